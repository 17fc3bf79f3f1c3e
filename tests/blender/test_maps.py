"""Bakes with images into Blender's Principled BSDF, as Cycles renders them, against bakes of their texels' stacks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from with_cycles import NEEDED, SCENE, pictures

import velatura as vt
from velatura.stack import Texture

pytestmark = NEEDED

COPPER = vt.Stack([vt.Interface(eta=(0.28, 0.48, 1.08), k=(3.6, 2.6, 2.4), alpha=0.2)])
PAINT = vt.Stack([vt.Interface(eta=1.5, alpha=0.05), vt.Diffuse(albedo=(0.7, 0.2, 0.1))])
MASK = np.kron(np.array([[0, 255], [0, 0]]), np.ones((8, 8))).astype(np.uint8)  # paint above on the right
JOB = {"size": 8, "spp": 512, "seeds": [1], "cosines": [0.9, 0.4]}
OFF = 0.015  # of 8 bits, of parameters without an image, and of noise


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    """Light (cosines, 3) that Cycles gives back of bakes of the parts."""
    folder = tmp_path_factory.mktemp("alone")
    scripts = {}
    for name, stack in {"copper": COPPER, "paint": PAINT}.items():
        scripts[name] = folder / f"{name}.py"
        vt.export(stack, "blender-principled").save(scripts[name])
    return {name: found.mean(axis=(1, 2)) for name, found in pictures(folder, scripts, JOB).items()}


@pytest.mark.parametrize("right", [False, True], ids=["left", "right"])
@pytest.mark.parametrize("above", [False, True], ids=["below", "above"])
def test_cycles_shows_the_texels_of_a_baked_image(
    right: bool, above: bool, alone: dict[str, np.ndarray], tmp_path: Path
) -> None:
    """Expected: in each quarter of the plane the light of the part that the mask has there."""
    Image.fromarray(MASK).save(tmp_path / "mask.png")
    worn = vt.Mix([(Texture(texture=tmp_path / "mask.png"), PAINT), (None, COPPER)], name="worn")
    vt.export(worn, "blender-principled", maps=16, folder=tmp_path).save(tmp_path / "worn.py")
    side = 0.5 * SCENE["half"]
    job = {**JOB, "at": [side if right else -side, side if above else -side]}
    seen = pictures(tmp_path, {"worn": tmp_path / "worn.py"}, job)["worn"].mean(axis=(1, 2))
    assert seen == pytest.approx(alone["paint" if right and above else "copper"], abs=OFF)
