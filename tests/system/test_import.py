"""Materials of other programs, wherever Velatura asks for a material.

Rationale: an import is only worth something if what is rendered follows the other program's file; so each way to name
such a file gives the same stack, and what a stack cannot carry is said once, in one line.
"""

from __future__ import annotations

import json
import re
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import pytest
from benchmarks import benchmark
from fuzzing import pictures

import velatura as vt
from velatura import kernel
from velatura.errors import Incomplete

Run = Callable[..., tuple[int, str, str]]

DOCUMENT = """<?xml version="1.0"?>
<materialx version="1.39" colorspace="lin_rec709">
  <open_pbr_surface name="S" type="surfaceshader">
    <input name="base_color" type="color3" value="0.1, 0.3, 0.6"/>
    <input name="coat_weight" type="float" value="1"/>
    <input name="coat_color" type="color3" value="0.9, 0.7, 0.5"/>
    <input name="fuzz_weight" type="float" value="0.2"/>
  </open_pbr_surface>
  <surfacematerial name="Painted" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="S"/>
  </surfacematerial>
</materialx>
"""
LEFT = "fuzz_weight 0.2: a stack has no fibres above it: left out"


@pytest.fixture
def document(tmp_path: Path) -> Path:
    path = tmp_path / "painted.mtlx"
    path.write_text(DOCUMENT)
    return path


def test_a_file_is_taken_wherever_a_material_is(document: Path) -> None:
    """Expected: one warning of one line, and the stack that the parameters give."""
    expected = vt.from_openpbr(
        base_color=(0.1, 0.3, 0.6), coat_weight=1, coat_color=(0.9, 0.7, 0.5), fuzz_weight=0.2
    ).stack
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        stack = vt.load(document)
        lobes = vt.lobes(str(document), 0.5)
        bsdf = vt.bsdf(f"{document}#Painted")
    assert [(each.category, str(each.message)) for each in caught[:2]] == [(Incomplete, f"{document}: {LEFT}")] * 2
    assert len(caught) == 3 and stack.layers == expected.layers
    np.testing.assert_array_equal(lobes.energy, vt.lobes(expected, 0.5).energy)
    assert str(bsdf) == str(vt.bsdf(expected))


def test_shares_are_rendered_as_mixtures(run: Run, document: Path, tmp_path: Path) -> None:
    """Expected: from the file and from what `import` writes the same picture, between those of the whole shares."""
    document.write_text(
        DOCUMENT.replace('"coat_weight" type="float" value="1"', '"base_metalness" type="float" value="0.3"')
    )
    assert run("import", str(document), "-o", str(tmp_path / "half.yaml"))[0] == 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Incomplete)
        found: Any = vt.load(document)
    assert vt.load(tmp_path / "half.yaml") == found and found.mix[0].weight == 0.3
    for name, file in (("a", document), ("b", tmp_path / "half.yaml")):
        command = (
            "render",
            str(file),
            "--scene",
            "sphere",
            "--size",
            "16",
            "--spp",
            "4",
            "-o",
            f"{tmp_path / name}.exr",
        )
        assert run(*command)[0] == 0
    images = [np.array(kernel.bitmap(tmp_path / f"{name}.exr")) for name in "ab"]
    np.testing.assert_allclose(images[0], images[1], rtol=1e-5)  # samples are summed up in any order
    si: Any = kernel.mitsuba().SurfaceInteraction3f()
    si.wi = wo = kernel.mitsuba().Vector3f(0.0, 0.0, 1.0)
    parts = [vt.bsdf(material) for material in (found, *(part.material for part in found.mix))]
    whole, metal, paint = (np.ravel(each.eval(kernel.mitsuba().BSDFContext(), si, wo)) for each in parts)
    np.testing.assert_allclose(whole, 0.3 * metal + 0.7 * paint, rtol=1e-5)


