"""Parameters for programs that take no code: what is written is read back by their readers, and the loss is said."""

from __future__ import annotations

import functools
import json
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from materialx import document, generated

import velatura as vt
from velatura import kernel
from velatura.bakes import TARGETS, Bake
from velatura.checks.probe import Probe
from velatura.model import named
from velatura.optics.directions import directions
from velatura.programs import fit
from velatura.programs.from_stack import Described
from velatura.programs.gltf import formulas as gltf
from velatura.programs.gltf.read import read as imported_gltf
from velatura.programs.lost import lost
from velatura.programs.parameters import complete
from velatura.programs.sampled import Sampled
from velatura.stack import Material

Run = Callable[..., tuple[int, str, str]]

bake = functools.cache(vt.bakes.bake)  # of materials that several tests bake

SHEEN = vt.Stack([vt.Interface(eta=1.6, alpha=0.1), vt.Diffuse(albedo=(0.6, 0.2, 0.1))], name="Paint")


@pytest.fixture(scope="module", params=TARGETS)
def baked(request) -> Bake:
    return bake(SHEEN, request.param)


# Fits -----------------------------------------------------------------------------------------------------------------


def test_a_dielectric_over_paint_is_held_by_all(baked: Bake) -> None:
    """Expected: all of them have this material, with its index and roughness; what is lost is how Fresnel's formula is
    approximated, and light between the layers.
    """
    index, roughness = {
        "openpbr": ("specular_ior", "specular_roughness"),
        "gltf": ("ior", "roughnessFactor"),
        "gltf-coat": ("ior", "roughnessFactor"),
        "usd": ("ior", "roughness"),
        "blender-principled": ("IOR", "Roughness"),
        "mitsuba-principled": ("eta", "roughness"),
    }[baked.target]
    assert (baked.values[index], baked.values[roughness]) == pytest.approx((1.6, 0.1**0.5), abs=1e-4)
    assert baked.total_variation.max() < 0.065
    assert np.abs(baked.baked_albedo - baked.albedo).max() < 0.03
    for each in TARGETS[baked.target].parameters:
        value = np.array(baked.values[each.name])
        assert np.all((value >= each.low) & (value <= each.high)), each.name


@pytest.mark.parametrize("target", TARGETS)
def test_a_base_without_an_interface_is_its_colour(target: str) -> None:
    """Expected: the albedo, to .01 at the normal; `principled` has its own law of diffuse light, and UsdPreviewSurface
    reflects all light at the edge, regardless of its index."""
    made = bake(vt.Stack([vt.Diffuse(albedo=(0.6, 0.2, 0.1))]), target)
    assert made.baked_albedo[:, 0] == pytest.approx(np.array([0.6, 0.2, 0.1]), abs=0.01)
    assert made.total_variation.max() < (0.1 if target == "usd" else 0.03)


def test_bare_metal_is_what_a_target_that_compensates_has() -> None:
    """Expected: one lobe of the true roughness and colour, to a hundredth."""
    made = bake(vt.Stack([vt.Interface(conductor="Au", alpha=0.2)]), "openpbr")
    assert made.values["base_metalness"] == 1
    assert made.values["specular_roughness"] == pytest.approx(0.2**0.5, abs=0.01)
    assert made.total_variation.max() < 0.01


def test_brushing_is_turned_with_the_material() -> None:
    """Expected: glTF's direction is that of greater roughness, which is the second axis here."""
    made = bake(vt.Stack([vt.Interface(conductor="Al", alpha=(0.1, 0.3), rotation=20)]), "gltf")
    turn = np.degrees(made.values["anisotropyRotation"])
    assert (turn - 110 + 90) % 180 - 90 == pytest.approx(0, abs=2)
    along, across = gltf.alphas(made.values["roughnessFactor"], made.values["anisotropyStrength"])
    assert (along, across) == pytest.approx((0.3, 0.1), rel=0.1)


def test_panes_pass_light() -> None:
    plate = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Medium(sigma_a=(0.7, 0.3, 0.1)), vt.Interface(eta=1.0)])
    made = bake(plate, "gltf")
    assert made.thin and made.values["transmissionFactor"] > 0.9
    assert np.abs(made.baked_passed - made.passed)[:, :2].max() < 0.06


def test_the_same_material_gives_the_same_numbers() -> None:
    first, second = (vt.bakes.bake(SHEEN, "gltf") for _ in range(2))
    assert first.values == second.values


