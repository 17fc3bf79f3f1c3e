"""Exports of glTF as three.js and model-viewer load and draw them in headless Chromium."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import chromium
import in_three
import numpy as np
import pytest
from PIL import Image

import velatura as vt

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

SIZE = 48
DRAW = """
async (text) => {
  const THREE = await import('three');
  const { GLTFLoader } = await import('/examples/jsm/loaders/GLTFLoader.js');
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const { scene } = await new GLTFLoader().parseAsync(bytes.buffer, '');
  const found = [];
  scene.traverse((each) => each.isMesh && found.push(each));
  const [{ material, geometry }] = found;
  const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10), stage = new THREE.Scene();
  if (!window.studio) {
    // A renderer blurs an environment once, for seconds
    const renderer = new THREE.WebGLRenderer({ alpha: true, preserveDrawingBuffer: true });
    renderer.setSize(SIZE, SIZE, false);
    const white = new THREE.DataTexture(new Uint8Array(4 * 4 * 2).fill(255), 4, 2);
    white.mapping = THREE.EquirectangularReflectionMapping;
    white.needsUpdate = true;
    window.studio = { renderer, white };
  }
  const { renderer, white } = window.studio;
  stage.environment = white;
  stage.add(scene);
  camera.position.set(0, 1, 4);
  renderer.render(stage, camera);
  const picture = renderer.domElement.toDataURL('image/png').split(',')[1];
  const { name, type, metalness, roughness, clearcoat, clearcoatRoughness, anisotropy } = material;
  return {
    picture, meshes: found.length, tangents: 'tangent' in geometry.attributes,
    material: { name, type, metalness, roughness, clearcoat, clearcoatRoughness, anisotropy },
  };
}
""".replace("SIZE", str(SIZE))


GOLD = vt.Stack([vt.Interface(eta=1.5, alpha=0.04), vt.Interface(conductor="Au", alpha=0.25)])


def halves(folder: Path) -> vt.Stack:
    """Paint with an image that is red above and blue below."""
    texels = np.full((8, 8, 3), 0.1, np.float32)
    texels[:4, :, 0] = texels[4:, :, 2] = 0.6
    vt.scenes.write_image(texels, folder / "halves.png")
    colour: Any = {"texture": str(folder / "halves.png"), "encoding": "srgb"}
    return vt.Stack([vt.Interface(eta=1.5, alpha=0.3), vt.Diffuse(albedo=colour)], name="Halves")


def drawn(three: in_three.Stage, path: Path) -> tuple[dict[str, Any], np.ndarray]:
    """What three.js has of a file's material, and its picture, sRGB from 0 to 255 (height, width, 4)."""
    found = three.page.evaluate(DRAW, base64.b64encode(path.read_bytes()).decode())
    picture = Image.open(io.BytesIO(base64.b64decode(found.pop("picture")))).convert("RGBA")
    return found, np.asarray(picture, float)


@pytest.mark.parametrize("ending", [".gltf", ".glb"])
def test_paint_with_an_image_is_drawn(three: in_three.Stage, tmp_path: Path, ending: str) -> None:
    """Expected: one ball, whose upper half has the colours of the upper half of the image: red above, blue below."""
    paint = halves(tmp_path) if ending == ".glb" else halves(tmp_path).replace(layer1_albedo=(0.6, 0.1, 0.1))
    path = vt.export(paint, "gltf", folder=tmp_path, mesh="sphere").save(tmp_path / f"ball{ending}")[0]
    found, picture = drawn(three, path)
    assert found["meshes"] == 1 and found["tangents"] and found["material"]["name"] == "Halves"
    above, below = picture[SIZE // 4, SIZE // 2], picture[3 * SIZE // 4, SIZE // 2]
    assert above[0] > 1.5 * above[2]
    assert (below[2] > 1.5 * below[0]) == (ending == ".glb")
    assert picture[0, 0, 3] == 0


def test_a_coat_is_a_clearcoat_to_those_that_know_no_other(three: in_three.Stage, tmp_path: Path) -> None:
    """Expected: metal of the file's roughness below a clearcoat, though three.js does not read the coat."""
    found, picture = drawn(three, vt.export(GOLD, "gltf-coat", mesh="sphere").save(tmp_path / "gold.glb")[0])
    assert found["material"]["type"] == "MeshPhysicalMaterial" and found["material"]["metalness"] == 1
    assert found["material"]["clearcoat"] == pytest.approx(1, abs=1e-3)
    assert found["material"]["clearcoatRoughness"] == pytest.approx(0.2, abs=0.02)
    red, _, blue, _ = picture[SIZE // 2, SIZE // 2]
    assert red > 1.2 * blue


# model-viewer --------------------------------------------------------------------------------------------------------

VIEWER = in_three.Engine(
    Path(__file__).parents[1] / "page" / "node_modules" / "@google" / "model-viewer",
    "https://",
    '<!doctype html><script type="module" src="/dist/model-viewer.min.js"></script>',
    """
async (address) => {
  await customElements.whenDefined('model-viewer');
  const viewer = document.createElement('model-viewer');
  viewer.innerHTML = '<span slot="progress-bar"></span>';
  Object.assign(viewer, { src: address, loading: 'eager', cameraOrbit: '0deg 90deg 105%' });
  viewer.style.cssText = 'width: SIZEpx; height: SIZEpx';
  const loaded = new Promise((done, failed) => {
    viewer.addEventListener('load', done);
    viewer.addEventListener('error', ({ detail }) => failed(new Error(detail.sourceError ?? detail.type)));
  });
  document.body.replaceChildren(viewer);
  await loaded;
  viewer.jumpCameraToGoal();
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
}
""".replace("SIZE", str(SIZE)),
)


@pytest.fixture(scope="module")
def viewer() -> Iterator[in_three.Stage]:
    if not VIEWER.folder.is_dir():
        pytest.skip("model-viewer is missing: npm ci in tests/page")
    with in_three.stage(VIEWER) as opened:
        yield opened


def viewed(viewer: in_three.Stage, path: Path) -> np.ndarray:
    """Picture of a file in the viewer's own light, sRGB from 0 to 255 with coverage (height, width, 4)."""
    viewer.files[path.name] = path.read_bytes()
    viewer.page.evaluate(VIEWER.draw, f"/{path.name}")
    shot = viewer.page.locator("model-viewer").screenshot(omit_background=True)
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGBA"), float)


def test_model_viewer_draws_exports(viewer: in_three.Stage, tmp_path: Path) -> None:
    """Expected: paint in the colours of the halves of its image, gold below a coat in gold, a pane that is clear."""
    pane = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=1.0, alpha=0.1)], thin=True)
    exports = {
        "paint": vt.export(halves(tmp_path), "gltf", folder=tmp_path, mesh="sphere"),
        "gold": vt.export(GOLD, "gltf-coat", mesh="sphere"),
        "pane": vt.export(pane, "gltf", mesh="sphere"),
    }
    paint, gold, clear = (viewed(viewer, made.save(tmp_path / f"{name}.glb")[0]) for name, made in exports.items())
    above, below = paint[SIZE // 4, SIZE // 2], paint[3 * SIZE // 4, SIZE // 2]
    assert above[0] > 1.5 * above[2] and below[2] > 1.5 * below[0]
    red, _, blue, solid = gold[SIZE // 2, SIZE // 2]
    assert red > 1.2 * blue and solid == 255
    assert 0 < clear[SIZE // 4 : SIZE // 2, SIZE // 2, 3].mean() < 200
    assert all(picture[0, 0, 3] == 0 for picture in (paint, gold, clear))
