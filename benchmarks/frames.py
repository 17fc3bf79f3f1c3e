"""Frames of three.js with materials of `--to three`, against frames with its MeshPhysicalMaterial.

A page in headless Chromium, on the processor (SwiftShader), draws four balls under a prefiltered environment by one
material after the other, round by round. Prints, for each preset, the processor time of the browser's processes over
that by the engine's own material in the same round: plain, and as `--to gltf` bakes the preset into it, with the
clearcoat, anisotropy, iridescence or transmission that it takes there. Needs psutil.

    python benchmarks/frames.py [--presets bare-gold,coated-gold,...] [--rounds 9] [--frames 4] [--size 440]
"""

from __future__ import annotations

import base64
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from rows import parsed, row

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
import in_three

import velatura as vt

PRESETS = "bare-gold,car-paint,varnished-paint,wet-copper,anodised-titanium,coated-gold,frosted-glass"

STAGE = """
async (job) => {
  const THREE = await import('three');
  const renderer = new THREE.WebGLRenderer({ canvas: document.createElement('canvas') });
  renderer.setSize(job.size, job.size);
  const floats = new Float32Array(4 * 64 * 32).map((_, i) => 0.2 + 0.8 * ((i >> 4) % 7) / 6);
  const sky = new THREE.DataTexture(floats, 64, 32, THREE.RGBAFormat, THREE.FloatType);
  sky.mapping = THREE.EquirectangularReflectionMapping;
  sky.needsUpdate = true;
  const scene = new THREE.Scene(), camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
  scene.environment = sky;
  camera.position.z = 4;
  const geometry = new THREE.SphereGeometry(0.49, 64, 32);
  const balls = [[-1, -1], [-1, 1], [1, -1], [1, 1]].map(([x, y]) => {
    const ball = new THREE.Mesh(geometry);
    ball.position.set(x / 2, y / 2, 0);
    scene.add(ball);
    return ball;
  });
  const { GLTFLoader } = await import('/examples/jsm/loaders/GLTFLoader.js');
  const materials = [new THREE.MeshPhysicalMaterial({ color: 0xffc070, metalness: 1, roughness: 0.4 })];
  for (const text of job.baked) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const { scene } = await new GLTFLoader().parseAsync(bytes.buffer, '');
    scene.traverse((each) => each.isMesh && materials.push(each.material));
  }
  for (const module of job.modules) materials.push(new (await import(module)).LayeredMaterial());
  const gl = renderer.getContext(), pixel = new Uint8Array(4);
  window.draw = ([k, frames]) => {
    for (const ball of balls) ball.material = materials[k];
    for (let frame = 0; frame < frames; frame++) {
      renderer.render(scene, camera);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // the frame is drawn when it comes back
    }
  };
}
"""


def times(page: Any, presets: Sequence[str], rounds: int, frames: int, size: int) -> tuple[np.ndarray, ...]:
    """Processor time of frames in milliseconds: of the plain material (rounds,), of each preset as the engine's own
    material, and of its module (presets, rounds)."""
    files = (vt.export(preset, "gltf", mesh="sphere").binary[".glb"]() for preset in presets)
    baked = [base64.b64encode(each).decode() for each in files]
    page.evaluate(STAGE, {"modules": [f"/{preset}.js" for preset in presets], "baked": baked, "size": size})
    processes = psutil.Process().children(recursive=True)

    def spent() -> float:
        return sum(sum(process.cpu_times()[:2]) for process in processes)

    found = np.zeros((1 + 2 * len(presets), rounds))
    for turn in range(-1, rounds):
        for k in range(len(found)):
            before = spent()
            page.evaluate("job => window.draw(job)", [k, frames])
            if turn >= 0:
                found[k, turn] = (spent() - before) / frames * 1e3
    return found[0], *np.split(found[1:], 2)


def main() -> None:
    options = parsed(__doc__, presets=PRESETS, rounds=9, frames=4, size=440)
    if why := chromium.missing():
        print(f"skipped: {why}")
        return
    presets = options.presets.split(",")
    with in_three.stage() as stage:
        stage.files.update({f"{preset}.js": vt.export(preset, "three").text for preset in presets})
        plain, baked, found = times(stage.page, presets, options.rounds, options.frames, options.size)
    row("frames", "MeshPhysicalMaterial", plain.tolist(), "ms")
    for preset, own, module in zip(presets, baked, found):
        row("frames", f"{preset}, baked into it", (own / plain).tolist(), "of a frame")
        row("frames", preset, (module / plain).tolist(), "of a frame", f"{np.median(module / own):.2f} of it baked")


if __name__ == "__main__":
    main()
