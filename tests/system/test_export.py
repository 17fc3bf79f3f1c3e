"""What `velatura export` writes is read back by those that it is written for.

Rationale: an export is only worth something if the other program gets the same material; so each is loaded as its
readers load it.
"""

from __future__ import annotations

import json
import re
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.bakes import TARGETS
from velatura.exports import FORMATS
from velatura.exports.request import headed
from velatura.exports.shader import LANGUAGES
from velatura.shader import closures, prefiltered, shader
from velatura.shader.lookups import atlas

Run = Callable[..., tuple[int, str, str]]

TEXTS = [name for name, each in FORMATS.items() if each.is_text and name not in (*TARGETS, "bsdf-xml")]
PRESETS = ["coated-gold", "frosted-glass", "varnished-paint", "furnace"]


def test_glsl_is_the_shader_with_its_tables_beside(run: Run, tmp_path: Path) -> None:
    """Expected: the text and the texture that Python makes, the texture as little-endian floats in rows of RGBA."""
    path = tmp_path / "gold.glsl"
    arguments = ["--model", "belcour2018", "--constant", "layer0_eta", "--set", "layer0_alpha=0.2", "-o", str(path)]
    assert run("export", "coated-gold", "--to", "glsl", *arguments)[0] == 0
    made = shader(vt.preset("coated-gold").replace(layer0_alpha=0.2), "belcour2018", ["layer0_eta"])
    assert path.read_text() == headed(made.text)
    found = np.frombuffer((tmp_path / "gold.tables.bin").read_bytes(), "<f4")
    np.testing.assert_array_equal(found.reshape(made.tables.shape), made.tables)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few samples of closures and of blurs, where how well they fit is another test's."""
    monkeypatch.setattr(prefiltered, "SAMPLES", 16)
    monkeypatch.setattr(closures, "PLANE", (16, 9))
    monkeypatch.setattr(closures, "PAIRS", 64)


@pytest.mark.usefixtures("few")
def test_python_exports_what_the_command_writes(run: Run, tmp_path: Path) -> None:
    """Expected: `vt.export` of a preset's name has the text of the command line, and saves the same files."""
    for to in TEXTS:
        made = vt.export("bare-gold", to, "belcour2018", tir="off")
        _, out, _ = run("export", "bare-gold", "--to", to, "--model", "belcour2018", "--set", "tir=off")
        assert made.text == out, to
        written = made.save(tmp_path / f"gold{FORMATS[to].endings[0]}")
        facts = [made.described(written[0]).encode()] if made.facts else []
        assert [path.read_bytes() for path in written] == [made.text.encode(), *made.beside.values(), *facts]
    files = {path.name for path in tmp_path.iterdir()}
    endings = "glsl", "hlsl", "js", "osl", "slang", "tres", "wgsl", "mtlx", "py", "xml"
    described = {f"gold.{ending}" for ending in endings}
    beside = {f"gold.{ending}" for ending in ("json", "tables.bin", "cs", "ush", "exr")}
    assert files == described | {f"{name}.json" for name in described} | beside
    with pytest.raises(vt.InvalidInput, match="unknown format 'oslo'"):
        vt.export("bare-gold", "oslo")
    with pytest.raises(vt.InvalidInput, match=r"constant: only for glsl, .*wgsl.*, not for json"):
        vt.export("bare-gold", "json", constant=["layer0_eta"])


def test_without_tables_there_is_no_texture(run: Run, tmp_path: Path) -> None:
    """Expected: a model that looks up no averages needs none."""
    path = tmp_path / "gold.glsl"
    run("export", "coated-gold", "--to", "glsl", "--model", "weier2020", "--constant", "all", "-o", str(path))
    assert {entry.name for entry in tmp_path.iterdir()} == {"gold.glsl", "gold.glsl.json"}
    assert "vt_tables" not in path.read_text()
    assert json.loads((tmp_path / "gold.glsl.json").read_text())["textures"] == []


FACTS = [
    ("glsl", ["--prefix", "gold"], "gold_baked", "RGBA32F"),
    ("wgsl", ["--model", "belcour2018", "--half"], "vt_tables", "RGBA16F"),
    ("hlsl", ["--model", "belcour2018", "--tables", "shared.bin"], "vt_tables", "RGBA32F"),
]


