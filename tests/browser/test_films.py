"""Thin films in the editor, in headless Chromium: as cards, in the picture, in files and links, and without a server.

Rationale: films are worked out by Python whenever they change, for every model, and only a browser shows that the
picture has them. Pictures are previews, which are the same every time.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import pytest
from editor import Server, Tabs, Visit, difference, unexpected

import velatura as vt
from velatura.stack import loads

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]
SAME = 0.5  # of 255: mean difference of pictures of one material
OTHER = 1.0  # of 255: what a change of a film makes at least
REFUSED = "the server responded with a status of 4"
AXE = Path(__file__).parents[1] / "page/node_modules/axe-core/axe.min.js"
COATED = """
name: Coated
layers:
  - interface: {eta: 1.5, alpha: 0.05, films: [{eta: 2.0, thickness_nm: 200}, {eta: 1.38, thickness_nm: 100}]}
  - interface: {conductor: Al, alpha: 0.15, films: [{eta: 2.4, k: 0.1, thickness_nm: 50}]}
"""
PANE = """
layers:
  - interface: {eta: 1.5, alpha: 0.2, films: [{eta: 2.2, thickness_nm: 150}]}
  - interface: {eta: 1, alpha: 0.1, films: [{eta: 2.2, thickness_nm: 70}]}
