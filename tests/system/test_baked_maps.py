"""Textured materials as baked images: texels with the parameters of their stacks, in files that are read back."""

from __future__ import annotations

import functools
import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from materialx import document, generated
from PIL import Image

import velatura as vt
from velatura import kernel
from velatura.bakes import TARGETS, Bake, bake
from velatura.checks.probe import Probe
from velatura.exports import baked
from velatura.model import DEFAULT, named
from velatura.model.context import in_silence
from velatura.pictures import png
from velatura.programs.closures import ViewAndLight
from velatura.programs.embedded import loosened
from velatura.programs.maps import AT_ONCE, Grid, mapped
from velatura.programs.parameters import Input
from velatura.programs.values import texels
from velatura.stack import Texture

once = functools.cache(bake)
Run = Callable[..., tuple[int, str, str]]
NO_USD = 'usd-core is missing: pip install "velatura[usd]"'

COPPER = vt.Stack([vt.Interface(eta=(0.28, 0.48, 1.08), k=(3.6, 2.6, 2.4), alpha=0.2)])
PAINT = vt.Stack([vt.Interface(eta=1.5, alpha=0.05), vt.Diffuse(albedo=(0.7, 0.2, 0.1))])
MAPPED = [name for name, each in TARGETS.items() if each.maps]
HALF = np.repeat([[0, 255]], 4, axis=0).repeat(2, axis=1).astype(np.uint8)  # 4 x 4: nothing on the left, all right


def written(pixels: np.ndarray, path: Path) -> Path:
    Image.fromarray(pixels).save(path)
    return path


@pytest.fixture(scope="module")
def worn(tmp_path_factory) -> vt.Mix:
    """Paint on the right half, copper on the left, whose name is of other characters than files have."""
    mask = Texture(texture=written(HALF, tmp_path_factory.mktemp("images") / "mask.png"))
    return vt.Mix([(mask, PAINT), (None, COPPER)], name="../'''-->\"\\é</🎨")


@pytest.fixture(scope="module")
def made(worn: vt.Mix) -> dict[str, Bake]:
    return {target: once(worn, target, named(DEFAULT), maps=16, progress=in_silence) for target in MAPPED}


