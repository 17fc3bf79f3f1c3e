"""Graphs of closures of MaterialX: the stacks and mixtures that they are, and nodes that are refused by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura.imports import read

Read = Callable[..., Any]

GLOSS = vt.Interface(eta=1.6, alpha=0.04)
GOLD = vt.Interface(eta=(0.2, 0.4, 1.4), k=(3.4, 2.3, 1.8), alpha=0.3)
RED = vt.Diffuse(albedo=(0.6, 0.2, 0.1))
NODES = """
  <dielectric_bsdf name="gloss" type="BSDF"><input name="ior" type="float" value="1.6"/>
    <input name="roughness" type="vector2" value="0.04, 0.04"/></dielectric_bsdf>
  <conductor_bsdf name="gold" type="BSDF"><input name="ior" type="color3" value="0.2, 0.4, 1.4"/>
    <input name="extinction" type="color3" value="3.4, 2.3, 1.8"/>
    <input name="roughness" type="vector2" value="0.3, 0.3"/></conductor_bsdf>
  <oren_nayar_diffuse_bsdf name="red" type="BSDF"><input name="color" type="color3" value="0.6, 0.2, 0.1"/>
  </oren_nayar_diffuse_bsdf>
"""


@pytest.fixture
def graph(tmp_path: Path) -> Read:
    """What is read of nodes, of which the last one, `out`, is the surface's closure, with further inputs of that."""

    def made(nodes: str, surface: str = "", attributes: str = "") -> Any:
        text = f"""<materialx version="1.39" {attributes}>{NODES}{nodes}
          <surface name="S" type="surfaceshader"><input name="bsdf" type="BSDF" nodename="out"/>{surface}</surface>
          <surfacematerial name="M" type="material">
            <input name="surfaceshader" type="surfaceshader" nodename="S"/></surfacematerial></materialx>"""
        path = tmp_path / "a.mtlx"
        path.write_text(text)
        return read(path)

    return made


def two(tag: str, first: str, second: str, name: str = "out", more: str = "") -> str:
    """A node of two closures, by the names of both inputs."""
    (a, x), (b, y) = (each.split("=") for each in (first, second))
    inputs = "".join(f'<input name="{key}" type="BSDF" nodename="{node}"/>' for key, node in ((a, x), (b, y)))
    return f'<{tag} name="{name}" type="BSDF">{inputs}{more}</{tag}>'


def number(name: str, value: object, kind: str = "float") -> str:
    return f'<input name="{name}" type="{kind}" value="{value}"/>'


def parts(found: Any) -> list[tuple[float, tuple[Any, ...]]]:
    return [(round(float(share), 6), stack.layers) for share, stack in found.stack.weighted("no images here")]


def test_layers_are_stacks(graph: Read) -> None:
    """Expected: interfaces of the nodes' own indices and roughnesses, from the top, and nothing left."""
    found = graph(two("layer", "top=gloss", "base=red"))
    assert parts(found) == [(1, (GLOSS, RED))] and not found.left
    assert (found.stack.name, found.stack.source) == ("M", "imported from MaterialX")
    film = number("thinfilm_thickness", 300) + number("thinfilm_ior", 1.4)
    above = f'<dielectric_bsdf name="above" type="BSDF">{number("ior", 1.3)}{film}</dielectric_bsdf>'
    found = graph(above + two("layer", "top=gloss", "base=gold", "inner") + two("layer", "top=above", "base=inner"))
    top = vt.Interface(eta=1.3, alpha=0.05, films=[{"eta": 1.4, "thickness_nm": 300}])
    assert parts(found) == [(1, (top, GLOSS, GOLD))] and not found.left


def test_mixes_and_weights_are_shares(graph: Read) -> None:
    """Expected: a mix below a layer is a mixture of stacks that both have it; a weight is a share with it, beside one
    without; what closures weigh away of a base is black."""
    mixed = two("mix", "fg=gold", "bg=red", "mixed", number("mix", 0.25))
    found = graph(mixed + two("layer", "top=gloss", "base=mixed"))
    assert parts(found) == [(0.25, (GLOSS, GOLD)), (0.75, (GLOSS, RED))]
    half = f'<multiply name="half" type="BSDF"><input name="in1" type="BSDF" nodename="gloss"/>{number("in2", 0.5)}'
    found = graph(half + "</multiply>" + two("layer", "top=half", "base=gold"))
    assert parts(found) == [(0.5, (GLOSS, GOLD)), (0.5, (GOLD,))]
    dim = (
        NODES.split("<oren")[1].replace('name="red"', 'name="out"').replace("</oren", number("weight", 0.5) + "</oren")
    )
    assert parts(graph(f"<oren{dim}")) == [(0.5, (RED,)), (0.5, (vt.Diffuse(albedo=0.0),))]
    assert parts(graph(two("layer", "top=gloss", "base=red"), number("opacity", 0.25)))[0] == (0.25, (GLOSS, RED))


