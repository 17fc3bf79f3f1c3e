"""The editor as its users have it: a server of its own in a folder of its own, and pages in headless Chromium."""

from __future__ import annotations

import os
import re
import secrets
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar
from urllib.parse import urlsplit

import numpy as np

from velatura.editor import bundle, guard

_ADDRESS = re.compile(r"(http://127\.0\.0\.1:\d+/)\?token=[\w-]+")


class Server:
    """`velatura edit` in a folder; it can be killed, and started again at the same address with the same token.

    It prints its `entrance`, which leads to its `address`.
    """

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder = folder
        self.arguments = arguments
        self.address = self.entrance = ""
        self.token = secrets.token_urlsafe(32)
        self.start()

    def start(self) -> None:
        port = self.address.rstrip("/").rpartition(":")[2] or "0"
        command = [sys.executable, "-m", "velatura", "edit", *self.arguments, "--no-browser", "--port", port]
        environment = {**_environment(), guard.VARIABLE: self.token}
        self.process = subprocess.Popen(
            command, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
        )
        assert self.process.stdout
        line = self.process.stdout.readline()
        found = _ADDRESS.search(line)
        assert found, f"the editor's server says: {line}{self.process.stdout.read()}"
        self.entrance, self.address = found[0], found[1]

    def clear(self) -> None:
        """Remove all that lies in the folder."""
        for entry in self.folder.iterdir():
            if entry.is_dir():
                shutil.rmtree(entry)
            else:
                entry.unlink()

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate()


@contextmanager
def server(folder: Path, *arguments: str) -> Iterator[Server]:
    """A server for as long as the block runs; `arguments` of `velatura edit`."""
    require_fresh_page()
    running = Server(folder, *arguments)
    try:
        yield running
    finally:
        running.kill()


def require_fresh_page() -> None:
    """Fail, with the command that helps, where the page has changed since it was built."""
    built = bundle.STATIC / "editor.js"
    sources = [path for path in _sources() if not built.is_file() or path.stat().st_mtime > built.stat().st_mtime]
    assert not sources, f"{sources[0].name} is newer than the built page: cd {bundle.SOURCES} && npm run build"


def _sources() -> Iterator[Path]:
    for path in bundle.SOURCES.rglob("*"):
        if "node_modules" not in path.parts and path.suffix in (".js", ".css", ".html"):
            yield path


def _environment() -> dict[str, str]:
    source = str(Path(bundle.__file__).parents[2])
    return {**os.environ, "PYTHONPATH": source, "PYTHONUNBUFFERED": "1"}


# Parts of the page that are closed until they are wanted, open unless the visit has closed them
EVERYTHING_OPEN = """localStorage['velatura.layout'] ??=
  JSON.stringify({ form: 1, value: { look: true, view: true, model: true, expert: true } })"""


# Previews alone are drawn, from the first one on: a page that traces paths compiles their programs
PREVIEWS_ALONE = """Object.defineProperty(window, 'velatura', {
  configurable: true,
  set(app) {
    Object.defineProperty(window, 'velatura', { value: app });
    app.viewport.setBudget({ samples: 0 });
  },
})"""


# What a page writes last may else arrive after the next one, of another process, has cleared the storage
WRITES_NO_MORE = """() => {
  try { localStorage.clear(); } catch { /* a document without storage */ }
  Storage.prototype.setItem = () => {};
}"""


POLLING = 50  # milliseconds


