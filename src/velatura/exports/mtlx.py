"""A material as a node of MaterialX, with a graph of standard nodes in its place, and a material that uses it."""

from __future__ import annotations

from textwrap import wrap
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from velatura.exports.request import Export, Request, origin, relative
from velatura.programs import xml
from velatura.shader import closures
from velatura.shader.material import constant as as_constant
from velatura.shader.material import identifier, title
from velatura.shader.printers import mtlx
from velatura.shader.printers.nodes import constant
from velatura.shader.program import described
from velatura.shader.recorder import recording
from velatura.stack import Address, Stack, Varying, single

LINE = 110  # characters of comments


def write(request: Request) -> Export:
    """The node, its graphs, and a material that uses it.

    Raises:
        InvalidInput: as `velatura.shader.printers.mtlx.record`.
    """
    stack = single(request.material, "mtlx")
    recorded = mtlx.record(stack, recording.drawn_by(stack, request.model))
    name = identifier(stack)
    node = f"velatura_lobes_{name}"
    values = mtlx.values(stack, [*recorded.plain, *recorded.conserving])
    made, connected = mtlx.varying(values, lambda path: relative(path, request.folder))
    losses = closures.losses(closures.numbers(stack), request.model, recorded.known)
    about = _about(request)
    lines = [
        '<?xml version="1.0"?>',
        '<materialx version="1.39" colorspace="lin_rec709">',
        *xml.comment([*about, *(f"  {loss}" for loss in losses)]),
        f'  <nodedef name="ND_{node}" node="{node}" nodegroup="pbr" doc={quoteattr(about[0])}>',
        *(_input(stack, *each) for each in values),
        '    <input name="normal" type="vector3" defaultgeomprop="Nworld" />',
        '    <input name="tangent" type="vector3" defaultgeomprop="Tworld" />',
        '    <output name="out" type="BSDF" />',
        "  </nodedef>",
        *mtlx.graph(f"NG_{node}", node, "", stack, recorded.conserving),
        *mtlx.graph(f"NG_{node}_genosl", node, ' target="genosl"', stack, recorded.plain),
        *made,
        f'  <{node} name="{name}_lobes" type="BSDF">',
        *connected,
        f"  </{node}>",
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


def _about(request: Request) -> list[str]:
    stack, varying = request.material, not recording.is_uniform(request.material)
    over = "computed from the values of layers, which are inputs" if varying else "polynomials of the direction of view"
    text = (
        f"Weights and roughnesses of its lobes are {over}. All targets but genosl are taken to return the light that"
        " facets block."
        f"{' It looks alike from both sides.' * stack.transmits}"
        f" Difference of its closures from the model{', where textures are half bright' * varying}, in light from"
        " above, as total variation and as the greatest difference of albedo:"
    )
    name = f"{title(stack)}, by the model {described(recording.drawn_by(stack, request.model))}; MaterialX."
    return [name, origin(), *wrap(text, LINE)]


def _input(stack: Stack, at: Address, value: Any) -> str:
    """The declaration of a value."""
    kind, name = "color3" if at.colour else "float", at.key if at.layer is None else f"Layer {at.layer}: {at.key}"
    described = quoteattr(at.declared.doc)
    default = 0.5 if isinstance(value, Varying) else as_constant(at, value)
    channels = np.broadcast_to(default, 3 if at.colour else 1)
    return (
        f'    <input name="{at.name}" type="{kind}" {constant(kind, *channels).where}'
        f' uiname="{name}" doc={described} />'
    )
