"""Layers of USD as OpenUSD reads them: what is written, what comes back, and what others write."""

from __future__ import annotations

import functools
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from materialx import document, evaluated, generated

import velatura as vt
from velatura.errors import Incomplete, MissingTool
from velatura.exports import baked
from velatura.model import named
from velatura.programs import embedded
from velatura.programs.usd.write import PROGRAM
from velatura.shader.closures import tabulated
from velatura.shader.polynomials import PolynomialFit
from velatura.stack import Material

pxr = pytest.importorskip("pxr", reason='usd-core is missing: pip install "velatura[usd]"')
from pxr import Gf, Sdf, Usd, UsdShade, UsdValidation  # noqa: E402

Run = Callable[..., tuple[int, str, str]]
GOLD = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(conductor="Au", alpha=0.3)], name="Gold '''\"\\ -->")
PANE = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=1.0, alpha=0.1)])
BRUSHED = vt.Stack([vt.Interface(conductor="Al", alpha=(0.1, 0.3), rotation=20)])


MODEL = "belcour2018"

_fitted = functools.cache(baked.bake)


@pytest.fixture(autouse=True)
def fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parameters of the same material are fitted once."""
    monkeypatch.setattr(baked, "bake", _fitted)


@pytest.fixture
def painted(tmp_path: Path) -> vt.Stack:
    path = tmp_path / "wood @@@ 1.png"
    vt.scenes.write_image(np.full((4, 4, 3), (0.5, 0.3, 0.1), np.float32), path)
    rough = {"texture": str(path), "channel": "r"}
    wood = {"texture": str(path), "encoding": "srgb"}
    return vt.Stack([vt.Interface(eta=1.5, alpha=rough), vt.Diffuse(albedo=wood)], name="Wood")


def saved(stack: vt.Stack, folder: Path, to: str = "usd", name: str = "a.usda") -> Path:
    """The file of a material, by a model in closed form, whose light is fitted soon."""
    return vt.export(stack, to, MODEL, folder=folder).save(folder / name)[0]


def loosened(path: Path) -> Path:
    """The file, of which the parameters are read, and not the stack."""
    other = path.with_name(f"loose-{path.name}")
    other.write_bytes(embedded.loosened(path.read_bytes()))
    return other


def opened(path: Path, surface: str) -> Any:
    """The stage of a layer, with this variant of the surface."""
    stage = Usd.Stage.Open(str(path))
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        assert stage.GetDefaultPrim().GetVariantSet("surface").SetVariantSelection(surface)
    return stage


def test_layers_are_valid(painted: vt.Stack, tmp_path: Path) -> None:
    """Expected: no complaint of OpenUSD's validators, but that the wheel knows no nodes of MaterialX; these are defined
    there, with the inputs, types and outputs that the layer has, in all variants. OpenPBR is the default."""
    import MaterialX as mx

    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    surfaces = {"openpbr": "ND_open_pbr_surface_surfaceshader", "lobes": "ND_surface", "lobes_osl": "ND_surface"}
    for number, stack in enumerate((painted, GOLD, BRUSHED)):
        path = saved(stack, tmp_path, name=f"{number}.usda")
        unchosen = Usd.Stage.Open(str(path))
        variants = unchosen.GetDefaultPrim().GetVariantSet("surface")
        assert variants.GetVariantSelection() == "openpbr"
        assert set(variants.GetVariantNames()) == (set(surfaces) if stack is not painted else {"openpbr"})
        for variant in variants.GetVariantNames() if stack is GOLD else ["openpbr"]:  # others below, by documents
            stage = opened(path, variant)
            for fault in UsdValidation.ValidationContext(validators).Validate(stage):
                assert fault.GetName() == "MissingShaderIdInRegistry", fault.GetMessage()
                assert "'ND_" in fault.GetMessage(), fault.GetMessage()
            material = UsdShade.Material(stage.GetDefaultPrim())
            assert material.ComputeSurfaceSource("")[0].GetIdAttr().Get() == "UsdPreviewSurface"
            assert material.ComputeSurfaceSource("mtlx")[0].GetIdAttr().Get() == surfaces[variant]
            for prim in stage.Traverse():
                shader = UsdShade.Shader(prim)
                if not shader or not (name := shader.GetIdAttr().Get()).startswith("ND_"):
                    continue
                definition = library.getNodeDef(name)
                assert definition, name
                for each in shader.GetInputs():
                    expected = definition.getActiveInput(each.GetBaseName())
                    assert expected, (name, each.GetBaseName())
                    assert str(each.GetTypeName()) == TYPES.get(expected.getType(), expected.getType()), name
                assert [each.getName() for each in definition.getActiveOutputs()] == ["out"]


#: Types of MaterialX as USD has them (UsdMtlx).
TYPES = {
    "color3": "color3f",
    "color4": "color4f",
    "vector2": "float2",
    "vector3": "float3",
    "boolean": "bool",
    "integer": "int",
    "filename": "asset",
    "BSDF": "token",
}


def as_materialx(stage: Any) -> Any:
    """The network of MaterialX of a stage as a document, as renderers make one of it: nodes by their definitions."""
    import MaterialX as mx

    made, library = mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    kinds = {usd: kind for kind, usd in TYPES.items()}
    graphs: dict[str, Any] = {}
    for prim in stage.Traverse():
        if prim.GetTypeName() == "NodeGraph":
            graph = graphs[prim.GetName()] = made.addNodeGraph(prim.GetName())
            for port in UsdShade.NodeGraph(prim).GetInputs():
                kind = str(port.GetTypeName())
                connected(graph.addInput(port.GetBaseName(), kinds.get(kind, kind)), port)
            [result] = UsdShade.NodeGraph(prim).GetOutputs()
            connected(graph.addOutput("out", "BSDF"), result)
        shader = UsdShade.Shader(prim)
        if not shader or not (name := shader.GetIdAttr().Get()).startswith("ND_"):
            continue
        definition, parent = library.getNodeDef(name), graphs.get(prim.GetParent().GetName(), made)
        node = parent.addNode(definition.getNodeString(), prim.GetName(), definition.getType())
        node.setNodeDefString(name)
        for port in shader.GetInputs():
            connected(node.addInput(port.GetBaseName(), definition.getActiveInput(port.GetBaseName()).getType()), port)
    used = made.addMaterialNode("used", made.getNode("surface"))
    return mx.writeToXmlString(used.getDocument())


def connected(entry: Any, port: Any) -> None:
    """Give a port of MaterialX what one of USD is connected to, or its value."""
    if not port.HasConnectedSource():
        value = port.Get()
        text = ", ".join(map(str, value)) if hasattr(value, "__len__") and not isinstance(value, str) else str(value)
        entry.setValueString(value.path if isinstance(value, Sdf.AssetPath) else text)
        return
    [source] = port.GetConnectedSources()[0]
    name = source.source.GetPrim().GetName()
    if source.sourceType == UsdShade.AttributeType.Input:
        entry.setInterfaceName(source.sourceName)
    elif source.source.GetPrim().GetTypeName() == "NodeGraph":
        entry.setNodeGraphString(name)
        entry.setOutputString(source.sourceName)
    else:
        entry.setNodeName(name)


@pytest.fixture
def fitted_as_gold(monkeypatch: pytest.MonkeyPatch) -> None:
    """All materials have the parameters of one, beside lobes of their own."""

    def bake(stack: Any, target: str, *_: Any, **options: Any) -> Any:
        return replace(_fitted(GOLD, target, named(MODEL), **options), name=stack.name)

    monkeypatch.setattr(baked, "bake", bake)


@pytest.mark.parametrize(("stack", "model"), [(GOLD, "velatura"), (BRUSHED, "velatura"), (PANE, "weier2020")])
def test_lobes_in_usd_have_the_values_of_the_closures(
    stack: vt.Stack, model: str, tmp_path: Path, fitted_as_gold: None
) -> None:
    """Expected: weights and roughnesses at directions, of what OpenUSD reads, as the polynomials have them in NumPy; of
    facets that return what they block, and in the variant for OSL of facets that lose it. Constants have single
    precision. Generators make code of it.
    """
    path = vt.export(stack, "usd", model).save(tmp_path / "a.usda")[0]
    rng = np.random.default_rng(4)
    z, phi = rng.uniform(0.1, 1, 9), rng.uniform(0, 2 * np.pi, 9)
    wi = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])
    given = {"viewdirection": -wi, "normal": np.eye(3)[2][:, None] + 0 * wi, "tangent": np.eye(3)[0][:, None] + 0 * wi}
    for variant, target in (("lobes", "essl"), ("lobes_osl", "osl")):
        text = as_materialx(opened(path, variant))
        assert "generalized_schlick_bsdf(" in generated(document(text), target)
        made = document(text)
        graph = made.getNodeGraph("lobes")
        graph.removeOutput("out")
        lobes = [node for node in graph.getNodes() if node.getCategory().endswith("_bsdf")]
        for k, lobe in enumerate(lobes):
            weight = lobe.getInput("color")
            if lobe.getCategory() == "generalized_schlick_bsdf":
                [weighed] = [each.getParent().getInput("in2") for each in lobe.getDownstreamPorts()]
                weight = weighed
                graph.addOutput(f"roughness{k}", "vector2").setNodeName(lobe.getInput("roughness").getNodeName())
            graph.addOutput(f"weight{k}", "color3").setNodeName(weight.getNodeName())
        found = evaluated(graph, given)
        fit = PolynomialFit(tabulated(Material.of(stack), named(model), conserving=variant == "lobes"))
        expected = fit.above(tuple(wi))
        assert len(expected) == len(lobes)
        for k, closure in enumerate(expected):
            np.testing.assert_allclose(found[f"weight{k}"], np.broadcast_to(closure.weight, (3, 9)), atol=1e-4)
            if closure.kind not in ("diffuse", "translucent"):
                np.testing.assert_allclose(found[f"roughness{k}"], np.stack(closure.roughness[:2]), atol=1e-3)


def test_lobes_of_mixtures_and_images_are_in_usd_as_well(tmp_path: Path, fitted_as_gold: None) -> None:
    """Expected: a graph for each stack, whatever the material is called, mixed by a mask; images relative to the layer,
    and inside a package. Where a graph has no lobes the layer says why."""
    vt.scenes.write_image(np.full((4, 4, 3), 0.5, np.float32), tmp_path / "mask.png")
    mask = {"texture": str(tmp_path / "mask.png"), "channel": "g"}
    rough = GOLD.replace(layer0_alpha=mask)
    mix = vt.Mix([(mask, rough), (None, BRUSHED)], name='0 part1 "layer0" value0 ')
    made = vt.export(mix, "usd", "weier2020", folder=tmp_path)
    path, package = made.save(tmp_path / "a.usda")[0], made.save(tmp_path / "a.usdz")[0]
    assert "as total variation" in " ".join(made.notes) and len(made.facts["lobes"]["loss"]) == 3
    for stage in (opened(path, "lobes"), opened(path, "lobes_osl")):
        surface, _, _ = UsdShade.Material(stage.GetDefaultPrim()).ComputeSurfaceSource("mtlx")
        [[mixed]] = [surface.GetInput("bsdf").GetConnectedSources()[0]]
        parts = [mixed.source.GetInput(name).GetConnectedSources()[0][0].source for name in ("fg", "bg")]
        assert [part.GetPrim().GetName() for part in parts] == ["part0_lobes", "part1_lobes"]
        images = [prim.GetAttribute("inputs:file") for prim in stage.Traverse() if prim.HasAttribute("inputs:file")]
        assert {each.Get().path for each in images} == {"./mask.png"} and len(images) == 2
        assert {each.GetColorSpace() for each in images} == {"lin_rec709"}
        assert "generalized_schlick_bsdf(" in generated(document(as_materialx(stage)), "essl")
    stage = Usd.Stage.Open(str(package))
    stage.GetDefaultPrim().GetVariantSet("surface").SetVariantSelection("lobes")
    files = [prim.GetAttribute("inputs:file").Get() for prim in stage.Traverse() if prim.HasAttribute("inputs:file")]
    assert files and all(each.resolvedPath.startswith(f"{package}[") for each in files)

    without = vt.export(rough, "usd", folder=tmp_path)
    assert "Without a graph of the lobes: mtlx: a graph has no tables" in without.text
    assert without.facts["lobes"]["left_out"].startswith("mtlx: a graph has no tables")


def test_a_stack_comes_back_from_any_variant(tmp_path: Path) -> None:
    """Expected: the stack where a program has chosen the lobes; once OpenPBR is changed, the stack of that."""
    path = saved(BRUSHED, tmp_path)
    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(path)))
    assert stage.GetDefaultPrim().GetVariantSet("surface").SetVariantSelection("lobes")
    stage.GetRootLayer().Export(str(tmp_path / "b.usda"))
    assert vt.imports.read(tmp_path / "b.usda").stack == BRUSHED
    other = vt.imports.read(loosened(tmp_path / "b.usda")).stack
    assert other != BRUSHED and other.kinds == BRUSHED.kinds


def test_a_package_has_its_images_inside(painted: vt.Stack, tmp_path: Path) -> None:
    """Expected: the layer's surfaces, whose images are read out of the package where nothing else is left."""
    from pxr import Ar

    package = saved(painted, tmp_path, name="a.usdz")
    moved = tmp_path / "elsewhere" / "b.usdz"
    moved.parent.mkdir()
    shutil.move(package, moved)
    wood = tmp_path / "wood @@@ 1.png"
    data = wood.read_bytes()
    wood.unlink()
    stage = Usd.Stage.Open(str(moved))
    material = UsdShade.Material(stage.GetDefaultPrim())
    assert material.ComputeSurfaceSource("")[0].GetIdAttr().Get() == "UsdPreviewSurface"
    images = [
        each.Get().resolvedPath
        for prim in stage.Traverse()
        for each in prim.GetAttributes()
        if each.GetTypeName() == Sdf.ValueTypeNames.Asset
    ]
    assert len(images) == 3  # albedo twice, and roughness
    for path in images:
        assert path.startswith(f"{moved}[")
        assert bytes(Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path)).GetBuffer()) == data
    checker = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    for fault in checker.Validate(stage):
        assert fault.GetName() == "MissingShaderIdInRegistry" and "'ND_" in fault.GetMessage(), fault.GetMessage()


