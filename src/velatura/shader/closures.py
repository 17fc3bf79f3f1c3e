"""The light of a material as a sum of closures, for languages that have no functions of two directions.

Lobes depend on the direction of view alone, so a shader works out their energies and roughnesses and returns a sum of
closures of reflectance 1. What differs from the model is measured by `losses`: masking is correlated by the height of
facets, as renderers have it; lobes in their own media are drawn outside; all other light is diffuse.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import isclose, pi
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model import Model, variance_kind
from velatura.model.base import Query
from velatura.model.context import at_a_point
from velatura.model.directions import upright
from velatura.model.guards import ALPHA_MIN
from velatura.model.lobe_statistics import LobeStatistics, StackLobes
from velatura.model.papers import bsdf
from velatura.model.roughness_maps import AS_IT_IS
from velatura.model.side_by_side import SideBySide
from velatura.model.variance import Covariance, Isotropic, PerAxis, Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel, ggx, refraction
from velatura.optics.directions import directions
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid
from velatura.renderer.directional_grid import Curves
from velatura.renderer.low_discrepancy import fibonacci, square
from velatura.shader.lookups import films
from velatura.shader.recorder import recording
from velatura.stack import Address, Brushing, Described, Material, Stack, Texture
from velatura.stack import number as plain
from velatura.stack.mix import WEIGHT

Array = NDArray[np.floating]

LINE, PLANE = (128,), (32, 17)  # nodes over the cosine, and the azimuth where an interface is brushed
COS_MIN = 1e-3  # of directions at nodes
STRAIGHT = 3.0  # index at which light that goes straight on is spread
SPREAD = 2 / (1 - 1 / STRAIGHT)  # of its roughness
LEAST = 0.5  # share of a closure's light that passes: below, light passes in all directions
FAINT = 1e-6  # weight, below which there is no closure
SAMPLES = 377  # of the albedo of a closure
COSINES = (1.0, 0.7, 0.35)  # of directions for which losses are given
PAIRS = 2**13  # of samples of each, of the model and of the closures

Kind = Literal["reflection", "refraction", "straight", "diffuse", "translucent"]


class Closure(NamedTuple):
    """A closure for one direction: its weight, a colour; for facets their roughness, and the index beyond over that on
    the side of the light.

    Refraction that goes `straight` on bends nothing: its facets lie about the direction of view.
    """

    kind: Kind
    weight: Value
    roughness: Roughness = Roughness(1.0, 1.0, 0.0)
    eta: Value = 1.0


Closures = Callable[[Direction], list[Closure]]


def of_body(body: bsdf.Lobed, wi: Direction, straight: bool) -> list[Closure]:
    """The closures for light from wi, of lobes that a model draws outside; `straight` if light leaves into the medium
    that it comes from."""
    seen, w = bsdf.scattered(body, wi), upright(wi, wi)
    found = [
        Closure("reflection", lobe.energy * _separable(w, lobe.roughness), bounded(lobe.roughness))
        for lobe in seen.reflected
    ]
    if seen.base:
        found.append(Closure("diffuse", seen.base.energy))
    if seen.transmitted:
        found.append(_through(seen.transmitted.energy, seen.transmitted.roughness, w, seen.eta, straight))
    return found


def in_closed_form(
    stack: Stack, model: Model, constant: Collection[str], wi: Direction
) -> tuple[list[Closure], Closures]:
    """The closures of a model in closed form: for a recorded wi, of inputs for all values that are not `constant`, and
    in NumPy of `numbers`."""
    known = numbers(stack)
    body = bsdf.body(known, model)
    straight = known.transmits and isclose(np.mean(body.eta), 1.0)
    constants = {*constant, *films.beside(stack)}
    recorded = films.recorded(recording.symbols(stack, constants), stack, general=False)
    found = of_body(bsdf.body(recorded, model, recording.variance(stack), at_a_point()), wi, straight)
    return found, partial(of_body, body, straight=straight)


def numbers(stack: Stack) -> Material:
    """A stack with numbers in place of what varies: those of texels of .5."""
    return Material.of(stack, _number).solid()


def shares(material: Described) -> list[float]:
    """The share of every stack, by the same numbers."""
    weights = {at.name: _number(at, value) for at, value in material.values() if at.declared is WEIGHT}
    return [float(share) for share in material.shares(weights)]


def _number(address: Address, described: Any) -> Value:
    if isinstance(described, Texture):
        return float(np.clip(0.5 * described.scale + described.offset, *address.declared.within))
    return described.offset if isinstance(described, Brushing) else plain(address, described)


def weighted(shares: Iterable[Value], each: Iterable[Sequence[Closure]]) -> list[Closure]:
    """The closures of all stacks, by the shares of these."""
    return [closure._replace(weight=closure.weight * share) for share, own in zip(shares, each) for closure in own]


def side_by_side(shares: Sequence[float], each: Sequence[Closures]) -> Closures:
    """The closures of stacks with these shares."""
    return lambda wi: weighted(shares, [closures(wi) for closures in each])


def _separable(w: Direction, roughness: Roughness) -> Value:
    """Albedo of a GGX reflection with separable masking over that with masking correlated by height: a fit within .006
    for cosines of .1 and more."""
    u, v, _ = roughness
    x, y, z = ggx.rotate(w, roughness.rotation)
    sin2, cos2 = ops.maximum(1 - z * z, ops.TINY), ops.maximum(z * z, 1e-6)
    along2 = (u * u * x * x + v * v * y * y) / sin2
    hidden = ops.sqrt(1 + along2 * sin2 / cos2)
    m, a = (hidden - 1) / (hidden + 1), ops.sqrt(along2)
    polynomial = 0.7525 - 0.14 * a - 0.9354 * m - 0.105 * m * a + 0.6987 * m * m + 0.2909 * a * a - 0.6575 * z
    return 1 / (1 + ops.maximum(m * a * polynomial, 0.0))


def _through(energy: Value, roughness: Roughness, w: Direction, eta: Value, straight: bool) -> Closure:
    """Light that passes, of a lobe about the refracted direction: to first order as wide in tangential momentum, but
    alike along all axes, since Cycles refracts so."""
    u, v, _ = bounded(roughness)
    alpha = ops.sqrt(u * v)
    if straight:
        alpha = ops.clip(SPREAD * alpha * ops.sqrt(w[2]), ALPHA_MIN, 1.0)
        return Closure("straight", energy, Roughness(alpha, alpha, 0.0), STRAIGHT)
    inside = eta * fresnel.cos_transmitted(w[2], eta)
    alpha = ops.clip(alpha * ops.divide(2 * inside, ops.absolute(inside - w[2])), ALPHA_MIN, 1.0)
    return Closure("refraction", energy, Roughness(alpha, alpha, 0.0), eta)


def bounded(roughness: Roughness) -> Roughness:
    """A roughness that facets can have."""
    u, v, rotation = roughness
    return Roughness(ops.clip(u, ALPHA_MIN, 1.0), ops.clip(v, ALPHA_MIN, 1.0), rotation)


# TabulatedClosures over direction


class ColumnReader(NamedTuple):
    """Columns at a direction, by their place: one as a number, or the three from there on as a colour."""

    number: Callable[[int], Value]
    colour: Callable[[int], Value]

    @classmethod
    def of(cls, values: Sequence[Value], colour: Callable[..., Value]) -> ColumnReader:
        """Columns by all their numbers, and a function that makes a colour of three."""
        return cls(values.__getitem__, lambda k: colour(*values[k : k + 3]))


@dataclass(frozen=True)
class TabulatedClosures:
    """The closures of a uniform material over direction, from above and, where it transmits, from below: `rows` (sides,
    nodes, columns). `kinds` are those of the closures, `etas` the relative index beyond, by side. Where roughness has
    no rotation (`variance` is PerAxis) its first axis lies in the plane of incidence."""

    kinds: Sequence[Kind]
    variance: type[Variance]
    shape: tuple[int, ...]
    etas: Sequence[float]
    rows: Array

    def at(self, wi: Direction, read: Callable[[Direction], ColumnReader], eta: Value) -> list[Closure]:
        """The closures for light from wi, of the columns that are read at an upright direction."""
        columns, k, found = read(upright(wi, wi)), 0, list[Closure]()
        for kind in self.kinds:
            weight, k = columns.colour(k), k + 3
            if kind in _SMOOTH:
                found.append(Closure(kind, weight))
                continue
            variance = _variance(kind, self.variance)
            count = len(variance.__dataclass_fields__)
            u, v, rotation = variance(*map(columns.number, range(k, k + count))).roughness(AS_IT_IS)
            k += count
            if variance is PerAxis:
                rotation = ops.arctan2(wi[1], wi[0])
            found.append(Closure(kind, weight, Roughness(u, v, rotation), STRAIGHT if kind == "straight" else eta))
        return found

    def above(self, wi: Direction) -> list[Closure]:
        """The closures in NumPy, for light from above."""
        curves = Curves(self.rows[0].reshape(*self.shape, -1), self.shape)
        return self.at(wi, lambda w: ColumnReader.of(curves(w), lambda *three: np.stack(three)), self.etas[0])


_SMOOTH = ("diffuse", "translucent")


def _variance(kind: Kind, variance: type[Variance]) -> type[Variance]:
    """Kind of variance of the columns of a closure."""
    return variance if kind == "reflection" else Isotropic


def tabulated(material: Material, model: Model, conserving: bool = False) -> TabulatedClosures:
    """The closures of a material with values in NumPy, as `velatura.lobes` reports its lobes; for renderers whose
    facets are `conserving`, all light that they block leaves again."""
    isotropic = variance_kind(material) is Isotropic
    shape, variance = (LINE, PerAxis) if isotropic else (PLANE, Covariance)
    x, y, z = (np.ravel(w) for w in directional_grid.directions(shape, None))
    z = np.maximum(z, COS_MIN)
    scale = np.sqrt((1 - z * z) / (x * x + y * y))
    w = x * scale, y * scale, z
    sides = [material, material.reversed()] if material.transmits else [material]
    etas = [float(np.mean(side.below) / np.mean(side.exterior)) if material.transmits else 1.0 for side in sides]
    each = [_at_nodes(side, model, w, eta, conserving) for side, eta in zip(sides, etas)]
    of_each = enumerate(zip(*each, strict=True))
    bright = [k for k, closures in of_each if max(np.max(c.weight) for c in closures) > FAINT]
    kept = bright or [0]
    rows = np.array([np.concatenate([_columns(closures[k], variance) for k in kept]).T for closures in each])
    return TabulatedClosures(
        [each[0][k].kind for k in kept], variance, shape, etas, rows.astype(np.float32).astype(float)
    )


def _at_nodes(side: Material, model: Model, w: Direction, eta: float, conserving: bool) -> list[Closure]:
    """Closures at directions (N,) on a side; models in closed form lose the light that facets block."""
    if not model.closed_form:
        return _of_statistics(model.statistics(side, w), w, eta, conserving)
    found = of_body(bsdf.body(side, model), w, straight=side.transmits and abs(eta - 1) < FAINT)
    return [c._replace(weight=c.weight * albedo(c, w)) if conserving and c.kind not in _SMOOTH else c for c in found]


def _of_statistics(lobes: StackLobes, w: Direction, eta: float, conserving: bool) -> list[Closure]:
    """Closures of the energies of lobes at directions (N,)."""

    def facets(energy: Array, alpha: Array, rotation: Array) -> Closure:
        own = bounded(Roughness(alpha[0], alpha[1], rotation))
        closure = Closure("reflection", energy, own)
        return closure if conserving else closure._replace(weight=energy / albedo(closure, w))

    found = [facets(*each) for each in zip(lobes.energy, lobes.alpha, lobes.rotation)]
    found.append(Closure("diffuse", np.maximum(lobes.remainder, 0.0)))
    passed: LobeStatistics | None = lobes.transmitted
    if passed:
        u, v = passed.alpha
        closure = _through(passed.energy, Roughness(u, v, passed.rotation), w, eta, abs(eta - 1) < FAINT)
        through = np.ones_like(w[2]) if conserving else albedo(closure, w)
        weight = passed.energy / np.maximum(through, LEAST)
        found += [closure._replace(weight=weight), Closure("translucent", passed.energy - weight * through)]
    return found


def _columns(closure: Closure, variance: type[Variance]) -> Array:
    if closure.kind in _SMOOTH:
        return np.asarray(closure.weight)
    own = vars(_variance(closure.kind, variance).of(closure.roughness, AS_IT_IS)).values()
    return np.concatenate([closure.weight, np.stack(np.broadcast_arrays(*own))])


# As renderers evaluate them


def albedo(closure: Closure, wi: Direction) -> Array:
    """Share of light from upright directions wi (N,) that a closure of weight 1 keeps."""
    u1, u2 = fibonacci(SAMPLES)
    *roughness, eta = (np.reshape(x, (-1, 1)) for x in (*closure.roughness, closure.eta))
    one = closure._replace(weight=1.0, roughness=Roughness(*roughness), eta=eta)
    w = tuple(np.reshape(x, (-1, 1)) for x in wi)
    wo = sample(one, w, u1, u2)  # type: ignore[arg-type]
    value, density = eval_pdf(one, w, wo)  # type: ignore[arg-type]
    return np.mean(ops.divide(value, density), axis=-1)


def evaluate(closures: Sequence[Closure], wi: Direction, wo: Direction) -> tuple[Value, Value]:
    """f(wi, wo) |cos theta_o| of a sum, a colour, and the density of `_samples`; wi is above, wo on either side."""
    shares = _shares(closures)
    each = [eval_pdf(closure, wi, wo) for closure in closures]
    value = sum(closure.weight * value for closure, (value, _) in zip(closures, each))
    return value, sum(share * density for share, (_, density) in zip(shares, each))


def _shares(closures: Sequence[Closure]) -> Array:
    """Chances of sampling each."""
    weights = np.array([np.mean(closure.weight) for closure in closures]) + FAINT
    return np.asarray(weights / weights.sum())


def _samples(closures: Sequence[Closure], wi: Direction, count: int) -> Direction:
    """Directions (count,) for light from one."""
    u1, u2 = square(count)
    u = (np.arange(count) + 0.5) / count
    number = np.searchsorted(np.cumsum(_shares(closures))[:-1], u)
    found = np.zeros((3, count))
    for k, closure in enumerate(closures):
        own = number == k
        found[:, own] = sample(closure, wi, u1[own], u2[own])
    return found[0], found[1], found[2]


def sample(closure: Closure, wi: Direction, u1: Value, u2: Value) -> Direction:
    """A direction for light from above, of length 0 where facets throw light to the wrong side."""
    passes = closure.kind not in ("reflection", "diffuse")
    if closure.kind in _SMOOTH:
        radius, phi = ops.sqrt(u1), 2 * pi * u2
        z = ops.sqrt(1 - u1)
        return radius * ops.cos(phi), radius * ops.sin(phi), -z if passes else z
    u, v, _ = closure.roughness
    i = _into(closure, wi, wi)
    h = ggx.sample_visible(i, u, v, u1, u2)
    x, y, z = _out_of(closure, wi, refraction.refract(i, h, closure.eta) if passes else ggx.reflect(i, h))
    through = fresnel.cos_transmitted(ggx.dot(i, h), closure.eta) > 0
    there = (z < 0) & through if passes else z > 0
    return ops.select(there, x, 0.0), ops.select(there, y, 0.0), ops.select(there, z, 0.0)


def eval_pdf(closure: Closure, wi: Direction, wo: Direction) -> tuple[Value, Value]:
    """f(wi, wo) |cos theta_o| of a closure of weight 1, for light from above, and the density of `sample`."""
    if closure.kind in _SMOOTH:
        cosine = ops.maximum(-wo[2] if closure.kind == "translucent" else wo[2], 0.0) / pi
        return cosine, cosine
    u, v, _ = closure.roughness
    reflects = closure.kind == "reflection"
    eta = 1.0 if reflects else closure.eta
    i, o = _into(closure, wi, wi), _into(closure, wi, wo)
    h = refraction.half_vector(i, o, eta)
    cos_i, cos_o = ggx.dot(i, h), ggx.dot(o, h)
    there = (o[2] > 0) & (wo[2] > 0) if reflects else (o[2] < 0) & (wo[2] < 0) & (cos_i > 0) & (cos_o < 0)
    lit, seen = ggx.masking(i, u, v), ggx.masking((o[0], o[1], ops.absolute(o[2])), u, v)
    facing = ggx.ndf(h, u, v) * lit * ops.divide(ops.maximum(cos_i, 0.0), i[2])
    density = facing * refraction.jacobian(cos_i, cos_o, eta)
    # Masking is correlated by the height of facets (Heitz 2014, Eq. 99)
    value = density * ops.divide(seen, lit + seen - lit * seen)
    return ops.select(there, value, 0.0), ops.select(there, density, 0.0)


def _into(closure: Closure, wi: Direction, w: Direction) -> Direction:
    """A direction in the frame of a closure's facets."""
    if closure.kind != "straight":
        return ggx.rotate(w, closure.roughness.rotation)
    x, y, z = _about(wi)
    return ggx.dot(w, x), ggx.dot(w, y), ggx.dot(w, z)


