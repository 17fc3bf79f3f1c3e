"""A uniform material, solved once for all directions: its lobes in their own media, the remainder, and what passes.

Energies over integrals, widths and probabilities are columns of numbers over direction. A side is a material as light
from above sees it; stacks that transmit have two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from velatura import ops
from velatura.model import own_medium, passed, remainder, straight_through, widths
from velatura.model.context import Context
from velatura.model.models import Model
from velatura.model.own_medium import OwnMediumLobe
from velatura.model.passed import Parts
from velatura.model.precomputed_lobes import _AS_IT_IS
from velatura.model.prepare import Prepared, PreparedInterface, PreparedMedium, prepare
from velatura.model.remainder import Remainder
from velatura.model.straight_through import Passage
from velatura.model.transport.adding import parts
from velatura.model.transport.energies import INCIDENCES, Energies, energies
from velatura.model.transport.interfaces import Facets
from velatura.model.variance import Covariance, Isotropic, PerAxis, Roughness, Variance
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.sampling import directional_grid
from velatura.stack import Material
from velatura.tables import Tables

Array = NDArray[np.floating]

COSINES = 48  # nodes, even in the root of the cosine
AZIMUTHS = 12  # in half a turn, where interfaces are brushed
COS_MIN = 1e-3
VEIL_MIN = 1e-3  # energy of veils that are drawn
FAINT = 1e-9


@dataclass(frozen=True)
class Shape:
    """A lobe but for its columns: index of its medium, the facets that it is of and what lets it out."""

    n: Value
    facets: PreparedInterface | None
    first: PreparedInterface | None

    def lobe(self, weight: Value, roughness: Roughness) -> OwnMediumLobe:
        reflect = self.facets.reflect if self.facets else None
        return OwnMediumLobe(weight, roughness, self.n, reflect, self._leaving if self.first else None)

    def _leaving(self, cosine: Value) -> Value:
        assert self.first
        return 1 - self.first.reflect(cosine)


@dataclass(frozen=True)
class Columns:
    """What depends on direction: one direction's, or arrays (C, M) and (M,) over directions.

    `weights`, `roughness` and `chances` are those of lobes; of the remainder `scale` and `chance`.
    """

    weights: list[Value]
    roughness: list[tuple[Value, ...]]
    chances: list[Value]
    energies: list[Value]
    scale: Value
    chance: Value
    rest: Value
    passes: Parts | None
    passed: Value | None


@dataclass(frozen=True)
class Side:
    """One side of a solved material, in a renderer's numbers."""

    curves: Any
    shapes: tuple[Shape, ...]
    polynomial: Remainder
    passage: Passage | None
    colour: Callable[..., Value]
    kind: type[Variance]

    def at(self, w: Direction) -> Columns:
        """The columns for a direction above."""
        channels = iter(self.curves(w))
        count = len(self.colour())

        def colour() -> Value:
            return self.colour(*(next(channels) for _ in range(count)))

        weights, roughness, chances, found = [], [], [], []
        for _ in self.shapes:
            weights.append(colour())
            found.append(colour())
            roughness.append(tuple(next(channels) for _ in fields(self.kind)))
            chances.append(next(channels))
        scale, rest, chance = colour(), colour(), next(channels)
        passes, through = None, None
        if self.passage:
            passes = Parts(colour(), colour(), colour(), *(next(channels) for _ in range(3)))
            through = colour()
        return Columns(weights, roughness, chances, found, scale, chance, rest, passes, through)


@dataclass(frozen=True)
class Solved:
    """A uniform material as a BSDF."""

    above: Side
    below: Side | None
    eta: Value
    even: float = 0.0
    scaling: None = None


def solve(material: Material, model: Model, variance: type[Variance], context: Context) -> Solved:
    """The BSDF of a material with constants of a renderer."""
    material = material.solid()
    grid, side = _Grid(variance is Isotropic), partial(_side, model=model, variance=variance, context=context)

    def found(seen: Material) -> _Columns:
        plain = seen.each(lambda address, value: _plain(value, address.colour))
        return _columns(plain, model, variance, grid, context.tables)

    if not material.transmits:
        return Solved(side(material, found(material)), None, 1.0)
    below = material.reversed()
    from_above, from_below = found(material), found(below)
    most = max(len(from_above.lobes), len(from_below.lobes))
    eta = ops.mean(material.below) / ops.mean(material.exterior)
    return Solved(side(material, from_above.padded(most)), side(below, from_below.padded(most)), eta)


