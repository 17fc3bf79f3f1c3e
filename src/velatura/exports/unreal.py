"""A material for Unreal Engine 5: a script for its editor that makes a material of Substrate's slabs; beside it the
model's functions for a Custom node, with their texture.

Unreal was not run with them; the script is run with a stand-in for the editor, and the functions are compiled and run
without the engine, in the tests. The code is that of `velatura.exports.real_time`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pprint import pformat
from textwrap import indent
from typing import Any

from velatura.errors import InvalidInput, remark
from velatura.exports import baked, real_time
from velatura.exports.exr import exr
from velatura.exports.request import Export, Request, Stored, origin
from velatura.exports.shader import facts_of
from velatura.exports.unity import ABOVE, digest
from velatura.programs.substrate.slabs import Slab, slabs
from velatura.shader.material import identifier, title
from velatura.shader.printers.hlsl import Hlsl
from velatura.shader.program import PREFIX, described, prefixed

LONGEST = 64  # characters of a name of an asset
LINE = 110  # characters of values


@dataclass(frozen=True)
class UnrealHlsl(Hlsl):
    """HLSL whose functions are given the texture, since a Custom node has its inputs as arguments alone."""

    def texture(self, name: str, place: int) -> str:
        return ""


def write(request: Request) -> Export:
    """The script, the functions, and their texture.

    Raises:
        InvalidInput: a material with textures, or one that light passes.
    """
    if any(stack.transmits for _, stack in request.material.leaves()):
        raise InvalidInput(f"{request.to}: slabs are written of opaque materials; light passes this one")
    printer, prefix = UnrealHlsl(half=True), request.options.get("prefix", PREFIX)
    made = real_time.lit(request, printer)
    fit = baked.fitted(request, "openpbr")
    found = slabs(fit.values, request.material, request.model)
    script = _SCRIPT.format(
        origin=origin(),
        name=identifier(request.material)[:LONGEST],
        model=described(request.model),
        slabs=_listed(_pins(each) for each in found),
        left=_listed(fit.lost),
    )
    beside = {".ush": _functions(request, made, prefix).encode()}
    textures = []
    for name, texels in made.textures.items():
        beside[".exr"] = exr(texels)
        textures.append(Stored(name, ".exr", texels.shape[1], texels.shape[0], "RGBA16F"))
    facts = facts_of(made.shader, printer.language, request.folder)
    own = {"slabs": [each.facts for each in found], "left_out": list(fit.lost), "run": False}
    return Export(
        script, beside, notes=fit.lost, facts={**facts, "exports": [_entry(prefix)], **own}, textures=textures
    )


def _entry(prefix: str) -> str:
    return "Velatura" if prefix == PREFIX else prefix


def _functions(request: Request, made: real_time.Lit, prefix: str) -> str:
    """The text of the functions."""
    texture = made.texture
    argument = f"Texture2D<float4> {texture}"
    return prefixed(
        _HLSL.format(
            name=remark(title(request.material)),
            model=described(request.model),
            origin=origin(),
            entry=_entry(prefix),
            mark=digest(made).upper(),
            code=made.handed(made.code, argument).strip(),
            value=made.handed("vt_eval(material, vt_lobes(material, wi), wi, wo)", argument),
            asked=_ASKED if texture else "",
            texture=f"{argument}, " if texture else "",
            named="Baked, " if texture else "",
            above="" if made.two_sided else ABOVE,
        ),
        prefix,
    )


def _pins(slab: Slab) -> dict[str, Any]:
    """Inputs of a slab's node by their names in the editor, and what is connected around it, in lower case."""
    pins: dict[str, Any] = {
        "Diffuse Albedo": slab.diffuse_albedo,
        "F0": slab.f0,
        "F90": slab.f90,
        "Roughness": slab.roughness,
        "Anisotropy": slab.anisotropy,
        "Second Roughness": slab.second_roughness,
        "Second Roughness Weight": slab.second_roughness_weight,
        "turn": slab.turn,
        "coverage": slab.coverage,
    }
    if slab.transmittance is not None:
        pins |= {"transmittance": slab.transmittance, "thickness": slab.thickness_cm}
    return {name: _rounded(value) for name, value in pins.items()}


def _rounded(value: Any) -> Any:
    return tuple(map(_rounded, value)) if isinstance(value, tuple) else float(f"{value:.6g}")


def _listed(each: Iterable[Any]) -> str:
    """A list as Python's source, an entry after another."""
    entries = (indent(pformat(entry, width=LINE, sort_dicts=False), "    ") for entry in each)
    return "".join(["[\n", *(f"{entry},\n" for entry in entries), "]"])


