"""The Appearance panel as a user meets it, in headless Chromium with a server of its own.

Rationale: what is dragged there goes to Python and comes back as layers, and only a browser shows that both faces of a
material stay one. At the centre of a sphere that is looked at straight the light comes in along the normal: there the
lobes of the members of a class are the same, and pictures differ by their remainders alone, which a class does not
hold. The tolerance is what these make of light of radiance 1 (that of the studio is .7 on average), and the picture's
own noise: the differences of the two pictures over a patch of pixels have a standard error, and their mean must lie
within 4 of it (false alarms: 1 in 15 000).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator
from typing import Any

import chromium
import numpy as np
import pytest
from editor import Server, Tabs, Visit, drag, unexpected

import velatura as vt
from velatura.editor import appearance
from velatura.inverse import invert
from velatura.inverse.wishes.wish import compared, reflected
from velatura.scenes.objects import OBJECTS

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]
SAME = 0.5  # of 255: mean difference of previews of one material
OTHER = 1.0  # of 255: what a change of the material makes at least
NOISE = 4.0  # standard errors
SIZE = (96, 96)  # pixels of the pictures that are traced, which hold the sphere
SAMPLES = 32
ROOMY = "localStorage['velatura.layout'] ??= '{}'"  # the panel has all the room


@pytest.fixture(scope="module")
def tabs(opened: Any) -> Tabs:
    return Tabs(opened, (900, 500), permissions=["clipboard-read", "clipboard-write"])


@pytest.fixture
def visit(tabs: Tabs, served: Server) -> Iterator[Open]:
    """Opens pages in a browser without a past, and sees that no console complains."""
    expected: list[str] = []

    def begin(*expecting: str, address: str = "") -> Visit:
        expected.extend(expecting)
        return tabs.visit(address or served.entrance, ROOMY)

    yield begin
    assert unexpected(tabs.forget(), expected) == []


def open_material(visit: Visit, title: str) -> None:
    visit.page.get_by_role("button", name="Open", exact=True).click()
    visit.page.get_by_role("button", name=title, exact=True).click()
    visit.settled()


def panel(visit: Visit) -> Any:
    """The panel, with the lobes of the material in it."""
    visit.page.get_by_role("tab", name="Appearance").click()
    found = visit.page.locator("section.appearance")
    found.locator(".lobe").first.wait_for()
    return found


def answered(visit: Visit) -> None:
    """Wait until what was dragged has been answered, drawn, and made one step."""
    visit.settled()
    visit.page.wait_for_function("() => !velatura.store.dragging")


# Moves a slider and lets go, and does so once more when the first answer, an approximate one, is drawn
DRAG_AGAIN = """(slider, [first, second]) => new Promise((done) => {
  const move = (tick) => {
    slider.value = tick;
    for (const type of ['input', 'change']) slider.dispatchEvent(new Event(type, { bubbles: true }));
  };
  const stop = velatura.store.subscribe(() => {
    stop();
    requestAnimationFrame(() => requestAnimationFrame(() => done(move(second))));
  });
  move(first);
})"""


def chosen(visit: Visit, lobe: int) -> None:
    visit.page.locator(".lobe").nth(lobe - 1).click()
    visit.page.get_by_text(f"Class of lobe {lobe}").wait_for()


def steps(visit: Visit) -> int:
    return int(visit.page.evaluate("velatura.store.history().past.length"))


def lobes(visit: Visit) -> Any:
    """The lobes of the material in the page, by Python and the page's model."""
    material = {"layers": [{layer["kind"]: layer["keys"]} for layer in visit.state("layers")]}
    return vt.lobes(vt.Stack.from_dict(material), 1.0, model=visit.state("model"))


def check_physical(visit: Visit) -> None:
    for layer in visit.state("layers"):
        for key, value in layer["keys"].items():
            assert np.min(value) >= (1 if key == "eta" and "k" not in layer["keys"] else 0), (key, value)


def drag_member(visit: Visit, x: float, y: float) -> None:
    """Drags the point in the map to a share of its width and height, from the lower left."""
    plot = visit.page.locator(".plane").first
    plot.scroll_into_view_if_needed()
    plot.locator(".member").wait_for()
    box = plot.locator(".frame").bounding_box()
    point = plot.locator(".member").bounding_box()
    mouse = visit.page.mouse
    mouse.move(point["x"] + point["width"] / 2, point["y"] + point["height"] / 2)
    mouse.down()
    mouse.move(box["x"] + x * box["width"], box["y"] + (1 - y) * box["height"], steps=4)
    mouse.up()


