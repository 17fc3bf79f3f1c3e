"""Weights with which the symmetric form of a solved material keeps the energy of each of its parts.

A part f(wi, wo), the geometric mean of its values there and back, becomes s(wi) f(wi, wo) s(wo), and stays reciprocal.
Such factors exist for every symmetric kernel without negative values; Sinkhorn's iteration finds them. For what passes,
s(wi) and s(wo) belong to the two sides. Kernels are known at the nodes of a grid of directions, by samples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.solved.bsdf import SidePart, Solved, exchanged
from velatura.model.solved.grid import Folded, Grid
from velatura.model.solved.guards import ALBEDO_MIN, BELOW_ONE
from velatura.model.solved.sample_allocation import Demand
from velatura.model.solved.transmission import combined, direct
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import compiled, low_discrepancy
from velatura.renderer.compiled import Colour, Deposit, Found
from velatura.renderer.directional_grid import Curves

Array = NDArray[np.floating]

SAMPLES = {0: 1024, 64: 377, 100: 233}  # at each node, where there are more than so many
STEPS = 24
MOST = 10.0  # times as bright, there and back
MOST_REST = 4.0  # for the remainder


def factors(
    solved: Solved, folded: Folded, samples: int | None, share: float
) -> tuple[list[list[Array]], list[Demand | None]]:
    """Squares of the factors, (C, M) at nodes, of each reflected part of a side and then of what passes; and by side
    the weights of samples of reflected parts, None where light passes.

    `solved` is that of NumPy in the symmetric form, with the weights of the forward form; `samples` are those at each
    node, None for a `share` of as many as a single material may take.
    """
    count, wi = folded.count, folded.directions
    samples = samples or round(share * next(each for least, each in reversed(SAMPLES.items()) if count > least))
    u, closed = low_discrepancy.at_nodes(1, samples), folded.closed

    def kernel(light: Callable[..., Found], parts: tuple[SidePart, ...], *numbers: Value) -> Array:
        """Light (C, M, M) that goes from nodes to nodes."""
        given = *map(direct.wider, parts), folded.grid, *numbers
        _, _, found = compiled.over(light, wi, u, given, closed.size)
        every = np.sum([each[:, 0, :-1] for each in found], axis=0) / samples
        among = np.zeros((len(every), count, count))
        for k, places in enumerate(closed.T):
            among[:, places] += every[:, k :: len(closed.T)]
        return among.swapaxes(-1, -2)

    def wanted(part: SidePart, squares: Array, energy: Array) -> Demand:
        """Demand of a reflected part with its factors."""
        s = np.sqrt(squares)
        table = Curves(s.T[closed.reshape(folded.grid.closed)], folded.grid.closed)
        given = direct.wider(part), folded.grid, table, Colour(np.ones((len(s), 1, 1)))
        sums, largest, _ = compiled.over(_weights, (*wi, *s), u, given)
        means, usual = np.split(sums / samples, 2)
        return Demand.of(energy, ops.divide(usual, means), largest)

    sides = [side for side in (solved.above, solved.below) if side]
    result: list[list[Array]] = []
    samples_of: list[Demand | None] = []
    refraction: list[tuple[Array, Array]] = []
    for side, other in zip(sides, reversed(sides)):
        at_nodes = side.seen(wi)
        parts = [side.part(k) for k in range(len(at_nodes.energies))]
        most = [MOST if part.side.shapes else MOST_REST for part in parts]
        kernels = [kernel(_reflected, (part,)) for part in parts]
        result.append([_balanced(*each) for each in zip(kernels, at_nodes.energies, most)])
        if side.transmission:
            eta = solved.eta if side is solved.above else 1 / solved.eta
            refraction.append((kernel(_passed, (side.through, other.through), eta), at_nodes.passed))
            samples_of.append(None)
        else:
            each = zip(parts, result[-1], at_nodes.energies)
            samples_of.append(Demand.together([wanted(*part) for part in each]))
    if refraction:
        for factor, passing in zip(result, _balanced_between(*refraction)):
            factor.append(passing)
    return result, samples_of


def _reflected(wi: Direction, u: Sequence[Value], numbers: Any) -> Found:
    """Light of samples of a reflected part, where it falls."""
    part, grid = numbers
    value, wo = _sampled(part, wi, u)
    return _falling(grid, value, wo)


def _passed(wi: Direction, u: Sequence[Value], numbers: Any) -> Found:
    """Light of samples of what passes, which falls on the other side."""
    part, other, grid, eta = numbers
    of = part.seen(wi)
    passes = of.columns.passes
    wo = combined.sample(of.transmission, passes, wi, ops.minimum(u[0], BELOW_ONE), *u[1:])
    down = wo[0], wo[1], ops.maximum(-1 * wo[2], 0.0)
    value, density, _ = exchanged(of, other.seen(down), eta, wi, wo)
    value = ops.select((density > 0) & (wo[2] < 0), ops.divide(value * passes.share, density), 0.0)
    return _falling(grid, value, down)


def _weights(sources: Sequence[Value], u: Sequence[Value], numbers: Any) -> Found:
    """Weights of samples of a reflected part with its factors."""
    part, grid, factors, colour = numbers
    x, y, z, *here = sources
    value, wo = _sampled(part, (x, y, z), u)
    there = ops.interpolate(factors, *grid.places(wo))
    weights = value * colour(*here) * colour(*there)
    return Found([weights, weights * weights], [weights])


def _falling(grid: Grid, value: Value, w: Direction) -> Found:
    return Found(deposits=[Deposit(first, shares, [value], [1.0]) for first, shares in grid.stencils(w)])


def _sampled(part: SidePart, wi: Direction, u: Sequence[Value]) -> tuple[Value, Direction]:
    """Weights of samples of the geometric mean there and back, a colour, and their directions above."""
    of = part.seen(wi)
    wo = of.out_of(of.lobes[0], wi, *u[1:]) if of.lobes else of.samples.sample(wi, *u)
    up = wo[0], wo[1], ops.maximum(wo[2], 0.0)
    value, density = of.part(0, wi, wo)
    back, _ = part.seen(up).part(0, up, wi)
    both = ops.maximum(value, 0.0) * ops.maximum(back, 0.0) * (ops.absolute(wo[2]) / wi[2])
    return ops.select(density > 0, ops.divide(ops.sqrt(both), density), 0.0), up


def _balanced(kernel: Array, energy: Array, most: float) -> Array:
    factor = np.ones_like(energy)
    for _ in range(STEPS):
        factor = _bounded(factor * np.sqrt(_ratio(energy, factor * _leaving(kernel, factor))), most)
    return factor**2


def _balanced_between(above: tuple[Array, Array], below: tuple[Array, Array]) -> list[Array]:
    found = [np.ones_like(above[1]), np.ones_like(below[1])]
    for _ in range(2 * STEPS):
        leaving = [s * _leaving(kernel, t) for s, t, (kernel, _) in zip(found, reversed(found), (above, below))]
        ratios = [_ratio(energy, light) for (_, energy), light in zip((above, below), leaving)]
        found = [_bounded(s * np.sqrt(ratio), MOST) for s, ratio in zip(found, ratios)]
    return [s**2 for s in found]


def _leaving(kernel: Array, factor: Array) -> Array:
    return np.einsum("cij,cj->ci", kernel, factor)


def _ratio(energy: Array, light: Array) -> Array:
    return np.where(light > ALBEDO_MIN, np.maximum(energy, 0) / np.maximum(light, ALBEDO_MIN), 1.0)


def _bounded(factor: Array, most: float) -> Array:
    return np.clip(factor, 0.0, np.sqrt(most))