class Visit:
    """A page of the editor, with what its console has complained about; a slow machine has its time."""

    open: ClassVar[list[Visit]] = []  # all that were begun

    def __init__(self, page: Any, address: str, script: str = "", fresh: bool = False) -> None:
        """`script` runs in each document of the visit before its own code does. What a `fresh` one finds in storage is
        forgotten by the page itself: its process keeps what was cleared from outside."""
        self.open.append(self)
        self.page = page
        page.set_default_timeout(90_000)  # clicks, too, wait for shaders that the processor compiles
        self.complaints: list[str] = []
        self._listeners = {"console": self._listen, "pageerror": lambda error: self.complaints.append(str(error))}
        for event, listener in self._listeners.items():
            page.on(event, listener)
        self._devtools = page.context.new_cdp_session(page)
        self._devtools.send("Page.enable")
        first = self._before(f"sessionStorage.clear();{'localStorage.clear()' if fresh else ''}")
        self._before(f"{script};{EVERYTHING_OPEN};{PREVIEWS_ALONE}")
        page.goto(address)
        self._devtools.send("Page.removeScriptToEvaluateOnNewDocument", first)
        self.ready()

    def _before(self, script: str) -> Any:
        return self._devtools.send("Page.addScriptToEvaluateOnNewDocument", {"source": script})

    def leave(self) -> None:
        """End the visit, and leave the page for another one."""
        if self.page.is_closed():
            return
        for event, listener in self._listeners.items():
            self.page.remove_listener(event, listener)
        self._devtools.detach()  # with all scripts
        self.page.evaluate(WRITES_NO_MORE)

    def _listen(self, message: Any) -> None:
        if message.type == "error":
            self.complaints.append(message.text)

    def ready(self) -> None:
        """Wait until there is a picture: the preview, which is the same every time."""
        self._wait_for("window.velatura?.viewport.slots.a.shader && velatura.viewport.previewed")

    def report(self) -> str:
        """The state of the page, for the report of a failed test."""
        if self.page.is_closed():
            return "closed"
        report = """({ quiet, problems, viewport, store, session }) => JSON.stringify({
          quiet, problems, held: viewport.held, previewed: viewport.previewed, samples: viewport.samples,
          focus: document.activeElement?.outerHTML.slice(0, 200), layers: store.get().layers, view: store.get().view,
        })"""
        state = self.page.evaluate(f"window.velatura ? ({report})(velatura) : location.href")
        return f"{state}\n{self.complaints}"

    def state(self, path: str = "") -> Any:
        """A part of the state: `state("layers.0.keys.alpha")`."""
        return self.page.evaluate(
            "(path) => path.split('.').filter(Boolean).reduce((o, key) => o[key], window.velatura.store.get())", path
        )

    def settled(self) -> None:
        """Wait until Python has been asked, has answered, and what it said is drawn."""
        self.page.wait_for_timeout(300)
        self._wait_for("velatura.quiet && !velatura.viewport.held && velatura.viewport.previewed")

    def _wait_for(self, condition: str) -> None:
        """Looks now and then, since a look in every frame makes the page compose frames."""
        self.page.wait_for_function(f"() => {condition}", polling=POLLING)

    def drop(self, *files: tuple[str, str | bytes], text: str = "") -> None:
        """Drop files, or text, on the picture."""
        given = [(name, list(data.encode() if isinstance(data, str) else data)) for name, data in files]
        self.page.evaluate(
            """([files, text]) => {
              const dataTransfer = new DataTransfer();
              for (const [name, bytes] of files) dataTransfer.items.add(new File([Uint8Array.from(bytes)], name));
              if (text) dataTransfer.setData('text/plain', text);
              const event = new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true });
              document.querySelector('canvas').dispatchEvent(event);
            }""",
            [given, text],
        )

    def picture(self) -> np.ndarray:
        """The canvas as it is now, (48, 64, 3), in 0..255."""
        self.settled()
        pixels = self.page.evaluate(
            """() => {
              const copy = Object.assign(document.createElement('canvas'), { width: 64, height: 48 });
              const context = copy.getContext('2d');
              window.velatura.viewport.paint();
              context.drawImage(window.velatura.canvas, 0, 0, 64, 48);
              return [...context.getImageData(0, 0, 64, 48).data];
            }"""
        )
        return np.reshape(pixels, (48, 64, 4))[..., :3].astype(float)


class Tabs:
    """Tabs of a browser without a past, for one test after another.

    The first tab of each test is the same, and need not be made; each page that it opens has a process of its own. Two
    pixels of the page, along both axes, are one of the screen, and of the picture.
    """

    def __init__(self, browser: Any, size: tuple[int, int] = (900, 600), **options: Any) -> None:
        self.context = browser.new_context(**{"device_scale_factor": 0.5, **options})
        self.size = size
        self.visits: list[Visit] = []

    def visit(
        self, address: str, script: str = "", size: tuple[int, int] | None = None, scheme: str = "light"
    ) -> Visit:
        """Open an address, in the kept tab unless this test has opened one already."""
        free = [] if self.visits else self.context.pages
        page = free[0] if free else self.context.new_page()
        width, height = size or self.size
        page.set_viewport_size({"width": width, "height": height})
        page.emulate_media(color_scheme=scheme)
        self.visits.append(Visit(page, address, script, fresh=not self.visits))
        return self.visits[-1]

    def forget(self) -> list[Visit]:
        """Close all tabs but one, and forget all; returns the visits that have ended."""
        ended, self.visits = self.visits, []
        for visit in ended:
            visit.leave()
        if pages := self.context.pages:
            kept, *others = pages
            origins = {f"{at.scheme}://{at.netloc}" for at in (urlsplit(page.url) for page in pages)}
            for page in others:
                page.close()
            kept.goto("about:blank")
            kept.mouse.move(0, 0)
            devtools = self.context.new_cdp_session(kept)
            for origin in origins:
                devtools.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": "all"})
            devtools.send("Network.clearBrowserCache")
            devtools.detach()
        self.context.clear_cookies()
        return ended


# At once, since the page may write its own value meanwhile
MOVE = "(slider, tick) => { slider.value = tick; slider.dispatchEvent(new Event('input', { bubbles: true })); }"


def drag(slider: Any, ticks: tuple[int, ...]) -> None:
    """Drag a slider over its ticks as a hand does: a change follows where it is let go."""
    for tick in ticks:
        slider.evaluate(MOVE, tick)
    slider.dispatch_event("change")


def difference(a: np.ndarray, b: np.ndarray) -> float:
    """The mean difference of two pictures."""
    return float(np.mean(np.abs(a - b)))


def unexpected(visits: Iterable[Visit], expected: Iterable[str]) -> list[str]:
    """Complaints of the consoles of pages, without messages that contain an expected text."""
    known = list(expected)
    return [text for found in visits for text in found.complaints if not any(part in text for part in known)]
