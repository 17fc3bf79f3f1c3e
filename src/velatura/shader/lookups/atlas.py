"""The tables that a shader reads, as one texture of floats."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from velatura import tables
from velatura.tables import Table

WIDTH = 1024  # texels


class TableLayout(NamedTuple):
    """Where a table lies: its first texel, and its nodes along each axis, those along the last beside one another.

    A node has as many texels as hold its channels; the nodes of a table with a single channel share texels.
    """

    name: str
    start: int
    nodes: tuple[int, ...]
    channels: int

    @property
    def texels(self) -> int:
        """How many texels a node takes, if it has more than one channel."""
        return -(-self.channels // 4)

    @property
    def end(self) -> int:
        """The texel after the last."""
        count = math.prod(self.nodes)
        return self.start + (count * self.texels if self.channels > 1 else -(-count // 4))


def every() -> list[str]:
    """The tables that shaders may look up, which have up to three axes."""
    return [name for name, table in tables.load().items() if len(table.shape) <= 3]


def layouts(names: Collection[str], among: Collection[str] | None = None) -> list[TableLayout]:
    """Where each of the tables named lies in their texture, which may hold others."""
    found: list[TableLayout] = []
    start = 0
    for name, table in tables.load().items():
        if name in (names if among is None else among):
            found.append(TableLayout(name, start, table.shape, table.data.shape[-1]))
            start = found[-1].end
    return [layout for layout in found if layout.name in names]


def texture(names: Collection[str]) -> np.ndarray:
    """The texture of the tables named, float32 of shape (height, WIDTH, 4); a line of zeros for none."""
    placed = layouts(names)
    height = -(-placed[-1].end // WIDTH) if placed else 1
    filled = np.zeros((height * WIDTH, 4), np.float32)
    for layout in placed:
        filled[layout.start : layout.end] = texels_of(layout.name)
    return filled.reshape(-1, WIDTH, 4)


def texels(name: str) -> int:
    """How many texels a node of a table takes, if it has more than one channel."""
    (layout,) = layouts([name])
    return layout.texels


def texels_of(name: str) -> np.ndarray:
    """The texels of a table, (count, 4): nodes in order of their axes, channels filled up to whole texels; a single one
    is packed."""
    table: Table = getattr(tables.load(), name)
    channels = table.data.shape[-1]
    flat = table.data.reshape(-1, channels)
    if channels == 1:
        return np.pad(flat.ravel(), (0, -len(flat) % 4)).reshape(-1, 4)
    return np.pad(flat, ((0, 0), (0, -channels % 4))).reshape(-1, 4)
