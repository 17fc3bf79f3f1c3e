"""The phase function of a medium of a material."""

from __future__ import annotations

import functools

from velatura.media.tabulated import Tabulated
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction, Rayleigh, TwoLobes
from velatura.stack import SlabValues
from velatura.stack import phases as written


def phase_of(layer: SlabValues) -> PhaseFunction:
    """The phase function of a medium of values in any dialect.

    Raises:
        MissingTool: it is Mie's, and the package that works it out is not installed.
    """
    return HenyeyGreenstein(layer.g) if layer.phase is None else _of(layer.phase)


@functools.lru_cache(64)
def _of(phase: written.WrittenPhase) -> PhaseFunction:
    if isinstance(phase, written.TwoLobes):
        return TwoLobes(HenyeyGreenstein(phase.forward), HenyeyGreenstein(phase.backward), phase.share)
    if isinstance(phase, written.TabulatedPhase):
        return Tabulated.of(*phase.tabulated())
    return Rayleigh()
