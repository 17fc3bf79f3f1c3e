"""Files of other programs: what is read of them, and what is refused, in one line."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import imports

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """A file beside an image `wood.png`."""
    (tmp_path / "wood.png").touch()

    def written(name: str, text: str | bytes) -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return written


def document(inside: str, attributes: str = "") -> str:
    return f'<?xml version="1.0"?>\n<materialx version="1.39" {attributes}>\n{inside}\n</materialx>\n'


def node(inputs: str, name: str = "S", tag: str = "open_pbr_surface") -> str:
    return (
        f'<{tag} name="{name}" type="surfaceshader">{inputs}</{tag}>'
        f'<surfacematerial name="M_{name}" type="material">'
        f'<input name="surfaceshader" type="surfaceshader" nodename="{name}"/></surfacematerial>'
    )


def number(name: str, value: object) -> str:
    return f'<input name="{name}" type="float" value="{value}"/>'


def refusal(call: Callable[[], object]) -> str:
    with pytest.raises(vt.InvalidInput) as caught:
        call()
    assert "\n" not in str(caught.value)
    return str(caught.value)


# MaterialX -----------------------------------------------------------------------------------------------------------


def test_a_surface_of_materialx_is_that_of_its_parameters(write: Write) -> None:
    inputs = number("coat_weight", 1) + number("specular_roughness", 0.5)
    inputs += '<input name="base_color" type="color3" value="0.2, 0.4, 0.6"/>'
    inputs += '<input name="geometry_thin_walled" type="boolean" value="false"/>'
    found = imports.read(write("a.mtlx", document(node(inputs))))
    expected = vt.from_openpbr(coat_weight=1, specular_roughness=0.5, base_color=(0.2, 0.4, 0.6))
    assert found.stack.layers == expected.stack.layers and found.left == expected.left == ()
    assert (found.stack.name, found.stack.source) == ("M_S", "imported from OpenPBR")


def test_colours_are_read_in_their_space(write: Write) -> None:
    """Expected: white stays white, sRGB is decoded, a colour of ACEScg is converted; the nearest attribute counts."""

    def base(space: str, value: str) -> Any:
        given = f'<input name="base_color" type="color3" value="{value}" {space}/>' + number("specular_weight", 0)
        stack = imports.read(write("a.mtlx", document(node(given), 'colorspace="acescg"'))).stack
        assert stack.base
        return np.array(stack.base.albedo)

    np.testing.assert_allclose(base("", "0.5, 0.5, 0.5"), 0.5, atol=1e-4)
    # The green of sRGB in the primaries AP1 (ACES), by the transform of the Colour library
    np.testing.assert_allclose(base("", "0.3395, 0.9166, 0.1096"), [0, 1, 0], atol=2e-3)
    np.testing.assert_allclose(base('colorspace="srgb_texture"', "0.5, 0.5, 0.5"), 0.21404, atol=1e-4)
    np.testing.assert_allclose(base('colorspace="lin_rec709"', "0.5, 0.1, 0.2"), [0.5, 0.1, 0.2], atol=1e-6)


GRAPH = """
<nodegraph name="G" fileprefix="./">
  <image name="wood" type="color3">
    <input name="file" type="filename" value="wood.png" colorspace="srgb_texture"/>
  </image>
  <image name="grey" type="float"><input name="file" type="filename" value="wood.png"/></image>
  <constant name="half" type="float"><input name="value" type="float" value="0.5"/></constant>
  <multiply name="scaled" type="float">
    <input name="in1" type="float" nodename="grey"/><input name="in2" type="float" nodename="half"/>
  </multiply>
  <noise2d name="noise" type="float"/>
  <extract name="green" type="float">
    <input name="in" type="color3" nodename="wood"/><input name="index" type="integer" value="1"/>
  </extract>
  <output name="wood_out" type="color3" nodename="wood"/>
  <output name="scaled_out" type="float" nodename="scaled"/>
  <output name="noise_out" type="float" nodename="noise"/>
  <output name="half_out" type="float" nodename="half"/>
  <output name="green_out" type="float" nodename="green"/>
