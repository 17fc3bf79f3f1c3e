"""A material that is turned about the normal."""

from __future__ import annotations

from dataclasses import dataclass, replace

from velatura.model.bsdf import Asked, Body
from velatura.model.solved import ALL
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction


@dataclass(frozen=True)
class Turned:
    """A body turned anticlockwise, as seen from outside, by an angle in radians."""

    body: Body
    angle: Value

    @property
    def diffuse(self) -> bool:
        return self.body.diffuse

    @property
    def balanced(self) -> bool:
        return self.body.balanced

    def lit(self, wi: Direction) -> Turned:
        return replace(self, body=self.body.lit(self._inside(wi)))

    def albedo(self, wi: Direction) -> Value:
        return self.body.albedo(self._inside(wi))

    def eval_pdf(self, wi: Direction, wo: Direction, asked: Asked = ALL) -> tuple[Value, Value]:
        return self.body.eval_pdf(self._inside(wi), self._inside(wo), asked)

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value, asked: Asked = ALL) -> tuple[Direction, Value]:
        wo, eta = self.body.sample(self._inside(wi), u, u1, u2, asked)
        return ggx.rotate(wo, -self.angle), eta

    def component(self, wi: Direction, wo: Direction, u: Value, asked: Asked = ALL) -> Value:
        return self.body.component(self._inside(wi), self._inside(wo), u, asked)

    def _inside(self, w: Direction) -> Direction:
        return ggx.rotate(w, self.angle)