@pytest.mark.parametrize(("to", "options", "texture", "texel"), FACTS)
def test_facts_suffice_to_load_a_shader(
    to: str, options: list[str], texture: str, texel: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: the file of each texture has the size that its facts state; all functions, uniforms and samplers that
    they name are in the code."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rough.png").touch()
    albedo = {"texture": "rough.png"} if "belcour2018" in options else 0.2
    layers = [{"interface": {"eta": 1.5, "alpha": 0.2}}, {"diffuse": {"albedo": albedo}}]
    (tmp_path / "paint.yaml").write_text(json.dumps({"layers": layers}))
    assert run("export", "paint.yaml", "--to", to, *options, "-o", f"paint.{to}")[0] == 0
    facts, code = json.loads((tmp_path / f"paint.{to}.json").read_text()), (tmp_path / f"paint.{to}").read_text()
    assert (facts["format"], facts["velatura"]) == (to, vt.__version__)
    assert facts["model"]["name"] == ("belcour2018" if "belcour2018" in options else "velatura")
    (read,) = facts["textures"]
    assert (read["name"], read["format"], read["filter"]) == (texture, texel, "nearest")
    size = {"RGBA16F": 8, "RGBA32F": 16}[texel]
    assert len((tmp_path / read["file"]).read_bytes()) == read["width"] * read["height"] * size
    assert len(facts["entry_points"]) == 3
    assert all(re.search(rf"\b{name}\(", code) for name in facts["entry_points"])
    assert all(place.split(".")[-1] in code for place in facts["uniforms"].values())
    assert [each["file"] for each in facts["images"].values()] == ["rough.png"] * (albedo != 0.2)
    assert all(name in code for name in [*facts["images"], read["name"]])


@pytest.mark.parametrize("to", ["osl", "mtlx", "gltf"])
def test_facts_state_the_loss_that_the_file_states(to: str, tmp_path: Path) -> None:
    """Expected: total variations of both are the same, to the digits of the file's comments."""
    made = vt.export("varnished-paint", to)
    path = made.save(tmp_path / f"paint{FORMATS[to].endings[0]}")[-1]
    loss = json.loads(path.read_text())["loss"]
    assert [each["cosine"] for each in loss] == [1.0, 0.7, 0.35]
    stated = [f"{100 * each['variation']:.1f}" if to == "gltf" else f"{each['variation']:.3f}" for each in loss]
    text = " ".join(made.notes) if to == "gltf" else made.text
    assert all(number in text for number in stated)


@pytest.mark.parametrize("to", ["three", "three-webgpu", "babylon", "godot", "unity", "unreal"])
def test_engines_refuse_textures_in_one_line(
    to: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: the value is named, and nothing written."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rough.png").touch()
    (tmp_path / "gold.yaml").write_text("layers:\n  - interface: {conductor: Au, alpha: {texture: rough.png}}\n")
    status, _, err = run("export", "gold.yaml", "--to", to, "-o", f"gold{FORMATS[to].endings[0]}")
    assert status == 2 and err.count("\n") == 1 and "layer0_alpha" in err
    assert not (tmp_path / f"gold{FORMATS[to].endings[0]}").exists()


def test_shared_tables_that_code_does_not_read_are_reported(run: Run, tmp_path: Path) -> None:
    """Expected: a solved material has tables of its own alone; one line, and no file of shared ones."""
    shared, path = tmp_path / "shared.bin", tmp_path / "lacquer.glsl"
    options = ["--to", "glsl", "--tables", str(shared), "-o", str(path)]
    status, _, err = run("export", "glossy-plastic", *options)
    assert (status, err) == (0, f"{shared}: not written, since this code reads no tables that materials share\n")
    assert not shared.exists()


