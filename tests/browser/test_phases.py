"""Phase functions and pigments of media in the editor, in headless Chromium.

Rationale: Python alone knows what follows from them, so that pictures of all models must ask it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import chromium
import pytest
from editor import Server, Tabs, difference, unexpected

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

CLOUDY = """
layers:
  - interface: {eta: 1.5, alpha: 0.1}
  - medium: {depth: 1, sigma_s: 1, g: 0.9}
  - interface: {conductor: Al, alpha: 0.15}
"""
OTHER = 1.0  # of 255: what another phase function makes at least


@pytest.mark.parametrize("model", ["velatura", "yamaguchi2019"])
def test_a_medium_is_given_another_phase_function(model: str, opened: Callable[..., Any], served: Server) -> None:
    tabs = Tabs(opened)
    visit = tabs.visit(served.entrance)
    (served.folder / "cloudy.yaml").write_text(CLOUDY, encoding="utf-8")
    visit.page.evaluate("velatura.openFile('cloudy.yaml')")
    visit.page.wait_for_function("() => velatura.store.get().layers.some(({ kind }) => kind === 'medium')")
    visit.page.get_by_label("Model", exact=True).select_option(model)
    pictures = [visit.picture()]
    menu = visit.page.get_by_label("Phase function", exact=True)
    for name in ("rayleigh", "two_lobes"):
        menu.select_option(name)
        pictures.append(visit.picture())
        assert difference(pictures[-1], pictures[-2]) > OTHER
        assert visit.page.get_by_label("Forward (g)").count() == 0
    field = visit.page.get_by_label("Phase function, share", exact=True)
    field.fill("0.1")
    field.press("Enter")
    assert difference(visit.picture(), pictures[-1]) > OTHER
    assert visit.state("layers.1.keys.phase") == {"forward": 0.8, "backward": -0.3, "share": 0.1}
    menu.select_option("g")
    assert "phase" not in visit.state("layers.1.keys")
    assert unexpected(tabs.forget(), []) == []


PAINTED = """
layers:
  - interface: {eta: 1.5, alpha: 0.1}
  - medium: {depth: 1, pigments: [{name: "white <b>", K: 0.01, S: 4}, {K: [3, 0.8, 0.1], S: 0.4}]}
  - diffuse: {albedo: 0.5}
"""


def test_pigments_stand_in_place_of_what_follows_from_them(opened: Callable[..., Any], served: Server) -> None:
    """Expected: their names, no fields of absorption, a picture that follows their medium, and the same file."""
    tabs = Tabs(opened)
    visit = tabs.visit(served.entrance)
    (served.folder / "painted.yaml").write_text(PAINTED, encoding="utf-8")
    visit.page.evaluate("velatura.openFile('painted.yaml')")
    visit.page.wait_for_function("() => velatura.store.get().layers.some(({ keys }) => keys.pigments)")
    before = visit.picture()
    names = [visit.page.get_by_label(f"Name of pigment {n}") for n in (0, 1)]
    assert [names[0].input_value(), names[1].get_attribute("placeholder")] == ["white <b>", "pigment 1"]
    assert visit.page.get_by_label("Absorption").count() == 0
    field = visit.page.get_by_label("Depth", exact=True).last
    field.fill("0.01")
    field.press("Enter")
    assert difference(visit.picture(), before) > OTHER
    assert len(visit.state("layers.1.keys.pigments")) == 2
    assert unexpected(tabs.forget(), []) == []
