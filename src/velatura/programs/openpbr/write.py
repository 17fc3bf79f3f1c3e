"""A document of MaterialX with one surface of OpenPBR."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from velatura.programs import embedded, xml
from velatura.programs.openpbr import formulas
from velatura.programs.openpbr.parameters import PARAMETERS, TURNS
from velatura.programs.program import Bake, Carried, Fitted, Program, own_maps, rgb, roughness
from velatura.programs.surface import Surface


def start(surface: Surface) -> Fitted:
    """Parameters of a surface."""
    base, coat, coated = np.asarray(surface.alpha, float), np.asarray(surface.coat.alpha, float), surface.coated
    # The coat roughens the base again
    mean = np.sqrt(max(np.sqrt(base[0] * base[1]) ** 2 - 2 * coat[0] * coat[1] * coated, 1e-6))

    def split(u: float, v: float) -> float:
        return float(1 - v / u) if u > 0 else 0.0

    def rough(u: float, v: float) -> float:
        """The roughness whose alphas, by `formulas.alphas`, are these."""
        return roughness(np.sqrt(0.5 * (u**2 + v**2)))

    anisotropy = split(*base)
    u = mean / np.sqrt(1 - min(anisotropy, 0.99))
    values: Fitted = {
        "base_color": rgb(surface.colour),
        "base_metalness": surface.metalness,
        "specular_roughness": rough(u, mean**2 / u if u else 0.0),
        "specular_roughness_anisotropy": anisotropy,
        "geometry_tangent": surface.rotation,
        "specular_ior": surface.eta * surface.coat.eta,  # in air
        "transmission_weight": surface.clear,
        "transmission_color": rgb(surface.tint),
    }
    if coated:
        values |= {
            "coat_weight": surface.coat.share,
            "coat_ior": surface.coat.eta,
            "coat_roughness": rough(*coat),
            "coat_roughness_anisotropy": split(*coat),
            "geometry_coat_tangent": surface.coat.rotation,
            "coat_color": rgb(surface.coat.colour),
        }
    if surface.film:
        n, nm = surface.film
        values |= {"thin_film_weight": 1.0, "thin_film_ior": n, "thin_film_thickness": nm / 1000}  # type: ignore[operator]
    return values


def text(made: Bake, material: Any, files: dict[str, str]) -> str:
    """The document, with the loss in a comment and the stack in another."""
    nodes = [node for name, image in made.images.items() for node in _image(name, image, files[name])]
    inputs = [_input(name, _kind(image.factor), node=name) for name, image in made.images.items()]
    plain = [(each.name, value) for each, value in made.differing(PARAMETERS) if each.name not in made.images]
    inputs += [_input(name, _kind(value), xml.numbers(value)) for name, value in plain]
    turns = [(each.name, value) for each, value in made.differing(TURNS)]
    inputs += [_input(name, "vector3", node=name) for name, _ in turns]
    if turns:
        world = _input("space", "string", "world")
        nodes += [_node(each, f"{each}_of_surface", "vector3", world) for each in ("normal", "tangent")]
    nodes += [
        _node(
            "rotate3d",
            name,
            "vector3",
            _input("in", "vector3", node="tangent_of_surface"),
            _input("amount", "float", xml.numbers(value)),
            _input("axis", "vector3", node="normal_of_surface"),
        )
        for name, value in turns
    ]
    if made.thin:
        inputs.append(_input("geometry_thin_walled", "boolean", "true"))
    body = [
        *nodes,
        _node("open_pbr_surface", "surface", "surfaceshader", *inputs),
        _node("surfacematerial", "material", "material", _input("surfaceshader", "surfaceshader", node="surface")),
        "</materialx>",
        "",
    ]
    head = ['<?xml version="1.0"?>', '<materialx version="1.39" colorspace="lin_rec709">']
    return embedded.document(head, made.comment, material, body)


def _image(name: str, image: Carried, file: str) -> Iterator[str]:
    """Nodes that read an image, take a channel, or its root, where it is none of colours, and scale it."""
    space = "srgb_texture" if image.texture.encoding == "srgb" else ""
    kind, read = _kind(image.factor), "color3" if image.channel < 3 else "color4"
    source = f"{name}_image"
    yield _node("image", source, read, _input("file", "filename", file, space=space))
    if kind == "float":
        index = _input("index", "integer", str(image.channel))
        yield _node("extract", f"{name}_channel", "float", _input("in", read, node=source), index)
        source = f"{name}_channel"
        if image.root:
            yield _node("sqrt", f"{name}_root", "float", _input("in", "float", node=source))
            source = f"{name}_root"
    factor = _input("in2", kind, xml.numbers(image.factor))
    yield _node("multiply", name, kind, _input("in1", kind, node=source), factor)


def _kind(value: object) -> str:
    return "color3" if isinstance(value, tuple) else "float"


def _input(name: str, kind: str, value: str = "", node: str = "", space: str = "") -> str:
    given = f"nodename={quoteattr(node)}" if node else f"value={quoteattr(value)}"
    return f'<input name="{name}" type="{kind}" {given}{f" colorspace={quoteattr(space)}" if space else ""} />'


def _node(node: str, name: str, kind: str, *inputs: str) -> str:
    return "\n".join([f'  <{node} name="{name}" type="{kind}">', *(f"    {each}" for each in inputs), f"  </{node}>"])


PROGRAM = Program(
    "OpenPBR",
    (*PARAMETERS, *TURNS),
    formulas.value,
    start,
    text,
    coat_eta=True,
    coat_brushed=True,
    coat_colour=True,
    turned=True,
    pane=True,
    colour="base_color",
    roughness="specular_roughness",
    maps=own_maps(PARAMETERS),
)