def test_a_colour_on_what_is_below_a_layer_is_a_medium(graph: Read) -> None:
    """Expected: its square root is the transmittance of one crossing; a diffuse base alone has the product."""
    tinted = """<multiply name="tinted" type="BSDF"><input name="in1" type="BSDF" nodename="{}"/>
      <input name="in2" type="color3" value="0.81, 0.49, 0.25"/></multiply>"""
    ((_, layers),) = parts(graph(tinted.format("gold") + two("layer", "top=gloss", "base=tinted")))
    assert layers[0] == GLOSS and layers[2] == GOLD
    np.testing.assert_allclose(np.exp(-np.array(layers[1].sigma_a) * layers[1].depth), (0.9, 0.7, 0.5), rtol=1e-4)
    ((_, layers),) = parts(graph(tinted.format("red") + two("layer", "top=gloss", "base=tinted")))
    assert layers == (GLOSS, vt.Diffuse(albedo=(0.486, 0.098, 0.025)))


def test_brushing_follows_its_nodes(graph: Read) -> None:
    """Expected: the roughness that MaterialX computes of roughness and anisotropy, turned by the tangent's angle."""
    brushed = f"""<roughness_anisotropy name="rough" type="vector2">{number("roughness", 0.5)}
      {number("anisotropy", 0.75)}</roughness_anisotropy><tangent name="t" type="vector3"/>
      <rotate3d name="turned" type="vector3"><input name="in" type="vector3" nodename="t"/>
      {number("amount", 30)}</rotate3d><conductor_bsdf name="out" type="BSDF">
      <input name="roughness" type="vector2" nodename="rough"/><input name="tangent" type="vector3" nodename="turned"/>
      </conductor_bsdf>"""
    ((_, (metal,)),) = parts(graph(brushed))
    assert metal.alpha == pytest.approx((0.5, 0.125)) and metal.rotation == 30
    artistic = """<artistic_ior name="metal" type="multioutput"><input name="reflectivity" type="color3"
      value="0.9, 0.6, 0.3"/><input name="edge_color" type="color3" value="1, 1, 1"/></artistic_ior>
      <conductor_bsdf name="out" type="BSDF"><input name="ior" type="color3" nodename="metal" output="ior"/>
      <input name="extinction" type="color3" nodename="metal" output="extinction"/></conductor_bsdf>"""
    lobes = vt.lobes(graph(artistic).stack, 1.0)
    np.testing.assert_allclose(lobes.energy[0][:, 0], (0.9, 0.6, 0.3), rtol=0.01)


def test_generalized_schlick_is_a_metal_or_a_dielectric(graph: Read) -> None:
    """Expected: the reflectance at the normal, of a metal alone, and of an interface over a base."""
    node = '<generalized_schlick_bsdf name="{}" type="BSDF"><input name="color0" type="color3" value="{}"/>{}'
    close, smooth = "</generalized_schlick_bsdf>", '<input name="roughness" type="vector2" value="0, 0"/>'
    alone = graph(node.format("out", "0.9, 0.6, 0.3", smooth) + close).stack
    assert alone.kinds == ("conductor",)
    np.testing.assert_allclose(vt.lobes(alone, 1.0).energy[0][:, 0], (0.9, 0.6, 0.3), rtol=1e-3)
    over = graph(node.format("top", "0.04, 0.04, 0.04", smooth) + close + two("layer", "top=top", "base=red")).stack
    assert over.layers == (vt.Interface(eta=1.5, alpha=0.0), RED)


def test_light_passes_by_the_mode(graph: Read) -> None:
    """Expected: a solid, and of a thin wall a pane of two like interfaces; none in the mode of reflection."""
    clear = f'<dielectric_bsdf name="out" type="BSDF">{number("scatter_mode", "{}", "string")}</dielectric_bsdf>'
    plain = vt.Interface(eta=1.5, alpha=0.05)
    assert parts(graph(clear.format("RT"))) == [(1, (plain,))]
    pane = graph(clear.format("RT"), number("thin_walled", "true", "boolean")).stack
    assert pane.thin and pane.layers == (plain, vt.Interface(eta=1.0, alpha=0.05))
    assert parts(graph(clear.format("R"))) == [(1, (plain, vt.Diffuse(albedo=0.0)))]


