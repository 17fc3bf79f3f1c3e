"""The editor as a user meets it, in headless Chromium with a server of its own.

Rationale: what people do in it runs through page, Python and files at once, and only a browser shows whether it holds.
Pictures are compared as previews, which are the same every time. Every visit fails where the console has complained;
the browser itself notes there that a server is away, or has refused, which the visits that bring it about expect.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import parted
import pytest
from editor import Server, Tabs, Visit, difference, unexpected
from fuzzing import hostile
from fuzzing.hands import Hands
from matplotlib.image import imsave

import velatura as vt
from velatura.stack import rgb

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]
SAME = 0.5  # of 255: mean difference of pictures of one material
OTHER = 1.0  # of 255: what a change of the material makes at least
REFUSED = "the server responded with a status of 4"
AWAY = "ERR_CONNECTION_REFUSED"
CUT = ("ERR_CONNECTION_RESET", "ERR_CONTENT_LENGTH_MISMATCH")  # before, and while a picture is sent
AXE = Path(__file__).parents[1] / "page/node_modules/axe-core/axe.min.js"
PREVIEWS = "[...velatura.viewport.device.programs.keys()].filter((text) => text.includes('PARTS =')).length"


@pytest.fixture
def visit(opened: Any, tabs: Tabs, served: Server) -> Iterator[Open]:
    """Opens pages in a browser without a past, and sees that no console complains; the folder is empty afterwards."""
    expected: list[str] = []
    own: list[Tabs] = []

    def begin(*expecting: str, script: str = "", size: Any = None, scheme: str = "light", **options: Any) -> Visit:
        expected.extend(expecting)
        if options:
            own.append(Tabs(opened, **options))
        return (own or [tabs])[-1].visit(served.entrance, script, size, scheme)

    yield begin
    visits = tabs.forget()
    for each in own:
        visits += each.visits
        each.context.close()
    served.clear()
    assert unexpected(visits, expected) == []


def open_preset(visit: Visit, title: str) -> None:
    visit.page.get_by_role("button", name="Open", exact=True).click()
    visit.page.get_by_role("button", name=title, exact=True).click()
    visit.settled()


def save_as(visit: Visit, name: str) -> None:
    visit.page.get_by_role("button", name="Save as").click()
    visit.page.get_by_label("File name").fill(name)
    visit.page.locator("dialog.save").get_by_role("button", name="Save").click()


def slider(visit: Visit, layer: int, label: str) -> Any:
    return visit.page.locator(".layer").nth(layer).get_by_label(f"{label}, slider", exact=True)


def drag(control: Any, ticks: Iterable[int]) -> None:
    """What the browser tells the page while a slider is held and moved, and when it is let go."""
    control.evaluate(
        """async (element, ticks) => {
          for (const tick of ticks) {
            element.value = tick;
            element.dispatchEvent(new Event('input', { bubbles: true }));
            await new Promise(requestAnimationFrame);
          }
          element.dispatchEvent(new Event('change', { bubbles: true }));
        }""",
        list(ticks),
    )


def said(visit: Visit) -> Any:
    return visit.page.locator(".messages")


# A visit -------------------------------------------------------------------------------------------------------------


def test_open_change_undo_reorder_save_and_reopen(visit: Open, served: Server) -> None:
    page = visit()
    open_preset(page, "Three dielectric layers over metal")
    first = page.picture()

    slider(page, 0, "Roughness").fill("80")
    assert page.state("layers.0.keys.alpha") == 0.4
    assert difference(page.picture(), first) > OTHER

    page.page.get_by_role("button", name="Undo: change a value").click()
    assert page.state("layers.0.keys.alpha") == 0.02
    assert difference(page.picture(), first) < SAME

    page.page.get_by_label("Move dielectric: arrow keys").first.press("ArrowDown")
    assert [layer["keys"]["eta"] for layer in page.state("layers")[:2]] == [1.6, 1.35]
    moved = page.picture()

    save_as(page, "coats.yaml")
    said(page).get_by_text("Saved coats.yaml").wait_for()
    assert vt.load(served.folder / "coats.yaml").flat()["layer0_eta"] == 1.6
    open_preset(page, "Gold")
    page.page.get_by_role("button", name="Open", exact=True).click()
    page.page.get_by_role("button", name="coats.yaml", exact=True).click()
    page.page.wait_for_function("() => velatura.store.get().layers.length === 4")
    assert difference(page.picture(), moved) < SAME


def test_layers_are_dragged_added_duplicated_turned_off_and_removed(visit: Open) -> None:
    page = visit(script="localStorage['velatura.layout'] ??= '{}'")
    open_preset(page, "Coated brushed aluminium")
    page.page.get_by_role("button", name="Interface", exact=True).click()
    page.page.get_by_role("button", name="Medium", exact=True).click()
    assert [layer["kind"] for layer in page.state("layers")] == ["interface", "interface", "medium", "interface"]

    grips = page.page.locator(".grip")
    start, end = grips.nth(2).bounding_box(), grips.nth(1).bounding_box()
    page.page.mouse.move(start["x"] + 5, start["y"] + 5)
    page.page.mouse.down()
    page.page.mouse.move(end["x"] + 5, end["y"] + 5, steps=3)
    page.page.mouse.up()
    assert [layer["kind"] for layer in page.state("layers")] == ["interface", "medium", "interface", "interface"]

    page.page.get_by_role("button", name="Duplicate dielectric").click()
    page.page.get_by_role("checkbox", name="dielectric is on").first.uncheck()
    page.page.get_by_role("button", name="Remove clear-coat").click()
    kinds = [(layer["kind"], layer["enabled"]) for layer in page.state("layers")]
    assert kinds == [("interface", False), ("interface", True), ("medium", True), ("interface", True)]
    page.settled()
    while page.page.evaluate("velatura.store.canUndo"):
        page.page.keyboard.press("Control+z")
    page.page.keyboard.press("Control+y")
    assert page.state("name") == "Coated brushed aluminium"
    page.settled()


def test_red_paint_is_built_from_nothing_without_a_message(visit: Open) -> None:
    """Expected: varnished paint over metal in eleven steps, each drawn and without a message."""
    page = visit()
    layers = page.page.locator(".layer")
    said_wrong: list[str] = []

    def step() -> None:
        page.settled()
        said_wrong.extend(each["text"] for each in page.page.evaluate("velatura.problems"))

    page.page.get_by_role("button", name="New", exact=True).click()
    step()
    layers.nth(1).get_by_label("Albedo, hexadecimal").fill("#c83220")
    page.page.keyboard.press("Enter")
    step()
    layers.nth(0).get_by_role("button", name="Remove").click()
    step()
    assert [layer["kind"] for layer in page.state("layers")] == ["diffuse"]
    assert layers.nth(0).get_by_role("button", name="Remove").is_disabled()
    for place, kind in ((0, "interface"), (1, "medium")):
        page.page.get_by_label(f"Add a layer at place {place}").click()
        page.page.locator(f"[data-kind={kind}]").click()
        step()
    layers.nth(1).get_by_label("Colour twice through, hexadecimal").fill("#ffc060")
    page.page.keyboard.press("Enter")
    step()
    layers.nth(2).get_by_label("Kind of layer").select_option("metal")
    step()
    assert [layer["kind"] for layer in page.state("layers")] == ["interface", "medium", "interface"]
    page.page.get_by_label("Add a layer at place 3").click()
    page.page.locator("[data-kind=medium]").click()  # where light does not come
    step()
    assert [layer["enabled"] for layer in page.state("layers")] == [True, True, True, False]
    assert said_wrong == []

    red, green, blue = page.state("layers.1.keys.sigma_a")
    assert red == 0
    assert np.exp([-2 * green, -2 * blue]) == pytest.approx([linear(0xC0), linear(0x60)], rel=1e-3)
    assert layers.nth(1).get_by_label("Colour twice through, hexadecimal").input_value() == "#ffc060"


def test_the_tasks_of_an_artist_take_few_steps_and_no_message(visit: Open, served: Server) -> None:
    """Expected: each within so many clicks, keys, drops and fields; the page says nothing wrong at any step."""
    page = visit(permissions=["clipboard-read", "clipboard-write"])
    layers, button = page.page.locator(".layer"), lambda name: page.page.get_by_role("button", name=name, exact=True)
    said_wrong: list[str] = []
    steps = 0

    def step(control: Any, act: str = "click", *given: Any) -> None:
        nonlocal steps
        steps += 1
        getattr(control, act)(*given)
        if act == "fill":
            control.press("Enter")
        page.page.wait_for_timeout(50)
        said_wrong.extend(each["text"] for each in page.page.evaluate("velatura.problems"))

    def done(task: str, most: int, *expected: tuple[str, Any]) -> None:
        nonlocal steps
        page.settled()
        said_wrong.extend(f"{task}: {each['text']}" for each in page.page.evaluate("velatura.problems"))
        assert steps <= most, task
        assert [page.state(path) for path, _ in expected] == [value for _, value in expected], task
        steps = 0

    def kinds() -> list[str]:
        return [layer["kind"] for layer in page.state("layers")]

    step(button("Open"))
    step(button("Gold"))
    done("a preset", 2, ("name", "Gold"))

    step(button("Interface"))
    step(button("Interface"))
    step(button("Medium"))
    step(page.page.get_by_label("Colour twice through, hexadecimal"), "fill", "#a02818")
    step(page.page.get_by_label("Metal", exact=True), "select_option", "Al")
    done("car paint of two coats", 8, ("layers.3.keys.conductor", "Al"))
    assert kinds() == ["interface", "interface", "medium", "interface"]

    step(layers.nth(0).get_by_label("Roughness", exact=True), "fill", "0.2")
    done("a roughness", 2, ("layers.0.keys.alpha", 0.2))
    step(layers.nth(3).get_by_label("Roughness: one for each axis"))
    step(layers.nth(3).get_by_label("Roughness v", exact=True), "fill", "0.4")
    done("a roughness for each axis", 2, ("layers.3.keys.alpha", [0.15, 0.4]))
    step(layers.nth(3).get_by_label("Rotation", exact=True), "fill", "45")
    done("a rotation", 2, ("layers.3.keys.rotation", 45))
    step(page.page.get_by_label("Undo: change a value"))
    done("undo", 2, ("layers.3.keys.alpha", [0.15, 0.4]))
    step(layers.nth(1).locator(".grip"), "press", "ArrowUp")
    done("another order", 2, ("layers.1.keys.alpha", 0.2))
    step(layers.nth(0).get_by_role("button", name="Duplicate"))
    done("a duplicate", 2)
    assert len(kinds()) == 5
    step(layers.nth(0).get_by_role("checkbox"), "uncheck")
    done("a layer turned off", 2, ("layers.0.enabled", False))

    step(page.page.get_by_label("Object", exact=True), "select_option", "sphere")
    step(page.page.get_by_label("Light", exact=True), "select_option", "sky")
    step(page.page.get_by_label("Exposure, in stops", exact=True), "fill", "0.5")
    done("object, light and exposure", 3, ("view.object", "sphere"), ("view.environment", "sky"))

    step(button("Save as"))
    step(page.page.get_by_label("File name"), "fill", "paint.yaml")
    done("a saved file", 3)
    assert vt.load(served.folder / "paint.yaml").kinds[-1] == "conductor"
    step(button("Share"))
    done("an address", 3)
    assert "#m=" in page.page.evaluate("navigator.clipboard.readText()")

    for mode in ("split", "difference"):
        step(page.page.get_by_label("Compare", exact=True), "select_option", mode)
        step(page.page.get_by_label("With", exact=True), "select_option", "belcour2018")
        done(mode, 3, ("view.mode", mode))
    page.page.get_by_label("Compare", exact=True).select_option("single")

    step(button("Open"))
    step(button("paint.yaml"))
    done("the file again", 3, ("name", "Gold"))
    step(button("Open"))
    step(button("Gold"))
    step(layers.nth(0).get_by_label("Kind of layer"), "select_option", "dielectric")
    step(layers.nth(0).get_by_label("Roughness", exact=True), "fill", "0.3")
    step(page.page.get_by_label("Add a layer at place 1"))
    step(page.page.locator("[data-kind=interface]"))
    done("frosted glass", 8, ("layers.0.keys.alpha", 0.3), ("layers.1.keys.eta", 1))

    spots = io.BytesIO()
    imsave(spots, np.random.default_rng(3).random((8, 8, 3)), format="png")
    drop(page, "[aria-label='Roughness, slider']", "spots.png", spots.getvalue())
    page.page.wait_for_function("() => velatura.store.get().layers[0].keys.alpha.texture")
    done("a texture", 1, ("layers.0.keys.alpha", {"texture": "spots.png"}))
    assert said_wrong == []


def test_a_colour_dragged_by_hue_returns_to_where_it_began(visit: Open) -> None:
    """Expected: through black and grey, which have no hue, in 100 events and back."""
    page = visit()
    page.page.get_by_role("button", name="New", exact=True).click()
    base = page.page.locator(".layer").nth(1)
    base.get_by_label("Albedo, hexadecimal").fill("#c86428")
    page.page.keyboard.press("Enter")
    base.get_by_label("Albedo by").select_option("hsv")
    page.settled()
    for name in ("value", "saturation", "hue"):
        control = base.get_by_label(f"Albedo, {name}, slider")
        start = int(control.input_value())
        drag(control, [*(start - start * n // 50 for n in range(51)), *(start * n // 50 for n in range(51))])
        page.settled()
    np.testing.assert_allclose(page.state("layers.1.keys.albedo"), [linear(b) for b in (200, 100, 40)], atol=0.01)


def test_a_material_is_found_by_its_picture_or_its_name(visit: Open) -> None:
    page = visit()
    page.page.get_by_role("button", name="Open", exact=True).click()
    pictures = page.page.locator("dialog.open img")
    assert pictures.count() == len(vt.presets())
    page.page.wait_for_function("() => document.querySelector('dialog.open img').naturalWidth === 160")
    page.page.get_by_label("Search").fill("enamel")
    assert pictures.count() == 1
    page.page.locator("dialog.open li button").click()
    assert page.page.title() == f"{vt.preset('red-enamel').name} - Velatura"
    page.settled()


def test_a_stack_is_mixed_with_another_and_is_itself_again(visit: Open, served: Server) -> None:
    """Rationale: parts, shares and masks are worked with by hand, and the picture follows values without new code.
    Expected: with a share of 1 the picture of that part; the file holds what was made; nothing is left of a part that
    was removed."""
    page = visit()
    gold = page.picture()
    page.page.get_by_role("button", name="Mix with …").click()
    dialog = page.page.get_by_role("dialog", name="Mix with a material")
    dialog.get_by_label("Search").fill("enamel")
    dialog.locator("li button").click()
    page.settled()
    assert page.page.get_by_label("Name of part 0").input_value() == vt.preset("red-enamel").name
    assert page.page.locator(".layer").count() == len(vt.preset("red-enamel").layers)
    key = page.page.evaluate("velatura.shader().key")
    half = page.picture()
    assert difference(half, gold) > OTHER
    share = page.page.locator("li.part").first.get_by_label("share, slider")
    drag(share, range(100, 201, 20))
    enamel = page.picture()
    assert page.state("parts.0.weight") == 1 and difference(enamel, half) > OTHER
    page.page.get_by_role("button", name=f"Remove {vt.preset('coated-gold').name}").click()
    assert difference(page.picture(), enamel) < SAME and page.page.locator("li.part").count() == 0
    for _ in range(2):
        page.page.get_by_role("button", name="Undo").click()
    assert difference(page.picture(), half) < SAME

    # The layers of the other part, and a share that is typed
    page.page.locator("li.part").get_by_title("Show its layers").click()
    assert page.page.locator(".layer").count() == len(vt.preset("coated-gold").layers)
    drag(slider(page, 2, "Roughness u"), range(60, 121, 20))
    assert difference(page.picture(), half) > OTHER / 2
    field = page.page.locator("li.part").first.get_by_label("Red enamel, share", exact=True)
    field.fill("1.2")
    field.press("Enter")
    assert "Red enamel, share: must lie in 0 to 1, got 1.2" in said(page).inner_text()
    field.fill("0.25")
    field.press("Enter")
    page.settled()
    assert page.page.evaluate("velatura.shader().key") == key  # nothing was compiled for it

    # A mask, in the file as well
    pixels = np.tile(np.array([[0.0, 1.0]]), (2, 1))
    content = io.BytesIO()
    imsave(content, pixels, format="png", cmap="gray")
    numbered = page.picture()
    drop(page, "[data-part] > .parameter", "mask.png", content.getvalue())
    page.page.wait_for_function("() => velatura.store.get().parts[0].weight.texture")
    assert difference(page.picture(), numbered) > OTHER
    save_as(page, "mixed.yaml")
    page.page.wait_for_function("() => document.querySelector('.document').textContent.includes('mixed.yaml')")
    saved = vt.load(served.folder / "mixed.yaml")
    assert [stack.name for _, stack in saved.leaves()] == [
        vt.preset(name).name for name in ("red-enamel", "coated-gold")
    ]
    assert "texture: mask.png" in (served.folder / "mixed.yaml").read_text()

    # What is plotted and designed is the chosen part; a part that goes leaves a stack
    assert "plots are of the chosen part" in page.page.locator(".inspector").inner_text()
    page.page.get_by_role("button", name="Remove Red enamel").click()
    page.settled()
    assert page.page.locator("li.part").count() == 0 and page.state("name") == vt.preset("coated-gold").name
    for _ in range(5):
        page.page.get_by_role("button", name="Undo").click()
    assert difference(page.picture(), gold) < SAME


def test_a_paint_is_mixed_from_pigments(visit: Open, served: Server) -> None:
    """Expected: the first pigment is the medium as it was; colours and concentrations move the picture by values."""
    page = visit()
    open_preset(page, vt.preset("red-enamel").name)
    enamel, key = page.picture(), page.page.evaluate("velatura.shader().key")
    page.page.get_by_label("Describe absorption and scattering by pigments").click()
    assert difference(page.picture(), enamel) < SAME
    page.page.get_by_label("Add a pigment", exact=True).click()
    page.settled()
    page.page.get_by_label("Name of pigment 1").fill("green")
    page.page.get_by_label("Name of pigment 1").press("Tab")
    field = page.page.get_by_label("green, colour, hexadecimal")
    field.fill("#209040")
    field.press("Tab")
    green = page.page.locator("[data-pigment='1']")
    drag(green.get_by_label("green, concentration, slider"), range(20, 201, 20))
    page.settled()
    assert difference(page.picture(), enamel) > OTHER
    typed = green.get_by_label("green, concentration", exact=True)
    typed.fill("-2")
    typed.press("Enter")
    assert "green, concentration: must lie in 0 to 1000000000, got -2" in said(page).inner_text()
    typed.fill("3")
    typed.press("Enter")
    page.settled()
    assert page.page.evaluate("velatura.shader().key") == key
    save_as(page, "paint.yaml")
    page.page.wait_for_function("() => document.querySelector('.document').textContent.includes('paint.yaml')")
    medium = next(layer for layer in vt.load(served.folder / "paint.yaml").layers if isinstance(layer, vt.Medium))
    assert [(each.name, each.concentration) for each in medium.pigments] == [("", 1.0), ("green", 3.0)]
    page.page.get_by_label("Remove green").click()
    page.page.get_by_label("Remove pigment 0").click()
    assert difference(page.picture(), enamel) < SAME
    assert page.page.get_by_label("Absorption, red", exact=True).count() == 1


def test_metals_are_found_by_their_names(visit: Open) -> None:
    """Expected: in groups by what they are, each once, in the order of the alphabet."""
    page = visit()
    open_preset(page, "Gold")
    menu = page.page.get_by_label("Metal", exact=True)
    groups = menu.evaluate(
        "(menu) => [...menu.children].map(({ label, children }) => [label, [...children].map((o) => o.text)])"
    )
    assert [name for name, _ in groups] == [
        "Noble metals",
        "Industrial metals",
        "Ceramics and oxides",
        "Other conductors",
        "refractiveindex.info",
    ]
    titles = [title for _, group in groups for title in group]
    assert len(set(titles)) == len(titles) > 70
    assert not any("Palik" in title for title in titles)
    assert all(group == sorted(group) for _, group in groups)
    menu.focus()
    page.page.keyboard.type("silv")
    page.settled()
    assert page.state("layers.0.keys.conductor") == "Ag"


def test_substances_of_refractiveindex_info_are_metals_and_dielectrics(visit: Open) -> None:
    """Expected: a page that is chosen is drawn, stands in the menu, and its numbers are those of the page."""
    page = visit()
    open_preset(page, "Gold")
    metal = page.page.get_by_label("Metal", exact=True)
    metal.select_option("main/Ti/Johnson")
    page.settled()
    titanium = {"refractiveindex": "main/Ti/Johnson"}
    assert (page.state("layers.0.keys.eta"), page.state("layers.0.keys.k")) == (titanium, titanium)
    assert metal.input_value() == "main/Ti/Johnson"
    kind = page.page.get_by_label("Kind of layer", exact=True).first
    kind.select_option("custom")
    page.settled()
    assert page.state("layers.0.keys.eta") == pytest.approx(rgb(vt.Substance(**titanium)), rel=1e-3)
    kind.select_option("dielectric")
    page.page.get_by_label("Index, by name", exact=True).select_option("popular_glass/SF11/SCHOTT")
    page.settled()
    assert page.state("layers.0.keys.eta") == {"refractiveindex": "popular_glass/SF11/SCHOTT"}


def test_reloading_loses_nothing(visit: Open) -> None:
    page = visit()
    open_preset(page, "Wet copper")
    slider(page, 1, "Roughness").fill("100")
    page.page.locator("canvas").first.press("ArrowLeft")
    page.settled()
    state, picture = page.state(), page.picture()
    page.page.reload()
    page.ready()
    assert page.state() == state
    assert difference(page.picture(), picture) < SAME
    page.page.keyboard.press("Control+z")
    assert page.state("layers.1.keys.alpha") == 0.25


def test_a_server_that_goes_away_and_comes_back(visit: Open, served: Server) -> None:
    page = visit(AWAY, *CUT)
    page.page.evaluate("velatura.store.run((state) => ({ ...state, model: 'belcour2018' }))")  # which is not solved
    open_preset(page, "Wet copper")
    served.kill()
    page.page.get_by_text("Offline, trying again").wait_for()

    # Values go on
    before = page.picture()
    slider(page, 1, "Roughness").fill("10")
    page.settled()
    assert difference(page.picture(), before) > OTHER

    # What needs the server is said, and done when it is back
    page.page.get_by_role("button", name="Interface", exact=True).click()
    said(page).get_by_text("The server is away").wait_for()
    page.page.get_by_role("button", name="Open", exact=True).click()
    said(page).get_by_text("The server does not answer.").wait_for()
    page.page.get_by_role("button", name="Cancel").first.click()
    served.start()
    page.page.get_by_text("Offline, trying again").wait_for(state="detached")
    page.settled()
    assert page.page.evaluate("velatura.problems.map(({ about, text }) => `${about}: ${text}`)") == []
    assert len(page.page.evaluate("velatura.shader().parts[0].lobes")) == 3


def test_dragging_never_compiles(visit: Open) -> None:
    page = visit()
    open_preset(page, "Coated brushed gold")
    page.page.evaluate(
        """() => {
          const { viewport } = window.velatura;
          window.compiled = 0;
          viewport.prepare = async () => {}; // looking ahead compiles what may come, at any time
          const { setMaterial } = viewport;
          viewport.setMaterial = (...given) => (window.compiled++, setMaterial.apply(viewport, given));
          const { gl } = viewport.device;
          const { linkProgram } = gl;
          gl.linkProgram = (program) => (window.compiled++, linkProgram.call(gl, program));
        }"""
    )
    for layer, label in [(0, "Roughness"), (0, "Index"), (1, "Depth"), (1, "Absorption, red"), (2, "Roughness u")]:
        drag(slider(page, layer, label), range(10, 200, 60))
    page.settled()
    page.settled()
    assert page.page.evaluate("window.compiled") == 0
    assert page.page.evaluate("velatura.store.history().past.length") == 6  # the preset and five drags

    page.page.get_by_role("button", name="Interface", exact=True).click()
    page.settled()
    assert page.page.evaluate("window.compiled") > 0


def test_one_more_layer_is_compiled_before_it_is_asked_for(visit: Open) -> None:
    """Expected: a while after a change, the programs for an interface on top, or for a medium, are there."""
    page = visit()
    open_preset(page, "Wet copper")
    page.page.evaluate("velatura.viewport.setSize(64, 48); velatura.viewport.setBudget({ samples: 16 })")
    page.page.wait_for_function("() => velatura.viewport.coming?.shader?.parts[0].base")  # the last
    page.page.evaluate("velatura.viewport.setBudget({ samples: 0 })")  # look no further
    page.settled()
    known = page.page.evaluate(PREVIEWS)
    page.page.get_by_role("button", name="Interface", exact=True).click()
    page.settled()
    assert len(page.page.evaluate("velatura.shader().parts[0].lobes")) == 3
    page.page.keyboard.press("Control+z")
    page.page.get_by_role("button", name="Medium", exact=True).click()
    page.settled()
    assert page.page.evaluate(PREVIEWS) == known


def test_the_page_goes_on_while_thirty_interfaces_are_compiled(visit: Open) -> None:
    """Expected: a word for what the picture waits for, and no pause of the page as long as half of the compiling."""
    page = visit(size=(480, 400))
    page.page.evaluate(
        """() => {
          const watched = (window.watched = {}), place = document.querySelector('.samples');
          let last = performance.now();
          setInterval(() => {
            const now = performance.now(), found = (watched[place.textContent] ??= { whole: 0, pause: 0 });
            found.whole += now - last;
            found.pause = Math.max(found.pause, now - last);
            last = now;
          }, 20);
        }"""
    )
    for _ in range(28):
        page.page.get_by_role("button", name="Interface", exact=True).click()
    page.settled()
    assert len(page.page.evaluate("velatura.shader().parts[0].lobes")) == 30
    watched = page.page.evaluate("watched")
    compiling = watched["compiling the shader \u2026"]
    assert max(each["pause"] for each in watched.values()) < compiling["whole"] / 2
    assert watched["solving the layers \u2026"]["whole"] > 0


def test_a_material_is_not_stained_by_the_one_before(visit: Open) -> None:
    """Expected: after paths have told where gold shadows itself, another material is previewed as in a new tab, of the
    same kinds of layers or of others; what is kept for other values of one material has no hue."""
    page = visit()
    for title in ("Wet copper", "Coated rough metal"):
        open_preset(page, "Coated brushed gold")
        page.page.evaluate("velatura.viewport.setSize(64, 48); velatura.viewport.setBudget({ samples: 20 })")
        page.page.wait_for_function("() => velatura.viewport.samples >= 20")
        page.page.evaluate("velatura.viewport.setBudget({ samples: 0 })")
        if title == "Wet copper":
            slider(page, 0, "Roughness").fill("20")
            page.settled()
            shade = "Array.from(velatura.viewport.device.read(velatura.viewport.slots.a.shades[0]))"
            red, green, blue = np.reshape(page.page.evaluate(shade), (-1, 4))[:, :3].T
            assert float(np.ptp(red)) > 0.1
            assert np.array_equal(red, green)
            assert np.array_equal(red, blue)
        open_preset(page, title)
        fresh = visit()
        fresh.page.evaluate("velatura.viewport.setSize(64, 48)")
        assert fresh.state("name") == title
        assert difference(page.picture(), fresh.picture()) < SAME
        fresh.page.close()


# Under the hand ------------------------------------------------------------------------------------------------------

SLOW = """(() => {
  const { fetch } = window;
  window.fetch = async (...asked) => {
    await new Promise((resolve) => setTimeout(resolve, 120));
    return fetch(...asked);
  };
})()"""


def test_names_that_arrive_late_move_none_under_the_hand(visit: Open) -> None:
    page = visit(script=SLOW.replace("120", "500"))
    page.page.get_by_role("button", name="Open", exact=True).click()
    dialog = page.page.locator("dialog.open")
    entry = dialog.get_by_role("button", name="Coated brushed aluminium", exact=True)
    assert dialog.get_by_text("On their way.").is_visible()
    before = entry.bounding_box()
    dialog.get_by_text("On their way.").wait_for(state="detached")
    assert dialog.get_by_role("button").count() > 40
    assert entry.bounding_box() == before
    entry.click()
    assert page.state("name") == "Coated brushed aluminium"
    page.settled()


def test_none_of_150_typed_numbers_is_lost_though_the_server_is_slow(visit: Open) -> None:
    """Expected: each, typed letter by letter into one field after another, is shown and taken, the last ones drawn."""
    page = visit(script=SLOW)
    open_preset(page, "Paint under old varnish")
    lost = page.page.evaluate(
        """async (count) => {
          const frame = () => new Promise(requestAnimationFrame), lost = [];
          const fieldOf = (name) => document.querySelector(`[aria-label="Albedo, ${name}"]`);
          const fields = ['red', 'green', 'blue'].map(fieldOf);
          for (let k = 0; k < count; k++) {
            const field = fields[k % 3], number = (0.1 + (k * 0.6180339) % 0.8).toFixed(4);
            field.focus();
            field.value = '';
            for (const letter of number) {
              field.value += letter;
              field.dispatchEvent(new InputEvent('input', { bubbles: true, data: letter }));
              if (letter === '.') await frame();
            }
            if (field.value !== number) lost.push(`${number} became ${field.value}`);
            field.dispatchEvent(new Event('change', { bubbles: true }));
            const taken = velatura.store.get().layers.at(-1).keys.albedo[k % 3];
            if (taken !== Number(number)) lost.push(`${number} was taken for ${taken}`);
          }
          return lost;
        }""",
        150,
    )
    assert lost == []
    typed = [float(f"{0.1 + k * 0.6180339 % 0.8:.4f}") for k in (147, 148, 149)]
    assert page.state("layers").pop()["keys"]["albedo"] == typed
    drawn = page.picture()
    page.page.reload()
    page.ready()
    assert difference(page.picture(), drawn) < SAME


PICK = """async (swatch) => {
  const start = swatch.value, channels = [1, 3, 5].map((at) => parseInt(start.slice(at, at + 2), 16));
  const byte = (x) => Math.round(Math.max(0, Math.min(255, x))).toString(16).padStart(2, '0');
  for (let k = 1; k <= 100; k++) {
    const away = 60 * Math.sin((k / 100) * Math.PI), by = [-away, away, -2 * away];
    swatch.value = k === 100 ? start : `#${channels.map((c, i) => byte(c + by[i])).join('')}`;
    swatch.dispatchEvent(new Event('input', { bubbles: true }));
    await new Promise(requestAnimationFrame);
  }
  swatch.dispatchEvent(new Event('change', { bubbles: true }));
}"""


def test_a_picked_colour_returns_to_where_it_began_though_the_server_is_slow(visit: Open) -> None:
    """Expected: after 100 colours of the browser's picker, the last of which is the first, all is as before; each drag
    is one step."""
    page = visit(script=SLOW)
    open_preset(page, "Coated brushed gold")
    picture = page.picture()
    steps = len(page.page.evaluate("velatura.store.history().past"))
    for label in ("Absorption", "Colour twice through"):
        page.page.locator(".layer").nth(1).get_by_label(f"{label}, swatch").evaluate(PICK)
        assert page.state("layers.1.keys.sigma_a") == [0.1, 0.5, 2]
        page.settled()
    assert len(page.page.evaluate("velatura.store.history().past")) == steps + 2
    assert difference(page.picture(), picture) < SAME


@pytest.mark.parametrize("pause", [0, 110])
def test_what_is_typed_is_taken_once_though_the_server_is_slow(visit: Open, pause: int) -> None:
    """Expected: the answer to one number comes while the next is typed, and neither is lost."""
    page = visit(script=SLOW)
    open_preset(page, "Paint under old varnish")
    card = page.page.locator(".layer").last
    before = len(page.page.evaluate("velatura.store.history().past"))
    page.page.wait_for_timeout(300)
    card.get_by_label("Albedo, red", exact=True).select_text()
    for number in ("0.06502", "0.5035", "0,7141"):
        page.page.keyboard.type(number, delay=pause)
        field = page.page.evaluate("document.activeElement.value")
        assert field == number
        page.page.keyboard.press("Tab")
        page.page.keyboard.press("Tab")
    assert page.state("layers.2.keys.albedo") == [0.06502, 0.5035, 0.7141]
    assert card.get_by_label("Albedo, blue", exact=True).input_value() == "0.7141"
    assert len(page.page.evaluate("velatura.store.history().past")) == before + 3
    page.settled()


def test_a_field_follows_again_once_it_is_left(visit: Open) -> None:
    page = visit()
    open_preset(page, "Gold")
    field = page.page.locator(".layer").first.get_by_label("Roughness", exact=True)
    field.fill("7")
    field.press("Enter")
    said(page).get_by_text("Roughness: must lie in 0 to 1, got 7").wait_for()
    assert field.input_value() == "7"  # to be mended
    field.press("Tab")
    assert field.input_value() == "0.15"
    assert field.evaluate("(field) => field.validity.valid")

    # What is typed and taken back leaves nothing behind; arrow keys go on from what is typed
    field.focus()
    field.press("End")
    field.type("5")
    field.press("Backspace")
    field.press("Tab")
    slider(page, 0, "Roughness").fill("80")
    assert field.input_value() == "0.4"
    field.fill("0.6")
    field.press("ArrowUp")
    assert field.input_value() == "0.61"
    assert page.state("layers.0.keys.alpha") == 0.61
    page.settled()


def test_a_drag_of_the_colour_picker_keeps_the_largest_channel(visit: Open) -> None:
    """Expected: 30 colours of any brightness, as the browser's picker reports them, change the hue alone."""
    page = visit()
    open_preset(page, "Coated brushed gold")
    swatch = page.page.locator(".layer").nth(1).get_by_label("Absorption, swatch")

    def pick(*colours: str) -> None:
        swatch.evaluate(
            """async (swatch, colours) => {
              for (const colour of colours) {
                swatch.value = colour;
                swatch.dispatchEvent(new Event('input', { bubbles: true }));
                if (swatch.value !== colour) throw new Error(`the picker was moved to ${swatch.value}`);
                await new Promise(requestAnimationFrame);
              }
              swatch.dispatchEvent(new Event('change', { bubbles: true }));
            }""",
            colours,
        )

    steps = len(page.page.evaluate("velatura.store.history().past"))
    assert page.state("layers.1.keys.sigma_a") == [0.1, 0.5, 2]
    pick(swatch.input_value())
    assert page.state("layers.1.keys.sigma_a") == [0.1, 0.5, 2]

    pick(*(f"#{120 - n:02x}{90 - 2 * n:02x}{60 - n:02x}" for n in range(30)))
    red, green, blue = page.state("layers.1.keys.sigma_a")
    assert red == 2
    assert (green, blue) == pytest.approx([2 * linear(32) / linear(91), 2 * linear(31) / linear(91)], rel=1e-3)
    assert len(page.page.evaluate("velatura.store.history().past")) == steps + 1
    picked = page.state("layers.1.keys.sigma_a")
    pick(swatch.input_value())
    assert page.state("layers.1.keys.sigma_a") == picked

    # Numbers however small are read whole
    pick("#ff0100")
    page.page.locator(".layer").nth(1).get_by_label("Absorption, blue", exact=True).fill("1.2345678e-10")
    page.page.keyboard.press("Enter")
    cut = page.page.evaluate(
        "[...document.querySelectorAll('.layer input.number')].filter((field) => field.scrollWidth > field.clientWidth)"
        ".map((field) => `${field.ariaLabel}: ${field.value}`)"
    )
    assert cut == []
    assert page.state("layers.1.keys.sigma_a.2") == 1.2345678e-10
    page.settled()


