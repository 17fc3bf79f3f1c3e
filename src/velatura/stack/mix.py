"""A mixture of materials, each of which covers a share of a surface: worn paint, dust, metalness between 0 and 1."""

from __future__ import annotations

import contextlib
import dataclasses
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from pydantic import model_validator

from velatura.errors import InvalidInput, within
from velatura.stack import cross_section
from velatura.stack.flat_names import Address
from velatura.stack.flat_names import addressed as in_a_stack
from velatura.stack.layers import Value
from velatura.stack.schema import Parameter, Record, Taken, by_default, unknown
from velatura.stack.stack import Stack
from velatura.stack.values import Scalar, ScalarLike, Text, Texture, Written

DEEPEST = 4  # mixtures within each other
MOST = 16  # stacks of a mixture, those of its mixtures included
ROUNDING = 1e-6  # by which the sum of all weights may differ from 1

WEIGHT = Scalar("share of the surface; the last part has what the others leave", low=0, high=1, typical=0.0)

#: A weight and a material.
Share: TypeAlias = "tuple[ScalarLike | None, Stack | Mix | str | Path | Written]"

_PART = re.compile(rf"(?!(?:part\d+_){{{DEEPEST + 1}}})part(\d{{1,4}})_(\w+)")  # not deeper than mixtures are


class MaterialRecord(Parameter):
    """A stack or a mixture: one of either, the keys of one, a file, or the name of a preset."""

    what = "a material: its keys, a file, or the name of a preset"

    def check(self, value: Any) -> Described:
        if not isinstance(value, Stack | Mix | Mapping | str | Path):
            raise self.refuse(value)
        found: Described = import_module("velatura.stack.io").load(value)  # which reads mixtures itself
        return found

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [{"$ref": "#/$defs/stack"}, {"$ref": "#/$defs/mixture"}, {"type": "string"}]}


class Part(Record):
    """A part of a mixture: its share of the surface, None for what the others leave, and its material.

    On an object with a part of the name `covers`, it has the whole of that part (`Mix.covering`).
    """

    holds = "weight, material and covers"

    weight: Annotated[Taken[ScalarLike | None, float | Texture | None], WEIGHT] = by_default(None)
    material: Annotated[
        Taken[Stack | Mix | str | Path | Written, Stack | Mix], MaterialRecord("what covers this share")
    ]
    covers: Annotated[str, Text("part of an object, by name, that it has the whole of")] = ""


class Parts(Parameter):
    """The parts of a mixture."""

    what = "a list of parts"

    def check(self, value: Any) -> tuple[Part, ...]:
        if isinstance(value, str | Mapping) or not isinstance(value, Iterable):
            raise self.refuse(value)
        with _one_deeper():
            parts = tuple(_part(index, entry) for index, entry in enumerate(value))
        return _with_rest(parts)

    def json_schema(self) -> dict[str, Any]:
        return {"type": "array", "minItems": 1, "maxItems": MOST, "items": {"$ref": "#/$defs/part"}}


