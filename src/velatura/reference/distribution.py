"""Distribution of light: energies on a grid over the projected disc."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.light.square_bins import BINS, grids
from velatura.optics.directions import directions
from velatura.reference.batches import trace
from velatura.results import Fields
from velatura.stack import Described, MaterialLike, Stack, load

Array = NDArray[np.floating]


@dataclass(frozen=True, repr=False)
class Distribution(Fields):
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

    Those of a mixture are sums of its stacks', by their shares.

    Raises:
        InvalidInput, MissingTool: as `statistics`.
    """
    material: Described = load(stack)
    shares, stacks = zip(*material.weighted("a distribution is that of one point; replace it by a number"))
    each = [
        sum(
            share * _walked(stack, wi, paths, seed, microsurface, bins, polarised)
            for share, stack in zip(shares, stacks)
        )
        for wi in directions(cos_theta, phi)
    ]
    reflected, transmitted = (np.stack([pair[side] for pair in each], axis=1) for side in (0, 1))
    return Distribution(reflected, transmitted if any(stack.transmits for stack in stacks) else None)


def _walked(stack: Stack, wi: Array, paths: int, seed: int, microsurface: bool, bins: int, polarised: bool) -> Array:
    """Energies (2, 3, bins, bins): reflected, transmitted."""
    parts = trace(stack, wi, paths, seed, microsurface, polarised)
    total = sum(grids(part.w[:2], part.weight, part.w[2] <= 0, 2, bins) for part in parts)
    return np.swapaxes(total, 0, 1) / paths
