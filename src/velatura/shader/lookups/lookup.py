"""Textures of lobes over direction, as a shader reads them: their layout, and what every kind of them answers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model import Model
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid
from velatura.shader.recorder.seen import Seen
from velatura.shader.recorder.symbol import Symbol, number, operand
from velatura.shader.recorder.tape import Tape

Array = NDArray[np.floating]


class Group(NamedTuple):
    """Texels that are read together: how many, from which on."""

    name: str
    begin: int
    texels: int


@dataclass(frozen=True, kw_only=True)
class LookUp(ABC):
    """Lobes that are read from a texture over direction.

    A line of texels holds one of them for all cosines; lines go over azimuths, sides and texels. `nodes` are those over
    the cosine, and over the azimuth where lobes depend on it; `sides` is 1 where light comes from above only. `known`
    is the texture of known values, (height, nodes over the cosine, 4). `colours` of the remainders and `numbers` of the
    layout change with the values of a solved material.
    """

    nodes: tuple[int, ...]
    groups: Sequence[Group]
    sides: int
    known: Array | None = None
    colours: int = 0
    numbers: int = 0

    @property
    def tape(self) -> Tape | None:
        """The steps that compute the texture from the values of the material, where these are steps."""
        return None

    @property
    def height(self) -> int:
        """Lines of the texture."""
        return _texels(self.groups) * self.sides * prod(self.nodes[1:])

    @abstractmethod
    def seen(self, wi: Direction, weighed: bool) -> Seen:
        """The lobes as read for a recorded wi, with weights where they are `weighed`."""


def _texels(groups: Sequence[Group]) -> int:
    return sum(group.texels for group in groups)


def texture(columns: Iterable[tuple[int, Array]], groups: Sequence[Group], sides: int, nodes: tuple[int, ...]) -> Array:
    """The texture of groups, by columns (sides, nodes) and their places; a line of zeros without any."""
    if not groups:
        return np.zeros((1, 1, 4), np.float32)
    filled = np.zeros((4 * _texels(groups), sides, nodes[0], prod(nodes[1:])), np.float32)
    for place, column in columns:
        filled[place] = column.reshape(filled.shape[1:])
    return filled.reshape(-1, 4, *filled.shape[1:]).transpose(0, 2, 4, 3, 1).reshape(-1, nodes[0], 4)


def untextured(texels: Array, groups: Sequence[Group], sides: int, nodes: tuple[int, ...]) -> Array:
    """The columns in a texture of groups, (places, sides, nodes over the cosine, and over the azimuth)."""
    filled = texels.reshape(_texels(groups), sides, prod(nodes[1:]), nodes[0], 4)
    return filled.transpose(0, 4, 1, 3, 2).reshape(-1, sides, nodes[0], prod(nodes[1:]))


def stacked(textures: Sequence[Array]) -> Array | None:
    """Textures in one, each below the one before; None without any."""
    width = max((texels.shape[1] for texels in textures), default=0)
    padded = [np.pad(texels, ((0, 0), (0, width - texels.shape[1]), (0, 0))) for texels in textures]
    return np.concatenate(padded) if padded else None


def sides_read(sides: int, model: Model) -> tuple[Value, Value]:
    """The side of the texture that each side reads: where light is, but for the symmetric form, which looks at both."""
    if sides == 1:
        return 0.0, 0.0
    return (0.0, 1.0) if model.form == "symmetric" else (ops.select(number("wi.z") > 0, 0.0, 1.0),) * 2


@dataclass(frozen=True)
class Texels:
    """The columns of a group, over direction, on one side."""

    shape: tuple[int, ...]
    group: Group
    side: Value
    begin: int = 0

    def __call__(self, w: Direction) -> Iterable[Value]:
        at = [operand(x) for x in (*directional_grid.places(w, len(self.shape)), 0.0, self.side)]
        texels = Symbol("baked", (at[0], at[1], at[-1]), "texels", self.group)
        channels = range(self.begin, 4 * self.group.texels)
        return [Symbol("component", (texels,), "number", channel) for channel in channels]


def together(r: Value, g: Value, b: Value) -> Value:
    """The colour of three numbers."""
    return Symbol("colour", (r, g, b), "colour")