def linear(byte: int) -> float:
    """A channel of a colour on a page, linear (sRGB)."""
    return float(((byte / 255 + 0.055) / 1.055) ** 2.4)


# Errors --------------------------------------------------------------------------------------------------------------


def test_a_stack_that_cannot_be_is_refused_in_words_and_undone(visit: Open) -> None:
    """Rationale: hands are kept from such stacks; a stored state of an older page is not."""
    page = visit(REFUSED)
    open_preset(page, "Coated brushed gold")
    before = page.picture()
    put(page, "layers: [layers[0], layers[2], layers[1]]")
    problem = "nothing may lie below layer 1 (conductor), which is opaque"
    page.page.locator(".layer .problem").get_by_text(problem).wait_for()
    assert problem in said(page).inner_text()
    assert page.page.get_by_label("Layer 1: Au").locator(".place").inner_text() == "1"
    assert difference(page.picture(), before) < SAME
    page.page.keyboard.press("Control+z")
    page.settled()
    assert page.page.locator(".problem").count() == 0
    assert difference(page.picture(), before) < SAME


def put(visit: Visit, changes: str) -> None:
    """Change the state, regardless of what hands may do."""
    visit.page.evaluate(f"velatura.store.run(({{ layers, ...state }}) => ({{ ...state, layers, {changes} }}))")