def _side(material: Material, found: _Columns, model: Model, variance: type[Variance], context: Context) -> Side:
    shape = directional_grid.LINE if variance is Isotropic else directional_grid.PLANE
    grid = _Grid(variance is Isotropic)
    columns = [column for lobe in found.lobes for column in lobe.columns] + found.others
    polynomial = found.polynomial
    own = prepare(material, replace(model, reflectance="fresnel", tir="off"), variance, context)
    each, kind = _shapes(own), PerAxis if variance is Isotropic else Covariance
    shapes = tuple(each[lobe.interface] for lobe in found.lobes)
    dense = [grid.spread(column, shape) for column in columns]
    number = context.number
    curves = directional_grid.curves([number(np.float32(c)) if number else c for c in dense], shape, number)
    assert context.colour is not None
    numbers = Remainder(*(context.colour(*np.broadcast_to(x, len(context.colour())).tolist()) for x in vars(polynomial).values()))
    passage = straight_through.passage(material, variance) if material.transmits else None
    return Side(curves, shapes, numbers, passage, context.colour, kind)


def _plain(value: Value, colour: bool) -> Any:
    found = np.asarray(value, float).reshape(-1)
    return found[:, None] if colour else float(found[0])


def _shapes(prepared: Prepared) -> list[Shape]:
    """One for each interface from the top."""
    found: list[Shape] = []
    n: Value = 1.0
    first: PreparedInterface | None = None
    for layer in prepared.layers:
        if isinstance(layer, PreparedMedium):
            continue
        found.append(Shape(n, layer if first is None or not layer.opaque else None, first))
        first = first or layer
        n = n * layer.n12
    return found


@dataclass(frozen=True)
class _Grid:
    """Directions at which a material is solved, and how columns are spread over a finer grid."""

    isotropic: bool

    @property
    def nodes(self) -> Array:
        return np.linspace(0, 1, COSINES)

    @property
    def turns(self) -> int:
        return 1 if self.isotropic else AZIMUTHS

    @property
    def cosine(self) -> Array:
        return np.repeat(np.maximum(self.nodes**2, COS_MIN), self.turns)

    @property
    def phi(self) -> Array:
        return np.tile(np.pi * np.arange(self.turns) / self.turns, COSINES)

    def spread(self, column: Array, shape: tuple[int, ...]) -> Array:
        """Values at the nodes, (M,), interpolated: by splines over the cosine, by waves over the azimuth."""
        values = column.reshape(COSINES, self.turns)
        if not self.isotropic:
            x, y, _ = directional_grid.directions(shape, None)
            phi = np.arctan2(y, x).reshape(shape)[0]
            waves = np.fft.rfft(values, axis=1) / self.turns
            order = np.arange(waves.shape[1])
            both = np.where((order == 0) | (2 * order == self.turns), 1, 2)
            values = (waves[:, None, :] * both * np.exp(2j * order * phi[:, None])).real.sum(axis=-1)
        return np.asarray(CubicSpline(self.nodes, values)(np.linspace(0, 1, shape[0])).ravel())


@dataclass(frozen=True)
class _Drawn:
    """A lobe: the number of its interface, and its columns in the order in which `Side.at` reads them."""

    interface: int
    columns: list[Array]


@dataclass(frozen=True)
class _Columns:
    lobes: list[_Drawn]
    others: list[Array]
    polynomial: Remainder

    def padded(self, count: int) -> _Columns:
        """With lobes of no energy, as many as the other side has."""
        last = self.lobes[-1]
        dark = _Drawn(last.interface, [0 * column for column in last.columns])
        return replace(self, lobes=[*self.lobes, *[dark] * (count - len(self.lobes))])


