"""The GGX distribution of microfacet normals, anisotropic, with separable Smith masking.

`wi`, `wo`, `h` are triples of components in the frame of the distribution: x along the tangent, of roughness `alpha_u`,
y along the bitangent, of roughness `alpha_v`, z the normal. Roughnesses must be positive.
"""

from __future__ import annotations

from math import pi

from velatura import ops
from velatura.ops import Value

Direction = tuple[Value, Value, Value]


def rotate(w: Direction, angle: Value) -> Direction:
    """Coordinates of `w` in a frame turned by `angle` (radians, anticlockwise seen from outside)."""
    c, s = ops.cos(angle), ops.sin(angle)
    ops.names(cosine=c, sine=s)
    return turned(w, c, s)


def turned(w: Direction, cosine: Value, sine: Value) -> Direction:
    """Coordinates like those of `rotate`, by the cosine and the sine of the angle."""
    return cosine * w[0] + sine * w[1], cosine * w[1] - sine * w[0], w[2]


def plane(w: Direction) -> tuple[Value, Value]:
    """Cosine and sine of the azimuth of `w`, which is 0 for the normal."""
    tilted = w[0] * w[0] + w[1] * w[1] > ops.TINY
    x, y = ops.select(tilted, w[0], 1.0), ops.select(tilted, w[1], 0.0)
    scale = 1 / ops.sqrt(x * x + y * y)
    ops.names(scale=scale)
    return x * scale, y * scale


def dot(a: Direction, b: Direction) -> Value:
    return ops.fma(a[0], b[0], ops.fma(a[1], b[1], a[2] * b[2]))


def normalize(w: Direction) -> Direction:
    scale = 1 / ops.sqrt(ops.maximum(dot(w, w), ops.TINY))
    ops.names(scale=scale)
    return w[0] * scale, w[1] * scale, w[2] * scale


def cross(a: Direction, b: Direction) -> Direction:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def reflect(w: Direction, h: Direction) -> Direction:
    """Mirror image of `w` about the normal `h`."""
    t = 2 * dot(w, h)
    ops.names(t=t)
    return t * h[0] - w[0], t * h[1] - w[1], t * h[2] - w[2]


def ndf(h: Direction, alpha_u: Value, alpha_v: Value) -> Value:
    """Density D(h) of normals, whose projected integral is 1 (Walter 2007, Eq. 33, stretched)."""
    x, y = h[0] / alpha_u, h[1] / alpha_v
    q = x * x + y * y + h[2] * h[2]
    ops.names(x=x, y=y, q=q)
    # Opposite directions have no half-vector, and q is 0
    return 1 / (pi * alpha_u * alpha_v * ops.maximum(q * q, ops.TINY))


def masking(w: Direction, alpha_u: Value, alpha_v: Value) -> Value:
    """Smith's G1(w), the visible share of the normals that face `w` (Heitz 2014, Eq. 43); 0 below the horizon."""
    x, y = alpha_u * w[0], alpha_v * w[1]
    z = ops.maximum(w[2], 0.0)
    return ops.divide(2 * z, z + ops.sqrt(z * z + x * x + y * y))


def sample_visible(wi: Direction, alpha_u: Value, alpha_v: Value, u1: Value, u2: Value) -> Direction:
    """A normal drawn from those visible from `wi`, with density G1(wi) D(h) max(wi·h, 0) / cos_theta_i.

    Uniform on a cap of the sphere in the stretched space (Dupuy & Benyoub 2023).
    """
    with ops.block("Stretch to the hemisphere of unit roughness"):
        vx, vy, vz = normalize((alpha_u * wi[0], alpha_v * wi[1], wi[2]))
    with ops.block("Draw a direction reflected there by a spherical cap"):
        phi = 2 * pi * u1
        z = (1 - u2) * (1 + vz) - vz
        sin_theta = ops.sqrt(1 - z * z)
        ops.names(phi=phi, z=z, sin_theta=sin_theta)
        hx, hy, hz = sin_theta * ops.cos(phi) + vx, sin_theta * ops.sin(phi) + vy, z + vz
    with ops.block("Unstretch the half-vector"):
        return normalize((alpha_u * hx, alpha_v * hy, ops.maximum(hz, 0.0)))