def traced(visit: Visit) -> np.ndarray:
    """The sphere looked at straight, (height, width, 3), linear, traced; then the preview alone is drawn again."""
    positions = OBJECTS["sphere"].surface().positions
    centre = (0.5 * (positions.min(axis=0) + positions.max(axis=0))).tolist()
    visit.settled()
    pixels = visit.page.evaluate(
        """async ([[x, y, z], size, samples]) => {
          const { viewport } = velatura;
          viewport.moving(false);
          viewport.setSize(...size);
          viewport.setCamera({ origin: [x, y, z + 7], target: [x, y, z], fov: 19.5 });
          viewport.setBudget({ samples });
          while (viewport.samples < samples) await new Promise((resolve) => setTimeout(resolve, 20));
          const { data } = viewport.radiance();
          viewport.setBudget({ samples: 0 });
          return [...data];
        }""",
        [centre, SIZE, SAMPLES],
    )
    return np.reshape(pixels, (SIZE[1], SIZE[0], 4))[..., :3]


def around(low: float, high: float) -> np.ndarray:
    """The pixels of `traced` between two shares of the sphere's radius."""
    positions = OBJECTS["sphere"].surface().positions
    radius = 0.5 * float(np.ptp(positions[:, 0]))
    edge = radius / np.sqrt(7**2 - radius**2) / np.tan(np.radians(19.5 / 2)) * SIZE[1] / 2
    y, x = np.indices((SIZE[1], SIZE[0]))
    away = np.hypot(x + 0.5 - SIZE[0] / 2, y + 0.5 - SIZE[1] / 2) / edge
    return (away >= low) & (away < high)


def apart(a: np.ndarray, b: np.ndarray, where: np.ndarray, allowed: float = 0.0) -> float:
    """By how many standard errors two pictures differ on average over some pixels, in the worst channel, by more than
    is allowed."""
    differences = (a - b)[where]
    error = differences.std(axis=0) / np.sqrt(len(differences))
    return float(np.max((np.abs(differences.mean(axis=0)) - allowed) / np.maximum(error, 1e-6)))


# A visit -------------------------------------------------------------------------------------------------------------


def test_a_visit_from_blur_to_class_to_coat(visit: Open, served: Server) -> None:
    page = visit()
    page.page.evaluate(
        "void (velatura.viewport.thumbnail = () => new Promise(() => {}))"
    )  # no paths but those asked for here
    page.page.locator("details.section > summary", has_text="View").click()
    page.page.get_by_label("Object", exact=True).select_option("sphere")
    page.page.locator("details.section > summary", has_text="View").click()
    open_material(page, "Coated rough metal")
    look = panel(page)
    first = page.picture()

    # Blur
    chosen(page, 2)
    before = steps(page)
    blur = look.get_by_label("Blur, slider")
    drag(blur, (88, 80, 70))
    answered(page)
    assert lobes(page).alpha[-1][0, 0] == pytest.approx(0.35, abs=1e-4)
    assert float(np.mean(np.abs(page.picture() - first))) > SAME
    assert steps(page) == before + 1
    check_physical(page)

    # Two interfaces, and the class that they have
    chosen(page, 1)
    look.get_by_label("Number of interfaces").select_option("2")
    answered(page)
    assert sum(layer["kind"] == "interface" for layer in page.state("layers")) == 3
    whole, seen = traced(page), lobes(page)
    indices = page.state("layers.0.keys.eta"), page.state("layers.1.keys.eta")
    before = steps(page)
    drag_member(page, 0.13, 0.62)  # indices 1.2 and 2.36
    answered(page)
    assert steps(page) == before + 1
    assert page.state("layers.0.keys.eta") == pytest.approx(1.2, abs=0.05)
    check_physical(page)
    after = lobes(page)
    assert float(np.max(np.abs(sum(after.energy[:2]) - sum(seen.energy[:2])))) < 1e-6
    assert after.energy[2] == pytest.approx(seen.energy[2], abs=1e-6)
    assert after.alpha[2] == pytest.approx(seen.alpha[2], abs=1e-5)
    remainder = float(np.max(np.abs(after.remainder - seen.remainder)))
    other = traced(page)
    assert apart(whole, other, around(0, 0.09), remainder) < NOISE
    assert apart(whole, other, around(0.9, 0.97), remainder) > 2 * NOISE

    # Back
    page.page.get_by_role("button", name="Undo: choose a member of the class").click()
    page.settled()
    assert (page.state("layers.0.keys.eta"), page.state("layers.1.keys.eta")) == indices

    # Coat
    look.get_by_text("Coat", exact=True).click()
    look.get_by_label("Index of the coat", exact=True).fill("1.33")
    look.get_by_label("Index of the coat", exact=True).press("Enter")
    interfaces = len(lobes(page).energy)
    look.get_by_role("button", name="Coat it").click()
    page.page.get_by_role("button", name="Undo: coat the material").wait_for()
    page.settled()
    assert page.state("layers.0.keys.eta") == pytest.approx(1.33)
    covered = lobes(page)
    assert len(covered.energy) == interfaces + 1
    energy = f"{float(np.mean(covered.energy[0])):.3g}"
    assert look.get_by_text("Its own lobe:").inner_text() == f"Its own lobe: energy {energy}, blur 0."
    assert covered.alpha[-1][0, 0] == pytest.approx(0.35, abs=1e-3)  # the roughness of solved lobes has small steps
    kept = page.picture()

    # Save and reopen
    page.page.get_by_role("button", name="Save as").click()
    page.page.get_by_label("File name").fill("looks.yaml")
    page.page.locator("dialog.save").get_by_role("button", name="Save").click()
    page.page.get_by_text("Saved looks.yaml").wait_for()
    assert (served.folder / "looks.yaml").is_file()
    open_material(page, "Gold")
    open_material(page, "looks.yaml")
    page.page.wait_for_function("() => velatura.store.get().layers.length > 2")
    assert float(np.mean(np.abs(page.picture() - kept))) < SAME


