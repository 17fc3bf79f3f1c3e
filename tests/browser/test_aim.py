"""Places of the editor's picture that are asked for, of a colour and of a highlight, in headless Chromium.

Rationale: hands, keys, the device's light and its view transform work together.
"""

from __future__ import annotations

import io
from collections.abc import Callable

import chromium
import numpy as np
import pytest
import yaml
from editor import Visit
from PIL import Image

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]

ALBEDO = [0.5, 0.3, 0.1]
CHALK = {"layers": [{"diffuse": {"albedo": ALBEDO}}]}
PAINT = {"layers": [{"interface": {"eta": 1.5}}, {"diffuse": {"albedo": 0.1}}]}
MIRROR = {"layers": [{"interface": {"conductor": "Al", "alpha": 0.1}}]}


def click(page: Visit, across: float, down: float) -> None:
    """Click a place of the picture, in shares of its width and height."""
    box = page.page.locator("canvas").bounding_box()
    assert box
    page.page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])


def chosen(page: Visit, label: str, name: str) -> None:
    page.page.get_by_label(label, exact=True).select_option(name)


def test_a_colour_is_taken_from_the_picture_without_its_view_and_kept(visit: Open) -> None:
    """Expected: chalk in a furnace has the light of its albedo in any view transform; swatches outlive the page."""
    page = visit()
    page.drop(("chalk.yaml", yaml.safe_dump(CHALK)))
    chosen(page, "Object", "sphere")
    chosen(page, "Light", "furnace")
    chosen(page, "View transform", "agx")
    page.page.get_by_role("button", name="Add a light").click()
    strength = page.page.get_by_label("Light 1, strength")
    strength.fill("0")
    strength.press("Enter")
    page.settled()
    page.page.get_by_role("button", name="Light 1, from the picture").click()
    click(page, 0.5, 0.5)
    page.page.wait_for_function("() => velatura.store.get().view.lights[0].colour[2] < 1")
    assert page.state("view.lights.0.colour") == pytest.approx(ALBEDO, rel=0.05)

    # By keys alone, beside the object: what is white is taken as it is
    page.page.get_by_role("button", name="Light 1, from the picture").press("Enter")
    page.page.keyboard.press("Escape")
    assert page.page.evaluate("document.activeElement.ariaLabel") == "Light 1, from the picture"
    taken = page.state("view.lights.0.colour")
    page.page.get_by_role("button", name="Light 1, kept colours").click()
    page.page.get_by_role("button", name="Keep this colour").click()
    page.page.keyboard.press("Escape")
    page.page.get_by_role("button", name="Light 1, from the picture").press("Enter")
    for _ in range(8):
        page.page.keyboard.press("Shift+ArrowLeft")
    page.page.keyboard.press("Enter")
    page.page.wait_for_function("() => velatura.store.get().view.lights[0].colour[2] > .9")
    assert page.state("view.lights.0.colour") == pytest.approx([1, 1, 1], abs=0.02)
    page.page.reload()
    page.ready()
    page.page.get_by_role("button", name="Light 1, kept colours").press("Enter")
    swatch = page.page.locator(".light .swatches .one")
    swatch.press("Enter")
    assert page.state("view.lights.0.colour") == pytest.approx(taken, rel=1e-3)
    page.page.get_by_role("button", name="Light 1, kept colours").press("Enter")
    swatch.press("Delete")
    swatch.wait_for(state="detached")


def test_a_colour_is_taken_from_the_photograph(visit: Open) -> None:
    """Expected: the linear light of its bytes, by the curve of sRGB."""
    page = visit()
    page.drop(("paint.yaml", yaml.safe_dump(PAINT)))
    file = io.BytesIO()
    Image.new("RGB", (8, 8), (128, 64, 32)).save(file, "PNG")
    page.drop(("photo.png", file.getvalue()))
    page.page.wait_for_function("() => velatura.viewport.screen.photograph")
    page.settled()
    page.page.get_by_role("button", name="Add a light").click()
    page.page.get_by_role("button", name="Light 1, from the picture").click()
    click(page, 0.55, 0.5)
    page.page.wait_for_function("() => velatura.store.get().view.lights[0].colour[2] < 1")
    expected = ((np.array([128, 64, 32]) / 255 + 0.055) / 1.055) ** 2.4
    assert page.state("view.lights.0.colour") == pytest.approx(expected, rel=0.02)


def test_a_light_is_placed_by_its_highlight(visit: Open) -> None:
    """Expected: what becomes brightest lies where the click was, while the light around is turned."""
    page = visit()
    page.drop(("mirror.yaml", yaml.safe_dump(MIRROR)))
    chosen(page, "Object", "sphere")
    chosen(page, "Light", "furnace")
    page.page.evaluate("velatura.viewport.setView({ rotation: 0 })")
    rotation = page.page.get_by_label("Rotation of the light", exact=True)
    rotation.fill("70")
    rotation.press("Enter")
    page.page.get_by_role("button", name="Add a light").click()
    for part, value in (("size", "8"), ("strength", "0")):
        field = page.page.get_by_label(f"Light 1, {part}")
        field.fill(value)
        field.press("Enter")
    page.settled()
    before = page.picture()
    page.page.get_by_role("button", name="Place the highlight of Light 1").click()
    click(page, 0.45, 0.4)
    page.page.wait_for_function("() => velatura.store.get().view.lights[0].azimuth !== 45")
    strength = page.page.get_by_label("Light 1, strength")
    strength.fill("30")
    strength.press("Enter")
    page.settled()
    brighter = (page.picture() - before).mean(axis=2)
    brighter[brighter < 0.5 * brighter.max()] = 0
    rows, columns = np.indices(brighter.shape)
    middle = [float((axis * brighter).sum() / brighter.sum()) for axis in (rows, columns)]
    assert brighter.max() > 5
    assert middle == pytest.approx([0.4 * 48, 0.45 * 64], abs=3)

    # The floor has no highlight
    page.page.get_by_role("button", name="Place the highlight of Light 1").click()
    click(page, 0.02, 0.05)
    page.page.get_by_text("There is nothing of the object").wait_for()
