"""Files of other programs: what is read of them, and what is refused, in one line."""

from __future__ import annotations

import base64
import json
import os
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import imports, kernel
from velatura.programs.values import texels

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


def test_a_look_names_the_material(write: Write) -> None:
    """Expected: the only one that looks assign needs no name; of two, or of an unknown one, the name is asked for."""
    two, assigned = node(number("base_metalness", 1), "A") + node("", "B"), '<materialassign name="{}" material="{}"/>'

    def looks(*materials: str) -> Path:
        inside = "".join(assigned.format(k, each) for k, each in enumerate(materials))
        return write("a.mtlx", document(f'{two}<look name="L">{inside}</look>'))

    assert imports.read(looks("M_A", "M_A")).stack.kinds == ("conductor",)
    assert imports.read(looks("M_A"), "M_B").stack.name == "M_B"
    for path in (looks("M_A", "M_B"), looks("M_C"), looks()):
        assert "has 2 materials; name one" in refusal(lambda path=path: imports.read(path))  # type: ignore[misc]


def test_inputs_of_newer_versions_are_left_out(write: Write) -> None:
    """Expected: those of OpenPBR 1.2 where they differ from its defaults; what is unknown with what looks alike."""
    defaults = number("specular_haze", 0.0) + number("specular_haze_spread", 0.3)
    assert imports.read(write("a.mtlx", document(node(defaults)))).left == ()
    inputs = number("specular_haze", 0.4) + number("specular_haze_spread", 0.5) + number("sparkle", 2)
    inputs += number("specular_retroreflectivity", 1) + number("coat_weigth", 1) + number("base_metalness", 1)
    found = imports.read(write("a.mtlx", document(node(inputs))))
    assert found.stack.kinds == ("conductor",)
    assert {each.parameter: each.value for each in found.left} == {
        **{"specular_haze": "0.4", "specular_haze_spread": "0.5", "specular_retroreflectivity": "1"},
        **{"coat_weigth": "1", "sparkle": "2"},
    }
    why = {each.parameter: each.why for each in found.left}
    assert why["coat_weigth"] == "unknown input 'coat_weigth' (did you mean coat_weight?): left out"
    assert why["sparkle"] == "unknown input 'sparkle': left out"


XI = 'xmlns:xi="http://www.w3.org/2001/XInclude"'


def test_included_documents_are_read_once_and_share_their_nodes(write: Write) -> None:
    """Expected: of 60 documents that include the next twice, the last is read once; it keeps what its root says."""
    for k in range(60):
        twice = f'<xi:include href="d{k + 1}.mtlx"/>' * 2
        write(f"d{k}.mtlx", document(twice + (node("", f"S{k}") if k == 0 else ""), XI))
    base = '<input name="base_color" type="color3" value="0.5, 0.5, 0.5"/>' + number("specular_weight", 0)
    write("d60.mtlx", document(node(base, "deep") + GRAPH, 'colorspace="srgb_texture"'))
    stack = imports.read(write("d0.mtlx", (write("d0.mtlx", b"").parent / "d1.mtlx").read_bytes())).stack
    assert stack.base is not None
    np.testing.assert_allclose(stack.base.albedo, 0.21404, atol=1e-4)
    # A document uses the graph that another includes
    write("graph.mtlx", document(GRAPH))
    write("surface.mtlx", document(node(connected("specular_roughness", "half_out"))))
    both = write("a.mtlx", document('<xi:include href="surface.mtlx"/><xi:include href="graph.mtlx"/>', XI))
    assert imports.read(both).stack.interfaces[0].alpha == 0.25