class Mix(Record):
    """Materials side by side, each on a share of every spot of a surface, frozen and validated.

    The last weight is always left out, and is then what the others leave, at least 0.

    Args:
        mix: pairs (weight, material), `Part` models, or mappings as a file holds them. A weight is a number, a texture,
            or for the last part None; a material is a stack, a mixture, a file, or the name of a preset.
        name, source: the keys of a file.

    Raises:
        InvalidInput: in one line that names part, layer, key and allowed range.
    """

    holds = "the keys of a mixture, mix above all"

    name: Annotated[str, Text("name of the material")] = ""
    source: Annotated[str, Text("where the numbers come from", lines=True)] = ""
    mix: Annotated[tuple[Part, ...], Parts("the parts, side by side")]

    def __init__(self, /, mix: Iterable[Part | Share | Written] = (), **options: Any) -> None:
        super().__init__(mix=mix, **options)

    @model_validator(mode="after")
    def _parts_fit_together(self) -> Mix:
        leaves = list(self.leaves())
        if not leaves:
            raise ValueError("mix: must hold at least one part")
        if len(leaves) > MOST:
            raise ValueError(f"mix: must hold at most {MOST} stacks, got {len(leaves)}")
        if max(len(path) for path, _ in leaves) > DEEPEST:
            raise ValueError(_too_deep())
        first = leaves[0][1].exterior
        for path, stack in leaves:
            if stack.exterior != first:
                what = f"must be that of all parts, {first:g}, got {stack.exterior:g}"
                raise ValueError(f"part {path[0]}: exterior: {what}")
        return self

    # Contents -----------------------------------------------------------------------------------------------------

    def leaves(self) -> Iterator[tuple[tuple[int, ...], Stack]]:
        """The stacks, those of mixtures within included, each with the numbers of the parts that it is in."""
        for index, part in enumerate(self.mix):
            for path, stack in part.material.leaves():
                yield (index, *path), stack

    def shares(self, weights: Mapping[str, Any]) -> list[Any]:
        """The share of every stack, by the values of all weights by flat name, in any dialect.

        Weights whose sum exceeds 1 are divided by it.
        """
        from velatura.ops import divide, maximum  # loads NumPy, which files do not need

        own = [weights[f"part{index}_weight"] for index in range(len(self.mix) - 1)]
        if len(own) > 1:
            most = maximum(sum(own), 1.0)
            own = [divide(weight, most) for weight in own]
        found: list[Any] = []
        for index, (part, share) in enumerate(zip(self.mix, [*own, 1.0 - sum(own)])):
            within_part = {name: value for number, name, value in _by_part(weights) if number == index}
            found += [share * other for other in part.material.shares(within_part)]
        return found

    def weighted(self, refusal: str) -> list[tuple[float, Stack]]:
        """The stacks with their shares as numbers.

        Raises:
            InvalidInput: a weight is a texture; `refusal` ends the message.
        """
        weights = {at.name: at.plain(value, refusal) for at, value in self.values() if at.declared is WEIGHT}
        return [(share, stack) for share, (_, stack) in zip(self.shares(weights), self.leaves())]

    def covering(self, name: str) -> Stack | Mix:
        """The material of a part of an object, by its name: that of the part that covers it, else of the last; the
        mixture where no part covers any, or for no name."""
        if not name or not any(part.covers for part in self.mix):
            return self
        found = [part for part in self.mix if part.covers == name]
        return (found or self.mix[-1:])[0].material

    def each(self, change: Callable[[tuple[int, ...], Stack], Stack]) -> Mix:
        """The mixture with every stack changed, by the numbers of the parts that it is in."""
        parts = []
        for index, part in enumerate(self.mix):
            material = part.material.each(lambda path, stack: change((index, *path), stack))  # noqa: B023 (called here)
            parts.append(part.model_copy(update={"material": material}))
        return Mix(parts, name=self.name, source=self.source)

    def turned(self, degrees: float) -> Mix | None:
        """All parts turned, as `Stack.turned`."""
        parts = []
        for part in self.mix:
            material = part.material.turned(degrees)
            if material is None:
                return None
            parts.append(part.model_copy(update={"material": material}))
        return Mix(parts, name=self.name)

    # As it is shown --------------------------------------------------------------------------------------------------

    def __str__(self) -> str:
        return cross_section.text(self)

    def _repr_html_(self) -> str:
        return cross_section.svg(self)

    # As a file holds it ----------------------------------------------------------------------------------------------

    def values(self) -> Iterator[tuple[Address, Value]]:
        """Every weight but the last, and every value of every part."""
        for index, part in enumerate(self.mix):
            if part.weight is not None:
                yield Address(None, "weight", WEIGHT, (index,)), part.weight
            for address, value in part.material.values():
                yield dataclasses.replace(address, parts=(index, *address.parts)), value

    # As flat names ---------------------------------------------------------------------------------------------------

    def flat(self) -> dict[str, Value]:
        """Every value under its flat name, `part0_weight`, `part0_layer0_eta`, `part1_part0_layer2_depth`, ..."""
        return {address.name: value for address, value in self.values()}

    def replace(self, /, **values: Any) -> Mix:
        """This mixture with some flat values changed: `mix.replace(part0_weight=0.2, part1_layer0_alpha=0.3)`.

        Takes the names of `Stack.replace` for each part, and `name`, `source`.

        Raises:
            InvalidInput: a name that this mixture does not have, or a value outside its range.
        """
        options = {name: value for name, value in values.items() if name in ("name", "source")}
        parts = list(self.mix)
        changes: dict[int, dict[str, Any]] = {}
        for name in values.keys() - options.keys():
            if not _PART.fullmatch(name):
                raise InvalidInput(unknown("parameter", name, ("name", "source", *self.flat())))
        for number, name, value in _by_part(values):
            changes.setdefault(number, {})[name] = value
        for number, change in changes.items():
            if number >= len(parts):
                raise InvalidInput(f"part{number}_{next(iter(change))}: the last part is part {len(parts) - 1}")
            with within(f"part {number}"):
                parts[number] = _changed(parts[number], change, number == len(parts) - 1)
        return Mix(parts, **{"name": self.name, "source": self.source, **options})

    @classmethod
    def from_flat(cls, values: Mapping[str, Any]) -> Mix:
        """The mixture with the given flat values; other values take their defaults.

        Raises:
            InvalidInput: an unknown name, or a value that a file might not hold either.
        """
        options = {name: value for name, value in values.items() if not _PART.fullmatch(name)}
        parts: dict[int, dict[str, Any]] = {}
        for number, name, value in _by_part(values):
            parts.setdefault(number, {})[name] = value
        entries = []
        for number in range(len(parts)):
            if number not in parts:
                raise InvalidInput(f"part {number}: no value is given, but there are values of part {max(parts)}")
            with within(f"part {number}"):
                own = {name: parts[number].pop(name) for name in ("weight",) if name in parts[number]}
                entries.append({**own, "material": from_flat(parts[number])})
        return cls.from_dict({**options, "mix": entries})