def test_a_number_out_of_range_is_refused_in_words(visit: Open) -> None:
    page = visit()
    open_preset(page, "Gold")
    field = page.page.locator(".layer").first.get_by_label("Roughness", exact=True)
    for text, why in [("1.5", "must lie in 0 to 1, got 1.5"), ("rough", "must be a number, got rough")]:
        field.fill(text)
        field.press("Enter")
        said(page).get_by_text(f"Roughness: {why}").wait_for()
    assert page.state("layers.0.keys.alpha") == 0.15
    field.fill("0.3")
    field.press("Enter")
    assert page.state("layers.0.keys.alpha") == 0.3
    assert said(page).inner_text() == ""


def drop(page: Visit, selector: str, name: str, content: str | bytes) -> None:
    data = content.encode() if isinstance(content, str) else content
    page.page.evaluate(
        """([selector, name, bytes]) => {
          const dataTransfer = new DataTransfer();
          dataTransfer.items.add(new File([Uint8Array.from(bytes)], name));
          const event = new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true });
          document.querySelector(selector).dispatchEvent(event);
        }""",
        [selector, name, list(data)],
    )


def test_broken_files_are_refused_in_words(visit: Open, served: Server) -> None:
    page = visit(REFUSED)
    before = page.state("layers")
    drop(page, "canvas", "broken.yaml", "layers: [")
    said(page).get_by_text("broken.yaml: line 1: is not valid YAML").wait_for()
    drop(page, "canvas", "light.hdr", "no picture")
    said(page).get_by_text("light.hdr: not a readable picture").wait_for()
    drop(page, "canvas", "letter.txt", "Dear")
    said(page).get_by_text("letter.txt: drop a material").wait_for()
    drop(page, ".parameter .control", "scratches.png", "no picture")
    said(page).get_by_text("scratches.png: is no picture that can be read").wait_for()
    assert page.state("layers") == before

    # At most three are there, clear of the picture's edges, and they go with the next change
    problems = said(page).locator(".problem")
    assert problems.count() == 3
    assert "broken.yaml" not in said(page).inner_text()
    picture, note = page.page.locator("canvas").first.bounding_box(), problems.last.bounding_box()
    assert note["x"] > picture["x"]
    assert note["y"] + note["height"] < picture["y"] + picture["height"]
    slider(page, 0, "Roughness").fill("40")
    assert problems.count() == 0
    assert not list(served.folder.glob("*.png"))


