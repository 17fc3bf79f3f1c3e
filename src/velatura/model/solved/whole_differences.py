"""Gradients by an index beside a kink of light, or by one that moves edges of light: differences of the whole BSDF.

Where media beside each other have one index, or nearly, light has a kink or is curved like a root of the index. Light
that passes a medium rarer than the outside ends at edges that move with the index, which analytic slopes of shapes do
not see. So these and differences of energies do not belong together: white materials would gain or lose light.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from velatura.model.base import ALL, Body, Query
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer.differentiated import Variables
from velatura.stack import Material


def body(material: Material, solved: Callable[[Material], Body]) -> Body:
    """The body that `solved` makes of a material with constants of a renderer; gradients by indices
    `Variables.by_whole` are differences of such bodies."""
    given = Variables.of(material)
    chosen = list(given.by_whole())
    if not chosen:
        return solved(material)
    ends = list[tuple[Value, Body]]()
    for k, x, (low, high) in chosen:
        share = (given.given[k].number - x) / (high - low)
        if low < x:
            ends.append((-share, solved(given.moved(material, k, low - x))))
        if high > x:
            ends.append((share, solved(given.moved(material, k, high - x))))
    return WithEnds(solved(given.without(material, [k for k, *_ in chosen])), ends)


@dataclass(frozen=True)
class WithEnds:
    """A body, and those at the ends of steps of variables, each with its share of the light: 0, with a gradient."""

    body: Body
    ends: list[tuple[Value, Body]]

    @property
    def diffuse(self) -> bool:
        return self.body.diffuse

    @property
    def balanced(self) -> bool:
        return self.body.balanced

    def at_direction(self, wi: Direction) -> WithEnds:
        ends = [(share, end.at_direction(wi)) for share, end in self.ends]
        return replace(self, body=self.body.at_direction(wi), ends=ends)

    def albedo(self, wi: Direction, asked: Query = ALL) -> Value:
        found = self.body.albedo(wi, asked)
        return found + sum(share * (end.albedo(wi, asked) - found) for share, end in self.ends)

    def eval_pdf(self, wi: Direction, wo: Direction, asked: Query = ALL) -> tuple[Value, Value]:
        found, density = self.body.eval_pdf(wi, wo, asked)
        return found + sum(share * (end.eval_pdf(wi, wo, asked)[0] - found) for share, end in self.ends), density

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value, asked: Query = ALL) -> tuple[Direction, Value]:
        return self.body.sample(wi, u, u1, u2, asked)

    def component(self, wi: Direction, wo: Direction, u: Value, asked: Query = ALL) -> Value:
        return self.body.component(wi, wo, u, asked)
