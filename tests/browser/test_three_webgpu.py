"""Modules for three.js's WebGPURenderer in headless Chromium, against the model in NumPy."""

from __future__ import annotations

from collections.abc import Iterator

import chromium
import in_three
import numpy as np
import pytest

import velatura as vt

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())


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
    """Expected: the mean of 256 samples for each pixel, within .03 of white as displays have it, .05 where layers are
    brushed."""
    assert in_three.missed_by_environment(stage, preset, "three-webgpu", 256) < most


FOG = vt.Stack([vt.Medium(depth=1.0, sigma_s=(1.5, 1.2, 0.9), g=0.4), vt.Diffuse(albedo=(0.2, 0.5, 0.3))])


@pytest.mark.parametrize(
    ("material", "light"),
    [
        ("glossy-plastic", (0.5, 0.6, 0.6)),
        ("coated-gold", (0.5, 0.6, 0.6)),
        ("frosted-glass", (0.1, 0.1, -1.0)),
        (FOG, (0.5, 0.6, 0.6)),
    ],
)
def test_lights_meet_the_model_itself(
    stage: in_three.Stage, material: vt.Stack | str, light: tuple[float, float, float]
) -> None:
    """A pane is lit from behind; of fog, values too read the texture."""
    in_three.meets_light(stage, material, "three-webgpu", light)


@pytest.mark.parametrize("material", [vt.Stack([vt.Diffuse(albedo=0.8)]), "glossy-plastic"])
def test_area_lights_meet_the_model(stage: in_three.Stage, material: vt.Stack | str) -> None:
    """Expected: sums over 128 x 128 points of the light, within .01 of white as displays have it."""
    assert in_three.missed_by_rectangle(stage, material, "three-webgpu") < 0.01


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
    gold = vt.export("bare-gold", "three-webgpu", "bati2021").text
    stage.files.update({"gold.js": gold, "page.html": in_three.manual_page(1)})
    picture, complaints = stage.visit("page.html", ready="window.shown")
    assert not complaints
    red, _, blue = picture[picture.sum(axis=-1) > 0].mean(axis=0)
    assert red > 1.2 * blue