def test_one_budget_holds_for_all_that_is_included(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    for k in range(3):
        write(f"b{k}.mtlx", document("<a/>" * 90_000))
    includes = "".join(f'<xi:include href="b{k}.mtlx"/>' for k in range(3))
    path = write("a.mtlx", document(includes, XI))
    assert "b2.mtlx: line 3: holds more than 200000 elements" in refusal(lambda: imports.read(path))
    for k in range(300):
        write(f"c{k}.mtlx", document(f'<xi:include href="c{k + 1}.mtlx"/>', XI))
    assert "c256.mtlx: holds more than 256 files" in refusal(lambda: imports.read(path.with_name("c0.mtlx")))
    monkeypatch.setattr("velatura.files.SECONDS", -1.0)
    assert "a.mtlx: takes longer than -1 s to read" in refusal(lambda: imports.read(path))


def chain(length: int, each: str) -> str:
    nodes = "".join(each.format(name=f"n{k}", below=f"n{k + 1}") for k in range(length))
    last = f'<constant name="n{length}" type="float"><input name="value" type="float" value="0.5"/></constant>'
    return nodes + last


TWICE = """<add name="{name}" type="float"><input name="in1" type="float" nodename="{below}"/>
  <input name="in2" type="float" nodename="{below}"/></add>"""
ONCE = '<dot name="{name}" type="float"><input name="in" type="float" nodename="{below}"/></dot>'


def test_graphs_are_worked_out_node_by_node(write: Write) -> None:
    """Expected: 2^60 / 2 = 2^59 of a graph in which 60 nodes use the next twice; a long chain is not called a cycle."""
    rough = '<input name="specular_roughness" type="float" nodename="n0"/>'
    found = imports.read(write("a.mtlx", document(chain(60, TWICE) + node(rough))))
    assert found.left[0].value == f"{2.0**59:.4g}" and found.stack.interfaces[0].alpha == 1.0
    found = imports.read(write("a.mtlx", document(chain(5000, ONCE) + node(rough))))
    assert "more than 64 nodes in a row" in str(found.left[0])
    wide = "".join(chain(40, TWICE).replace('"n', f'"{k}n') for k in range(400))
    names = [f'<input name="specular_roughness" type="float" nodename="{k}n0"/>' for k in range(400)]
    assert "holds more than 10000 nodes" in refusal(
        lambda: imports.read(write("a.mtlx", document(wide + node("".join(names)))))
    )


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
    "other surface": (document(node("", tag="surface_unlit")), "its surface surface_unlit is none of"),
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


SURFACES = (
    '<open_pbr_surface name="paint" type="surfaceshader"><input name="base_color" type="color3" value="0.1, 0.3, 0.6"/>'
    '<input name="fuzz_weight" type="float" value="0.2"/></open_pbr_surface>'
    '<standard_surface name="steel" type="surfaceshader"><input name="metalness" type="float" value="1"/>'
    "</standard_surface>"
)


def mixed(share: str, fg: str = "paint", bg: str = "steel", name: str = "S") -> str:
    sides = "".join(
        f'<input name="{key}" type="surfaceshader" nodename="{of}"/>' for key, of in (("fg", fg), ("bg", bg))
    )
    return f'<mix name="{name}" type="surfaceshader">{sides}{share}</mix>'


def of_surface(nodes: str) -> str:
    return document(
        f'{SURFACES}{nodes}<surfacematerial name="M" type="material">'
        '<input name="surfaceshader" type="surfaceshader" nodename="S"/></surfacematerial>'
    )


def test_a_mix_of_surfaces_is_a_mixture(write: Write, tmp_path: Path) -> None:
    """Expected: the stacks of both surfaces, the foreground by the share (MaterialX 1.39, "mix"); an image as it is."""
    paint, steel = (vt.from_openpbr(base_color=(0.1, 0.3, 0.6)), imports.from_standard_surface(metalness=1))
    found = imports.read(write("a.mtlx", of_surface(mixed(number("mix", 0.3)))))
    mix: Any = found.stack
    assert (mix.name, mix.source) == ("M", "imported from MaterialX")
    assert [part.weight for part in mix.mix] == [0.3, None]
    assert [part.material.layers for part in mix.mix] == [paint.stack.layers, steel.stack.layers]
    assert [part.material.name for part in mix.mix] == ["paint", "steel"]
    assert [each.parameter for each in found.left] == ["paint: fuzz_weight"]
    kernel.mitsuba().Bitmap(np.array([[[0.0], [1.0]]], np.float32)).write(str(tmp_path / "mask.exr"))
    image = '<image name="i" type="float"><input name="file" type="filename" value="mask.exr"/></image>'
    masked: Any = imports.read(
        write("a.mtlx", of_surface(image + mixed('<input name="mix" type="float" nodename="i"/>')))
    )
    weight = masked.stack.mix[0].weight
    assert isinstance(weight, vt.Texture) and weight.texture == tmp_path / "mask.exr"
    assert imports.read(write("a.mtlx", of_surface(mixed("")))).stack.layers == steel.stack.layers


def test_mixes_of_mixes_are_read_once(write: Write) -> None:
    """Expected: of forty nodes that each name the one before twice, the surface of the first."""
    nodes = mixed(number("mix", 0.5), "paint", "paint", "m0")
    nodes += "".join(mixed(number("mix", 0.5), f"m{n}", f"m{n}", f"m{n + 1}") for n in range(40))
    found: Any = imports.read(write("a.mtlx", of_surface(nodes + mixed(number("mix", 0.25), "m40"))))
    assert [part.material.name for part in found.stack.mix] == ["paint", "steel"]


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        (mixed("", bg="S"), "material M: a cycle of nodes"),
        (
            mixed("", bg="m0") + "".join(mixed("", bg=f"m{n + 1}", name=f"m{n}") for n in range(2000)),
            "material M: mixes more than 64 nodes",
        ),
        (mixed("", bg="other"), "material M: there is no node other"),
        ('<mix name="S" type="surfaceshader"/>', "material M: the node S lacks fg"),
        (
            mixed("", bg="u") + '<surface_unlit name="u" type="surfaceshader"/>',
            "material u: its surface surface_unlit is",
        ),
    ],
)
def test_mixes_of_other_surfaces_are_refused_in_one_line(write: Write, nodes: str, message: str) -> None:
    path = write("a.mtlx", of_surface(nodes))
    assert refusal(lambda: imports.read(path)).startswith(f"{path}: {message}")


