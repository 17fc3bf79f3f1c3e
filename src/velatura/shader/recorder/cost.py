"""Cost of the functions of a shader for one point of a material."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from velatura import tables
from velatura.shader.lookups import atlas
from velatura.shader.lookups.films import FILM
from velatura.shader.recorder.graph import work
from velatura.shader.recorder.needed import most, needed
from velatura.shader.recorder.symbol import Operand, Symbol, in_order, inside, is_colour


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
    operations, texels = 0, dict[Symbol, int]()
    for symbol, times in _rounds(outputs).items():
        operations += times * work(symbol) * (3 if is_colour(symbol) else 1)
        if read := times * _texels(symbol, axes):
            texels[symbol] = read
    return Cost(operations, most(texels, needed(outputs)))


def _rounds(outputs: Sequence[Operand]) -> Counter[Symbol]:
    """How often each value is worked out: in loops once for every round, of every loop that works it out."""
    order = in_order(outputs)
    bound = inside(order)
    found = Counter(x for x in order if not bound[x])

    def enter(loop: Symbol, times: int, around: frozenset[str]) -> None:
        own, times = around.union(loop.detail.bound), times * loop.detail.times
        for x in in_order(loop.args):
            if bound[x].intersection(loop.detail.bound) and bound[x] <= own:
                found[x] += times
                if x.kind == "loop":
                    enter(x, times, own)

    for x in [x for x in found if x.kind == "loop"]:
        enter(x, 1, frozenset())
    return found


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
