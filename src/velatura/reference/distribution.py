"""Distribution of light: energies on a grid over the projected disc."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.optics.directions import directions
from velatura.reference.batches import trace
from velatura.stack import MaterialLike, Stack, load

BINS = 40

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Distribution:
    """Energies (3, N, bins, bins) by colour and direction of incidence.

    The last two axes run over x and y of the outgoing direction, from -1 to 1. `transmitted` is None below an opaque
    base.
    """

    reflected: Array
    transmitted: Array | None


def distribution(
    stack: MaterialLike,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    paths: int = 3 * 10**6,
    seed: int = 0,
    microsurface: bool = False,
    bins: int = BINS,
    polarised: bool = False,
) -> Distribution:
    """Energies of reflected and transmitted light on a grid over the projected disc; arguments as `statistics`.

    Raises:
        InvalidInput, MissingTool: as `statistics`.
    """
    stack = load(stack)
    grids = [_grids(stack, wi, paths, seed, microsurface, bins, polarised) for wi in directions(cos_theta, phi)]
    reflected, transmitted = (np.stack([pair[side] for pair in grids], axis=1) for side in (0, 1))
    return Distribution(reflected, transmitted if stack.transmits else None)


def _grids(stack: Stack, wi: Array, paths: int, seed: int, microsurface: bool, bins: int, polarised: bool) -> Array:
    """Energies (2, 3, bins, bins): reflected, transmitted."""
    total = np.zeros((3, 2 * bins * bins))
    for part in trace(stack, wi, paths, seed, microsurface, polarised):
        x, y = np.clip((0.5 * (part.w[:2] + 1) * bins).astype(int), 0, bins - 1)
        cell = (np.where(part.w[2] > 0, 0, bins) + x) * bins + y
        total += [np.bincount(cell, weight, total.shape[1]) for weight in part.weight]
    return total.reshape(3, 2, bins, bins).swapaxes(0, 1) / paths
