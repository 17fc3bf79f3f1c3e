"""Look inside, in the editor: plots tell the model's numbers, follow what is done, and are read without a pointer."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import pytest

import velatura as vt
from velatura import tables
from velatura.model.solved.energies.adding import parts
from velatura.model.solved.energies.energies import energies
from velatura.model.solved.lobes import widths
from velatura.stack import Material

if chromium.missing():
    pytest.skip(chromium.missing(), allow_module_level=True)

import editor

PRESET = "coated-gold"
PATIENCE = 90.0  # seconds, as of all visits


class Look(editor.Visit):
    """A visit that does not wait for the picture, but for the plots; the preview alone is drawn."""

    begun: dict[str, list[float]] | None = None  # what the plots read at first

    def ready(self) -> None:
        self.page.wait_for_selector(".inspector .legend")
        self.page.evaluate("velatura.viewport.setBudget({ samples: 0 })")


@pytest.fixture(scope="module")
def look(served: editor.Server, opened: Any) -> Iterator[Look]:
    context = opened.new_context(viewport={"width": 1000, "height": 600})
    yield Look(context.new_page(), served.entrance)
    context.close()


@pytest.fixture
def visit(look: Look) -> Iterator[Look]:
    """The first preset, lit from 45 degrees; afterwards all is undone, and nothing was complained about."""
    tab(look, "Polar")
    aim(look, "angle", 45)
    look.begun = look.begun or read_out(look)
    until(look, lambda: read_out(look) == look.begun)  # the plots of what was undone may still be there
    yield look
    look.page.evaluate("() => { while (velatura.store.canUndo) velatura.store.undo(); }")
    assert look.complaints == []


def tab(visit: Look, name: str) -> None:
    visit.page.get_by_role("tab", name=name).click()
    visit.page.wait_for_selector(f"[aria-labelledby=inspect-{name.lower()}]")
    painted(visit)


def painted(visit: Look) -> None:
    """Wait for two frames: what is done in one is seen in the next."""
    visit.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def until(visit: Look, holds: Callable[[], bool]) -> None:
    """Wait until a condition holds, which is looked at between frames."""
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        visit.page.wait_for_timeout(100)


def read_out(visit: Look) -> dict[str, list[float]]:
    """The read-out: numbers by what they are of."""
    rows = """() => [...document.querySelectorAll('.inspector .legend tbody tr')].map(
      (row) => [row.querySelector('th').innerText.trim(), row.querySelector('td').innerText])"""  # at one time
    return {name: [float(number) for number in numbers.split()] for name, numbers in visit.page.evaluate(rows)}


def aim(visit: Look, key: str, degrees: int) -> None:
    visit.page.locator(f".inspector input[name={key}]").fill(str(degrees))
    painted(visit)


@pytest.mark.parametrize("model", ["velatura", "belcour2018"])
def test_the_energy_plot_tells_the_energies_of_the_model(visit: Look, model: str) -> None:
    """Three digits are shown, of energies below 1: within 5e-4 of what the page has, and that within 5e-4."""
    visit.page.evaluate(
        "(model) => velatura.store.run((state) => ({ ...state, model, switches: {} }))",
        model,
    )
    tab(visit, "Energy")
    for degrees in (0, 45, 80):
        lobes = vt.lobes(vt.preset(PRESET), math.cos(math.radians(degrees)), model=model)
        parts = [*lobes.energy, *([lobes.remainder] if model == "velatura" else [])]
        expected = [energy[:, 0].tolist() for energy in (*parts, sum(parts))]

        def agrees(expected: list[list[float]] = expected) -> bool:
            found = [energy if len(energy) == 3 else 3 * energy for energy in read_out(visit).values()]
            return len(found) == len(expected) and all(a == pytest.approx(b, abs=1e-3) for a, b in zip(found, expected))

        aim(visit, "angle", degrees)
        until(visit, agrees)


def test_the_blur_plot_tells_the_roughnesses_of_the_model(visit: Look) -> None:
    """Within .001 of the texture that shaders read, and the rounding of three digits; those of the first part of a lobe
    that is two."""
    tab(visit, "Blur")
    aim(visit, "angle", 60)
    material, cosine, phi = Material.of(vt.preset(PRESET)), np.array([0.5]), np.zeros(1)
    solved = energies(material, cosine, phi, tables.load(), widths.nearly_straight, incidences=np.zeros(0))
    _, metal = widths.each(parts(material), cosine, phi, solved.lobes.mean(axis=1))
    expected = sorted(float(alpha[0]) for alpha in metal.near.roughness(phi)[:2])

    def agrees() -> bool:
        return sorted(list(read_out(visit).values())[1]) == pytest.approx(expected, abs=1.5e-3)

    until(visit, agrees)


def test_the_polar_plot_follows_the_angle_and_the_material(visit: Look) -> None:
    """The highest value lies near the mirror direction, and drops where the coat is rougher."""
    outline = visit.page.locator("svg.polar .line").first
    before, peak = outline.get_attribute("d"), read_out(visit)
    aim(visit, "angle", 20)
    until(visit, lambda: outline.get_attribute("d") != before)
    assert "20°" in visit.page.locator(".legend thead").inner_text()

    aim(visit, "angle", 45)
    until(visit, lambda: read_out(visit) == peak)
    coat = visit.state("layers.0.id")
    visit.page.evaluate(
        """(id) => velatura.store.run((state) => ({ ...state, layers: state.layers.map((layer) =>
             layer.id === id ? { ...layer, keys: { ...layer.keys, alpha: 0.3 } } : layer) }))""",
        coat,
    )
    first = next(iter(peak))
    until(visit, lambda: read_out(visit)[first][0] < 0.2 * peak[first][0])


def test_a_lobe_is_shown_alone_in_plots_and_picture(visit: Look) -> None:
    whole = visit.picture()
    lines = visit.page.locator("svg.polar .line")
    assert lines.count() == 4
    lobe = visit.page.locator(".legend button").first
    lobe.click()
    visit.page.wait_for_function("() => velatura.store.get().view.lobe === 0")
    painted(visit)
    assert lines.count() == 1
    assert lobe.get_attribute("aria-pressed") == "true"
    until(visit, lambda: (whole - visit.picture()).mean() > 5)

    lobe.click()
    painted(visit)
    assert visit.state("view.lobe") is None
    assert lines.count() == 4


def test_names_and_numbers_change_together(visit: Look) -> None:
    """Expected: while the server prints the shader of another material, the plots keep the names of what they show."""
    legend = "document.querySelector('.inspector .legend').innerText"
    before = visit.page.evaluate(legend)
    visit.page.evaluate(
        f"""() => {{
          window.legends = new Set();
          const {{ fetch }} = window;
          window.fetch = async (...asked) => {{
            await new Promise((resolve) => setTimeout(resolve, 300));
            return fetch(...asked);
          }};
          const look = () => (legends.add({legend}), (window.looking = requestAnimationFrame(look)));
          look();
        }}"""
    )
    visit.page.get_by_role("button", name="Open", exact=True).click()
    visit.page.get_by_role("button", name="Metallic car paint", exact=True).click()
    layers = visit.state("layers")
    names = [
        f"{n} {'Al' if n == 2 else 'polyurethane'}" for n, layer in enumerate(layers) if layer["kind"] == "interface"
    ]
    until(visit, lambda: [name.split(",")[0] for name in list(read_out(visit))[:-1]] == [*names, "remainder"])
    visit.page.evaluate("cancelAnimationFrame(looking)")
    after = visit.page.evaluate(legend)
    assert before != after
    assert set(visit.page.evaluate("[...legends]")) == {before, after}
    numbers = visit.page.locator(".layer .place").all_inner_texts()
    assert numbers == [str(n) for n in range(len(layers))]


def test_plots_come_back_with_the_graphics_device(visit: Look) -> None:
    """Expected: what is dragged while the device is away is in the plots once it is back."""
    tab(visit, "Energy")
    visit.page.evaluate(
        "window.away = velatura.viewport.device.gl.getExtension('WEBGL_lose_context'); away.loseContext()"
    )
    visit.page.wait_for_function("() => velatura.viewport.lost")
    visit.page.locator(".layer").first.get_by_label("Roughness, slider").fill("100")
    visit.page.wait_for_timeout(300)
    visit.page.evaluate("away.restoreContext()")
    stack = vt.preset(PRESET).replace(layer0_alpha=visit.state("layers.0.keys.alpha"))
    lobes = vt.lobes(stack, math.cos(math.radians(45)))
    parts = [*lobes.energy, lobes.remainder]
    expected = [energy[:, 0].tolist() for energy in (*parts, sum(parts))]

    def agrees() -> bool:
        found = [energy if len(energy) == 3 else 3 * energy for energy in read_out(visit).values()]
        return len(found) == len(expected) and all(a == pytest.approx(b, abs=1e-3) for a, b in zip(found, expected))

    until(visit, agrees)


def test_the_disc_tells_f_cos_where_the_pointer_is(visit: Look) -> None:
    """In the mirror direction it tells what the polar plot tells there, but for the size of a pixel."""
    peak = list(read_out(visit).values())
    tab(visit, "Disc")
    disc = visit.page.locator(".disc svg")
    disc.scroll_into_view_if_needed()
    box = disc.bounding_box()
    assert box
    x = box["x"] + box["width"] * (1.05 - math.sin(math.radians(45))) / 2.1
    visit.page.mouse.move(x, box["y"] + box["height"] / 2)
    painted(visit)
    found = list(read_out(visit).values())
    assert found[1] == pytest.approx(peak[1], rel=0.03)
    assert found[-1] == pytest.approx(peak[-1], rel=0.1)


def test_two_models_are_drawn_and_listed_side_by_side(visit: Look) -> None:
    visit.page.evaluate(
        """() => velatura.store.run((state) =>
             ({ ...state, view: { ...state.view, mode: 'split', other: { model: 'belcour2018' } } }))"""
    )
    visit.page.wait_for_selector("svg.polar .dashed", state="attached")
    assert "- - Belcour 2018" in visit.page.locator(".legend thead").inner_text()
    tab(visit, "Energy")
    assert visit.page.locator("svg.chart .dashed").count() > 0
    visit.page.evaluate("() => velatura.store.undo()")
    visit.page.wait_for_selector("svg.chart .dashed", state="detached")


def test_everything_is_reached_by_keys(visit: Look) -> None:
    page = visit.page
    page.get_by_role("tab", name="Polar").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    painted(visit)
    assert page.evaluate("() => document.activeElement.id") == "inspect-energy"
    page.keyboard.press("Tab")
    page.keyboard.press("ArrowRight")
    page.locator(".legend thead").get_by_text("46°").wait_for()
    page.locator("svg.chart").focus()
    page.keyboard.press("PageUp")
    page.locator(".legend thead").get_by_text("56°").wait_for()
    page.locator(".legend button").nth(1).focus()
    page.keyboard.press("Enter")
    painted(visit)
    assert visit.state("view.lobe") == 1


def test_validations_answer_their_sliders(visit: Look) -> None:
    tab(visit, "Validations")
    page = visit.page
    said = page.locator(".inspector .says")
    said.wait_for()
    for name in ("Transmission scale", "Absorption", "Scattering", "Total internal reflection", "Reflection"):
        page.locator(".inspector .choice select").select_option(label=name)
        page.wait_for_selector(".inspector .truth")
        until(visit, lambda: page.locator(".inspector .line").count() >= 3)
    page.locator(".inspector input[name=alpha_1]").fill("0")
    until(visit, lambda: "belcour 0.300" in said.inner_text())
    assert "two bounces 0.300" in said.inner_text()


def test_validations_of_brushed_interfaces_follow_the_material(visit: Look) -> None:
    """Coated gold, brushed at the bottom: its numbers are taken, until they are changed by hand; the grid of pairs is
    filled cell by cell, half walk, half model."""
    tab(visit, "Validations")
    page = visit.page
    said = page.locator(".inspector .says")
    choice = page.locator(".inspector .choice select")
    said.wait_for()
    choice.first.select_option(label="Anisotropic fetch")
    slider = page.locator(".inspector input[name=alpha_v]")
    until(visit, lambda: slider.input_value() == "0.3")
    assert choice.nth(1).input_value() == "2"
    page.evaluate(
        """() => {
          const { store } = velatura;
          store.run((state) => ({ ...state, layers: state.layers.map((layer) =>
            layer.id === 3 ? { ...layer, keys: { ...layer.keys, alpha: [0.1, 0.5] } } : layer) }));
        }"""
    )
    until(visit, lambda: slider.input_value() == "0.5")
    choice.nth(1).select_option("0")
    until(visit, lambda: slider.input_value() == "0.05")
    slider.fill("0.4")
    until(visit, lambda: "stretched" in said.inner_text() and "0.4" in page.locator("output").all_inner_texts())

    choice.first.select_option(label="Anisotropic lobe")
    page.locator(".inspector .disc .truth").wait_for()
    for name, value in (("alpha_u", "0.1"), ("alpha_v", "0.4"), ("angle", "70")):
        page.locator(f".inspector input[name={name}]").fill(value)
    until(visit, lambda: "turned by 6." in said.inner_text() or "turned by -6." in said.inner_text())

    choice.first.select_option(label="Roughness pairs")
    first = page.get_by_role("button", name="Alpha 0.02, 0.02: difference")
    first.wait_for()
    first.click()
    until(visit, lambda: "Alpha 0.02, 0.02: Root mean square difference 0." in said.inner_text())
    halves = page.evaluate(
        """() => [0, 32].map((x) => document.querySelector('.roughnesses canvas').getContext('2d')
          .getImageData(x, 0, 32, 64).data.reduce((a, b) => a + b, 0))"""
    )
    assert min(halves) > 32 * 64 * 256


@pytest.mark.parametrize(("scheme", "width"), [("light", 380), ("dark", 1280)])
def test_it_is_usable_in_a_narrow_window_and_in_the_dark(
    served: editor.Server, opened: Any, tmp_path: Path, scheme: str, width: int
) -> None:
    """Nothing sticks out of the panel, and words have a contrast of at least 4.5 to what is behind them."""
    context = opened.new_context(viewport={"width": width, "height": 720}, color_scheme=scheme)
    visit = Look(context.new_page(), served.entrance)
    for name in ("Polar", "Disc", "Energy", "Blur"):
        tab(visit, name)
        visit.page.locator(".inspector").screenshot(path=tmp_path / f"{name}.png")
        slot = visit.page.locator(".inspector-slot")
        assert slot.evaluate("(e) => e.scrollWidth <= e.clientWidth + 1")
        assert slot.evaluate(CONTRAST) >= 4.5
    context.close()
    assert visit.complaints == []


#: The lowest contrast of text to its ground among cells of the legend, by the definition of WCAG 2.
CONTRAST = """(slot) => {
  const context = new OffscreenCanvas(1, 1).getContext('2d', { willReadFrequently: true });
  const rgb = (colour) => {
    context.clearRect(0, 0, 1, 1);
    context.fillStyle = colour;
    context.fillRect(0, 0, 1, 1);
    return [...context.getImageData(0, 0, 1, 1).data];
  };
  const light = (colour) => {
    const [r, g, b] = rgb(colour).map((x) => (x / 255 <= 0.04045 ? x / 3294.6 : ((x / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ground = (element) => {
    const colour = getComputedStyle(element).backgroundColor;
    return rgb(colour)[3] === 255 || !element.parentElement ? colour : ground(element.parentElement);
  };
  const texts = [...slot.querySelectorAll('.legend th, .legend td, [role=tab]')];
  return Math.min(...texts.map((element) => {
    const [a, b] = [light(getComputedStyle(element).color), light(ground(element))].sort();
    return (b + 0.05) / (a + 0.05);
  }));
}"""
