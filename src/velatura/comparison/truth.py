"""The reference by random walks, with its noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from velatura import reference
from velatura.comparison.result import Account
from velatura.reference import WalkedLobe
from velatura.stack import Stack

Array = NDArray[np.floating]


def truth(
    stack: Stack,
    cos_theta: Sequence[float],
    paths: int,
    seed: int,
    microsurface: bool,
    polarised: bool,
    advance: Callable[[], None],
) -> tuple[Account, tuple[WalkedLobe, ...], Array]:
    """The truth's account, the standard errors of its lobes, and the noise of its distribution as a total variation.

    Arguments are those of `compare`; `advance` is called three times for each direction.

    Raises:
        InvalidInput, MissingTool: as `reference.statistics`.
    """
    # One direction at a time, so that progress is reported and memory is bounded
    each, halves = [], []
    for cosine in cos_theta:
        each.append(reference.statistics(stack, cosine, 0.0, paths, seed, microsurface, polarised))
        advance()
        pair = []
        for half in (1, 2):
            found = reference.distribution(
                stack, cosine, 0.0, paths // 2, seed + half, microsurface, polarised=polarised
            )
            pair.append(found.reflected[:, 0])
            advance()
        halves.append(pair)

    # Half the difference of two halves is as noisy as their mean
    grids = np.array(halves)  # (N, 2, 3, bins, bins)
    mean = grids.mean(axis=1)
    apart = 0.5 * np.abs((grids[:, 0] - grids[:, 1]).mean(axis=1))
    noise = 0.5 * apart.sum(axis=(1, 2)) / np.maximum(mean.mean(axis=1).sum(axis=(1, 2)), 1e-12)

    reflected, transmitted = _joined(each)
    errors, below = _joined([s.standard_error for s in each if s.standard_error])
    evaluated = np.sum([lobe.energy for lobe in reflected], axis=0)
    return (
        Account(reflected, transmitted, evaluated, mean.swapaxes(0, 1)),
        (*errors, *([below] if below else [])),
        noise,
    )


def _joined(each: Sequence[reference.Statistics]) -> tuple[tuple[WalkedLobe, ...], WalkedLobe | None]:
    """Lobes over all directions, from statistics of single ones."""
    names = [field.name for field in fields(WalkedLobe)]
    reflected = tuple(
        WalkedLobe(**{name: np.concatenate([getattr(s, name)[k] for s in each], axis=-1) for name in names})
        for k in range(len(each[0].energy))
    )
    below = [s.transmitted for s in each if s.transmitted]
    transmitted = {name: np.concatenate([getattr(lobe, name) for lobe in below], axis=-1) for name in names if below}
    return reflected, WalkedLobe(**transmitted) if below else None
