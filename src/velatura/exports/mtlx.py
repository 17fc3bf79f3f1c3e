"""A material as a node of MaterialX: a graph of standard nodes that works out the lobes, and the sum of their closures.

A graph has no tables, so that weights and roughnesses are polynomials of the root of the cosine, and of even modes of
the azimuth where lobes are brushed. Every generator turns the graph into code of its language.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from velatura.errors import InvalidInput
from velatura.exports.formats import Export, Request, xml_comment
from velatura.model.mixture import ALPHA_MIN
from velatura.shader import closures, recording
from velatura.shader.material import identifier, title
from velatura.shader.polynomials import Fit
from velatura.shader.program import described
from velatura.stack import Material

NEGLIGIBLE = 3e-4  # of a weight or a roughness, over directions

Array = NDArray[np.floating]


def write(request: Request) -> Export:
    """The node, its graphs, and a material that uses it.

    Raises:
        InvalidInput: light passes, or values come from textures.
    """
    stack = request.stack
    if not recording.is_uniform(stack):
        raise InvalidInput("mtlx: only for uniform materials; textures are for osl and blender")
    if stack.transmits:
        raise InvalidInput("mtlx: only for materials that no light passes; osl and blender take others")
    chosen = recording.drawn_by(stack, request.model)
    material = Material.of(stack).solid()
    plain, conserving = (Fit(closures.tabulated(material, chosen, kept)) for kept in (False, True))
    name = identifier(stack)
    about = [
        f"{title(stack)} as the model {described(request.model)} has it, by Velatura.",
        "Its lobes are polynomials of the direction of view. What their closures are off the model, in light from",
        "above, as total variation and as the greatest difference of albedo:",
        *(f"  {loss}" for loss in closures.losses(material, request.model, plain.above)),
        "Reflections of all targets but genosl are taken to let out again what facets block, as those of MaterialX do.",
    ]
    node = f"velatura_lobes_{name}"
    lines = [
        '<?xml version="1.0"?>',
        '<materialx version="1.39" colorspace="lin_rec709">',
        *xml_comment(about),
        f'  <nodedef name="ND_{node}" node="{node}" nodegroup="pbr" doc={quoteattr(about[0])}>',
        '    <input name="normal" type="vector3" defaultgeomprop="Nworld" />',
        '    <input name="tangent" type="vector3" defaultgeomprop="Tworld" />',
        '    <output name="out" type="BSDF" />',
        "  </nodedef>",
        *_graph(f"NG_{node}", node, "", conserving),
        *_graph(f"NG_{node}_genosl", node, ' target="genosl"', plain),
        f'  <{node} name="{name}_lobes" type="BSDF" />',
        f'  <surface name="{name}_surface" type="surfaceshader">',
        f'    <input name="bsdf" type="BSDF" nodename="{name}_lobes" />',
        "  </surface>",
        f'  <surfacematerial name="{name}" type="material">',
        f'    <input name="surfaceshader" type="surfaceshader" nodename="{name}_surface" />',
        "  </surfacematerial>",
        "</materialx>",
        "",
    ]
    return Export("\n".join(lines))


class _Value(NamedTuple):
    """A value in a graph: its type, and the attribute that says where it comes from."""

    kind: str
    where: str


def _constant(kind: str, *numbers: float) -> _Value:
    return _Value(kind, f'value="{", ".join(f"{x:.7g}" for x in numbers)}"')


def _named(text: str) -> _Value:
    return _Value("string", f'value="{text}"')


class _Graph:
    """Nodes, in order."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def node(self, category: str, kind: str, **inputs: _Value) -> _Value:
        name = f"n{len(self.lines)}"
        each = "".join(f'<input name="{key}" type="{x.kind}" {x.where} />' for key, x in inputs.items())
        self.lines.append(f'    <{category} name="{name}" type="{kind}">{each}</{category}>')
        return _Value(kind, f'nodename="{name}"')

    def of(self, category: str, kind: str, a: _Value, b: _Value | float | None = None) -> _Value:
        """A node of one input or two."""
        if b is None:
            return self.node(category, kind, **{"in": a})
        return self.node(category, kind, in1=a, in2=_constant("float", b) if isinstance(b, float) else b)


