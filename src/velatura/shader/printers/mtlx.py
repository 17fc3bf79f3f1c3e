"""A material as a graph of MaterialX's nodes, which works out the lobes and adds up their closures.

A graph has no tables. Weights and roughnesses of a uniform material are polynomials of the direction of view; where
values come from textures the graph holds the layers, of a model in closed form.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import degrees
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from velatura import ops
from velatura.errors import InvalidInput
from velatura.model import Model
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.shader import closures
from velatura.shader.closures import Closure, Closures
from velatura.shader.material import brushed, place
from velatura.shader.polynomials import PolynomialFit
from velatura.shader.printers.nodes import LOOKED_UP, Node, NodeGraph, constant, string
from velatura.shader.program import described
from velatura.shader.recorder import recording
from velatura.shader.recorder.graph import Graph
from velatura.shader.recorder.symbol import Operand, colour, in_order, number
from velatura.stack import Address, Brushing, Stack, Texture

SLIGHT = 1e-6  # of its tangent, so that it has an azimuth
INDEX_MIN = 1.223  # beyond a surface that refracts: MaterialX derives it from a reflectance of .01 at least
_SMOOTH = {"diffuse": "oren_nayar_diffuse_bsdf", "translucent": "translucent_bsdf"}


class Recorded(NamedTuple):
    """The closures of a material for a recorded direction, for renderers whose facets keep what they block and for
    those whose facets let it out again; and the former in NumPy."""

    plain: Sequence[Closure]
    conserving: Sequence[Closure]
    known: Closures


def check(values: Iterable[tuple[Address, Any]]) -> None:
    """Refuse textures that have a curve."""
    for at, x in values:
        if isinstance(x, Texture) and x.curve is not None:
            raise InvalidInput(f"mtlx: {at.name}: textures with a curve are for osl and blender")


def record(stack: Stack, model: Model) -> Recorded:
    """The closures of a material, by a model that shaders of it compute.

    Raises:
        InvalidInput: values come from textures, and the model looks up tables; or light passes into a medium of an
            index that MaterialX has not.
    """
    wi = recording.direction("wi")
    found = _uniform(stack, model, wi) if recording.is_uniform(stack) else _layers(stack, model, wi)
    for closure in found.known((0.0, 0.0, 1.0)):
        if closure.kind == "refraction" and np.min(closure.eta) < INDEX_MIN:
            raise InvalidInput(f"mtlx: the index below over that above must be 1, or {INDEX_MIN:g} at least")
    return found


def _uniform(stack: Stack, model: Model, wi: Direction) -> Recorded:
    material = closures.numbers(stack)
    plain, conserving = (PolynomialFit(closures.tabulated(material, model, kept)) for kept in (False, True))
    return Recorded(plain.above(wi), conserving.above(wi), plain.above)


def _layers(stack: Stack, model: Model, wi: Direction) -> Recorded:
    found, known = closures.in_closed_form(stack, model, (), wi)
    read = {symbol.op for symbol in in_order(Graph().unique([x for c in found for x in (c.weight, *c.roughness)]))}
    if read & LOOKED_UP:
        raise InvalidInput(
            f"mtlx: a graph has no tables, which {described(model)} looks up for this material with textures;"
            " weier2020 looks none up without films and diffuse bases"
        )
    return Recorded(found, [_conserving(closure, wi) for closure in found], known)


def _conserving(closure: Closure, wi: Direction) -> Closure:
    """A reflection for renderers that divide by the albedo of facets, MaterialX's fit of it (1.39,
    `mx_ggx_dir_albedo_analytic`, of reflectance 1)."""
    if closure.kind != "reflection":
        return closure
    u, v, _ = closure.roughness
    x, y = wi[2], ops.sqrt(u * v)
    terms = (1.0, x, y, x * y, x * x, y * y, x * x * y, x * y * y, x * x * y * y)
    a, b, c, d = (sum(k * term for k, term in zip(row, terms)) for row in _ALBEDO)
    return closure._replace(weight=closure.weight * (ops.clip(a / c, 0.0, 1.0) + ops.clip(b / d, 0.0, 1.0)))


_ALBEDO = (
    (0.1003, -0.6303, 9.748, -2.038, 29.34, -8.245, -26.44, 19.99, -5.448),
    (0.9345, -2.323, 2.229, -3.748, 1.424, -0.7684, 1.436, 0.2913, 0.6286),
    (1.0, -1.765, 8.263, 11.53, 28.96, -7.507, -36.11, 15.86, 33.37),
    (1.0, 0.2281, 15.94, -55.83, 13.08, 41.26, 54.9, 300.2, -285.1),
)


# Values


def values(stack: Stack, found: Sequence[Closure]) -> list[tuple[Address, Any]]:
    """The values that closures read."""
    symbols = in_order([x for closure in found for x in (closure.weight, *closure.roughness, closure.eta)])
    read = {symbol.detail for symbol in symbols if symbol.op == "input"}
    return [(at, x) for at, x in stack.values() if f"m.{place(at)}" in read]


def varying(
    nodes: NodeGraph, values: Iterable[tuple[Address, Any]], file: Callable[[Path], str]
) -> dict[Address, Node]:
    """Nodes of values that vary; `file` gives the path of an image."""
    found: dict[Address, Node] = {}
    for at, x in values:
        if isinstance(x, Brushing):
            found[at] = _angle(nodes, x)
        elif isinstance(x, Texture):
            found[at] = _image(nodes, at, x, file(x.texture))
    return found


def mixed(nodes: NodeGraph, lobes: Sequence[Node], shares: Sequence[Operand], weights: Mapping[str, Node]) -> Node:
    """The BSDF of stacks side by side, by those of each: each is mixed with all that follow it."""
    rest: Value = 1.0
    over = []
    for share in shares[:-1]:
        over.append(ops.divide(share, rest))
        rest = rest - share
    found = lobes[-1]
    for lobe, weight in zip(lobes[-2::-1], nodes.recorded(over, weights)[::-1]):
        found = nodes.node("mix", "BSDF", fg=lobe, bg=found, mix=weight)
    return found


def _angle(nodes: NodeGraph, brushing: Brushing) -> Node:
    """Degrees of the direction away from the centre."""
    u, v, offset = brushed(brushing)
    turned = ops.arctan2(number("uv.y") - v, number("uv.x") - u) * degrees(1.0) + offset
    uv = nodes.node("texcoord", "vector2")
    (found,) = nodes.recorded([turned], {f"uv.{axis}": nodes.channel(uv, k) for k, axis in enumerate("xy")})
    return found


def _image(nodes: NodeGraph, at: Address, image: Texture, file: str) -> Node:
    """A value of a texel, scaled and kept within the bounds of its parameter."""
    channel = image.channel or "r"
    wide, kind = channel == "rgb", "color4" if channel == "a" else "color3"
    space = "srgb_texture" if image.encoding == "srgb" else "lin_rec709"
    read = nodes.node("image", kind, file=Node("filename", f'value={quoteattr(file)} colorspace="{space}"'))
    part = read if wide else nodes.channel(read, "rgba".index(channel))
    low, high = (float(np.clip(x, -1e6, 1e6)) for x in at.declared.within)
    texel = colour("texel") if wide else number("texel")
    (found,) = nodes.recorded([ops.clip(texel * image.scale + image.offset, low, high)], {"texel": part})
    return nodes.converted("color3" if at.colour else "float", found)


# The graph


def graph(name: str, node: str, target: str, stack: Stack, found: Sequence[Closure]) -> list[str]:
    """The graph that stands for the node."""
    nodes = NodeGraph()
    of, normal, tangent = (
        nodes.of,
        Node("vector3", 'interfacename="normal"'),
        Node("vector3", 'interfacename="tangent"'),
    )

    # The direction of view in the frame of the surface
    view = of("multiply", "vector3", nodes.node("viewdirection", "vector3", space=string("world")), -1.0)
    cosine = of("dotproduct", "float", view, normal)
    if stack.transmits:
        sides = {"in1": normal, "in2": of("multiply", "vector3", normal, -1.0)}
        normal = nodes.node("ifgreatereq", "vector3", value1=cosine, value2=constant("float", 0), **sides)
        cosine = of("absval", "float", cosine)
    across = of("crossproduct", "vector3", normal, tangent)
    inputs = {
        "wi.x": of("add", "float", of("dotproduct", "float", view, tangent), SLIGHT),
        "wi.y": of("dotproduct", "float", view, across),
        "wi.z": of("max", "float", cosine, closures.COS_MIN),
    }
    for at, _ in values(stack, found):
        inputs[f"m.{place(at)}"] = Node("color3" if at.colour else "float", f'interfacename="{at.name}"')

    # The sum of closures
    each = iter(nodes.recorded([x for closure in found for x in _needed(closure)], inputs))
    total = None
    for closure in found:
        weight, u, v, c, s, mirrored, scale = (next(each) for _ in range(7))
        colour = nodes.converted("color3", nodes.converted("vector3", weight))
        if closure.kind in _SMOOTH:
            lobe = nodes.node(_SMOOTH[closure.kind], "BSDF", color=colour, normal=normal)
        else:
            turned = [of("multiply", "vector3", axis, x) for axis, x in ((tangent, c), (across, s))]
            reflectance = nodes.converted("color3", mirrored)
            facets = {
                "weight": scale,
                "color0": reflectance,
                "color90": reflectance,
                "roughness": of("combine2", "vector2", u, v),
                "normal": view if closure.kind == "straight" else normal,
                "tangent": of("add", "vector3", *turned),
                "scatter_mode": string("R" if closure.kind == "reflection" else "T"),
            }
            lobe = of("multiply", "BSDF", nodes.node("generalized_schlick_bsdf", "BSDF", **facets), colour)
        total = of("add", "BSDF", total, lobe) if total else lobe
    assert total
    head = f'  <nodegraph name="{name}" nodedef="ND_{node}"{target}>'
    return [head, *nodes.lines, f'    <output name="out" type="BSDF" {total.where} />', "  </nodegraph>"]


def _needed(closure: Closure) -> list[Value]:
    """The weight, two roughnesses, cosine and sine of the rotation, and of facets their reflectance, which is the same
    at all angles, and what makes up for it.

    MaterialX derives the index beyond from the reflectance, which takes its share of the light that passes.
    """
    u, v, rotation = closure.roughness
    mirrored: Value = 1.0
    scale: Value = 1.0
    if closure.kind in ("refraction", "straight"):
        root = (closure.eta - 1) / (closure.eta + 1)
        mirrored = root * root
        scale = 1 / (1 - mirrored)
    return [closure.weight, u, v, ops.cos(rotation), ops.sin(rotation), mirrored, scale]