def test_code_says_where_it_comes_from(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the material, the model with its changed switches, version, date and licence; no textures, said so."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    status, out, err = run("export", "coated-gold", "--to", "slang", "--model", "belcour2018", "--set", "tir=off")
    first, second = out.split("\n")[:2]
    assert first == "// Coated brushed gold, by the model belcour2018 (tir=off); Slang."
    assert second == f"// Velatura {vt.__version__}, 2023-11-14; SPDX-License-Identifier: BSD-3-Clause"
    assert (status, err) == (0, "not written without -o: what lies beside it (.tables.bin)\n")


def test_names_and_bindings_may_be_chosen(run: Run) -> None:
    """Expected: all names begin with the prefix; numbers are defaults where there are macros."""
    bound = ["--prefix", "gold", "--group", "2", "--binding", "5"]
    _, wgsl, _ = run("export", "coated-gold", "--to", "wgsl", *bound)
    assert "@group(2) @binding(5) var gold_baked: texture_2d<f32>;" in wgsl
    assert not re.search(r"\bvt_|\bVt[A-Z]|\bVT_", wgsl)
    _, hlsl, _ = run("export", "coated-gold", "--to", "hlsl", *bound)
    assert "#ifndef GOLD_BAKED_REGISTER\n#define GOLD_BAKED_REGISTER t5, space2\n#endif\n" in hlsl
    _, vulkan, _ = run("export", "coated-gold", "--to", "vulkan", *bound)
    assert "#define GOLD_SET 2\n" in vulkan and "#define GOLD_BAKED_BINDING 5\n" in vulkan


def test_materials_may_share_their_tables(run: Run, tmp_path: Path) -> None:
    """Expected: one file, whichever materials, in which each finds its numbers; halves of floats if asked."""
    shared = tmp_path / "shared.bin"
    common = ["--model", "belcour2018", "--tables", str(shared), "--half"]
    written = []
    for name in ("coated-gold", "varnished-paint"):
        path = tmp_path / f"{name}.wgsl"
        assert run("export", name, "--to", "wgsl", *common, "-o", str(path))[0] == 0
        written.append(shared.read_bytes())
        assert not path.with_suffix(".tables.bin").exists()
        assert "RGBA16F, 1024 texels a row" in path.read_text()
    assert written[0] == written[1]
    whole = np.frombuffer(written[0], "<f2").reshape(-1, 4)
    for name in ("coated-gold", "varnished-paint"):
        made = shader(vt.preset(name), "belcour2018", shared=True)
        for layout in atlas.layouts(made.looked_up, atlas.every()):
            expected = atlas.texels_of(layout.name)
            np.testing.assert_allclose(whole[layout.start :][: len(expected)], expected, rtol=1e-3, atol=1e-7)
            assert f"({layout.start}, " in made.text


@pytest.mark.parametrize("to", ["json", *(name for name in FORMATS if "tables" in FORMATS[name].options)])
def test_no_export_names_a_folder_of_this_machine(
    to: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rough.png").touch()
    (tmp_path / "gold.yaml").write_text("layers:\n  - interface: {conductor: Au, alpha: {texture: rough.png}}\n")
    status, out, _ = run("export", "gold.yaml", "--to", to)
    assert status == 0 and "rough.png" in out and str(tmp_path) not in out


@pytest.mark.parametrize("preset", PRESETS)
def test_json_holds_the_material_and_its_numbers(preset: str, run: Run) -> None:
    """Expected: the material reads back; the values are numbers, or three where colours differ, of metals by name too,
    by which the models of the papers have the same lobes."""
    status, out, _ = run("export", preset, "--to", "json", "--set", "tir=off", "--model", "belcour2018")
    found, stack = json.loads(out), vt.preset(preset)
    assert status == 0
    assert vt.Stack.from_dict(found["material"]) == stack
    assert (found["model"]["name"], found["model"]["tir"]) == ("belcour2018", "off")
    assert set(found["values"]) == set(stack.flat())
    again = stack.replace(**{name: value for name, value in found["values"].items() if "layer" in name})
    for a, b in zip(*(vt.lobes(each, 0.5, model="belcour2018").energy for each in (stack, again))):
        np.testing.assert_allclose(a, b, rtol=1e-12)


FILMS = """
layers:
  - interface: {eta: 1.5, alpha: 0.05, films: [{eta: 2.0, thickness_nm: 200}]}
  - interface: {conductor: Al, alpha: 0.15, films: [{eta: [1.4, 1.46, 1.5], k: 0.1, thickness_nm: 320}]}
"""


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("to", TEXTS)
def test_films_are_exported(to: str, run: Run, tmp_path: Path) -> None:
    """Expected: a shader has a texture of films beside it, or tables within; the others describe the same material."""
    (tmp_path / "film.yaml").write_text(FILMS, encoding="utf-8")
    stack, path = vt.load(tmp_path / "film.yaml"), tmp_path / f"film{FORMATS[to].endings[0]}"
    assert run("export", str(tmp_path / "film.yaml"), "--to", to, "-o", str(path))[0] == 0
    if ".films.bin" in FORMATS[to].beside:
        films, expected = np.frombuffer((tmp_path / "film.films.bin").read_bytes(), "<f4"), shader(stack).films
        assert expected is not None
        np.testing.assert_array_equal(films, expected.ravel())
        assert "vt_films" in path.read_text()
    elif to == "json":
        found = json.loads(path.read_text())
        assert vt.Stack.from_dict(found["material"]) == stack
        assert found["values"]["layer1_film0_eta"] == [1.4, 1.46, 1.5]
        assert found["values"]["layer0_film0_thickness_nm"] == 200
    elif to in ("osl", "blender", "mtlx", "three", "three-webgpu", "babylon", "godot", "unity", "unreal"):
        assert "by the model velatura" in path.read_text().lower()
    elif to == "python":
        assert runpy.run_path(str(path))["stack"] == stack
    else:
        wanted, shape = vt.bsdf(stack), '<shape type="sphere"><ref id="material"/></shape>'
        found = kernel.mitsuba().load_string(f'<scene version="3.0.0"><include filename="{path}"/>{shape}</scene>')
        assert str(found.shapes()[0].bsdf()) == str(wanted)


PAINTED = """
name: Worn paint
mix:
  - weight: {texture: mask.png, channel: g}
    material: bare-gold
  - weight: 0.25
    material:
      mix: [{weight: 0.5, material: varnished-paint}, {material: {layers: [diffuse: {albedo: 0.3}]}}]
  - material: varnished-paint
"""


@pytest.mark.parametrize("to", ["json", "python", "mitsuba-xml", "glsl", "wgsl", "osl", "blender"])
def test_mixtures_are_exported(to: str, run: Run, tmp_path: Path) -> None:
    """Expected: files of a description read back as the mixture, its mask included; a shader has its weights."""
    (tmp_path / "mask.png").touch()
    (tmp_path / "worn.yaml").write_text(PAINTED, encoding="utf-8")
    mix, path = vt.load(tmp_path / "worn.yaml"), tmp_path / f"worn{FORMATS[to].endings[0]}"
    assert run("export", str(tmp_path / "worn.yaml"), "--to", to, "-o", str(path))[0] == 0
    text = path.read_text(encoding="utf-8")
    if to == "json":
        found = json.loads(text)
        assert vt.stack.loads(json.dumps(found["material"]), "worn.json", tmp_path) == mix
        assert found["values"]["part1_part0_weight"] == 0.5 and "part0_weight" not in found["values"]
    elif to == "python":
        assert runpy.run_path(str(path))["mix"] == mix
    elif to == "mitsuba-xml":
        (material,) = (each for each in ElementTree.fromstring(text).iter("string") if each.get("name") == "material")
        assert vt.stack.loads(material.get("value", ""), "worn.json", tmp_path) == mix
    elif to in ("osl", "blender"):
        assert "part0_weight_map" in text and "mask.png" in text and "part1_part0_columns" in text
    else:
        made = shader(mix, printer=LANGUAGES[to]())
        assert text == headed(made.text) and made.columns is not None
        columns = np.frombuffer(path.with_suffix(".tables.bin").read_bytes(), "<f4")
        np.testing.assert_array_equal(columns, made.columns.ravel())
        assert list(made.maps) == ["vt_map_part0_weight"]


@pytest.mark.parametrize("material", [*PRESETS, "mixture"])
def test_a_scene_of_mitsuba_can_include_it(material: str, run: Run, tmp_path: Path) -> None:
    """Expected: the BSDF of the XML answers as the one that Python makes, switches included."""
    if material == "mixture":
        vt.save(vt.Mix([(0.3, "bare-gold"), (None, "varnished-paint")]), tmp_path / "mix.yaml")
        material = str(tmp_path / "mix.yaml")
    run("export", material, "--to", "mitsuba-xml", "--set", "form=symmetric", "-o", str(tmp_path / "material.xml"))
    expected = vt.bsdf(material, form="symmetric")
    mi: Any = kernel.mitsuba()
    scene = mi.load_string(
        f"""<scene version="3.0.0"><include filename="{tmp_path / "material.xml"}"/>
        <shape type="sphere"><ref id="material"/></shape></scene>"""
    )
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0.6, 0.0, 0.8)
    wo = mi.Vector3f(-0.5, 0.1, float(np.sqrt(0.74)))
    found = scene.shapes()[0].bsdf()
    a, b = (np.ravel(each.eval(mi.BSDFContext(), si, wo)) for each in (found, expected))
    np.testing.assert_array_equal(a, b)
    assert str(found) == str(expected)


def test_a_scene_and_its_images_may_be_moved(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the scene names its image relative to itself, and is read in another place from any folder."""
    mi: Any = kernel.mitsuba()
    here, there = tmp_path / "here", tmp_path / "there"
    (here / "maps").mkdir(parents=True)
    mi.Bitmap(np.full((2, 2, 1), 0.3, np.float32)).write(str(here / "maps/rough.exr"))
    (here / "gold.yaml").write_text(
        "layers:\n  - interface: {conductor: Au, alpha: {texture: maps/rough.exr}}\n", encoding="utf-8"
    )
    monkeypatch.chdir(here)
    assert run("export", "gold.yaml", "--to", "mitsuba-xml", "-o", "gold.xml")[0] == 0
    assert '"maps/rough.exr"' in (here / "gold.xml").read_text()
    here.rename(there)
    monkeypatch.chdir(tmp_path)
    (there / "scene.xml").write_text(
        '<scene version="3.0.0"><include filename="gold.xml"/><shape type="sphere"><ref id="material"/></shape></scene>'
    )
    assert "layer0_alpha_u.data" in str(mi.traverse(mi.load_file(str(there / "scene.xml"))))


def test_a_script_has_what_parts_of_a_mixture_cover(tmp_path: Path) -> None:
    mix = vt.Mix.from_dict(
        {"mix": [{"weight": 0.5, "material": "bare-gold", "covers": "Foot'}\""}, {"material": "coated-gold"}]}
    )
    (path,) = vt.export(mix, "python").save(tmp_path / "lamp.py")[:1]
    assert runpy.run_path(str(path))["mix"] == mix


@pytest.mark.parametrize("preset", PRESETS)
def test_the_script_runs(preset: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: it describes the same stack, and as a script renders it with the same model to the file named."""
    path, picture, seen = tmp_path / "material.py", tmp_path / "out.png", []
    run("export", preset, "--to", "python", "--model", "weier2020", "--set", "tir=clean", "-o", str(path))
    assert runpy.run_path(str(path))["stack"] == vt.preset(preset)

    def render(stack: vt.Stack, **chosen: str) -> np.ndarray:
        seen.append((stack, chosen))
        return np.zeros((2, 2, 3))

    monkeypatch.setattr(vt, "render", render)
    monkeypatch.setattr(sys, "argv", [str(path), str(picture)])
    runpy.run_path(str(path), run_name="__main__")
    assert seen == [(vt.preset(preset), {"model": "weier2020", "tir": "clean"})]
    assert picture.exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["coated-gold", "--to", "obj"], "'obj' is not one of 'glsl', 'glsl450', 'vulkan', 'hlsl', 'slang', 'wgsl'"),
        (["coated-gold", "--to", "json", "-o", "gold.yaml"], "gold.yaml: json output ends in .json"),
        (["coated-gold", "--to", "json", "-o", "nowhere/gold.json"], "nowhere/gold.json: there is no folder nowhere"),
        (["coated-gold", "--to", "json", "--constant", "all"], "--constant: only for --to glsl"),
        (["coated-gold", "--to", "glsl", "--binding", "2"], "--binding: only for --to glsl450, vulkan, hlsl"),
        (["coated-gold", "--to", "glsl", "--prefix", "a b"], "prefix: must be letters, digits and single underscores"),
        (["coated-gold", "--to", "glsl", "--constant", "layer9_eta"], "constant: unknown parameter 'layer9_eta'"),
        (["coated-gold", "--to", "python", "--model", "weier"], "unknown model 'weier' (did you mean weier2020?)"),
        (["gold", "--to", "json"], "unknown preset 'gold'"),
    ],
)
def test_wrong_input_is_said_in_a_line(arguments: list[str], message: str, run: Run, tmp_path: Path) -> None:
    status, out, err = run("export", *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err