def test_files_out_of_the_folder_are_refused_in_words(visit: Open, served: Server) -> None:
    page = visit(REFUSED)
    save_as(page, "../stolen.yaml")
    said(page).get_by_text("must be the plain name of a file").wait_for()
    assert not (served.folder.parent / "stolen.yaml").exists()


def test_files_of_hostile_names_run_nothing(visit: Open, served: Server) -> None:
    """Expected: those whose names can be printed are listed and opened, with their names as they are."""
    files = {f"{name[:200].replace('/', '_')}.yaml": name for name in hostile.NAMES} | {"plain.yaml": "Plain"}
    for file, name in files.items():
        (served.folder / file).write_text(json.dumps(hostile.material(name)), "utf-8")
    page = visit(script=hostile.WATCH)
    for file, name in files.items():
        page.page.get_by_role("button", name="Open", exact=True).click()
        page.page.get_by_role("button", name="plain.yaml", exact=True).wait_for()
        listed = page.page.locator("dialog.open").get_by_role("button", name=file, exact=True)
        assert listed.count() == (1 if file.isprintable() and "\\" not in file else 0)
        (listed if listed.count() else page.page.get_by_role("button", name="Cancel").first).click()
        if file.isprintable() and "\\" not in file:
            page.page.wait_for_function("(name) => velatura.store.get().name === name", arg=name)
    page.settled()


