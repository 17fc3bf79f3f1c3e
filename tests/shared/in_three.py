"""Exported modules for three.js in headless Chromium, a ball each; and the same by samples of the model."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import chromium
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import map_coordinates, uniform_filter

import velatura as vt
from velatura.editor import bundle
from velatura.model import named
from velatura.model.base import Query
from velatura.model.side_by_side import SideBySide
from velatura.renderer.low_discrepancy import at_nodes
from velatura.stack import Material, MaterialLike

Array = NDArray[np.floating]

RADIUS = 0.98
EDGE = 0.999  # of the radius: nearer to the edge, interpolated normals of a mesh are not those of the sphere
ADDRESS = "https://engine.test/"  # pages without encryption have no WebGPU
Rectangle = tuple[float, float, tuple[float, float, float]]  # width, height and middle; shines at the origin with 1
SIZE, TILT = 24, 0.6  # of balls that are compared
PIXELS = [(12, 12), (8, 14), (5, 12), (15, 6)]
LAMP: Rectangle = (2.0, 1.2, (1.5, 1.2, 1.8))

_SCENE = """
async (job) => {
  const THREE = await import('%s');
  const { LayeredMaterial } = await import(job.module);
  // Each renderer blurs an environment once, for seconds
  const skies = (window.skies ??= new Map());
  if (!skies.has(job.sky)) {
    const floats = new Float32Array(Uint8Array.from(atob(job.sky), (letter) => letter.charCodeAt(0)).buffer);
    const sky = new THREE.DataTexture(floats, job.width, job.height, THREE.RGBAFormat, THREE.FloatType);
    sky.mapping = THREE.EquirectangularReflectionMapping;
    sky.minFilter = sky.magFilter = THREE.LinearFilter;
    sky.wrapS = THREE.RepeatWrapping;
    sky.needsUpdate = true;
    skies.set(job.sky, sky);
  }
  const scene = new THREE.Scene(), camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
  camera.position.z = 4;
  const material = new LayeredMaterial();
  const ball = new THREE.Mesh(new THREE.SphereGeometry(job.radius, 192, 96), material);
  ball.rotation.x = job.tilt;
  scene.add(ball);
  if (job.light) {
    const light = new THREE.DirectionalLight(0xffffff, 1);
    light.position.set(...job.light);
    scene.add(light);
  } else if (job.rectangle) {
    const light = new THREE.RectAreaLight(0xffffff, 1, job.rectangle[0], job.rectangle[1]);
    if (THREE.RectAreaLightNode) {
      const { RectAreaLightTexturesLib } = await import('/examples/jsm/lights/RectAreaLightTexturesLib.js');
      THREE.RectAreaLightNode.setLTC(RectAreaLightTexturesLib.init());
    }
    light.position.set(...job.rectangle[2]);
    light.lookAt(0, 0, 0);
    scene.add(light);
  } else scene.environment = skies.get(job.sky);
  const complaints = [];
%s  let text = '';
  const bytes = new Uint8Array(pixels.buffer);
  for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
  return { pixels: btoa(text), complaints, revision: THREE.REVISION };
}
"""

DRAW = _SCENE % (
    "three",
    """\
  const renderer = (window.renderer ??= new THREE.WebGLRenderer({ canvas: document.createElement('canvas') }));
  renderer.debug.onShaderError = (gl, program, vertex, fragment) =>
    complaints.push(gl.getShaderInfoLog(vertex), gl.getShaderInfoLog(fragment), gl.getProgramInfoLog(program));
  const target = new THREE.WebGLRenderTarget(job.size, job.size, { type: THREE.FloatType });
  renderer.setRenderTarget(target);
  renderer.setClearColor(0, 0);
  renderer.render(scene, camera);
  const pixels = new Float32Array(4 * job.size * job.size);
  renderer.readRenderTargetPixels(target, 0, 0, job.size, job.size, pixels);
""",
)

# Its rows come from the top
DRAW_BY_WEBGPU = _SCENE % (
    "three/webgpu",
    """\
  const renderer = (window.renderer ??= new THREE.WebGPURenderer({ canvas: document.createElement('canvas') }));
  await renderer.init();
  if (!renderer.backend.isWebGPUBackend) throw new Error('no WebGPU');
  renderer.backend.device.onuncapturederror = ({ error }) => complaints.push(error.message);
  THREE.setConsoleFunction((kind, ...parts) => complaints.push(parts.join(' ')));
  const target = new THREE.RenderTarget(job.size, job.size, { type: THREE.FloatType });
  renderer.setRenderTarget(target);
  renderer.setClearColor(0, 0);
  renderer.render(scene, camera);
  const found = await renderer.readRenderTargetPixelsAsync(target, 0, 0, job.size, job.size);
  const rows = Array.from({ length: job.size }, (_, k) => found.subarray(4 * job.size * k, 4 * job.size * (k + 1)));
  const pixels = Float32Array.from(rows.reverse().flatMap((row) => [...row]));
