"""The figure of the primer, in Chromium: it draws what the package computes, by the keyboard as well."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType
from typing import Any

import chromium
import numpy as np
import pytest
from benchmarks import tool

import velatura as vt
from velatura.model import Model, variance_kind
from velatura.model.context import Context
from velatura.stack import Material

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

DOCS = Path(__file__).parents[2] / "docs"
SLIDERS = ("index", "coat", "depth", "metal", "angle")
CASES = [(1.5, 0.1, 0.3, 0.15, 40), (1.05, 0.03, 0.0, 0.5, 0), (2.2, 0.5, 2.0, 0.03, 80), (1.8, 0.25, 1.0, 0.3, 65)]


@pytest.fixture(scope="module")
def primer() -> ModuleType:
    return tool("primer")


@pytest.fixture(scope="module")
def page(opened: Any) -> Any:
    """The figure alone, as the page has it."""
    text = (DOCS / "explanation" / "primer.md").read_text(encoding="utf-8")
    found = re.search(r"(<figure.*</figure>)\n", text, re.DOTALL)
    assert found
    page = opened.new_page()
    page.set_content(found[1])
    for name in ("primer-data.js", "primer.js"):
        page.add_script_tag(path=DOCS / "_static" / name)
    yield page
    page.close()


def test_the_formulas_are_those_of_the_package(primer: ModuleType) -> None:
    assert primer.DATA.read_text(encoding="utf-8") == primer.text(), "run `python tools/primer.py`"


@pytest.mark.parametrize("case", CASES)
def test_the_figure_draws_the_lobes(case: tuple[float, ...], page: Any, primer: ModuleType) -> None:
    """Expected: energies, roughnesses, and the light by angle, to the last digit that is written or drawn."""
    page.evaluate(
        """(values) => {
            for (const [name, value] of Object.entries(values)) document.querySelector(`[name=${name}]`).value = value;
            document.querySelector('figure').dispatchEvent(new Event('input'));
        }""",
        dict(zip(SLIDERS, case)),
    )
    *layers, angle = case
    stack, cosine = primer.coated(*layers), float(np.cos(np.radians(angle)))
    lobes = vt.lobes(stack, cosine, model=primer.MODEL)
    for k, name in enumerate(("coat", "metal")):
        energy, alpha = (page.locator(f".{name}-{what}").inner_text() for what in ("energy", "alpha"))
        assert float(energy.removesuffix(" %")) == pytest.approx(100 * lobes.energy[k][1, 0], abs=0.051)
        assert float(alpha) == pytest.approx(lobes.alpha[k][0, 0], abs=0.00051)
    lost = page.locator(".lost").inner_text()
    assert float(lost.removesuffix(" %")) == pytest.approx(100 * lobes.absorbed[1, 0], abs=0.051)

    points = np.array([point.split(",") for point in page.locator(".all").get_attribute("points").split()], float)
    rays = (points[1:] - points[0]) * (1, -1)
    view = np.arctan2(rays[:, 0], rays[:, 1])
    drawn = np.square(rays).sum(axis=1) / np.square(rays).sum(axis=1).max()
    seen = np.abs(view) < np.radians(89)
    seen &= drawn > 1e-3  # longer than the digits of its ends
    light = evaluated(stack, primer.MODEL, cosine, view)
    np.testing.assert_allclose(drawn[seen], light[seen] / light.max(), rtol=0.01, atol=2e-3)


def evaluated(stack: vt.Stack, model: Model, cosine: float, view: np.ndarray) -> np.ndarray:
    """Light by solid angle at angles of view in the plane of incidence, in NumPy."""
    material = Material.of(stack)
    body = model.body(material, variance_kind(material), Context())
    still = np.ones_like(view)
    wi = -np.sqrt(1 - cosine**2) * still, 0 * still, cosine * still
    return np.broadcast_to(body.eval_pdf(wi, (np.sin(view), 0 * still, np.cos(view)))[0], (3, view.size))[1]


def test_the_sliders_have_names_and_keys(page: Any) -> None:
    for name in ("Index of the coat", "Roughness of the metal", "Angle of incidence"):
        page.get_by_role("slider", name=name).wait_for()
    slider = page.get_by_role("slider", name="Roughness of the coat")
    before = page.locator(".coat-alpha").inner_text(), slider.get_attribute("aria-valuetext")
    slider.focus()
    page.keyboard.press("ArrowRight" if float(before[0]) < 0.4 else "ArrowLeft")
    after = page.locator(".coat-alpha").inner_text(), slider.get_attribute("aria-valuetext")
    assert before[0] != after[0] and before[1] != after[1]
    assert re.search(r"the metal \d+\.\d %", page.get_by_role("img").get_attribute("aria-label"))
