"""A material as a node of MaterialX, with a graph of standard nodes in its place, and a material that uses it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from velatura.exports.request import Export, Request, origin, relative, stated
from velatura.model import Model
from velatura.programs import xml
from velatura.shader import closures, mixture
from velatura.shader.closures import Loss
from velatura.shader.material import constant as as_constant
from velatura.shader.material import identifier, place, title
from velatura.shader.printers import mtlx
from velatura.shader.printers.nodes import Node, NodeGraph, constant
from velatura.shader.program import described
from velatura.shader.recorder import recording
from velatura.stack import Address, Described, Stack, Varying
from velatura.stack.flat_names import prefix

LINE = 110  # characters of comments


def write(request: Request) -> Export:
    """The document of a material, with its loss.

    Raises:
        InvalidInput: as `document`.
    """
    made = document(request)
    return Export(made.text, facts={"loss": stated(made.losses)})


@dataclass(frozen=True)
class Document:
    """A document of MaterialX, the remarks on its lobes and on their loss, and that loss."""

    text: str
    remarks: Sequence[str]
    losses: Sequence[Loss]


def document(request: Request) -> Document:
    """The node of each stack, its graphs, and a material that uses it, or mixes those of several.

    Raises:
        InvalidInput: as `velatura.shader.printers.mtlx.record`; a texture has a curve.
    """
    material, name = request.material, identifier(request.material)
    mtlx.check(material.values())
    parts = [_Part.of(path, stack, request) for path, stack in material.leaves()]
    nodes, halves = NodeGraph("value"), closures.shares(material)
    numbers = [(share, closures.numbers(part.stack)) for share, part in zip(halves, parts)]
    known = closures.side_by_side(halves, [part.recorded.known for part in parts])
    losses = list(closures.losses(numbers, request.model, known))

    # Use the nodes of the stacks
    file = partial(relative, folder=request.folder)
    lobes = [part.used(nodes, file) for part in parts]
    weights = dict(mixture.weights(material))
    masks = {f"m.{place(at)}": node for at, node in mtlx.varying(nodes, weights.items(), file).items()}
    constant = [at.name for at, x in weights.items() if not isinstance(x, Varying)]
    bsdf = mtlx.mixed(nodes, lobes, mixture.shares(material, constant), masks)
    by = " and ".join(dict.fromkeys(described(part.model) for part in parts))
    about = f"{title(material)}, by the model {by}; MaterialX."
    remarks = [*wrap(_about(material), LINE), *(f"  {loss}" for loss in losses)]
    lines = [
        '<?xml version="1.0"?>',
        '<materialx version="1.39" colorspace="lin_rec709">',
        *xml.comment([about, origin(), *remarks]),
        *(line for part in parts for line in part.defined(about)),
        *(line.removeprefix("  ") for line in nodes.lines),
        f'  <surface name="{name}_surface" type="surfaceshader">',
        f'    <input name="bsdf" type="BSDF" {bsdf.where} />',
        "  </surface>",
        f'  <surfacematerial name="{name}" type="material">',
        f'    <input name="surfaceshader" type="surfaceshader" nodename="{name}_surface" />',
        "  </surfacematerial>",
        "</materialx>",
        "",
    ]
    return Document("\n".join(lines), remarks, losses)


@dataclass(frozen=True)
class _Part:
    """A stack, recorded, and the name that its nodes have."""

    stack: Stack
    model: Model
    recorded: mtlx.Recorded
    name: str

    @classmethod
    def of(cls, path: tuple[int, ...], stack: Stack, request: Request) -> _Part:
        model, name = recording.drawn_by(stack, request.model), f"{identifier(request.material)}_{prefix(path)}"
        return cls(stack, model, mtlx.record(stack, model), name.removesuffix("_"))

    @property
    def values(self) -> list[tuple[Address, Any]]:
        """The values that its lobes are worked out from."""
        return mtlx.values(self.stack, [*self.recorded.plain, *self.recorded.conserving])

    def defined(self, about: str) -> list[str]:
        """The definition of its node, and its graphs."""
        node, stack = self._node, self.stack
        return [
            f'  <nodedef name="ND_{node}" node="{node}" nodegroup="pbr" doc={quoteattr(about)}>',
            *(_input(stack, *each) for each in self.values),
            '    <input name="normal" type="vector3" defaultgeomprop="Nworld" />',
            '    <input name="tangent" type="vector3" defaultgeomprop="Tworld" />',
            '    <output name="out" type="BSDF" />',
            "  </nodedef>",
            *mtlx.graph(f"NG_{node}", node, "", stack, self.recorded.conserving),
            *mtlx.graph(f"NG_{node}_genosl", node, ' target="genosl"', stack, self.recorded.plain),
        ]

    def used(self, nodes: NodeGraph, file: Callable[[Path], str]) -> Node:
        """Its node, with its values that vary."""
        varying = mtlx.varying(nodes, self.values, file)
        return nodes.node(self._node, "BSDF", f"{self.name}_lobes", **{at.name: node for at, node in varying.items()})

    @property
    def _node(self) -> str:
        return f"velatura_lobes_{self.name}"


def _about(material: Described) -> str:
    varying = not all(recording.is_uniform(stack) for _, stack in material.leaves())
    over = "computed from the values of layers, which are inputs" if varying else "polynomials of the direction of view"
    return (
        f"Weights and roughnesses of its lobes are {over}. All targets but genosl are taken to return the light that"
        " facets block."
        f"{' It looks alike from both sides.' * any(stack.transmits for _, stack in material.leaves())}"
        f" Difference of its closures from the model{', where textures are half bright' * varying}, in light from"
        " above, as total variation and as the greatest difference of albedo:"
    )


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
