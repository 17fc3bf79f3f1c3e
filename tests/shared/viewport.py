"""The editor's viewport alone on a page of headless Chromium, with Python answering its calls."""

from __future__ import annotations

import base64
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import chromium
import numpy as np

import velatura
from velatura.editor import messages, service, views
from velatura.model import DEFAULT
from velatura.scenes.views import DEFAULT_VIEW
from velatura.stack import Described

PAGE = Path(velatura.__file__).parent / "editor" / "page"
ESBUILD = PAGE / "node_modules" / ".bin" / "esbuild"

_ENTRY = """
export { Viewport } from './render/viewport.js';
export * from './render/environment.js';
export * from './render/load.js';
"""
_OPEN = """
(displayed) => {
  window.viewport = new page.Viewport(document.querySelector('canvas'), {
    call: (verb, body) => window.answer(verb, body),
    displayed,
    onError: (error) => console.error(error.stack),
  });
}
"""
_SHOW = """
async ([material, model, object, environment]) => {
  const { viewport } = window;
  viewport.setBudget({ samples: 0 });
  if (object) await viewport.setObject(object);
  if (environment) await viewport.setEnvironment(environment);
  const shader = await answer('shader', { material, model });
  await viewport.setMaterial('a', shader);
}
"""
_RADIANCE = """
() => {
  const { width, height, data } = viewport.radiance();
  let text = '';
  const bytes = new Uint8Array(data.buffer);
  for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
  return { width, height, data: btoa(text) };
}
"""


def missing() -> str:
    """The tool that must be installed first, or nothing."""
    if not ESBUILD.exists():
        return f"the page's packages are missing: npm ci in {PAGE}"
    return chromium.missing()


@dataclass
class Stage:
    """A page with one viewport; `errors` are what it has written to the console."""

    page: Any
    errors: list[str] = field(default_factory=list)

    def show(self, stack: Described, scene: str | None = None, env: str | None = None, model: str = DEFAULT) -> None:
        """Set a material, and the object and the light where they are others than before."""
        self.page.evaluate(_SHOW, [messages.document(stack), model, scene, env])

    def resize(self, width: int, height: int) -> None:
        """Change the picture's size in pixels."""
        self.page.evaluate("([width, height]) => viewport.setSize(width, height)", [width, height])

    def trace(self, samples: int, seconds: float = 1200.0) -> np.ndarray:
        """The linear picture (height, width, 3) after so many samples."""
        self.page.evaluate("(samples) => viewport.setBudget({ samples })", samples)
        end = time.monotonic() + seconds
        while self.page.evaluate("viewport.samples") < samples:
            assert time.monotonic() < end, f"fewer than {samples} samples in {seconds} s; {self.errors}"
            time.sleep(0.05)
        found = self.page.evaluate(_RADIANCE)
        data = np.frombuffer(base64.b64decode(found["data"]), np.float32)
        return data.reshape(found["height"], found["width"], 4)[..., :3].astype(float)


def script(entry: str) -> str:
    """Modules of the page bundled: what the text of an entry exports is in `page`."""
    options = ["--bundle", "--format=iife", "--global-name=page", "--log-level=warning"]
    made = subprocess.run([ESBUILD, *options], cwd=PAGE, input=entry, text=True, check=True, stdout=subprocess.PIPE)
    return made.stdout


@contextmanager
def stage(width: int, height: int, exports: str = "") -> Iterator[Stage]:
    """A stage of so many pixels, for as long as the block runs.

    `exports` are statements of JavaScript; what they export is in `page` as well.
    """
    with chromium.launched() as browser:
        opened = Stage(browser.new_page(viewport={"width": max(width, 200), "height": max(height, 200)}))
        page = opened.page
        page.on("pageerror", lambda error: opened.errors.append(str(error)))
        page.on("console", lambda line: opened.errors.append(line.text) if line.type == "error" else None)
        page.expose_function("answer", lambda verb, body: service.VERBS[verb](body))
        page.set_content(f"<canvas width={width} height={height} style='width:{width}px;height:{height}px'></canvas>")
        page.add_script_tag(content=script(_ENTRY + exports))
        page.evaluate(_OPEN, views.printed(DEFAULT_VIEW))
        yield opened


@dataclass(frozen=True)
class Comparison:
    """Root mean squares, relative to white: of the difference, and of the noise in either picture."""

    difference: float
    noise: float
    noise_of_truth: float
    pictures: tuple[np.ndarray, np.ndarray]


def compare(
    opened: Stage, stack: Described, scene: str, env: str, samples: int, spp: int, model: str = DEFAULT
) -> Comparison:
    """The page's still against Mitsuba's picture of the same: nothing is clipped, and all pixels count."""
    opened.show(stack, scene, env, model)
    return compared(opened, stack, scene, env, samples, spp, model)


def compared(
    opened: Stage, stack: Described, scene: str, env: str, samples: int, spp: int, model: str = DEFAULT
) -> Comparison:
    """Compare what is shown already, as `compare` does."""
    half = opened.trace(samples // 2)
    still = opened.trace(samples)
    size = still.shape[1], still.shape[0]
    truths = [velatura.render(stack, scene, env, spp // 2, size, model, seed, form="forward") for seed in (1, 2)]
    truth = (truths[0].astype(float) + truths[1]) / 2
    return Comparison(_rms(still - truth), _rms(still - half), _rms(truths[0] - truths[1]) / 2, (still, truth))


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
