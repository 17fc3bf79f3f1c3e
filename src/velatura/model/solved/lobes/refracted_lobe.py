"""A reflected lobe in its own medium: GGX above the interface that reflects it, refracted out.

Snell's law leaves the tangential momentum p = n sin(theta) of light alone. So light from wi that leaves along wo meets
interface k, in a medium of index n_k, from the direction i = (p_i / n_k, c_k(p_i)) towards o = (p_o / n_k, c_k(p_o)),
with c_k(p) = sqrt(1 - p^2 / n_k^2), and leaves with

    f |cos_o| = weight D(h) G1(i) G1(o) / (4 c_k(p_i)) F(i.h) (1 - F_0(cos_o)) cos_o / (n_k^2 c_k(p_o))

with h halfway between i and o (model.md, Eq. 5; `eval_plain`). `eval_pdf` works with momenta n_k i and n_k o, squared
roughnesses, and G1(w) / w_z, which is finite at grazing directions. Indices are relative to the medium outside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.guards import ALPHA_MIN
from velatura.model.solved.guards import COS_INSIDE_MIN
from velatura.model.variance import Roughness
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.renderer import compiled, low_discrepancy
from velatura.renderer.compiled import Found
from velatura.renderer.differentiated import RELATIVE

Array = NDArray[np.floating]

NORMALS = 987  # of the quadrature's lattice; a Fibonacci number
SPARSE = 3  # of so many normals one, for weights
HORIZON = 0.05  # squares of momenta, over roughness and the index, across which samples of an integral fade

Reflectance = Callable[[Value], Value]


@dataclass(frozen=True)
class MediumIndex:
    """An index n relative to the medium outside, and what lobes take of it: its inverse, and the radius of the ring of
    momenta beyond those that can leave, from 1 to n, in squares and as it is. `denser`: whether n is known to be 1 at
    least, so that light from any direction gets in. `edged`: whether light of momenta beyond n is cut off, or n
    is so close to 1 that light at the horizon is curved like a root of it."""

    n: Value
    inverse: Value
    ring2: Value
    ring: Value
    denser: bool = False
    edged: bool = False

    @classmethod
    def of(cls, n: Value, denser: bool = False) -> MediumIndex:
        if isinstance(n, MediumIndex):
            return n
        ring2 = n * n - 1
        return cls(n, 1 / n, ring2, ops.sqrt(ops.maximum(ring2, 0.0)), denser)

    @staticmethod
    def selected(where: Value, a: MediumIndex, b: MediumIndex) -> MediumIndex:
        """The index a where a condition holds, else b; denser if both are."""
        n, inverse, ring2, ring = (
            ops.select(where, getattr(a, x), getattr(b, x)) for x in ("n", "inverse", "ring2", "ring")
        )
        return MediumIndex(n, inverse, ring2, ring, a.denser and b.denser, a.edged or b.edged)

    @property
    def is_outside(self) -> bool:
        """Whether it is known to be that of the medium outside."""
        return isinstance(self.n, float) and self.n == 1.0


@dataclass(frozen=True)
class RefractedLobe(ops.NamedFields):
    """A lobe of `weight` (a colour) times a GGX reflection of `roughness` in a medium of index `n`, a number or an
    `MediumIndex`, refracted out.

    `facets` is the Fresnel reflectance of the facets by the square of a cosine, and `leaving` the share of light at a
    cosine outside that the first interface lets out; None where the weight has all of it, or nothing lies above.
    `grazing`: whether it lets any out along the horizon. With the energy over the `integral` as weight, the lobe has
    that energy.
    """

    weight: Value
    roughness: Roughness
    n: Value = 1.0
    facets: Reflectance | None = None
    leaving: Reflectance | None = None
    grazing: bool = False


def eval_pdf(lobe: RefractedLobe, wi: Direction, wo: Direction) -> tuple[Value, Value]:
    """f(wi, wo) |cos theta_o|, a colour, and the density of `sample`; both 0 unless wi and wo are above the surface."""
    n = MediumIndex.of(lobe.n)
    ends = ops.around(n.n, RELATIVE) if n.edged else None
    if ends is None:
        return _eval_pdf(lobe, wi, wo)
    # The edge moves with the index: slopes by it are differences, over the step that those of weights are
    low, at, high = ends
    if n.denser:
        low = ops.select(low < 1, at, low)
    (below, _), (value, density), (above, _) = (
        _eval_pdf(replace(lobe, n=MediumIndex.of(each, n.denser)), wi, wo) for each in (low, at, high)
    )
    return value + (above - below) * ((n.n - at) / (high - low)), density


def _eval_pdf(lobe: RefractedLobe, wi: Direction, wo: Direction) -> tuple[Value, Value]:
    alpha_u, alpha_v, n, i = _inside(lobe, wi)
    p = _in_frame(lobe, wo)
    cos_o = ops.select(wi[2] > 0, ops.maximum(wo[2], 0.0), 0.0)
    # Reflect in the medium
    o, area = (p[0], p[1], _height(n, wo[2])), alpha_u * alpha_v
    squares = alpha_u * alpha_u, alpha_v * alpha_v, area * area
    m = _squares((i[0] + o[0], i[1] + o[1], i[2] + o[2]))
    shown, facing = _shown(o, _height2(n, wo[2]), squares), _facing(m, squares)
    ops.names(i=i, o=o, m=m, area=area, shown=shown, facing=facing)
    seen = cos_o * (0.5 / pi) * (area * squares[2]) / (_shown(i, _height2(n, wi[2]), squares) * shown * o[2])
    if not (n.is_outside or n.denser):
        seen = ops.select(n.ring2 + wo[2] * wo[2] > 0, seen, 0.0)
    light = seen * (o[2] + o[2]) * facing
    if lobe.facets:
        # Half the angle between i and o
        light = light * lobe.facets((m[0] + m[1] + m[2]) * (0.25 * n.inverse * n.inverse))
    if lobe.leaving:
        light = light * lobe.leaving(cos_o)
    density = facing
    # Add what falls outside the cone, and is spread over it
    if not n.is_outside:
        p2 = ops.maximum(wo[0] * wo[0] + wo[1] * wo[1], ops.TINY)
        far, stretch = _far(i, (p[0], p[1]), p2, n)
        m = _squares(far)
        ops.names(p2=p2, stretch=stretch, m_far=m)
        density = density + 2 * n.ring * o[2] * _facing(m, squares)
    return lobe.weight * light, seen * shown * density


def eval_plain(lobe: RefractedLobe, wi: Direction, wo: Direction) -> Value:
    """The value of `eval_pdf` as it is printed, for directions above whose light is inside; the reference of a test."""
    n, alpha = MediumIndex.of(lobe.n).n, (lobe.roughness.alpha_u, lobe.roughness.alpha_v)
    i, o = (
        (x / n, y / n, ops.sqrt(1 - (x * x + y * y) / (n * n))) for x, y, _ in (_in_frame(lobe, w) for w in (wi, wo))
    )
    h = ggx.normalize((i[0] + o[0], i[1] + o[1], i[2] + o[2]))
    facets = lobe.facets(ggx.dot(i, h) * ggx.dot(i, h)) if lobe.facets else 1.0
    leaving = lobe.leaving(wo[2]) if lobe.leaving else 1.0
    # model.md, Eq. 5
    light = ggx.ndf(h, *alpha) * ggx.masking(i, *alpha) * ggx.masking(o, *alpha) / (4 * i[2])
    return lobe.weight * light * facets * leaving * wo[2] / (n * n * o[2])


def sample(lobe: RefractedLobe, wi: Direction, u1: Value, u2: Value) -> Direction:
    """A direction wo from uniform numbers, by a normal visible inside.

    Momenta outside the cone, a ring of radii 1 to n, are spread over the disc inside: to the fourth root of
    (n^2 - p^2) / (n^2 - 1), which keeps the density finite. The direction may lie below the surface, where `eval_pdf`
    is 0.
    """
    alpha_u, alpha_v, n, i = _inside(lobe, wi)
    o = ggx.reflect(i, ggx.sample_visible(i, alpha_u, alpha_v, u1, u2))
    if n.is_outside:
        return _out_of_frame(lobe, o)
    p2 = o[0] * o[0] + o[1] * o[1]
    r2 = ops.select(p2 > 1, ops.minimum(ops.divide(ops.absolute(o[2]), n.ring), 1.0), p2)
    scale = ops.select(p2 > 1, ops.sqrt(r2 / ops.maximum(p2, 1.0)), 1.0)
    z = ops.sqrt(1 - r2)
    ops.names(o=o, p2=p2, r2=r2, scale=scale, z=z)
    return _out_of_frame(lobe, (scale * o[0], scale * o[1], ops.select(o[2] > 0, z, -z)))


def either(where: Value, a: RefractedLobe, b: RefractedLobe) -> RefractedLobe:
    """A lobe to `sample`: that of a where a condition holds, else of b."""
    roughness = Roughness(*(ops.select(where, x, y) for x, y in zip(a.roughness, b.roughness)))
    return RefractedLobe(1.0, roughness, ops.select_record(where, MediumIndex.of(a.n), MediumIndex.of(b.n)))


def integral(lobe: RefractedLobe, wi: Direction, normals: int = NORMALS) -> Value:
    """Albedo of a lobe in NumPy, (N,), or (C, N) of a colour, for directions wi and its roughness, (N,) each.

    A mean over visible normals on a lattice of a Fibonacci number of them; within .3 % on average.
    """
    directions, numbers = _split(lobe, wi)
    return lobe.weight * _mean(
        compiled.over(_values, directions, low_discrepancy.fibonacci(normals), numbers)[0], normals
    )


def integrals(lobe: RefractedLobe, wi: Direction, normals: int = NORMALS) -> tuple[Value, Value, Value]:
    """Mean of the weights of samples, and of their squares, and the largest one, as `integral`, for a weight of 1."""
    directions, numbers = _split(lobe, wi)
    u1, u2 = low_discrepancy.fibonacci(normals)
    few = (np.arange(len(u1)) % SPARSE == 0).astype(float)
    sums, largest, _ = compiled.over(_weights, directions, (u1, u2, few), numbers)
    values, squares = np.split(sums, 2)
    return _mean(values, len(u1)), _mean(squares, int(few.sum())), largest if len(largest) > 1 else largest[0]


def integrals_of_facets(lobe: RefractedLobe, wi: Direction, normals: int = NORMALS) -> tuple[Value, Value]:
    """Albedo of a lobe of weight 1 whose facets reflect all light, and of the lobe, as `integral`."""
    directions, numbers = _split(lobe, wi)
    sums, _, _ = compiled.over(_both, directions, low_discrepancy.fibonacci(normals), numbers)
    return _mean(sums[:1], normals), _mean(sums[1:], normals)


def _mean(sums: Array, count: int) -> Array:
    return (sums if len(sums) > 1 else sums[0]) / count


def _split(lobe: RefractedLobe, wi: Direction) -> tuple[list[Array], list[Any]]:
    """Numbers of each direction, and those of a lobe for all."""
    numbers = [*wi, *lobe.roughness]
    varying = [x for x in numbers if np.ndim(x)]
    fixed = [None if np.ndim(x) else x for x in numbers]
    return varying, [fixed, MediumIndex.of(lobe.n), lobe.facets, lobe.leaving, lobe.grazing]


def _joined(directions: Sequence[Value], numbers: Any) -> tuple[RefractedLobe, Direction]:
    fixed, n, facets, leaving, grazing = numbers
    varying = iter(directions)
    x, y, z, *roughness = (next(varying) if value is None else value for value in fixed)
    return RefractedLobe(1.0, Roughness(*roughness), n, facets, leaving, grazing), (x, y, z)


def _values(directions: Sequence[Value], lattice: Sequence[Value], numbers: Any) -> Found:
    return Found([_sampled(*_joined(directions, numbers), *lattice)[0]])


def _both(directions: Sequence[Value], lattice: Sequence[Value], numbers: Any) -> Found:
    lobe, wi = _joined(directions, numbers)
    return Found([_sampled(each, wi, *lattice)[0] for each in (replace(lobe, facets=None), lobe)])


def _weights(directions: Sequence[Value], lattice: Sequence[Value], numbers: Any) -> Found:
    lobe, wi = _joined(directions, numbers)
    u1, u2, few = lattice
    value, i, o = _sampled(lobe, wi, u1, u2)
    alpha_u, alpha_v, n, _ = _inside(lobe, wi)
    weights = value
    if not n.is_outside:
        # The light from outside the cone is spread over samples
        squares = alpha_u * alpha_u, alpha_v * alpha_v, (alpha_u * alpha_v) * (alpha_u * alpha_v)
        p2 = ops.maximum(o[0] * o[0] + o[1] * o[1], ops.TINY)
        near = 0.5 * _facing(_squares((i[0] + o[0], i[1] + o[1], i[2] + o[2])), squares)
        far = n.ring * o[2] * _facing(_squares(_far(i, (o[0], o[1]), p2, n)[0]), squares)
        weights = value * (near / (near + ops.maximum(far, 0.0)))
    return Found([value, few * weights * value], [few * weights])


def _sampled(lobe: RefractedLobe, wi: Direction, u1: Value, u2: Value) -> tuple[Value, Direction, Direction]:
    """Weight of a sample from wi, its momentum inside, and that of the sample."""
    alpha_u, alpha_v, n, i = _inside(lobe, wi)
    # Azimuths from the plane of incidence: the same normals for any axes of a round lobe
    h = ggx.sample_visible(i, alpha_u, alpha_v, u1 + ops.arctan2(i[1], i[0]) * (0.5 / pi), u2)
    o = ggx.reflect(i, h)
    p2 = o[0] * o[0] + o[1] * o[1]
    if lobe.grazing:
        # Samples about the horizon count in part, as much less above it as more below, so that none jumps
        inside = ops.clip(0.5 + (1 - p2) / (HORIZON * n.n * ops.maximum(alpha_u, alpha_v)), 0.0, 1.0)
        above = ops.absolute(1 - p2)
    else:
        inside, above = ops.select(p2 < 1, 1.0, 0.0), 1 - p2
    value = inside * ggx.masking(o, alpha_u, alpha_v)
    if lobe.facets:
        cosine = ops.clip(ggx.dot(i, h) * n.inverse, 0.0, 1.0)
        value = value * _flat(lobe.facets, cosine * cosine)
    if lobe.leaving:
        value = value * _flat(lobe.leaving, ops.sqrt(above))
    return value, i, o


def _flat(reflectance: Reflectance, cosine: Value) -> Value:
    """A reflectance at cosines; at an array of NumPy (N, M), with colours as the leading axis."""
    if not isinstance(cosine, np.ndarray):
        return reflectance(cosine)
    found = reflectance(cosine.ravel())
    return found.reshape(*found.shape[:-1], *cosine.shape) if np.ndim(found) else found


def _inside(lobe: RefractedLobe, wi: Direction) -> tuple[Value, Value, MediumIndex, Direction]:
    """Roughnesses, the index, and the momentum of light from wi in the medium, in the frame of the lobe."""
    alpha_u, alpha_v = ops.maximum(lobe.roughness.alpha_u, ALPHA_MIN), ops.maximum(lobe.roughness.alpha_v, ALPHA_MIN)
    x, y, z = _in_frame(lobe, wi)
    n = MediumIndex.of(lobe.n)
    if n.is_outside or n.denser:
        return alpha_u, alpha_v, n, (x, y, _height(n, z))
    inverse = 1 / ops.sqrt(wi[0] * wi[0] + wi[1] * wi[1], ops.TINY)
    scale = ops.minimum(n.n * ((1 - 0.5 * COS_INSIDE_MIN * COS_INSIDE_MIN) * inverse), 1.0)
    height = _height(n, z)
    ops.names(scale=scale, height=height)
    return alpha_u, alpha_v, n, (scale * x, scale * y, height)


def _height(n: MediumIndex, z: Value) -> Value:
    """Height, along the normal, of the momentum inside, of light with a cosine outside."""
    return ops.maximum(z, COS_INSIDE_MIN) if n.is_outside else ops.sqrt(_height2(n, z), None)


def _height2(n: MediumIndex, z: Value) -> Value:
    """Its square."""
    if n.is_outside:
        return _height(n, z) * _height(n, z)
    return ops.maximum(n.ring2 + z * z, COS_INSIDE_MIN * COS_INSIDE_MIN)


def _squares(w: Direction) -> Direction:
    return w[0] * w[0], w[1] * w[1], w[2] * w[2]


def _far(i: Direction, p: tuple[Value, Value], p2: Value, n: MediumIndex) -> tuple[Direction, Value]:
    """Vector along the normal of light from outside the cone that is spread to a momentum p inside, and its scale."""
    stretch = ops.sqrt((n.ring2 + 1) * (1 / p2) - n.ring2 * p2)
    return (i[0] + stretch * p[0], i[1] + stretch * p[1], i[2] + n.ring * p2), stretch


def _shown(w: Direction, z2: Value, squares: Direction) -> Value:
    """2 w_z over Smith's G1(w), which does not vanish at grazing directions, by the square of w_z."""
    return w[2] + ops.sqrt(w[0] * w[0] * squares[0] + w[1] * w[1] * squares[1] + z2, None)


def _facing(m: Direction, squares: Direction) -> Value:
    """pi D / (alpha_u alpha_v)^3, of GGX's density D of normals along a vector of any length, by its squares, those of
    roughnesses, and that of their product."""
    q = (m[0] + m[1] + m[2]) / ggx.dot((squares[1], squares[0], squares[2]), m)
    ops.names(q=q)
    return q * q


def _in_frame(lobe: RefractedLobe, w: Direction) -> Direction:
    return w if _is_straight(lobe.roughness) else ggx.rotate(w, lobe.roughness.rotation)


def _out_of_frame(lobe: RefractedLobe, w: Direction) -> Direction:
    return w if _is_straight(lobe.roughness) else ggx.rotate(w, -lobe.roughness.rotation)


def _is_straight(roughness: Roughness) -> bool:
    return isinstance(roughness.rotation, float) and roughness.rotation == 0.0