def test_what_is_not_held_is_said() -> None:
    stack = vt.Stack(
        [
            vt.Interface(eta=1.5, alpha=(0.1, 0.2), films=[{"eta": 1.4, "thickness_nm": 300}]),
            vt.Medium(sigma_a=0.1, sigma_s=0.2),
            vt.Interface(eta=1.7, alpha=0.1),
            vt.Interface(conductor="Al", alpha=(0.1, 0.3), rotation=30),
        ],
        exterior=1.33,
    )
    described = Described.of(Material.of(stack), named("belcour2018"))
    assert list(lost(described, TARGETS["mitsuba-principled"])) == [
        "exterior: indices are taken relative to it, so that the material stands in air",
        "layers 2, 3: merged into one base",
        "layer 0: the coat's brushing is left out",
        "layer 0: the coat's index is 1.5; its reflectance is the coat's weight",
        "layer 0: thin films are replaced by a colour",
        "layer 3: brushing is held along the tangent only",
        "layer 1: scattering is part of the base's colour",
        "layer 1: absorption is part of the base's colour, at all angles alike",
    ]


# Mixtures -------------------------------------------------------------------------------------------------------------

TAN = (0.9, 0.6, 0.3)
COPPER = vt.Stack([vt.Interface(eta=(0.28, 0.48, 1.08), k=(3.6, 2.6, 2.4), alpha=0.2)])
PAINT = vt.Stack([vt.Interface(eta=1.5, alpha=0.2), vt.Diffuse(albedo=TAN)])
LACQUER = vt.Interface(eta=1.5, alpha=0.05)


@pytest.mark.parametrize(
    ("target", "metal", "coat"),
    [
        ("openpbr", "base_metalness", "coat_weight"),
        ("gltf", "metallicFactor", "clearcoatFactor"),
        ("blender-principled", "Metallic", "Coat Weight"),
    ],
)
def test_metalness_and_coverage_are_shares_of_a_mixture(target: str, metal: str, coat: str) -> None:
    """Expected: the shares that are metal and that have a coat of index 1.5, as a program has them itself; of a metal
    beside a dielectric of the same roughness 97 % of the light is in its place."""
    made = bake(vt.Mix([(0.4, COPPER), (None, PAINT)]), target)
    assert made.values[metal] == pytest.approx(0.4, abs=1e-6)
    assert made.values[coat] == 0
    assert made.total_variation.max() < 0.03 and np.abs(made.baked_albedo - made.albedo).max() < 0.02
    coated = vt.Mix([(0.4, vt.Stack([LACQUER, *COPPER.layers])), (None, COPPER)])
    assert bake(coated, target).values[coat] == pytest.approx(0.4, abs=1e-6)


def test_a_black_material_is_black_in_all() -> None:
    """Expected: a fit, where no light sets a scale."""
    black = vt.Stack([vt.Interface(eta=1.0, alpha=0.2), vt.Diffuse(albedo=0.0)])
    for target in TARGETS:
        most = 0.1 if target == "usd" else 0.01  # UsdPreviewSurface always reflects at the edge
        assert bake(vt.Mix([(0.0, PAINT), (None, black)]), target).baked_albedo.max() < most


@pytest.mark.parametrize("target", TARGETS)
def test_the_light_of_a_mixture_is_the_weighted_sum(target: str) -> None:
    """Expected: the albedo that is compared, to the errors of quadrature; of two equal parts the parameters of one."""
    made, *each = (bake(m, target) for m in (vt.Mix([(0.3, COPPER), (None, PAINT)]), COPPER, PAINT))
    np.testing.assert_allclose(made.albedo, 0.3 * each[0].albedo + 0.7 * each[1].albedo, atol=2e-3)
    alike = bake(vt.Mix([(0.3, PAINT), (None, PAINT)]), target)
    assert np.abs(alike.baked_albedo - each[1].baked_albedo).max() < 0.01