</nodegraph>
"""


def connected(name: str, output: str, kind: str = "float") -> str:
    return f'<input name="{name}" type="{kind}" nodegraph="G" output="{output}"/>'


def test_images_and_constants_are_followed_through_graphs(write: Write, tmp_path: Path) -> None:
    inputs = connected("base_color", "wood_out", "color3") + connected("specular_roughness", "scaled_out")
    inputs += connected("specular_weight", "half_out") + connected("coat_weight", "noise_out")
    inputs += connected("geometry_normal", "noise_out", "vector3")
    found = imports.read(write("a.mtlx", document(GRAPH + node(inputs))))
    interface, base = found.stack.layers
    assert isinstance(interface, vt.Interface) and isinstance(base, vt.Diffuse)
    assert isinstance(interface.alpha, vt.Texture) and isinstance(base.albedo, vt.Texture)
    assert interface.eta == vt.from_openpbr(specular_weight=0.5).stack.interfaces[0].eta
    assert interface.alpha.curve and interface.alpha.curve[-1] == 0.25  # the square of a half
    assert (base.albedo.texture, base.albedo.encoding) == (tmp_path / "wood.png", "srgb")
    assert [each.parameter for each in found.left] == ["coat_weight", "geometry_normal"]
    assert "the node noise (noise2d) is no number and no plain image" in found.left[0].why
    channel = imports.read(write("a.mtlx", document(GRAPH + node(connected("specular_roughness", "green_out")))))
    assert channel.stack.interfaces[0].alpha.channel == "g"  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("tag", "inputs", "expected"),
    [
        (
            "standard_surface",
            number("metalness", 1) + number("specular_rotation", 0.5) + number("specular_anisotropy", 0.5),
            lambda: imports.from_standard_surface(metalness=1, specular_rotation=0.5, specular_anisotropy=0.5),
        ),
        (
            "gltf_pbr",
            number("metallic", 0) + number("clearcoat", 1) + number("iridescence", 1),
            lambda: imports.from_gltf(
                {
                    "pbrMetallicRoughness": {"metallicFactor": 0},
                    "extensions": {
                        "KHR_materials_clearcoat": {"clearcoatFactor": 1},
                        "KHR_materials_iridescence": {"iridescenceFactor": 1, "iridescenceThicknessMaximum": 100},
                    },
                }
            ),
        ),
        (
            "disney_principled",
            number("specTrans", 1) + number("specular", 0.5) + number("ior", 1.7),
            lambda: imports.from_principled({"spec_trans": 1, "eta": 1.7, "base_color": 0.16}),
        ),
    ],
)
def test_other_surfaces_of_materialx_are_read(write: Write, tag: str, inputs: str, expected: Any) -> None:
    found = imports.read(write("a.mtlx", document(node(inputs, tag=tag))))
    assert found.stack.layers == expected().stack.layers


def test_the_gloss_of_materialx_is_roughness(write: Write) -> None:
    """Expected: alpha is the square of 1 - gloss (`disney_principled.mtlx`); what Mitsuba's has not is listed."""
    for gloss, alpha, left in ((0.8, 0.04, []), (0.5, 0.1, ["clearcoat_gloss"])):
        inputs = number("clearcoat", 1) + number("clearcoatGloss", gloss)
        found = imports.read(write("a.mtlx", document(node(inputs, tag="disney_principled"))))
        assert found.stack.interfaces[0].alpha == pytest.approx(alpha, rel=1e-4)
        assert [each.parameter for each in found.left] == left


def test_turned_tangents_are_rotations(write: Write) -> None:
    """Expected: of what turns the tangent of the surface; other vectors are listed."""
    nodes = """<tangent name="t" type="vector3"/><bitangent name="b" type="vector3"/>
    <rotate3d name="r" type="vector3">
      <input name="in" type="vector3" nodename="t"/><input name="amount" type="float" value="30"/>
    </rotate3d>"""
    inputs = number("base_metalness", 1) + number("specular_roughness_anisotropy", 0.5)
    inputs += '<input name="geometry_tangent" type="vector3" nodename="{}"/>'
    found = imports.read(write("a.mtlx", document(nodes + node(inputs.format("r")))))
    assert found.stack.interfaces[0].rotation == 30 and found.left == ()
    found = imports.read(write("a.mtlx", document(nodes + node(inputs.format("b")))))
    assert [each.parameter for each in found.left] == ["geometry_tangent"]


