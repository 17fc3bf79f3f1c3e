"""Names of materials and paths of textures that would break out of a file, in every format.

Rationale: names and paths come from strangers' files. An export is read as its language is, and must have the structure
of the export with a harmless name: the syntax tree of Python, the elements of XML, the keys of JSON, and of shaders the
code that remains without comments and strings, by the strictest reading of both.
"""

from __future__ import annotations

import ast
import functools
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import pytest
from machines import MACHINES

import velatura as vt
from velatura.exports import FORMATS, baked, klems, real_time
from velatura.exports.request import Request
from velatura.model import named
from velatura.shader import closures
from velatura.stack import Texture

HARMLESS = "Plain paint"
HOSTILE = [
    "'''", '"""', "'''+str(__import__('os').system('false'))+'''", '"+str(1)+"', "\\'''", '\\"', "\\", "C:\\new\\x",
    "end ??/", "??/", "???/", "??'", "*/ int x; /*", "/*", "//", "// \\", "--", "---", "-----", "-", "-->", "--!>",
    "<!-- velatura {} -->", "]]>", "<![CDATA[", "<a b='", "&", "&amp;", "&#0;", "?>", "<?xml?>", "<!DOCTYPE a>",
    "{name}", "{0}", "{{", "%s %n", "${x} $(x) `x`", "#define float int", "#", "\\u000a", "\\N{DIGIT ONE}", "[[ ]]",
    "vt_lobes VtLobes VT_TABLES", "shader closure", ");}", "\u202ereversed", "\u200b\ufeff\u00ad", "é 漢字 🎨", "0",
    "<UDIM> %04d", "x" * 200, "...",
]  # fmt: skip
CONTROL = ["\n", "\r", "a\0", "\x1b[2J", "\x7f", "\x85", "\u2028", "\u2029", "\ud800", "\ufffe", "\uffff"]
MODEL = "belcour2018"

TEXTS = [name for name, each in FORMATS.items() if each.is_text]
UNIFORM = "bsdf-xml", "three", "three-webgpu", "babylon", "godot", "unity", "unreal"  # which have no textures
PAINTED = [name for name in TEXTS if name not in UNIFORM]

Structure = Callable[[str], Any]


def of_python(text: str) -> Any:
    """The syntax tree without texts; a shader among these as code."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            node.value = of_code(node.value) if "\nshader " in node.value else "text"
    return ast.dump(tree)


def of_xml(text: str) -> Any:
    """Elements and comments in order, with the keys of their attributes."""
    builder = ElementTree.TreeBuilder(insert_comments=True, insert_pis=True)
    root = ElementTree.fromstring(text, ElementTree.XMLParser(target=builder))
    node = re.compile(r"velatura_lobes_[a-z0-9_]+")  # of MaterialX, by the name of the material
    return [(node.sub("node", str(each.tag)), sorted(each.attrib)) for each in root.iter()]


def of_json(text: str) -> Any:
    """Values with texts left out."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: plain(each) for key, each in value.items()}
        return (
            [plain(each) for each in value] if isinstance(value, list) else "text" if isinstance(value, str) else value
        )

    return plain(json.loads(text))


_READ = re.compile(r'(?P<string>"(?:[^"\\]|\\.)*")|//[^\n]*|/\*.*?\*/', re.DOTALL)


def of_code(text: str) -> str:
    """Code without comments and strings, by a reader of trigraphs, continued lines, and every end of a line."""
    text = re.sub(r"\\[ \t]*\n", "", re.sub("\r\n?|[\v\f\x85\u2028\u2029]", "\n", text.replace("??/", "\\")))
    code = _READ.sub(lambda found: "text" if found["string"] else "", text)
    return re.sub(r"\n\s*\n", "\n", re.sub(r"^shader \w+", "shader", code, flags=re.MULTILINE))


