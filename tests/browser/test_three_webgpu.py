"""Modules for three.js's WebGPURenderer in headless Chromium, against the model in NumPy."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import chromium
import in_three
import numpy as np
import pytest

import velatura as vt

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

SIZE, TILT = 24, 0.6
PIXELS = [(12, 12), (8, 14), (5, 12), (15, 6)]


@pytest.fixture(scope="module")
def stage() -> Iterator[in_three.Stage]:
    if not in_three.WEBGPU.folder.is_dir():
        pytest.skip(f"three.js is missing: npm ci in {in_three.bundle.SOURCES}")
    with in_three.stage(in_three.WEBGPU) as opened:
        if not opened.page.evaluate("navigator.gpu?.requestAdapter().then(Boolean)"):
            pytest.skip("Chromium has no adapter for WebGPU")
        yield opened


@pytest.mark.parametrize(("preset", "most"), [("coated-gold", 0.05), ("frosted-glass", 0.03)])
def test_environments_light_a_ball_as_the_model_says(stage: in_three.Stage, preset: str, most: float) -> None:
    """Expected: the mean of 512 samples for each pixel, within .03 of white as displays have it, .05 where layers are
    brushed."""
    [expected] = in_three.sampled(preset, [in_three.softbox()], SIZE, 512, TILT)
    found = stage.ball(vt.export(preset, "three-webgpu").text, in_three.softbox(), SIZE, tilt=TILT)
    assert in_three.matched(expected, found) < most


@pytest.mark.parametrize(
    ("preset", "light"),
    [("glossy-plastic", (0.5, 0.6, 0.6)), ("coated-gold", (0.5, 0.6, 0.6)), ("frosted-glass", (0.1, 0.1, -1.0))],
)
def test_lights_meet_the_model_itself(stage: in_three.Stage, preset: str, light: tuple[float, float, float]) -> None:
    """Expected: values in NumPy, within 5 % in a highlight on a mesh, with texels in half precision; a light of
    intensity 1 has irradiance 1 for a surface that faces it. Through a pane it is seen from behind."""
    towards = np.array(light) / np.linalg.norm(light)
    found = stage.ball(vt.export(preset, "three-webgpu").text, in_three.softbox(), SIZE, light=tuple(towards))
    expected = in_three.by_the_model(preset, towards, PIXELS, SIZE)
    assert expected.max() > 0.01
    np.testing.assert_allclose([found[row, column, :3] for row, column in PIXELS], expected, rtol=0.05, atol=1e-3)


@pytest.mark.parametrize("material", [vt.Stack([vt.Diffuse(albedo=0.8)]), "glossy-plastic"])
def test_area_lights_meet_the_model(stage: in_three.Stage, material: vt.Stack | str) -> None:
    """Expected: sums over 128 x 128 points of the light, within .01 of white as displays have it."""
    assert in_three.missed(stage, material, "three-webgpu") < 0.01


def test_names_do_not_change_the_code(stage: in_three.Stage) -> None:
    """Expected: the light of the same stack without a name."""
    light, layers = (0.0, 0.0, 1.0), [vt.Diffuse(albedo=0.8)]
    named_, plain = vt.Stack(layers, name="`${alert(1)}` \\ */ '\"\u202e"), vt.Stack(layers)
    pictures = [
        stage.ball(vt.export(each, "three-webgpu").text, in_three.softbox(), 8, light) for each in (named_, plain)
    ]
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-5)


def test_the_page_of_the_manual_draws(stage: in_three.Stage) -> None:
    """Expected: the page as it is printed draws the material, with no complaint on its console; its copies of three.js
    are those of the editor's page."""
    manual = Path(__file__).parents[2] / "docs" / "how-to" / "in-my-engine.md"
    _, page, _ = re.findall(r"```html\n(.*?)```", manual.read_text(encoding="utf-8"), re.DOTALL)
    stage.files.update({"gold.js": vt.export("bare-gold", "three-webgpu", "bati2021").text, "page.html": page})
    picture, complaints = stage.visit("page.html", ready="window.shown")
    assert not complaints
    red, _, blue = picture[picture.sum(axis=-1) > 0].mean(axis=0)
    assert red > 1.2 * blue
