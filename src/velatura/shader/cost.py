"""What the functions of a shader cost for one point of a material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

from velatura import tables
from velatura.shader import atlas
from velatura.shader.films import FILM
from velatura.shader.graph import work
from velatura.shader.needed import most, needed
from velatura.shader.symbol import Operand, Symbol, in_order, inside, is_colour


@dataclass(frozen=True)
class Cost:
    """Operations on numbers, those on colours being three, and elementary functions as many as they take; and texels
    that are read, at most: a look-up that only one side of a choice needs counts for that side."""

    operations: int
    texels: int

    def __str__(self) -> str:
        read = f", {self.texels} texels read" if self.texels else ""
        return f"{self.operations} operations{read}"


def cost(outputs: Sequence[Operand], axes: int) -> Cost:
    """The cost of working out values together; `axes` are those of the texture that lobes are read from."""
    order = in_order(outputs)
    bound = inside(order)
    loop_of = {name: symbol for symbol in order if symbol.kind == "loop" for name in symbol.detail.bound}
    operations, texels = 0, dict[Symbol, int]()
    for symbol in order:
        times = prod(loop.detail.times for loop in {loop_of[name] for name in bound[symbol]})
        operations += times * work(symbol) * (3 if is_colour(symbol) else 1)
        if read := times * _texels(symbol, axes):
            texels[symbol] = read
    return Cost(operations, most(texels, needed(outputs)))


def _texels(symbol: Symbol, axes: int) -> int:
    """How many a look-up reads: between two nodes along every axis."""
    if symbol.op == FILM:
        return 2 ** len(symbol.args)
    if symbol.op == "baked":
        return int(symbol.detail.texels) << axes
    if symbol.op not in ("texels", "value"):
        return 0
    table = getattr(tables.load(), symbol.detail)
    times = 3 if is_colour(symbol) else 1
    return times * atlas.texels(symbol.detail) << len(table.shape)