def of_usd(text: str) -> Any:
    """Paths and kinds of all that a layer holds."""
    sdf = pytest.importorskip("pxr.Sdf", reason='usd-core is missing: pip install "velatura[usd]"')
    layer, found = sdf.Layer.CreateAnonymous(".usda"), list[tuple[str, list[str]]]()
    assert layer.ImportFromString(text)

    def seen(path: Any) -> None:
        if spec := layer.GetObjectAtPath(path):  # there is none of a connection
            found.append((str(path), sorted(spec.ListInfoKeys())))

    layer.Traverse("/", seen)
    return found


def of_resource(text: str) -> Any:
    """A resource of Godot: what remains without texts, and the code of its shader."""
    code = re.search(r'^code = ("(?:[^"\\]|\\.)*")', text, re.MULTILINE)
    assert code
    return re.sub(r'"(?:[^"\\]|\\.)*"', "text", text), of_code(json.loads(code[1]))


STRUCTURES: dict[str, Structure] = {
    ".tres": of_resource,
    ".usda": of_usd,
    ".py": of_python,
    ".xml": of_xml,
    ".mtlx": of_xml,
    ".json": of_json,
    ".gltf": of_json,
}


def structure(to: str) -> Structure:
    return STRUCTURES.get(FORMATS[to].endings[0], of_code)


def beside(made: vt.exports.Export) -> dict[str, str]:
    """Code that lies beside a file, by ending."""
    return {end: of_code(data.decode()) for end, data in made.beside.items() if end in (".cs", ".ush")}


FIT, ENVIRONMENT, FITTED = baked.bake, real_time.environment, dict[Any, Any]()


@pytest.fixture(autouse=True)
def fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers do not depend on names: they are fitted once for all tests, or are few, or are 0."""

    def of_any_name(stack: vt.Stack | vt.Mix, target: str, *rest: Any, **options: Any) -> Any:
        key = target, *((name, type(value)) for name, value in stack.flat().items())
        made = FITTED[key] = FITTED.get(key) or FIT(stack, target, *rest, **options)
        texture: Any = next((x for x in stack.flat().values() if isinstance(x, Texture)), None)
        images = {name: replace(image, texture=texture) for name, image in made.images.items()}
        return replace(made, name=stack.name, images=images)

    monkeypatch.setattr(baked, "bake", of_any_name)
    monkeypatch.setattr(real_time, "environment", lambda request: parts())
    monkeypatch.setattr(closures, "PAIRS", 16)
    monkeypatch.setattr(klems, "PATCHES", 2)
    monkeypatch.setattr(klems, "sides", lambda bsdf, side: np.zeros((2, 2, 2)))


@functools.cache
def parts() -> Any:
    return ENVIRONMENT(Request("three", painted(), named(MODEL), {}, None, {}))


def painted(name: str = HARMLESS, albedo: Any = 0.4) -> vt.Stack:
    return vt.Stack([vt.Diffuse(albedo=albedo)], name=name)


def srgb(path: Path) -> dict[str, str]:
    """A texture that glTF carries."""
    return {"texture": str(path), "encoding": "srgb"}


def texts(value: Any) -> Iterator[str]:
    """All texts in JSON."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from texts(each)


