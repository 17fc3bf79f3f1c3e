"""Exported modules for Babylon.js in headless Chromium, a ball each."""

from __future__ import annotations

from pathlib import Path

from in_three import Engine

# Orthographic pictures are taken from afar, since the engine has directions from the camera's place
DRAW = """
async (job) => {
  const { layeredMaterial } = await import(job.module);
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = job.size;
  const engine = new BABYLON.Engine(canvas, false);
  const complaints = [];
  BABYLON.Logger.OnNewCacheEntry = (entry) => complaints.push(entry);
  BABYLON.Logger.LogLevels = BABYLON.Logger.WarningLogLevel | BABYLON.Logger.ErrorLogLevel;
  const scene = new BABYLON.Scene(engine);
  scene.clearColor = new BABYLON.Color4(0, 0, 0, 0);
  scene.imageProcessingConfiguration.applyByPostProcess = true; // pictures are linear
  const camera = new BABYLON.FreeCamera('camera', new BABYLON.Vector3(0, 0, -400), scene);
  camera.fov = 2 * Math.atan(1 / 400);
  camera.minZ = 390;
  camera.maxZ = 410;
  const ball = BABYLON.MeshBuilder.CreateSphere('ball', { diameter: 2 * job.radius, segments: 96 }, scene);
  ball.rotation.x = -job.tilt;
  ball.material = layeredMaterial(BABYLON, scene);
  if (job.light) {
    const [x, y, z] = job.light;
    new BABYLON.DirectionalLight('light', new BABYLON.Vector3(-x, -y, z), scene);
  } else if (job.rectangle) {
    // It shines along -z of its own, which is turned towards the ball; depth is the other way round
    const [width, height, [x, y, z]] = job.rectangle;
    const stand = new BABYLON.TransformNode('stand', scene);
    stand.position.set(x, y, -z);
    stand.lookAt(stand.position.scale(2));
    new BABYLON.RectAreaLight('light', BABYLON.Vector3.Zero(), width, height, scene).parent = stand;
  } else {
    scene.environmentTexture = await new Promise((done, failed) => {
      const sky = new BABYLON.HDRCubeTexture(
        '/sky.hdr', scene, TEXELS, false, true, false, true, () => done(sky), failed, false, true,
      );
    });
  }
  const target = new BABYLON.RenderTargetTexture('target', job.size, scene, {
    type: BABYLON.Constants.TEXTURETYPE_FLOAT, generateMipMaps: false,
  });
  target.renderList = [ball];
  target.activeCamera = camera;
  await ball.material.forceCompilationAsync(ball);
  await scene.whenReadyAsync();
  target.render();
  const pixels = await target.readPixels();
  let text = '';
  const bytes = new Uint8Array(pixels.buffer);
  for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
  engine.dispose();
  return { pixels: btoa(text), complaints };
}
"""

# Tables that the engine fetches where a scene has area lights, for its own materials; nothing of them is read here
TABLES = {"https://assets.babylonjs.com/core/areaLights/areaLightsLTC.bin": bytes(64 * 64 * 8 * 2)}


def engine(texels: int) -> Engine:
    """The engine, whose environments are cubes of so many texels to a side."""
    return Engine(
        Path(__file__).parents[1] / "page" / "node_modules" / "babylonjs",
        "https://unpkg.com/babylonjs@[0-9.]+/",
        """<!doctype html><script src="/babylon.js"></script>""",
        DRAW.replace("TEXELS", str(texels)),
        turned=0.25,
    )


BABYLON = engine(32)
