"""How samples are shared among the parts of a material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops

TARGET_SAMPLE_WEIGHT = 2.7  # weight of samples of a part, where they can be kept so light
KEPT = 0.7  # of the share by its energy that a part keeps at least
STEPS = 8  # of halving
NEGLIGIBLE = 2e-3  # share of the energy, of parts whose samples may be cut

Array = NDArray[np.floating]


class Demand(NamedTuple):
    """What K parts need for N directions, (K, N) each, or (N,) of one part: their energies, and where a part takes all
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


def shared(demand: Demand) -> Array:
    """Shares of samples (K, N) in proportion to the energies; but as many as keep the weights of its samples down to
    `TARGET_SAMPLE_WEIGHT` to each part that is not too slight, as far as they suffice."""
    energy, usual, heaviest = demand
    even = ops.divide(energy, energy.sum(axis=0))
    counts = np.minimum(even / NEGLIGIBLE, 1) / TARGET_SAMPLE_WEIGHT

    def least(part: Array) -> Array:
        weight = usual + part * np.maximum(heaviest - usual, 0)
        return np.maximum(KEPT * even, counts * weight)

    part, step = np.ones_like(energy[0]), 0.5
    for _ in range(STEPS):
        part = part + np.where(least(part).sum(axis=0) > 1, -step, step)
        part, step = np.clip(part, 0, 1), 0.5 * step
    found = least(part)
    found = found / np.maximum(found.sum(axis=0), 1)
    raised = np.zeros(energy.shape, bool)
    for _ in range(len(energy)):
        left = 1 - np.sum(np.where(raised, found, 0), axis=0)
        total = np.sum(np.where(raised, 0, energy), axis=0)
        shares = np.where(raised, found, ops.divide(energy * left, total))
        raised |= shares < found
    return shares