def _out_of(closure: Closure, wi: Direction, w: Direction) -> Direction:
    if closure.kind != "straight":
        return ggx.rotate(w, -closure.roughness.rotation)
    a, b, c = (w[0] * x + w[1] * y + w[2] * z for x, y, z in zip(*_about(wi)))
    return a, b, c


def _about(wi: Direction) -> tuple[Direction, Direction, Direction]:
    """Axes about a direction, the first in the plane of incidence."""
    c, s = ggx.plane(wi)
    sine = ops.sqrt(1 - wi[2] * wi[2])
    return (c * wi[2], s * wi[2], -sine), (-s, c, 0.0 * c), wi


# What is lost


@dataclass(frozen=True)
class Loss:
    """Difference of closures from a model in light from one direction: total variation, which is half the sum of the
    differences over the light; and the greatest difference of albedo, over the colours."""

    cosine: float
    variation: float
    albedo: float

    def __str__(self) -> str:
        return f"cosine {self.cosine:g}: {self.variation:.3f} of the light, albedo {self.albedo:.4f}"


def losses(materials: Iterable[tuple[float, Material]], model: Model, closures: Closures) -> Iterator[Loss]:
    """Losses of the closures of materials with shares and values in NumPy, for light from above."""
    body = SideBySide.of(((share, each.solid()) for share, each in materials), model)
    asked = Query(radiance=False)
    u1, u2 = square(PAIRS)
    u = (np.arange(PAIRS) + 0.5) / PAIRS
    for cosine, direction in zip(COSINES, directions(COSINES, 0.0)):
        x, y, z = np.repeat(direction[:, None], PAIRS, axis=1)
        one = x[:1], y[:1], z[:1]
        found = closures(one)
        mine = _samples(found, one, PAIRS)
        theirs = body.sample((x, y, z), u, u1, u2, asked)
        truth, approximate = np.zeros(3), np.zeros(3)
        apart = 0.0
        for wo in (mine, theirs):
            value, density = body.eval_pdf((x, y, z), wo, asked)
            other, also = evaluate(found, one, wo)
            value, other = np.broadcast_to(value, (3, PAIRS)), np.broadcast_to(other, (3, PAIRS))
            share = 1 / np.maximum(density + also, ops.TINY) / PAIRS
            truth, approximate = truth + (value * share).sum(axis=1), approximate + (other * share).sum(axis=1)
            apart += 0.5 * float(np.sum(np.abs(value - other) * share))
        yield Loss(cosine, apart / (float(truth.sum()) or 1.0), float(np.max(np.abs(approximate - truth))))
