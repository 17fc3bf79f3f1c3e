"""Merging of lobes, so that there are fewer than interfaces, for renderers in which each lobe has a cost."""

from __future__ import annotations

from collections.abc import Sequence

from velatura import ops
from velatura.model.base import Model
from velatura.model.papers.adding import Lobe
from velatura.model.papers.prepare import Prepared

_COUNT = {"three": 3, "two": 2}


def merged(prepared: Prepared, lobes: Sequence[Lobe]) -> list[Lobe]:
    """The reflected lobes that the model evaluates.

    The first lobe is kept: it is a reflection by one interface alone, and is often sharp. Of three, the last is kept as
    well, the base's. Those between are merged.
    """
    groups = [lobes[group.start : group.stop] for group in merging(prepared.model, len(lobes))]
    return [_mixed(prepared, group) if len(group) > 1 else group[0] for group in groups]


def merging(model: Model, interfaces: int) -> list[range]:
    """The interfaces of each lobe that the model evaluates."""
    count = _COUNT.get(model.lobes, interfaces)
    if interfaces <= count:
        return [range(k, k + 1) for k in range(interfaces)]
    kept = interfaces - (count - 2)
    return [range(1), range(1, kept), *(range(k, k + 1) for k in range(kept, interfaces))]


def _mixed(prepared: Prepared, lobes: Sequence[Lobe]) -> Lobe:
    """One lobe with all of the energy; the variance of a mixture is the weighted mean (Belcour 2018, 5.2)."""
    weights = [ops.mean(lobe.energy) for lobe in lobes]
    share = 1 / ops.maximum(sum(weights), ops.TINY)
    energy = sum(lobe.energy for lobe in lobes)
    first, *others = (lobe.variance * (weight * share) for lobe, weight in zip(lobes, weights))
    variance = sum(others, first)
    return Lobe(energy, variance, variance.roughness(prepared.f))
