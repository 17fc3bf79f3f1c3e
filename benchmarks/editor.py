"""The editor's viewport: its stills against Mitsuba's, and what it costs (SwiftShader, so run it on a quiet machine).

Stills: root mean square of the difference in linear radiance relative to white, beside the noise of either picture.
Times: to a first picture, and of a sample; and of a frame beside one of three.js with MeshPhysicalMaterial and
clearcoat, by turns. Dragging: frames with new values, by turns with those of a model that is not solved.
Adding: from a click to the picture with one more layer, at once in a new page of a new server, and a while later.

    python benchmarks/editor.py [--size 96] [--samples 1024] [--spp 2560] [--only stills|times|dragging|adding]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
import editor
import viewport
from rows import parsed, row

import velatura as vt
from velatura.editor import messages

STILLS = (  # and how many pixels along either axis become one of as many more samples, where light is noisy
    ("coated-gold", "ball", 1),
    ("turned-brushing", "ball", 1),
    ("glossy-plastic", "ball", 1),
    ("frosted-metal", "sphere", 1),
    ("frosted-glass", "sphere", 4),
)

ADDED_TO = (
    "bare-gold",
    "wet-copper",
    "coated-gold",
    "frosted-glass",
    "three-dielectrics-over-metal",
    "pearl-lacquer",
    "furnace",
)

DRAGGED = (("turned-brushing", 0), ("coated-gold", 0), ("wet-copper", 0), ("frosted-metal", 1), ("frosted-glass", 0))
TURNS = 3

FORESEEN = 5000  # milliseconds without input, so that the page gets ready for one more layer

THREE = "export * as three from 'three';"
FIRST = """
async (material) => {
  const start = performance.now();
  await viewport.setObject('ball');
  await viewport.setEnvironment('studio');
  const shader = await answer('shader', { material });
  await viewport.setMaterial('a', shader);
  while (!viewport.schedule.frames.length) await new Promise((resolve) => setTimeout(resolve, 5));
  return performance.now() - start;
}
"""
ADD = """
async (kind) => {
  const { viewport } = velatura, { key } = viewport.slots.a.shader, start = performance.now();
  document.querySelector(`[data-add=${kind}]`).click();
  while (viewport.slots.a.shader.key === key) await new Promise((resolve) => setTimeout(resolve, 2));
  viewport.schedule.frames = [];
  while (!viewport.schedule.frames.length) await new Promise((resolve) => setTimeout(resolve, 2));
  return (viewport.schedule.frames[0] - start) / 1000;
}
"""
DRAG = """
async ([index, seconds]) => {
  const { store, viewport } = velatura;
  const set = (state, alpha) => {
    const layers = state.layers.map((layer, i) => (i === index ? { ...layer, keys: { ...layer.keys, alpha } } : layer));
    return { ...state, layers };
  };
  viewport.moving(true);
  viewport.schedule.frames = [];
  const begin = performance.now();
  for (let k = 0; performance.now() < begin + 1000 * seconds; k++) {
    store.drag('roughness', set, 0.05 + 0.3 * ((k % 50) / 50));
    await new Promise((resolve) => requestAnimationFrame(resolve));
  }
  const frames = viewport.schedule.frames.length / seconds;
  store.release();
  viewport.moving(false);
  return frames;
}
"""
MODEL = """
(model) => velatura.store.run(Object.assign((state) => ({ ...state, model }), { title: 'the model' }))
"""
SAMPLE = """
async () => {
  viewport.setBudget({ samples: 4 });
  while (viewport.samples < 1) await new Promise((resolve) => setTimeout(resolve, 5));
  const start = performance.now();
  while (viewport.samples < 4) await new Promise((resolve) => setTimeout(resolve, 5));
  return (performance.now() - start) / 3;
}
"""

BESIDE = """
async (material) => {
  const { three } = page, { sources, device, canvas, camera } = viewport, { gl } = device;
  viewport.setBudget({ samples: 0 });
  await viewport.setMaterial('a', await answer('shader', { material }));
  while (!viewport.previewed) await new Promise((resolve) => setTimeout(resolve, 20));
  await device.done();

  // The same object in the same light
  const other = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
  const renderer = new three.WebGLRenderer({ canvas: other, antialias: false });
  const stage = new three.Scene();
  const { width, height, blurred } = sources.environment;
  const light = new three.DataTexture(blurred, width, height, three.RGBAFormat, three.FloatType);
  light.mapping = three.EquirectangularReflectionMapping;
  light.needsUpdate = true;
  stage.environment = stage.background = new three.PMREMGenerator(renderer).fromEquirectangular(light).texture;
  const coated = { color: 0xffb040, metalness: 1, clearcoat: 1, clearcoatRoughness: 0.05 };
  const surface = new three.MeshPhysicalMaterial(coated);
  for (const { role, positions, normals, uv, triangles } of sources.parts) {
    if (role === 'ground') continue;
    const geometry = new three.BufferGeometry();
    geometry.setAttribute('position', new three.BufferAttribute(positions, 3));
    geometry.setAttribute('normal', new three.BufferAttribute(normals, 3));
    geometry.setAttribute('uv', new three.BufferAttribute(uv, 2));
    geometry.setIndex(new three.BufferAttribute(triangles, 1));
    stage.add(new three.Mesh(geometry, role === 'object' ? surface : new three.MeshStandardMaterial()));
  }
  const eye = new three.PerspectiveCamera(camera.fov, width / height, 0.1, 100);
  eye.aspect = canvas.width / canvas.height;
  eye.updateProjectionMatrix();
  eye.position.set(...camera.origin);
  eye.lookAt(...camera.target);

  // Frames by turns
  const pixel = new Uint8Array(4);
  const timed = (gl, draw) => {
    const start = performance.now();
    draw();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return performance.now() - start;
  };
  const slot = viewport.slots.a, { contents } = slot, uniforms = viewport.uniforms();
  const ours = (block, alpha) => () => {
    slot.setContents({ ...contents, values: { ...contents.values, layer0_alpha_u: alpha, layer0_alpha_v: alpha } });
    slot.drawPreview(viewport.gbuffer, uniforms, block);
    viewport.paint();
  };
  const theirs = (roughness) => () => {
    surface.roughness = roughness;
    renderer.render(stage, eye);
  };
  const found = { fine: [], quick: [], theirs: [] };
  for (let k = 0; k < 24; k++) {
    const roughness = 0.1 + 0.01 * k;
    found.fine.push(timed(gl, ours(1, roughness)));
    found.quick.push(timed(gl, ours(2, roughness)));
    found.theirs.push(timed(renderer.getContext(), theirs(roughness)));
  }
  const ratio = (name) => found[name].map((time, k) => time / found.theirs[k]).slice(4).sort((a, b) => a - b)[10];
  const middle = (name) => found[name].slice(4).sort((a, b) => a - b)[10];
  renderer.dispose();
  return { fine: ratio('fine'), quick: ratio('quick'), times: ['fine', 'quick', 'theirs'].map(middle) };
}
"""


def stills(size: int, samples: int, spp: int) -> None:
    for preset, scene, fewer in STILLS:
        with viewport.stage(size // fewer, size // fewer) as opened:
            more = fewer * fewer
            found = viewport.compare(opened, vt.preset(preset), scene, "studio", more * samples, more * spp)
            print(
                f"{preset:26} {scene:8} difference {found.difference:.4f}  noise {found.noise:.4f}, "
                f"of Mitsuba {found.noise_of_truth:.4f}",
                flush=True,
            )


def times() -> None:
    with viewport.stage(640, 360, THREE) as opened:
        page = opened.page
        page.evaluate("viewport.setBudget({ samples: 0 })")
        two = messages.document(vt.preset("coated-gold"))
        row("editor", "first picture", page.evaluate(FIRST, two) / 1e3)
        row("editor", "a sample at 640 x 360", page.evaluate(SAMPLE) / 1e3)
        found = page.evaluate(BESIDE, two)
        fine, quick, theirs = found["times"]
        theirs_too = f"{theirs:.0f} ms of MeshPhysicalMaterial"
        row("frame", "a solved material", fine, "ms", f"{found['fine']:.2f} times the {theirs_too}")
        row("frame", "in fewer pixels, as while dragging", quick, "ms", f"{found['quick']:.2f} times the {theirs_too}")


def dragging(browser: Any) -> None:
    for preset, layer in DRAGGED:
        with tempfile.TemporaryDirectory() as folder, editor.server(Path(folder), preset) as server:
            page = editor.Visit(browser.new_page(viewport={"width": 1280, "height": 720}), server.entrance)
            found: dict[str, list[float]] = {"velatura": [], "belcour2018": []}
            for model in [*found] * TURNS:
                page.page.evaluate(MODEL, model)
                page.page.wait_for_timeout(1000)
                page.settled()
                found[model].append(page.page.evaluate(DRAG, [layer, 3]))
            page.page.close()
        for model, rates in found.items():
            row("dragging", f"a roughness of {preset}, layer {layer}, {model}", rates, "frames/s")


def adding(browser: Any) -> None:
    found: dict[bool, list[float]] = {False: [], True: []}
    for preset in ADDED_TO:
        for kind in ("interface", "medium", "diffuse"):
            if kind == "diffuse" and (preset == "bare-gold" or vt.preset(preset).kinds[-1] == kind):
                continue
            for foreseen, times in found.items():
                with tempfile.TemporaryDirectory() as folder, editor.server(Path(folder), preset) as server:
                    page = editor.Visit(browser.new_page(viewport={"width": 1280, "height": 720}), server.entrance)
                    page.settled()
                    if foreseen:
                        page.page.evaluate("velatura.viewport.setBudget({ samples: 1 })")
                        page.page.wait_for_timeout(FORESEEN)
                    times.append(page.page.evaluate(ADD, kind))
                    page.page.close()
            print(f"{kind:10} {preset:30} {found[False][-1]:.2f} s at once, {found[True][-1]:.2f} s later", flush=True)
    for foreseen, times in found.items():
        when = f"{FORESEEN / 1000:.0f} s later" if foreseen else "at once"
        row("adding", f"a layer {when}", times, remark=f"at most {max(times):.2f} s")


def main() -> None:
    arguments = parsed(
        __doc__, size=96, samples=1024, spp=2560, only=(str, "", ("stills", "times", "dragging", "adding"))
    )
    if why := viewport.missing():
        print(f"skipped: {why}")
        return
    if arguments.only in (None, "times"):
        times()
    for name, measure in (("dragging", dragging), ("adding", adding)):
        if arguments.only in (None, name):
            with chromium.launched() as browser:
                measure(browser)
    if arguments.only in (None, "stills"):
        stills(arguments.size, arguments.samples, arguments.spp)


if __name__ == "__main__":
    main()
