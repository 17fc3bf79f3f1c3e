"""Parameters of UsdPreviewSurface for surfaces, and the text of shaders in USD."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, TypeAlias

from velatura.optics import fresnel
from velatura.programs import embedded
from velatura.programs.program import Bake, Fitted, Program, mean_alpha, own_maps, product, rgb, roughness
from velatura.programs.surface import Surface
from velatura.programs.usd import formulas
from velatura.programs.usd.parameters import PARAMETERS


def start(surface: Surface) -> Fitted:
    """Parameters of a surface, whose coat's colour goes into the base, and whose index is the coat's as well."""
    coat = surface.coat
    shown = product(surface.colour, coat.colour)
    values: Fitted = {
        "diffuseColor": rgb(surface.tint) if surface.clear else shown,
        "metallic": surface.metalness,
        "roughness": roughness(mean_alpha(surface.alpha)),
        "ior": surface.eta,
        "opacity": 1 - surface.clear,
    }
    if surface.coated:
        values |= {"clearcoat": coat.share, "clearcoatRoughness": roughness(mean_alpha(coat.alpha))}
        if surface.metalness == 1:
            values["ior"] = coat.eta
        else:  # the coat has the index of the base
            most = fresnel.normal_incidence(max(surface.eta, 1.001))
            values["clearcoat"] = min(coat.share * fresnel.normal_incidence(coat.eta) / most, 1.0)
    return values


# Text ----------------------------------------------------------------------------------------------------------------


#: A value as text, or the name of a shader and of its output; without the former, that of an input of its graph.
Given: TypeAlias = "str | tuple[str, str]"
Ports: TypeAlias = "dict[str, tuple[str, Given]]"  #: types and values of inputs or outputs, by name

ROOT = "/material"
SURFACES = "surface"  # the set of variants
CHOSEN = "openpbr"  # that variant of it which renderers take if none is named, and from which a stack is read


@dataclass(frozen=True)
class Shader:
    """A shader of a network: its name, what it is, and its inputs and outputs with their types, by name."""

    name: str
    identifier: str
    inputs: Ports
    outputs: dict[str, str]

    def lines(self, root: str) -> list[str]:
        """Its text, below a path."""
        outputs = [f"{kind} outputs:{name}" for name, kind in self.outputs.items()]
        body = [f"uniform token info:id = {quoted(self.identifier)}", *_ports("inputs", self.inputs, root), *outputs]
        return _block([f"def Shader {quoted(self.name)}", "{"], body)


@dataclass(frozen=True)
class Graph:
    """Shaders that are one node of a network: its name, its inputs and outputs, and what lies in it."""

    name: str
    inputs: Ports
    outputs: Ports
    shaders: Sequence[Shader]

    def lines(self, root: str) -> list[str]:
        """Its text, below a path."""
        inside = f"{root}/{self.name}"
        ports = [*_ports("inputs", self.inputs, root), *_ports("outputs", self.outputs, inside)]
        return _block([f"def NodeGraph {quoted(self.name)}", "{"], [*ports, "", *_all(self.shaders, inside)])


def _ports(side: str, ports: Ports, root: str) -> Iterator[str]:
    """Lines of inputs or outputs, which are connected to shaders below a path, or to its own inputs."""
    for name, (kind, value) in ports.items():
        if isinstance(value, str):
            yield f"{kind} {side}:{name} = {value}"
        else:
            shader, port = value
            source = f"{root}/{shader}.outputs:{port}" if shader else f"{root}.inputs:{port}"
            yield f"{kind} {side}:{name}.connect = <{source}>"


def _all(shaders: Iterable[Shader | Graph], root: str) -> Iterator[str]:
    return (line for each in shaders for line in each.lines(root))


def _block(head: Sequence[str], body: Iterable[str]) -> list[str]:
    """Lines in the brace that a head ends with, and an empty one."""
    return [*head, *(f"    {line}" if line else "" for line in body), "}", ""]


def quoted(text: str) -> str:
    """A text as a string of USD, which has no control characters."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def asset(path: str) -> str:
    """A path as an asset of USD, relative to the layer unless it is absolute."""
    path = path if Path(path).is_absolute() or path.startswith(".") else f"./{path}"
    return "@@@" + path.replace("@@@", "\\@@@") + "@@@"