def test_a_burst_of_drags_is_a_few_calls_and_the_last_one_wins(visit: Open) -> None:
    page = visit()
    open_material(page, "Coated rough metal")
    look = panel(page)
    chosen(page, 2)
    before = steps(page)
    page.page.evaluate(
        """() => {
          window.asked = [];
          const { ask } = velatura.live;
          velatura.live.ask = (verb, body) => (window.asked.push(verb), ask(verb, body));
        }"""
    )
    look.get_by_label("Blur, slider").evaluate(
        """(slider) => {
          for (let tick = 0; tick < 50; tick++) {
            slider.value = 91 - tick;
            slider.dispatchEvent(new Event('input', { bubbles: true }));
          }
          slider.dispatchEvent(new Event('change', { bubbles: true }));
        }"""
    )
    answered(page)
    assert page.page.evaluate("asked.filter((verb) => verb === 'invert').length") <= 3
    assert lobes(page).alpha[-1][0, 0] == pytest.approx(0.21, abs=1e-4)
    assert look.get_by_label("Blur", exact=True).input_value() == "0.21"
    assert steps(page) == before + 1


def test_handles_move_by_pointer_and_by_keys(visit: Open) -> None:
    page = visit()
    open_material(page, "Coated rough metal")
    look = panel(page)
    handle = look.locator(".handle").nth(1)
    handle.focus()
    handle.press("ArrowRight")
    answered(page)
    before = lobes(page)
    handle.press("ArrowRight")
    answered(page)
    start = lobes(page)
    assert start.alpha[-1][0, 0] == pytest.approx(before.alpha[-1][0, 0] + 0.01, abs=1e-3)

    box = handle.locator("circle").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x - 30, y, steps=3)
    page.page.mouse.up()
    answered(page)
    moved = lobes(page)
    assert moved.alpha[-1][0, 0] < start.alpha[-1][0, 0] - 0.05
    assert float(moved.energy[-1][0, 0]) == pytest.approx(float(start.energy[-1][0, 0]), rel=0.1)


def test_a_brushed_lobe_is_dragged_by_its_axes_turned_and_made_round(visit: Open) -> None:
    page = visit()
    page.page.evaluate("void (velatura.viewport.thumbnail = () => new Promise(() => {}))")
    open_material(page, "Coated brushed gold")
    look = panel(page)
    chosen(page, 2)
    before, first = steps(page), lobes(page)
    u, v = first.alpha[1][:, 0]

    # One axis, by its grip
    grip = look.locator(".grip").nth(1).locator("circle")
    grip.scroll_into_view_if_needed()
    box = grip.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x + 24, y, steps=4)
    page.page.mouse.up()
    answered(page)
    wider = lobes(page)
    assert steps(page) == before + 1
    assert wider.alpha[1][1, 0] > v + 0.05
    assert wider.alpha[1][0, 0] == pytest.approx(u, abs=1e-3)
    assert wider.energy[1] == pytest.approx(first.energy[1], abs=1e-3)

    # How it is turned, by a number beyond half a turn
    look.get_by_label("Rotation", exact=True).fill("200")
    look.get_by_label("Rotation", exact=True).press("Enter")
    answered(page)
    turned = lobes(page)
    assert np.degrees(turned.rotation[1][0]) % 180 == pytest.approx(20, abs=0.1)
    assert turned.alpha[1] == pytest.approx(wider.alpha[1], abs=2e-3)
    assert float(look.get_by_label("Rotation", exact=True).input_value()) == pytest.approx(200, abs=0.2)

    # The same for both axes, and one for each again
    look.get_by_role("button", name="Blur: the same for both axes").click()
    answered(page)
    again = lobes(page)
    assert again.alpha[1][0, 0] == pytest.approx(again.alpha[1][1, 0], abs=1e-3)
    assert look.locator(".grip").count() == 0
    look.get_by_role("button", name="Blur: one for each axis").click()
    look.get_by_label("Blur u", exact=True).fill("0.2")
    look.get_by_label("Blur u", exact=True).press("Enter")
    answered(page)
    brushed = lobes(page)
    assert brushed.alpha[1][0, 0] == pytest.approx(0.2, abs=1e-3)
    assert brushed.alpha[1][1, 0] == pytest.approx(again.alpha[1][1, 0], abs=2e-3)
    assert page.page.locator(".appearance .refused, .appearance .says").count() == 0