@pytest.mark.parametrize("to", TEXTS)
def test_names_do_not_change_the_structure_of_files(to: str) -> None:
    """Expected: the structure of a harmless name, and in JSON the name itself; the same code beside the file."""
    read, harmless = structure(to), vt.export(painted(), to, MODEL)
    expected, others = read(harmless.text), beside(harmless)
    for name in HOSTILE:
        made = vt.export(painted(name), to, MODEL)
        assert read(made.text) == expected, name
        assert beside(made) == others, name
        if read is of_json:
            assert name in texts(json.loads(made.text))


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A picture under a harmless path, and under hostile ones."""
    folder = tmp_path_factory.mktemp("maps")
    harmless = folder / "plain.png"
    vt.scenes.write_image(np.full((2, 2, 3), 0.5, np.float32), harmless)
    found = [harmless]
    for k, name in enumerate(HOSTILE):
        path = folder / str(k) / f"{name.lstrip('/')}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.hardlink_to(harmless)
        found.append(path)
    return found


@pytest.mark.parametrize("to", PAINTED)
def test_paths_of_textures_do_not_change_the_structure_of_files(to: str, maps: list[Path]) -> None:
    """Expected: the structure of a harmless path, and in JSON the path itself."""
    read = structure(to)
    expected = read(vt.export(painted(albedo=srgb(maps[0])), to, MODEL).text)
    for path in maps[1:]:
        text = vt.export(painted(albedo=srgb(path)), to, MODEL).text
        assert read(text) == expected, path.name
        if read is of_json:
            found, end = json.loads(text), f"/{path.parent.name}/{path.name}"
            assert any(each.endswith(end) for each in texts(found))
            assert to != "gltf" or unquote(found["images"][0]["uri"]).endswith(end)


@pytest.mark.parametrize("to", PAINTED)
def test_mixtures_keep_their_structure(to: str, maps: list[Path]) -> None:
    """Expected: the same of the names of a mixture and of a part, and of the path of a mask."""

    def worn(name: str, mask: Path) -> str:
        weight = {"texture": str(mask), "channel": "g"}
        return vt.export(vt.Mix([(weight, painted(name)), (None, painted())], name=name), to, MODEL).text

    read = structure(to)
    expected = read(worn(HARMLESS, maps[0]))
    for name, path in list(zip(HOSTILE, maps[1:]))[::2]:
        text = worn(name, path)
        assert read(text) == expected, name
        if read is of_json:
            assert name in texts(json.loads(text))


@pytest.mark.parametrize("to", MACHINES)
def test_compilers_take_hostile_names(to: str, maps: list[Path]) -> None:
    """Expected: no error, where the last character of a comment would continue its line."""
    machine = MACHINES[to]
    if why := machine.missing():
        pytest.skip(why)
    (path,) = (path for path in maps if path.name == "\\.png")
    text = vt.export(painted("*/ \\ ??/", srgb(path)), to, MODEL).text
    machine.compile("\n".join([text, machine.declarations(1), machine.main([])]))


@pytest.mark.parametrize("character", CONTROL)
def test_names_and_paths_refuse_control_characters(character: str, tmp_path: Path) -> None:
    with pytest.raises(vt.InvalidInput, match=r"^name: must be ") as refused:
        painted(f"Red{character}paint")
    assert "\n" not in str(refused.value)
    if character not in ("a\0", "\ud800"):  # no names of files
        path = tmp_path / f"a{character}b.png"
        path.touch()
        with pytest.raises(vt.InvalidInput, match=r"albedo: texture: must be a path without control characters"):
            painted(albedo={"texture": path})


@pytest.mark.parametrize("seconds", ["abc", "100000000000000000000", "-1", "1e9", "1_0", "٣", "9" * 5000])
def test_a_date_that_is_none_gets_one_line(seconds: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", seconds)
    with pytest.raises(vt.InvalidInput, match=r"^SOURCE_DATE_EPOCH: must be whole seconds since 1970, 0 to \d+, got "):
        vt.export(painted(), "glsl", MODEL)


@pytest.mark.parametrize("ending", [".gltf", ".mtlx", ".xml"])
def test_names_of_foreign_files_are_cleaned(ending: str, tmp_path: Path) -> None:
    """Expected: no control character, and a note that says so."""
    name, path = "Red\x85'''\u2028paint", tmp_path / f"red{ending}"
    written = {
        ".gltf": json.dumps({"asset": {"version": "2.0"}, "materials": [{"name": f"{name}\0\n"}]}),
        ".mtlx": f'<materialx version="1.39"><open_pbr_surface name="{name}" type="surfaceshader"/></materialx>',
        ".xml": f'<scene version="3.0.0"><bsdf type="principled" id="{name}"/></scene>',
    }
    path.write_text(written[ending], encoding="utf-8")
    found = vt.imports.read(path)
    assert found.stack.name == "Red ''' paint"
    assert "name Red ''' paint: control characters are left out" in map(str, found.left)