def number(value: float | tuple[float, ...]) -> str:
    """A number or a colour as text."""
    return f"({', '.join(f'{x:g}' for x in value)})" if isinstance(value, tuple) else f"{value:g}"


def preview(made: Bake, files: dict[str, str]) -> list[Shader]:
    """The shaders of UsdPreviewSurface, the surface first."""
    inputs: Ports = {
        each.name: ("color3f" if each.is_colour else "float", number(value))
        for each, value in made.differing(PARAMETERS)
    }
    others = []
    for name, image in made.images.items():
        space = "sRGB" if image.texture.encoding == "srgb" else "raw"
        if isinstance(image.factor, tuple):
            scale, output, kind = (*image.factor, 1.0), "rgb", "color3f"
        else:
            scale, output, kind = (image.factor,) * 4, "rgba"[image.channel], "float"
        read: Ports = {
            "file": ("asset", asset(files[name])),
            "sourceColorSpace": ("token", quoted(space)),
            "wrapS": ("token", '"repeat"'),
            "wrapT": ("token", '"repeat"'),
            "scale": ("float4", number(scale)),
            "st": ("float2", ("coordinates", "result")),
        }
        inputs[name] = (kind, (f"{name}_preview", output))
        others.append(
            Shader(f"{name}_preview", "UsdUVTexture", read, {output: "float3" if output == "rgb" else "float"})
        )
    if others:
        found: Ports = {"varname": ("string", quoted("st"))}
        others.append(Shader("coordinates", "UsdPrimvarReader_float2", found, {"result": "float2"}))
    return [Shader("preview", "UsdPreviewSurface", inputs, {"surface": "token"}), *others]


def document(
    name: str,
    remarks: Sequence[str],
    material: Any,
    shaders: Sequence[Shader],
    outputs: Sequence[str],
    variants: Mapping[str, Sequence[Shader | Graph]] | None = None,
) -> str:
    """A layer with one material, which holds the stack; `variants` have further shaders, those of `CHOSEN` by
    default."""
    variants = variants or {}
    known = [each for each in (*variants.get(CHOSEN, ()), *shaders) if isinstance(each, Shader)]
    held = json.dumps({"digest": digest(known), "material": material}, ensure_ascii=False)
    body = [
        'uniform string config:mtlx:version = "1.39"',
        *(f"token outputs:{each}" for each in outputs),
        "",
        *_all(shaders, ROOT),
    ]
    chosen: list[str] = []
    if variants:
        chosen = [
            "    variants = {",
            f"        string {SURFACES} = {quoted(CHOSEN)}",
            "    }",
            f"    prepend variantSets = {quoted(SURFACES)}",
        ]
        each = (_block([f"{quoted(name)} {{"], _all(own, ROOT)) for name, own in variants.items())
        body += _block([f"variantSet {quoted(SURFACES)} = {{"], chain.from_iterable(each))
    return "\n".join(
        [
            "#usda 1.0",
            "(",
            '    defaultPrim = "material"',
            "    metersPerUnit = 1",
            '    upAxis = "Y"',
            ")",
            "",
            *(f"# {line}" for line in remarks),
            "",
            'def Material "material" (',
            '    prepend apiSchemas = ["MaterialXConfigAPI"]',
            f"    displayName = {quoted(name or 'material')}",
            "    customData = {",
            f"        string {embedded.KEY} = {quoted(held)}",
            "    }",
            *chosen,
            ")",
            *_block(["{"], body),
        ]
    )


def digest(shaders: Sequence[Shader]) -> str:
    """A short text that is another one for other values or connections of a network, in any order."""
    given = (f"{each.name}.{name} {value}" for each in shaders for name, (_, value) in each.inputs.items())
    return embedded.digest("\n".join(sorted(given)))


def text(made: Bake, material: Any, files: dict[str, str]) -> str:
    """A layer with this surface alone."""
    connected = f"surface.connect = <{ROOT}/preview.outputs:surface>"
    return document(made.name, made.comment, material, preview(made, files), [connected])


PROGRAM = Program(
    "UsdPreviewSurface",
    PARAMETERS,
    formulas.value,
    start,
    text,
    pane=True,
    colour="diffuseColor",
    images=(".png", ".jpg", ".jpeg"),
    maps=own_maps(PARAMETERS, without=("ior",)),
)
