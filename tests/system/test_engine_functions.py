"""Exports for Unity and Unreal without these engines: functions on the CPU, against the model in NumPy, and a script
with a stand-in for the editor.

Rationale: neither engine can be had here, so the code is compiled by two front ends of HLSL and run on textures as they
are written; what a graph wires is given as numbers, in a turned frame.
"""

from __future__ import annotations

import base64
import json
import re
import runpy
import sys
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from machines import SLOTS, InHlslBySlang

import velatura as vt
from velatura import kernel
from velatura.exports import Export
from velatura.exports.exr import exr
from velatura.model import named
from velatura.model.side_by_side import SideBySide
from velatura.optics.fresnel import conductor
from velatura.programs.substrate.slabs import Slab, slabs
from velatura.stack import Material

Array = np.ndarray

MACHINE = InHlslBySlang()
ROWS = 48
TEXTURE = "Texture2D<float4> picture : register(t0, space0);\n"
GIVEN = "float3 {} = vt_given.Load(int3({}, row, 0)).xyz;"
INPUTS = ("View", "Light", "Normal", "Tangent", "Bitangent")

METAL = (0.2, 0.9, 1.2), (3.0, 2.5, 2.3)  # index, and extinction
STACKS: dict[str, vt.Stack | vt.Mix] = {
    "coated": vt.Stack(
        [vt.Interface(eta=1.5, alpha=0.08), vt.Medium(sigma_a=(0.1, 0.5, 1.0)), vt.Interface(conductor="Cu", alpha=0.3)]
    ),
    "brushed": vt.Stack([vt.Interface(eta=METAL[0], k=METAL[1], alpha=(0.4, 0.2), rotation=30)]),
    "mixed": vt.Mix(
        [(0.3, vt.Stack([vt.Diffuse(albedo=0.8)])), (None, vt.Stack([vt.Interface(eta=1.5, k=3, alpha=0.3)]))]
    ),
    "glass": vt.Stack([vt.Interface(eta=1.5, alpha=0.2)]),
    "fog": vt.Stack([vt.Medium(depth=1.0, sigma_s=(1.5, 1.2, 0.9), g=0.4), vt.Diffuse(albedo=(0.2, 0.5, 0.3))]),
}


@cache
def exported(name: str, to: str) -> Export:
    return vt.export(STACKS[name], to)