def test_scattering_media_and_mirrors_are_dragged_and_say_what_cannot_be(visit: Open) -> None:
    page = visit()
    page.page.evaluate("void (velatura.viewport.thumbnail = () => new Promise(() => {}))")
    open_material(page, "Metallic car paint")
    look = panel(page)
    chosen(page, 2)
    medium = page.state("layers.1.keys")
    look.get_by_label("Blur", exact=True).fill("0.5")
    look.get_by_label("Blur", exact=True).press("Enter")
    answered(page)
    assert lobes(page).alpha[-1][0, 0] == pytest.approx(0.5, abs=1e-3)
    for key in ("sigma_s", "g"):
        assert page.state(f"layers.1.keys.{key}") == pytest.approx(medium[key])
    assert look.get_by_label("Number of interfaces").is_disabled()
    assert look.get_by_text("A medium that scatters stays where it is.").is_visible()
    assert look.get_by_label("Energy", exact=True).is_enabled()

    open_material(page, "Crossed brushing")
    chosen(page, 2)
    look.get_by_label("Energy", exact=True).fill("0.5")
    look.get_by_label("Energy", exact=True).press("Enter")
    answered(page)
    assert lobes(page).energy[-1] == pytest.approx(0.5, abs=1e-3)
    assert [layer["kind"] for layer in page.state("layers")] == ["interface", "medium", "interface"]
    assert look.get_by_text("Nothing is free of a mirror but its roughness.").is_visible()

    page.page.get_by_role("tab", name="Layers").click()
    for name in ("dielectric", "medium"):
        page.page.get_by_role("button", name=f"Remove {name}").first.click()
    look = panel(page)
    page.page.wait_for_function("() => document.querySelectorAll('.appearance .lobe').length === 1")
    assert look.get_by_label("Energy", exact=True).is_disabled()
    assert look.get_by_text("Nothing above this mirror absorbs, so that it reflects all light.").is_visible()
    assert look.get_by_role("button", name="Blur: the same for both axes").is_enabled()


def test_small_pictures_lead_to_members(visit: Open) -> None:
    page = visit()
    page.page.evaluate(
        """() => {
          const { viewport } = velatura;
          const { thumbnail } = viewport;
          viewport.thumbnail = (shader, values, size) => thumbnail.call(viewport, shader, values, size, 1);
          viewport.setSize(96, 72);
          viewport.setBudget({ samples: 1 });
        }"""
    )
    open_material(page, "Bati 2021, figure 15 a")
    look = panel(page)
    drawn = page.page.wait_for_function(
        """() => {
          const pictures = [...document.querySelectorAll('.members canvas')].map((canvas) =>
            [...canvas.getContext('2d').getImageData(0, 0, 96, 96).data].reduce((sum, value) => sum + value, 0));
          return pictures.length === 5 && pictures.every(Boolean) && pictures;
        }""",
        timeout=60_000,
        polling=500,
    ).json_value()
    assert len(set(drawn)) == 5
    before = lobes(page).energy
    look.get_by_role("button", name="Take member 2 of the path").click()
    answered(page)
    after = lobes(page).energy
    assert page.state("layers.0.keys.eta") != pytest.approx(2.13, abs=0.02)
    assert float(np.max(np.abs(np.sum(before, axis=0) - np.sum(after, axis=0)))) < 1e-6


def test_the_coat_of_a_metal_is_dragged_to_a_pink_edge(visit: Open) -> None:
    """Figure 16 as in the paper: another index at the clear edge of the map, absorption of all channels on it, then of
    green alone by its slider, and less of it by the arrow keys. All lobes stay; the rim gets pink."""
    page = visit()
    page.page.evaluate("void (velatura.viewport.thumbnail = () => new Promise(() => {}))")
    open_material(page, "Bati 2021, figure 16")
    look = panel(page)
    wanted = np.sum(lobes(page).energy, axis=0)

    def media() -> list[Any]:
        return [layer["keys"]["sigma_a"] for layer in page.state("layers") if layer["kind"] == "medium"]

    shades = """() => {
      const canvas = document.querySelector('.plane canvas');
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      const pixels = Array.from({ length: data.length / 4 }, (_, i) => data.slice(4 * i, 4 * i + 4));
      return [...new Set(pixels.filter(([, , , a]) => a).map((pixel) => pixel.join()))];
    }"""
    look.get_by_text("absorption 0 to").wait_for()
    assert len(page.page.evaluate(shades)) > 10

    drag_member(page, 0.15, 0.0)
    answered(page)
    index = page.state("layers.0.keys.eta")
    assert index == pytest.approx(1.23, abs=0.03) and not media()
    assert all(isinstance(n, int | float) for layer in page.state("layers") for n in layer["keys"].values())
    drag_member(page, 0.15, 0.4)
    answered(page)
    (grey,) = media()
    assert np.ptp(grey) < 1e-9 and 0.1 < np.mean(grey) < 0.3

    for channel in ("red", "blue"):
        field = look.get_by_label(f"Absorption of the coat, {channel}", exact=True)
        field.fill("0")
        field.press("Enter")
        answered(page)
    field = look.get_by_label("Absorption of the coat, green", exact=True)
    field.fill("0.3")
    field.press("Enter")
    answered(page)
    assert media() == [pytest.approx([0, 0.3, 0], abs=1e-6)]
    slider = look.get_by_label("Absorption of the coat, green, slider")
    slider.press("ArrowLeft")
    answered(page)
    (tau,) = media()
    assert 0.25 < tau[1] < 0.3 and max(tau[0], tau[2]) < 1e-6
    assert float(np.max(np.abs(np.sum(lobes(page).energy, axis=0) - wanted))) < 1e-6
    check_physical(page)
    red, green, blue = invert.grazing(
        vt.Stack.from_dict({"layers": [{layer["kind"]: layer["keys"]} for layer in page.state("layers")]}),
        page.state("model"),
    ).mean(axis=1)
    assert (red + blue) / (2 * green) > 1.05


