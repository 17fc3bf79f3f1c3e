"""A density over directions that resembles the layered BSDF, for multiple importance sampling.

The density of the samples of the walk is not known. Any function of the two directions can replace it, as long as all
strategies use the same one: the weights still sum to 1. Widths are guessed from small tilts of the facets, to first
order, and all roughness matrices (alpha^2, in slopes of half-vectors outside) simply add up.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.ggx import Direction, normalize
from velatura.reference.layers import WalkedLayers, WalkedSurface
from velatura.reference.metal import mean

_FAINTEST = 0.05  # share of light that may go anywhere
_NARROWEST = 1e-6  # alpha^2


@dataclass(frozen=True)
class Matrix:
    """A symmetric 2x2 matrix of squared roughness."""

    xx: Value = 0.0
    xy: Value = 0.0
    yy: Value = 0.0

    def plus(self, surface: WalkedSurface, scale: Value) -> Matrix:
        """The sum with the roughness of a surface, times `scale`."""
        scale2 = ops.select(surface.smooth, 0.0, scale * scale)
        u, v = scale2 * surface.alpha_u * surface.alpha_u, scale2 * surface.alpha_v * surface.alpha_v
        c, s = ops.cos(surface.rotation), ops.sin(surface.rotation)
        return Matrix(self.xx + u * c * c + v * s * s, self.xy + (u - v) * c * s, self.yy + u * s * s + v * c * c)

    def density(self, wi: Direction, wo: Direction) -> Value:
        """Density of reflection by GGX normals visible from wi, both directions being above."""
        h = normalize((wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]))
        xx, yy = self.xx + _NARROWEST, self.yy + _NARROWEST
        determinant = ops.maximum(xx * yy - self.xy * self.xy, _NARROWEST * _NARROWEST)
        stretched = yy * h[0] * h[0] - 2 * self.xy * h[0] * h[1] + xx * h[1] * h[1]
        q = stretched / determinant + h[2] * h[2]
        ndf = 1 / (pi * ops.sqrt(determinant) * q * q)
        slope2 = xx * wi[0] * wi[0] + 2 * self.xy * wi[0] * wi[1] + yy * wi[1] * wi[1]
        return ops.divide(ndf, 2 * (wi[2] + ops.sqrt(wi[2] * wi[2] + slope2)))


def density(layers: WalkedLayers, wi: Direction, wo: Direction) -> Value:
    """Density of wo, per solid angle and on both sides, for a stack seen from wi, which lies above."""
    index = [ops.mean(n) for n in layers.index]
    above, upright = wo[2] > 0, (wo[0], wo[1], ops.absolute(wo[2]))
    passing, passing_back = Matrix(), Matrix()
    left, spread, cosine, smooth = 1.0, _FAINTEST, wi[2], True
    energy, value = 0.0, 0.0
    for k, surface in enumerate(layers.surfaces):
        # Lose light in the medium
        slab = layers.slabs[k]
        left = left * mean(slab.absorbed(1.0))
        spread = spread + left * (1 - mean(ops.exp(-slab.scattering)))
        if k == layers.count - 1 and layers.base == "diffuse":
            spread = spread + left
            break
        # Reflect
        reflectance = mean(layers.shares(k, cosine, layers.index[k], layers.index[k + 1], True)[0])
        smooth = smooth & surface.smooth
        reflected = ops.select(smooth, 0.0, left * reflectance)
        energy += reflected
        value += reflected * passing.plus(surface, index[k] / index[0]).density(wi, upright)
        # Refract: a tilt of the facets bends light by n - 1 times as much, and lets some out that would not leave else
        left = left * (1 - 0.95 * reflectance)
        bend = ops.absolute(index[k + 1] - index[k])
        passing = passing.plus(surface, bend / index[0] * 0.7)
        passing_back = passing_back.plus(surface, bend / index[-1] * 0.5)
        cosine = fresnel.cos_transmitted(cosine, index[k + 1] / index[k])
    # Add transmitted light, and light in all directions
    value = ops.select(above, value, 0.0)
    anywhere = spread * upright[2] / pi
    if not layers.transmits:
        return ops.select(above, (value + anywhere) / (energy + spread), 0.0)
    left = ops.select(smooth, 0.0, left)
    eta = index[-1] / index[0]
    wi_below = (wi[0] / eta, wi[1] / eta, fresnel.cos_transmitted(wi[2], eta))
    through = left * passing_back.density(wi_below, upright)
    return (ops.select(above, value, through) + 0.5 * anywhere) / (energy + left + spread)