#: What a material file holds, and all that a material may be.
Described: TypeAlias = Stack | Mix

Part.model_rebuild()


def from_dict(fields: Any) -> Described:
    """The stack or the mixture of a mapping as a file holds it.

    Raises:
        InvalidInput: it is none, in one line.
    """
    return Mix.from_dict(fields) if isinstance(fields, Mapping) and "mix" in fields else Stack.from_dict(fields)


def from_flat(values: Mapping[str, Any]) -> Described:
    """The stack or the mixture with the given flat values.

    Raises:
        InvalidInput: an unknown name, or a value that a file might not hold either.
    """
    return Mix.from_flat(values) if any(map(_PART.fullmatch, values)) else Stack.from_flat(None, values)


def addressed(name: str) -> tuple[Address, ...]:
    """The values that a flat name stands for, two for `layer0_alpha`; none for a name of anything else."""
    found = _PART.fullmatch(name)
    if not found:
        return in_a_stack(name)
    number, name = int(found[1]), found[2]
    own = (Address(None, name, WEIGHT),) if name == "weight" else addressed(name)
    return tuple(dataclasses.replace(address, parts=(number, *address.parts)) for address in own)


def _by_part(values: Mapping[str, Any]) -> Iterator[tuple[int, str, Any]]:
    """The numbers of parts, and the names and values within them."""
    for name, value in values.items():
        found = _PART.fullmatch(name)
        if found:
            yield int(found[1]), found[2], value


def _part(index: int, entry: Any) -> Part:
    if isinstance(entry, Part):
        return entry
    with within(f"part {index}"):
        if isinstance(entry, tuple | list) and len(entry) == 2:
            weight, material = entry
            return Part(material=material) if weight is None else Part(weight=weight, material=material)
        return Part.from_dict(entry)


def _changed(part: Part, change: dict[str, Any], last: bool) -> Part:
    """A part with a weight and flat values of its material changed."""
    weight = change.pop("weight", None)
    if last and weight is not None:
        raise InvalidInput("weight: is what the other parts leave; change theirs")
    material = part.material.replace(**change) if change else part.material
    weight = part.weight if weight is None else weight
    own = {} if weight is None else {"weight": weight}
    return Part(**own, material=material, covers=part.covers)


def _with_rest(parts: Sequence[Part]) -> tuple[Part, ...]:
    """The parts without the last weight, which the others determine."""
    for index, part in enumerate(parts[:-1]):
        if part.weight is None:
            raise ValueError(f"part {index}: weight: missing, which only the last part may leave out")
    given = [part.weight for part in parts if part.weight is not None]
    total = sum(weight for weight in given if isinstance(weight, float))
    if total > 1 + ROUNDING:
        raise ValueError(f"weights must sum to 1 at most, got {total:g}")
    if not parts or parts[-1].weight is None:
        return tuple(parts)
    last = f"part {len(parts) - 1}: weight"
    if any(isinstance(weight, Texture) for weight in given):
        raise ValueError(f"{last}: must be left out beside textures, since it is what these leave")
    if total < 1 - ROUNDING:
        raise ValueError(f"weights must sum to 1, got {total:g}; or leave out the last one")
    return (*parts[:-1], parts[-1].model_copy(update={"weight": None}))


_depth: ContextVar[int] = ContextVar("depth", default=0)


@contextlib.contextmanager
def _one_deeper() -> Iterator[None]:
    """Counts mixtures within each other while they are read, so that none is read within itself without end."""
    token = _depth.set(_depth.get() + 1)
    try:
        if _depth.get() > DEEPEST:
            raise ValueError(_too_deep())
        yield
    finally:
        _depth.reset(token)


def _too_deep() -> str:
    return f"holds mixtures more than {DEEPEST} deep, or itself"
