"""Polarised light: its Stokes parameters, and what facets make of them.

Light that travels along `w` is described in a frame of two directions across it, x and y = w times x: x, y and w are
right-handed. Its parameters are q, the intensity along x less that along y, u, the same in a frame turned by 45
degrees from x to y, and v = 2 Im(E_x conj(E_y)), all over the intensity: unpolarised light has q = u = v = 0, and
q^2 + u^2 + v^2 is at most 1 (Born and Wolf 1999, section 1.4.2). Depolarisation by media and diffuse bases is complete.

A facet's own frame has x along the normal of the plane of incidence, before and after, so that x is s and y is p.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.fresnel import Complex
from velatura.optics.ggx import Direction

_STRAIGHT = 1e-8  # square of the sine up to which incidence is normal, where any plane is one of incidence


@dataclass
class Polarisation:
    """Stokes parameters over the intensity, colours, in the frame whose first direction is `x`; see above."""

    x: Direction
    q: Value
    u: Value
    v: Value

    def mirrored(self, where: Value) -> Polarisation:
        """The parameters in a mirror in the plane of z where the condition holds: x is turned, and right is left."""
        x = self.x[0], self.x[1], ops.select(where, -self.x[2], self.x[2])
        return Polarisation(x, self.q, ops.select(where, -self.u, self.u), ops.select(where, -self.v, self.v))

    @property
    def inverted(self) -> Polarisation:
        """The parameters with all directions turned around, of travel too: x and y keep axes, right is left."""
        return Polarisation(self.x, self.q, -self.u, -self.v)

    def seen_by(self, into: Callable[[Direction], Direction]) -> Polarisation:
        """The parameters in the coordinates that a rotation leads to."""
        return Polarisation(into(self.x), self.q, self.u, self.v)

    def along(self, w: Direction, x: Direction) -> Polarisation:
        """The parameters in the frame of another first direction x across the direction of travel w."""
        cosine, sine = ggx.dot(self.x, x), ggx.dot(ggx.cross(w, self.x), x)
        square = ops.maximum(cosine * cosine + sine * sine, ops.TINY)
        cos_2, sin_2 = (cosine * cosine - sine * sine) / square, 2 * cosine * sine / square
        return Polarisation(x, cos_2 * self.q + sin_2 * self.u, cos_2 * self.u - sin_2 * self.q, self.v)

    def at(self, w: Direction, h: Direction) -> Polarisation:
        """The parameters in the frame of a facet of normal h."""
        s = ggx.cross(w, h)
        square = ggx.dot(s, s)
        tilted = square > _STRAIGHT
        scale = 1 / ops.sqrt(ops.maximum(square, _STRAIGHT))
        x, y, z = (ops.select(tilted, scale * new, old) for new, old in zip(s, self.x))
        return self.along(w, (x, y, z))


def unpolarised(w: Direction, colour: Value) -> Polarisation:
    """Unpolarised light along w, with channels as those of a colour."""
    none = 0.0 * colour
    return Polarisation(horizontal(w), none, none, none)


def horizontal(w: Direction) -> Direction:
    """The direction across w and across z: s for a horizontal surface. That of y for a w along z."""
    cosine, sine = ggx.plane(w)
    return -sine, cosine, 0.0 * w[2]


@dataclass(frozen=True)
class Mueller:
    """The Mueller matrix of a facet, in its own frame.

    s, p: shares of the light of either polarisation; real, imaginary: of r_s conj(r_p), by which u + iv is multiplied.
    """

    s: Value
    p: Value
    real: Value
    imaginary: Value

    def share(self, light: Polarisation) -> Value:
        """Share of the light that goes this way."""
        return 0.5 * ((1 + light.q) * self.s + (1 - light.q) * self.p)

    def applied(self, light: Polarisation) -> Polarisation:
        """The light that has gone this way."""
        share = self.share(light)
        q = 0.5 * ((1 + light.q) * self.s - (1 - light.q) * self.p)
        u = light.u * self.real - light.v * self.imaginary
        v = light.u * self.imaginary + light.v * self.real
        return Polarisation(light.x, *(ops.divide(part, share) for part in (q, u, v)))


def mueller(amplitude_s: Complex, amplitude_p: Complex) -> Mueller:
    """Matrix of the amplitudes that a facet reflects; transmitted ones, if their squares are shares of the energy."""
    (a, b), (c, d) = amplitude_s, amplitude_p
    return Mueller(a * a + b * b, c * c + d * d, a * c + b * d, b * c - a * d)


def complement(reflection: Mueller) -> Mueller:
    """Matrix of refraction by an interface that reflects thus and absorbs nothing: s and p are transmitted in phase."""
    s, p = (ops.maximum(1 - part, 0.0) for part in (reflection.s, reflection.p))
    return Mueller(s, p, ops.sqrt(s * p), 0.0)