def test_random_edits_by_hand(visit: Open, served: Server) -> None:
    """A slice of those of `benchmarks/fuzz_server.py`."""
    page = visit(REFUSED)
    page.page.evaluate("velatura.viewport.setSize(64, 48)")
    hands = Hands(page, served.folder, seed=2)
    hands.edit(12)
    hands.look()
    hands.reload()
    assert hands.outcome.failures == []


def test_two_tabs_have_a_state_each_and_do_not_overwrite_one_another(visit: Open, served: Server) -> None:
    one = visit(REFUSED)
    open_preset(one, "Gold")
    save_as(one, "gold.yaml")
    said(one).get_by_text("Saved gold.yaml").wait_for()
    two = visit()
    assert two.state("name") == "Gold"  # the last one
    slider(two, 0, "Roughness").fill("60")
    assert one.state("layers.0.keys.alpha") == 0.15
    two.page.keyboard.press("Control+s")
    said(two).get_by_text("Saved gold.yaml").wait_for()

    slider(one, 0, "Roughness").fill("20")
    one.page.keyboard.press("Control+s")
    said(one).get_by_text("has changed since it was opened").wait_for()
    assert vt.load(served.folder / "gold.yaml").flat()["layer0_alpha_u"] == 0.3
    one.page.get_by_role("button", name="Overwrite it").click()
    said(one).get_by_text("Saved gold.yaml").wait_for()
    assert vt.load(served.folder / "gold.yaml").flat()["layer0_alpha_u"] == 0.1