def test_a_scene_names_it(document: Path, tmp_path: Path) -> None:
    """Expected: the BSDF of its stack, from a dictionary, and from a scene beside it that names the material."""
    mi: Any = kernel.mitsuba()
    vt.register()
    scene = """<scene version="3.0.0"><shape type="sphere"><bsdf type="layered">
        <string name="material" value="painted.mtlx#Painted"/></bsdf></shape></scene>"""
    (tmp_path / "scene.xml").write_text(scene)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Incomplete)
        expected = str(vt.bsdf(document))
        assert str(mi.load_dict({"type": "layered", "material": str(document)})) == expected
        assert str(mi.load_file(str(tmp_path / "scene.xml")).shapes()[0].bsdf()) == expected


def test_the_command_writes_the_material_and_lists_the_rest(run: Run, document: Path, tmp_path: Path) -> None:
    """Expected: YAML that reads back as the stack, on standard output or in a file; the list on standard error."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Incomplete)
        expected = vt.load(document)
    status, out, err = run("import", str(document))
    assert (status, err) == (0, f"left: {LEFT}\n")
    (tmp_path / "out.yaml").write_text(out)
    assert vt.load(tmp_path / "out.yaml") == expected
    output = tmp_path / "painted.yaml"
    assert run("import", str(document), "-o", str(output))[:2] == (0, f"{output}\n")
    assert vt.load(output) == expected
    found = json.loads(run("import", str(document), "--json", "--material", "Painted")[1])
    assert vt.Stack.from_dict(found["material"]) == expected
    assert found["left"] == [{"parameter": "fuzz_weight", "value": "0.2", "why": LEFT.partition(": ")[2]}]


def test_errors_and_warnings_of_the_command_are_one_line(run: Run, document: Path, tmp_path: Path) -> None:
    assert run("lobes", str(document), "--cos", "1")[2] == f"velatura: {document}: {LEFT}\n"
    bomb = tmp_path / "bomb.mtlx"
    bomb.write_text('<!DOCTYPE x [<!ENTITY a "ha">]><materialx>&a;</materialx>')
    status, out, err = run("import", str(bomb))
    assert (status, out) == (2, "")
    assert err == f"velatura: {bomb}: line 1: has a document type, which is not read\n"
    assert run("import", str(document), "-o", "material.txt")[0] == 2
    assert run("import", str(document), "--material", "Other")[2].endswith(
        "unknown material 'Other' (known: Painted)\n"
    )


def test_a_stack_comes_back_from_its_gltf(run: Run, tmp_path: Path) -> None:
    """Expected: exactly, from the file that was written; from its parameters where another program has written it."""
    path = tmp_path / "gold.gltf"
    assert run("export", "coated-gold", "--to", "gltf", "-o", str(path))[0] == 0
    found = vt.imports.read(path)
    assert found.stack == vt.preset("coated-gold") and [each.parameter for each in found.left] == ["extras"]
    written = json.loads(path.read_text())
    written["asset"]["generator"] = "another program"
    path.write_text(json.dumps(written))
    assert vt.imports.read(path).stack.source == "imported from glTF"


def test_images_inside_a_glb_go_where_its_material_goes(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: the image beside what `import` and `export` write, named there; none without -o or on failure."""
    data = pictures.png()
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "images": [{"bufferView": 0, "mimeType": "image/png", "name": "wood"}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": 0}}}],
    }
    text, chunk = json.dumps(document).encode(), data + bytes(-len(data) % 4)
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(chunk), len(text), b"JSON")
    monkeypatch.chdir(tmp_path)
    Path("red.glb").write_bytes(head + text + struct.pack("<I4s", len(chunk), b"BIN\0") + chunk)
    assert run("import", "red.glb")[0] == 0 and [path.name for path in tmp_path.iterdir()] == ["red.glb"]
    assert run("import", "red.glb")[2].startswith("not written without -o: images inside the file (")
    assert run("import", "red.glb", "-o", "red.yaml")[:2] == (0, "red.yaml\n")
    (image,) = tmp_path.glob("*.png")
    assert image.read_bytes() == data and f"texture: {image.name}" in Path("red.yaml").read_text()
    assert str(vt.bsdf("red.yaml")) == str(vt.bsdf("red.glb"))
    image.unlink()
    assert run("export", "red.glb", "--to", "mitsuba-xml", "-o", "red.xml")[0] == 0
    assert image.read_bytes() == data and f'"{image.name}"' in Path("red.xml").read_text()
    image.unlink()
    Path("red.osl").mkdir()
    assert run("export", "red.glb", "--to", "osl", "-o", "red.osl")[0] == 2 and not image.exists()