LATE_MAPS = """(() => {
  const { send } = WebSocket.prototype;
  WebSocket.prototype.send = function (text) {
    setTimeout(() => send.call(this, text), String(text).includes('"class"') ? 1500 : 0);
  };
})()"""


def test_what_is_typed_before_the_map_arrives_is_kept(visit: Open) -> None:
    """Expected: sliders of a coat show what the point was dragged to, and each is taken, before the new map."""
    page = visit()
    page.page.evaluate(LATE_MAPS)
    page.page.evaluate("void (velatura.viewport.thumbnail = () => new Promise(() => {}))")
    open_material(page, "Bati 2021, figure 16")
    look = panel(page)
    look.get_by_text("absorption 0 to").wait_for()
    drag_member(page, 0.15, 0.4)
    answered(page)
    for channel, depth in (("red", 0), ("blue", 0), ("green", 0.3)):
        field = look.get_by_label(f"Absorption of the coat, {channel}", exact=True)
        if channel != "red":  # typed before; the map may arrive now
            page.page.wait_for_function("(field) => Number(field.value) > 0.1", arg=field.element_handle())
        field.fill(str(depth))
        field.press("Enter")
        answered(page)
    (medium,) = [layer["keys"]["sigma_a"] for layer in page.state("layers") if layer["kind"] == "medium"]
    assert medium == pytest.approx([0, 0.3, 0], abs=1e-6)


# What cannot be ------------------------------------------------------------------------------------------------------


def test_what_cannot_be_had_is_said_beside_the_lobe(visit: Open) -> None:
    page = visit()
    open_material(page, "Bati 2021, figure 21 right")
    look = panel(page)
    chosen(page, 2)
    look.get_by_label("Blur, slider").fill("0")
    answered(page)
    look.locator(".refused", has_text="Asked: blur 0").wait_for()
    assert look.locator("circle.ghost").count() == 1
    check_physical(page)
    page.page.get_by_role("button", name="Undo").click()
    look.locator(".refused").wait_for(state="detached")


def test_a_lobe_of_three_interfaces_is_dragged(visit: Open) -> None:
    """Expected: three dielectrics with the lobe of one, then more energy than two of this blur have; one step each. Its
    class has no map, with the reason."""
    page = visit()
    open_material(page, "Bati 2021, figure 15 c")
    look = panel(page)
    chosen(page, 1)
    before, past = lobes(page), steps(page)
    look.get_by_label("Number of interfaces").select_option("3 interfaces")
    answered(page)
    assert steps(page) == past + 1 and len(lobes(page).energy) == 3
    assert np.sum(lobes(page).energy, axis=0) == pytest.approx(np.sum(before.energy, axis=0), abs=1e-5)
    look.get_by_text("Lobe 1: has no map of its class").wait_for()
    energy = look.get_by_label("Energy, slider")
    most = int(energy.get_attribute("max"))
    for share in (0.75, 0.86):
        energy.fill(str(round(share * most)))
    answered(page)
    assert steps(page) == past + 2
    bright = float(np.mean(np.sum(lobes(page).energy, axis=0)))
    assert 0.2 < bright < 0.36 and look.locator(".lobe").count() == 1
    assert [float(alpha[0, 0]) for alpha in lobes(page).alpha] == pytest.approx(
        [float(before.alpha[0][0, 0])] * 3, abs=1e-3
    )
    check_physical(page)