def directions(count: int, below: bool = False) -> tuple[Array, Array]:
    """Directions (count, 3) of view and of light, above the surface, or of a light on either side."""
    w = np.random.default_rng(11).normal(size=(2, count, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.2
    if below:
        w[1, ::2, 2] *= -1
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    return w[0], w[1]


def frames(count: int, hand: float) -> Array:
    """Tangent, bitangent and normal in rows (count, 3, 3); hand is 1 where they are right-handed."""
    t, n = np.random.default_rng(12).normal(size=(2, count, 3))
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    t -= np.sum(t * n, axis=-1, keepdims=True) * n
    t /= np.linalg.norm(t, axis=-1, keepdims=True)
    return np.stack([t, hand * np.cross(n, t), n], axis=1)


def by_the_model(name: str, wi: Array, wo: Array) -> Array:
    """f cos (count, 3) of a material."""
    leaves = [stack for _, stack in STACKS[name].leaves()]
    shares = [0.3, 0.7] if len(leaves) > 1 else [1.0]
    body = SideBySide.of([(share, Material.of(leaf)) for share, leaf in zip(shares, leaves)], named("velatura"))
    value, _ = body.eval_pdf(tuple(wi.T), tuple(wo.T))
    return np.broadcast_to(value, (3, len(wi))).T


def on_machine(text: str, call: str, frame: Array, wi: Array, wo: Array, textures: dict[str, Array]) -> Array:
    """What a function returns for each row of directions in frames."""
    if why := MACHINE.missing():
        pytest.skip(why)
    view, light = (np.einsum("nk,nka->na", w, frame) for w in (wi, wo))
    given = np.stack([view, light, frame[:, 2], frame[:, 0], frame[:, 1]], axis=1)
    lines = [GIVEN.format(name, k) for k, name in enumerate(INPUTS)]
    lines += ["float2 UV = float2(0.5, 0.5);", "float3 Value;", call, "results[row] = float4(Value, 0.0);"]
    whole = "\n".join([text, MACHINE.declarations(ROWS), MACHINE.main(lines)])
    texels = {**textures, "vt_given": np.pad(given, ((0, 0), (0, 0), (0, 1)))}
    return MACHINE.run(whole, ROWS, 1, texels, {**SLOTS, **dict.fromkeys(textures, 0)})[:, 0, :3]


def agree(found: Array, expected: Array) -> None:
    """Within 2 % of the value, or of a thousandth of the largest one, since texels are halves of floats."""
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-3 * expected.max())


@pytest.mark.parametrize(("name", "hand"), [("brushed", -1.0), ("mixed", 1.0), ("glass", 1.0)])
def test_the_function_for_unity_is_the_model(name: str, hand: float) -> None:
    """Expected: its values, in frames of either hand, by the texture that the class beside it holds."""
    made = exported(name, "unity")
    (bound,) = made.facts["globals"]
    bind = rf'SetGlobalTexture\("{bound["name"]}", Made\((\d+), (\d+), "(.*)"\)\);'
    call = re.search(bind, made.beside[".cs"].decode())
    assert call and (int(call[1]), int(call[2])) == (bound["width"], bound["height"])
    texels = np.frombuffer(base64.b64decode(call[3]), "<f2").reshape(bound["height"], bound["width"], 4)
    wi, wo = directions(ROWS, below=name == "glass")
    given = "Velatura_float(View, Light, Normal, Tangent, Bitangent, UV, Value);"
    agree(on_machine(made.text, given, frames(ROWS, hand), wi, wo, {bound["name"]: texels}), by_the_model(name, wi, wo))


@pytest.mark.parametrize("name", ["coated", "brushed", "mixed", "fog"])
def test_the_function_for_unreal_is_the_model(name: str, tmp_path: Path) -> None:
    """Expected: its values, in the engine's left-handed frames, by the texture beside it as Mitsuba reads it."""
    _, *beside = exported(name, "unreal").save(tmp_path / "a.py")
    assert {path.name for path in beside} == {"a.ush", "a.exr", "a.py.json"}
    texels = np.array(kernel.mitsuba().Bitmap(str(tmp_path / "a.exr")).convert(component_format=_float()), float)
    wi, wo = directions(ROWS)
    text = TEXTURE + (tmp_path / "a.ush").read_text()
    call = "Value = Velatura(picture, View, Light, Normal, Tangent, UV);"
    agree(on_machine(text, call, frames(ROWS, -1.0), wi, wo, {"picture": texels}), by_the_model(name, wi, wo))


def _float() -> Any:
    return kernel.mitsuba().Struct.Type.Float32


def test_textures_of_unreal_are_read_back(tmp_path: Path) -> None:
    """Expected: every half of every channel, the first line at the top."""
    texels = np.random.default_rng(3).normal(size=(5, 7, 4)).astype(np.float16)
    path = tmp_path / "a.exr"
    path.write_bytes(exr(texels))
    bitmap = kernel.mitsuba().Bitmap(str(path))
    assert str(bitmap.component_format()).endswith("Float16") and str(bitmap.pixel_format()).endswith("RGBA")
    np.testing.assert_array_equal(np.array(bitmap).view(np.float16).reshape(5, 7, 4), texels)


@pytest.mark.parametrize(("to", "ending"), [("unity", ".hlsl"), ("unreal", ".ush")])
def test_two_materials_share_a_program(to: str, ending: str) -> None:
    """Expected: both compile together under names of their own; files say that they were not run."""
    if why := MACHINE.missing():
        pytest.skip(why)
    made = [
        vt.export(vt.Stack([vt.Diffuse(albedo=x)]), to, prefix=prefix) for x, prefix in ((0.2, "red"), (0.8, "ash"))
    ]
    texts = [each.text if to == "unity" else each.beside[ending].decode() for each in made]
    MACHINE.compile("\n".join([*texts, MACHINE.declarations(1), MACHINE.main([])]))
    assert not re.search(r"\bvt_|\bVt[A-Z]|\bVT_", "".join(texts))
    for each in made:
        files = [each.text, *(data.decode() for end, data in each.beside.items() if end != ".exr")]
        assert all("NOT RUN IN UN" in text for text in files)
        assert each.facts["run"] is False and each.facts["exports"][0].startswith(("red", "ash"))


# Slabs ---------------------------------------------------------------------------------------------------------------

PLAIN = vt.Stack([vt.Interface(eta=1.5, alpha=0.3)])


def made_of(values: dict[str, Any], stack: vt.Stack = PLAIN) -> list[Slab]:
    return slabs(values, stack, named("belcour2018"))


def test_a_brushed_metal_is_a_slab_of_its_reflectance() -> None:
    """Expected: F0 of the metal's index, roughnesses along both axes by the engine's formula, turned like it."""
    (base,) = exported("brushed", "unreal").facts["slabs"]
    np.testing.assert_allclose(base["f0"], conductor(1.0, *(np.array(x) for x in METAL)), atol=0.03)
    assert base["diffuse_albedo"] == (0.0, 0.0, 0.0) and max(base["f90"]) == 1.0
    alpha, anisotropy = base["roughness"] ** 2, base["anisotropy"]
    np.testing.assert_allclose([alpha * (1 + anisotropy), alpha * (1 - anisotropy)], [0.4, 0.2], atol=0.02)
    assert base["turn"] % 180 == pytest.approx(30, abs=2)


def test_a_coat_is_a_slab_of_its_own() -> None:
    """Expected: the coat's index and roughness, above a rougher base without diffuse light."""
    base, coat = exported("coated", "unreal").facts["slabs"]
    np.testing.assert_allclose(coat["f0"], 0.04, atol=1e-3)
    assert coat["roughness"] ** 2 == pytest.approx(0.08, abs=0.01) and coat["coverage"] == 1.0
    assert base["diffuse_albedo"] == (0.0, 0.0, 0.0) and base["roughness"] > coat["roughness"]


def test_a_coat_s_colour_is_a_mean_free_path() -> None:
    """Expected: light that crosses it along the normal, twice, keeps that colour by Beer's law; it covers its share."""
    colour = (0.9, 0.25, 0.01)
    _, coat = made_of({"coat_weight": 0.4, "coat_color": colour, "coat_ior": 1.5})
    assert coat.mean_free_path_cm
    crossed = np.exp(-2 * coat.thickness_cm / np.array(coat.mean_free_path_cm))
    np.testing.assert_allclose(crossed, colour, rtol=1e-4)
    assert coat.coverage == 0.4 and coat.diffuse_albedo == (0.0, 0.0, 0.0)


def test_a_base_has_its_colours_at_the_normal_and_at_grazing_angles() -> None:
    """Expected: of paint the reflectance of its index, and its colour; of tinted metal F90 of the tint's hue."""
    (paint,) = made_of({"base_color": (0.6, 0.3, 0.1), "specular_ior": 2.0})
    np.testing.assert_allclose(paint.f0, 1 / 9, rtol=1e-6)
    np.testing.assert_allclose(paint.diffuse_albedo, (0.6, 0.3, 0.1))
    (metal,) = made_of({"base_color": (0.9, 0.5, 0.2), "base_metalness": 1.0, "specular_color": (1.0, 0.8, 0.4)})
    np.testing.assert_allclose(metal.f0, (0.9, 0.5, 0.2))
    assert metal.f90[0] == 1 > metal.f90[1] > metal.f90[2] and metal.diffuse_albedo == (0.0, 0.0, 0.0)


def test_what_bounces_below_a_coat_takes_is_in_the_base() -> None:
    """Expected: darker than without the coat, and darker than where the program is told not to darken."""
    given = {"base_color": (0.8, 0.5, 0.2), "coat_ior": 1.5}
    bare, dark, bright = (
        made_of({**given, **more})[0].diffuse_albedo
        for more in ({}, {"coat_weight": 1.0}, {"coat_weight": 1.0, "coat_darkening": 0.0})
    )
    assert np.all(np.array(dark) < bare)
    np.testing.assert_allclose(bright, bare)


def test_two_lobes_of_a_base_are_two_roughnesses() -> None:
    """Expected: below a smooth coat, gloss of one interface and haze of another, by their shares at the normal."""
    coat, gloss = vt.Interface(eta=1.3, alpha=0.01), vt.Interface(eta=2.4, alpha=0.05)
    stack = vt.Stack([coat, gloss, vt.Interface(eta=0.2, k=3.0, alpha=0.5)])
    base, _ = made_of({"base_metalness": 1.0, "coat_weight": 1.0, "coat_ior": 1.3}, stack)
    assert 0.05 < base.second_roughness_weight < 0.5
    assert base.second_roughness < 0.7 * base.roughness
    assert made_of({})[0].second_roughness_weight == 0


# The script ----------------------------------------------------------------------------------------------------------

#: Inputs of nodes, as Unreal's editor names them (documentation of 5.7), and outputs
PINS = {
    "SubstrateSlabBSDF": "Diffuse Albedo, F0, F90, Roughness, Anisotropy, Normal, Tangent, SSS MFP, SSS MFP Scale, "
    "SSS Phase Anisotropy, Emissive Color, Second Roughness, Second Roughness Weight",
    "SubstrateVerticalLayering": "Top, Bottom, Top Thickness",
    "SubstrateWeight": "A, Weight",
    "SubstrateTransmittanceToMFP": "Transmittance Color, Thickness",
}
OUTPUTS = {"SubstrateTransmittanceToMFP": ("MFP", "Thickness")}


class Node:
    """A node, and what is connected to its inputs: nodes with their outputs."""

    def __init__(self, kind: str) -> None:
        self.kind, self.given, self.properties = kind, dict[str, tuple[Node, str]](), dict[str, Any]()

    def set_editor_property(self, name: str, value: Any) -> None:
        self.properties[name] = value

    def get_path_name(self) -> str:
        return "/Game/Velatura/M"

    def value(self, pin: str) -> Any:
        """The constant of an input."""
        node, _ = self.given[pin]
        return node.properties["constant"] if node.kind == "Constant3Vector" else node.properties["r"]


def editor(front: list[Node], warned: list[str]) -> ModuleType:
    """A stand-in for the module of the editor."""

    def connect(source: Node, output: str, node: Node, pin: str) -> bool:
        there = pin in PINS[node.kind].split(", ") and output in OUTPUTS.get(source.kind, ("",))
        if there:
            node.given[pin] = source, output
        return there

    def finish(node: Node, output: str, where: Any) -> bool:
        front.append(node)
        return where == "front"

    unreal: Any = ModuleType("unreal")
    for kind in (*PINS, "Constant", "Constant3Vector"):
        setattr(unreal, f"MaterialExpression{kind}", kind)
    unreal.MaterialEditingLibrary = SimpleNamespace(
        create_material_expression=lambda material, kind, x, y: Node(kind),
        connect_material_expressions=connect,
        connect_material_property=finish,
        layout_material_expressions=lambda material: None,
        recompile_material=lambda material: None,
    )
    unreal.EditorAssetLibrary = SimpleNamespace(
        does_asset_exist=lambda path: False, save_loaded_asset=lambda material: True
    )
    tools = SimpleNamespace(create_asset=lambda name, folder, kind, factory: Node(name))
    unreal.AssetToolsHelpers = SimpleNamespace(get_asset_tools=lambda: tools)
    unreal.MaterialProperty = SimpleNamespace(MP_FRONT_MATERIAL="front")
    unreal.MaterialSubSurfaceType = SimpleNamespace(MSS_SIMPLE_VOLUME="volume")
    unreal.LinearColor = lambda r, g, b, a: (r, g, b)
    unreal.Material = unreal.MaterialFactoryNew = lambda: None
    unreal.log, unreal.log_warning = (lambda text: None), warned.append
    return unreal


def drawn(made: Export, path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Node, list[str]]:
    """The node that a script connects to the material, and what it warns of."""
    front, warned = list[Node](), list[str]()
    monkeypatch.setitem(sys.modules, "unreal", editor(front, warned))
    path.write_text(made.text)
    runpy.run_path(str(path), run_name="__main__")
    (node,) = front
    return node, warned


def test_the_script_connects_what_the_facts_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: a coat above a base, each with its numbers, to six digits; what is left out is said in the log."""
    made = exported("coated", "unreal")
    layers, warned = drawn(made, tmp_path / "red.py", monkeypatch)
    assert layers.kind == "SubstrateVerticalLayering" and set(layers.given) == {"Top", "Bottom", "Top Thickness"}
    for (node, _), facts in zip((layers.given["Bottom"], layers.given["Top"]), made.facts["slabs"]):
        for pin in ("Diffuse Albedo", "F0", "F90", "Roughness"):
            key = pin.lower().replace(" ", "_")
            np.testing.assert_allclose(node.value(pin), facts[key], rtol=1e-5)
    (coat, _), (path, output) = layers.given["Top"], layers.given["Top Thickness"]
    assert (path.kind, output) == ("SubstrateTransmittanceToMFP", "Thickness")
    assert coat.given["SSS MFP"] == (path, "MFP") and coat.properties == {"sub_surface_type": "volume"}
    np.testing.assert_allclose(path.value("Transmittance Color"), made.facts["slabs"][1]["transmittance"], rtol=1e-5)
    assert len(warned) == len(made.facts["left_out"])


def test_the_script_turns_brushed_slabs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the tangent, in a surface whose second texture coordinate runs down."""
    made = exported("brushed", "unreal")
    slab, _ = drawn(made, tmp_path / "steel.py", monkeypatch)
    turn = np.radians(made.facts["slabs"][0]["turn"])
    np.testing.assert_allclose(slab.value("Tangent"), [np.cos(turn), -np.sin(turn), 0], atol=1e-4)


def test_unreal_refuses_panes_in_one_line() -> None:
    with pytest.raises(vt.InvalidInput, match=r"^unreal: slabs are written of opaque materials; .*$"):
        vt.export(STACKS["glass"], "unreal")


def test_facts_are_json(tmp_path: Path) -> None:
    for to, ending in (("unity", "hlsl"), ("unreal", "py")):
        path = exported("brushed", to).save(tmp_path / f"red.{ending}")[-1]
        assert json.loads(path.read_text())["run"] is False