def _columns(material: Material, model: Model, variance: type[Variance], grid: _Grid, known: Tables) -> _Columns:
    """What a material is at the directions of a grid."""
    cosine, phi = grid.cosine, grid.phi
    often = known if model.reflectance == "fgd-multi" else None
    sine = np.sqrt(1 - cosine * cosine)
    wi = sine * np.cos(phi), sine * np.sin(phi), cosine
    all_cosines, all_phi = np.concatenate([cosine, INCIDENCES]), np.concatenate([phi, 0 * INCIDENCES])
    solved = energies(material, all_cosines, all_phi, often, widths.nearly_straight)
    count = len(cosine)
    found = parts(material)
    own = _shapes(prepare(material, replace(model, reflectance="fresnel", tir="off"), variance))
    lit = solved.lobes[..., :count]
    tensors = widths.tensors(found, cosine, phi, lit.mean(axis=1)) if len(own) else []

    colours = max(3, solved.rest.shape[0])

    def full(x: Array) -> Array:
        return np.broadcast_to(x, (colours, count))

    # Lobes, and the veils that are seen
    drawn: list[tuple[int, Array, Any]] = []
    for k, tensor in enumerate(tensors):
        drawn.append((k, solved.lobes[k][:, :count], tensor))
        if solved.veils[k].max() > VEIL_MIN:
            drawn.append((k, solved.veils[k][:, :count], widths.veil(found, k, cosine, tensor)))
    weights, shown = [], []
    for k, energy, tensor in drawn:
        roughness = tensor.roughness(phi)
        integral = own_medium.integral(own[k].lobe(1.0, roughness), wi)
        weights.append(full(np.where(integral > FAINT, energy / np.maximum(integral, FAINT), 1.0)))
        in_plane = tensor.roughness(0 * phi)
        shown.append(vars((PerAxis if variance is Isotropic else Covariance).of(in_plane, _AS_IT_IS)).values())
    albedo = solved.lobes.sum(axis=0) + solved.veils.sum(axis=0) + solved.rest
    polynomial = remainder.fit(solved.nodes, solved.remainder, INCIDENCES, np.broadcast_to(albedo[:, count:], (len(solved.rest), len(INCIDENCES))))
    rest = full(solved.rest[:, :count])
    numbers = Remainder(*(np.reshape(x, (-1, 1)) for x in vars(polynomial).values()))
    scale = np.clip(rest / np.maximum(full(numbers.albedo(cosine)), 1e-6), 0, 4)

    # Chances of being sampled
    shares = [energy.mean(axis=0) * np.ones(count) for _, energy, _ in drawn]
    if material.transmits and len(drawn) == 1:
        once = own_medium.integral(own[0].lobe(1.0, tensors[0].roughness(phi)), wi).mean(axis=0)
        shares[0] = np.maximum(shares[0] - once, 0)
    shares.append(rest.mean(axis=0) + FAINT)
    passing: list[Array] = []
    left = 1.0
    if material.transmits:
        of = passed.parts(
            straight_through.passage(material, variance), wi, *(x[:, :count] for x in (solved.straight, solved.bounced, solved.passed)),
            np.array([sum(shares)]),
        )
        left = 1 - of.share
        passing = [*full(of.straight), *full(of.bounced), *full(of.rest), of.of_straight, of.of_bounced, of.of_rest]
        passing = [*passing, *full(solved.passed[:, :count])]
    total = sum(shares)
    lobes = [
        _Drawn(k, [*weight, *full(energy), *(x * np.ones(count) for x in shape), left * share / total])
        for weight, (k, energy, _), shape, share in zip(weights, drawn, shown, shares)
    ]
    return _Columns(lobes, [*scale, *rest, left * shares[-1] / total, *passing], polynomial)


# The BSDF


@dataclass(frozen=True)
class _Seen:
    """A side as light from one direction sees it."""

    lobes: list[OwnMediumLobe]
    chances: list[Value]
    energies: list[Value]
    polynomial: Remainder
    scale: Value
    rest: Value
    chance: Value
    passage: Passage | None
    passes: Parts | None
    passed: Value
    eta: Value

    @property
    def albedo(self) -> Value:
        return sum(self.energies) + self.rest + self.passed