def test_modes_of_alpha_are_those_of_gltf(write: Write) -> None:
    """Expected: the alpha where it is blended; all or nothing by the cutoff where it is a mask."""

    def read(mode: int, alpha: float) -> Any:
        inputs = number("alpha", alpha) + f'<input name="alpha_mode" type="integer" value="{mode}"/>'
        return imports.read(write("a.mtlx", document(node(inputs + number("alpha_cutoff", 0.4), tag="gltf_pbr")))).stack

    assert isinstance(read(0, 0.3), vt.Stack) and read(2, 0.3).mix[0].weight == 0.3
    assert read(1, 0.5) == read(0, 0.5) and read(1, 0.3).interfaces[0].eta == 1.0


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


def binary(document: bytes, chunk: bytes = b"") -> bytes:
    padded = document + b" " * (-len(document) % 4)
    chunk += b"\0" * (-len(chunk) % 4)
    rest = struct.pack("<I4s", len(chunk), b"BIN\0") + chunk if chunk else b""
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(padded) + len(rest), len(padded), b"JSON")
    return head + padded + rest


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
    assert left.pop("baseColorTexture") == "inside the file, neither PNG nor JPEG: left out"
    assert set(left) == {"normalTexture", "emissiveFactor", "KHR_materials_unlit"}
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
        (
            "a.gltf",
            '{"asset": {}, "materials": [{"pbrMetallicRoughness": {"roughnessFactor": %s}}]}' % ("9" * 400),
            "roughnessFactor: must be a number, got inf",
        ),
        (
            "a.gltf",
            '{"asset": {}, "materials": [{"pbrMetallicRoughness": {"roughnessFactor": true}}]}',
            "roughnessFactor: must be a number, got True",
        ),
        (
            "a.gltf",  # a text times a number would fill the memory
            '{"asset": {}, "materials": [{"emissiveFactor": [4000000000, 1, 1], "extensions": '
            '{"KHR_materials_emissive_strength": {"emissiveStrength": "text"}}}]}',
            "emissiveStrength: must be a number, got 'text'",
        ),
        ("a.gltf", '{"asset": {}, "asset": {}}', "key 'asset' appears twice"),
        ("a.glb", struct.pack("<4sIII4s", b"glTF", 1, 22, 2, b"JSON") + b"{}", "is glTF in version 1, and 2 is read"),
        ("a.glb", struct.pack("<4sIII4s", b"glTF", 2, 99, 2, b"JSON") + b"{}", "its head says 99 bytes, and it has 22"),
        ("a.glb", struct.pack("<4sIII4s", b"glTF", 2, 22, 9, b"JSON") + b"{}", "is not whole"),
        ("a.glb", b"glTF", "its first chunk is not JSON"),
        ("a.glb", b"glTF" + b"\xff" * 40, "its first chunk is not JSON"),
    ],
)
def test_other_gltf_is_refused_in_one_line(write: Write, name: str, text: str | bytes, message: str) -> None:
    path = write(name, text)
    assert message in refusal(lambda: imports.read(path))


def picture(tmp_path: Path, ending: str) -> bytes:
    """A red picture of 2 x 2 pixels, half bright, by Mitsuba."""
    mi = kernel.mitsuba()
    texels = np.full((2, 2, 3), [128, 64, 0], np.uint8)
    mi.Bitmap(texels).write(str(tmp_path / f"made{ending}"))
    return (tmp_path / f"made{ending}").read_bytes()


