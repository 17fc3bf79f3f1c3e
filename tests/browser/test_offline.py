"""The folder that `velatura edit --static` writes, on a web server of files alone, beside `velatura edit`.

Rationale: without Python, materials are drawn of answers that were worked out before, and only a browser shows whether
they are found, and are those of the server. The browser reaches no other address. Pictures are previews, which are the
same every time; a picture by another model differs by more than the bound.
"""

from __future__ import annotations

import functools
import gzip
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import pytest
from editor import Server, Tabs, Visit, drag, require_fresh_page, unexpected
from fuzzing import hostile
from hosted import hosted

import velatura as vt
from velatura.editor import offline, tabulated
from velatura.model import named

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]
SAME = 0.01  # root mean square of differences, white being 1
MODELS = [named("belcour2018"), named("velatura")]
# Those that are opened here, and one with films; `make docs` writes all
PRESETS = [
    *("bare-gold", "coated-gold", "coated-rough-metal", "frosted-glass", "glossy-plastic", "red-enamel"),
    "anodised-titanium",  # which has films
]
FOLLOWED = "Coated rough metal"  # whose values may move; tables of all take longer to write
LAYERS = 0  # besides the orders of presets, of which more take longer to write
FIRST_LOAD = 6e6  # bytes, compressed
POLICY = (  # as a careful host of the folder may send it
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    require_fresh_page()
    place = tmp_path_factory.mktemp("site")
    axes = tabulated.axes
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(offline, "presets", lambda mixtures: PRESETS)
        patch.setattr(tabulated, "axes", lambda stack: axes(stack) if stack.name == FOLLOWED else [])
        offline.write(place, layers=LAYERS, models=MODELS)
    return place


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    with hosted(folder) as found:
        yield found


@pytest.fixture(scope="module")
def tabs(opened: Any, address: str, served: Server) -> Tabs:
    """Of a browser that reaches no other address."""
    made = Tabs(opened, permissions=["clipboard-read", "clipboard-write"])
    allowed = address, served.address

    def guard(route: Any) -> None:
        route.continue_() if route.request.url.startswith(allowed) else route.abort()

    made.context.route("**/*", guard)
    return made


@pytest.fixture
def requests(tabs: Tabs) -> Iterator[list[str]]:
    """All that pages have asked the network for."""
    found: list[str] = []

    def listen(request: Any) -> None:
        found.append(request.url)

    tabs.context.on("request", listen)
    yield found
    tabs.context.remove_listener("request", listen)


@pytest.fixture
def visit(tabs: Tabs, address: str, served: Server, requests: list[str]) -> Iterator[Open]:
    """Opens the folder's page, or the server's, in a browser without a past; no console may complain."""

    def begin(place: str = "") -> Visit:
        return tabs.visit(place or address)

    yield begin
    assert unexpected(tabs.forget(), ()) == []
    allowed = address, served.address
    assert [url for url in requests if not url.startswith((*allowed, "data:", "ws://127.0.0.1"))] == []


def open_preset(page: Visit, title: str) -> None:
    page.page.get_by_role("button", name="Open", exact=True).click()
    page.page.get_by_role("button", name=title, exact=True).click()
    page.settled()


def choose_model(page: Visit, title: str) -> None:
    page.page.get_by_label("Model", exact=True).select_option(title)
    page.settled()


def roughen(page: Visit, layer: int, ticks: int) -> None:
    """Drag the roughness of a layer."""
    page.page.locator(".layer").nth(layer).get_by_label("Roughness, slider", exact=True).fill(str(ticks))
    page.settled()


def link(page: Visit) -> str:
    """The part of an address that opens what is shown."""
    page.page.get_by_role("button", name="Share").click()
    page.page.get_by_text("The address is on the clipboard").wait_for()
    return "#" + page.page.evaluate("navigator.clipboard.readText()").partition("#")[2]


def distance(a: Visit, b: Visit) -> float:
    return float(np.sqrt(np.mean(np.square(a.picture() - b.picture())))) / 255


def test_presets_are_those_of_the_server(visit: Open, served: Server) -> None:
    """Expected: one picture, of an opaque brushed stack, of a pane and of a base; any model."""
    here, there = visit(), visit(served.entrance)
    for title in ("Coated brushed gold", "Frosted glass pane", "Red enamel"):
        for page in (here, there):
            open_preset(page, title)
        assert distance(here, there) < SAME
    before = here.picture()
    assert not here.page.locator(".form").count()
    for page in (here, there):
        choose_model(page, "belcour2018")
    assert distance(here, there) < SAME
    assert np.sqrt(np.mean(np.square(here.picture() - before))) / 255 > SAME


def test_a_value_dragged_and_a_layer_added_make_the_servers_picture(visit: Open, served: Server) -> None:
    """Expected: by a model that needs no solution, the picture of the server, which opens the link of each step."""
    here = visit()
    open_preset(here, "Gold")
    choose_model(here, "belcour2018")
    roughen(here, 0, 80)
    assert here.state("layers.0.keys.alpha") == 0.4
    dragged = visit(served.entrance + link(here))
    assert distance(here, dragged) < SAME
    here.page.get_by_role("button", name="Interface", exact=True).click()
    here.settled()
    added = visit(served.entrance + link(here))
    assert added.state("layers.length") == 2
    assert distance(here, added) < SAME
    assert not here.page.locator(".form").count()


def test_a_solved_model_says_that_changes_are_drawn_in_closed_form(visit: Open) -> None:
    here = visit()
    open_preset(here, "Gold")
    solved = here.picture()
    roughen(here, 0, 80)
    assert here.page.locator(".form").inner_text() == "closed form"
    here.page.get_by_role("button", name="Undo: change a value").click()
    here.settled()
    here.page.wait_for_function("() => !velatura.shader().closed_form")
    assert np.abs(here.picture() - solved).max() < 1


def test_a_roughness_that_is_dragged_is_nearer_to_the_servers_picture_than_the_closed_form(
    visit: Open, address: str, served: Server
) -> None:
    """Expected: by half at least; the page says what it draws, and the preset is as it was solved, once more. A turn of
    what is not brushed changes nothing but is not followed, which shows the closed form."""
    here = visit()
    open_preset(here, FOLLOWED)
    solved = here.picture()
    assert not here.page.locator(".form").count()
    drag(here.page.locator(".layer").nth(1).get_by_label("Roughness, slider", exact=True), (70, 80, 90))
    here.settled()
    assert here.state("layers.1.keys.alpha") == 0.45
    assert here.page.locator(".form").inner_text() == "interpolated"
    there = visit(served.entrance + link(here))
    layers = [{kind: {**keys, "rotation": 1}} for kind, keys in ((x["kind"], x["keys"]) for x in here.state("layers"))]
    closed = visit(address + hostile.fragment("", material={"layers": layers}, model="velatura"))
    assert closed.page.locator(".form").inner_text() == "closed form"
    assert 2 * distance(here, there) < distance(closed, there)
    here.page.get_by_role("button", name="Undo: change a value").click()
    here.settled()
    assert not here.page.locator(".form").count()
    assert np.abs(here.picture() - solved).max() < 1


def test_a_link_is_shared_and_opened(visit: Open, address: str) -> None:
    here = visit()
    open_preset(here, "Gold")
    roughen(here, 0, 60)
    there = visit(address + link(here))
    there.page.get_by_text("from the address").wait_for()
    assert there.state("layers.0.keys.alpha") == here.state("layers.0.keys.alpha") == 0.3
    assert distance(here, there) < SAME


@pytest.fixture
def stranger(opened: Any, folder: Path) -> Iterator[Visit]:
    """A visit under a strict policy, whose console complains of all that this refuses and of foreign code that runs;
    presets have hostile names."""

    def session(route: Any) -> None:
        found = json.loads(gzip.decompress((folder / offline.SESSION).read_bytes()))
        for preset, name in zip(found["presets"], hostile.NAMES):
            preset["title"] = preset["material"]["name"] = name
        route.fulfill(body=gzip.compress(json.dumps(found).encode()))

    with hosted(folder, POLICY) as address:
        context = opened.new_context(viewport={"width": 900, "height": 600}, accept_downloads=True)
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        context.route(f"**/{offline.SESSION}", session)
        visit = Visit(context.new_page(), address, hostile.WATCH)
        yield visit
        context.close()
        assert visit.complaints == []


def test_hostile_names_run_nothing_under_a_strict_policy(stranger: Visit) -> None:
    """Expected: names of presets, addresses, files and fields are shown as they are, downloads have plain letters."""
    page = stranger.page
    button = functools.partial(page.get_by_role, "button", exact=True)
    for name in hostile.NAMES:
        page.evaluate("(fragment) => (location.hash = fragment)", hostile.fragment(name))
        page.wait_for_function("(name) => velatura.store.get().name === name", arg=name)
        assert page.get_by_label("Name", exact=True).input_value() == name
        page.evaluate(hostile.DROP, [f"{name[:200]}.json", "{"])
        page.get_by_text("is not JSON").wait_for()
        page.evaluate(hostile.DROP, [f"{name[:200]}.json", json.dumps(hostile.material(f"{name}."))])
        page.wait_for_function("(name) => velatura.store.get().name === name", arg=f"{name}.")
    stranger.settled()
    button(name="Pin as B").click()
    button(name="Put beside").click()
    button(name="Export").click()
    page.get_by_label("What is written").wait_for()  # which moves the button
    button(name="Close").click()
    button(name="Open").click()
    for name in hostile.NAMES[:3]:
        assert page.locator("dialog.open").get_by_role("button", name=name, exact=True).count() == 1
    button(name="Cancel").click()
    for name in hostile.NAMES:
        page.get_by_label("Name", exact=True).fill(name)
        page.get_by_label("Name", exact=True).press("Enter")
        with page.expect_download() as download:
            button(name="Download").click()
        assert re.fullmatch(r"[\w-]{1,60}\.json", download.value.suggested_filename)
    page.evaluate("localStorage.clear(); location.hash = '#m=' + 'A'.repeat(1e5)")
    page.get_by_text("The address holds no material that can be read").wait_for()
    page.reload()
    stranger.ready()


def test_the_first_load_is_small(visit: Open, folder: Path, address: str, requests: list[str]) -> None:
    """Expected: all that is asked for until page and neighbouring states are ready, each file by its size in gzip."""
    here = visit()
    here.page.wait_for_timeout(1500)
    here.settled()
    names = {url.removeprefix(address).partition("?")[0] or "index.html" for url in requests if url.startswith(address)}
    sizes = {name: len(gzip.compress((folder / name).read_bytes())) for name in names}
    assert {"index.html", "editor.js", "data/session.pack"} < sizes.keys()
    assert sum(sizes.values()) < FIRST_LOAD


def test_what_needs_python_is_grey_and_says_why(visit: Open) -> None:
    here = visit()
    page = here.page
    for role, name in (("button", "Save"), ("button", "Save as"), ("tab", "Appearance"), ("tab", "Validations")):
        found = page.get_by_role(role, name=name, exact=True)
        assert found.is_disabled()
        assert "Python" in found.get_attribute("title")
    assert page.get_by_role("button", name="Roughness: take a texture").first.is_disabled()
    assert page.get_by_role("button", name="Add a film below the others").first.is_disabled()
    page.get_by_label("Compare", exact=True).select_option("split")
    truth = page.get_by_label("With", exact=True).locator("option[value=truth]")
    assert truth.get_attribute("disabled") is not None
    page.get_by_role("button", name="Open", exact=True).click()
    assert page.locator("dialog.open").get_by_text("Needs Python").count() == 2
    page.get_by_role("button", name="Cancel").click()
    # A third layer has not been written
    open_preset(here, "Coated rough metal")
    page.get_by_role("button", name="Interface", exact=True).click()
    page.get_by_text("So many layers need Python").wait_for()


def test_films_that_are_not_those_of_a_preset_are_refused_in_words(visit: Open, address: str, served: Server) -> None:
    there = visit(served.entrance)
    open_preset(there, "Gold")
    there.page.get_by_role("button", name="Add a film below the others").click()
    there.settled()
    here = visit(address)
    here.page.evaluate("(hash) => (location.hash = hash)", link(there))
    here.page.get_by_text("Films, and indices beside them, need Python: velatura edit.").first.wait_for()


def test_the_shader_that_is_exported_is_that_of_python(visit: Open) -> None:
    here = visit()
    open_preset(here, "Glossy plastic")
    choose_model(here, "belcour2018")
    roughen(here, 0, 80)
    here.page.get_by_role("button", name="Export", exact=True).click()
    text = here.page.locator("dialog.export textarea").input_value()
    wanted = vt.export(vt.preset("glossy-plastic").replace(layer0_alpha=0.4), "glsl", "belcour2018").text
    number = re.compile(r"(?<![\w.])\d+\.?\d*(?:e-?\d+)?")
    text, wanted = (re.sub("Velatura.*", "", each) for each in (text, wanted))  # the folder may be of yesterday
    assert number.sub("#", text.partition("\n")[2]) == number.sub("#", wanted.partition("\n")[2])
    found, expected = ([float(x) for x in number.findall(each)] for each in (text, wanted))
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_a_page_that_is_opened_as_a_file_says_what_to_do(opened: Any, folder: Path) -> None:
    """Expected: a sentence, since browsers load no modules from files."""
    page = opened.new_page()
    page.goto((folder / "index.html").as_uri())
    page.get_by_role("alert").get_by_text('Run "python -m http.server" in its folder').wait_for()
    page.close()