def test_images_are_rendered_by_their_curves(tmp_path: Path) -> None:
    """Expected: where an image has the texel t, the value of the material of roughness t and colour t."""
    mi: Any = kernel.mitsuba()
    texels = np.full((2, 2, 3), 0.0, np.float32)
    texels[:] = (0.3, 0.5, 0.8)
    mi.Bitmap(texels).write(str(tmp_path / "colour.exr"))
    colour = vt.Texture(texture=tmp_path / "colour.exr")
    grey = vt.Texture(texture=tmp_path / "colour.exr", channel="g")
    found = vt.bsdf(vt.from_openpbr(base_metalness=1, base_color=colour, specular_roughness=grey).stack)
    wanted = vt.bsdf(vt.from_openpbr(base_metalness=1, base_color=(0.3, 0.5, 0.8), specular_roughness=0.5).stack)
    si = mi.SurfaceInteraction3f()
    si.wi, si.uv = mi.Vector3f(0.6, 0.0, 0.8), mi.Point2f(0.3, 0.6)
    wo = mi.Vector3f(-0.28, 0.0, 0.96)
    values = [np.ravel(each.eval(mi.BSDFContext(), si, wo)) for each in (found, wanted)]
    np.testing.assert_allclose(values[0], values[1], rtol=5e-3)


def test_the_examples_of_the_manual_run(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the page's file is read by its commands and its code."""
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "imports.md").read_text()
    monkeypatch.chdir(tmp_path)
    (document,) = re.findall(r"```xml\n(.*?)```", page, re.DOTALL)
    Path("varnished.mtlx").write_text(document)
    for command in re.findall(r"^velatura (.*)$", page, re.MULTILINE):
        assert run(*command.split())[0] == 0, command
    with pytest.warns(Incomplete):
        exec("\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)), {})
    assert vt.load("varnished.yaml").kinds == ("dielectric", "medium", "dielectric", "diffuse")


@pytest.mark.parametrize(
    "title, name",
    [
        ("OpenPBR", "copper, smooth coat"),
        ("OpenPBR", "paint, coat"),
        ("glTF", "paint, film of 300 nm"),
        ("Mitsuba's principled", "paint, coat"),
        ("Standard Surface", "paint, coat"),
    ],
)
def test_the_tables_of_the_manual_are_those_of_the_benchmark(title: str, name: str) -> None:
    """Expected: energies and roughness within .002, first by the formulas of the source, then by the stack."""
    if title == "Standard Surface" and chromium.missing():
        pytest.skip(chromium.missing())
    program, page = benchmark("imports"), (Path(__file__).parents[2] / "docs" / "how-to" / "imports.md").read_text()
    source = program.SOURCES[title]
    (table,) = re.findall(rf"^\| {title} \| lobe \|(.*?)\n\n", page, re.MULTILINE | re.DOTALL)
    theirs, ours = (of(source, source.materials[name], 1.0) for of in (program.of_formulas, program.of_stack))
    for lobe in ours:
        (row,) = re.findall(rf"^\| {name} \| {lobe} \|(.*)\|$", table, re.MULTILINE)
        energy, _, alpha, _ = row.split("|")
        for kind, cell in enumerate((energy, alpha)):
            if cell.strip():
                printed = [float(part) for part in cell.split(",")]
                assert printed == pytest.approx([theirs[lobe][kind], ours[lobe][kind]], abs=0.002), lobe