# The view ------------------------------------------------------------------------------------------------------------


def test_light_from_a_file_fills_the_picture(visit: Open) -> None:
    """Expected: in even green light all is green, by half of the exposure darker, and after a reload as before."""
    page = visit()
    green = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + bytes([0, 128, 0, 128]) * 8
    drop(page, "canvas", "green.hdr", green)
    page.page.wait_for_function("() => velatura.viewport.sources.environment.width === 4")
    lit = page.picture()
    assert page.page.get_by_label("Light", exact=True).input_value() == "file:green.hdr"
    assert lit[..., 1].min() > 20
    assert lit[..., [0, 2]].max() < 2
    page.page.get_by_label("Exposure, in stops", exact=True).fill("-1")
    page.page.get_by_label("Exposure, in stops", exact=True).press("Enter")
    darker = page.picture()
    assert np.all(darker[..., 1] < lit[..., 1])
    page.page.reload()
    page.ready()
    assert difference(page.picture(), darker) < SAME


def test_fingers_turn_the_object_and_bring_it_closer(visit: Open) -> None:
    page = visit(has_touch=True)
    touch = page.page.context.new_cdp_session(page.page)
    box = page.page.locator("canvas").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def put(kind: str, *points: tuple[float, float]) -> None:
        where = [{"x": x + dx, "y": y + dy, "id": k} for k, (dx, dy) in enumerate(points)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": where})

    def camera() -> tuple[np.ndarray, float]:
        eye = np.subtract(*(np.array(page.page.evaluate(f"velatura.viewport.camera.{key}")) for key in KEYS))
        return eye, float(np.linalg.norm(eye))

    start, far = camera()
    put("touchStart", (0, 0))
    put("touchMove", (60, 0))
    put("touchEnd")
    turned, away = camera()
    assert away == pytest.approx(far)
    assert abs(np.arctan2(turned[0], turned[2]) - np.arctan2(start[0], start[2])) > 0.2
    assert turned[1] == pytest.approx(start[1])

    put("touchStart", (-40, 0), (40, 0))
    put("touchMove", (-80, 0), (80, 0))
    put("touchEnd")
    assert camera()[1] == pytest.approx(far / 2, rel=0.1)
    page.settled()


KEYS = ("origin", "target")


def test_two_models_differ_where_they_do(visit: Open) -> None:
    """Expected: the difference of a model from itself is one flat grey, that from another is not; a split screen has
    either model on its side of the line, which is dragged."""
    page = visit()
    open_preset(page, "Three dielectric layers over metal")
    alone = page.picture()
    page.page.get_by_label("Compare", exact=True).select_option("difference")
    page.page.get_by_label("With", exact=True).select_option("velatura")
    assert np.ptp(page.picture()) < 2
    scale = page.page.locator(".scale")
    scale.get_by_text("mean 0.0000").wait_for()
    page.page.get_by_label("With", exact=True).select_option("belcour2018")
    assert np.ptp(page.picture()) > 10
    page.page.wait_for_function("() => Number(document.querySelector('.measure').textContent.slice(5)) > 1e-3")
    assert re.match(r"Belcour 2018 darker .* brighter than Velatura", " ".join(scale.inner_text().split()))

    page.page.get_by_label("Compare", exact=True).select_option("split")
    line = page.page.get_by_role("slider", name="Where the picture is split")
    halves = page.picture()
    assert difference(halves[:, :30], alone[:, :30]) < SAME
    assert difference(halves[:, 34:], alone[:, 34:]) > SAME
    at, picture = line.bounding_box(), page.page.locator("canvas").first.bounding_box()
    page.page.mouse.move(at["x"] + at["width"] / 2, at["y"] + 50)
    page.page.mouse.down()
    page.page.mouse.move(picture["x"] + picture["width"] - 2, at["y"] + 50, steps=3)
    page.page.mouse.up()
    assert page.state("view.split") > 0.95
    assert difference(page.picture()[:, :58], alone[:, :58]) < SAME


def test_what_is_exported_is_seen_before_it_is_taken(visit: Open, tmp_path: Path) -> None:
    page = visit()
    open_preset(page, "Gold")
    page.page.get_by_role("button", name="Export", exact=True).click()
    written = page.page.get_by_label("What is written")
    formats = page.page.get_by_label("Format", exact=True)
    assert formats.locator("optgroup").evaluate_all("all => all.map(({ label }) => label)") == [
        "Programs",
        "One page",
        "Parameters",
        "Shader code",
    ]
    untitled = "all => all.filter(({ value, textContent }) => value === textContent || !value).length"
    assert formats.locator("option").evaluate_all(untitled) == 0
    formats.select_option("python")
    page.page.wait_for_function("() => document.querySelector('dialog.export textarea')?.value.includes('import')")
    with page.page.expect_download() as download:
        page.page.get_by_role("button", name="Download .py").click()
    assert download.value.suggested_filename == "gold.py"
    assert Path(download.value.path()).read_text() == written.input_value()
    page.page.get_by_label("Format", exact=True).select_option("glsl")
    page.page.get_by_role("button", name="Download .tables.bin").wait_for()
    costs = page.page.get_by_role("table", name="What a call costs")
    assert "texels read" in costs.get_by_role("row", name="vt_lobes").inner_text()
    assert "vt_eval_pdf" in written.input_value()


def test_a_material_is_pinned_and_swapped(visit: Open) -> None:
    """Expected: what it becomes beside what it was, and the other way round once they are swapped."""
    page = visit()
    open_preset(page, "Gold")
    gold = page.picture()
    page.page.get_by_role("button", name="Pin as B").click()
    open_preset(page, "Glossy plastic")
    both = page.picture()
    assert difference(both[:, 34:], gold[:, 34:]) < SAME
    assert difference(both[:, :30], gold[:, :30]) > OTHER
    assert page.page.locator(".side.right").inner_text() == "B: Gold"
    page.page.get_by_role("button", name="Swap A and B").click()
    assert page.state("name") == "Gold"
    assert difference(page.picture()[:, :30], gold[:, :30]) < SAME


def test_a_material_of_more_lobes_is_plotted_beside_one_of_fewer(visit: Open) -> None:
    page = visit()
    open_preset(page, "Three dielectric layers over metal")
    page.page.get_by_role("button", name="Pin as B").click()
    open_preset(page, "Gold")
    for tab in ("Blur", "Energy"):
        page.page.get_by_role("tab", name=tab).click()
        page.page.locator(".look svg .dashed").first.wait_for(state="attached")


def test_a_refused_material_beside_another_stops_nothing(visit: Open) -> None:
    """Expected: the open material is drawn and saved, and what is said of the other goes with it."""
    page = visit(REFUSED)
    open_preset(page, "Gold")
    put(page, "thin: true")
    said(page).get_by_text("thin: only for a stack").wait_for()
    page.page.get_by_role("button", name="Pin as B").click()
    put(page, "thin: false")
    before = page.picture()
    slider(page, 0, "Roughness").fill("80")
    assert difference(page.picture(), before) > OTHER
    save_as(page, "beside.yaml")
    said(page).get_by_text("Saved beside.yaml").wait_for()
    said(page).get_by_text("thin: only for a stack").wait_for()
    page.page.get_by_label("Compare", exact=True).select_option("single")
    said(page).get_by_text("thin: only for a stack").wait_for(state="detached")


def test_each_settled_material_is_a_picture_to_go_back_to(visit: Open) -> None:
    """Expected: one for each state that was left alone, none twice; a click or a key goes back, and undo forth."""
    page = visit()
    strip = page.page.locator(".snapshot")
    current = page.page.locator(".snapshot[aria-current=true]")

    def kept(count: int, title: str) -> None:
        page.settled()
        page.page.wait_for_function("(count) => document.querySelectorAll('.snapshot').length === count", arg=count)
        page.page.wait_for_function(
            "(title) => document.querySelector('.snapshot[aria-current=true]')?.ariaLabel === title", arg=title
        )

    kept(1, "1 · Coated brushed gold")
    open_preset(page, "Gold")
    kept(2, "2 · Gold")
    drag(slider(page, 0, "Roughness"), range(10, 100, 5))
    kept(3, "3 · Gold")
    changed = page.state("layers")
    pictures = "[...document.querySelectorAll('.snapshot img')]"
    assert (
        page.page.evaluate(f"Promise.all({pictures}.map((img) => img.decode().then(() => img.naturalWidth)))")
        == [144] * 3
    )

    strip.nth(1).click()
    kept(3, "2 · Gold")
    assert page.state("layers.0.keys.alpha") == 0.15
    page.page.get_by_role("button", name="Undo: go back").click()
    kept(3, "3 · Gold")
    assert page.state("layers") == changed

    current.focus()
    page.page.keyboard.press("Home")
    page.page.keyboard.press("Enter")
    kept(3, "1 · Coated brushed gold")
    page.page.reload()
    page.ready()
    kept(3, "1 · Coated brushed gold")


TILE = """(place) => {
  const { canvas, viewport } = velatura, { width, height } = viewport.frame;
  const copy = Object.assign(document.createElement('canvas'), { width, height }), context = copy.getContext('2d');
  viewport.paint();
  context.drawImage(canvas, place ? width - canvas.width : 0, 0);
  return [...context.getImageData(0, 0, width, height).data];
}"""


def test_materials_are_side_by_side_in_one_view(visit: Open) -> None:
    """Expected: a material beside itself is seen twice, and stays as it was while the open one changes; up to four, by
    keys too, as they were before a reload; the last that is taken away leaves one picture."""
    page = visit()
    page.page.wait_for_selector("[aria-label='1 · Coated brushed gold']")
    open_preset(page, "Gold")
    page.page.wait_for_selector("[aria-label='2 · Gold']")
    alone = page.picture()
    page.page.get_by_label("Compare", exact=True).select_option("tiles")
    tiles, all_drawn = page.page.locator(".tile"), "() => !document.querySelector('.picture').innerText.includes('…')"
    page.page.wait_for_function(all_drawn)
    assert tiles.all_inner_texts() == ["Gold", "Gold"]
    twice = page.picture()
    assert np.ptp(twice) > 100
    assert difference(*(np.array(page.page.evaluate(TILE, place)) for place in (0, 1))) < SAME

    open_preset(page, "Glossy plastic")
    both = page.picture()
    assert difference(both[:, 33:62], twice[:, 33:62]) < SAME
    assert difference(both[:, 1:30], twice[:, 1:30]) > OTHER
    drawn = page.page.evaluate_handle(
        """() => {
          const { gbuffer, slots } = velatura.viewport, { drawObject } = gbuffer, drawn = { a: 0, b: 0 };
          gbuffer.drawObject = (...given) => {
            for (const name of Object.keys(drawn)) if (given[2] === slots[name].preview) drawn[name]++;
            return drawObject.apply(gbuffer, given);
          };
          return drawn;
        }"""
    )
    drag(slider(page, 0, "Roughness"), range(10, 60, 5))
    page.settled()
    assert drawn.json_value()["a"] > 2
    assert drawn.json_value()["b"] == 0
    page.page.keyboard.press("Control+z")
    page.settled()
    page.page.wait_for_selector("[aria-label='3 · Glossy plastic']")
    page.page.locator(".snapshot[aria-current=true]").focus()
    page.page.keyboard.press("Home")
    for _ in range(2):
        page.page.keyboard.press("Tab")
        page.page.keyboard.press("Enter")
        page.settled()
        page.page.keyboard.press("Shift+Tab")
        page.page.keyboard.press("ArrowRight")
    assert tiles.all_inner_texts() == ["Glossy plastic", "Gold", "1 · Coated brushed gold", "2 · Gold"]
    assert page.page.get_by_role("button", name="3 · Glossy plastic, side by side").is_disabled()
    four = page.picture()
    page.page.reload()
    page.ready()
    page.page.wait_for_function(all_drawn)
    assert difference(page.picture(), four) < SAME

    for name in ("Take Gold away", "Take 1 · Coated brushed gold away", "Take 2 · Gold away"):
        page.page.get_by_role("button", name=name).click()
    assert page.state("view.mode") == "single"
    open_preset(page, "Gold")
    assert difference(page.picture(), alone) < SAME
    page.page.keyboard.press("Control+z")
    page.page.keyboard.press("Control+z")
    assert tiles.all_inner_texts() == ["Glossy plastic", "2 · Gold"]
    page.settled()


def test_a_lost_graphics_device_is_reported_until_it_is_back(visit: Open) -> None:
    page = visit("CONTEXT_LOST_WEBGL", "does not belong", "context lost")
    before = page.picture()
    page.page.evaluate("(window.losing = velatura.viewport.device.gl.getExtension('WEBGL_lose_context')).loseContext()")
    said(page).get_by_text("The browser has taken the graphics device away").wait_for()
    page.page.wait_for_function("() => document.querySelector('.samples').textContent === 'no graphics device'")
    page.page.evaluate("losing.restoreContext()")
    said(page).get_by_text("The browser has taken the graphics device away").wait_for(state="detached")
    page.ready()
    assert difference(page.picture(), before) < SAME


# Looks ---------------------------------------------------------------------------------------------------------------


def test_everything_is_reached_by_keys_and_has_a_name(visit: Open) -> None:
    page = visit()
    page.page.wait_for_selector(".snapshot")
    reached = []
    for _ in range(140):
        page.page.keyboard.press("Tab")
        found = page.page.evaluate(
            """() => {
              const element = document.activeElement;
              const label = element.labels?.[0]?.innerText ?? '';
              return [element.tagName, element.getAttribute('aria-label') || label || element.innerText.trim(),
                      getComputedStyle(element).outlineStyle];
            }"""
        )
        if found[0] == "BODY":
            break
        assert found[1], f"a {found[0]} has no name"
        assert found[2] != "none", f"the focus on {found} is not seen"
        reached.append(found[1])
    for name in ["Open", "Save", "Roughness", "Roughness, slider", "Rotation, dial", "Move Au: arrow keys", "Model"]:
        assert name in reached
    for name in ["History", "1 · Coated brushed gold", "1 · Coated brushed gold, side by side", "Put beside"]:
        assert name in reached

    # Change a value and add a layer without a mouse
    slider(page, 0, "Roughness").focus()
    page.page.keyboard.press("ArrowRight")
    assert page.state("layers.0.keys.alpha") == 0.055
    page.page.get_by_role("button", name="Interface", exact=True).focus()
    page.page.keyboard.press("Enter")
    assert len(page.state("layers")) == 4
    page.settled()


@pytest.mark.parametrize("width", [360, 1280])
def test_nothing_sticks_out_of_the_window(visit: Open, width: int) -> None:
    page = visit(size=(width, 720))
    assert page.page.evaluate("document.documentElement.scrollWidth") <= width
    picture = page.page.locator("canvas").first.bounding_box()
    panel = page.page.locator(".panel").bounding_box()
    assert panel["width"] >= min(width, 300)
    if width == 360:
        assert panel["y"] >= picture["y"] + picture["height"]


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1024, 768), (480, 900)])
def test_the_picture_has_most_of_the_window_until_it_is_shared(visit: Open, width: int, height: int) -> None:
    """Expected: half of a wide window, View and Model in sight, and above the values on a narrow one; what is opened
    and dragged is so again after a reload."""
    page = visit(size=(width, height), script="localStorage['velatura.layout'] ??= '{}'")
    box = page.page.locator(".picture").bounding_box
    sections = page.page.locator("details.section > summary")
    if width == 480:
        sections.last.scroll_into_view_if_needed()
        assert box()["y"] == 0 and box()["height"] >= 0.35 * height
        return
    assert box()["width"] * box()["height"] >= (0.5 if width == 1280 else 0.45) * width * height
    for summary in sections.all():
        place = summary.bounding_box()
        assert place["y"] + place["height"] <= height

    page.page.locator(".look > summary").click()
    sections.first.click()
    border = page.page.get_by_role("separator", name="Width of the panel")
    before = box()["width"]
    border.press("ArrowLeft")
    assert box()["width"] == pytest.approx(before - 24, abs=1)
    lower, edge = box(), page.page.get_by_role("separator", name="Height of the plots").bounding_box()
    page.page.mouse.move(edge["x"] + 50, edge["y"] + 3)
    page.page.mouse.down()
    page.page.mouse.move(edge["x"] + 50, edge["y"] + 63, steps=3)
    page.page.mouse.up()
    assert box()["height"] == pytest.approx(lower["height"] + 60, abs=5)
    arranged = box()
    page.page.reload()
    page.ready()
    assert box() == arranged
    page.page.get_by_label("Light", exact=True).wait_for()
    border.dblclick()
    assert box()["width"] == before