"""


@pytest.fixture(scope="module")
def tabs(opened: Any) -> Tabs:
    return Tabs(opened, permissions=["clipboard-read", "clipboard-write"])


@pytest.fixture
def visit(tabs: Tabs, served: Server) -> Iterator[Open]:
    """Opens a material in a browser without a past; no console may complain of more than what is expected."""
    expected: list[str] = []

    def begin(text: str = "", *expecting: str, place: str = "", **options: Any) -> Visit:
        expected.extend(expecting)
        found = tabs.visit(place or served.entrance, **options)
        if text:
            (served.folder / "films.yaml").write_text(text, encoding="utf-8")
            found.page.evaluate("velatura.openFile('films.yaml')")
            found.page.wait_for_function("() => velatura.store.get().layers.some(({ keys }) => keys.films)")
            found.settled()
        return found

    yield begin
    assert unexpected(tabs.forget(), expected) == []


def choose_model(page: Visit, title: str) -> None:
    page.page.get_by_label("Model", exact=True).select_option(title)
    page.settled()


def films(page: Visit, layer: int = 0) -> Any:
    return page.page.locator(".layer").nth(layer).locator(".film")


def thicknesses(page: Visit, layer: int = 0) -> list[float]:
    return [film["thickness_nm"] for film in page.state(f"layers.{layer}.keys").get("films", [])]


def link(page: Visit) -> str:
    """The part of an address that opens what is shown."""
    page.page.get_by_role("button", name="Share").click()
    page.page.get_by_text("The address is on the clipboard").wait_for()
    return "#" + page.page.evaluate("navigator.clipboard.readText()").partition("#")[2]


def test_films_are_added_changed_moved_removed_saved_and_reopened(visit: Open, served: Server) -> None:
    page = visit()
    bare = page.picture()
    add = page.page.get_by_role("button", name="Add a film below the others").first
    add.click()
    add.click()
    assert thicknesses(page) == [250, 250]
    filmed = page.picture()
    assert difference(filmed, bare) > OTHER

    # By slider, number and keys, each one step
    steps = len(page.page.evaluate("velatura.store.history().past"))
    films(page).nth(0).get_by_label("Film 0, thickness, slider").fill("80")
    assert thicknesses(page) == [400, 250]
    field = films(page).nth(1).get_by_label("Film 1, thickness", exact=True)
    field.fill("120")
    field.press("Enter")
    field.press("ArrowUp")
    field.press("Shift+ArrowDown")
    assert thicknesses(page) == [400, 111]
    films(page).nth(1).get_by_label("Film 1, index", exact=True).fill("1.38")
    page.page.keyboard.press("Enter")
    page.settled()
    assert steps < len(page.page.evaluate("velatura.store.history().past")) <= steps + 5
    films(page).nth(1).get_by_label("Move film 1: arrow keys").press("ArrowUp")
    assert page.state("layers.0.keys.films") == [{"eta": 1.38, "thickness_nm": 111}, {"eta": 2, "thickness_nm": 400}]
    assert page.page.evaluate("document.activeElement.ariaLabel") == "Move film 0: arrow keys"
    moved = page.picture()

    # To a file, an address, and back
    page.page.get_by_role("button", name="Save as").click()
    page.page.get_by_label("File name").fill("filmed.yaml")
    page.page.locator("dialog.save").get_by_role("button", name="Save").click()
    page.page.locator(".messages").get_by_text("Saved filmed.yaml").wait_for()
    saved = vt.load(served.folder / "filmed.yaml")
    assert saved.interfaces[0].films == (vt.Film(eta=1.38, thickness_nm=111), vt.Film(eta=2, thickness_nm=400))
    there = visit(place=served.entrance + link(page))
    there.page.get_by_text("from the address").wait_for()
    assert difference(there.picture(), moved) < SAME

    films(page).nth(0).get_by_role("button", name="Remove film 0").click()
    films(page).nth(0).get_by_role("button", name="Remove film 0").click()
    assert "films" not in page.state("layers.0.keys")
    assert difference(page.picture(), bare) < SAME
    for _ in range(2):
        page.page.get_by_role("button", name="Undo: remove a film").click()
    assert difference(page.picture(), moved) < SAME
    page.page.reload()
    page.ready()
    assert thicknesses(page) == [111, 400]
    assert difference(page.picture(), moved) < SAME


@pytest.mark.parametrize(("text", "model"), [(COATED, "belcour2018"), (PANE, "velatura")])
def test_a_film_that_is_dragged_is_that_of_the_file(text: str, model: str, visit: Open) -> None:
    """Expected: no shader is compiled, and the picture is that of the material opened anew."""
    page = visit(text)
    choose_model(page, model)
    before = page.picture()
    compiled = "velatura.viewport.device.programs.size"
    programs = page.page.evaluate(compiled)
    slider = films(page, 1).nth(0).get_by_label("Film 0, thickness, slider")
    for tick in (20, 40, 55):
        slider.fill(str(tick))
    dragged = page.picture()
    assert page.page.evaluate(compiled) == programs
    assert difference(dragged, before) > OTHER / 3
    again = visit(re.sub(r"thickness_nm: (50|70)", "thickness_nm: 275", text))
    choose_model(again, model)
    assert difference(again.picture(), dragged) < SAME


def test_the_strip_shows_what_a_thickness_would_make(visit: Open) -> None:
    """Expected: the colours of the interface relative to the brightest, as the page writes them; a click picks one."""
    page = visit(COATED)
    strip = films(page, 1).nth(0).locator(".colours")
    strip.wait_for()
    stops = re.findall(r"rgb\((\d+), (\d+), (\d+)\)", strip.evaluate("(strip) => strip.style.background"))
    assert len(stops) == 128
    stack = loads(COATED)
    seen = []
    for k in (0, 20, 64, 127):
        film = stack.interfaces[1].films[0].model_copy(update={"thickness_nm": 1000 * k / 127})
        metal = stack.interfaces[1].model_copy(update={"films": (film,), "alpha": 0.0})
        found = vt.lobes(vt.Stack([metal], exterior=1.5), 1.0, model="weier2020").energy[0]
        seen.append(np.ravel(found))
    encoded = np.array([stops[k] for k in (0, 20, 64, 127)], float) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(linear / linear.max(), np.array(seen) / np.max(seen), atol=0.02)

    strip.click(position={"x": 0.3 * strip.bounding_box()["width"], "y": 3})
    assert thicknesses(page, 1)[0] == pytest.approx(300, abs=10)  # a pixel
    page.settled()


def test_what_cannot_be_is_refused_in_words(visit: Open) -> None:
    page = visit(COATED, REFUSED)
    said = page.page.locator(".messages")
    field = films(page).nth(0).get_by_label("Film 0, thickness", exact=True)
    field.fill("6000")
    field.press("Enter")
    said.get_by_text("Film 0, thickness: must lie in 0 to 5000, got 6000").wait_for()
    field.fill("200")
    field.press("Enter")

    # Films between media of one index, on the card
    index = page.page.locator(".layer").nth(0).get_by_label("Index", exact=True)
    index.fill("1")
    index.press("Enter")
    problem = "films: between media whose indices differ by less than 0.001 only where alpha is 0"
    page.page.locator(".layer .problem").get_by_text(problem).wait_for()
    page.page.keyboard.press("Control+z")
    page.settled()
    assert page.page.locator(".problem").count() == 0

    # A mirror and a dielectric keep a film that absorbs
    kind = page.page.locator(".layer").nth(1).get_by_label("Kind of layer")
    assert films(page, 1).get_by_label("Film 0, extinction, slider").count() == 1
    kind.select_option("mirror")
    page.settled()
    assert page.state("layers.1.keys.films") == [{"eta": 2.4, "k": 0.1, "thickness_nm": 50}]
    assert films(page, 1).count() == 1
    index.fill("1.4")  # that of a new dielectric is 1.5
    index.press("Enter")
    kind.select_option("dielectric")
    page.settled()
    assert page.state("layers.1.keys.films") == [{"eta": 2.4, "k": 0.1, "thickness_nm": 50}]
    assert films(page, 1).get_by_label("Film 0, extinction, slider").count() == 1
    assert page.page.locator(".problem").count() == 0

    add = page.page.get_by_role("button", name="Add a film below the others").first
    for _ in range(6):
        add.click()
    assert len(thicknesses(page)) == 8
    assert add.is_disabled()
    page.settled()


@pytest.mark.parametrize(("width", "height", "scheme"), [(1280, 720, "light"), (480, 900, "dark")])
def test_cards_of_films_are_accessible_and_fit(width: int, height: int, scheme: str, visit: Open) -> None:
    page = visit(COATED, size=(width, height), scheme=scheme)
    page.page.locator(".film").first.scroll_into_view_if_needed()
    page.page.evaluate(AXE.read_text())
    found = page.page.evaluate("axe.run(document.querySelector('.layers')).then(({ violations }) => violations)")
    assert [each["id"] for each in found if each["impact"] in ("serious", "critical")] == []
    sticking = """[...document.querySelectorAll('.layers *')].filter((element) => {
      const card = element.closest('.layer')?.getBoundingClientRect(), box = element.getBoundingClientRect();
      return card && box.width && (box.right > card.right + 1 || box.left < card.left - 1);
    }).map(({ outerHTML }) => outerHTML.slice(0, 90))"""
    assert page.page.evaluate(sticking) == []


def test_lobes_of_a_material_with_films_are_dragged(visit: Open) -> None:
    """Expected: the lobe has the blur that was asked for, all films stay, and the panel says why there is no map."""
    page = visit(COATED)
    before = [layer["keys"]["films"] for layer in page.state("layers")]
    page.page.get_by_role("tab", name="Appearance").click()
    look = page.page.locator("section.appearance")
    look.locator(".lobe").nth(1).click()
    look.get_by_text("Lobe 2: has no map of its class, since thin films").wait_for()
    blur = look.get_by_label("Blur", exact=True)
    blur.fill("0.25")
    blur.press("Enter")
    page.settled()
    page.page.wait_for_function("() => !velatura.store.dragging")
    assert look.locator(".refused").count() == 0
    assert [layer["keys"]["films"] for layer in page.state("layers")] == before
    material = {"layers": [{layer["kind"]: layer["keys"]} for layer in page.state("layers")]}
    read = vt.lobes(vt.Stack.from_dict(material), 1.0, model=page.state("model"))
    assert read.alpha[1][0, 0] == pytest.approx(0.25, abs=1e-4)
