"""Light of materials does not jump where a parameter changes: a slice of `benchmarks/continuity.py`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from benchmarks import benchmark

from velatura.model import named
from velatura.stack import Stack

continuity = benchmark("continuity")

LEAST = 5e-4  # share of the light
STEPS = 16
#: Where light jumped: roughness that begins, modes of the azimuth, events at the horizon, veils, clipped remainders.
SCANS = (
    ("smooth coat", "layer1_alpha"),
    ("smooth coat", "layer1_alpha_u"),
    ("fog", "layer0_g"),
    ("scattering-medium-over-gold", "layer0_depth"),
)


@pytest.mark.parametrize(("name", "parameter"), SCANS)
def test_light_does_not_jump(name: str, parameter: str) -> None:
    (scan,) = (each for each in continuity.scans(continuity.materials()[name]) if each.name == parameter)
    assert continuity.jumps(scan, continuity.Light(named("velatura"), False), STEPS, LEAST) == []


class Known:
    """Light that jumps by .01 of itself at a roughness of .3, and has a steep slope at .6."""

    energetic = np.array([True, False])

    def __call__(self, stack: Stack) -> tuple[Any, Any]:
        alpha = stack.flat()["layer0_alpha_u"]
        energy = 0.5 + 0.005 * (alpha >= 0.3) + 0.1 * np.tanh((alpha - 0.6) / 1e-4)
        return np.array([energy, energy]), np.array([energy, energy])

    def name(self, number: int) -> str:
        return ("energy", "value")[number]


def test_jumps_are_found_and_slopes_are_not() -> None:
    (scan,) = (each for each in continuity.scans(continuity.OWN["bare glass"]) if each.name == "layer0_alpha")
    found = continuity.jumps(scan, Known(), STEPS, LEAST)
    assert {jump.quantity for jump in found} == {"energy", "value"}
    assert [jump.value for jump in found] == pytest.approx([0.3, 0.3], abs=1e-7)
    assert [jump.size for jump in found] == pytest.approx([0.0125, 0.0125], rel=1e-3)
