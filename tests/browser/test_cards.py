"""The cards of layers in headless Chromium: folded, searched, for experts, and reordered without a red message.

Rationale: what a card shows depends on the page's own state, which no file has, and on what hands may do to its layer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import chromium
import pytest
from editor import Server, Tabs, Visit, unexpected

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]
PLAIN = "localStorage['velatura.layout'] ??= '{}'"  # as a browser without a past has the page


@pytest.fixture
def visit(tabs: Tabs, served: Server) -> Iterator[Open]:
    """Opens the page, with the preset coated-gold, in a browser without a past, whose console may not complain."""
    yield lambda script="": tabs.visit(served.entrance, script)
    assert unexpected(tabs.forget(), []) == []


def test_cards_fold_and_show_what_is_sought_and_coefficients_to_experts(visit: Open) -> None:
    page = visit(PLAIN)
    layers = page.page.locator(".layer")
    rows = page.page.locator(".layers .parameter:visible")
    every = rows.count()
    layers.nth(2).get_by_role("button", name="Fold Au").click()
    assert layers.nth(2).locator(".parameter:visible").count() == 0
    assert layers.nth(2).get_by_role("button", name="Unfold Au").get_attribute("aria-expanded") == "false"
    page.page.get_by_role("button", name="Fold all layers").click()
    assert rows.count() == 0

    find = page.page.get_by_label("Find a parameter")
    find.fill("rough")
    assert [row.get_attribute("title").split(":")[0] for row in rows.all()] == ["alpha", "alpha"]
    find.press("Enter")
    assert page.page.evaluate("document.activeElement.ariaLabel").startswith("Roughness")
    find.fill("thickness")  # of films, within their parameter
    assert [row.get_attribute("title").split(":")[0] for row in rows.all()] == ["films", "films"]
    find.fill("sigma_a")
    assert rows.count() == 1
    find.fill("")
    page.page.get_by_role("button", name="Unfold all layers").click()
    assert rows.count() == every

    assert layers.nth(1).get_by_text("Absorption").count() == 0
    page.page.get_by_label("Expert").check()
    assert rows.count() == every + 1
    assert layers.nth(1).get_by_text("Absorption").is_visible()
    page.page.reload()
    page.ready()
    assert page.page.get_by_label("Expert").is_checked()


def test_layers_that_cannot_stand_wait_and_a_pane_says_what_lies_below(visit: Open) -> None:
    """Expected: a metal moved up turns off what it covers, and that is back when it goes; nothing is refused."""
    page = visit(PLAIN)
    layers = page.page.locator(".layer")

    def on() -> list[bool]:
        page.settled()
        assert page.page.evaluate("velatura.problems") == []
        return [layer["enabled"] for layer in page.state("layers")]

    grip = page.page.get_by_label("Move Au: arrow keys")
    grip.press("ArrowUp")
    assert on() == [True, True, False]
    assert layers.nth(2).get_by_role("checkbox").is_disabled()
    assert layers.nth(2).get_by_role("checkbox").get_attribute("title") == "Nothing shows below an opaque layer"
    assert page.page.get_by_label("Thin pane").is_disabled()
    grip.press("ArrowDown")
    assert on() == [True, True, True]
    layers.nth(2).get_by_role("checkbox").uncheck()
    assert on() == [True, False, False]
    layers.nth(2).get_by_role("checkbox").check()
    assert on() == [True, True, True]

    page.page.get_by_role("button", name="New", exact=True).click()
    layers.nth(1).get_by_label("Kind of layer").select_option("dielectric")
    assert on() == [True, True]
    assert page.page.locator(".below").all_inner_texts() == ["below: glass 1.5", "below: air 1"]
    layers.nth(1).get_by_label("Index", exact=True).fill("1.33")
    page.page.keyboard.press("Enter")
    assert page.page.locator(".below").nth(1).inner_text() == "below: liquid 1.33, without an end"
    page.settled()
