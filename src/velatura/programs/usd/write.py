"""Parameters of UsdPreviewSurface for surfaces, and the text of shaders in USD."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from velatura.optics import fresnel
from velatura.programs import embedded
from velatura.programs.program import Bake, Fitted, Program, mean_alpha, product, rgb, roughness
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


#: A value as text, or the name of a shader and of its output.
Given: TypeAlias = "str | tuple[str, str]"

ROOT = "/material"


@dataclass(frozen=True)
class Shader:
    """A shader of a network: its name, what it is, and its inputs and outputs with their types, by name."""

    name: str
    identifier: str
    inputs: dict[str, tuple[str, Given]]
    outputs: dict[str, str]

    @property
    def lines(self) -> list[str]:
        """Its text, indented within a material."""
        inputs = [
            f"{kind} inputs:{name} = {value}"
            if isinstance(value, str)
            else f"{kind} inputs:{name}.connect = <{ROOT}/{value[0]}.outputs:{value[1]}>"
            for name, (kind, value) in self.inputs.items()
        ]
        outputs = [f"{kind} outputs:{name}" for name, kind in self.outputs.items()]
        body = [f"uniform token info:id = {quoted(self.identifier)}", *inputs, *outputs]
        return [f"    def Shader {quoted(self.name)}", "    {", *(f"        {each}" for each in body), "    }", ""]


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
    inputs: dict[str, tuple[str, Given]] = {
        each.name: ("color3f" if each.is_colour else "float", number(value))
        for each, value in made.differing(PARAMETERS)
    }
    others = []
    for name, image in made.images.items():  # of the base's colour alone
        space = "sRGB" if image.texture.encoding == "srgb" else "raw"
        scale = number((*rgb(image.factor), 1.0))
        read: dict[str, tuple[str, Given]] = {
            "file": ("asset", asset(files[name])),
            "sourceColorSpace": ("token", quoted(space)),
            "wrapS": ("token", '"repeat"'),
            "wrapT": ("token", '"repeat"'),
            "scale": ("float4", scale),
            "st": ("float2", ("coordinates", "result")),
        }
        inputs[name] = ("color3f", ("image", "rgb"))
        others = [
            Shader("image", "UsdUVTexture", read, {"rgb": "float3"}),
            Shader("coordinates", "UsdPrimvarReader_float2", {"varname": ("string", '"st"')}, {"result": "float2"}),
        ]
    return [Shader("preview", "UsdPreviewSurface", inputs, {"surface": "token"}), *others]


def document(
    name: str, remarks: Sequence[str], material: Any, shaders: Sequence[Shader], outputs: Sequence[str]
) -> str:
    """A layer with one material, which holds the stack."""
    held = json.dumps({"digest": digest(shaders), "material": material}, ensure_ascii=False)
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
            ")",
            "{",
            '    uniform string config:mtlx:version = "1.39"',
            *(f"    token outputs:{each}" for each in outputs),
            "",
            *(line for each in shaders for line in each.lines),
            "}",
            "",
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
)
