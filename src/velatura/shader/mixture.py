"""A mixture as a program: the structs that hold those of its parts, and the share of each."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from velatura import ops
from velatura.ops import Value
from velatura.shader.lookups.films import FILM
from velatura.shader.material import member, place
from velatura.shader.part import PartCode
from velatura.shader.printers.printer import Field, Member, Struct
from velatura.shader.recorder.cost import Cost, cost
from velatura.shader.recorder.graph import Graph, renamed
from velatura.shader.recorder.symbol import Operand, Symbol, number, operand
from velatura.stack import Address, Described, Mix
from velatura.stack import number as plain
from velatura.stack.flat_names import prefix
from velatura.stack.mix import WEIGHT


@dataclass(frozen=True)
class Mixture:
    """The stacks of a mixture, with their shares; `own` are the first of each pattern, whose functions those of the
    same pattern use: of each part the number in `functions`; `weights` are the flat names of the weights that the code
    reads."""

    parts: Sequence[PartCode]
    own: Sequence[PartCode]
    functions: Sequence[int]
    members: Sequence[Member]
    weights: Sequence[str]

    @classmethod
    def of(cls, mix: Mix, parts: Sequence[PartCode], constant: Collection[str]) -> Mixture:
        first: dict[object, PartCode] = {}
        used = [first.setdefault(part.pattern, part) for part in parts]
        each = zip(parts, used, shares(mix, constant))
        members = [Member(part.member, other.prefix, share) for part, other, share in each]
        own, read = list(first.values()), [at.name for at, _ in weights(mix) if at.name not in constant]
        functions = [next(k for k, each in enumerate(own) if each is part) for part in used]
        return cls(parts, own, functions, members, read)

    @property
    def values(self) -> Struct:
        """The struct of all values, those of parts within; numbers come first, as in the struct of a layer's part."""
        own = [Field(name, "number") for name in self.weights]
        return Struct("VtMaterial", [*own, *self._each("VtMaterial")], "weights, and the values of each part")

    @property
    def lobes(self) -> Struct:
        """The struct of the shares and lobes of all parts."""
        shares = [Field(f"{name}_share", "number") for name, _, _ in self.members]
        return Struct("VtLobes", [*shares, *self._each("VtLobes")], "of light from one direction, with shares of parts")

    def _each(self, struct: str) -> Iterator[Field]:
        for name, functions, _ in self.members:
            (own,) = (part for part in self.own if part.prefix == functions)
            yield Field(name, own.named(struct))

    @property
    def costs(self) -> dict[str, Cost]:
        """The cost of each function, where every part has a share; a sample is that of the dearest."""
        each = [part.costs for part in self.parts]
        shared = cost([share for _, _, share in self.members], 0)
        added = {name: [costs[name] for costs in each] for name in each[0]}
        dearest = max(added.pop("vt_sample"), key=lambda own: (own.operations, own.texels))
        added["vt_lobes"].append(shared)
        summed = {
            name: Cost(sum(own.operations for own in costs), sum(own.texels for own in costs))
            for name, costs in added.items()
        }
        return {**summed, "vt_sample": dearest}


def shares(material: Described, constant: Collection[str]) -> list[Operand]:
    """The share of every stack, recorded from the weights that are not constant."""

    def weight(at: Address, value: object) -> object:
        return plain(at, value) if at.name in constant else number(f"m.{place(at)}")

    with ops.readable():
        found = material.shares({at.name: weight(at, value) for at, value in weights(material)})
    return Graph().unique(found)


def named_after(parts: tuple[int, ...], outputs: Sequence[Value]) -> list[Operand]:
    """The outputs of a stack with the names that its inputs, its tables of films and its lobes over direction have in
    a mixture."""
    own, within = prefix(parts), f"m.{member(parts)}."

    def name(symbol: Symbol) -> object:
        if symbol.op == "input":
            return re.sub(r"^m\.", within, symbol.detail)
        if symbol.op == FILM:
            return own + symbol.detail
        return symbol.detail._replace(name=own + symbol.detail.name) if symbol.op == "baked" else None

    return renamed(outputs, name) if parts else list(map(operand, outputs))


def weights(material: Described) -> Iterator[tuple[Address, object]]:
    """The weights of a mixture."""
    return ((at, value) for at, value in material.values() if at.declared is WEIGHT)
