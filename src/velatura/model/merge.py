"""Fewer lobes than interfaces, for renderers that pay for each."""

from __future__ import annotations

from collections.abc import Sequence

from velatura import ops
from velatura.model.adding import Lobe
from velatura.model.prepare import Prepared

_COUNT = {"three": 3, "two": 2}


def merged(prepared: Prepared, lobes: Sequence[Lobe]) -> list[Lobe]:
    """The reflected lobes that the model evaluates.

    The first lobe is kept: it is a reflection by one interface alone, and is often sharp. Of three, the last is kept as
    well, the base's. Those between are merged.
    """
    count = _COUNT.get(prepared.model.lobes, len(lobes))
    if len(lobes) <= count:
        return list(lobes)
    kept = len(lobes) - (count - 2)
    return [lobes[0], _mixed(prepared, lobes[1:kept]), *lobes[kept:]]


def _mixed(prepared: Prepared, lobes: Sequence[Lobe]) -> Lobe:
    """One lobe with all of the energy; the variance of a mixture is the weighted mean (Belcour 2018, 5.2)."""
    weights = [ops.mean(lobe.energy) for lobe in lobes]
    share = 1 / ops.maximum(sum(weights), ops.TINY)
    energy = sum(lobe.energy for lobe in lobes)
    first, *others = (lobe.variance * (weight * share) for lobe, weight in zip(lobes, weights))
    variance = sum(others, first)
    return Lobe(energy, variance, variance.roughness(prepared.f))
