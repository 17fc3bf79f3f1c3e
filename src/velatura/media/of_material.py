"""The phase function of a medium of a material, and two lobes that stand in for it."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from velatura.media.tabulated import Tabulated
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction, Rayleigh, TwoLobes
from velatura.stack import SlabValues
from velatura.stack import phases as written

Array = NDArray[np.floating]

DRAWN = 4096  # cosines, for moments
SPREAD_MIN = 1e-3
G_MAX = 0.98


def phase_of(layer: SlabValues) -> PhaseFunction:
    """The phase function of a medium of values in any dialect.

    Raises:
        MissingTool: it is Mie's, and the package that works it out is not installed.
    """
    return HenyeyGreenstein(layer.g) if layer.phase is None else _of(layer.phase)


def two_lobes(phase: PhaseFunction) -> TwoLobes:
    """Two lobes with the first three moments of a phase function of numbers. Of one that has none such, a lobe and even
    scattering with the first two, or a lobe of its asymmetry."""
    if isinstance(phase, TwoLobes):
        return phase
    if isinstance(phase, HenyeyGreenstein):
        return TwoLobes(phase, phase, 1.0)
    cosine = phase.sample((np.arange(DRAWN) + 0.5) / DRAWN)
    first, second, third = (float(np.mean(x)) for x in _legendre(cosine))
    spread = max(second - first * first, SPREAD_MIN)
    # Asymmetries are the nodes of Gauss's quadrature of these moments
    half, product = 0.5 * (third - first * second) / spread, (first * third - second * second) / spread
    root = float(np.sqrt(max(half * half - product, SPREAD_MIN)))
    nodes = half + root, half - root
    if second <= first * first or max(map(abs, nodes)) > G_MAX:
        widest = second <= first * first or second > G_MAX * abs(first)
        nodes = (first, 0.0) if widest else (second / first, 0.0)
    forward, backward = nodes
    share = (first - backward) / (forward - backward) if forward != backward else 1.0
    return TwoLobes(HenyeyGreenstein(forward), HenyeyGreenstein(backward), share)


def _legendre(x: Array) -> tuple[Array, Array, Array]:
    return x, 0.5 * (3 * x * x - 1), 0.5 * (5 * x * x * x - 3 * x)


@functools.lru_cache(64)
def _of(phase: written.WrittenPhase) -> PhaseFunction:
    if isinstance(phase, written.TwoLobes):
        return TwoLobes(HenyeyGreenstein(phase.forward), HenyeyGreenstein(phase.backward), phase.share)
    if isinstance(phase, written.TabulatedPhase):
        return Tabulated.of(*phase.tabulated())
    return Rayleigh()
