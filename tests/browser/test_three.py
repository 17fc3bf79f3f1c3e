"""Modules for three.js as a page imports them, in headless Chromium, against samples of the model in NumPy."""

from __future__ import annotations

import re
from pathlib import Path

import chromium
import in_three
import numpy as np
import pytest

import velatura as vt

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

SIZE, TILT = 24, 0.6


@pytest.mark.parametrize(("preset", "most"), [("varnished-paint", 0.03), ("coated-gold", 0.05)])
def test_environments_light_a_ball_as_the_model_says(three: in_three.Stage, preset: str, most: float) -> None:
    """Expected: the mean of 1,024 samples for each pixel, within .03 of white as displays have it, .05 where layers are
    brushed."""
    [expected] = in_three.sampled(preset, [in_three.softbox()], SIZE, 1024, TILT)
    found = three.ball(vt.export(preset, "three").text, in_three.softbox(), SIZE, tilt=TILT)
    assert in_three.matched(expected, found) < most


def test_lights_meet_the_model_itself(three: in_three.Stage) -> None:
    """Expected: values in NumPy, within 5 % in a highlight on a mesh, with texels in half precision; a light of
    intensity 1 has irradiance 1 for a surface that faces it."""
    light = np.array([0.5, 0.6, 0.6]) / np.linalg.norm([0.5, 0.6, 0.6])
    found = three.ball(vt.export("glossy-plastic", "three").text, in_three.softbox(), SIZE, light=tuple(light))
    pixels = [(12, 12), (8, 14), (5, 12), (15, 6)]
    expected = in_three.by_the_model("glossy-plastic", light, pixels, SIZE)
    np.testing.assert_allclose([found[row, column, :3] for row, column in pixels], expected, rtol=0.05, atol=1e-3)


MATT = vt.Stack([vt.Diffuse(albedo=0.8)])


@pytest.mark.parametrize(("material", "most"), [(MATT, 0.01), ("varnished-paint", 0.01), ("coated-gold", 0.05)])
def test_area_lights_meet_the_model(three: in_three.Stage, material: vt.Stack | str, most: float) -> None:
    """Expected: sums over 128 x 128 points of the light, within .01 of white as displays have it, .05 where layers are
    brushed."""
    assert in_three.missed(three, material, "three") < most


def test_mixtures_are_sums_of_their_parts(three: in_three.Stage) -> None:
    """Expected: a third of one picture and two thirds of the other; a hostile name changes nothing."""
    one, other = vt.Stack([vt.Diffuse(albedo=0.8)]), vt.Stack([vt.Interface(eta=1.5, k=3, alpha=0.3)])
    mixed = vt.Mix([(1 / 3, one), (None, other)], name="`${alert(1)}` \\ */ '\"")
    pictures = [three.ball(vt.export(each, "three").text, in_three.softbox(), SIZE) for each in (mixed, one, other)]
    np.testing.assert_allclose(pictures[0], pictures[1] / 3 + pictures[2] * 2 / 3, atol=5e-3)


def test_the_page_of_the_manual_draws(three: in_three.Stage) -> None:
    """Expected: the page as it is printed draws the material, with no complaint on its console; its copies of three.js
    are those of the editor's page."""
    manual = Path(__file__).parents[2] / "docs" / "how-to" / "in-my-engine.md"
    page, _, _ = re.findall(r"```html\n(.*?)```", manual.read_text(encoding="utf-8"), re.DOTALL)
    three.files.update({"gold.js": vt.export("bare-gold", "three", "bati2021").text, "page.html": page})
    picture, complaints = three.visit("page.html")
    assert not complaints
    red, _, blue = picture[picture.sum(axis=-1) > 0].mean(axis=0)
    assert red > 1.2 * blue
