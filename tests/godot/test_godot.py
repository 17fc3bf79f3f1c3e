"""Exported materials in Godot 4.6, built for the web, in headless Chromium, against the model in NumPy."""

from __future__ import annotations

import in_godot
import in_three
import numpy as np
import pytest

import velatura as vt

pytestmark = pytest.mark.skipif(bool(in_godot.missing()), reason=in_godot.missing())

SIZE, ENERGY = 24, 0.3
PIXELS = [(12, 12), (8, 14), (5, 12), (15, 6)]
LIGHT = np.array([0.5, 0.6, 0.6]) / np.linalg.norm([0.5, 0.6, 0.6])


def linear(shown: np.ndarray) -> np.ndarray:
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def test_lights_meet_the_model_itself() -> None:
    """Expected: no complaint, and values in NumPy within 6 % and the steps of 8 bits; a light's energy is its
    irradiance over pi. A hostile name changes nothing."""
    names = ["glossy-plastic", "varnished-paint", "frosted-glass"]
    stacks = [vt.preset(name) for name in names]
    hostile = vt.Stack(stacks[0].layers, name='\\ "}] ; // [resource]\\')
    texts = [vt.export(stack, "godot").text for stack in [*stacks, hostile]]
    (*found, named_), complaints = in_godot.balls(texts, tuple(LIGHT.tolist()), SIZE, ENERGY)
    assert not complaints
    np.testing.assert_array_equal(named_, found[0])
    for stack, picture in zip(stacks, found):
        expected = in_three.by_the_model(stack, LIGHT, PIXELS, SIZE) * np.pi * ENERGY
        shown = np.array([picture[pixel] for pixel in PIXELS])
        np.testing.assert_allclose(linear(shown), expected, rtol=0.06, atol=2e-3)
