"""How samples are shared among the parts of a material."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops

MANY = 4  # interfaces or lobes, beyond which each has fewer samples
TARGET_SAMPLE_WEIGHT = 2.7  # weight of samples of a part, where they can be kept so light
KEPT = 0.7  # of the share by its energy that a part keeps at least
STEPS = 8  # of halving
EVENED = 16  # steps by which they are shared anew
BEGUN = 0.1  # share of samples that all parts have alike, as steps begin
HEAVY = 6  # power of the weights of samples, in their mean
PLACES = 11  # between the chances that were and those
BEYOND = 10.0  # variance that is as bad as a weight beyond the target
NEGLIGIBLE = 2e-3  # share of the energy, of parts whose samples may be cut

Array = NDArray[np.floating]


class Demand(NamedTuple):
    """Needs of K parts for N directions, (K, N) each, or (N,) of one part: their energies, and where a part takes all
    samples, the mean weight of these over the light that they carry, and the largest one."""

    energy: Array
    usual: Array
    heaviest: Array

    @classmethod
    def of(cls, energy: Array, usual: Array, heaviest: Array) -> Demand:
        """Demand of values by colour, (C, N)."""
        return cls(ops.mean(energy), np.max(usual, axis=0), np.max(heaviest, axis=0))

    @classmethod
    def together(cls, parts: Sequence[Demand]) -> Demand:
        """Parts one after another."""
        energy, usual, heaviest = (np.concatenate([np.atleast_2d(x) for x in each]) for each in zip(*parts))
        return cls(energy, usual, heaviest)

    def spared(self, k: int, weight: Array) -> Demand:
        """The demand less weights (N,) of part k, which other samples carry."""
        less = np.zeros_like(self.energy)
        less[k] = weight
        return Demand(self.energy, *(np.maximum(x - less, 0) for x in self[1:]))


def share(parts: int) -> float:
    """Share of the usual samples that each of some parts has: less where there are many, so that time stays bounded."""
    return min(1.0, MANY / max(parts, 1))


def shared(demand: Demand) -> Array:
    """Shares of samples (K, N) in proportion to the energies; but as many as keep the weights of its samples down to
    `TARGET_SAMPLE_WEIGHT` to each part that is not too slight, as far as they suffice."""
    energy, usual, heaviest = demand
    even = ops.divide(energy, energy.sum(axis=0))
    counts = np.minimum(even / NEGLIGIBLE, 1) / TARGET_SAMPLE_WEIGHT

    def least(part: Array) -> Array:
        weight = usual + part * np.maximum(heaviest - usual, 0)
        return np.maximum(KEPT * even, counts * weight)

    # Halve to where all samples are asked for, and interpolate there, so that shares do not jump
    low, high = np.zeros_like(energy[0]), np.ones_like(energy[0])
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        beyond = least(middle).sum(axis=0) > 1
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    at_low, at_high = (least(end).sum(axis=0) for end in (low, high))
    found = least(low + (high - low) * np.clip(ops.divide(1 - at_low, at_high - at_low), 0, 1))
    found = found / np.maximum(found.sum(axis=0), 1)
    raised = np.zeros(energy.shape, bool)
    for _ in range(len(energy)):
        left = 1 - np.sum(np.where(raised, found, 0), axis=0)
        total = np.sum(np.where(raised, 0, energy), axis=0)
        shares = np.where(raised, found, ops.divide(energy * left, total))
        raised |= shares < found
    return shares


def evened(values: Array, kept: Array, densities: Array, chances: Array) -> Array:
    """Chances (K, N) of parts with densities (K, N, P), of the same sum, shared anew so that the variance of weights is
    the least without any above `TARGET_SAMPLE_WEIGHT`, as far as that can be: for values (N, P) at directions that are
    even in projection, and the density `kept` (N, P) of all other parts.

    Steps that scale chances by what more samples of a part would do to a high mean of weights find the chances by which
    the heaviest are least. From there to those that were, the best place is taken.
    """

    def weights(found: Array) -> tuple[Array, Array]:
        whole = kept + (found[..., None] * densities).sum(axis=0)
        return ops.divide(values, whole), whole

    total = chances.sum(axis=0)
    found = (1 - BEGUN) * chances + BEGUN * total / len(chances)
    for _ in range(EVENED):
        weight, whole = weights(found)
        heavy = reduce(np.multiply, [weight] * HEAVY)  # a tenth of the time of a power
        found = found * (heavy * ops.divide(densities, whole)).mean(axis=-1) ** (1 / HEAVY)
        found = found * ops.divide(total, found.sum(axis=0))
    places = [chances + share * (found - chances) for share in np.linspace(0, 1, PLACES)]
    costs = []
    for place in places:
        weight, _ = weights(place)
        beyond = np.maximum(weight.max(axis=-1) - TARGET_SAMPLE_WEIGHT, 0)
        costs.append((values * weight).mean(axis=-1) + BEYOND * beyond)
    best = np.argmin(costs, axis=0)
    return np.asarray(np.take_along_axis(np.array(places), best[None, None], axis=0)[0])
