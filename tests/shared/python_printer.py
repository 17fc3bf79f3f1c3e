"""A second language for shaders: Python on NumPy's arrays, which runs what is printed."""

from __future__ import annotations

import keyword
from collections.abc import Callable, Mapping, Sequence, Set
from types import SimpleNamespace
from typing import Any

import numpy as np

from velatura import ops
from velatura.shader import Printer
from velatura.shader.lookups.atlas import TableLayout
from velatura.shader.lookups.columns import SolvedContents, SolvedLookUp
from velatura.shader.lookups.lookup import Group, LookUp
from velatura.shader.material import Brushed, Entry, Filled, Mapped
from velatura.shader.printers.printer import ATOM, Member, Output, Struct
from velatura.shader.printers.statements import assignments, statements
from velatura.shader.recorder.cost import Cost
from velatura.shader.recorder.symbol import Kind, Operand, Symbol
from velatura.tables.store import Table

_COMPARE = {"less": "<", "greater": ">", "at_most": "<=", "at_least": ">="}
_ELEMENTS = {"x": 0, "y": 1, "z": 2, "r": 0}


class PythonPrinter(Printer):
    """Directions are three arrays (N,), colours arrays (3, N); it has no function for `clip`, and no single choice."""

    words = frozenset([*keyword.kwlist, "np", "list", "range"])
    functions = {op: f"vt_{op}" for op in ("mean", "sqrt")} | {
        op: f"np.{op}" for op in ("exp", "log", "sin", "cos", "absolute", "power", "arctan2", "minimum", "maximum")
    }
    operators = {  # noqa: RUF012
        **{op: (sign, 3) for op, sign in _COMPARE.items()},
        **{"add": ("+", 5), "subtract": ("-", 5), "multiply": ("*", 6), "divide": ("/", 6)},
        "both": ("&", 4),
    }

    # Values

    def input(self, place: str) -> str:
        rest, _, last = place.rpartition(".")
        return f"{rest}[{_ELEMENTS[last]}]" if last in _ELEMENTS else place

    def literal(self, x: Operand) -> str:
        assert not isinstance(x, Symbol)
        return self.colour(list(map(repr, x))) if isinstance(x, tuple) else repr(x)

    def colour(self, channels: Sequence[str]) -> str:
        return f"vt_colour({', '.join(channels)})"

    def component(self, x: str, channel: int, kind: Kind) -> str:
        return f"{x}[{channel}]"

    def each_channel(self, op: str, a: str, b: str) -> str:
        return f"(({a}) & ({b}))" if op == "both" else f"({a} {_COMPARE[op]} {b})"

    def select(self, condition: str, a: str, b: str) -> tuple[str, int]:
        return self.select_channels(condition, a, b), ATOM

    def select_channels(self, conditions: str, a: str, b: str) -> str:
        return f"np.where({conditions}, {a}, {b})"

    def value(self, table: str, args: Sequence[str], wide: bool) -> str:
        return f"vt_{table}({', '.join(args)})[0]"

    def film(self, table: str, args: Sequence[str]) -> str:
        return f"vt_{table}({', '.join(args)})"

    # Statements

    def title(self, text: str) -> str:
        return f"# {text}"

    def named(self, name: str, kind: Kind, text: str) -> str:
        return f"{name} = {text}"

    def texels(self, name: str, table: str, count: int, args: Sequence[str], where: str = "") -> list[str]:
        return [f"{name} = vt_{table}({', '.join(args)})"]

    def baked(self, name: str, group: Group, place: Sequence[str]) -> list[str]:
        return [f"{name} = vt_baked_{group.name}({', '.join(place)})"]

    def nodes(self, name: str, nodes: Sequence[float]) -> list[str]:
        return [f"{name} = {list(nodes)}"]

    def results(self, name: str, kind: Kind, count: int) -> list[str]:
        return [f"{name} = [None] * {count}"]

    def state(self, name: str, following: str, kind: Kind, begin: Sequence[str]) -> list[str]:
        return [f"{name} = [{', '.join(begin)}]", f"{following} = [None] * {len(begin)}"]

    def loop(self, index: str, times: int, lines: Sequence[str]) -> list[str]:
        return _block(f"for {index} in range({times})", lines)

    def store(self, array: str, place: str, text: str) -> str:
        return f"{array}[{place}] = {text}"

    def put(self, place: str, text: str) -> str:
        return f"{place} = {text}"

    def advance(self, name: str, following: str) -> str:
        return f"{name} = list({following})"

    # Programs

    def header(self, name: str, model: str, fixed: bool, costs: Mapping[str, Cost]) -> str:
        return f"# {name}, by the model {model}\n"

    def structs(self, structs: Sequence[Struct]) -> str:
        def member(name: str, kind: str, length: int) -> str:
            made = f"{kind}()" if kind.startswith("Vt") else "None"
            return f"self.{name} = {f'[{made} for _ in range({length})]' if length else made}"

        return "".join(
            _function(f"class {name}", _block("def __init__(self)", [member(*field) for field in fields]))
            for name, fields, _ in structs
        )

    def parameters(self, arrays: Sequence[tuple[str, str, int]]) -> str:
        return ""

    def material(self, filled: Filled) -> str:
        begin = "vt_parameters" if filled.parameters else "VtMaterial()"
        lines = [f"m.{entry.place} = {self._entry(entry)}" for entry in filled.entries]
        return _function("def vt_material(uv)", [f"m = {begin}", *lines, "return m"])

    def _entry(self, entry: Entry) -> str:
        value = entry.value
        if isinstance(value, Brushed):
            return f"np.degrees(np.arctan2(uv[1] - {value.v}, uv[0] - {value.u})) + {value.offset}"
        if isinstance(value, Mapped):
            channels = [f"{value.sampler}(uv)['rgba'.index({channel!r})]" for channel in value.channel]
            texel = self.colour(channels) if entry.wide else channels[0]
            return f"np.clip({texel} * {value.scale} + {value.offset}, {value.low}, {value.high})".replace(
                "inf", "np.inf"
            )
        return self.literal(value) if isinstance(value, tuple) or not entry.wide else self.colour([self.literal(value)])

    def tables(self, layouts: Sequence[TableLayout]) -> str:
        return "".join(
            f"vt_{x.name} = lambda *place: vt_looked_up(vt_tables, {x.start}, {x.nodes}, {x.channels}, place)\n"
            for x in layouts
        )

    def baked_texture(self, width: int, height: int) -> str:
        return ""

    def lookup(self, bake: LookUp, first: int) -> str:
        read = f"vt_baked[{first}:{first + bake.height}, :{bake.nodes[0]}], {bake.nodes}, {bake.sides}"
        return "".join(
            f"vt_baked_{x.name} = lambda *place: vt_read({read}, {tuple(x[1:])}, place)\n" for x in bake.groups
        )

    def films(self, layouts: Sequence[TableLayout]) -> str:
        return "".join(
            f"vt_{x.name} = lambda *place: vt_filmed(vt_films, {x.start}, {x.nodes}, place)\n" for x in layouts
        )

    def helpers(self, called: Set[tuple[str, Kind]]) -> str:
        return ""

    def lobes(self, outputs: Mapping[str, Output]) -> str:
        lines = assignments({f"l.{name}": output for name, output in outputs.items()}, self)
        return _function("def vt_lobes(m, wi)", ["l = VtLobes()", *lines, "return l"])

    def energies(self, found: Sequence[Output]) -> str:
        return self._returned("def vt_energies(m, wi)", found)

    def eval_pdf(self, value: Output, density: Output) -> str:
        return self._returned("def vt_eval_pdf(m, l, wi, wo)", [value, density])

    def sample(self, drawn: Sequence[Output]) -> str:
        return self._returned("def vt_sample(m, l, wi, u)", drawn)

    def mixture(self, members: Sequence[Member]) -> str:
        shares = assignments({f"l.{name}_share": (share, "number") for name, _, share in members}, self)
        lobes = [f"l.{name} = vt_{own}lobes(m.{name}, wi)" for name, own, _ in members]
        values = ", ".join(
            f"(l.{name}_share, vt_{own}eval_pdf(m.{name}, l.{name}, wi, wo))" for name, own, _ in members
        )
        drawn = ", ".join(
            f"(l.{name}_share, lambda u: vt_{own}sample(m.{name}, l.{name}, wi, u))" for name, own, _ in members
        )
        return "".join(
            [
                _function("def vt_lobes(m, wi)", ["l = VtLobes()", *shares, *lobes, "return l"]),
                _function("def vt_eval_pdf(m, l, wi, wo)", [f"return vt_weighted({values})"]),
                _function("def vt_sample(m, l, wi, u)", [f"return vt_chosen(u, {drawn})"]),
            ]
        )

    def _returned(self, head: str, outputs: Sequence[Output]) -> str:
        lines, texts = statements(outputs, self)
        return _function(head, [*lines, f"return {', '.join(texts)}"])