def test_the_bake_of_a_mixture_is_compared_with_walks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the albedo of walks through both parts, to the loss that is stated and 4 standard errors."""
    monkeypatch.setattr(fit, "COMPARED", 2**15)  # nodes, which err by much less than so few walks
    mix = vt.Mix([(0.4, COPPER), (None, PAINT)])
    found, made = vt.compare(mix, models=["openpbr"], paths=4000, seed=3, microsurface=True), bake(mix, "openpbr")
    stated = np.abs(made.baked_albedo - made.albedo).max()
    off = np.abs(found.models["openpbr"].evaluated - found.truth.albedo)
    assert np.all(off < stated + 4 * found.albedo_error)


def test_a_mixture_stays_in_its_file_and_its_losses_name_parts(tmp_path: Path) -> None:
    """Expected: the file holds the mixture, which is read again; a mask is replaced by its mean."""
    vt.scenes.write_image(np.linspace(0, 1, 16, dtype=np.float32).reshape(4, 4, 1), tmp_path / "mask.exr")
    thick = vt.Stack([LACQUER, vt.Medium(sigma_a=0.1, sigma_s=0.3), vt.Diffuse(albedo=TAN)], name="thick")
    mask = {"texture": str(tmp_path / "mask.exr"), "scale": 0.8}
    mix = vt.Mix([(mask, "bare-gold"), (None, vt.Mix([(0.5, thick), (None, PAINT)]))], name="Worn")
    for target, ending in (("openpbr", ".mtlx"), ("gltf", ".gltf"), ("mitsuba-principled", ".xml")):
        made = vt.export(mix, target, folder=tmp_path)
        made.save(tmp_path / f"worn{ending}")
        lost = [note for note in made.notes if note.startswith("not held: ")]
        assert (
            "not held: the parts become one surface, which has their shares of metal, coat and light that passes"
            in lost
        )
        assert "not held: part 1.0: layer 1: scattering is part of the base's colour" in lost
        assert "not held: part0_weight: the image is replaced by its mean" in lost
        with pytest.warns(UserWarning, match="holds the stack that the parameters were fitted to"):
            assert vt.load(tmp_path / f"worn{ending}") == mix


@pytest.mark.parametrize("target", TARGETS)
def test_a_pane_that_becomes_a_solid_is_said(target: str) -> None:
    pane = Described.of(Material.of(vt.preset("frosted-glass")), named("belcour2018"))
    said = "transmission: light is refracted as into a solid, and does not leave a pane"
    assert (said in lost(pane, TARGETS[target])) == (target in ("blender-principled", "mitsuba-principled"))


def test_unknown_targets_are_refused() -> None:
    with pytest.raises(vt.InvalidInput, match=r"unknown target 'unreal' \(known: openpbr, gltf,"):
        bake(SHEEN, "unreal")


# Files ----------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Callable[[str, str], Path]:
    """The file of a target, written once."""
    made: dict[str, Path] = {}

    def file(target: str, ending: str) -> Path:
        if target not in made:
            made[target] = tmp_path_factory.mktemp("bakes") / f"paint{ending}"
            vt.export(SHEEN, target).save(made[target])
        return made[target]

    return file


def loaded_bsdf(path: Path) -> Any:
    mi = kernel.mitsuba()
    scene = f"""<scene version="3.0.0"><include filename="{path.name}"/>
        <shape type="sphere"><ref id="material"/></shape></scene>"""
    (path.parent / "scene.xml").write_text(scene)
    return mi.load_file(str(path.parent / "scene.xml")).shapes()[0].bsdf()


def test_mitsuba_renders_the_loss_that_is_said(files) -> None:
    """Expected: the albedo of the plugin in the file is the one that the bake says, to the noise of its samples."""
    probe, rng = Probe(loaded_bsdf(files("mitsuba-principled", ".xml"))), np.random.default_rng(0)
    made = bake(SHEEN, "mitsuba-principled")
    for n, cosine in enumerate(made.cos_theta):
        wi = np.broadcast_to([np.sqrt(1 - cosine**2), 0, cosine], (200_000, 3))
        drawn = probe.sample(wi, rng.random((200_000, 3)))
        weight = drawn.weight * (drawn.wo[:, 2:] > 0)
        # 4 standard errors of the mean in each of 9 numbers, a false alarm of .06 %, and .002 of our own quadrature
        error = 4 * weight.std(axis=0) / np.sqrt(len(weight)) + 0.002
        assert np.all(np.abs(weight.mean(axis=0) - made.baked_albedo[:, n]) < error)


def test_gltf_holds_one_material_by_its_extensions(files) -> None:
    document = json.loads(files("gltf", ".gltf").read_text())
    assert document["asset"]["version"] == "2.0"
    (material,) = document["materials"]
    names = {each.name: each for each in gltf.PARAMETERS}
    for extension, values in material.get("extensions", {}).items():
        assert extension in document["extensionsUsed"]
        assert all(names[name].within == extension for name in values)
    core = material["pbrMetallicRoughness"]
    assert len(core["baseColorFactor"]) == 4 and core["baseColorFactor"][3] == 1
    about = material["extras"]["velatura"]
    assert about["material"] == json.loads(json.dumps(SHEEN.to_dict()))
    assert about["loss"]["total_variation"] == pytest.approx(bake(SHEEN, "gltf").total_variation, abs=1e-3)
    # The values are those of the bake
    written = {**core, **{k: v for part in material.get("extensions", {}).values() for k, v in part.items()}}
    written["baseColorFactor"] = core["baseColorFactor"][:3]
    held = {name: tuple(value) if isinstance(value, list) else value for name, value in written.items()}
    assert complete(gltf.PARAMETERS, held) == bake(SHEEN, "gltf").values


def test_materialx_has_a_material_with_known_inputs(files) -> None:
    root = ElementTree.parse(files("openpbr", ".mtlx")).getroot()
    (surface,) = root.findall("open_pbr_surface")
    known = {each.name for each in TARGETS["openpbr"].parameters}
    assert {each.get("name") for each in surface} <= known | {"geometry_thin_walled"}
    (shader,) = root.findall("surfacematerial/input")
    assert shader.get("nodename") == surface.get("name")


def test_materialx_generates_code_of_images_and_turned_brushing(painted: vt.Stack) -> None:
    """Expected: a valid document, whose code takes the turned tangent, or reads the images."""
    brushed = vt.Stack([vt.Interface(conductor="Al", alpha=(0.1, 0.3), rotation=20)])
    for stack, part in ((brushed, "mx_rotate_vector3("), (painted, "base_color_image")):
        assert part in generated(document(vt.export(stack, "openpbr").text), "glsl")


def test_blender_runs_the_script(files, monkeypatch) -> None:
    """Expected: every input that the script sets is one of the node's; its values are those of the bake."""
    inputs = {each.name: SimpleNamespace(default_value=None) for each in TARGETS["blender-principled"].parameters}
    node = SimpleNamespace(type="BSDF_PRINCIPLED", inputs=inputs)
    material = SimpleNamespace(node_tree=SimpleNamespace(nodes=[SimpleNamespace(type="OUTPUT_MATERIAL"), node]))
    materials = SimpleNamespace(new=lambda name: material)
    monkeypatch.setitem(sys.modules, "bpy", SimpleNamespace(data=SimpleNamespace(materials=materials)))
    runpy.run_path(str(files("blender-principled", ".py")))
    for name, value in bake(SHEEN, "blender-principled").values.items():
        assert inputs[name].default_value == ((*value, 1.0) if isinstance(value, tuple) else value)