def seen(solved: Solved, wi: Direction) -> _Seen:
    """What light from wi sees, turned up."""
    turned = _upright(wi, wi)
    side, columns, eta = solved.above, solved.above.at(turned), solved.eta
    if solved.below:
        where = wi[2] > 0
        columns = _select(where, columns, solved.below.at(turned))
        side = replace(
            solved.above,
            shapes=tuple(_either(where, a, b) for a, b in zip(solved.above.shapes, solved.below.shapes)),
            polynomial=_select(where, solved.above.polynomial, solved.below.polynomial),
            passage=_select(where, solved.above.passage, solved.below.passage),
        )
        eta = ops.select(where, eta, 1 / eta)
    azimuth = ops.arctan2(turned[1], turned[0])
    lobes = []
    for shape, weight, numbers in zip(side.shapes, columns.weights, columns.roughness):
        u, v, rotation = side.kind(*numbers).roughness(_AS_IT_IS)
        lobes.append(shape.lobe(weight, Roughness(u, v, rotation + azimuth)))
    return _Seen(
        lobes, columns.chances, columns.energies, side.polynomial, columns.scale, columns.rest, columns.chance,
        side.passage, columns.passes, columns.passed if columns.passed is not None else 0.0, eta,
    )  # fmt: skip


def eval_pdf(solved: Solved, wi: Direction, wo: Direction, radiance: bool) -> tuple[Value, Value]:
    """f(wi, wo) |cos theta_o|, a colour, and the density of `sample`."""
    of, i, o = seen(solved, wi), _upright(wi, wi), _upright(wo, wi)
    value = of.scale * of.polynomial.value(i, o)
    density = of.chance * remainder.density(o)
    for lobe, chance in zip(of.lobes, of.chances):
        more, pdf = own_medium.eval_pdf(lobe, i, o)
        value, density = value + more, density + chance * pdf
    if of.passage is None or of.passes is None:
        lit = wi[2] > 0
        return ops.select(lit, value, 0.0), ops.select(lit, density, 0.0)
    through, pdf = passed.eval_pdf(of.passage, of.passes, i, o)
    if radiance:
        through = through / (of.eta * of.eta)
    return value + through, density + pdf


def sample(solved: Solved, wi: Direction, u: Value, u1: Value, u2: Value) -> tuple[Direction, Value]:
    """A direction wo, and the index on its side over that on the side of wi."""
    of, i = seen(solved, wi), _upright(wi, wi)
    wo = remainder.sample(u1, u2)
    begin = 1 - of.chance
    for lobe, chance in zip(reversed(of.lobes), reversed(of.chances)):
        wo = _chosen(u < begin, own_medium.sample(lobe, i, u1, u2), wo)
        begin = begin - chance
    if of.passage is None or of.passes is None:
        return wo, 1.0
    share = of.passes.share
    through = passed.sample(of.passage, of.passes, i, ops.clip(ops.divide(u, share), 0.0, 1 - 2**-24), u1, u2)
    wo = _chosen(u < share, through, (wo[0], wo[1], ops.maximum(wo[2], 0.0)))
    return _upright(wo, wi), ops.select(wo[2] < 0, of.eta, 1.0)


def _either(where: Value, a: Shape, b: Shape) -> Shape:
    """The shape a where a condition holds, else b."""
    assert a.facets and b.facets
    facets = replace(a.facets, eta=ops.select(where, a.facets.eta, b.facets.eta))
    if a.first is None and b.first is None:
        return Shape(1.0, facets, None)
    some = a.first or b.first
    assert some
    first = replace(some, eta=ops.select(where, a.first.eta if a.first else 1.0, b.first.eta if b.first else 1.0))
    return Shape(ops.select(where, a.n, b.n), facets, first)


def _select(where: Value, a: Any, b: Any) -> Any:
    """Records of values, value by value."""
    if is_dataclass(a) and not isinstance(a, type):
        return type(a)(*(_select(where, getattr(a, f.name), getattr(b, f.name)) for f in fields(a)))
    if isinstance(a, tuple) and hasattr(a, "_fields"):
        return type(a)(*(_select(where, x, y) for x, y in zip(a, b)))
    if isinstance(a, (list, tuple)):
        return type(a)(_select(where, x, y) for x, y in zip(a, b))
    if a is None or (isinstance(a, float) and isinstance(b, float) and a == b):
        return a
    return ops.select(where, a, b)


def _upright(w: Direction, wi: Direction) -> Direction:
    return w[0], w[1], ops.select(wi[2] < 0, -w[2], w[2])


def _chosen(where: Value, a: Direction, b: Direction) -> Direction:
    x, y, z = (ops.select(where, p, q) for p, q in zip(a, b))
    return x, y, z
