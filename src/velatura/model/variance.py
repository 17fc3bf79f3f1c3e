"""Variances of a lobe, which the recursion adds and scales, and which finally become a GGX lobe.

Three kinds, from the cheapest to the most general. A stack uses one kind throughout, the cheapest that holds all of its
interfaces; the recursion does not care which.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from velatura import ops
from velatura.model.guards import VARIANCE_MAX
from velatura.model.roughness_maps import RoughnessMap
from velatura.ops import Value

if TYPE_CHECKING:
    from velatura.stack import Material

V = TypeVar("V", bound="Variance")

ALIKE = 2e-7  # difference of two eigenvalues, as share of their mean, that is rounding


class Roughness(NamedTuple):
    """GGX roughness along two axes, the first turned from the tangent by `rotation` (radians, anticlockwise)."""

    alpha_u: Value
    alpha_v: Value
    rotation: Value

    def scaled(self, scale: Value) -> Roughness:
        return Roughness(scale * self.alpha_u, scale * self.alpha_v, self.rotation)


@dataclass(frozen=True)
class Variance(ops.NamedFields):
    """Components of a variance; sums and multiples are taken component by component."""

    def __add__(self: V, other: V) -> V:
        return type(self)(*(a + b for a, b in zip(vars(self).values(), vars(other).values())))

    def __mul__(self: V, scale: Value) -> V:
        return type(self)(*(scale * a for a in vars(self).values()))

    __rmul__ = __mul__

    def bounded(self: V) -> V:
        """The variance with every component below the value that a map treats as infinite, so that no sum overflows."""
        return type(self)(*(ops.clip(a, -VARIANCE_MAX, VARIANCE_MAX) for a in vars(self).values()))

    @classmethod
    def of(cls: type[V], roughness: Roughness, f: RoughnessMap) -> V:
        """Variance of a rough reflection."""
        raise NotImplementedError

    @classmethod
    def uniform(cls: type[V], s: Value) -> V:
        """The same variance s in all directions."""
        raise NotImplementedError

    def roughness(self, f: RoughnessMap) -> Roughness:
        """The GGX lobe of this variance."""
        raise NotImplementedError

    def matrix(self) -> tuple[Value, Value, Value]:
        """Entries xx, xy, yy of the 2x2 covariance in the shading frame."""
        raise NotImplementedError


@dataclass(frozen=True)
class Isotropic(Variance):
    """One number, the same along all axes (Belcour 2018)."""

    s: Value

    @classmethod
    def of(cls, roughness: Roughness, f: RoughnessMap) -> Isotropic:
        return cls(f.variance(roughness.alpha_u))

    @classmethod
    def uniform(cls, s: Value) -> Isotropic:
        return cls(s)

    def roughness(self, f: RoughnessMap) -> Roughness:
        alpha = f.roughness(self.s)
        return Roughness(alpha, alpha, 0.0)

    def matrix(self) -> tuple[Value, Value, Value]:
        return self.s, 0.0 * self.s, self.s


@dataclass(frozen=True)
class PerAxis(Variance):
    """One number per tangent axis, where all interfaces share the axes (Weier & Belcour 2020)."""

    uu: Value
    vv: Value

    @classmethod
    def of(cls, roughness: Roughness, f: RoughnessMap) -> PerAxis:
        u, v = roughness.alpha_u, roughness.alpha_v
        return cls(f.variance(u, v), f.variance(v, u))

    @classmethod
    def uniform(cls, s: Value) -> PerAxis:
        return cls(s, s)

    def roughness(self, f: RoughnessMap) -> Roughness:
        return Roughness(f.roughness(self.uu, self.vv), f.roughness(self.vv, self.uu), 0.0)

    def matrix(self) -> tuple[Value, Value, Value]:
        return self.uu, 0.0 * self.uu, self.vv


@dataclass(frozen=True)
class Covariance(Variance):
    """A symmetric 2x2 matrix, where every interface has its own axes.

    Reflection and refraction scale all axes alike (Yamaguchi et al. 2019, Eqs. 4-5), so that the matrix is turned from
    the variances along the interface's axes, and stands for the variance in Yamaguchi et al. 2019, Eqs. 1-2.
    """

    xx: Value
    xy: Value
    yy: Value

    @classmethod
    def of(cls, roughness: Roughness, f: RoughnessMap) -> Covariance:
        u, v = f.variance(roughness.alpha_u, roughness.alpha_v), f.variance(roughness.alpha_v, roughness.alpha_u)
        c, s = ops.cos(roughness.rotation), ops.sin(roughness.rotation)
        ops.names(u=u, v=v, cosine=c, sine=s)
        # (u - v) c s would be -0 without rotation, an angle that drivers take for another than that of 0
        return cls(u * c * c + v * s * s, u * c * s - v * c * s, u * s * s + v * c * c)

    @classmethod
    def uniform(cls, s: Value) -> Covariance:
        return cls(s, 0.0 * s, s)

    def roughness(self, f: RoughnessMap) -> Roughness:
        with ops.block("Eigenvalues mean +- radius; where they agree the axes stay those of the frame"):
            mean, half = 0.5 * (self.xx + self.yy), 0.5 * (self.xx - self.yy)
            radius = ops.sqrt(half * half + self.xy * self.xy)
            turned = radius > ALIKE * mean
            radius = ops.select(turned, radius, half)  # which has a gradient there, too
            rotation = 0.5 * ops.arctan2(ops.select(turned, self.xy, 0.0), ops.select(turned, half, 1.0))
            u = mean + radius
            v = ops.divide(ops.maximum(self.xx * self.yy - self.xy * self.xy, 0.0), u)  # mean - radius would cancel
            ops.names(mean=mean, half=half, radius=radius, turned=turned, rotation=rotation, u=u, v=v)
        return Roughness(f.roughness(u, v), f.roughness(v, u), rotation)

    def matrix(self) -> tuple[Value, Value, Value]:
        return self.xx, self.xy, self.yy


def variance_kind(material: Material) -> type[Variance]:
    """The cheapest kind of variance that holds all interfaces; values are only compared, never computed."""
    same = [is_same(layer.alpha_u, layer.alpha_v) for layer in material.interfaces]
    straight = [is_same(layer.rotation, 0.0) for layer in material.interfaces]
    if all(same):
        return Isotropic
    return PerAxis if all(s or t for s, t in zip(same, straight)) else Covariance


def is_same(a: object, b: object) -> bool:
    """Whether two values are known to be the same."""
    return a is b or (isinstance(a, float) and isinstance(b, float) and a == b)