def test_a_stack_comes_back(painted: vt.Stack, tmp_path: Path) -> None:
    """Expected: the stack exactly, as text, as crate, and after another program has written it; not once a number is
    changed."""
    for stack in (painted, GOLD, BRUSHED):
        path = saved(stack, tmp_path)
        with pytest.warns(Incomplete, match="which is read"):
            assert vt.load(path) == stack
        layer = Sdf.Layer.OpenAsAnonymous(str(path))
        layer.Export(str(tmp_path / "b.usdc"))
        assert vt.imports.read(tmp_path / "b.usdc").stack == stack
        stage = Usd.Stage.Open(layer)
        UsdShade.Shader(stage.GetPrimAtPath("/material/surface")).CreateInput("coat_ior", Sdf.ValueTypeNames.Float).Set(
            1.23
        )
        layer.Export(str(tmp_path / "c.usda"))
        assert vt.imports.read(tmp_path / "c.usda").stack != stack


def test_the_network_is_that_of_materialx(painted: vt.Stack, tmp_path: Path) -> None:
    """Expected: by numbers and images alone, the same stack as of the document of MaterialX."""
    for stack in (painted, GOLD, BRUSHED, PANE):
        here, there = (
            loosened(saved(stack, tmp_path, to, name)) for to, name in (("usd", "a.usda"), ("openpbr", "a.mtlx"))
        )
        found, expected = (vt.imports.read(path) for path in (here, there))
        assert found.stack.layers == expected.stack.layers
        assert found.left == expected.left