_SCRIPT = '''\
"""A material of Substrate for Unreal Engine 5.5 and later, by the model {model}.

{origin}

NOT RUN IN UNREAL. Its slabs are those of the fit of OpenPBR to the material, by Substrate's documentation; how far
they are from the model in the engine is not known.

Run it in the editor with Tools, Execute Python Script, where the plugin Python Editor Script Plugin is on, and
Substrate in the settings of the project. It makes a material in the folder Velatura of the content, or makes the one
there anew.
"""

import math

import unreal

NAME = "M_{name}"
FOLDER = "/Game/Velatura"

# The base, then the coat. Lengths in centimetres, transmittance along the normal, turns in degrees
SLABS = {slabs}

# Of the material, what they do not hold
LEFT_OUT = {left}

editing = unreal.MaterialEditingLibrary


def make():
    path = f"{{FOLDER}}/{{NAME}}"
    if unreal.EditorAssetLibrary.does_asset_exist(path):
        material = unreal.load_asset(path)
        editing.delete_all_material_expressions(material)
    else:
        tools = unreal.AssetToolsHelpers.get_asset_tools()
        material = tools.create_asset(NAME, FOLDER, unreal.Material, unreal.MaterialFactoryNew())
    material.set_editor_property("tangent_space_normal", True)
    found = slab(material, SLABS[0])
    for top in SLABS[1:]:
        found = coated(material, top, found)
    if not editing.connect_material_property(found, "", unreal.MaterialProperty.MP_FRONT_MATERIAL):
        raise RuntimeError("the material takes no slab; is Substrate on?")
    editing.layout_material_expressions(material)
    editing.recompile_material(material)
    unreal.EditorAssetLibrary.save_loaded_asset(material)
    for each in LEFT_OUT:
        unreal.log_warning(f"{{NAME}}: not held: {{each}}")
    return material


def slab(material, values):
    node = expression(material, "SubstrateSlabBSDF")
    for name, value in values.items():
        if name[0].isupper():
            connect(constant(material, value), "", node, name)
    turn = math.radians(values["turn"])
    if turn:
        # Of surfaces, the second texture coordinate runs down
        connect(constant(material, (math.cos(turn), -math.sin(turn), 0.0)), "", node, "Tangent")
    return node


def coated(material, values, base):
    node = slab(material, values)
    if hasattr(unreal, "MaterialSubSurfaceType"):
        node.set_editor_property("sub_surface_type", unreal.MaterialSubSurfaceType.MSS_SIMPLE_VOLUME)
    path = expression(material, "SubstrateTransmittanceToMFP")
    connect(constant(material, values["transmittance"]), "", path, "Transmittance Color", "TransmittanceColor")
    connect(constant(material, values["thickness"]), "", path, "Thickness")
    connect(path, "MFP", node, "SSS MFP")
    top = node
    if values["coverage"] < 1:
        top = expression(material, "SubstrateWeight")
        connect(node, "", top, "A")
        connect(constant(material, values["coverage"]), "", top, "Weight")
    layers = expression(material, "SubstrateVerticalLayering")
    connect(top, "", layers, "Top")
    connect(base, "", layers, "Bottom", "Base")
    connect(path, "Thickness", layers, "Top Thickness", "Thickness")
    return layers


def expression(material, kind):
    return editing.create_material_expression(material, getattr(unreal, f"MaterialExpression{{kind}}"), 0, 0)


def constant(material, value):
    if isinstance(value, tuple):
        node = expression(material, "Constant3Vector")
        node.set_editor_property("constant", unreal.LinearColor(*value, 1.0))
    else:
        node = expression(material, "Constant")
        node.set_editor_property("r", value)
    return node


def connect(source, output, node, *names):
    """Connect an output to an input, whose name depends on the engine's version."""
    if not any(editing.connect_material_expressions(source, output, node, name) for name in names):
        raise RuntimeError(f"{{NAME}}: a node has no input {{' or '.join(names)}}")


if __name__ == "__main__":
    unreal.log(f"Made {{make().get_path_name()}}")
'''

_HLSL = """\
// {name}, by the model {model}; functions for a Custom node of Unreal Engine 5.
// {origin}
//
// NOT RUN IN UNREAL: compiled as HLSL, and its numbers compared with the model, without the engine.
//
// Put the file into the folder Shaders of the project. The node has /Project/ and the file's name as an include file,
// the output type Float 3, and the code
//     return {entry}({named}View, Light, Normal, Tangent, UV);
// with these inputs:
{asked}//     View     from Camera Vector
//     Light    towards the light: from Sky Atmosphere Light Direction, or a parameter
//     Normal   from Pixel Normal WS
//     Tangent  from Vertex Tangent WS
//     UV       from Texture Coordinate
// It returns f(wi, wo) |cos theta_o|: light of irradiance E on a surface that faces it leaves as E times that, which an
// unlit material has as its emissive colour. One light is met; neither its shadow nor an environment.

#ifndef VT_{mark}_INCLUDED
#define VT_{mark}_INCLUDED

{code}

float3 {entry}({texture}float3 View, float3 Light, float3 Normal, float3 Tangent, float2 UV) {{
    float3 n = normalize(Normal), t = normalize(Tangent - dot(Tangent, n) * n), b = cross(t, n); // left-handed
    float3x3 frame = float3x3(t, b, n);
    float3 wi = normalize(mul(frame, View)), wo = normalize(mul(frame, Light));{above}
    VtMaterial material = vt_material(UV);
    return {value};
}}

#endif
"""

_ASKED = """\
//     Baked    a Texture Object of the picture beside this file (.exr), imported without mips, compressed as HDR
"""