def run(text: str, **given: Any) -> SimpleNamespace:
    """The functions of a program that was printed; textures and parameters are `given` by name."""
    names = {
        "np": np,
        "vt_colour": _colour,
        "vt_mean": _mean,
        "vt_sqrt": _sqrt,
        "vt_weighted": _weighted,
        "vt_chosen": _chosen,
    }
    program: dict[str, Any] = {**names, "vt_looked_up": _looked_up, "vt_read": _read, "vt_filmed": _filmed, **given}
    exec(compile(text, "<printed>", "exec"), program)
    return SimpleNamespace(**program)


def put(target: Any, place: str, value: Any) -> None:
    """Set a value by its place in a struct."""
    *path, last = place.split(".")
    for part in path:
        target = getattr(target, part)
    setattr(target, last, value)


def reader(baked: SolvedLookUp, found: SolvedContents | None = None) -> Callable[[Group, Sequence[Any]], Any]:
    """A function that reads a group of texels of a solved material at a place."""
    solved = found or baked.solved
    assert solved is not None
    texture = solved.texels.astype(float)
    return lambda group, place: _read(texture, baked.nodes, baked.sides, (group.begin, group.texels), place)


def _block(head: str, lines: Sequence[str]) -> list[str]:
    return [f"{head}:", *(f"    {line}".rstrip() for line in lines)]