def _graph(name: str, node: str, target: str, fit: Fit) -> list[str]:
    """The graph that stands for the node."""
    graph, turns = _Graph(), fit.modes > 1
    of, normal, tangent = (
        graph.of,
        _Value("vector3", 'interfacename="normal"'),
        _Value("vector3", 'interfacename="tangent"'),
    )

    # The direction of view
    away = graph.node("viewdirection", "vector3", space=_named("world"))
    view = of("multiply", "vector3", away, -1.0)
    cosine = of("max", "float", of("dotproduct", "float", view, normal), 0.0)
    across = of("crossproduct", "vector3", normal, tangent)
    frame = _Frame(graph, view, normal, tangent, across, cosine)
    modes = _modes(frame) if turns else []

    # The sum of closures
    columns, total = iter(range(fit.coefficients.shape[-1])), None
    x = of("sqrt", "float", cosine)

    def fitted(kind: str, count: int) -> _Value:
        own = [next(columns) for _ in range(count)]
        return _polynomial(graph, kind, fit.coefficients[:, :, own], x, modes)

    for closure in fit.baked.kinds:
        weight = of("max", "color3", fitted("color3", 3), 0.0)
        if closure == "diffuse":
            lobe = graph.node("oren_nayar_diffuse_bsdf", "BSDF", color=weight, normal=normal)
        else:
            roughness, axis = frame.turned(fitted("vector3", 3)) if turns else frame.in_plane(fitted("vector2", 2))
            one = _constant("color3", 1, 1, 1)
            facets = {"color0": one, "color90": one, "roughness": roughness, "normal": normal, "tangent": axis}
            lobe = of("multiply", "BSDF", graph.node("generalized_schlick_bsdf", "BSDF", **facets), weight)
        total = of("add", "BSDF", total, lobe) if total else lobe
    assert total
    head = f'  <nodegraph name="{name}" nodedef="ND_{node}"{target}>'
    return [head, *graph.lines, f'    <output name="out" type="BSDF" {total.where} />', "  </nodegraph>"]


def _modes(frame: _Frame) -> list[_Value]:
    """Cosine and sine of twice the azimuth, and of four times."""
    of = frame.graph.of
    u, v = (of("dotproduct", "float", frame.view, axis) for axis in (frame.tangent, frame.across))
    uu, vv, uv = of("multiply", "float", u, u), of("multiply", "float", v, v), of("multiply", "float", u, v)
    length = of("max", "float", of("add", "float", uu, vv), 1e-6)
    c = of("divide", "float", of("subtract", "float", uu, vv), length)
    s = of("divide", "float", of("multiply", "float", uv, 2.0), length)
    squares = of("multiply", "float", c, c), of("multiply", "float", s, s)
    return [c, s, of("subtract", "float", *squares), of("multiply", "float", of("multiply", "float", c, s), 2.0)]


def _polynomial(graph: _Graph, kind: str, coefficients: Array, x: _Value, modes: Sequence[_Value]) -> _Value:
    """Polynomials of x, of the modes that count."""
    total = None
    for mode, each in enumerate(coefficients):
        if mode and np.abs(each).sum(axis=0).max() < NEGLIGIBLE:
            continue
        found = graph.node("constant", kind, value=_constant(kind, *each[-1]))
        for numbers in each[-2::-1]:
            found = graph.of("add", kind, graph.of("multiply", kind, found, x), _constant(kind, *numbers))
        found = graph.of("multiply", kind, found, modes[mode - 1]) if mode else found
        total = graph.of("add", kind, total, found) if total else found
    assert total
    return total


class _Frame(NamedTuple):
    """The frame of the surface, and the direction of view."""

    graph: _Graph
    view: _Value
    normal: _Value
    tangent: _Value
    across: _Value
    cosine: _Value

    def in_plane(self, roughness: _Value) -> tuple[_Value, _Value]:
        """Of roughness along the plane of incidence and across it, and the axis along it, which the normal has, too."""
        of = self.graph.of
        upright = of("multiply", "vector3", self.normal, self.cosine)
        along = of("subtract", "vector3", self.view, upright)
        along = of("add", "vector3", along, of("multiply", "vector3", self.tangent, 1e-5))
        limits = {"low": _constant("float", ALPHA_MIN), "high": _constant("float", 1)}
        return self.graph.node("clamp", "vector2", **{"in": roughness}, **limits), of("normalize", "vector3", along)

    def turned(self, matrix: _Value) -> tuple[_Value, _Value]:
        """Of the entries xx, xy and yy of a matrix its eigenvalues, and the axis of the first."""
        of, parts = self.graph.of, []
        for k in range(3):
            index = _Value("integer", f'value="{k}"')
            parts.append(self.graph.node("extract", "float", **{"in": matrix, "index": index}))
        xx, xy, yy = parts
        mean = of("multiply", "float", of("add", "float", xx, yy), 0.5)
        half = of("multiply", "float", of("subtract", "float", xx, yy), 0.5)
        squares = of("multiply", "float", half, half), of("multiply", "float", xy, xy)
        radius = of("sqrt", "float", of("add", "float", *squares))
        u, v = of("add", "float", mean, radius), of("max", "float", of("subtract", "float", mean, radius), ALPHA_MIN)
        double = self.graph.node("atan2", "float", iny=xy, inx=of("add", "float", half, 1e-5))
        angle = of("multiply", "float", double, 0.5)
        along = of("multiply", "vector3", self.tangent, of("cos", "float", angle))
        beside = of("multiply", "vector3", self.across, of("sin", "float", angle))
        return self.graph.of("combine2", "vector2", u, v), of("add", "vector3", along, beside)