def with_image(data: bytes, inside: str, name: str = "wood") -> tuple[dict[str, Any], bytes]:
    """A document whose base colour is an image, in its own text, in a buffer there, or in the chunk beside it."""
    uri = f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}"
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "images": [{"uri": uri, "name": name} if inside == "text" else {"bufferView": 0, "name": name}],
        "textures": [{"source": 0}],
        "materials": [
            {"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": 0}}, "name": "Red"},
        ],
    }
    if inside != "text":
        document["bufferViews"] = [{"buffer": 0, "byteOffset": 4, "byteLength": len(data)}]
        padded = b"\0\0\0\0" + data
        buffer = f"data:application/octet-stream;base64,{base64.b64encode(padded).decode()}"
        document["buffers"] = [{"byteLength": len(padded)} | ({"uri": buffer} if inside == "buffer" else {})]
    return document, b"\0\0\0\0" + data if inside == "chunk" else b""


def written_with_image(write: Write, data: bytes, inside: str, **options: str) -> Path:
    document, chunk = with_image(data, inside, **options)
    text = json.dumps(document).encode()
    return write("red.glb", binary(text, chunk)) if inside == "chunk" else write("red.gltf", text)


@pytest.mark.parametrize(("inside", "ending"), [("text", ".png"), ("buffer", ".jpg"), ("chunk", ".png")])
def test_images_inside_gltf_are_read_and_written(write: Write, tmp_path: Path, inside: str, ending: str) -> None:
    """Expected: the bytes of the picture, in memory and beside the material that is written, under a plain name."""
    data = picture(tmp_path, ending)
    stack = vt.load(written_with_image(write, data, inside, name="../../wood \n"))
    assert stack.base is not None and isinstance(stack.base.albedo, vt.Texture)
    assert stack.base.albedo.texture.read_bytes() == data and stack.base.albedo.encoding == "srgb"
    folder = tmp_path / "out"
    folder.mkdir()
    vt.save(stack, folder / "red.yaml")
    image, material = sorted(folder.iterdir(), key=lambda path: path.suffix == ".yaml")
    assert image.read_bytes() == data and re.fullmatch(rf"wood-[0-9a-f]{{12}}\{ending}", image.name)
    again = vt.load(material)
    assert again == stack.replace(layer1_albedo=stack.base.albedo.model_copy(update={"texture": image}))
    vt.save(stack, folder / "other.yaml")  # the same image serves both
    assert len(list(folder.iterdir())) == 3


def test_an_image_replaces_no_file_and_goes_with_its_material(write: Write, tmp_path: Path) -> None:
    stack = vt.load(written_with_image(write, picture(tmp_path, ".png"), "chunk"))
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "red.yaml").mkdir()  # cannot be written
    refusal(lambda: vt.save(stack, folder / "red.yaml"))
    assert [path.name for path in folder.iterdir()] == ["red.yaml"]
    vt.save(stack, folder / "a.yaml")
    (image,) = folder.glob("*.png")
    image.write_text("mine")
    assert "is another file than the image" in refusal(lambda: vt.save(stack, folder / "b.yaml"))
    assert image.read_text() == "mine" and not (folder / "b.yaml").exists()


def test_images_inside_gltf_are_refused_in_one_line(write: Write, tmp_path: Path) -> None:
    """Expected: pictures of too many pixels, which the head of the file says, and data that is not there."""
    data = picture(tmp_path, ".png")
    bomb = data[:16] + struct.pack(">II", 60000, 60000) + data[24:]
    path = written_with_image(write, bomb, "chunk")
    assert refusal(lambda: imports.read(path)) == f"{path}: Red: image 0: holds 3.6e+09 pixels, more than 1.3e+08"

    def changed(change: Callable[[dict[str, Any]], object]) -> str:
        document, chunk = with_image(data, "chunk")
        change(document)
        path = write("red.glb", binary(json.dumps(document).encode(), chunk))
        return refusal(lambda: imports.read(path)).removeprefix(f"{path}: Red: ")

    view = f"image 0: bufferView 0: lies outside its buffer of {4 + len(data)} bytes"
    assert changed(lambda it: it["bufferViews"][0].update(byteLength=10**9)) == view
    assert changed(lambda it: it["bufferViews"][0].update(byteOffset=2**40)) == view
    assert changed(lambda it: it["bufferViews"][0].update(byteOffset=-4)).startswith(
        "image 0: bufferView 0: byteOffset:"
    )
    assert changed(lambda it: it["bufferViews"][0].update(buffer=1)) == "buffers: has no entry of index 1"
    assert changed(lambda it: it["images"][0].update(bufferView="0")) == "bufferViews: has no entry of index '0'"
    assert changed(lambda it: it["images"][0].update(uri="data:image/png,AAAA")).endswith(
        "must be in base64, got 'data:image/png'"
    )
    assert changed(lambda it: it["images"][0].update(uri="data:;base64,A")) == "image 0: is not in base64"
    assert changed(lambda it: it["textures"][0].update(source=True)) == "images: has no entry of index True"


