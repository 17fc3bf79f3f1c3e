"""The reference by random walks, with its noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from velatura import reference
from velatura.comparison.result import Account
from velatura.reference import WalkedLobe
from velatura.stack import Described, Stack

Array = NDArray[np.floating]


def truth(
    material: Described,
    cos_theta: Sequence[float],
    paths: int,
    seed: int,
    microsurface: bool,
    polarised: bool,
    advance: Callable[[], None],
) -> tuple[Account, tuple[WalkedLobe, ...], Array]:
    """The truth's account, the standard errors of its lobes, and the noise of its distribution as a total variation.

    Arguments are those of `compare`; `advance` is called three times for each direction and stack.

    Raises:
        InvalidInput, MissingTool: as `reference.statistics`.
    """
    shares, stacks = zip(*material.weighted("lobes are those of one point; replace it by a number"))
    found = [_walked(stack, cos_theta, paths, seed, microsurface, polarised, advance) for stack in stacks]
    accounts, errors, halves = zip(*found)

    # Half the difference of two halves is as noisy as their mean
    grids = np.tensordot(shares, halves, 1)  # (N, 2, 3, bins, bins)
    mean = grids.mean(axis=1)
    apart = 0.5 * np.abs((grids[:, 0] - grids[:, 1]).mean(axis=1))
    noise = 0.5 * apart.sum(axis=(1, 2)) / np.maximum(mean.mean(axis=1).sum(axis=(1, 2)), 1e-12)

    return Account.mixed(shares, accounts), Account.mixed(shares, errors).lobes, noise


def _walked(
    stack: Stack,
    cos_theta: Sequence[float],
    paths: int,
    seed: int,
    microsurface: bool,
    polarised: bool,
    advance: Callable[[], None],
) -> tuple[Account, Account, Array]:
    """The account of one stack, another one with the standard errors of its lobes, and distributions of two halves of
    the paths, (N, 2, 3, bins, bins)."""
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
    grids = np.array(halves)
    reflected, transmitted = _joined(each)
    evaluated = np.sum([lobe.energy for lobe in reflected], axis=0)
    mean = grids.mean(axis=1).swapaxes(0, 1)
    errors = _joined([s.standard_error for s in each if s.standard_error])
    return Account(reflected, transmitted, evaluated, mean), Account(*errors, 0 * evaluated, 0 * mean), grids


def _joined(each: Sequence[reference.Statistics]) -> tuple[tuple[WalkedLobe, ...], tuple[WalkedLobe, ...]]:
    """Lobes over all directions, from statistics of single ones."""
    names = [field.name for field in fields(WalkedLobe)]
    reflected = tuple(
        WalkedLobe(**{name: np.concatenate([getattr(s, name)[k] for s in each], axis=-1) for name in names})
        for k in range(len(each[0].energy))
    )
    below = [s.transmitted for s in each if s.transmitted]
    transmitted = {name: np.concatenate([getattr(lobe, name) for lobe in below], axis=-1) for name in names if below}
    return reflected, (WalkedLobe(**transmitted),) if below else ()