def test_the_preview_keeps_what_it_has(tmp_path: Path) -> None:
    """Expected: metal below a clearcoat of the layer's roughness; the loss of both surfaces in the file."""
    text = vt.export(GOLD, "usd", MODEL).text
    assert "in the formulas of OpenPBR" in text and "in the formulas of UsdPreviewSurface" in text
    made = baked.bake(GOLD, "usd", named(MODEL))
    assert (made.values["metallic"], made.values["clearcoat"]) == (1, 1)
    assert made.values["clearcoatRoughness"] == pytest.approx(0.1**0.5, abs=0.01)
    path = tmp_path / "a.usda"
    path.write_text(
        "\n".join(line for line in text.splitlines() if "outputs:mtlx" not in line and "velatura =" not in line)
    )
    found = vt.imports.read(path).stack
    assert found.kinds == GOLD.kinds and found.source == "imported from UsdPreviewSurface"
    assert found.flat()["layer0_alpha_u"] == pytest.approx(0.1, abs=0.01)
    assert PROGRAM.title == "UsdPreviewSurface"


# Layers of others -----------------------------------------------------------------------------------------------------


def preview(stage: Any, path: str = "/Looks/Wood", **values: Any) -> Any:
    """A material with a UsdPreviewSurface in a graph."""
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Graph/Surface")
    UsdShade.NodeGraph.Define(stage, f"{path}/Graph")
    shader.CreateIdAttr("UsdPreviewSurface")
    for name, value in values.items():
        kind = Sdf.ValueTypeNames.Color3f if isinstance(value, tuple) else Sdf.ValueTypeNames.Float
        kind = Sdf.ValueTypeNames.Token if isinstance(value, str) else kind
        shader.CreateInput(name, kind).Set(Gf.Vec3f(*value) if isinstance(value, tuple) else value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return shader


def test_a_preview_surface_is_the_stack_of_its_parameters(tmp_path: Path) -> None:
    """Expected: paint under a clearcoat of the same index; of a metal, its colour at the normal."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    preview(stage, diffuseColor=(0.5, 0.2, 0.1), roughness=0.4, clearcoat=1.0, clearcoatRoughness=0.1, ior=1.6)
    preview(stage, "/Looks/Metal", diffuseColor=(0.9, 0.6, 0.3), metallic=1.0, roughness=0.5)
    stage.GetRootLayer().Save()
    with pytest.raises(vt.InvalidInput, match=r"has 2 materials; name one, as in a\.usda#NAME: Wood, Metal"):
        vt.imports.read(tmp_path / "a.usda")
    paint = vt.imports.read(f"{tmp_path}/a.usda#Wood")
    assert paint.stack.kinds == ("dielectric", "dielectric", "diffuse") and not paint.left
    flat = paint.stack.flat()
    assert (flat["layer0_eta"], flat["layer0_alpha_u"], flat["layer1_alpha_u"]) == (
        1.6,
        *map(pytest.approx, (0.01, 0.16)),
    )
    metal = vt.imports.read(f"{tmp_path}/a.usda#Metal").stack
    energy = vt.lobes(metal, 1.0).energy[0][:, 0]
    np.testing.assert_allclose(energy, (0.9, 0.6, 0.3), rtol=0.06)  # but for light that facets lose


@pytest.mark.parametrize(
    ("values", "kinds"),
    [
        ({"opacity": 0.0}, [("dielectric", "dielectric")]),
        ({"opacity": 0.3}, [("dielectric", "dielectric"), ("dielectric", "diffuse")]),
        ({"opacity": 0.3, "opacityMode": "presence"}, [("dielectric", "diffuse"), ("dielectric",)]),
        ({"opacity": 0.3, "opacityThreshold": 0.5}, [("dielectric",)]),
        ({"opacity": 0.6, "opacityThreshold": 0.5}, [("dielectric", "diffuse")]),
        ({"useSpecularWorkflow": 1.0, "specularColor": (0.5, 0.5, 0.5)}, [("dielectric", "diffuse")]),
    ],
)
def test_opacity_lets_light_pass_or_is_coverage(tmp_path: Path, values: dict[str, Any], kinds: list[Any]) -> None:
    """Expected: what the modes of opacity say, as panes and as nothing; in the specular workflow the colour's index."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    preview(stage, **values)
    stage.GetRootLayer().Save()
    found = vt.imports.read(tmp_path / "a.usda").stack
    assert [stack.kinds for _, stack in found.leaves()] == kinds
    if "specularColor" in values:
        assert vt.lobes(found, 1.0).energy[0][0, 0] == pytest.approx(0.5, rel=0.05)


def test_images_are_read_with_their_scale_and_space(painted: vt.Stack, tmp_path: Path) -> None:
    """Expected: colours in sRGB times the scale, one channel as it is; a transform of coordinates is listed."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    shader = preview(stage)
    image = UsdShade.Shader.Define(stage, "/Looks/Wood/Image")
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath("./wood @@@ 1.png"))
    image.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(0.5, 0.5, 0.5, 1))
    move = UsdShade.Shader.Define(stage, "/Looks/Wood/Move")
    move.CreateIdAttr("UsdTransform2d")
    image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(move.ConnectableAPI(), "result")
    for name, output, kind in (("diffuseColor", "rgb", "Color3f"), ("roughness", "g", "Float")):
        made = shader.CreateInput(name, getattr(Sdf.ValueTypeNames, kind))
        made.ConnectToSource(image.ConnectableAPI(), output)
    stage.GetRootLayer().Save()
    found = vt.imports.read(tmp_path / "a.usda")
    flat = found.stack.flat()
    albedo, rough = flat["layer1_albedo"], flat["layer0_alpha_u"]
    assert isinstance(albedo, vt.Texture) and (albedo.channel, albedo.encoding) == ("rgb", "srgb")
    assert isinstance(rough, vt.Texture) and (rough.channel, rough.encoding) == ("g", "linear")
    assert albedo.texture == tmp_path / "wood @@@ 1.png"
    assert rough.curve is not None and rough.curve[-1] == pytest.approx(0.25)
    assert any("texcoord" in each.parameter for each in found.left)


LAYERED = """#usda 1.0
def Material "Lacquer" {
  token outputs:mtlx:surface.connect = </Lacquer/S.outputs:out>
  def Shader "S" {
    uniform token info:id = "ND_surface"
    token inputs:bsdf.connect = </Lacquer/L.outputs:out>
    token outputs:out
  }
  def Shader "L" {
    uniform token info:id = "ND_layer_bsdf"
    token inputs:top.connect = </Lacquer/D.outputs:out>
    token inputs:base.connect = </Lacquer/M.outputs:out>
    token outputs:out
  }
  def Shader "D" {
    uniform token info:id = "ND_dielectric_bsdf"
    float2 inputs:roughness = (0.04, 0.04)
    float inputs:ior = 1.6
    token outputs:out
  }
  def Shader "M" {
    uniform token info:id = "ND_lama_conductor"
    int inputs:fresnelMode = 1
    float3 inputs:IOR = (0.2, 0.4, 1.4)
    float3 inputs:extinction = (3.4, 2.3, 1.8)
    float inputs:roughness = 0.5
    token outputs:out
  }
}
"""


def test_graphs_of_closures_are_stacks_in_usd_as_well(tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    path.write_text(LAYERED)
    metal = vt.Interface(eta=(0.2, 0.4, 1.4), k=(3.4, 2.3, 1.8), alpha=0.25)
    found = vt.imports.read(path)
    assert found.stack.layers == (vt.Interface(eta=1.6, alpha=0.04), metal) and not found.left


def test_other_layers_are_not_read(tmp_path: Path) -> None:
    """Expected: what references, payloads and sublayers hold is left out and listed, also in variants."""
    other = Usd.Stage.CreateNew(str(tmp_path / "other.usda"))
    preview(other, "/Hidden", metallic=1.0)
    other.GetRootLayer().Save()
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    preview(stage)
    stage.GetRootLayer().subLayerPaths.append("other.usda")
    prim = stage.DefinePrim("/Model")
    prim.GetReferences().AddReference("other.usda", "/Hidden")
    prim.GetPayloads().AddPayload("other.usda", "/Hidden")
    variants = prim.GetVariantSets().AddVariantSet("look")
    variants.AddVariant("one")
    variants.SetVariantSelection("one")
    with variants.GetVariantEditContext():
        prim.GetReferences().AddReference("other.usda", "/Hidden")
    stage.GetRootLayer().Save()
    found = vt.imports.read(tmp_path / "a.usda")
    assert found.stack.name == "Wood"
    assert "references 4: other layers are not read" in map(str, found.left)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nonsense", "cannot be read as USD: "),
        ("#usda 1.0\n(", "cannot be read as USD: "),
        ("#usda 1.0\n", "has no material that is read here"),
        ('#usda 1.0\ndef Material "A" {}\n', "material A: has no surface that is read here"),
        ('#usda 1.0\ndef Material "A" {\ntoken outputs:surface.connect = </A/S.outputs:surface>\ndef Shader "S" {\n'
         'uniform token info:id = "Toon"\ntoken outputs:surface\n}\n}\n', "material A: its surface Toon is none of "),
        ('#usda 1.0\ndef Material "A" (customData = {string velatura = "{[["}) {}\n', "has no surface that is read"),
    ],
)  # fmt: skip
def test_other_files_are_refused_in_one_line(run: Run, tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.usda"
    path.write_text(text)
    status, out, said = run("import", str(path))
    assert status == 2 and not out and said.count("\n") == 1 and message in said


def test_without_usd_core_one_line_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = saved(GOLD, tmp_path)
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingTool, match=r'is not installed: run `.* -m pip install "velatura\[usd\]"`'):
        vt.imports.read(path)
