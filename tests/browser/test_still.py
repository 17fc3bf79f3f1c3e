"""The editor's converged still against the Mitsuba render of the same.

Rationale: the page has a path tracer of its own, and only the picture tells whether camera, objects, shading frames,
light and sampling are those of `velatura render`. Linear radiance relative to white, all pixels, nothing clipped; both
pictures are rendered until their own noise is below a third of the bound. `benchmarks/editor.py` does five presets in
larger pictures.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import viewport

import velatura as vt
from velatura.stack import Described

pytestmark = pytest.mark.skipif(bool(viewport.missing()), reason=viewport.missing())

BOUND = 0.01
#: What is drawn as it is at every point, beside what is solved, within a mixture within another.
BRUSHED = vt.Mix([(0.6, "turned-brushing"), (None, vt.Mix([(0.7, "glossy-plastic"), (None, "coated-gold")]))])

#: Paint without any interface above its base.
MATT = vt.Stack([vt.Medium(sigma_s=(4.0, 2.0, 1.0), sigma_a=0.2, g=0.5), vt.Diffuse(albedo=0.4)])


@pytest.fixture(scope="module")
def stage() -> Iterator[viewport.Stage]:
    with viewport.stage(16, 16) as opened:
        yield opened


@pytest.mark.parametrize(
    ("material", "scene", "size", "samples", "spp"),
    [
        (BRUSHED, "ball", 12, 768, 1536),
        (vt.preset("frosted-glass"), "sphere", 3, 16384, 16384),
        (MATT, "ball", 12, 512, 2048),
    ],
    ids=["brushed", "frosted", "matt"],
)
def test_a_still_converges_to_mitsuba(
    material: Described, scene: str, size: int, samples: int, spp: int, stage: viewport.Stage
) -> None:
    """Expected: within .01 of white, a mixture with an anisotropic part on a curved body with a cavity, through a solid
    body, and of paint without any interface."""
    stage.resize(size, size)
    found = viewport.compare(stage, material, scene, "studio", samples, spp)
    assert found.noise < BOUND / 3
    assert found.noise_of_truth < BOUND / 3
    assert found.difference < BOUND
    assert not stage.errors


def test_another_roughness_is_seen(stage: viewport.Stage) -> None:
    """The comparison can fail: pictures of a coat twice as rough differ by more than the bound."""
    stage.resize(12, 12)
    stack = vt.preset("glossy-plastic")
    stage.show(stack, "ball", "studio")
    before = stage.trace(64)
    stage.show(stack.replace(layer0_alpha=2.0 * stack.flat()["layer0_alpha_u"] + 0.1))
    assert np.sqrt(np.mean((stage.trace(64) - before) ** 2)) > BOUND


def test_without_a_material_that_loses_light_the_furnace_is_white(stage: viewport.Stage) -> None:
    """Expected: a mirror in light of 1 from everywhere cannot be told from it, but at the rim, where normals are those
    of a rounder body than its triangles, and light reflected at a few of them
    meets the body again. Mitsuba shows .978 there, and a mean of .9997."""
    stage.resize(12, 12)
    stage.show(vt.preset("furnace"), "sphere", "furnace")
    still = stage.trace(16)
    assert abs(still.mean() - 1.0) < 2e-3
    assert np.abs(still - 1.0).max() < 0.05


def test_the_sun_is_as_bright_as_in_mitsuba(stage: viewport.Stage) -> None:
    """Expected: a matte body in the sky has the same mean, shadow of the plinth and sun included, within 2 %."""
    stage.resize(12, 12)
    found = viewport.compare(stage, vt.Stack([vt.Diffuse(albedo=0.5)]), "ball", "sky", 192, 1024)
    page, truth = (picture.mean(axis=(0, 1)) for picture in found.pictures)
    np.testing.assert_allclose(page, truth, rtol=0.02)


def test_no_paths_are_traced_of_what_is_dragged(stage: viewport.Stage) -> None:
    """A coarse answer knows light from above alone; paths begin with the whole one."""
    stage.resize(12, 12)
    stage.show(vt.preset("frosted-glass"), "sphere", "studio")
    stage.trace(1)
    contents = "const { contents } = viewport.slots.a; viewport.setContents('a', { ...contents, coarse: %s })"
    stage.page.evaluate("() => {" + contents % "true" + "}")
    stage.page.wait_for_function("() => viewport.idle && viewport.rested(500)")
    assert stage.page.evaluate("viewport.samples") == 0
    stage.page.evaluate("() => {" + contents % "false" + "}")
    stage.trace(1)
    assert not stage.errors