def test_lama_is_a_stack_with_its_thickness(graph: Read) -> None:
    """Expected: absorption that leaves the colour of Lama after its radius, over the thickness of the layer; another
    roughness across by the anisotropy; the top on its share."""
    lama = f"""<LamaDielectric name="lacquer" type="BSDF">{number("fresnelMode", 1, "integer")}{number("IOR", 1.4)}
      {number("roughness", 0.2)}<input name="absorptionColor" type="color3" value="0.8, 0.5, 0.25"/>
      {number("absorptionRadius", 2)}</LamaDielectric>
      <LamaConductor name="metal" type="BSDF">{number("fresnelMode", 1, "integer")}{number("roughness", 0.5)}
      {number("anisotropy", 0.5)}{number("anisotropyRotation", -0.125)}</LamaConductor>"""
    more = number("topThickness", 3) + number("topMix", 0.75)
    found = graph(lama + two("LamaLayer", "materialTop=lacquer", "materialBase=metal", "out", more))
    (share, (top, medium, metal)), (other, bare) = parts(found)
    assert (share, other, bare) == (0.75, 0.25, (metal,)) and not found.left
    assert top == vt.Interface(eta=1.4, alpha=0.04)
    np.testing.assert_allclose(
        np.exp(-np.array(medium.sigma_a) * medium.depth), np.power((0.8, 0.5, 0.25), 1.5), rtol=1e-4
    )
    assert metal.alpha == pytest.approx((0.25, 0.5625)) and metal.rotation == pytest.approx(45)
    assert metal.eta == (0.18, 0.42, 1.37)  # vectors have no colour space
    mixed = graph(lama + two("LamaMix", "material1=red", "material2=metal", "out", number("mix", 0.2)))
    assert [share for share, _ in parts(mixed)] == [0.2, 0.8] and mixed.stack.mix[0].material.kinds == ("conductor",)


def test_images_are_shares_and_colours(graph: Read, tmp_path: Path) -> None:
    """Expected: textures of weights and of albedos."""
    vt.scenes.write_image(np.linspace(0, 1, 12, dtype=np.float32).reshape(2, 2, 3), tmp_path / "wood.png")
    image = """<image name="{}" type="{}"><input name="file" type="filename" value="wood.png"/></image>"""
    found = graph(
        image.format("mask", "float") + image.format("wood", "color3")
        + '<oren_nayar_diffuse_bsdf name="painted" type="BSDF"><input name="color" type="color3" nodename="wood"/>'
        + "</oren_nayar_diffuse_bsdf>"
        + two("mix", "fg=painted", "bg=gold", "out", '<input name="mix" type="float" nodename="mask"/>')
    )  # fmt: skip
    weight, albedo = found.stack.mix[0].weight, found.stack.mix[0].material.base.albedo
    assert isinstance(weight, vt.Texture) and isinstance(albedo, vt.Texture) and albedo.channel == "rgb"


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ('<chiang_hair_bsdf name="out" type="BSDF"/>', "the node out (chiang_hair_bsdf) is none of layer, mix, "),
        (two("add", "in1=gold", "in2=red"), "the node out (add) is none of layer, "),
        (two("layer", "top=gloss", "base=out"), "more than 64 closures within each other, or a cycle of nodes"),
        (two("layer", "top=gloss", "base=nothing"), "base: there is no node nothing"),
        ('<layer name="out" type="BSDF"/>', "the node out lacks base"),
        (f'<conductor_bsdf name="out" type="BSDF">{number("ior", "inf, 1, 1", "color3")}</conductor_bsdf>', "ior: "),
        (f'<dielectric_bsdf name="out" type="BSDF">{number("ior", "x")}</dielectric_bsdf>', "ior: 'x' is no number"),
        ('<dielectric_bsdf name="out" type="BSDF"><input name="roughness" type="vector2" nodename="red"/>'
         "</dielectric_bsdf>", "the node red (oren_nayar_diffuse_bsdf) is no roughness that is read"),
    ],
)  # fmt: skip
def test_other_nodes_are_refused_by_name(graph: Read, tmp_path: Path, nodes: str, message: str) -> None:
    with pytest.raises(vt.InvalidInput) as refused:
        graph(nodes)
    assert str(refused.value).startswith(f"{tmp_path / 'a.mtlx'}: material M: {message}")
    assert "\n" not in str(refused.value)


def test_many_paths_to_a_node_end(graph: Read) -> None:
    """Expected: a line about the budget, of a graph whose paths double with each node, and not hours."""
    doubled = [two("layer", f"top=n{k}", f"base=n{k}", f"n{k + 1}") for k in range(40)]
    with pytest.raises(vt.InvalidInput, match="nodes"):
        graph('<sheen_bsdf name="n0" type="BSDF"/>' + "".join(doubled) + two("layer", "top=n40", "base=n40"))
