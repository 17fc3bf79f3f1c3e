"""Numbers of the editor's page under the hand, in headless Chromium: dragged by their labels, typed, and taken back.

Rationale: pointers, wheels and double clicks exist in a browser alone, and one component serves all numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import chromium
import pytest
from editor import Visit

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]


def scrub(page: Visit, label: Any, pixels: int, key: str = "") -> None:
    """Drag a label sideways, with a key held."""
    label.scroll_into_view_if_needed()
    box = label.bounding_box()
    x, y = box["x"] + 4, box["y"] + box["height"] / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    if key:
        page.page.keyboard.down(key)
    page.page.mouse.move(x + pixels, y, steps=4)
    page.page.mouse.up()
    if key:
        page.page.keyboard.up(key)


def test_a_label_is_dragged_and_a_double_click_on_it_takes_the_default(visit: Open) -> None:
    """Expected: a step of .01 a pixel, ten with Shift, a tenth with Ctrl, within the range; a drag is one undo."""
    page = visit()
    layer = page.page.locator(".layer").nth(0)
    steps = len(page.page.evaluate("velatura.store.history().past"))
    label = layer.get_by_text("Roughness")
    start = page.state("layers.0.keys.alpha")
    scrub(page, label, 20)
    assert page.state("layers.0.keys.alpha") == pytest.approx(start + 0.2)
    page.settled()
    scrub(page, label, -20, "Control")
    assert page.state("layers.0.keys.alpha") == pytest.approx(start + 0.18)
    page.settled()
    scrub(page, label, 20, "Shift")
    assert page.state("layers.0.keys.alpha") == 1
    page.settled()
    assert len(page.page.evaluate("velatura.store.history().past")) == steps + 3
    label.dblclick()
    assert page.state("layers.0.keys.alpha") == 0
    page.page.keyboard.press("Control+z")
    assert page.state("layers.0.keys.alpha") == 1

    # Of a channel, of all of a colour, of a label around its field, and of a setting
    medium = page.page.locator(".layer.medium")
    green = page.state("layers.1.keys.sigma_a.1")
    scrub(page, medium.locator(".channel.green .tag"), 10)
    assert page.state("layers.1.keys.sigma_a.1") == pytest.approx(green + 0.1)
    medium.get_by_text("Absorption").dblclick()
    assert page.state("layers.1.keys.sigma_a") == 0
    scrub(page, page.page.locator(".top label", has_text="Exterior"), 10)
    assert page.state("exterior") == pytest.approx(1.1)
    assert page.page.evaluate("document.activeElement.ariaLabel") != "Exterior index"
    page.page.locator(".top label", has_text="Exterior").dblclick(position={"x": 4, "y": 8})
    assert page.state("exterior") == 1
    scrub(page, page.page.get_by_text("Exposure"), -50)
    assert page.state("view.exposure") == -0.5
    page.page.get_by_text("Exposure").dblclick()
    assert page.state("view.exposure") == 0
    page.settled()


def test_arithmetic_percent_and_units_are_typed_and_the_wheel_turns_where_the_focus_is(visit: Open) -> None:
    page = visit()
    layer = page.page.locator(".layer").nth(0)

    def typed(field: Any, text: str) -> None:
        field.fill(text)
        field.press("Enter")

    roughness = layer.get_by_label("Roughness", exact=True)
    for text, expected in (("1/3", 1 / 3), ("25 %", 0.25), ("(1 - 0,4) / 2", 0.3)):
        typed(roughness, text)
        assert page.state("layers.0.keys.alpha") == pytest.approx(expected)
    assert roughness.input_value() == "0.3"
    typed(roughness, "0.2 mm")
    page.page.locator(".messages").get_by_text("Roughness: must be a number, got 0.2 mm").wait_for()
    assert page.state("layers.0.keys.alpha") == pytest.approx(0.3)
    depth = page.page.locator(".layer.medium").get_by_label("Depth", exact=True)
    typed(depth, "0.2 mm + 50 um")
    assert page.state("layers.1.keys.depth") == pytest.approx(0.25)

    depth.hover()
    page.page.mouse.wheel(0, -100)
    assert page.state("layers.1.keys.depth") == pytest.approx(0.26)
    page.page.keyboard.press("Control+ArrowUp")
    page.page.keyboard.press("Shift+ArrowDown")
    assert page.state("layers.1.keys.depth") == pytest.approx(0.161)
    roughness.hover()
    page.page.mouse.wheel(0, -100)  # the page scrolls
    assert page.state("layers.0.keys.alpha") == pytest.approx(0.3)
    page.settled()
