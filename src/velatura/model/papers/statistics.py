"""Lobe statistics of a material as NumPy arrays, for analysis; needs no renderer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.model.base import Model
from velatura.model.lobe_statistics import LobeStatistics, StackLobes, nearer_axis, with_axes_named
from velatura.model.papers.adding import Lobe, lobes
from velatura.model.papers.diffuse_base import under, with_means
from velatura.model.papers.prepare import prepare
from velatura.optics.ggx import Direction
from velatura.stack import Material


def added(material: Material, model: Model, wi: Direction) -> StackLobes:
    """The lobes of a material with values in NumPy by a recursion that draws them outside, for directions (N,)."""
    prepared = prepare(material, model)
    reflected, transmitted = lobes(prepared, wi)
    axis = nearer_axis(material, np.zeros_like(wi[2]))
    base = under(with_means(prepared), wi)
    return StackLobes.of(
        wi,
        [_collect(lobe, model, axis) for lobe in reflected],
        _collect(transmitted, model, axis) if material.transmits else None,
        np.broadcast_to(base.energy if base else 0.0, (3, len(wi[2]))).copy(),
    )


def _collect(lobe: Lobe, model: Model, axis: np.ndarray) -> LobeStatistics:
    """The statistics of a lobe that is drawn outside."""
    lead, count = (3,) if model.channels == "separate" else (), len(axis)

    def shaped(values: Sequence[Any], axis: int) -> np.ndarray:
        return np.stack([np.broadcast_to(v, (*lead, count)) for v in values], axis=axis)

    alpha_u, alpha_v, turned = with_axes_named(lobe.roughness, axis)
    alpha, rotation = shaped((alpha_u, alpha_v), -2), shaped((turned,), -2)[..., 0, :]
    return LobeStatistics(
        energy=np.broadcast_to(lobe.energy, (3, count)).copy(),
        covariance=shaped(lobe.variance.matrix(), -2),
        alpha=alpha,
        rotation=rotation,
        own_alpha=alpha,
        own_rotation=rotation,
    )