def _function(head: str, lines: Sequence[str]) -> str:
    return "\n".join([*_block(head, lines), "", ""])


def _colour(*channels: Any) -> np.ndarray:
    return np.stack(np.broadcast_arrays(*map(np.atleast_1d, channels * (1 if len(channels) > 1 else 3))))


def _mean(x: np.ndarray) -> np.ndarray:
    return (x[0] + x[1] + x[2]) / 3


def _sqrt(x: Any) -> Any:
    return np.sqrt(np.maximum(x, 0))


def _weighted(*parts: Any) -> tuple[Any, Any]:
    """Value and density of parts, weighted by their shares."""
    return sum(share * value for share, (value, _) in parts), sum(share * density for share, (_, density) in parts)


def _chosen(u: np.ndarray, *parts: Any) -> np.ndarray:
    """Directions of the part that the first number chooses, which is rescaled."""
    begin, found = np.zeros_like(u[0]), np.zeros_like(u)
    for share, sample in parts:
        drawn = sample(np.stack([np.clip((u[0] - begin) / share, 0, 1), *u[1:]]))
        found, begin = np.where(u[0] >= begin, np.stack(np.broadcast_arrays(*drawn)), found), begin + share
    return found


def _looked_up(texture: np.ndarray, start: int, nodes: tuple[int, ...], channels: int, place: Sequence[Any]) -> Any:
    """All channels of a table, found in the texture where its layout says."""
    width = channels if channels == 1 else -(-channels // 4) * 4
    data = texture.reshape(-1)[4 * start :][: int(np.prod(nodes)) * width].reshape(*nodes, width)
    return ops.interpolate(Table(data), *place)


def _filmed(texture: np.ndarray, start: int, nodes: tuple[int, ...], place: Sequence[Any]) -> np.ndarray:
    """A table of films, found in their texture where its layout says."""
    data = texture.reshape(-1, 4)[start:][: int(np.prod(nodes)), :3].reshape(*nodes, 3)
    return _colour(*ops.interpolate(Table(data), *place))


def _read(texture: np.ndarray, nodes: tuple[int, ...], sides: int, group: tuple[int, int], place: Sequence[Any]) -> Any:
    """All channels of a group of texels, found in the texture of lobes: lines over azimuths, sides and texels."""
    (begin, count), (x, y, side) = group, place
    lines = texture.reshape(-1, sides, *nodes[::-1], 4)[begin : begin + count]
    data = np.moveaxis(lines, (0, -2), (-2, 1))  # side, cosine, azimuth, texel, channel
    at = (x, y)[: len(nodes)]
    seen = [ops.interpolate(Table(one.reshape(*nodes, -1)), *at) for one in data]
    return seen[0] if sides == 1 else [np.where(np.asarray(side) > 0.5, below, above) for above, below in zip(*seen)]
