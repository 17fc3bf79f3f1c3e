"""Stokes parameters of the light that a stack reflects and transmits, by random walks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.optics.directions import directions
from velatura.reference.batches import Ends, ends, mean_and_error
from velatura.results import Fields
from velatura.stack import MaterialLike, single

Array = NDArray[np.floating]


@dataclass(frozen=True, repr=False)
class Stokes(Fields):
    """Stokes parameters (4, 3, N) of lobes: I, Q, U and V by colour and direction of incidence.

    Each is that of the lobe's light together, over the intensity that comes in. I is the energy, (I + Q) / 2 that of s,
    whose field lies across the normal of the stack and the direction of light, and (I - Q) / 2 that of p; the degree of
    polarisation is sqrt(Q^2 + U^2 + V^2) / I. For light that leaves along the normal, s is along the bitangent. Lobes
    are those of `Statistics`; `standard_error` has the same names.
    """

    reflected: list[Array]
    transmitted: Array | None
    standard_error: Stokes | None = None


def stokes(
    stack: MaterialLike,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    paths: int = 10**6,
    seed: int = 0,
    microsurface: bool = False,
) -> Stokes:
    """Polarisation of the light that a stack reflects and transmits where unpolarised light comes in.

    Arguments are those of `statistics`, whose energies with `polarised=True` are the I of this.

    Raises:
        InvalidInput, MissingTool: as `statistics`.
    """
    stack = single(stack, "Stokes vectors")
    each = (ends(stack, wi, paths, seed, microsurface, polarised=True) for wi in directions(cos_theta, phi))
    columns = [_column(found, len(stack.surfaces)) for found in each]
    value, error = ([np.stack(lobe, axis=-1) for lobe in zip(*(pair[i] for pair in columns))] for i in (0, 1))
    return _stokes(value, stack.transmits, _stokes(error, stack.transmits, None))


def _stokes(lobes: list[Array], transmits: bool, error: Stokes | None) -> Stokes:
    return Stokes(lobes[:-1], lobes[-1] if transmits else None, error)


def _column(found: Ends, count: int) -> tuple[list[Array], list[Array]]:
    """Parameters (4, 3) of lobes by their deepest surface, and of all that is transmitted; and their errors."""
    assert found.stokes is not None
    each = np.concatenate([found.weight[None], found.stokes])
    up, paths = found.w[2] > 0, each.shape[-1]
    lobes = (*(up & (found.deepest == k) for k in range(count)), ~up)
    values, errors = zip(*(mean_and_error(each[:, :, where], paths) for where in lobes))
    return list(values), list(errors)
