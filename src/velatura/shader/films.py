"""Thin films in a shader: the reflectance of each interface that has any, a line of a texture over the cosine.

Where a user changes values, code knows none of the films but that there are some; else those that are read at
constant cosines are numbers in the code.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value
from velatura.sampling import coated
from velatura.sampling.coated import NODES, Coated
from velatura.shader.symbol import Symbol, operand
from velatura.stack import Address, InterfaceValues, Material, Stack, Varying, number

Array = NDArray[np.floating]

FILM = "film"  # an operation: a line of the texture, looked up at a cosine


class Read(Coated):
    """Films that code reads in a line of the texture.

    `from_above` is whether the medium above is the rarer one, a condition where values change; then there are no data.
    """

    known = False  # the texture may change

    def __init__(self, line: int, from_above: Value, data: Array | None) -> None:
        super().__init__(np.empty((0, 0)) if data is None else data, 1)
        self.line, self.from_above = line, from_above

    def reversed(self) -> Read:
        """As seen from below."""
        return Read(self.line, ops.select(self.from_above, False, True), self.data if self.data.size else None)

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        return self.at(ops.select(self.from_above, cos_1, cos_2), like)

    def at(self, cosine: Value, like: Value) -> Value:
        if self.data.size and not isinstance(cosine, Symbol):
            return np.stack(ops.interpolate(self, float(cosine)))
        return Symbol(FILM, (operand(cosine),), "colour", self.line)


def recorded(material: Material, stack: Stack, general: bool) -> Material:
    """A material of a stack whose films are read, of any values in `general`."""
    lines = iter(range(len(material.layers)))
    above, layers = material.exterior, material.layers
    for n, (layer, known) in enumerate(zip(layers, _of(stack))):
        if not isinstance(layer, InterfaceValues):
            continue
        if known:
            from_above: Value = known.rarer == 1
            if general and known.n12 is not None:
                below = material.exterior if material.thin and layer is layers[-1] else layer.eta
                from_above = ops.mean(above) < ops.mean(below)
            read: Any = Read(next(lines), from_above, None if general else known.data)
            material = material.with_layer(n, coating=read)
        elif layer.films:
            material = material.with_layer(n, films=())
        above = layer.eta
    return material


def beside(stack: Stack) -> set[str]:
    """Flat names of the indices that the films of a stack are worked out from."""
    found, above = set[str](), "exterior"
    for n, films in enumerate(_of(stack)):
        if films:
            found |= {above, f"layer{n}_eta", *([f"layer{n}_k"] if films.n12 is None else [])}
        above = f"layer{n}_eta" if n in stack.surfaces else above
    return found | ({"exterior"} if found and stack.thin else set())


def _of(stack: Stack) -> list[Coated | None]:
    """The films on each layer. Other values may come from textures."""

    def value(address: Address, described: Any) -> Value:
        return 0.0 if isinstance(described, Varying) and address.film is None else number(address, described)

    return coated.of(Material.of(stack, value))


def texture(stack: Stack) -> Array | None:
    """The films of a stack as a texture, float32 of shape (interfaces with films, NODES, 4); None without any."""
    lines: Sequence[Array] = [films.data for films in _of(stack) if films]
    return np.pad(np.array(lines, np.float32), ((0, 0), (0, 0), (0, 1))) if lines else None


__all__ = ["FILM", "NODES", "Read", "beside", "recorded", "texture"]
