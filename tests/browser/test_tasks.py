"""What artists come for, from an empty page in headless Chromium, by clicks, fields and drags that are counted.

Rationale: how many acts a look takes, and whether any is answered in red, no test of a part shows.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import chromium
import pytest
from editor import Server, Tabs, Visit, unexpected

from velatura.stack import Stack

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

MOST = 8  # acts of a task, with New


@pytest.fixture
def page(tabs: Tabs, served: Server) -> Iterator[Visit]:
    """The page of a browser without a past, whose console may not complain."""
    yield tabs.visit(served.entrance, "localStorage['velatura.layout'] ??= '{}'")
    assert unexpected(tabs.forget(), []) == []


class Hands:
    """Acts on a page, counted from New on; none may be answered in red."""

    def __init__(self, page: Visit) -> None:
        self.page, self.count = page, 0
        self.layers = page.page.locator(".layer")
        self.click(page.page.get_by_role("button", name="New", exact=True))

    def click(self, control: Any, **given: Any) -> None:
        control.click(**given)
        self._done()

    def type(self, control: Any, text: str) -> None:
        control.fill(text)
        control.press("Enter")
        self._done()

    def choose(self, control: Any, option: str) -> None:
        control.select_option(option)
        self._done()

    def become(self, layer: int, kind: str) -> None:
        self.choose(self.layers.nth(layer).get_by_label("Kind of layer"), kind)

    def medium_between(self) -> None:
        """Two acts: the + between two cards, and what comes there."""
        self.click(self.page.page.get_by_label("Add a layer at place 1"))
        self.click(self.page.page.locator("[data-kind=medium]"))

    def field(self, layer: int, label: str) -> Any:
        return self.layers.nth(layer).get_by_label(label, exact=True)

    def _done(self) -> None:
        self.count += 1
        assert self.page.page.evaluate("velatura.problems") == []

    def made(self) -> Stack:
        """What is there at the end, which is drawn."""
        self.page.settled()
        assert self.page.page.evaluate("velatura.problems") == []
        assert self.count <= MOST
        layers = [{each["kind"]: each["keys"]} for each in self.page.state("layers") if each["enabled"]]
        return Stack.from_dict({"layers": layers})


def test_tinted_lacquer_on_brushed_gold(page: Visit) -> None:
    hands = Hands(page)
    hands.become(1, "metal")
    hands.choose(hands.field(1, "Metal"), "Au")
    hands.medium_between()
    hands.type(hands.field(1, "Colour twice through, hexadecimal"), "#c84020")
    hands.click(hands.layers.nth(2).get_by_role("button", name="Roughness: one for each axis"))
    hands.type(hands.field(2, "Roughness v"), "0.4")
    made = hands.made()
    assert made.kinds == ("dielectric", "medium", "conductor")
    assert made.interfaces[1].alpha == (0.1, 0.4)


def test_car_paint(page: Visit) -> None:
    """A clear coat, smooth by a double click, over a coloured medium over rough metal."""
    hands = Hands(page)
    hands.become(1, "metal")
    hands.medium_between()
    hands.type(hands.field(1, "Colour twice through, hexadecimal"), "#1030c0")
    hands.type(hands.field(2, "Roughness"), "35 %")
    hands.click(hands.layers.nth(0).get_by_text("Roughness", exact=True), click_count=2)
    made = hands.made()
    assert made.kinds == ("dielectric", "medium", "conductor")
    assert (made.interfaces[0].alpha, made.interfaces[1].alpha) == (0, 0.35)


def test_frosted_pane(page: Visit) -> None:
    hands = Hands(page)
    hands.become(1, "dielectric")
    hands.type(hands.field(0, "Roughness"), "0.3")
    hands.type(hands.field(1, "Roughness"), "0.3")
    made = hands.made()
    assert made.transmits
    assert [layer.eta for layer in made.interfaces] == [1.5, 1]


def test_oxide_film(page: Visit) -> None:
    """Anodised titanium, whose colour is picked from the strip."""
    hands = Hands(page)
    hands.become(1, "metal")
    hands.choose(hands.field(1, "Metal"), "main/Ti/Johnson")
    hands.click(hands.layers.nth(0).get_by_role("button", name="Remove"))
    hands.click(hands.layers.nth(0).get_by_role("button", name="Add a film below the others"))
    hands.type(hands.field(0, "Film 0, index"), "2.4")
    strip = page.page.locator(".colours")
    strip.wait_for()
    box = strip.bounding_box()
    hands.click(strip, position={"x": 0.2 * box["width"], "y": 4})
    (film,) = hands.made().interfaces[0].films
    assert film.eta == 2.4
    assert film.thickness_nm == pytest.approx(200, abs=20)