def test_one_of_several_materials_is_named(write: Write, tmp_path: Path) -> None:
    two = node(number("base_metalness", 1), "A") + node("", "B")
    path = write("a.mtlx", document(two))
    assert refusal(lambda: imports.read(path)) == f"{path}: has 2 materials; name one, as in a.mtlx#NAME: M_A, M_B"
    assert imports.read(path, "M_A").stack.kinds == imports.read(f"{path}#M_A").stack.kinds == ("conductor",)
    assert vt.load(f"{path}#M_B").kinds == ("dielectric", "diffuse")
    assert "unknown material 'M_C' (did you mean M_" in refusal(lambda: imports.read(path, "M_C"))
    # A document may include others, and shaders need no material
    write("b.mtlx", document('<xi:include href="a.mtlx"/>', 'xmlns:xi="http://www.w3.org/2001/XInclude"'))
    assert imports.read(tmp_path / "b.mtlx", "M_A").stack.name == "M_A"
    bare = write("c.mtlx", document('<open_pbr_surface name="bare" type="surfaceshader"/>'))
    assert imports.read(bare).stack.name == "bare"


LAUGHS = '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><materialx>&b;</materialx>'
LOOP = """<nodegraph name="G">
  <dot name="d" type="float"><input name="in" nodename="d"/></dot><output name="half_out" nodename="d"/>
</nodegraph>"""
HOSTILE = {
    "no document": ("<a/>", "is no document of MaterialX: begins with 'a'"),
    "broken": ("<materialx>", "line 1: is not valid XML: no element found"),
    "empty": ("", "line 1: is not valid XML: no element found"),
    "no text": (b"\xff\xfe\x00", "is not valid XML"),
    "entities": (LAUGHS, "line 1: has a document type, which is not read"),
    "deep": ("<materialx>" + "<a>" * 200, "within each other"),
    "many": ("<materialx>" + "<a/>" * 200_001, "holds more than 200000 elements"),
    "large": ("<materialx>" + " " * 2**24, "is larger than 16 MiB"),
    "encoding": ('<?xml version="1.0" encoding="none"?><materialx/>', "unknown encoding"),
    "no material": (document(""), "has no material that is read here"),
    "no surface": (document('<surfacematerial name="M"/>'), "material M: has no surface"),
    "lost": (
        document('<surfacematerial name="M"><input name="surfaceshader" nodename="S"/></surfacematerial>'),
        "material M: there is no node S",
    ),
    "other surface": (document(node("", tag="UsdPreviewSurface")), "its surface UsdPreviewSurface is none of"),
    "unknown input": (document(node(number("coat", 1))), "material M_S: unknown parameter 'coat'"),
    "no image": (
        document(GRAPH.replace("wood.png", "oak.png") + node(connected("base_color", "wood_out", "color3"))),
        "oak.png",
    ),
    "itself": (document('<xi:include href="a.mtlx"/>', 'xmlns:xi="x"'), "includes itself"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_other_documents_are_refused_in_one_line(write: Write, kind: str) -> None:
    text, message = HOSTILE[kind]
    path = write("a.mtlx", text)
    assert message in refusal(lambda: imports.read(path)) and str(path) in refusal(lambda: vt.load(path))


def test_cycles_are_left_out(write: Write) -> None:
    """Expected: of nodes, and of an image's file that is an input of its own graph."""
    graph = """<nodegraph name="G"><input name="file" type="filename" interfacename="file"/>
      <image name="i" type="color3"><input name="file" type="filename" interfacename="file"/></image>
      <output name="o" type="color3" nodename="i"/></nodegraph>"""
    found = imports.read(write("a.mtlx", document(graph + node(connected("base_color", "o", "color3")))))
    assert "the node i (image) names no file" in str(found.left[0])
    found = imports.read(write("a.mtlx", document(LOOP + node(connected("coat_weight", "half_out")))))
    assert str(found.left[0]) == "coat_weight G: a cycle of nodes; its default stands for it"


# glTF ----------------------------------------------------------------------------------------------------------------

GLTF: dict[str, Any] = {
    "asset": {"version": "2.0"},
    "images": [{"uri": "wood.png"}, {"uri": "data:image/png;base64,AAAA"}],
    "textures": [{"source": 0}, {"source": 1}],
    "materials": [
        {
            "name": "Painted",
            "pbrMetallicRoughness": {
                "metallicFactor": 0,
                "roughnessFactor": 0.5,
                "metallicRoughnessTexture": {"index": 0},
                "baseColorTexture": {"index": 1},
            },
            "normalTexture": {"index": 0},
            "emissiveFactor": [1, 1, 1],
            "alphaMode": "MASK",
            "extensions": {
                "KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.2},
                "KHR_materials_ior": {"ior": 1.4},
                "KHR_materials_unlit": {},
            },
        },
        {
            "pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.6, 0.2, 1]},
            "extensions": {
                "KHR_materials_iridescence": {
                    "iridescenceFactor": 1,
                    "iridescenceIor": 1.8,
                    "iridescenceThicknessTexture": {"index": 0},
                }
            },
        },
        {
            "name": "Glass",
            "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0, "baseColorFactor": [1, 1, 1, 1]},
            "extensions": {
                "KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_volume": {
                    "thicknessFactor": 1,
                    "attenuationDistance": 0.5,
                    "attenuationColor": [0.5, 0.5, 1],
                },
            },
        },
    ],
}


def binary(document: bytes) -> bytes:
    padded = document + b" " * (-len(document) % 4)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(padded), len(padded), b"JSON") + padded


@pytest.mark.parametrize("ending", [".gltf", ".glb"])
def test_materials_of_gltf_are_read(write: Write, tmp_path: Path, ending: str) -> None:
    """Expected: factors times images in their channels; those inside the file, and other parts, are listed."""
    text = json.dumps(GLTF).encode()
    path = write(f"a{ending}", binary(text) if ending == ".glb" else text)
    assert "has 3 materials" in refusal(lambda: imports.read(path))
    found = imports.read(path, "Painted")
    coat, base, _ = found.stack.layers
    assert isinstance(coat, vt.Interface) and isinstance(base, vt.Interface) and isinstance(base.alpha, vt.Texture)
    assert (coat.eta, coat.alpha) == (1.5, 0.04) and base.eta == pytest.approx(1.5 * 1.4, rel=1e-5)
    assert (base.alpha.texture, base.alpha.channel) == (tmp_path / "wood.png", "g")
    assert base.alpha.curve and base.alpha.curve[-1] == 0.25
    left = {each.parameter: each.why for each in found.left}
    assert left.pop("baseColorTexture") == "inside the file: left out"
    assert set(left) == {"normalTexture", "emissiveFactor", "alpha", "KHR_materials_unlit"}
    (film,) = imports.read(path, "material 1").stack.interfaces[0].films
    assert film.eta == 1.8 and isinstance(film.thickness_nm, vt.Texture)
    assert (film.thickness_nm.offset, film.thickness_nm.scale) == (pytest.approx(100), pytest.approx(300))
    glass = imports.read(path, "Glass")
    assert glass.stack.kinds == ("dielectric",) and not glass.stack.thin
    assert f"sigma_a [{2 * np.log(2):.4g}, {2 * np.log(2):.4g}, 0]" in str(glass.left[0])


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.gltf", "{", "line 1: is not valid JSON"),
        ("a.gltf", "[]", "is no glTF: has no asset"),
        ("a.gltf", "[" * 100_000, "a.gltf: "),
        ("a.gltf", b"\xff", "is not UTF-8 text"),
        ("a.gltf", '{"asset": {}}', "has no material that is read here"),
        ("a.gltf", '{"asset": {}, "materials": 3}', "materials: must be a list, got 3"),
        ("a.gltf", '{"asset": {}, "materials": [3]}', "material 0: must hold keys and values, got 3"),
        ("a.gltf", '{"asset": {}, "materials": [{"extensions": 3}]}', "extensions: must hold keys and values, got 3"),
        (
            "a.gltf",
            '{"asset": {}, "materials": [{"extensions": {"KHR_materials_ior": 2}}]}',
            "KHR_materials_ior: must hold keys and values, got 2",
        ),
        (
            "a.gltf",
            '{"asset": {}, "materials": [{"emissiveFactor": ["x"]}]}',
            "emissiveFactor: must be a number or [r, g, b]",
        ),
        (
            "a.gltf",
            '{"asset": {}, "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 4}}}]}',
            "textures: has no image of index 4",
        ),
        (
            "a.gltf",
            '{"asset": {}, "materials": [{"pbrMetallicRoughness": {"roughnessFactor": "x"}}]}',
            "roughnessFactor: must be a number, got 'x'",
        ),
        ("a.glb", b"glTF", "its first chunk is not JSON"),
        ("a.glb", b"glTF" + b"\xff" * 40, "its first chunk is not JSON"),
    ],
)
def test_other_gltf_is_refused_in_one_line(write: Write, name: str, text: str | bytes, message: str) -> None:
    path = write(name, text)
    assert message in refusal(lambda: imports.read(path))


