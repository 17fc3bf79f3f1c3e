"""The manual as `make docs` has built it: its links, its weight, and its pages in Chromium, without a network."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import cache, partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import chromium
import pytest

ROOT = Path(__file__).parents[2]
SITE = ROOT / "site"
AXE = ROOT / "tests" / "page" / "node_modules" / "axe-core" / "axe.min.js"
PAGES = sorted(path for path in SITE.rglob("*.html") if path.relative_to(SITE).parts[0] not in ("try", "_static"))
KINDS = (
    "index.html",
    "explanation/films.html",
    "explanation/model.html",
    "explanation/primer.html",
    "gallery/films.html",
    "gallery/index.html",
    "how-to/in-mitsuba.html",
    "reference/api.html",
    "reference/api/velatura.render.html",
    "reference/materials.html",
    "reference/presets.html",
    "search.html",
    "tutorials/inverse-design.html",
)
PICTURES = {".png", ".jpg", ".webp", ".svg", ".gif"}
HEAVIEST = 20e6  # bytes of all pictures
FIRST = 3e6  # bytes that the first page loads, which a local server hands out in a small part of a second

pytestmark = pytest.mark.skipif(not PAGES, reason="the manual is not built: run `make docs`")
needs_chromium = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())


class Links(HTMLParser):
    """The links of a page, and the names in it that links may lead to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: set[str] = set()
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if value and (key in ("href", "src")):
                self.found.add(value)
            elif value and key in ("id", "name"):
                self.names.add(value)


@cache
def links(page: Path) -> Links:
    return Links(page.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Of a server of files, as Python's `http.server` is."""

    class Silent(SimpleHTTPRequestHandler):
        def log_message(self, *_: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Silent, directory=str(SITE))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def test_every_link_within_the_site_leads_somewhere() -> None:
    broken = []
    for page in PAGES:
        for link in links(page).found:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            if not target.is_file():
                broken.append(f"{page.relative_to(SITE)}: {link}")
            elif parts.fragment and target in PAGES and unquote(parts.fragment) not in links(target).names:
                broken.append(f"{page.relative_to(SITE)}: {link} has no such place")
    assert broken == []


def test_pictures_are_light() -> None:
    sizes = {path: path.stat().st_size for path in SITE.rglob("*") if path.suffix in PICTURES}
    assert sum(sizes.values()) < HEAVIEST, sorted(sizes, key=lambda path: -sizes[path])[:5]


@needs_chromium
def test_the_first_page_is_light(opened: Any, address: str) -> None:
    page = opened.new_page()
    sizes: dict[str, int] = {}
    page.on("requestfinished", lambda request: sizes.update({request.url: request.sizes()["responseBodySize"]}))
    page.goto(address, wait_until="networkidle")
    page.close()
    assert sum(sizes.values()) < FIRST, sorted(sizes.items(), key=lambda item: -item[1])[:5]


@needs_chromium
@pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed: run `make lint`")
@pytest.mark.parametrize("name", KINDS)
def test_a_page_is_accessible_and_asks_no_other_machine(opened: Any, address: str, name: str) -> None:
    """Expected: axe-core finds nothing serious, in the light and in the dark, the console has no errors, all requests
    go to the site, and every formula can be set."""
    context = opened.new_context(viewport={"width": 1300, "height": 900})
    page = context.new_page()
    asked, said = set(), []
    page.on("request", lambda request: asked.add(request.url))
    page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    page.emulate_media(color_scheme="light")
    page.goto(address + name, wait_until="networkidle")
    page.add_script_tag(path=AXE)
    worst = []
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        page.wait_for_function("(scheme) => document.documentElement.dataset.theme === scheme", arg=scheme)
        found = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
        worst += [(scheme, each) for each in found["violations"] if each["impact"] in ("serious", "critical")]
    formulas = page.locator("[data-mml-node='merror']").all_text_contents()
    context.close()
    found = [f"{scheme}: {each['id']}: {node['html'][:200]}" for scheme, each in worst for node in each["nodes"]]
    assert found == []
    assert [url for url in asked if not url.startswith((address, "data:", "blob:"))] == []
    assert said == [] and formulas == []
