"""Modules for Babylon.js as a page imports them, in headless Chromium, against samples of the model in NumPy."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import chromium
import in_babylon
import in_three
import numpy as np
import pytest

import velatura as vt

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

SIZE, TILT = 24, 0.6


@pytest.fixture(scope="module")
def stage() -> Iterator[in_three.Stage]:
    if not in_babylon.BABYLON.folder.is_dir():
        pytest.skip("Babylon.js is missing: npm ci in tests/page")
    with in_three.stage(in_babylon.BABYLON) as opened:
        yield opened


def test_environments_light_a_ball_as_the_model_says(stage: in_three.Stage) -> None:
    """Expected: the mean of 512 samples for each pixel, within .03 of white as displays have it; the engine's panoramas
    begin a quarter of a turn from those of three.js, whose test draws brushed layers by the same code."""
    preset, sky = "glossy-plastic", in_three.softbox()
    [expected] = in_three.sampled(preset, [np.roll(sky, -(sky.shape[1] // 4), axis=1)], SIZE, 512, TILT)
    found = stage.ball(vt.export(preset, "babylon").text, sky, SIZE, tilt=TILT)
    assert in_three.matched(expected, found) < 0.03


def test_lights_meet_the_model_itself(stage: in_three.Stage) -> None:
    """Expected: values in NumPy, within 5 % in a highlight on a mesh, with texels in half precision; a light of
    intensity 1 has irradiance 1 for a surface that faces it."""
    light = np.array([0.5, 0.6, 0.6]) / np.linalg.norm([0.5, 0.6, 0.6])
    found = stage.ball(vt.export("glossy-plastic", "babylon").text, in_three.softbox(), SIZE, light=tuple(light))
    pixels = [(12, 12), (8, 14), (5, 12), (15, 6)]
    expected = in_three.by_the_model("glossy-plastic", light, pixels, SIZE)
    np.testing.assert_allclose([found[row, column, :3] for row, column in pixels], expected, rtol=0.05, atol=1e-3)


def test_names_do_not_reach_the_engine_s_preprocessor(stage: in_three.Stage) -> None:
    """Expected: the light of the same stack without a name. The engine reads directives in comments, too, and patterns
    of replacements."""
    light, layers = (0.0, 0.0, 1.0), [vt.Diffuse(albedo=0.8)]
    named_, plain = vt.Stack(layers, name="`${alert(1)}` $& #if */ '\""), vt.Stack(layers)
    pictures = [stage.ball(vt.export(each, "babylon").text, in_three.softbox(), 8, light) for each in (named_, plain)]
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-5)


def test_the_page_of_the_manual_draws(stage: in_three.Stage) -> None:
    """Expected: the page as it is printed draws the material, with no complaint on its console."""
    manual = Path(__file__).parents[2] / "docs" / "how-to" / "in-my-engine.md"
    _, _, page = re.findall(r"```html\n(.*?)```", manual.read_text(encoding="utf-8"), re.DOTALL)
    sky = in_three.radiance(in_three.softbox())
    stage.files.update(
        {"gold.js": vt.export("bare-gold", "babylon", "bati2021").text, "page.html": page, "sky.hdr": sky}
    )
    picture, complaints = stage.visit("page.html", ready="BABYLON.EngineStore.LastCreatedScene?.isReady()")
    assert not complaints
    red, _, blue = picture[32 - 8 : 32 + 8, 32 - 8 : 32 + 8].mean(axis=(0, 1))
    assert red > 1.2 * blue
