"""Materials side by side, each with its share of a surface, as one that light meets."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from velatura import ops
from velatura.model.base import ALL, Body, Model, Query
from velatura.model.context import Context
from velatura.model.variance import variance_kind
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.stack import Material


@dataclass(frozen=True)
class SideBySide:
    """Bodies with the shares that they have, which add up to 1."""

    parts: tuple[tuple[Value, Body], ...]

    @classmethod
    def of(cls, materials: Iterable[tuple[Value, Material]], model: Model) -> SideBySide:
        """The bodies of materials with values in NumPy."""
        return cls(
            tuple((share, model.body(each, variance_kind(each), Context())) for share, each in materials if share)
        )

    def eval_pdf(self, wi: Direction, wo: Direction, asked: Query = ALL) -> tuple[Value, Value]:
        """Sums of values and densities, weighted by the shares."""
        value: Value = 0.0
        density: Value = 0.0
        for share, body in self.parts:
            own, also = body.eval_pdf(wi, wo, asked)
            value, density = value + share * own, density + share * also
        return value, density

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value, asked: Query = ALL) -> Direction:
        """A direction of the body that u chooses by the shares; u is rescaled for it."""
        found: Direction = (0.0, 0.0, 0.0)
        begin: Value = 0.0
        for share, body in self.parts:
            drawn, _ = body.sample(wi, ops.clip((u - begin) / share, 0.0, 1.0), u1, u2, asked)
            x, y, z = (ops.select(u >= begin, new, old) for new, old in zip(drawn, found))
            found, begin = (x, y, z), begin + share
        return found
