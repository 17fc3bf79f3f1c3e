"""How rough light looks outside: the alpha of the one GGX reflection there that is as wide.

Width is a median of slopes of half-vectors about the mirror's direction, weighted by energy, along the principal axes
of their covariance, as in `velatura.reference.statistics`. Light is that of samples of lobes, on a lattice; with those
medians roughnesses are within 1 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.guards import ALPHA_MIN
from velatura.model.solved.guards import COS_OF_DIRECTIONS_MIN, SAMPLED_ENERGY_MIN, SEARCHED_ALPHA
from velatura.model.solved.lobes import refracted_lobe
from velatura.model.solved.lobes.refracted_lobe import MediumIndex, RefractedLobe
from velatura.model.solved.transmission import combined, internal_reflections
from velatura.model.solved.transmission.combined import Parts
from velatura.model.solved.transmission.direct import Transmission
from velatura.model.variance import Roughness
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.renderer import low_discrepancy

Array = NDArray[np.floating]

SAMPLES = 4 * 377  # of a lobe; four times a Fibonacci number
STEPS = 12  # of the search for a roughness
ENOUGH = 1e-7  # relative change of a roughness, or a median, at which it ends
SLOPES = 0.2, 1.5  # of the logarithm of a median, by that of the roughness
ROUND = 1e-4  # difference of variances, of their sum, below which a lobe hardly has axes


@dataclass(frozen=True)
class LobeSamples:
    """Directions wo above, (N, M) each, of light from wi, (N,) each, with the energy of each, (N, M)."""

    wi: Direction
    wo: Direction
    energy: Array


def of_lobe(lobe: RefractedLobe, wi: Direction) -> LobeSamples:
    """Samples of a lobe with numbers (N,), and a weight (C, N), for directions wi.

    They are those of a GGX reflection outside that is as wide to first order: there the value of a lobe falls off
    steadily towards the horizon, so that the roughness has no steps, as samples inside that are totally reflected have.
    """
    u1, u2 = _lattice(_azimuth(wi) - lobe.roughness.rotation)
    i = ggx.rotate(_columns(wi), lobe.roughness.rotation[:, None])
    wider = np.sqrt(np.maximum(MediumIndex.of(lobe.n).ring2 + i[2] * i[2], 0.0)) / np.maximum(
        i[2], COS_OF_DIRECTIONS_MIN
    )
    u, v = (np.clip(alpha[:, None] * wider, ALPHA_MIN, 1.0) for alpha in lobe.roughness[:2])
    h = ggx.sample_visible(i, u, v, u1, u2)
    density = ggx.masking(i, u, v) * ggx.ndf(h, u, v) / (4 * np.maximum(i[2], COS_OF_DIRECTIONS_MIN))
    x, y, z = (w.ravel() for w in ggx.rotate(ggx.reflect(i, h), -lobe.roughness.rotation[:, None]))
    each = replace(lobe, weight=_each(lobe.weight), roughness=Roughness(*map(_each, lobe.roughness)))
    return _weighted(wi, (x, y, z), refracted_lobe.eval_pdf(each, _direction(wi), (x, y, z))[0], density.ravel())


def of_passed(transmission: Transmission, parts: Parts, wi: Direction) -> LobeSamples:
    """Samples of light that passes, in the medium beyond, turned up; that of wi is refracted by all interfaces."""
    u, u1, u2 = low_discrepancy.at_nodes(len(wi[2]), SAMPLES)
    i, each = _direction(wi), Parts(*map(_each, vars(parts).values()))
    x, y, z = combined.sample(transmission, each, i, u, u1, u2)
    value, density = combined.eval_pdf(transmission, each, i, (x, y, z))
    return _weighted(internal_reflections.seen_below(transmission, wi), (x, y, -z), value, density)


def together(samples: Sequence[LobeSamples]) -> LobeSamples:
    """Light of several lobes."""
    wo = [np.concatenate(each, axis=-1) for each in zip(*(part.wo for part in samples))]
    return LobeSamples(samples[0].wi, (wo[0], wo[1], wo[2]), np.concatenate([part.energy for part in samples], axis=-1))


def roughness(samples: LobeSamples, axis: Array | None = None) -> Roughness:
    """The equivalent roughness, (N,) each; `axis` is the rotation where symmetry gives it."""
    i, o = _columns(samples.wi), samples.wo
    x, y, z = ggx.normalize((i[0] + o[0], i[1] + o[1], np.maximum(i[2] + o[2], COS_OF_DIRECTIONS_MIN)))
    # Light of no energy has the shape of its samples
    total = samples.energy.sum(axis=-1, keepdims=True)
    weight = np.where(
        total > SAMPLED_ENERGY_MIN, samples.energy / np.maximum(total, SAMPLED_ENERGY_MIN), 1 / z.shape[-1]
    )
    azimuth = _azimuth(samples.wi)
    rotation = _axis((x, y, z), weight, azimuth) if axis is None else axis
    x, y, z = ggx.rotate((x, y, z), rotation[:, None])
    target = np.array([_median(w / z, weight) for w in (x, y)])
    u, v = _matching(ggx.rotate(samples.wi, rotation), azimuth - rotation, target)
    return Roughness(u, v, rotation)


def _matching(wi: Direction, azimuth: Array, target: Array) -> Array:
    """Roughnesses (2, N) of GGX reflections of wi, (N,) each, in their frame, whose medians are `target`.

    Medians grow almost in proportion to the roughness, so that the first step is that of the median; secants follow.
    """
    u1, u2 = _lattice(azimuth)
    wi = _columns(wi)
    alpha, slope = np.clip(target, *SEARCHED_ALPHA), np.ones_like(target)
    before: tuple[Array, Array] | None = None
    for _ in range(STEPS):
        u, v = alpha[..., None]
        h = ggx.sample_visible(wi, u, v, u1, u2)
        weight = ggx.masking(ggx.reflect(wi, h), u, v)
        off = np.log([_step(w / h[2], weight, m) for w, m in zip(h[:2], target)])
        if before is not None:
            change = np.log(alpha / before[0])
            seen = np.clip((off - before[1]) / np.where(change == 0, 1.0, change), *SLOPES)
            slope = np.where(change == 0, slope, seen)
        before = alpha, off
        alpha = np.clip(alpha * np.exp(-off / slope), *SEARCHED_ALPHA)
        if np.all(np.abs(alpha - before[0]) < ENOUGH * alpha):
            break
    return alpha


def _lattice(azimuth: Array) -> tuple[Array, Array]:
    """Uniform numbers (N, M) for visible normals, in any frame alike on both sides of the plane of incidence, and
    along and across it; its azimuth in the frame, (N,), is given, as the normal itself has one in no frame."""
    u1, u2 = low_discrepancy.fibonacci(SAMPLES // 4)
    turn = azimuth[:, None] / (2 * np.pi)
    turned = np.concatenate([u1, 1 - u1, u1 + 0.25, 1.25 - u1])
    return (turned + turn) % 1, np.tile(u2, 4) + 0 * turn


def _azimuth(wi: Direction) -> Array:
    return np.asarray(np.arctan2(wi[1], wi[0]))


def _median(x: Array, weight: Array) -> Array:
    """Weighted medians (N,) of sizes over the last axis, of steps that are smooth: so it takes few samples."""
    x = np.abs(x)
    median = np.exp(ops.divide(np.sum(weight * np.log(x + ops.TINY), axis=-1), np.sum(weight, axis=-1)))
    for _ in range(STEPS):
        step = _step(x, weight, median)
        median = median * step
        if np.all(np.abs(step - 1) < ENOUGH):
            break
    return np.asarray(median)


def _step(x: Array, weight: Array, median: Array) -> Array:
    """Newton update factor of the smoothed median. A value counts as below m for 1 / (1 + (x/m)^4)."""
    square = ops.divide(x, median[..., None]) ** 2
    below = 1 / (1 + square * square)
    excess = np.sum(weight * (below - 0.5), axis=-1)
    slope = 4 * np.sum(weight * below * (1 - below), axis=-1)
    return np.asarray(np.exp(np.clip(-ops.divide(excess, slope), -1, 1)))


def _axis(h: Direction, weight: Array, azimuth: Array) -> Array:
    """Angle (N,) of the longer principal axis of normals on the disc, of weights with sum 1; that of the plane of
    incidence where hardly any axis is longer."""
    x, y = (w - np.sum(weight * w, axis=-1, keepdims=True) for w in h[:2])
    xx, xy, yy = (np.sum(weight * product, axis=-1) for product in (x * x, x * y, y * y))
    little = ROUND * (xx + yy)
    return np.asarray(0.5 * np.arctan2(2 * xy + little * np.sin(2 * azimuth), xx - yy + little * np.cos(2 * azimuth)))


def _weighted(wi: Direction, wo: Direction, value: Array, density: Array) -> LobeSamples:
    shape = len(wi[2]), SAMPLES
    energy = ops.divide(np.mean(np.atleast_2d(value), axis=0), density)
    x, y, z = (np.broadcast_to(w, energy.shape).reshape(shape) for w in wo)
    return LobeSamples(wi, (x, y, z), energy.reshape(shape))


def _columns(w: Direction) -> Direction:
    return w[0][:, None], w[1][:, None], w[2][:, None]


def _direction(w: Direction) -> Direction:
    return _each(w[0]), _each(w[1]), _each(w[2])


def _each(value: Array | float) -> Array | float:
    """Values at directions, once for each sample."""
    return low_discrepancy.repeated(value, SAMPLES) if np.ndim(value) else value
