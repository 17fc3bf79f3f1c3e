"""A reflected lobe in its own medium: GGX above the interface that reflects it, refracted out.

Snell's law leaves the tangential momentum p = n sin(theta) of light alone. So light from wi that leaves along wo meets
interface k, in a medium of index n, from i = (p_i / n, c(p_i)) towards o = (p_o / n, c(p_o)), c(p) = sqrt(1 - p^2/n^2),
and leaves with

    f |cos_o| = weight D(h) V(i) V(o) / 4 F(i.h) (1 - F_1(cos_o)) cos_o / n^2,    h halfway between i and o,

where V(w) = G1(w) / w_z is finite at grazing directions, and 1 / (n^2 c(p_o)) cos_o is the solid angle inside over that
outside. The shift of the peak, the cut of the cone, the stretch across the plane and the fall-off at grazing directions
follow; turning the axes turns the lobe. Indices are relative to the medium outside, where that of the first lobe is 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi
from typing import NamedTuple

import numpy as np

from velatura import ops
from velatura.model.mixture import ALPHA_MIN
from velatura.model.variance import Roughness
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.sampling import low_discrepancy

COS_MIN = 1e-3  # inside; what refraction does not reach meets the interface at this one
NORMALS = 987  # of the quadrature's lattice; a Fibonacci number
BLOCK = 1 << 16  # normals at a time, which a processor's cache holds

Reflectance = Callable[[Value], Value]


class Index(NamedTuple):
    """An index n relative to the medium outside, and what lobes take of it: its inverse, and the radius of the ring of
    momenta beyond those that can leave, from 1 to n, in squares and as it is."""

    n: Value
    inverse: Value
    ring2: Value
    ring: Value

    @classmethod
    def of(cls, n: Value) -> Index:
        if isinstance(n, Index):
            return n
        ring2 = n * n - 1
        return cls(n, 1 / n, ring2, ops.sqrt(ops.maximum(ring2, 0.0)))

    @property
    def is_outside(self) -> bool:
        """Whether it is known to be that of the medium outside."""
        return isinstance(self.n, float) and self.n == 1.0


@dataclass(frozen=True)
class OwnMediumLobe(ops.Named):
    """A lobe of `weight` (a colour) times a GGX reflection of `roughness` in a medium of index `n`, a number or an
    `Index`, refracted out.

    `facets` is the Fresnel reflectance of the facets at a cosine, and `leaving` the share of light at a cosine outside
    that the first interface lets out; None where the weight has all of it, or nothing lies above. With the energy over
    the `integral` as weight, the lobe has that energy.
    """

    weight: Value
    roughness: Roughness
    n: Value = 1.0
    facets: Reflectance | None = None
    leaving: Reflectance | None = None


def eval_pdf(lobe: OwnMediumLobe, wi: Direction, wo: Direction) -> tuple[Value, Value]:
    """f(wi, wo) |cos theta_o|, a colour, and the density of `sample`; both 0 unless wi and wo are above the surface."""
    alpha_u, alpha_v, n, i = _inside(lobe, wi)
    p = _in_frame(lobe, wo)
    cos_o = ops.select(wi[2] > 0, ops.maximum(wo[2], 0.0), 0.0)
    # Reflect in the medium
    o, reached = (p[0], p[1], ops.maximum(cos_o, COS_MIN)), True
    if not n.is_outside:
        o, reached = _out(p[0], p[1], n.inverse)
    m = i[0] + o[0], i[1] + o[1], i[2] + o[2]
    ops.names(i=i, o=o, m=m)
    seen = 0.5 * cos_o * (n.inverse * n.inverse) / _shown(i, alpha_u, alpha_v)
    density = ops.select(reached, seen * _facing(m, alpha_u, alpha_v), 0.0)
    light = 2 * density / _shown(o, alpha_u, alpha_v)
    if lobe.facets:
        # The cosine of half the angle between i and o
        light = light * lobe.facets(ops.minimum(0.5 * ops.sqrt(ggx.dot(m, m)), 1.0))
    if lobe.leaving:
        light = light * lobe.leaving(cos_o)
    pdf = density / o[2]
    # Add what falls outside the cone, and is spread over it
    if not n.is_outside:
        p2 = ops.maximum(wo[0] * wo[0] + wo[1] * wo[1], ops.TINY)
        cos_far = n.ring * n.inverse * p2
        stretch = ops.sqrt((1 - cos_far * cos_far) * (1 / p2))
        m = i[0] + stretch * p[0], i[1] + stretch * p[1], i[2] + cos_far
        ops.names(p2=p2, cos_far=cos_far, stretch=stretch, m_far=m)
        pdf = pdf + seen * _facing(m, alpha_u, alpha_v) * (2 * n.n * n.ring)
    return lobe.weight * light, pdf


def sample(lobe: OwnMediumLobe, wi: Direction, u1: Value, u2: Value) -> Direction:
    """A direction wo from uniform numbers, by a normal visible inside.

    Momenta outside the cone, a ring of radii 1 to n, are spread over the disc inside: to the fourth root of
    (n^2 - p^2) / (n^2 - 1), which keeps the density finite. The direction may lie below the surface, where `eval_pdf`
    is 0.
    """
    alpha_u, alpha_v, n, i = _inside(lobe, wi)
    o = ggx.reflect(i, ggx.sample_visible(i, alpha_u, alpha_v, u1, u2))
    if n.is_outside:
        return _out_of_frame(lobe, o)
    x, y = n.n * o[0], n.n * o[1]
    p2 = x * x + y * y
    spread = ops.divide(n.n * n.n - p2, ops.maximum(n.ring2, 0.0))
    r2 = ops.select(p2 > 1, ops.sqrt(ops.minimum(spread, 1.0)), p2)
    scale = ops.select(p2 > 1, ops.sqrt(r2 / ops.maximum(p2, 1.0)), 1.0)
    z = ops.sqrt(1 - r2)
    ops.names(o=o, x=x, y=y, p2=p2, r2=r2, scale=scale, z=z)
    return _out_of_frame(lobe, (scale * x, scale * y, ops.select(o[2] > 0, z, -z)))


def either(where: Value, a: OwnMediumLobe, b: OwnMediumLobe) -> OwnMediumLobe:
    """A lobe to `sample`: that of a where a condition holds, else of b."""
    roughness = Roughness(*(ops.select(where, x, y) for x, y in zip(a.roughness, b.roughness)))
    return OwnMediumLobe(1.0, roughness, _chosen(where, a.n, b.n))


def integral(lobe: OwnMediumLobe, wi: Direction, normals: int = NORMALS) -> Value:
    """Albedo of a lobe in NumPy, (N,), or (C, N) of a colour, for directions wi and its roughness, (N,) each.

    A mean over visible normals on a lattice of a Fibonacci number of them, in single precision; within .3 % on average.
    """
    return lobe.weight * integrals(lobe, wi, normals)[0]


def integrals(lobe: OwnMediumLobe, wi: Direction, normals: int = NORMALS) -> tuple[Value, Value]:
    """Mean and largest weight of samples, as `integral`, for a weight of 1."""
    count, size = len(wi[2]), max(BLOCK // normals, 1)
    blocks = [
        _integrals(replace(lobe, n=_single(Index.of(lobe.n).n), roughness=Roughness(*roughness)), (x, y, z), normals)
        for x, y, z, *roughness in (
            [_single(value, slice(k, k + size)) for value in (*wi, *lobe.roughness)] for k in range(0, count, size)
        )
    ]
    mean, largest = (np.concatenate(each, axis=-1) for each in zip(*blocks))
    return mean, largest


def _integrals(lobe: OwnMediumLobe, wi: Direction, normals: int) -> tuple[Value, Value]:
    """For columns of directions (N, 1)."""
    u1, u2 = (u.astype(np.float32) for u in low_discrepancy.fibonacci(normals))
    alpha_u, alpha_v, n, i = _inside(lobe, wi)
    # Azimuths from the plane of incidence: the same normals for any axes of a round lobe
    u1 = (u1 + np.arctan2(i[1], i[0]) / (2 * np.pi)) % 1
    h = ggx.sample_visible(i, alpha_u, alpha_v, u1, u2)
    o = ggx.reflect(i, h)
    p2 = n.n * n.n * (o[0] * o[0] + o[1] * o[1])
    value = ops.select(p2 < 1, ggx.masking(o, alpha_u, alpha_v), 0.0)
    # Of reflectances, colours are the leading axis, and light the last one
    if lobe.facets:
        value = value * _flat(lobe.facets, ops.clip(ggx.dot(i, h), 0.0, 1.0))
    if lobe.leaving:
        value = value * _flat(lobe.leaving, ops.sqrt(1 - p2))
    return np.mean(value, axis=-1, dtype=float), np.max(value, axis=-1)


def _single(x: Value, part: slice = slice(None)) -> Value:
    """A number, or part of an array as a column."""
    return float(x) if np.ndim(x) == 0 else np.asarray(x[part], np.float32)[:, None]


def _flat(reflectance: Reflectance, cosine: Value) -> Value:
    """A reflectance at an array of cosines (N, M)."""
    found = reflectance(cosine.ravel())
    return found.reshape(*found.shape[:-1], *cosine.shape) if np.ndim(found) else found


def _inside(lobe: OwnMediumLobe, wi: Direction) -> tuple[Value, Value, Index, Direction]:
    """Roughnesses, the index, and wi refracted into the medium, in the frame of the lobe."""
    alpha_u, alpha_v = ops.maximum(lobe.roughness.alpha_u, ALPHA_MIN), ops.maximum(lobe.roughness.alpha_v, ALPHA_MIN)
    x, y, z = _in_frame(lobe, wi)
    n, z = Index.of(lobe.n), ops.maximum(z, 0.0)
    if n.is_outside:
        return alpha_u, alpha_v, n, (x, y, ops.maximum(z, COS_MIN))
    radius = ops.sqrt(ops.maximum(wi[0] * wi[0] + wi[1] * wi[1], ops.TINY))
    scale = ops.minimum(n.inverse, (1 - 0.5 * COS_MIN * COS_MIN) / radius)
    cosine = ops.sqrt(ops.maximum((n.ring2 + z * z) * (n.inverse * n.inverse), COS_MIN * COS_MIN))
    ops.names(scale=scale, cosine=cosine)
    return alpha_u, alpha_v, n, (scale * x, scale * y, cosine)


def _out(x: Value, y: Value, inverse: Value) -> tuple[Direction, Value]:
    """The direction inside with a momentum, and whether it exists; `inverse` is that of the index."""
    x, y = inverse * x, inverse * y
    cos2 = 1 - x * x - y * y
    return (x, y, ops.sqrt(ops.maximum(cos2, COS_MIN * COS_MIN))), cos2 > 0


def _shown(w: Direction, alpha_u: Value, alpha_v: Value) -> Value:
    """2 w_z over Smith's G1(w), which does not vanish at grazing directions."""
    x, y = alpha_u * w[0], alpha_v * w[1]
    return w[2] + ops.sqrt(ggx.dot((x, y, w[2]), (x, y, w[2])))


def _facing(m: Direction, alpha_u: Value, alpha_v: Value) -> Value:
    """GGX's density D of normals along a vector, of any length, by one division."""
    area = alpha_u * alpha_v
    s = alpha_v * m[0], alpha_u * m[1], area * m[2]
    q = ggx.dot(m, m) * area / ggx.dot(s, s)
    ops.names(area=area, q=q)
    return q * q * area * (1 / pi)


def _in_frame(lobe: OwnMediumLobe, w: Direction) -> Direction:
    return w if _is_straight(lobe.roughness) else ggx.rotate(w, lobe.roughness.rotation)


def _out_of_frame(lobe: OwnMediumLobe, w: Direction) -> Direction:
    return w if _is_straight(lobe.roughness) else ggx.rotate(w, -lobe.roughness.rotation)


def _is_straight(roughness: Roughness) -> bool:
    return isinstance(roughness.rotation, float) and roughness.rotation == 0.0


def _chosen(where: Value, a: Value, b: Value) -> Value:
    """Of two indices."""
    if a is b:
        return a
    return Index(*(ops.select(where, x, y) for x, y in zip(Index.of(a), Index.of(b))))
