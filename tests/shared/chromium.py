"""Headless Chromium as a machine that runs GLSL on arrays of numbers."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

# Programs of earlier pages are found again, which SwiftShader compiles in most of the time of a page. The features are
# those that Playwright turns off, whose list this one replaces, and a pop-up of the address bar, a page of its own
# beside each window.
FLAGS = (
    "--no-sandbox --disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--enable-unsafe-webgpu --use-webgpu-adapter=swiftshader --enable-angle-features=preferGlobalPipelineCache "
    "--disable-features=AvoidUnnecessaryBeforeUnloadCheckSync,DestroyProfileOnBrowserClose,HttpsUpgrades,"
    "HttpsFirstBalancedModeAutoEnable,LensOverlay,MediaRouter,PaintHolding,ThirdPartyStoragePartitioning,"
    "AvoidCorsURLLoaderRestartOnRedirect,OptimizationHints,NetworkTimeServiceQuerying,AimEnabled,PreconnectToSearch,"
    "WebUIOmniboxAimPopup"
)

# The first is without windows, toolbars and forms that are filled in, which take a third of the time of a test
COMMANDS = "chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"

PAGE = """
(job) => {
  const floats = (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl || !gl.getExtension('EXT_color_buffer_float')) throw new Error('no WebGL2 with float targets');

  // Compile
  const start = performance.now();
  const program = gl.createProgram();
  const corner = 'vec2(gl_VertexID & 1, gl_VertexID >> 1)';
  const texts = [
    [gl.VERTEX_SHADER, `#version 300 es\\nvoid main() { gl_Position = vec4(4.0 * ${corner} - 1.0, 0.0, 1.0); }`],
    [gl.FRAGMENT_SHADER, job.text],
  ];
  for (const [kind, text] of texts) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);

  // Bind
  const texture = (unit, width, height, data) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, data);
    for (const way of ['MIN', 'MAG']) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${way}_FILTER`], gl.NEAREST);
    return made;
  };
  job.textures.forEach(({ name, width, height, data }, unit) => {
    texture(unit, width, height, floats(data));
    gl.uniform1i(gl.getUniformLocation(program, name), unit);
  });
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
    const { name, type } = gl.getActiveUniform(program, i), values = job.uniforms[name];
    const set = { [gl.FLOAT]: 'uniform1fv', [gl.FLOAT_VEC3]: 'uniform3fv' }[type];
    if (set) gl[set](gl.getUniformLocation(program, name), values);
  }
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  const target = texture(job.textures.length, job.width, job.height, null);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, job.width, job.height);

  // Draw
  const linked = performance.now();
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const pixels = new Float32Array(4 * job.width * job.height);
  gl.readPixels(0, 0, job.width, job.height, gl.RGBA, gl.FLOAT, pixels);
  const drawn = performance.now();
  const bytes = new Uint8Array(pixels.buffer);
  let text = '';
  for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
  const error = gl.getError();
  gl.getExtension('WEBGL_lose_context').loseContext();
  return { pixels: btoa(text), linking: linked - start, drawing: drawn - linked, error };
}
"""


@dataclass(frozen=True)
class Drawn:
    """Pixels (height, width, 4), and how long it took to compile and to draw them (milliseconds)."""

    pixels: np.ndarray
    linking: float
    drawing: float


@dataclass(frozen=True)
class Browser:
    """A page that draws."""

    page: Any

    def draw(
        self,
        text: str,
        textures: Mapping[str, np.ndarray],
        width: int,
        height: int,
        uniforms: Mapping[str, Sequence[float]] | None = None,
    ) -> Drawn:
        """The floats that a fragment shader writes to a target.

        Args:
            text: GLSL ES 3.00 with its version.
            textures: float arrays (height, width, 4) by the name of the sampler.
            uniforms: numbers and triples, or arrays of numbers under the name of the first (`weights[0]`).
        """
        job = {
            "text": text,
            "textures": [
                {"name": name, "width": data.shape[1], "height": data.shape[0], "data": _text(data)}
                for name, data in textures.items()
            ],
            "uniforms": {name: list(values) for name, values in (uniforms or {}).items()},
            "width": width,
            "height": height,
        }
        found = self.page.evaluate(PAGE, job)
        assert found["error"] == 0
        pixels = np.frombuffer(base64.b64decode(found["pixels"]), np.float32).reshape(height, width, 4)
        return Drawn(pixels, found["linking"], found["drawing"])


def missing() -> str:
    """The tool that must be installed before anything can be drawn, or nothing."""
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return "Playwright is missing: pip install playwright"
    return "" if path() else "Chromium is missing: apt-get install -y chromium"


def path() -> str | None:
    return next(filter(None, map(shutil.which, COMMANDS)), None)


@contextmanager
def browser() -> Iterator[Browser]:
    """A page of Chromium for as long as the block runs."""
    with launched() as chromium:
        yield Browser(chromium.new_page())


@contextmanager
def launched() -> Iterator[Any]:
    """Chromium for as long as the block runs, or the one that is kept; pages that are opened there end with the block.

    Playwright cannot be started twice in a thread.
    """
    from playwright.sync_api import sync_playwright

    if _kept:
        (chromium,) = _kept
        before = chromium.contexts
        try:
            yield chromium
        finally:
            for context in chromium.contexts:
                if context not in before:
                    context.close()
        return
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path(), args=FLAGS.split())
        try:
            yield chromium
        finally:
            chromium.close()


@contextmanager
def kept() -> Iterator[None]:
    """One Chromium for all that is `launched` within the block."""
    with launched() as chromium:
        _kept.append(chromium)
        try:
            yield
        finally:
            _kept.remove(chromium)


_kept: list[Any] = []


def _text(data: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(data, np.float32).tobytes()).decode()
