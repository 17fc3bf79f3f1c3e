"""Pictures as values of a material, in the page.

Rationale: only there are they fetched from the folder, laid on the object and read by the printed program.
"""

from __future__ import annotations

import numpy as np
import pytest
import viewport
from editor import Server, Tabs
from matplotlib.image import imsave

import velatura as vt

pytestmark = pytest.mark.skipif(bool(viewport.missing()), reason=viewport.missing())

BOUND = 0.01  # as of other stills

TEXTURED = """
layers:
  - interface: {eta: 1.5, alpha: 0.05}
  - medium: {depth: 0.5, sigma_a: {texture: spots.png, scale: 3}}
  - interface: {conductor: Al, alpha: {texture: spots.png, curve: [0.1, 0.2, 0.5]}}
"""
FILMED = """
layers:
  - interface: {eta: 1.5, alpha: 0.05}
  - interface: {conductor: Ta, alpha: 0.2, films: [{eta: 2.4, thickness_nm: {texture: spots.png, scale: 300}}]}
"""


@pytest.mark.parametrize("text", [TEXTURED, FILMED])
def test_images_lie_on_the_object_as_in_mitsuba(
    text: str, tabs: Tabs, served: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: within .01 of white, values from a picture that the page fetches from the folder."""
    spots = np.random.default_rng(3).integers(0, 256, (4, 8, 3))
    imsave(served.folder / "spots.png", np.kron(spots, np.ones((4, 4, 1))).astype(np.uint8))
    (served.folder / "spots.yaml").write_text(text)
    visit = tabs.visit(served.entrance)
    page = visit.page
    page.get_by_label("Object", exact=True).select_option("sphere")
    page.get_by_label("Light", exact=True).select_option("studio")
    page.get_by_label("Model", exact=True).select_option("belcour2018")
    page.evaluate("velatura.openFile('spots.yaml')")
    visit.settled()
    page.evaluate("window.viewport = velatura.viewport")
    stage = viewport.Stage(page, visit.complaints)
    stage.resize(16, 16)
    monkeypatch.chdir(served.folder)
    found = viewport.compared(stage, vt.load("spots.yaml"), "sphere", "studio", 512, 1152, "belcour2018")
    tabs.forget()
    assert found.noise < BOUND / 3
    assert found.noise_of_truth < BOUND / 3
    assert found.difference < BOUND
    assert not stage.errors