# Mitsuba -------------------------------------------------------------------------------------------------------------

SCENE = """<scene version="3.0.0">
    <default name="rough" value="0.4"/>
    <bsdf type="twosided" id="painted">
        <bsdf type="principled">
            <rgb name="base_color" value="0.2, 0.4 0.6"/>
            <float name="roughness" value="$rough"/>
            <float name="clearcoat" value="1"/>
            <float name="main_specular_sampling_rate" value="2"/>
            <ref name="normal" id="x"/>
        </bsdf>
    </bsdf>
    <shape type="sphere">
        <bsdf type="mask"><bsdf type="principled" id="gold">
            <rgb name="base_color" value="#ffbb55"/>
            <float name="metallic" value="1"/>
            <texture name="roughness" type="bitmap">
                <string name="filename" value="wood.png"/><boolean name="raw" value="true"/>
            </texture>
        </bsdf></bsdf>
    </shape>
</scene>"""


def test_principled_is_read_from_scenes(write: Write) -> None:
    path = write("scene.xml", SCENE)
    found = imports.read(path, "painted")
    expected = imports.from_principled({"base_color": [0.2, 0.4, 0.6], "roughness": 0.4, "clearcoat": 1.0})
    assert found.stack.layers == expected.stack.layers
    assert [each.parameter for each in found.left] == ["normal"]
    gold = imports.read(path, "gold")
    metal = gold.stack.interfaces[0]
    assert isinstance(metal.alpha, vt.Texture) and metal.alpha.encoding == "linear"
    reflectance = ((np.array(metal.eta) - 1) ** 2 + np.array(metal.k) ** 2) / (
        (np.array(metal.eta) + 1) ** 2 + np.array(metal.k) ** 2
    )
    encoded = np.array([0xFF, 0xBB, 0x55]) / 255
    np.testing.assert_allclose(reflectance, np.minimum(((encoded + 0.055) / 1.055) ** 2.4, 0.998), atol=1e-4)
    assert [each.parameter for each in gold.left] == ["bsdf mask"]