""",
)


# Chromium presents no canvas of WebGPU without a GPU: a texture in place of each, and shown(), its address of data;
# frames wait for the one before, as a display has them wait
KEEP = """
const next = window.requestAnimationFrame;
navigator.gpu.getPreferredCanvasFormat = () => 'rgba8unorm';
Object.assign(GPUCanvasContext.prototype, {
  configure({ device, format }) {
    const { width, height } = this.canvas, usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC;
    const texture = device.createTexture({ size: [width, height], format, usage });
    const bytesPerRow = 256 * Math.ceil(width / 64);
    window.requestAnimationFrame = (draw) => void device.queue.onSubmittedWorkDone().then(() => next(draw));
    this.getCurrentTexture = () => {
      window.shown = async () => {
        const usage = GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ;
        const buffer = device.createBuffer({ size: bytesPerRow * height, usage });
        const encoder = device.createCommandEncoder();
        encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow }, [width, height]);
        device.queue.submit([encoder.finish()]);
        await buffer.mapAsync(GPUMapMode.READ);
        const pixels = new Uint8ClampedArray(buffer.getMappedRange());
        const canvas = Object.assign(document.createElement('canvas'), { width, height });
        canvas.getContext('2d').putImageData(new ImageData(pixels, bytesPerRow / 4), 0, 0);
        return canvas.toDataURL();
      };
      return texture;
    };
  },
});
"""


@dataclass(frozen=True)
class Engine:
    """An engine: the folder of its package, the address in place of which it is served, a page with it, and a function
    that draws a ball there; a script that keeps what canvases show, where no screenshot has it; and how far its
    panoramas begin from those of three.js, in turns."""

    folder: Path
    network: str
    page: str
    draw: str
    keep: str = ""
    turned: float = 0


@dataclass(frozen=True)
class Stage:
    """A page with an engine, in which balls are drawn."""

    page: Any
    engine: Engine
    files: dict[str, str | bytes]

    def ball(
        self,
        module: str,
        sky: Array,
        size: int = 96,
        light: tuple[float, float, float] | None = None,
        tilt: float = 0.0,
        rectangle: Rectangle | None = None,
    ) -> Array:
        """A ball, linear colours and coverage (size, size, 4), from the top.

        Args:
            module: text of an export.
            sky: environment (height, width, 3), from the top, y up, in three.js's coordinates.
            light: direction of a light in place of the environment.
            rectangle: a light in place of the environment.
        """
        name = f"{len(self.files)}.js"
        sky = np.roll(sky, int(self.engine.turned * sky.shape[1]), axis=1)
        self.files.update({name: module, "sky.hdr": radiance(sky)})
        rgba = np.pad(sky[::-1], ((0, 0), (0, 0), (0, 1)), constant_values=1).astype("<f4")
        found = self.page.evaluate(
            self.engine.draw,
            {
                "module": f"/{name}",
                "sky": base64.b64encode(rgba.tobytes()).decode(),
                "width": sky.shape[1],
                "height": sky.shape[0],
                "size": size,
                "radius": RADIUS,
                "light": light,
                "tilt": tilt,
                "rectangle": rectangle,
            },
        )
        assert not found["complaints"], "\n".join(filter(None, found["complaints"]))
        pixels = np.frombuffer(base64.b64decode(found["pixels"]), np.float32).reshape(size, size, 4)
        return pixels[::-1]

    def visit(
        self, name: str, size: int = 64, ready: str = "document.querySelector('canvas')"
    ) -> tuple[Array, list[str]]:
        """A page of the files two frames after it is ready, sRGB from 0 to 255 (size, size, 3), and errors and warnings
        of its console."""
        page, said = self.page.context.browser.new_page(), list[str]()

        def listen(message: Any) -> None:
            if (
                message.type in ("error", "warning") and "GPU stall" not in message.text
            ):  # which drivers say of the screenshot
                said.append(message.text)

        page.on("console", listen)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.set_viewport_size({"width": size, "height": size})
        page.add_init_script(self.engine.keep)
        self.serve(page)
        page.goto(ADDRESS + name)
        page.wait_for_function(ready)
        page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        kept = page.evaluate("shown()").partition(",")[2] if self.engine.keep else ""
        shot = base64.b64decode(kept) if kept else page.screenshot()
        page.close()
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")), said

    def serve(self, page: Any) -> None:
        """Give a page the files, and the engine in place of the network."""

        def answer(route: Any) -> None:
            name = re.sub(rf"^{ADDRESS}|^{self.engine.network}", "", route.request.url)
            path = self.engine.folder / name
            kind = "text/html" if name.endswith("html") else "text/javascript"
            if name in self.files:
                route.fulfill(body=self.files[name], content_type=kind)
            elif path.is_file():
                route.fulfill(body=path.read_text(encoding="utf-8"), content_type=kind)
            else:
                route.fulfill(status=404, body="")

        page.route("**", answer)


THREE = Engine(
    bundle.SOURCES / "node_modules" / "three",
    "https://unpkg.com/three@[0-9.]+/",
    """<!doctype html><script type="importmap">{"imports": {"three": "/build/three.module.js"}}</script>""",
    DRAW,
)


WEBGPU = Engine(
    THREE.folder,
    THREE.network,
    """<!doctype html><script type="importmap">{"imports": {"three": "/build/three.webgpu.js",
    "three/webgpu": "/build/three.webgpu.js", "three/tsl": "/build/three.tsl.js"}}</script>""",
    DRAW_BY_WEBGPU,
    KEEP,
)


@contextmanager
def stage(engine: Engine = THREE) -> Iterator[Stage]:
    """A page for as long as the block runs."""
    with chromium.browser() as browser:
        opened = Stage(browser.page, engine, {"index.html": engine.page})
        opened.serve(browser.page)
        browser.page.goto(f"{ADDRESS}index.html")
        yield opened


def softbox(width: int = 64) -> Array:
    """A bright, coloured window over a gradient, (width / 2, width, 3)."""
    row, column = np.mgrid[: width // 2, :width] / width
    window = np.exp(-(((column - 0.7) / 0.06) ** 2) - ((row - 0.13) / 0.06) ** 2)
    return np.asarray((0.1 + 0.4 * (0.5 - row))[..., None] + 6 * window[..., None] * [1, 0.8, 0.5], np.float32)


def frame_at(row: int, column: int, size: int) -> Array:
    """Tangent, bitangent and normal of the ball at a pixel, in rows; x to the right, y up, z towards the viewer."""
    x, y = ((np.array([column, row]) + 0.5) / size * 2 - 1) * [1, -1] / RADIUS
    n = np.array([x, y, np.sqrt(1 - x * x - y * y)])
    t = np.cross([0, 1, 0], n)
    return np.stack([t / np.linalg.norm(t), np.cross(n, t) / np.linalg.norm(t), n])


def body_of(material: MaterialLike) -> SideBySide:
    """The default model of a material."""
    return SideBySide.of([(1, Material.of(vt.load(material)))], named("velatura"))


@cache
def exported(material: str | vt.Stack, to: str) -> str:
    """A module for an engine; what it reads of environments takes seconds to work out."""
    return vt.export(material, to).text


def by_the_model(material: MaterialLike, light: Array, pixels: Sequence[tuple[int, int]], size: int) -> Array:
    """Values of the model (pixels, 3) at rows and columns of the ball, for light from a direction."""
    body = body_of(material)
    frames = [frame_at(row, column, size) for row, column in pixels]
    values = (body.eval_pdf(tuple(frame[:, 2, None]), tuple((frame @ light)[:, None]))[0] for frame in frames)
    return np.array([np.ravel(value) for value in values])


def by_rectangle(
    material: MaterialLike, rectangle: Rectangle, pixels: Sequence[tuple[int, int]], size: int, count: int = 128
) -> Array:
    """Light of the model (pixels, 3) at rows and columns of the ball, by `count` squared points of a rectangle."""
    body = body_of(material)
    width, height, middle = rectangle
    n = -np.array(middle) / np.linalg.norm(middle)
    u = np.cross([0, 1, 0], n)
    u /= np.linalg.norm(u)
    at = (np.arange(count) + 0.5) / count - 0.5
    points = middle + width * at[:, None, None] * u + height * at[:, None] * np.cross(n, u)
    found = []
    for row, column in pixels:
        frame = frame_at(row, column, size)
        way = points.reshape(-1, 3) - RADIUS * frame[2]
        distance = np.linalg.norm(way, axis=1)
        wo = way / distance[:, None]
        solid = np.maximum(-wo @ n, 0) / distance**2 * width * height / count**2
        value = body.eval_pdf(tuple(frame[:, 2, None]), tuple(frame @ wo.T))[0]
        found.append((np.broadcast_to(value, (3, len(way))) * solid).sum(axis=1))
    return np.array(found)


def missed_by_rectangle(stage: Stage, material: str | vt.Stack, to: str) -> float:
    """How far a ball under `LAMP`, by a module of a format, is from the model, as `matched` has it."""
    found = stage.ball(exported(material, to), softbox(), SIZE, rectangle=LAMP)
    places = [(row, column) for row in range(1, SIZE, 2) for column in range(1, SIZE, 2)]
    pixels = [place for place in places if np.hypot(*np.subtract(place, (SIZE - 1) / 2)) < 0.95 * RADIUS * SIZE / 2]
    expected = np.pad(by_rectangle(material, LAMP, pixels, SIZE), ((0, 0), (0, 1)), constant_values=1)
    return matched(expected, np.array([found[place] for place in pixels]))


def missed_by_environment(stage: Stage, material: str | vt.Stack, to: str, samples: int) -> float:
    """The same under `softbox`, by means of so many samples for each pixel."""
    sky = softbox()
    [expected] = sampled(material, [sky], SIZE, samples, TILT)
    return matched(expected, stage.ball(exported(material, to), sky, SIZE, tilt=TILT))


def meets_light(stage: Stage, material: str | vt.Stack, to: str, towards: tuple[float, float, float]) -> None:
    """Fails if pixels of a ball under a light are not values in NumPy, within 5 % in a highlight on a mesh, with texels
    in half precision; a light of intensity 1 has irradiance 1 for a surface that faces it."""
    light = np.array(towards) / np.linalg.norm(towards)
    found = stage.ball(exported(material, to), softbox(), SIZE, light=tuple(light))
    expected = by_the_model(material, light, PIXELS, SIZE)
    assert expected.max() > 0.01
    np.testing.assert_allclose([found[row, column, :3] for row, column in PIXELS], expected, rtol=0.05, atol=1e-3)


def manual_page(number: int) -> str:
    """A page of HTML that the manual prints for engines, by its number there."""
    manual = Path(__file__).parents[2] / "docs" / "how-to" / "in-my-engine.md"
    pages: list[str] = re.findall(r"```html\n(.*?)```", manual.read_text(encoding="utf-8"), re.DOTALL)
    assert len(pages) == 3
    return pages[number]


def radiance(sky: Array) -> bytes:
    """An environment as a file of Radiance, with one exponent a texel (Ward 1991)."""
    exponent = np.frexp(np.maximum(sky.max(axis=-1), 1e-30))[1]
    bytes_ = np.concatenate([sky * 256 / np.ldexp(1.0, exponent)[..., None], exponent[..., None] + 128.0], axis=-1)
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {sky.shape[0]} +X {sky.shape[1]}\n"
    return head.encode() + bytes_.astype(np.uint8).tobytes()


def sampled(material: MaterialLike, skies: Sequence[Array], size: int, samples: int, tilt: float = 0.0) -> list[Array]:
    """The same ball but for its `EDGE`, under each of some environments, by means of so many samples of the model for
    each pixel, in NumPy."""
    across = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = across / RADIUS, -across[:, None] / RADIUS
    inside = x**2 + y**2 < EDGE**2
    x, y = np.broadcast_to(x, inside.shape)[inside], np.broadcast_to(y, inside.shape)[inside]
    n = np.stack([x, y, np.sqrt(1 - x**2 - y**2)])

    # The frame of the sphere: its tangent lies along its circles of latitude
    up = np.array([0, np.cos(tilt), np.sin(tilt)])
    t = np.cross(up, n, axisb=0).T
    t /= np.maximum(np.linalg.norm(t, axis=0), 1e-9)
    frame = np.stack([t, np.cross(n, t, axis=0), n])
    count = n.shape[1]
    generator = np.random.default_rng(5)
    u, u1, u2 = (generator.random((3, count, 1)) + np.array(at_nodes(1, samples))[:, None]) % 1
    wi = tuple(np.repeat(frame[:, 2], samples, axis=1))
    body = body_of(material)
    asked = Query(radiance=False)
    wo = np.array(np.broadcast_arrays(*body.sample(wi, u.ravel(), u1.ravel(), u2.ravel(), asked)))
    own = np.einsum("kan,kns->ans", frame, wo.reshape(3, count, samples))

    def evaluated(w: Array) -> tuple[Array, Array]:
        """Values (3, count, samples) and densities of directions in the world."""
        x, y, z = np.einsum("kan,ans->kns", frame, w).reshape(3, -1)
        value, density = body.eval_pdf(wi, (x, y, z), asked)
        value = np.broadcast_to(value, (3, count * samples)).reshape(3, count, -1)
        return value, np.reshape(density, (count, -1))

    of_own = evaluated(own)
    pictures: list[Array] = []
    for sky in skies:
        lights = _towards_lights(sky, (count, samples), generator)
        drawn = np.concatenate([own, lights], axis=-1)
        value, density = (np.concatenate(each, axis=-1) for each in zip(of_own, evaluated(lights)))
        # The balance heuristic (Veach and Guibas 1995, Eq. 14)
        density = density + _density_of_lights(sky, drawn)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0) / samples
        picture = np.zeros((size, size, 4))
        picture[inside] = np.concatenate([(weight * looked_up(sky, drawn)).sum(axis=-1), np.ones((1, count))]).T
        pictures.append(picture)
    return pictures


def _shares(sky: Array) -> Array:
    """Share of each texel in an environment's light, with a tenth that goes to all directions alike."""
    size = np.cos((0.5 - (np.arange(sky.shape[0]) + 0.5) / sky.shape[0]) * np.pi)[:, None] * np.ones(sky.shape[1])
    light = uniform_filter(sky.mean(axis=-1), 3, mode=("nearest", "wrap")) * size  # texels are interpolated
    return np.asarray(0.9 * light / light.sum() + 0.1 * size / size.sum())


