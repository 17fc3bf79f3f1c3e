"""Modules for three.js as a page imports them, in headless Chromium, against samples of the model in NumPy."""

from __future__ import annotations

import chromium
import in_three
import numpy as np
import pytest

import velatura as vt

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())


@pytest.mark.parametrize(("preset", "most"), [("varnished-paint", 0.03), ("coated-gold", 0.05)])
def test_environments_light_a_ball_as_the_model_says(three: in_three.Stage, preset: str, most: float) -> None:
    """Expected: the mean of 256 samples for each pixel, within .03 of white as displays have it, .05 where layers are
    brushed."""
    assert in_three.missed_by_environment(three, preset, "three", 256) < most


def test_lights_meet_the_model_itself(three: in_three.Stage) -> None:
    in_three.meets_light(three, "glossy-plastic", "three", (0.5, 0.6, 0.6))


MATT = vt.Stack([vt.Diffuse(albedo=0.8)])


@pytest.mark.parametrize(("material", "most"), [(MATT, 0.01), ("varnished-paint", 0.01), ("coated-gold", 0.05)])
def test_area_lights_meet_the_model(three: in_three.Stage, material: vt.Stack | str, most: float) -> None:
    """Expected: sums over 128 x 128 points of the light, within .01 of white as displays have it, .05 where layers are
    brushed."""
    assert in_three.missed_by_rectangle(three, material, "three") < most


def test_mixtures_are_sums_of_their_parts(three: in_three.Stage) -> None:
    """Expected: a third of one picture and two thirds of the other; a hostile name changes nothing."""
    one, other = vt.Stack([vt.Diffuse(albedo=0.8)]), vt.Stack([vt.Interface(eta=1.5, k=3, alpha=0.3)])
    mixed = vt.Mix([(1 / 3, one), (None, other)], name="`${alert(1)}` \\ */ '\"")
    pictures = [
        three.ball(vt.export(each, "three").text, in_three.softbox(), in_three.SIZE) for each in (mixed, one, other)
    ]
    np.testing.assert_allclose(pictures[0], pictures[1] / 3 + pictures[2] * 2 / 3, atol=5e-3)


def test_the_page_of_the_manual_draws(three: in_three.Stage) -> None:
    """Expected: the page as it is printed draws the material, with no complaint on its console; its copies of three.js
    are those of the editor's page."""
    gold = vt.export("bare-gold", "three", "bati2021").text
    three.files.update({"gold.js": gold, "page.html": in_three.manual_page(0)})
    picture, complaints = three.visit("page.html")
    assert not complaints
    red, _, blue = picture[picture.sum(axis=-1) > 0].mean(axis=0)
    assert red > 1.2 * blue