def test_a_lobe_that_is_dragged_too_far_is_shown_where_it_is(visit: Open) -> None:
    """Expected: the panel and the layers have one lobe, and a dashed circle is where the hand let go."""
    page = visit()
    open_material(page, "Bati 2021, figure 15 a")
    look = panel(page)
    handle = look.locator(".handle circle").first.bounding_box()
    plot = look.locator("svg.plot").first.bounding_box()
    mouse = page.page.mouse
    mouse.move(handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2)
    mouse.down()
    mouse.move(plot["x"] + 0.58 * plot["width"], plot["y"] + 4, steps=5)
    mouse.up()
    answered(page)
    look.locator(".refused", has_text="No index up to 4 reflects as much").wait_for()
    assert look.locator("circle.ghost").count() == 1
    read = lobes(page)
    energy = float(np.mean(np.sum(read.energy, axis=0)))
    assert energy < 0.6
    assert float(look.get_by_label("Energy", exact=True).input_value()) == pytest.approx(energy, rel=0.01)
    assert float(look.get_by_label("Blur", exact=True).input_value()) == pytest.approx(read.alpha[0][0, 0], rel=0.01)
    check_physical(page)


def test_a_material_that_is_no_target_says_why(visit: Open) -> None:
    page = visit()
    open_material(page, "Frosted glass pane")
    page.page.get_by_label("Thin pane").click()
    look = panel(page)
    look.locator(".says", has_text="turn thin off to drag them").wait_for()
    assert look.locator(".lobe").count() == 2
    assert "dielectric" in look.locator(".lobe").last.inner_text()
    assert look.get_by_label("Blur, slider").is_disabled()


# Saved states, addresses, objects ------------------------------------------------------------------------------------


def test_all_figures_of_the_paper_open(visit: Open) -> None:
    page = visit()
    states = appearance.targets({})["targets"]
    assert {state["title"].split()[3] for state in states} == {str(figure) for figure in range(15, 23)}
    page.page.get_by_role("button", name="Open", exact=True).click()
    for state in states:
        page.page.get_by_role("button", name=state["title"], exact=True).click()
        page.page.wait_for_function("(name) => velatura.store.get().name === name", arg=state["title"])
        page.page.wait_for_function(
            "(count) => document.querySelectorAll('.appearance .lobe').length === count",
            arg=len(state["target"]["lobes"]),
        )
        assert page.state("model") == state["model"]
        assert len(page.state("layers")) == len(state["material"]["layers"])
        said = page.page.locator("section.appearance .refused").all_inner_texts()
        assert bool(said) == bool(state["snapped"]), state["title"]
        page.page.get_by_role("button", name="Open", exact=True).click()
    page.page.get_by_role("button", name="Cancel").first.click()
    page.settled()


def test_an_address_holds_the_material(visit: Open, served: Server) -> None:
    page = visit()
    open_material(page, "Wet copper")
    page.page.locator("details.section > summary").first.click()
    page.page.get_by_label("Exposure, in stops", exact=True).fill("1")
    page.page.get_by_label("Exposure, in stops", exact=True).press("Enter")
    page.page.get_by_role("button", name="Share").click()
    page.page.get_by_text("The address is on the clipboard").wait_for()
    address = page.page.evaluate("navigator.clipboard.readText()")
    assert address.startswith(f"{served.address}#m=")
    before = page.picture()

    other = visit(address=address)
    other.page.wait_for_function("() => velatura.store.get().name === 'Wet copper'")
    assert other.state("view.exposure") == 1
    assert other.page.url == served.address
    assert float(np.mean(np.abs(other.picture() - before))) < SAME

    broken = visit(address=address[:-20])
    broken.page.locator(".messages").get_by_text("The address holds no material that can be read").wait_for()


def test_a_dropped_object_is_seen(visit: Open) -> None:
    page = visit()
    before = page.picture()
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .5 1\nf 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"
    for name, data in (("pyramid.obj", text.encode()), ("triangle.glb", _glb())):
        page.page.evaluate(
            """([name, bytes]) => {
              const dataTransfer = new DataTransfer();
              dataTransfer.items.add(new File([new Uint8Array(bytes)], name));
              document.querySelector('canvas').dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true }));
            }""",
            [name, list(data)],
        )
        page.page.wait_for_function("(name) => velatura.store.get().view.object === `file:${name}`", arg=name)
        page.page.wait_for_timeout(300)
        seen = page.picture()
        assert float(np.mean(np.abs(seen - before))) > OTHER, name
        before = seen
    page.page.reload()
    page.ready()
    assert float(np.mean(np.abs(page.picture() - before))) < SAME


def test_where_a_dropped_object_is_lost_the_first_one_is_seen(visit: Open) -> None:
    page = visit()
    before = page.picture()
    page.drop(("triangle.glb", _glb()))
    page.page.wait_for_function("() => velatura.store.get().view.object === 'file:triangle.glb'")
    assert float(np.mean(np.abs(page.picture() - before))) > OTHER
    # It waits until the page is left
    page.page.evaluate(
        "async () => { for (const { name } of await indexedDB.databases()) indexedDB.deleteDatabase(name) }"
    )
    page.page.reload()
    page.ready()
    page.page.locator(".messages").get_by_text("triangle.glb: drop this file on the page again").wait_for()
    assert float(np.mean(np.abs(page.picture() - before))) < SAME


