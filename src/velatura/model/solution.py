"""A uniform material, solved once for all directions: what `velatura.model.solved` reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from velatura import ops
from velatura.model import exchange, own_medium, passed, remainder, straight_through, widths
from velatura.model.context import Context
from velatura.model.models import Model
from velatura.model.precomputed_lobes import _AS_IT_IS
from velatura.model.prepare import Prepared, PreparedInterface, PreparedMedium, prepare
from velatura.model.remainder import Remainder
from velatura.model.solved import FAINT, Shape, Side, Solved
from velatura.model.transport.adding import parts
from velatura.model.transport.energies import INCIDENCES, energies
from velatura.model.variance import Covariance, Isotropic, PerAxis, Variance
from velatura.ops import Value
from velatura.sampling import directional_grid, low_discrepancy
from velatura.stack import Material
from velatura.tables import Tables

Array = NDArray[np.floating]

COSINES = 48  # nodes, even in the root of the cosine
AZIMUTHS = 12  # in half a turn, where interfaces are brushed
COS_MIN = 1e-3
EVENLY = 377  # directions over which the remainder is integrated
VEIL_MIN = 1e-3  # energy of veils that are drawn
EVEN = 0.2  # share of samples of the symmetric form that the remainder has at least, and of those that pass


def solve(material: Material, model: Model, variance: type[Variance], context: Context) -> Solved:
    """The BSDF of a material with constants of a renderer."""
    material = material.solid()
    plain = material.each(lambda address, value: _plain(value, address.colour))
    smooth = not any(layer.spreads for layer in plain.layers)
    grid = _Grid(variance is Isotropic, directional_grid.LINE[0] if smooth and variance is Isotropic else COSINES)
    solved = partial(_columns, model=model, variance=variance, grid=grid, known=context.tables)
    found = [solved(plain), *([solved(plain.reversed())] if material.transmits else [])]
    found = [columns.with_lobes(_both([columns.drawn for columns in found])) for columns in found]
    symmetric = model.form == "symmetric" and not smooth
    if symmetric:
        found = [replace(columns, scale=np.ones_like(columns.scale)) for columns in found]
        numbers = _bsdf(plain, found, model, variance, replace(context, number=None, colour=_colour), grid, True)
        factors = exchange.factors(numbers, grid.directions, grid.shares, grid.count)
        found = [columns.weighed(each) for columns, each in zip(found, factors)]
    return replace(_bsdf(material, found, model, variance, context, grid, symmetric), smooth=smooth)


def _bsdf(
    material: Material,
    found: Sequence[_Columns],
    model: Model,
    variance: type[Variance],
    context: Context,
    grid: _Grid,
    symmetric: bool,
) -> Solved:
    above, *below = (
        _side(seen, columns, model, variance, context, grid)
        for seen, columns in zip((material, material.reversed() if material.transmits else material), found)
    )
    eta = ops.mean(material.below) / ops.mean(material.exterior) if below else 1.0
    return Solved(above, below[0] if below else None, eta, symmetric, False)


def _colour(*channels: Value) -> Value:
    return np.stack(channels) if channels else np.empty(3)


def _both(drawn: Sequence[Sequence[tuple[int, bool]]]) -> list[tuple[int, bool]]:
    """Lobes, by interface, and veils that are seen from any side."""
    return sorted({each for side in drawn for each in side})


def _side(
    material: Material, found: _Columns, model: Model, variance: type[Variance], context: Context, grid: _Grid
) -> Side:
    shape = directional_grid.LINE if variance is Isotropic else directional_grid.PLANE
    number, colour = context.number, context.colour
    own = prepare(material, replace(model, reflectance="fresnel", tir="off"), variance, replace(context, number=None))
    each, kind = _shapes(own), PerAxis if variance is Isotropic else Covariance
    shapes = tuple(each[lobe.interface] for lobe in found.lobes)
    dense = [grid.spread(column, shape) for column in found.all]
    curves = directional_grid.curves([number(np.float32(c)) if number else c for c in dense], shape, number)
    assert colour is not None
    width = len(colour())
    numbers = Remainder(*(_constants(x, width, colour) for x in vars(found.polynomial).values()))
    passage = straight_through.passage(material, variance) if material.transmits else None
    return Side(curves, shapes, numbers, passage, colour, kind)


def _constants(channels: Array, width: int, colour: Any) -> Value:
    channels = np.broadcast_to(channels, width)
    return channels[:, None] if colour is _colour else colour(*channels.tolist())


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
        found.append(Shape(len(found), n, layer if first is None or not layer.opaque else None, first))
        first = first or layer
        n = n * layer.n12
    return found


@dataclass(frozen=True)
class _Grid:
    """Directions at which a material is solved, and how columns are spread over a finer grid."""

    isotropic: bool
    cosines: int

    @property
    def nodes(self) -> Array:
        return np.linspace(0, 1, self.cosines)

    @property
    def turns(self) -> int:
        return 1 if self.isotropic else AZIMUTHS

    @property
    def count(self) -> int:
        return self.cosines * self.turns

    @property
    def cosine(self) -> Array:
        return np.repeat(np.maximum(self.nodes**2, COS_MIN), self.turns)

    @property
    def phi(self) -> Array:
        return np.tile(np.pi * np.arange(self.turns) / self.turns, self.cosines)

    @property
    def directions(self) -> tuple[Array, Array, Array]:
        sine = np.sqrt(1 - self.cosine * self.cosine)
        return sine * np.cos(self.phi), sine * np.sin(self.phi), self.cosine

    def shares(self, w: tuple[Array, Array, Array]) -> list[tuple[Array, Array]]:
        """Nodes and weights of the linear interpolation at directions above."""
        place = np.sqrt(np.clip(w[2], 0, 1)) * (self.cosines - 1)
        cell = np.minimum(place.astype(int), self.cosines - 2)
        along = [(cell, 1 - (place - cell)), (cell + 1, place - cell)]
        if self.isotropic:
            return along
        turn = (np.arctan2(w[1], w[0]) % np.pi) * (self.turns / np.pi)
        first = turn.astype(int)
        around = [(first % self.turns, 1 - (turn - first)), ((first + 1) % self.turns, turn - first)]
        return [(k * self.turns + m, x * y) for k, x in along for m, y in around]

    def spread(self, column: Array, shape: tuple[int, ...]) -> Array:
        """Values at the nodes, (M,), interpolated: by splines over the cosine, by waves over the azimuth."""
        values = column.reshape(self.cosines, self.turns)
        if not self.isotropic:
            x, y, _ = directional_grid.directions(shape, None)
            phi = np.arctan2(y, x).reshape(shape)[0]
            waves = np.fft.rfft(values, axis=1) / self.turns
            order = np.arange(waves.shape[1])
            both = np.where((order == 0) | (2 * order == self.turns), 1, 2)
            values = (waves[:, None, :] * both * np.exp(2j * order * phi[:, None])).real.sum(axis=-1)
        if shape[0] == self.cosines:
            return np.asarray(values.ravel())
        return np.asarray(CubicSpline(self.nodes, values)(np.linspace(0, 1, shape[0])).ravel())


@dataclass(frozen=True)
class _Drawn:
    """The columns of a lobe, in the order in which `Side.at` reads them, or of its veil."""

    interface: int
    veil: bool
    weight: Array
    others: list[Array]


@dataclass(frozen=True)
class _Columns:
    """Those of lobes, of the remainder and, or none, of what passes: the weights of the latter, and what follows."""

    lobes: list[_Drawn]
    scale: Array
    rest: list[Array]
    passes: Array
    passed: list[Array]
    polynomial: Remainder

    @property
    def drawn(self) -> list[tuple[int, bool]]:
        return [(lobe.interface, lobe.veil) for lobe in self.lobes]

    @property
    def all(self) -> list[Array]:
        lobes = [column for lobe in self.lobes for column in (*lobe.weight, *lobe.others)]
        return [*lobes, *self.scale, *self.rest, *self.passes, *self.passed]

    def with_lobes(self, drawn: Sequence[tuple[int, bool]]) -> _Columns:
        """With lobes of no energy, where the other side has more."""
        known, any_one = dict(zip(self.drawn, self.lobes)), self.lobes[0]
        dark = replace(any_one, weight=0 * any_one.weight, others=[0 * column for column in any_one.others])
        lobes = [known.get(key) or replace(dark, interface=key[0], veil=key[1]) for key in drawn]
        return replace(self, lobes=lobes)

    def weighed(self, factors: Sequence[Array]) -> _Columns:
        """With the weights of reflected parts, and of what passes, scaled by factors (C, M)."""
        lobes = [replace(lobe, weight=factor * lobe.weight) for lobe, factor in zip(self.lobes, factors)]
        passes = self.passes
        if len(passes):
            passes = np.concatenate([factors[-1], passes[len(factors[-1]) :]])
        return replace(self, lobes=lobes, scale=factors[len(lobes)] * self.scale, passes=passes)


def _columns(material: Material, model: Model, variance: type[Variance], grid: _Grid, known: Tables) -> _Columns:
    """What a material is at the directions of a grid."""
    cosine, phi, wi = grid.cosine, grid.phi, grid.directions
    often = known if model.reflectance == "fgd-multi" else None
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
    drawn: list[tuple[int, bool, Array, Any]] = []
    for k, tensor in enumerate(tensors):
        drawn.append((k, False, solved.lobes[k][:, :count], tensor))
        if solved.veils[k].max() > VEIL_MIN:
            drawn.append((k, True, solved.veils[k][:, :count], widths.veil(found, k, cosine, tensor)))
    weights, shown = [], []
    for k, _, energy, tensor in drawn:
        roughness = tensor.roughness(phi)
        integral = own_medium.integral(own[k].lobe(1.0, roughness), wi)
        weights.append(full(np.where(integral > FAINT, energy / np.maximum(integral, FAINT), 1.0)))
        if variance is Isotropic:
            shown.append(vars(PerAxis.of(tensor.straight(), _AS_IT_IS)).values())
        else:
            shown.append(vars(Covariance.of(tensor.roughness(0 * phi), _AS_IT_IS)).values())
    albedo = solved.lobes.sum(axis=0) + solved.veils.sum(axis=0) + solved.rest
    polynomial = remainder.fit(
        solved.nodes,
        solved.remainder,
        INCIDENCES,
        np.broadcast_to(albedo[:, count:], (len(solved.rest), len(INCIDENCES))),
    )
    rest = full(solved.rest[:, :count])
    numbers = Remainder(*(np.reshape(x, (-1, 1, 1)) for x in vars(polynomial).values()))
    wo = remainder.sample(*low_discrepancy.square(EVENLY))
    clipped = numbers.value((wi[0][:, None], wi[1][:, None], wi[2][:, None]), wo) / remainder.density(wo)
    scale = np.clip(rest / np.maximum(full(clipped.mean(axis=-1)), 1e-6), 0, 4)

    # Chances of being sampled
    shares = [energy.mean(axis=0) * np.ones(count) for _, _, energy, _ in drawn]
    if material.transmits and len(drawn) == 1:
        once = own_medium.integral(own[0].lobe(1.0, tensors[0].roughness(phi)), wi).mean(axis=0)
        shares[0] = np.maximum(shares[0] - once, 0)
    shares.append(rest.mean(axis=0) + FAINT)
    least = EVEN if model.form == "symmetric" else 0.0
    shares[-1] = np.maximum(shares[-1], least * sum(shares))
    weights_passing, passing = np.empty((0, count)), []
    left = 1.0
    if material.transmits:
        of = passed.parts(
            straight_through.passage(material, variance),
            wi,
            solved.straight[:, :count],
            solved.bounced[:, :count],
            solved.passed[:, :count],
            np.array([sum(shares)]),
        )
        even = np.maximum(least * of.share - of.of_rest, 0) / np.maximum(of.share - of.of_rest, FAINT)
        others = (1 - even) * of.of_straight, (1 - even) * of.of_bounced
        of = replace(of, of_straight=others[0], of_bounced=others[1], of_rest=of.share - sum(others))
        left = 1 - of.share
        weights_passing = np.concatenate([full(of.straight), full(of.bounced), full(of.rest)])
        passing = [of.of_straight, of.of_bounced, of.of_rest, *full(solved.passed[:, :count])]
    total = sum(shares)
    lobes = [
        _Drawn(k, veil, weight, [*full(energy), *(x * np.ones(count) for x in shape), left * share / total])
        for weight, (k, veil, energy, _), shape, share in zip(weights, drawn, shown, shares)
    ]
    return _Columns(lobes, scale, [*rest, left * shares[-1] / total], weights_passing, passing, polynomial)