def test_principled_is_read_from_dictionaries(write: Write, tmp_path: Path) -> None:
    """Expected: what `mi.load_dict` takes; a texture of another kind is listed."""
    given = {
        "type": "principled",
        "base_color": {"type": "rgb", "value": [0.2, 0.4, 0.6]},
        "roughness": {"type": "bitmap", "filename": str(tmp_path / "wood.png"), "raw": True},
        "metallic": {"type": "checkerboard"},
    }
    found = imports.from_principled(given)
    assert isinstance(found.stack.interfaces[0].alpha, vt.Texture)
    assert [each.parameter for each in found.left] == ["metallic"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<a/>", "is no scene of Mitsuba: begins with 'a'"),
        ('<scene version="3.0.0"/>', "has no material that is read here"),
        (
            '<scene version="3.0.0"><bsdf type="principled"><float name="rough" value="1"/></bsdf></scene>',
            "bsdf 0: unknown parameter 'rough' (did you mean roughness?)",
        ),
    ],
)
def test_other_scenes_are_refused_in_one_line(write: Write, text: str, message: str) -> None:
    path = write("a.xml", text)
    assert message in refusal(lambda: imports.read(path))


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    for ending in imports.FORMATS:
        path = tmp_path / f"none{ending}"
        assert refusal(lambda path=path: imports.read(path)) == f"{path}: file not found"  # type: ignore[misc]
    assert "a file to import ends in .mtlx, .gltf, .glb, .xml" in refusal(lambda: imports.read("a.usd"))
    (tmp_path / "a.mtlx").mkdir()
    assert "is a folder" in refusal(lambda: vt.load(tmp_path / "a.mtlx"))
    assert "cannot be read: is a directory" in refusal(lambda: imports.read(tmp_path / "a.mtlx"))
