"""Phase functions of media in the editor, in headless Chromium.

Rationale: Python alone knows what follows from a phase function, so that pictures of all models must ask it.
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