def _towards_lights(sky: Array, shape: tuple[int, int], generator: np.random.Generator) -> Array:
    """Directions (3, *shape) by the light of an environment's texels, stratified along the last axis."""
    height, width, _ = sky.shape
    strata = (np.arange(shape[1]) + generator.random(shape)) / shape[1]
    texel = np.minimum(np.searchsorted(np.cumsum(_shares(sky)), strata), height * width - 1)
    row, column = np.divmod(texel, width)
    phi = ((column + generator.random(shape)) / width - 0.5) * 2 * np.pi
    edges = np.cos(np.arange(height + 1) * np.pi / height)
    y = edges[row] + generator.random(shape) * (edges[row + 1] - edges[row])
    across = np.sqrt(1 - y * y)
    return np.stack([across * np.cos(phi), y, across * np.sin(phi)])


def _density_of_lights(sky: Array, w: Array) -> Array:
    """Density of `_towards_lights` over solid angle."""
    height, width, _ = sky.shape
    column = ((np.arctan2(w[2], w[0]) / (2 * np.pi) + 0.5) * width).astype(int) % width
    row = np.minimum((np.arccos(np.clip(w[1], -1, 1)) / np.pi * height).astype(int), height - 1)
    edges = np.cos(np.arange(height + 1) * np.pi / height)
    solid = (edges[:-1] - edges[1:]) * 2 * np.pi / width
    return np.asarray(_shares(sky)[row, column] / solid[row])


def looked_up(sky: Array, w: Array) -> Array:
    """Radiance (3, ...) of an environment in directions, as three.js reads it."""
    height, width, _ = sky.shape
    column = (np.arctan2(w[2], w[0]) / (2 * np.pi) + 0.5) * width - 0.5
    row = (0.5 - np.arcsin(np.clip(w[1], -1, 1)) / np.pi) * height - 0.5
    channels = [
        map_coordinates(c, [np.clip(row, 0, height - 1), column], order=1, mode="grid-wrap")
        for c in np.moveaxis(sky, -1, 0)
    ]
    return np.stack(channels)


def matched(truth: Array, found: Array) -> float:
    """Root mean square of the difference of two pictures as displays have them, sRGB from 0 to 1, over pixels that both
    cover; the exposure brings the mean of the first to .25."""
    inside = (truth[..., 3] > 0) & (found[..., 3] > 0)
    scale = 0.25 / truth[inside, :3].mean()

    def shown(picture: Array) -> Array:
        x = np.clip(picture[inside, :3] * scale, 0, 1)
        return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)

    return float(np.sqrt(np.mean((shown(truth) - shown(found)) ** 2)))