def test_the_picture_keeps_its_size_while_all_else_changes(visit: Open) -> None:
    """Every other size begins its light anew."""
    page = visit()
    size = page.page.locator("canvas").first.bounding_box()
    page.page.get_by_role("button", name="Interface", exact=True).click()
    page.page.wait_for_selector(".inspector .legend")
    page.page.get_by_role("tab", name="Disc").click()
    page.settled()
    assert page.page.locator("canvas").first.bounding_box() == size


@pytest.mark.parametrize(("scheme", "rules"), [("light", None), ("dark", ["color-contrast"])], ids=["light", "dark"])
def test_axe_finds_nothing_serious(visit: Open, scheme: str, rules: list[str] | None) -> None:
    """Expected: no serious or critical violation of axe-core's rules, with all parts open and in every dialog; in the
    dark, of those that colours are subject to. Where a part of the page alone has changed, it is looked at."""
    page = visit(size=(1280, 900), scheme=scheme, bypass_csp=True)
    page.page.add_script_tag(path=AXE)
    found: list[str] = []

    def look(where: str, part: str = "html") -> None:
        page.settled()
        options = {"resultTypes": ["violations"], **({"runOnly": rules} if rules else {})}
        answer = page.page.evaluate("([part, options]) => axe.run(part, options)", [part, options])
        worst = [each for each in answer["violations"] if each["impact"] in ("serious", "critical")]
        found.extend(f"{where}: {each['id']}: {node['html'][:200]}" for each in worst for node in each["nodes"])

    look("layers")
    page.page.get_by_role("button", name="Add a light").click()
    page.page.get_by_role("button", name="Place the highlight of Light 1").click()
    look("a place of the picture")
    page.page.keyboard.press("Escape")
    page.page.get_by_role("button", name="Light 1, kept colours").click()
    page.page.get_by_role("button", name="Keep this colour").click()
    look("kept colours")
    page.page.keyboard.press("Escape")
    page.drop(("lamp.glb", parted.in_a_row(["Foot", "Shade"])))
    page.page.get_by_role("button", name="The object", exact=True).click()
    page.page.get_by_role("region", name="Parts of the object").wait_for()
    look("parts of an object")
    page.page.get_by_label("Compare", exact=True).select_option("difference")
    look("difference")
    page.page.get_by_label("Compare", exact=True).select_option("tiles")
    look("side by side")
    page.page.get_by_label("Compare", exact=True).select_option("split")
    for tab in ("Disc", "Energy", "Blur", "Validations"):
        page.page.get_by_role("tab", name=tab, exact=True).click()
        look(tab, ".inspector-slot")
    for button in ("Open", "Save as", "Export", "Render"):
        page.page.get_by_role("button", name=button, exact=True).click()
        if button == "Export":
            page.page.get_by_label("Format", exact=True).select_option("gltf")
            page.page.locator("dialog.export .loss").wait_for()
        look(button, "dialog[open]")
        page.page.keyboard.press("Escape")
    page.page.get_by_label("Find a parameter").fill("rough")
    look("found")
    page.page.get_by_label("Find a parameter").fill("")
    page.page.get_by_role("button", name="Fold all layers").click()
    look("folded")
    page.page.get_by_role("tab", name="Appearance").click()
    look("appearance")
    assert found == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_is_readable_in_light_and_dark(visit: Open, scheme: str) -> None:
    page = visit(size=(1280, 720), scheme=scheme)
    pairs = page.page.evaluate(
        """() => ['.toolbar button', '.parameter .name', '.parameter .unit', '.kind', 'summary'].map((selector) => {
          const element = document.querySelector(selector);
          let behind = element;
          while (getComputedStyle(behind).backgroundColor === 'rgba(0, 0, 0, 0)') behind = behind.parentElement;
          return [getComputedStyle(element).color, getComputedStyle(behind).backgroundColor];
        })"""
    )
    for text, ground in pairs:
        high, low = sorted([luminance(text), luminance(ground)], reverse=True)
        assert (high + 0.05) / (low + 0.05) >= 4.5  # WCAG 2.2, 1.4.3
    assert (luminance(pairs[0][1]) < 0.2) == (scheme == "dark")


def luminance(colour: str) -> float:
    """Relative luminance of a colour as a browser tells it (WCAG 2.2)."""
    channels = np.array([float(number) for number in re.findall(r"[\d.]+", colour)[:3]]) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_the_picture_and_the_material_can_be_taken_away(visit: Open, tmp_path: Path) -> None:
    page = visit()
    open_preset(page, "Gold")
    for button, name in [("Download", "gold.yaml"), ("Save picture", "gold.png")]:
        with page.page.expect_download() as download:
            page.page.get_by_role("button", name=button, exact=True).click()
        assert download.value.suggested_filename == name
        download.value.save_as(tmp_path / name)
    assert vt.load(tmp_path / "gold.yaml") == vt.preset("bare-gold")
    assert (tmp_path / "gold.png").read_bytes()[:4] == b"\x89PNG"
