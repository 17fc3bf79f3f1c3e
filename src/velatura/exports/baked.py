"""A material as parameters of programs that take no code: fitted, with the loss written into the file."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from velatura import __version__
from velatura.bakes import TARGETS, Bake, bake
from velatura.exports.formats import Export, Request
from velatura.stack import dumps
from velatura.targets import embedded
from velatura.targets.openpbr import TURNS
from velatura.targets.parameters import RGB, Parameter


def write(request: Request) -> Export:
    """The file of the target that has the format's name."""
    made = bake(request.stack, request.to, request.model)
    text = _PRINTERS[request.to](made, json.loads(dumps(request.stack, "json", request.folder)))
    return Export(text, notes=tuple(made.summary))


def _written(made: Bake) -> list[tuple[Parameter, float | RGB]]:
    """Parameters that differ from their defaults."""
    each = [(parameter, made.values[parameter.name]) for parameter in TARGETS[made.target].parameters]
    return [(parameter, value) for parameter, value in each if value != parameter.default]


def _comment(made: Bake) -> list[str]:
    return [f"Written by Velatura {__version__}.", *made.summary]


def _xml_comment(lines: list[str], indent: str) -> list[str]:
    """Comments of XML hold no two hyphens in a row."""
    return [f"{indent}<!--", *(f"{indent}  {line.replace('--', '- -')}" for line in lines), f"{indent}-->"]


def _text(value: float | RGB) -> str:
    return ", ".join(f"{x:g}" for x in value) if isinstance(value, tuple) else f"{value:g}"


def _openpbr(made: Bake, material: Any) -> str:
    turned = {each.name for each in TURNS}
    nodes: list[str] = []
    inputs: list[str] = []
    for parameter, value in _written(made):
        name = parameter.name
        if name not in turned:
            kind = "color3" if parameter.is_colour else "float"
            inputs.append(f'    <input name="{name}" type="{kind}" value="{_text(value)}" />')
            continue
        if not nodes:
            world = '    <input name="space" type="string" value="world" />'
            nodes += [
                f'  <{node} name="{node}_of_surface" type="vector3">\n{world}\n  </{node}>'
                for node in ("normal", "tangent")
            ]
        nodes.append(
            f'  <rotate3d name="{name}" type="vector3">\n'
            f'    <input name="in" type="vector3" nodename="tangent_of_surface" />\n'
            f'    <input name="amount" type="float" value="{_text(value)}" />\n'
            f'    <input name="axis" type="vector3" nodename="normal_of_surface" />\n'
            f"  </rotate3d>"
        )
        inputs.append(f'    <input name="{name}" type="vector3" nodename="{name}" />')
    if made.thin:
        inputs.append('    <input name="geometry_thin_walled" type="boolean" value="true" />')
    body = [
        *nodes,
        '  <open_pbr_surface name="surface" type="surfaceshader">',
        *inputs,
        "  </open_pbr_surface>",
        '  <surfacematerial name="material" type="material">',
        '    <input name="surfaceshader" type="surfaceshader" nodename="surface" />',
        "  </surfacematerial>",
        "</materialx>",
        "",
    ]
    head = ['<?xml version="1.0"?>', '<materialx version="1.39" colorspace="lin_rec709">']
    return _xml(head, made, material, body)


def _gltf(made: Bake, material: Any) -> str:
    written: dict[str, Any] = {"name": made.name or "material"}
    extensions: dict[str, dict[str, Any]] = {}
    for parameter, value in _written(made):
        core = not parameter.within.startswith("KHR_")
        part = written if core else extensions
        number = [*value, 1.0] if parameter.name == "baseColorFactor" and isinstance(value, tuple) else value
        part.setdefault(parameter.within, {})[parameter.name] = number
    if made.passed.any() and not made.thin:
        extensions["KHR_materials_volume"] = {"thicknessFactor": 1.0}
    if extensions:
        written["extensions"] = extensions
    loss = {
        "cos": list(made.cos_theta),
        "total_variation": made.total_variation.round(4).tolist(),
        "albedo": made.albedo.T.round(4).tolist(),
        "baked_albedo": made.baked_albedo.T.round(4).tolist(),
    }
    about = {"comment": _comment(made), "model": made.model, "loss": loss, **embedded.in_gltf(material, written)}
    written["extras"] = {embedded.KEY: about}
    document: dict[str, Any] = {"asset": {"version": "2.0", "generator": f"Velatura {__version__}"}}
    if extensions:
        document["extensionsUsed"] = list(extensions)
    document["materials"] = [written]
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _blender(made: Bake, material: Any) -> str:
    values = {name: (*value, 1.0) if isinstance(value, tuple) else value for name, value in made.values.items()}
    return "\n".join(
        [
            *(f"# {line}" for line in _comment(made)),
            "",
            "import bpy",
            "",
            f"material = bpy.data.materials.new({made.name or 'material'!r})",
            "material.use_nodes = True",
            'node = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")',
            "inputs = {",
            *(f"    {name!r}: {value!r}," for name, value in values.items()),
            "}",
            "for name, value in inputs.items():",
            "    node.inputs[name].default_value = value",
            "",
        ]
    )


def _mitsuba(made: Bake, material: Any) -> str:
    values = [
        f'        <{"rgb" if isinstance(value, tuple) else "float"} name="{parameter.name}" value="{_text(value)}"/>'
        for parameter, value in _written(made)
    ]
    body = ['    <bsdf type="principled" id="material">', *values, "    </bsdf>", "</scene>", ""]
    return _xml(['<scene version="3.0.0">'], made, material, body)


def _xml(head: list[str], made: Bake, material: Any, body: list[str]) -> str:
    """A document with the loss in a comment, and the stack in another."""
    above = "\n".join([*head, *_xml_comment(_comment(made), "  ")])
    return f"{above}\n  {embedded.in_xml(material, chr(10).join(body))}"


_PRINTERS: dict[str, Callable[[Bake, Any], str]] = {
    "openpbr": _openpbr,
    "gltf": _gltf,
    "blender-principled": _blender,
    "mitsuba-principled": _mitsuba,
}
