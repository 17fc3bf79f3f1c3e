"""Lobe statistics of a material as NumPy arrays, for analysis; needs no renderer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from velatura.model.adding import Lobe
from velatura.model.models import DEFAULT, Model, named
from velatura.model.prepare import lobes, prepare
from velatura.model.variance import Isotropic, Roughness
from velatura.optics.directions import directions
from velatura.stack import Material, Stack

FAINTLY_BRUSHED = 0.01  # difference of two roughnesses, below which an interface hardly has axes


@dataclass(frozen=True)
class LobeStatistics:
    """One lobe, for N directions and C channels.

    energy (C, N); covariance (3, N): xx, xy, yy in the space of the model's roughness map, in the shading frame;
    alpha (2, N) along two axes, the first turned from the tangent by rotation (N,), radians anticlockwise. With
    `channels=separate` all but the energy have a leading axis of channels.
    """

    energy: np.ndarray
    covariance: np.ndarray
    alpha: np.ndarray
    rotation: np.ndarray


@dataclass(frozen=True)
class StackLobes:
    """Reflected lobes as lists over interfaces from the top, and the transmitted lobe (None below an opaque base)."""

    energy: list[np.ndarray]
    covariance: list[np.ndarray]
    alpha: list[np.ndarray]
    rotation: list[np.ndarray]
    transmitted: LobeStatistics | None


def stack_lobes(
    stack: Stack,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    model: str | Model = DEFAULT,
    **switches: str,
) -> StackLobes:
    """The lobes of a stack; see `velatura.lobes`."""
    chosen = named(model, **switches)
    x, y, z = directions(cos_theta, phi).T
    material = Material.of(stack)
    reflected, transmitted = lobes(prepare(material.solid(), chosen), (x, y, z))
    in_plane = chosen.recursion.lobe_kind(Isotropic) is not Isotropic
    axis = _axis(material, np.arctan2(y, x) if in_plane else np.zeros_like(z))
    each = [_collect(lobe, chosen, axis) for lobe in reflected]
    return StackLobes(
        energy=[lobe.energy for lobe in each],
        covariance=[lobe.covariance for lobe in each],
        alpha=[lobe.alpha for lobe in each],
        rotation=[lobe.rotation for lobe in each],
        transmitted=_collect(transmitted, chosen, axis) if stack.transmits else None,
    )


def _axis(material: Material, isotropic: np.ndarray) -> np.ndarray:
    """Azimuths (N,) to which the first axis of a lobe is the nearer one.

    They are the mean axis of the interfaces, by how anisotropic each is, so that axes keep their names where a value
    changes by little; `isotropic` where none is.
    """
    double = FAINTLY_BRUSHED * np.exp(2j * isotropic)
    for layer in material.interfaces:
        double = double + abs(layer.alpha_u - layer.alpha_v) * np.exp(2j * np.radians(layer.rotation))
    return 0.5 * np.angle(double)


def with_axes_named(roughness: Roughness, axis: ArrayLike) -> Roughness:
    """The same roughness with the axis first that is nearer to a given one."""
    u, v, rotation = roughness
    other = np.cos(2 * (rotation - axis)) < 0
    across = rotation - np.copysign(0.5 * np.pi, rotation)
    return Roughness(np.where(other, v, u), np.where(other, u, v), np.where(other, across, rotation))


def _collect(lobe: Lobe, model: Model, axis: np.ndarray) -> LobeStatistics:
    lead, count = (3,) if model.channels == "separate" else (), len(axis)

    def shaped(values: Sequence[Any], axis: int) -> np.ndarray:
        return np.stack([np.broadcast_to(v, (*lead, count)) for v in values], axis=axis)

    alpha_u, alpha_v, rotation = with_axes_named(lobe.roughness, axis)
    return LobeStatistics(
        energy=np.broadcast_to(lobe.energy, (3, count)).copy(),
        covariance=shaped(lobe.variance.matrix(), -2),
        alpha=shaped((alpha_u, alpha_v), -2),
        rotation=shaped((rotation,), -2)[..., 0, :],
    )
