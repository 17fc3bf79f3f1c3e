"""The third dialect of `velatura.ops`: values that record their operations.

A `Symbol` is a node of an expression: an input, or an operation on other symbols and constants. The functions of the
model run on symbols as they run on arrays. Values independent of inputs are computed in Python, so constants fold by
themselves: constants are floats, or NumPy arrays of three channels.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextvars import ContextVar
from itertools import count
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from velatura import ops, tables
from velatura.ops import Unrolled, Value

Kind: TypeAlias = Literal["number", "colour", "condition", "conditions", "texels", "loop"]
Operand: TypeAlias = "Symbol | float | bool | tuple[float, ...]"

SHOWN = "vt_shown"  # in the code: the weights of lobes
REMAINDER = "vt_remainder"  # the colours of the remainders of both sides, where they change
LAYOUT = "vt_layout"  # and which interfaces shape the light that passes

_serials = count()
_depth: ContextVar[int] = ContextVar("depth", default=0)  # of loops that are being recorded
_CONDITIONS = {"less", "greater", "at_most", "at_least", "both"}


def _operator(op: str) -> tuple[Callable[[Any, Value], Value], Callable[[Any, Value], Value]]:
    """Methods of a binary operator, for the recorded value on the left and on the right."""
    return lambda a, b: record(op, a, b), lambda a, b: record(op, b, a)


class Symbol:
    """A recorded value.

    Args:
        op: the operation: an elementary function by its name in `ops`, an operator (`add`, `less`, ...), or `input`,
            `texels`, `value`, `film`, `component`, `colour`; of loops `bound`, which stands for a node or for a value
            of the state, `each`, `repeat`, and `item`.
        args: its arguments; constants as floats, or as three of them; of a loop its results, which are made of the
            bound symbols, and before them the initial state.
        kind: number, colour, the truth of either, the channels of a table, or a loop.
        detail: name of an input, a table or a bound symbol, number of a component or item, the `Loop`.

    Attributes:
        serial: numbers symbols in the order in which they were made.
        title: of the block of the model that made it.
        name: that the model gives it; "" for none.
    """

    __slots__ = ("args", "detail", "kind", "name", "op", "serial", "title")
    __array_ufunc__ = None  # so that NumPy leaves the arithmetic to this class

    dialect: Any

    def __init__(self, op: str, args: tuple[Operand, ...], kind: Kind, detail: Any = None) -> None:
        self.op, self.args, self.kind, self.detail = op, args, kind, detail
        self.serial, self.title, self.name = next(_serials), ops.title(), ""

    def with_args(self, args: tuple[Operand, ...], detail: Any = None) -> Symbol:
        """The same operation, made in the same block, on other arguments, and with another detail if given."""
        other = object.__new__(Symbol)
        other.op, other.args, other.kind, other.detail = self.op, args, self.kind, detail or self.detail
        other.serial, other.title, other.name = self.serial, self.title, self.name
        return other

    __add__, __radd__ = _operator("add")
    __sub__, __rsub__ = _operator("subtract")
    __mul__, __rmul__ = _operator("multiply")
    __truediv__, __rtruediv__ = _operator("divide")
    __and__, __rand__ = _operator("both")
    __lt__, _ = _operator("less")
    __gt__, _ = _operator("greater")
    __le__, _ = _operator("at_most")
    __ge__, _ = _operator("at_least")

    def __neg__(self) -> Value:
        return record("negative", self)

    def __bool__(self) -> bool:
        raise TypeError("a recorded value is neither true nor false: use ops.select")


def number(name: str) -> Symbol:
    """An input that is a number; `name` as the shader has it."""
    return Symbol("input", (), "number", name)


def colour(name: str) -> Symbol:
    """An input that is a colour."""
    return Symbol("input", (), "colour", name)


def operand(x: Value) -> Operand:
    """A value as an argument of a symbol."""
    if isinstance(x, Symbol):
        return x
    array = np.asarray(x)
    if array.ndim:
        return tuple(float(channel) for channel in array.ravel())
    return bool(array) if array.dtype == bool else float(array)


def is_colour(x: Operand) -> bool:
    return x.kind in ("colour", "conditions") if isinstance(x, Symbol) else isinstance(x, tuple)


def _is_condition(x: Operand) -> bool:
    return x.kind == "condition" if isinstance(x, Symbol) else isinstance(x, bool)


def component(x: Operand, channel: int) -> Operand:
    """One channel of a colour; a number is the same in all channels."""
    if isinstance(x, tuple):
        return x[channel]
    if not isinstance(x, Symbol) or not is_colour(x):
        return x
    if x.op == "colour":
        return x.args[channel]
    return Symbol("component", (x,), "number" if x.kind == "colour" else "condition", channel)


def record(op: str, *values: Value) -> Value:
    """The symbol of an operation, or its result if that is known."""
    args = tuple(operand(x) for x in values)
    known = _known(op, args)
    if known is not None:
        return known
    wide = any(is_colour(x) for x in args)
    if op in _CONDITIONS:
        return Symbol(op, args, "conditions" if wide else "condition")
    return Symbol(op, args, "colour" if wide else "number")


def _known(op: str, args: tuple[Operand, ...]) -> Value | None:
    """The result of an operation with a neutral element, else None."""
    a, b = (*args, None)[:2]
    neutral = {
        "add": a if b == 0.0 else b if a == 0.0 else None,
        "subtract": a if b == 0.0 else None,
        "multiply": a if b == 1.0 else b if a == 1.0 else 0.0 if 0.0 in (a, b) else None,
        "divide": a if b == 1.0 else 0.0 if a == 0.0 else None,
        "both": (b if a else False) if isinstance(a, bool) else (a if b else False) if isinstance(b, bool) else None,
    }
    found = neutral.get(op)
    return np.array(found) if isinstance(found, tuple) else found


class Loop(NamedTuple):
    """The names bound in a loop, and the nodes that it runs over, or how many times it runs."""

    bound: tuple[str, ...]
    nodes: tuple[float, ...]
    times: int


class Recorder(Unrolled):
    """The elementary functions on symbols; loops are kept in readable code, and unrolled elsewhere."""

    @staticmethod
    def name(x: Symbol, name: str) -> None:
        x.name = x.name or name

    def __getattr__(self, op: str) -> Callable[..., Value]:
        if op.startswith("_"):
            raise AttributeError(op)
        return lambda *args: record(op, *args)

    def cos(self, x: Symbol) -> Value:
        return record("cos", x.args[0] if x.op == "negative" else x)

    def sin(self, x: Symbol) -> Value:
        return -record("sin", x.args[0]) if x.op == "negative" else record("sin", x)

    def select(self, condition: Value, a: Value, b: Value) -> Value:
        asked, chosen, other = operand(condition), operand(a), operand(b)
        if isinstance(asked, tuple):
            channels = [component(chosen if asked[c] else other, c) for c in range(3)]
            return channels[0] if channels == [channels[0]] * 3 else Symbol("colour", tuple(channels), "colour")
        if not isinstance(asked, Symbol):
            return a if asked else b
        if chosen is other or (not isinstance(chosen, Symbol) and chosen == other):
            return a
        kind: Kind = "condition" if _is_condition(chosen) and _is_condition(other) else "number"
        wide = any(is_colour(x) for x in (asked, chosen, other))
        return Symbol("select", (asked, chosen, other), "colour" if wide else kind)

    def mean(self, x: Symbol) -> Value:
        return Symbol("mean", (x,), "number") if is_colour(x) else x

    def interpolate(self, table: tables.Table, coordinates: Sequence[Value]) -> list[Value]:
        args = tuple(operand(x) for x in coordinates)
        wide = any(is_colour(x) for x in args)
        name = next(name for name, known in tables.load().items() if known is table)
        channels = table.data.shape[-1]
        if channels == 1:
            return [Symbol("value", args, "colour" if wide else "number", name)]
        if wide:
            each = (self.interpolate(table, [component(x, c) for x in args]) for c in range(3))
            return [Symbol("colour", channels, "colour") for channels in zip(*each)]
        texels = Symbol("texels", args, "texels", name)
        return [Symbol("component", (texels,), "number", c) for c in range(channels)]

    def each(self, function: Callable[..., Value], nodes: Sequence[float], values: Sequence[Value]) -> list[Value]:
        if not ops.is_readable():
            return super().each(function, nodes, values)
        node = Symbol("bound", (), "number", f"node{_depth.get()}")
        made = _within(function, node, *values)
        results = tuple(operand(x) for x in (made if isinstance(made, list) else [made]))
        loop = Symbol("each", results, "loop", Loop((node.detail,), tuple(nodes), len(nodes)))
        loop.name = "at_nodes"
        items = [_items(loop, results, k * len(results)) for k in range(len(nodes))]
        return items if isinstance(made, list) else [item for (item,) in items]

    def repeat(self, function: Callable[..., Sequence[Value]], times: int, state: Sequence[Value]) -> Sequence[Value]:
        if not ops.is_readable():
            return super().repeat(function, times, state)
        bound = [Symbol("bound", (), "colour", f"state{_depth.get()}[{k}]") for k in range(len(state))]
        results = tuple(operand(x) for x in _within(function, *bound))
        begin = tuple(operand(x) for x in state)
        loop = Symbol("repeat", (*begin, *results), "loop", Loop(tuple(x.detail for x in bound), (), times))
        loop.name = "state"
        return [Symbol("item", (loop,), "colour", k) for k in range(len(state))]


def _within(function: Callable[..., Value], *args: Value) -> Value:
    """The result of a function called inside a loop."""
    outside = _depth.set(_depth.get() + 1)
    try:
        return function(*args)
    finally:
        _depth.reset(outside)


def _items(loop: Symbol, results: Sequence[Operand], first: int) -> list[Symbol]:
    kind: Kind = "colour" if any(is_colour(x) for x in results) else "number"
    return [Symbol("item", (loop,), kind, first + k) for k in range(len(results))]


Symbol.dialect = Recorder()


def in_order(outputs: Sequence[Value], given: Collection[Symbol] = ()) -> list[Symbol]:
    """All symbols that the outputs are made of, inputs first, arguments before their results; none that only what is
    `given` is made of."""
    found: set[Symbol] = set()
    waiting = [x for x in outputs if isinstance(x, Symbol)]
    while waiting:
        symbol = waiting.pop()
        if symbol not in found:
            found.add(symbol)
            waiting.extend(x for x in symbol.args if isinstance(x, Symbol) and symbol not in given)
    return sorted(found, key=lambda symbol: (symbol.op != "input", symbol.serial))


def inside(order: Sequence[Symbol]) -> dict[Symbol, frozenset[str]]:
    """The bound symbols of the loops around it that each symbol depends on."""
    found: dict[Symbol, frozenset[str]] = {}
    for symbol in order:
        own = {symbol.detail} if symbol.op == "bound" else set()
        inner = own.union(*(found[x] for x in symbol.args if x in found))
        found[symbol] = frozenset(inner.difference(symbol.detail.bound) if symbol.kind == "loop" else inner)
    return found