@pytest.fixture(autouse=True)
def fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exports have the parameters that were fitted for others."""
    monkeypatch.setattr(baked, "bake", once)


def values_at(made: Bake, row: int, column: int) -> dict[str, Any]:
    """All values at a texel."""
    values = dict(made.values)
    for name, image in made.images.items():
        is_colour = isinstance(image.factor, tuple)
        texel = texels(image.texture, is_colour)[row, column] * image.factor
        values[name] = tuple(texel.tolist()) if is_colour else float(texel[0])
    return values


# Texels ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("target", MAPPED)
def test_texels_have_the_light_of_their_own_stack(made: dict[str, Bake], target: str) -> None:
    """Expected: in the program's formulas the albedo of the part that a texel has, to what its own bake would lose and
    .02 for 8 bits and parameters without an image; the loss that is stated is that of these."""
    program, found = TARGETS[target], made[target]
    assert found.images and found.total_variation.max() < 0.05
    for column, part in ((0, COPPER), (3, PAINT)):
        alone = bake(part, target)
        rng = np.random.default_rng(0)
        u, phi = rng.random(2**14), 2 * np.pi * rng.random(2**14)
        wo = np.stack([np.sqrt(u) * np.cos(phi), np.sqrt(u) * np.sin(phi), np.sqrt(1 - u)])  # by the cosine
        pair = ViewAndLight(np.repeat([[0.6], [0.0], [0.8]], wo.shape[1], axis=1), wo)
        own, found_there = (program.value(v, pair, False) for v in (alone.values, values_at(found, 1, column)))
        weight = np.pi / wo[2]
        np.testing.assert_allclose((found_there * weight).mean(axis=1), (own * weight).mean(axis=1), atol=0.02)


def test_numbers_that_do_not_vary_have_no_image(made: dict[str, Bake]) -> None:
    images = made["openpbr"].images
    assert {"base_color", "base_metalness", "specular_roughness"} <= set(images)
    assert "coat_weight" not in images and made["openpbr"].values["coat_weight"] == 0
    packed = {image.texture.texture for name, image in made["gltf"].images.items() if name != "baseColorFactor"}
    assert len(packed) == 1  # metalness and roughness share one, as glTF has them


def test_mitsuba_shows_the_texels(made: dict[str, Bake], worn: vt.Mix, tmp_path: Path) -> None:
    """Expected: the plugin of the file, on either half of the image, has the values of the formulas with that texel's
    numbers, to the rounding of 8 bits."""
    vt.export(worn, "mitsuba-principled", maps=16, folder=tmp_path).save(tmp_path / "worn.xml")
    scene = (
        '<scene version="3.0.0"><include filename="worn.xml"/><shape type="sphere"><ref id="material"/></shape></scene>'
    )
    (tmp_path / "scene.xml").write_text(scene)
    mi = kernel.mitsuba()
    bsdf = mi.load_file(str(tmp_path / "scene.xml")).shapes()[0].bsdf()
    wi = np.broadcast_to([0.6, 0.0, 0.8], (64, 3))
    wo = np.random.default_rng(1).normal(size=(64, 3))
    wo[:, 2] = np.abs(wo[:, 2])
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    for u, column in ((0.2, 0), (0.8, 3)):
        si = Probe(bsdf).interaction(wi)
        si.uv = mi.Point2f(u, 0.5)
        seen = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T)))
        own = values_at(made["mitsuba-principled"], 1, column)
        expected = TARGETS["mitsuba-principled"].value(own, ViewAndLight(wi.T, wo.T), False)
        np.testing.assert_allclose(seen, expected, rtol=0.01, atol=2e-3)


def test_images_are_as_fine_as_the_finest_up_to_the_size_that_is_asked_for(tmp_path: Path) -> None:
    """Expected: means of blocks where an image becomes smaller; distinct texels once."""
    fine = np.kron(np.array([[0, 255], [255, 0]]), np.ones((4, 8))).astype(np.uint8)
    grey = Texture(texture=written(fine, tmp_path / "fine.png"))
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=grey), vt.Diffuse(albedo=0.5)])
    assert Grid.of(PAINT, 8) is None
    for size, shape in ((64, (8, 16)), (8, (8, 8)), (2, (2, 2))):
        grid = Grid.of(stack, size)
        assert grid is not None and grid.shape == shape and len(grid.values) == 2
        texels = grid.values[grid.which, 0].reshape(shape)
        np.testing.assert_allclose(texels[0, 0], grid.values.min())
        np.testing.assert_allclose(texels[-1, 0], grid.values.max())
    one = Grid.of(stack, 1)
    assert one is not None and one.values[0, 0] == pytest.approx(0.5)


def test_fits_are_few_where_parameters_are_smooth(tmp_path: Path) -> None:
    """Expected: of 256 values two rounds of fits at most, which predict a square root between them, and a colour
    exactly."""
    ramp = np.arange(256, dtype=np.uint8).reshape(16, 16)
    stack = vt.Stack([vt.Diffuse(albedo=Texture(texture=written(ramp, tmp_path / "ramp.png")))])
    grid = Grid.of(stack, 16)
    assert grid is not None and len(grid.values) == 256
    parameters = Input("a", 0.0), Input("b", (0.0, 0.0, 0.0))
    steps: list[tuple[int, int]] = []

    def fit(row: Any) -> dict[str, Any]:
        x = row["layer0_albedo"]
        return {"a": 0.5 * x * x, "b": (x, 0.5 * x, 0.2)}

    found = mapped(grid, parameters, fit, lambda done, total: steps.append((done, total)))
    assert len(found.nodes) <= 4 * AT_ONCE and steps[0] == (0, 64) and steps[-1] == (64, 64)
    x = grid.values[:, 0]
    np.testing.assert_allclose(found.columns["a"][:, 0], 0.5 * x * x, atol=0.005)
    np.testing.assert_allclose(found.columns["b"], np.stack([x, 0.5 * x, 0 * x + 0.2], axis=1), atol=1e-6)
    assert found.varying == ["a", "b"] and found.means()["b"][2] == pytest.approx(0.2)


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_png_is_read_by_others(channels: int) -> None:
    pixels = np.random.default_rng(2).integers(0, 256, (5, 7, channels), np.uint8)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(png(pixels)))).reshape(pixels.shape), pixels)


# Files ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("target", "ending"),
    [("openpbr", ".mtlx"), ("usd", ".usda"), ("gltf", ".gltf"), ("mitsuba-principled", ".xml")],
)
def test_files_are_read_back(worn: vt.Mix, target: str, ending: str, tmp_path: Path) -> None:
    """Expected: the material itself; without it a mixture by the image of metalness, which is the mask."""
    if target == "usd":
        pytest.importorskip("pxr", reason=NO_USD)
    path, *beside = vt.export(worn, target, maps=16, folder=tmp_path).save(tmp_path / f"worn{ending}")
    assert {each.parent for each in beside} == {tmp_path}
    assert all(each.name.isascii() and ("'" not in each.name) for each in beside)
    with pytest.warns(UserWarning, match="holds the stack"):
        assert vt.load(path) == worn
    path.write_bytes(loosened(path.read_bytes()))
    read = vt.imports.read(path).stack
    assert isinstance(read, vt.Mix) and isinstance(read.mix[0].weight, Texture)
    metal = texels(read.mix[0].weight)[..., 0]
    np.testing.assert_allclose(metal, 1 - HALF / 255, atol=0.01)


def test_materialx_and_a_binary_gltf_have_all_that_they_need(worn: vt.Mix, tmp_path: Path) -> None:
    generated(document(vt.export(worn, "openpbr", maps=16, folder=tmp_path).text), "glsl")
    written = vt.export(worn, "gltf", maps=16, folder=tmp_path).save(tmp_path / "worn.glb")
    assert written == [tmp_path / "worn.glb", tmp_path / "worn.glb.json"]
    assert not list(tmp_path.glob("*.png"))


def test_the_command_bakes_images(run: Run, worn: vt.Mix, tmp_path: Path) -> None:
    from velatura.stack import dumps

    (tmp_path / "worn.yaml").write_text(dumps(worn), encoding="utf-8")
    arguments = ("export", str(tmp_path / "worn.yaml"), "--to", "gltf", "--maps", "16")
    status, out, said = run(*arguments, "-o", str(tmp_path / "worn.gltf"))
    assert status == 0 and ".png" in out and "baked images: 4 x 4 texels, by fits of 2 stacks" in said
    for image in json.loads((tmp_path / "worn.gltf").read_text(encoding="utf-8"))["images"]:
        assert (tmp_path / image["uri"]).exists()
    status, _, said = run(*arguments)
    assert status == 2 and "maps: gltf has its images in files beside it" in said
    status, _, said = run("export", "bare-gold", "--to", "glsl", "--maps", "16")
    assert status == 2 and "--maps: only for --to openpbr, " in said


@pytest.mark.parametrize("size", [0, 4097, True, 2.5, "64"])
def test_other_sizes_are_refused(size: Any, worn: vt.Mix) -> None:
    with pytest.raises(vt.InvalidInput, match="maps: must be a whole number of texels, 1 to 4096, got"):
        bake(worn, "gltf", maps=size)


def test_a_program_without_baked_images_refuses_them(worn: vt.Mix, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(TARGETS, "usd", replace(TARGETS["usd"], maps={}))
    with pytest.raises(vt.InvalidInput, match=r"maps: only for openpbr, gltf, gltf-coat, .*, not for usd"):
        bake(worn, "usd", maps=16)


def test_surfaces_of_usd_have_their_own_images(worn: vt.Mix, tmp_path: Path) -> None:
    """Expected: of both surfaces, files beside the layer, and inside a package; colours in sRGB, all else as it is."""
    pxr = pytest.importorskip("pxr.Usd", reason=NO_USD)
    made = vt.export(worn, "usd", maps=16, folder=tmp_path)
    layer, package = made.save(tmp_path / "worn.usda")[0], made.save(tmp_path / "worn.usdz")[0]
    stage = pxr.Stage.Open(str(layer))
    read = {prim.GetName(): prim for prim in stage.Traverse() if prim.HasAttribute("inputs:file")}
    assert {"base_color_image", "base_metalness_image"} <= set(read)
    spaces = {"diffuseColor_preview": "sRGB", "metallic_preview": "raw", "roughness_preview": "raw"}
    for name, space in spaces.items():
        assert read[name].GetAttribute("inputs:sourceColorSpace").Get() == space
    paths = {prim.GetAttribute("inputs:file").Get() for prim in read.values()}
    assert all(Path(each.resolvedPath).parent == tmp_path and each.path.startswith("./") for each in paths)
    stage = pxr.Stage.Open(str(package))
    inside = [prim.GetAttribute("inputs:file").Get() for prim in stage.Traverse() if prim.HasAttribute("inputs:file")]
    assert len(inside) == len(read)
    assert all(each.resolvedPath.startswith(f"{package}[") for each in inside)