def test_the_command_says_the_loss_beside_the_file(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "paint.gltf"
    status, out, said = run("export", "varnished-paint", "--to", "gltf", "-o", str(path))
    assert status == 0 and out.strip() == f"{path}, and beside it {path}.json"
    assert "total variation:" in said and "not held: layer 1: absorption is part of the base's colour" in said
    status, _, said = run("export", "varnished-paint", "--to", "gltf", "-o", str(tmp_path / "paint.xml"))
    assert status == 2 and ".gltf" in said


# Textures -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def painted(tmp_path_factory) -> vt.Stack:
    """Paint with an image in sRGB below an interface whose roughness is one, too."""
    folder, mi = tmp_path_factory.mktemp("images"), kernel.mitsuba()
    colours = np.full((4, 4, 3), (150, 100, 60), np.uint8)
    colours[:2] //= 2
    mi.Bitmap(colours).write(str(folder / "paint.png"))
    mi.Bitmap(np.full((4, 4, 1), 51, np.uint8)).write(str(folder / "rough.png"))
    rough = vt.Texture(texture=folder / "rough.png", scale=0.5)
    paint = vt.Texture(texture=folder / "paint.png", channel="rgb", encoding="srgb")
    return vt.Stack([vt.Interface(eta=1.5, alpha=rough), vt.Diffuse(albedo=paint)])


@pytest.mark.parametrize("target", TARGETS)
def test_means_are_fitted_and_images_stay_where_they_can(painted: vt.Stack, target: str) -> None:
    """Expected: the light of the material with its means; a factor on an image, whose mean is then that number."""
    texels = [((np.array((150, 100, 60)) // part / 255 + 0.055) / 1.055) ** 2.4 for part in (1, 2)]
    mean = np.mean(texels, axis=0)
    made = bake(painted, target)
    plain = bake(painted.replace(layer0_alpha=0.1, layer1_albedo=tuple(mean)), target)
    colour, rough = TARGETS[target].colour, TARGETS[target].roughness
    assert made.baked_albedo == pytest.approx(plain.baked_albedo, abs=2e-3)
    assert set(made.images) == {colour, rough} - {""}
    said = [line for line in made.lost if "image" in line]
    assert said == [
        *([] if rough else ["layer0_alpha: the image is replaced by its mean"]),
        *([] if colour else ["layer1_albedo: the image is replaced by its mean"]),
    ]
    if colour:
        assert np.array(made.images[colour].factor) * mean == pytest.approx(np.array(made.values[colour]), rel=1e-2)
    if rough:
        assert made.images[rough].factor * 0.2**0.5 == pytest.approx(made.values[rough], rel=1e-3)


def test_files_name_their_images(painted: vt.Stack, tmp_path: Path) -> None:
    paths = {}
    for target, ending in (("gltf", ".gltf"), ("openpbr", ".mtlx")):
        paths[target] = vt.export(painted, target, folder=tmp_path).save(tmp_path / f"paint{ending}")[0]
        read = vt.imports.read(paths[target]).stack.flat()["layer1_albedo"]
        assert isinstance(read, vt.Texture) and read.texture.resolve().exists()
    document = json.loads(paths["gltf"].read_text())
    assert (tmp_path / document["images"][0]["uri"]).exists()
    assert document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0}
    root = ElementTree.parse(paths["openpbr"]).getroot()
    inputs = {each.get("name"): each.get("nodename") for each in root.find("open_pbr_surface") or ()}
    nodes = {each.get("name"): each for each in root}
    for name, reader in (("base_color", "base_color_image"), ("specular_roughness", "specular_roughness_image")):
        assert nodes[inputs[name]].tag == "multiply"
        assert (tmp_path / str(nodes[reader][0].get("value"))).exists()


# Comparisons ----------------------------------------------------------------------------------------------------------


def test_bakes_are_compared_with_the_truth_beside_the_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the numbers of the bake itself, against walks in place of the model."""
    monkeypatch.setattr(fit, "COMPARED", 2**17)
    targets = ["gltf", "mitsuba-principled"]
    found = vt.compare(SHEEN, ["velatura", *targets], [0.35], paths=100_000)
    assert list(found.models) == ["velatura", *targets]
    for target in targets:
        made = bake(SHEEN, target)
        assert found.models[target].evaluated == pytest.approx(made.baked_albedo[:, 2:], abs=1e-3)
        assert np.isnan(found.models[target].lobes[0].energy).all()
        # By way of the model, whose distance from the truth is mostly the noise of walks
        bound = made.total_variation[2:] + found.total_variation["velatura"]
        assert np.all(found.total_variation[target] < bound + 0.01)


def test_pictures_show_the_bake_that_can_be_rendered() -> None:
    with pytest.raises(
        vt.InvalidInput, match="pictures: not with openpbr, gltf; of the bakes, only mitsuba-principled"
    ):
        vt.compare(SHEEN, ["openpbr", "velatura", "gltf"], paths=100, pictures=True)


# Round trips ----------------------------------------------------------------------------------------------------------

FOREIGN: dict[str, dict[str, Any]] = {
    "metal": {"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.6, 0.3, 1.0], "roughnessFactor": 0.5}},
    "plastic": {
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.2, 0.1, 1.0], "metallicFactor": 0, "roughnessFactor": 0.4},
        "extensions": {"KHR_materials_ior": {"ior": 1.7}},
    },
    "coated": {
        "pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.7, 0.7, 1.0], "roughnessFactor": 0.6},
        "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.2}},
    },
}


@pytest.mark.parametrize("name", FOREIGN)
def test_gltf_comes_back_from_a_stack(name: str) -> None:
    """Expected: the stack exactly, and parameters by which the material looks as it did, in glTF's own formulas."""
    stack = vt.imports.from_gltf(FOREIGN[name]).stack
    entry = json.loads(vt.export(stack, "gltf").text)["materials"][0]
    assert vt.imports.from_gltf(entry).stack == stack
    # By its values, in glTF's own formulas: there, rough metals lose light, and coats do not blur what is below
    flat = dict(FOREIGN[name]["pbrMetallicRoughness"])
    for part in FOREIGN[name].get("extensions", {}).values():
        flat |= part
    flat["baseColorFactor"] = flat["baseColorFactor"][:3]
    model = named("velatura")
    shown = Sampled.of(Described.of(Material.of(stack), model), model, directions([1.0, 0.7, 0.35]), 2**14)
    before, after = (gltf.value(values, shown.pair) for values in (flat, bake(stack, "gltf").values))
    apart = np.abs(shown.distribution(after) - shown.distribution(before)).mean(axis=0).sum(axis=(1, 2))
    assert np.all(0.5 * apart / shown.energy(before).mean(axis=0) < 0.2)
    assert np.all(np.abs(shown.energy(after) - shown.energy(before)) < 0.12)


def foreign(rng: np.random.Generator, metal: float) -> dict[str, Any]:
    """A metal or a paint of glTF, bare or below a clearcoat, plain, brushed, or with a film."""
    kind = rng.integers(3)
    values: dict[str, Any] = {
        "baseColorFactor": tuple(rng.uniform(0.1, 0.9, 3)),
        "metallicFactor": metal,
        "roughnessFactor": rng.uniform(0.1, 0.9),
        "ior": 1.5 if metal else rng.uniform(1.3, 2.0),
    }
    if rng.random() < 0.6:
        values |= {"clearcoatFactor": rng.choice([0.4, 1.0]), "clearcoatRoughnessFactor": rng.uniform(0.1, 0.6)}
    if kind == 1:
        values |= {"anisotropyStrength": rng.uniform(0.3, 0.8), "anisotropyRotation": rng.uniform(0.2, 1.4)}
    if kind == 2:
        thickness = rng.uniform(150, 500)
        values |= {"iridescenceFactor": 1.0, "iridescenceIor": 1.8, "iridescenceThicknessMaximum": thickness}
    return values


def _kinds(material: Any) -> list[tuple[str, ...]]:
    return [stack.kinds for _, stack in material.leaves()]


@pytest.mark.parametrize("metal", [0.0, 1.0])
def test_numbers_of_gltf_keep_what_the_stack_holds(metal: float) -> None:
    """Expected: by numbers alone, metal stays metal, coats and films stay, a clearcoat keeps its weight and roughness,
    to .02, and a bare base the latter and its brushing; the stack of these numbers has the same layers.

    Colours, indices and what a coat blurs follow the light of the stack, which is not that of glTF's formulas.
    """
    rng = np.random.default_rng(1)
    for _ in range(8):
        drawn = foreign(rng, metal)
        given, stack = complete(gltf.PARAMETERS, drawn), imported_gltf(drawn).stack
        made = bake(stack, "gltf").values
        same = ["metallicFactor", "transmissionFactor", "clearcoatFactor", "clearcoatRoughnessFactor"]
        same += ["iridescenceFactor"]
        if not drawn.get("clearcoatFactor"):
            same += ["roughnessFactor", "anisotropyStrength"]
        if "anisotropyStrength" in drawn:
            assert np.sin(made["anisotropyRotation"] - given["anisotropyRotation"]) == pytest.approx(0, abs=0.05)
        for name in same:
            assert made[name] == pytest.approx(given[name], abs=0.02), (name, drawn)
        again = {name: value for name, value in made.items() if np.all(np.isfinite(value))}
        assert _kinds(imported_gltf(again).stack) == _kinds(stack)


@pytest.mark.parametrize("target, ending", [("gltf", ".gltf"), ("openpbr", ".mtlx"), ("mitsuba-principled", ".xml")])
def test_files_hold_their_stack_until_they_are_changed(files, target: str, ending: str, tmp_path: Path) -> None:
    path = files(target, ending)
    found = vt.imports.read(path)
    assert found.stack == SHEEN and ["which is read" in each.why for each in found.left] == [True]
    value = next(v for v in bake(SHEEN, target).values.values() if isinstance(v, float) and 0.01 < v < 0.99)
    changed = tmp_path / path.name
    changed.write_text(path.read_text().replace(f'"{value:g}"', '"0.5"').replace(f": {value!r}", ": 0.5"))
    assert changed.read_text() != path.read_text()
    assert vt.imports.read(changed).stack != SHEEN


def test_names_and_texts_of_any_kind_stand_in_files(tmp_path: Path) -> None:
    stack = vt.Stack(SHEEN.layers, name="Paint -- <old> & \"new\" --> {'a'}")
    for target, ending in (("openpbr", ".mtlx"), ("mitsuba-principled", ".xml"), ("gltf", ".gltf")):
        path = vt.export(stack, target).save(tmp_path / f"paint{ending}")[0]
        assert vt.imports.read(path).stack == stack