def _glb() -> bytes:
    """One triangle that faces the camera."""
    positions = np.array([[-1, 0, 0], [1, 0, 0], [0, 2, 0]], "<f4").tobytes()
    fields = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, 0, 0], "max": [1, 2, 0]}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(positions)}],
        "buffers": [{"byteLength": len(positions)}],
    }
    text = json.dumps(fields).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(positions), b"BIN\0") + positions
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


# Side by side --------------------------------------------------------------------------------------------------------


def test_two_members_side_by_side(visit: Open) -> None:
    page = visit()
    open_material(page, "Bati 2021, figure 15 c")
    look = panel(page)
    look.get_by_role("button", name="Pin as B").click()
    page.settled()
    alike = page.picture()
    look.get_by_label("Energy, slider").fill("198")
    answered(page)
    changed = np.abs(page.picture() - alike).mean(axis=(0, 2))
    assert changed[:30].mean() > OTHER
    assert changed[34:].mean() < SAME
    assert page.page.locator(".side.right").inner_text() == "B: Bati 2021, figure 15 c"
    look.get_by_role("button", name="One picture").click()
    assert page.state("view.mode") == "single"


def test_the_truth_beside_the_model(visit: Open) -> None:
    page = visit()
    page.page.evaluate("velatura.viewport.setSize(96, 72)")
    open_material(page, "Glossy plastic")
    page.page.locator("details.section > summary").last.click()
    page.page.get_by_label("Compare").select_option("split")
    alike = page.picture()
    page.page.get_by_label("With", exact=True).select_option("truth")
    page.page.wait_for_function("() => velatura.viewport.truth?.samples >= 32", timeout=60_000)
    truth = page.picture()
    assert float(np.mean(np.abs(truth - alike)[:, :30])) < SAME
    # It is the same view, where the model is good: noise and the preview's lack of shadows are what is left
    assert 0 < float(np.mean(np.abs(truth - alike)[:, 34:])) < 20
    page.page.get_by_label("Compare").select_option("single")
    assert page.page.evaluate("velatura.viewport.truth") is None


