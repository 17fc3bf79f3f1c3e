"""Lobes as a graph of MaterialX: it is valid, and every generator makes code of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from materialx import GENERATORS, document, generated

import velatura as vt
from velatura.model import named
from velatura.shader.closures import losses, tabulated
from velatura.shader.polynomials import PolynomialFit
from velatura.stack import Material


@pytest.mark.parametrize(("preset", "model"), [("frosted-metal", "weier2020"), ("tinted-plate", "weier2020")])
def test_all_generators_make_code_of_the_graph(preset: str, model: str) -> None:
    """Facets for each lobe that has light; only those of genosl have other weights."""
    text = vt.export(preset, "mtlx", model).text
    made = document(text)
    assert len(made.getMaterialNodes()) == 1
    for target in GENERATORS:
        assert "velatura_lobes" in generated(made, target), target
    osl = generated(made, "osl")
    kinds = tabulated(Material.of(vt.preset(preset)), named(model)).kinds
    body = osl.split("NG_velatura_lobes", 1)[1].split("\n}\n")[0]
    assert body.count("mx_generalized_schlick_bsdf(") == sum(kind not in ("diffuse", "translucent") for kind in kinds)
    assert body.count("translucent_bsdf(") == kinds.count("translucent") == text.count("<translucent_bsdf")


@pytest.fixture
def image(tmp_path: Path) -> str:
    (tmp_path / "map.png").touch()
    return str(tmp_path / "map.png")


@pytest.mark.parametrize(
    ("preset", "key", "varies"),
    [
        ("coated-gold", "layer0_alpha", {"channel": "g", "scale": 0.5}),
        ("tinted-plate", "layer1_sigma_a", {"channel": "rgb", "encoding": "srgb"}),
        ("turned-brushing", "layer1_rotation", {"brushing": "concentric", "u": 0.25}),
    ],
)
def test_all_generators_make_code_of_layers_with_textures(
    preset: str, key: str, varies: dict[str, Any], image: str
) -> None:
    """Values of layers are inputs of the node; those that vary come from nodes of the document, whose image lies where
    the stack has it."""
    value = varies if "brushing" in varies else {"texture": image, **varies}
    text = vt.export(vt.preset(preset).replace(**{key: value}), "mtlx", "weier2020").text
    made = document(text)
    for target in GENERATORS:
        assert "velatura_lobes" in generated(made, target), target
    (lobes,) = [node for node in made.getNodes() if node.getCategory().startswith("velatura_lobes")]
    connected = [each for each in lobes.getInputs() if each.getName().startswith(key)]
    assert all(each.getConnectedNode() for each in connected) and connected
    images = made.getNodes("image")
    assert [node.getInputValue("file") for node in images] == [] if "brushing" in varies else [image] * len(images)


@pytest.mark.usefixtures("coarse_solutions")
@pytest.mark.parametrize(("preset", "off"), [("frosted-metal", 0.01), ("turned-brushing", 0.1)])
def test_polynomials_are_the_columns_that_they_stand_for(preset: str, off: float) -> None:
    """Weights within .01; roughness too, but of brushed lobes, which changes fast at some azimuths."""
    baked = tabulated(Material.of(vt.preset(preset)), named("velatura"))
    cosine, phi = np.meshgrid(np.linspace(0.2, 0.98, 9), np.linspace(0, 3, 7), indexing="ij")
    sine = np.sqrt(1 - cosine**2)
    wi = tuple(x.ravel() for x in (sine * np.cos(phi), sine * np.sin(phi), cosine))
    for a, b in zip(PolynomialFit(baked).above(wi), baked.above(wi)):
        np.testing.assert_allclose(a.weight, b.weight, atol=0.01)
        np.testing.assert_allclose(np.sort(a.roughness[:2], 0), np.sort(b.roughness[:2], 0), atol=off)


@pytest.mark.parametrize("model", ["belcour2018", "weier2020"])
def test_polynomials_of_models_in_closed_form_have_their_light(model: str) -> None:
    """Expected: as the closures in closed form, within .01 of the light: facets of both lose what they block."""
    material, chosen = Material.of(vt.preset("coated-gold")), named(model)
    for loss in losses([(1.0, material)], chosen, PolynomialFit(tabulated(material, chosen)).above):
        assert loss.variation < 0.01
        assert loss.albedo < 0.002


def test_what_a_graph_cannot_hold_is_refused_in_a_line(image: str) -> None:
    rough = {"layer0_alpha": {"texture": image}}
    with pytest.raises(vt.InvalidInput, match=r"mtlx: a graph has no tables, which velatura .* looks up"):
        vt.export(vt.preset("coated-gold").replace(**rough), "mtlx")
    with pytest.raises(vt.InvalidInput, match="mtlx: a graph has no tables, which weier2020 looks up"):
        vt.export(vt.preset("glossy-plastic").replace(**rough), "mtlx", "weier2020")
    curved = {"layer0_alpha": {"texture": image, "curve": [0, 0.5, 0.6]}}
    with pytest.raises(vt.InvalidInput, match="mtlx: layer0_alpha_u: textures with a curve"):
        vt.export(vt.preset("coated-gold").replace(**curved), "mtlx", "weier2020")
    with pytest.raises(vt.InvalidInput, match=r"mtlx: the index below over that above must be 1, or 1\.223 at least"):
        vt.export(vt.Stack([vt.Interface(eta=1.1, alpha=0.2)]), "mtlx", "weier2020")


PAINT = vt.Stack([vt.Interface(eta=1.5, alpha=0.2), vt.Interface(conductor="Al", alpha=0.3)])


def test_a_mixture_mixes_its_stacks_by_their_shares(image: str) -> None:
    """Expected: a chain of `mix`, in which each stack has its share; all generators make code of it."""
    mix = vt.Mix([(0.3, "frosted-metal"), (0.5, vt.Mix([(0.25, PAINT), (None, PAINT)])), (None, "tinted-plate")])
    made = document(vt.export(mix, "mtlx", "weier2020").text)
    node, rest, found = made.getNode("material_surface").getConnectedNode("bsdf"), 1.0, []
    while node.getCategory() == "mix":
        weight = node.getInputValue("mix")
        found.append((node.getConnectedNode("fg").getName(), rest * weight))
        node, rest = node.getConnectedNode("bg"), rest * (1 - weight)
    found.append((node.getName(), rest))
    names = ["part0", "part1_part0", "part1_part1", "part2"]
    assert [name for name, _ in found] == [f"material_{name}_lobes" for name in names]
    assert [share for _, share in found] == pytest.approx([share for share, _ in mix.weighted("")], abs=1e-6)
    for target in GENERATORS:
        assert "velatura_lobes_material_part1_part1" in generated(made, target), target

    # A mask
    masked = vt.Mix([({"texture": image, "channel": "g"}, "frosted-metal"), (None, PAINT)])
    made = document(vt.export(masked, "mtlx", "weier2020").text)
    (weight,) = (node.getConnectedNode("mix") for node in made.getNodes("mix"))
    assert weight.getCategory() == "min" and len(made.getNodes("image")) == 1  # kept within 0 and 1
    for target in GENERATORS:
        assert generated(made, target), target
    curved = vt.Mix([({"texture": image, "curve": [0, 0.5, 0.6]}, "frosted-metal"), (None, PAINT)])
    with pytest.raises(vt.InvalidInput, match="mtlx: part0_weight: textures with a curve"):
        vt.export(curved, "mtlx", "weier2020")
