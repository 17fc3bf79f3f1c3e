"""Weights with which the symmetric form of a solved material keeps the energy of each of its parts.

A part f(wi, wo), the geometric mean of its values there and back, becomes s(wi) f(wi, wo) s(wo), and stays reciprocal.
Such factors exist for every symmetric kernel without negative values; Sinkhorn's iteration finds them. For what passes,
s(wi) and s(wo) belong to the two sides. Kernels are known at the nodes of a grid of directions, by samples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.solved.bsdf import Solved, exchanged
from velatura.model.solved.guards import ALBEDO_MIN, BELOW_ONE
from velatura.model.solved.sample_allocation import Demand
from velatura.model.solved.transmission import combined
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import low_discrepancy

Array = NDArray[np.floating]
Shares = Callable[[Direction], Sequence[tuple[Array, Array]]]

SAMPLES = {0: 1024, 64: 377, 100: 233}  # at each node, where there are more than so many
STEPS = 24
MOST = 10.0  # times as bright, there and back
MOST_REST = 4.0  # for the remainder


def factors(
    solved: Solved, wi: Direction, shares: Shares, count: int, samples: int | None, share: float
) -> tuple[list[list[Array]], list[Demand]]:
    """Squares of the factors, (C, M) at nodes wi, of each reflected part of a side and then of what passes; and by side
    the weights of samples of reflected parts.

    `solved` is that of NumPy in the symmetric form, with the weights of the forward form; `shares` interpolates between
    the nodes; `samples` are those at each node, None for a `share` of as many as a single material may take.
    """
    samples = samples or round(share * next(each for least, each in reversed(SAMPLES.items()) if count > least))
    i = tuple(low_discrepancy.repeated(x, samples) for x in wi)
    u = low_discrepancy.at_nodes(count, samples)
    nodes = np.repeat(np.arange(count), samples)

    def kernel(value: Array, reached: Sequence[tuple[Array, Array]]) -> Array:
        """Light (C, M, M) that goes from nodes to nodes."""
        found = np.zeros((len(value), count * count))
        for index, share in reached:
            for colour, light in zip(found, value):
                colour += np.bincount(nodes * count + index, light * (share / samples), count * count)
        return found.reshape(-1, count, count)

    def wanted(value: Array, reached: Sequence[tuple[Array, Array]], squares: Array, energy: Array) -> Demand:
        """Demand of a part with its factors."""
        s = np.sqrt(squares)
        weights = value * s[:, nodes] * sum(share * s[:, index] for index, share in reached)
        weights = weights.reshape(len(value), count, samples)
        usual = ops.divide((weights**2).mean(axis=-1), weights.mean(axis=-1))
        return Demand.of(energy, usual, weights.max(axis=-1))

    sides = [side for side in (solved.above, solved.below) if side]
    result: list[list[Array]] = []
    samples_of: list[Demand] = []
    refraction: list[tuple[Array, Array]] = []
    for side, other in zip(sides, reversed(sides)):
        at_nodes = side.seen(wi)
        result.append([])
        found = []
        for k, energy in enumerate(at_nodes.energies):
            of = side.part(k, i)
            wo = of.out_of(of.lobes[0], i, *u[1:]) if of.lobes else of.samples.sample(i, *u)
            up = wo[0], wo[1], np.maximum(wo[2], 0.0)
            value = _weight(of.part(0, i, wo), side.part(k, up).part(0, up, i)[0], i, wo)
            most = MOST if of.lobes else MOST_REST
            reached = list(shares(up))
            result[-1].append(_balanced(kernel(value, reached), energy, most))
            found.append(wanted(value, reached, result[-1][-1], energy))
        samples_of.append(Demand.together(found))
        if side.transmission:
            of = side.through(i)
            passes = of.columns.passes
            assert passes
            wo = combined.sample(side.transmission, passes, i, np.minimum(u[0], BELOW_ONE), *u[1:])
            down = wo[0], wo[1], np.maximum(-wo[2], 0.0)
            eta = solved.eta if side is solved.above else 1 / solved.eta
            value, density, _ = exchanged(of, other.through(down), eta, i, wo)
            value = np.where(density > 0, ops.divide(value * passes.share, density), 0.0)
            value = np.where(wo[2] < 0, value, 0.0)
            refraction.append((kernel(value, shares(down)), at_nodes.passed))
    if refraction:
        for factor, passing in zip(result, _balanced_between(*refraction)):
            factor.append(passing)
    return result, samples_of


def _weight(there: tuple[Value, Value], back: Value, wi: Direction, wo: Direction) -> Array:
    """Weights of samples of the geometric mean."""
    value, density = there
    both = np.maximum(value, 0) * np.maximum(back, 0) * (np.abs(wo[2]) / wi[2])
    return np.where(density > 0, ops.divide(np.sqrt(both), density), 0.0)


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
