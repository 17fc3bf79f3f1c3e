"""Frames of three.js with materials of `--to three`, against frames with its MeshPhysicalMaterial.

A page in headless Chromium, on the processor (SwiftShader), draws four balls under a prefiltered environment by one
material after the other, round by round. Prints, for each preset, the frame's time over that of the engine's own
material in the same round: plain, and with the clearcoat and anisotropy that such presets need there.

    python benchmarks/frames.py [--presets bare-gold,coated-gold,...] [--rounds 15] [--size 440]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rows import parsed, row

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
import in_three

import velatura as vt

PRESETS = "bare-gold,car-paint,varnished-paint,wet-copper,anodised-titanium,coated-gold,frosted-glass"

TIMES = """
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
  const materials = [
    new THREE.MeshPhysicalMaterial({ color: 0xffc070, metalness: 1, roughness: 0.4 }),
    new THREE.MeshPhysicalMaterial({
      color: 0xffc070, metalness: 1, roughness: 0.4, clearcoat: 1, clearcoatRoughness: 0.2, anisotropy: 0.5,
    }),
  ];
  for (const module of job.modules) materials.push(new (await import(module)).LayeredMaterial());
  const gl = renderer.getContext(), pixel = new Uint8Array(4), times = materials.map(() => []);
  for (let round = -2; round < job.rounds; round++) {
    for (const [k, material] of materials.entries()) {
      for (const ball of balls) ball.material = material;
      const start = performance.now();
      renderer.render(scene, camera);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // the frame is drawn when it comes back
      if (round >= 0) times[k].push(performance.now() - start);
    }
  }
  return times;
}
"""


def main() -> None:
    options = parsed(__doc__, presets=PRESETS, rounds=15, size=440)
    if why := chromium.missing():
        print(f"skipped: {why}")
        return
    presets = options.presets.split(",")
    with in_three.stage() as stage:
        stage.files.update({f"{preset}.js": vt.export(preset, "three").text for preset in presets})
        modules = [f"/{preset}.js" for preset in presets]
        job = {"modules": modules, "rounds": options.rounds, "size": options.size}
        plain, coated, *ours = np.array(stage.page.evaluate(TIMES, job))
    row("frames", "MeshPhysicalMaterial", plain.tolist(), "ms")
    for name, times in [("the same, clearcoat and anisotropy", coated), *zip(presets, ours)]:
        row("frames", name, (times / plain).tolist(), "of a frame")


if __name__ == "__main__":
    main()