@pytest.mark.parametrize("mode", ["OPAQUE", "MASK", "BLEND"])
def test_alpha_of_gltf_is_the_share_that_is_there(write: Write, tmp_path: Path, mode: str) -> None:
    """Expected: the factor times the alpha of the image; from the cutoff on 1, and 0 before, of a mask."""
    rgba = np.zeros((1, 4, 4), np.uint8)
    rgba[..., 3] = [0, 100, 200, 255]
    kernel.mitsuba().Bitmap(rgba).write(str(tmp_path / "cover.png"))
    material = {
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5], "baseColorTexture": {"index": 0}},
        "alphaMode": mode,
        "alphaCutoff": 0.25,
    }
    described = {"asset": {}, "images": [{"uri": "cover.png"}], "textures": [{"source": 0}], "materials": [material]}
    found: Any = imports.read(write("a.gltf", json.dumps(described))).stack
    if mode == "OPAQUE":
        assert isinstance(found, vt.Stack)
        return
    weight = found.mix[0].weight
    alpha = np.array([0, 100, 200, 255]) / 255 * 0.5
    expected = alpha if mode == "BLEND" else alpha >= 0.25
    np.testing.assert_allclose(texels(weight)[0, :, 0], expected, atol=1e-6)
    assert found.mix[1].material.name == "nothing"


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
        <bsdf type="mask"><float name="opacity" value="0.75"/><bsdf type="principled" id="gold">
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
    gold: Any = imports.read(path, "gold")
    assert [part.weight for part in gold.stack.mix] == [0.75, None] and gold.left == ()
    assert gold.stack.mix[1].material.name == "nothing"
    metal = gold.stack.mix[0].material.interfaces[0]
    assert isinstance(metal.alpha, vt.Texture) and metal.alpha.encoding == "linear"
    reflectance = ((np.array(metal.eta) - 1) ** 2 + np.array(metal.k) ** 2) / (
        (np.array(metal.eta) + 1) ** 2 + np.array(metal.k) ** 2
    )
    encoded = np.array([0xFF, 0xBB, 0x55]) / 255
    np.testing.assert_allclose(reflectance, np.minimum(((encoded + 0.055) / 1.055) ** 2.4, 0.998), atol=1e-4)


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


@pytest.mark.parametrize("ending", [".mtlx", ".gltf", ".glb", ".xml", ".yaml", ".json"])
def test_what_is_no_regular_file_is_not_opened(tmp_path: Path, ending: str) -> None:
    """Expected: one line for a pipe, which would wait, a device without an end, and links that loop."""
    pipe, link, loop = (tmp_path / f"{name}{ending}" for name in ("pipe", "link", "loop"))
    os.mkfifo(pipe)
    link.symlink_to("/dev/zero")
    loop.symlink_to(loop)
    assert refusal(lambda: vt.load(pipe)) == f"{pipe}: cannot be read: is no regular file"
    assert refusal(lambda: vt.load(link)) == f"{link}: cannot be read: is no regular file"
    assert refusal(lambda: vt.load(loop)) == f"{loop}: cannot be read: too many levels of symbolic links"
    if ending == ".mtlx":
        path = tmp_path / "a.mtlx"
        for other in (pipe, loop):
            path.write_text(document(f'<xi:include href="{other.name}"/>', XI))
            assert f"{other.name}: cannot be read: " in refusal(lambda: vt.load(path))


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    for ending in imports.FORMATS:
        path = tmp_path / f"none{ending}"
        assert refusal(lambda path=path: imports.read(path)) == f"{path}: file not found"  # type: ignore[misc]
    assert "a file to import ends in .mtlx, .gltf, .glb, .xml" in refusal(lambda: imports.read("a.obj"))
    (tmp_path / "a.mtlx").mkdir()
    assert "is a folder" in refusal(lambda: vt.load(tmp_path / "a.mtlx"))
    assert "cannot be read: is a directory" in refusal(lambda: imports.read(tmp_path / "a.mtlx"))
