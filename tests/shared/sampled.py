"""Tables of tests, read by NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from velatura.renderer.packets import SampledGrid


@dataclass(frozen=True)
class Sampled(SampledGrid):
    """Values at the nodes of a grid, with channels on the last axis."""

    data: np.ndarray
