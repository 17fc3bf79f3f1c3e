"""Materials turned about the normal.

Brushed ones are solved, and those in closed form looked at, in the axes of their first brushed interface: so all turns
exactly where all layers do, at any azimuths that they are solved at, and in single precision, which holds no matrix of
axes that are a thousand times as long as others.
"""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass, replace
from math import pi

from velatura.model.base import ALL, Body, Query
from velatura.model.variance import PerAxis, Variance, is_same
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.renderer.differentiated import Variables, plain
from velatura.stack import Address, InterfaceValues, Material


@dataclass(frozen=True)
class Frame:
    """The axes of one layer of a material, by its number; None for those of the surface. Of `straight` layers, no
    rotation is left in these axes, and `all_straight` is whether all are."""

    layer: int | None = None
    straight: frozenset[int] = frozenset()
    all_straight: bool = False

    @classmethod
    def of(cls, material: Material, textures: Set[str] = frozenset()) -> Frame:
        """That of the first interface with axes; values are only compared. Where one of the `textures`, by flat name,
        turns an interface against it, that of the surface."""
        found = {k: layer for k, layer in enumerate(material.layers) if isinstance(layer, InterfaceValues)}
        brushed = {k: layer.rotation for k, layer in found.items() if not is_same(layer.alpha_u, layer.alpha_v)}
        if not brushed:
            return cls()
        first, rotation = next(iter(brushed.items()))
        apart = {k for k, other in brushed.items() if not is_same(other, rotation)}
        if apart and not textures.isdisjoint(map(_rotation, brushed)):
            return cls()
        return cls(first, frozenset(found) - apart, not apart)

    def back(self, material: Material) -> Material:
        """A material in these axes."""
        if self.layer is None:
            return material
        by = self.degrees(material)

        def value(address: Address, old: Value) -> Value:
            if address.key != "rotation":
                return old
            return 0.0 if address.layer in self.straight else old - by

        return material.each(value)

    def kind(self, variance: type[Variance]) -> type[Variance]:
        """That of the material in these axes, for that of the surface."""
        return PerAxis if self.all_straight else variance

    def turned(self, body: Body, material: Material) -> Body:
        """The body of a material, by the one that it has in these axes."""
        if self.layer is None:
            return body
        return Turned(body, self.degrees(material) * (pi / 180))

    def degrees(self, material: Material) -> Value:
        """How far a material is turned, anticlockwise."""
        return 0.0 if self.layer is None else material.flat()[_rotation(self.layer)]


def frame(material: Material) -> Frame:
    """That of a material with constants of a renderer."""
    numbers = plain(material)
    if not any(layer.rotation for layer in numbers.interfaces):
        return Frame()
    return Frame.of(material if Variables.of(material).given else numbers)


def in_axes(material: Material, variance: type[Variance], make: Callable[[Material, type[Variance]], Body]) -> Body:
    """The body of a material with constants of a renderer, by the one that `make` makes of it, and of its kind of
    variance, in its own axes."""
    own = frame(material)
    return own.turned(make(own.back(material), own.kind(variance)), material)


def _rotation(layer: int) -> str:
    return f"layer{layer}_rotation"


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

    def at_direction(self, wi: Direction) -> Turned:
        return replace(self, body=self.body.at_direction(self._inside(wi)))

    def albedo(self, wi: Direction, asked: Query = ALL) -> Value:
        return self.body.albedo(self._inside(wi), asked)

    def eval_pdf(self, wi: Direction, wo: Direction, asked: Query = ALL) -> tuple[Value, Value]:
        return self.body.eval_pdf(self._inside(wi), self._inside(wo), asked)

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value, asked: Query = ALL) -> tuple[Direction, Value]:
        wo, eta = self.body.sample(self._inside(wi), u, u1, u2, asked)
        return ggx.rotate(wo, -self.angle), eta

    def component(self, wi: Direction, wo: Direction, u: Value, asked: Query = ALL) -> Value:
        return self.body.component(self._inside(wi), self._inside(wo), u, asked)

    def _inside(self, w: Direction) -> Direction:
        return ggx.rotate(w, self.angle)