def test_further_wishes_are_dragged(visit: Open) -> None:
    """Expected: the material shows, by Python, what the controls were dragged to, in one step each; a clear pane gets
    its medium by one click; the reason for what cannot be stands beside it."""
    page = visit()
    page.page.evaluate("void (velatura.viewport.thumbnail = () => new Promise(() => {}))")

    def further(title: str) -> Any:
        open_material(page, title)
        page.page.get_by_role("tab", name="Appearance").click()
        found = page.page.locator("details.further")
        found.wait_for()
        if not found.evaluate("details => details.open"):
            found.locator("summary").click()
        return found

    def one_step(slider: Any, ticks: tuple[int, ...]) -> None:
        before = steps(page)
        drag(slider, ticks)
        answered(page)
        assert steps(page) == before + 1

    # What a pane passes, by its haze
    look = further("Tinted plate")
    before = lobes(page)
    haze = look.get_by_label("Haze, slider")
    most = int(haze.get_attribute("max"))
    one_step(haze, (round(0.8 * most), round(0.5 * most)))
    alpha = float(lobes(page).transmitted.alpha.mean())
    assert alpha**2 / (alpha**2 + np.tan(np.radians(1.25)) ** 2) == pytest.approx(0.5, abs=2e-3)
    assert page.state("layers.1.keys.sigma_a") == pytest.approx([1.0, 0.7, 0.2])
    assert before.transmitted.alpha.mean() > 2 * alpha

    # A clear pane, which lacks a medium
    look = further("Frosted glass pane")
    look.get_by_role("button", name="Add a tinted medium below layer 0").click()
    one_step(look.get_by_label("Passes: share, slider"), (round(0.6 * most), round(0.4 * most)))
    assert float(lobes(page).passed.mean()) == pytest.approx(0.4, abs=2e-3)

    # The colour of a base
    look = further("Glossy plastic")
    look.get_by_label("Base, seen from outside, blue", exact=True).fill("0.2")
    look.get_by_label("Base, seen from outside, blue", exact=True).press("Enter")
    answered(page)
    assert lobes(page).remainder[2, 0] == pytest.approx(0.2, abs=1e-3)
    assert page.state("layers.0.keys.eta") == "polystyrene"

    # Grazing light: more than there can be
    look.get_by_label("Reflected at a second angle: share", exact=True).fill("0.99")
    look.get_by_label("Reflected at a second angle: share", exact=True).press("Enter")
    look.get_by_text("No stack of these layers with its lobes is found").wait_for()
    answered(page)

    # A film
    page.page.locator("details.section > summary", has_text="Model").click()
    page.page.get_by_label("Model", exact=True).select_option("weier2020")
    look = further("Anodised titanium")
    thickness = page.state("layers.0.keys.films.0.thickness_nm")
    one_step(look.get_by_label("Film, by its thickness: share, slider"), (round(0.3 * most), round(0.4 * most)))
    assert page.state("layers.0.keys.films.0.thickness_nm") != pytest.approx(thickness, abs=1)

    # Grazing light, which lobes at normal incidence are kept for
    look = further("Coloured absorbing coat")
    before = lobes(page)
    shown = look.get_by_label("Reflected at a second angle: share, slider")
    tick = int(shown.input_value())
    one_step(shown, (tick - 3, tick - 2))
    after = lobes(page)
    assert np.allclose(before.energy, after.energy, atol=2e-3) and np.allclose(before.alpha, after.alpha, atol=2e-3)
    assert int(shown.input_value()) < tick

    # The blur of one lobe there, then its energy: each gives way at normal incidence, and the other lobe stays
    look.get_by_label("Light at a second angle").select_option("The lobe of interface 2")
    for label, name in (
        ("Blur at a second angle, slider", "alpha"),
        ("Reflected at a second angle: share, slider", "energy"),
    ):
        before, shown = lobes(page), look.get_by_label(label)
        tick = int(shown.input_value())
        one_step(shown, (round(0.97 * tick), round(0.95 * tick)))
        after = lobes(page)
        assert int(shown.input_value()) < tick
        for other in {"energy", "alpha"} - {name}:
            assert np.allclose(getattr(before, other), getattr(after, other), atol=3e-3)
        assert np.allclose(getattr(before, name)[0], getattr(after, name)[0], atol=2e-3)
        assert np.all(getattr(after, name)[1] < 0.99 * getattr(before, name)[1])

    # A mixture, by its weights, taken up again before the step ends; its parts are wished for one at a time
    look = further("Half-metallic paint")
    page.settled()
    pigment = page.state("parts.1.layers.2.keys.albedo")
    share = look.get_by_label("Mixture, by its weights: share, slider")
    past = steps(page)
    share.evaluate(DRAG_AGAIN, [round(0.1 * most), round(0.2 * most)])
    answered(page)
    assert steps(page) == past + 1
    shares = np.linspace(0, 1, 101)
    paints = [vt.preset("half-metallic-paint").replace(part0_weight=float(share)) for share in (0, 0.5, 1)]
    flakeless, before, flaky = (reflected(vt.lobes(each, 1.0, model="weier2020"))[:, 0] for each in paints)
    asked = compared(before * 0.2 / before.mean(), None)
    missed = [np.linalg.norm(compared(share * flaky + (1 - share) * flakeless, None) - asked) for share in shares]
    assert page.state("parts.0.weight") == pytest.approx(shares[np.argmin(missed)], abs=0.01)
    assert page.state("parts.1.layers.2.keys.albedo") == pigment
    look.get_by_text("No weights of these parts give").wait_for()


def test_a_material_is_made_of_what_a_workshop_has(visit: Open) -> None:
    """Expected: the choices are of these substances, the nearest first, and one is taken as one step; a lacquer of the
    material's own coat is laid as thick as it was, or as the slider asks for."""
    page = visit()
    page.page.evaluate("void (velatura.viewport.thumbnail = () => new Promise(() => {}))")
    open_material(page, "Coloured absorbing coat")
    look = panel(page).locator("details.workshop")
    look.locator("summary").click()
    look.get_by_role("button", name="Add those of the material").click()
    look.get_by_label("Add a substance").select_option("Cu")
    look.get_by_label("Index of a substance").fill("1.7")
    look.get_by_label("Index of a substance").press("Enter")
    look.get_by_role("button", name="Add", exact=True).click()
    look.locator(".stock li").nth(3).wait_for()

    def take(place: int) -> None:
        look.get_by_role("button", name="Make it of these").click()
        page.settled()
        past = steps(page)
        look.locator(".choices button").nth(place).click()
        page.settled()
        assert steps(page) == past + 1

    def values() -> list[dict[str, Any]]:
        return [layer["keys"] for layer in page.state("layers")]

    take(0)
    surface, coat, metal = values()
    assert (surface["eta"], coat["sigma_a"], metal["conductor"]) == (1.8, [1, 0.7, 0.2], "Al")
    assert coat["depth"] == pytest.approx(1, abs=1e-3) and metal["alpha"] == pytest.approx(0.2, abs=1e-3)
    assert look.locator(".choices li").first.inner_text().split("off by")[0].strip() == "1.8, 1 deep, Al"

    look.get_by_label("Depth of coats at least", exact=True).fill("2")
    look.get_by_label("Depth of coats at least", exact=True).press("Enter")
    look.get_by_role("button", name="Remove 1.7").click()
    look.locator(".stock li").nth(3).wait_for(state="detached")
    take(1)
    surface, coat, metal = values()
    assert surface["eta"] == 1.8 and coat["depth"] >= 2 and metal["conductor"] in ("Al", "Cu")
    assert len(look.locator(".choices button").all()) == 2
