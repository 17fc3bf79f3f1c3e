"""Modules for Babylon.js as a page imports them, in headless Chromium, against samples of the model in NumPy."""

from __future__ import annotations

from collections.abc import Iterator

import chromium
import in_babylon
import in_three
import numpy as np
import pytest

import velatura as vt

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())


@pytest.fixture(scope="module")
def stage() -> Iterator[in_three.Stage]:
    if not in_babylon.BABYLON.folder.is_dir():
        pytest.skip("Babylon.js is missing: npm ci in tests/page")
    with in_three.stage(in_babylon.BABYLON) as opened:
        opened.files.update(in_babylon.TABLES)
        yield opened


def test_environments_light_a_ball_as_the_model_says(stage: in_three.Stage) -> None:
    """Expected: the mean of 256 samples for each pixel, within .03 of white as displays have it; the
    test of three.js draws brushed layers by the same code."""
    assert in_three.missed_by_environment(stage, "glossy-plastic", "babylon", 256) < 0.03


def test_lights_meet_the_model_itself(stage: in_three.Stage) -> None:
    in_three.meets_light(stage, "glossy-plastic", "babylon", (0.5, 0.6, 0.6))


@pytest.mark.parametrize("material", [vt.Stack([vt.Diffuse(albedo=0.6)]), "varnished-paint"])
def test_area_lights_meet_the_model(stage: in_three.Stage, material: vt.Stack | str) -> None:
    """Expected: sums over 128 x 128 points of the light, within .01 of white as displays have it."""
    assert in_three.missed_by_rectangle(stage, material, "babylon") < 0.01


def test_names_do_not_reach_the_engine_s_preprocessor(stage: in_three.Stage) -> None:
    """Expected: the light of the same stack without a name. The engine reads directives in comments, too, and patterns
    of replacements."""
    light, layers = (0.0, 0.0, 1.0), [vt.Diffuse(albedo=0.8)]
    named_, plain = vt.Stack(layers, name="`${alert(1)}` $& #if */ '\""), vt.Stack(layers)
    pictures = [stage.ball(vt.export(each, "babylon").text, in_three.softbox(), 8, light) for each in (named_, plain)]
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-5)


def test_the_page_of_the_manual_draws(stage: in_three.Stage) -> None:
    """Expected: the page as it is printed draws the material, with no complaint on its console."""
    gold, sky = vt.export("bare-gold", "babylon", "bati2021").text, in_three.radiance(in_three.softbox())
    stage.files.update({"gold.js": gold, "page.html": in_three.manual_page(2), "sky.hdr": sky})
    picture, complaints = stage.visit("page.html", ready="BABYLON.EngineStore.LastCreatedScene?.isReady()")
    assert not complaints
    red, _, blue = picture[32 - 8 : 32 + 8, 32 - 8 : 32 + 8].mean(axis=(0, 1))
    assert red > 1.2 * blue
