"""A material as parameters of programs that take no code: fitted, with the loss written into the file."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any
from urllib.parse import quote
from xml.sax.saxutils import quoteattr

from velatura.bakes import TARGETS, Bake, Carried, bake
from velatura.exports.request import Export, Request, relative, xml_comment
from velatura.shader.material import remark
from velatura.stack import dumps
from velatura.targets import embedded
from velatura.targets.openpbr import TURNS
from velatura.targets.parameters import RGB, Parameter
from velatura.version import __version__


def write(request: Request) -> Export:
    """The file of the target that has the format's name."""
    made = bake(request.stack, request.to, request.model)
    # Blender finds no files beside a script
    folder = None if request.to == "blender-principled" else request.folder
    files = {name: relative(image.texture.texture, folder) for name, image in made.images.items()}
    text = _PRINTERS[request.to](made, json.loads(dumps(request.stack, "json", request.folder)), files)
    return Export(text, notes=tuple(made.summary))


def _written(made: Bake) -> list[tuple[Parameter, float | RGB]]:
    """Parameters that differ from their defaults."""
    each = [(parameter, made.values[parameter.name]) for parameter in TARGETS[made.target].parameters]
    return [(parameter, value) for parameter, value in each if value != parameter.default]


def _comment(made: Bake) -> list[str]:
    return [f"Written by Velatura {__version__}.", *made.summary]


def _text(value: float | RGB) -> str:
    return ", ".join(f"{x:g}" for x in value) if isinstance(value, tuple) else f"{value:g}"


def _openpbr(made: Bake, material: Any, files: dict[str, str]) -> str:
    turned = {each.name for each in TURNS}
    nodes: list[str] = []
    inputs: list[str] = []
    for name, image in made.images.items():
        kind = "color3" if isinstance(image.factor, tuple) else "float"
        nodes += _image(name, image, files[name], kind)
        inputs.append(f'    <input name="{name}" type="{kind}" nodename="{name}" />')
    turning = False
    for parameter, value in _written(made):
        name = parameter.name
        if name in made.images:
            continue
        if name not in turned:
            kind = "color3" if parameter.is_colour else "float"
            inputs.append(f'    <input name="{name}" type="{kind}" value="{_text(value)}" />')
            continue
        if not turning:
            turning = True
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


def _image(name: str, image: Carried, file: str, kind: str) -> list[str]:
    """Nodes of MaterialX that read an image, take the root of a channel where it is none of colours, and scale it."""
    space = ' colorspace="srgb_texture"' if image.texture.encoding == "srgb" else ""
    read = "color3" if image.channel < 3 else "color4"
    source = f"{name}_image"
    nodes = [_node("image", source, read, f'<input name="file" type="filename" value={quoteattr(file)}{space} />')]
    if kind == "float":
        nodes += [
            _node(
                "extract",
                f"{name}_channel",
                "float",
                f'<input name="in" type="{read}" nodename="{source}" />',
                f'<input name="index" type="integer" value="{image.channel}" />',
            ),
            _node("sqrt", f"{name}_root", "float", f'<input name="in" type="float" nodename="{name}_channel" />'),
        ]
        source = f"{name}_root"
    factor = f'<input name="in2" type="{kind}" value="{_text(image.factor)}" />'
    return [*nodes, _node("multiply", name, kind, f'<input name="in1" type="{kind}" nodename="{source}" />', factor)]


def _node(node: str, name: str, kind: str, *inputs: str) -> str:
    return "\n".join([f'  <{node} name="{name}" type="{kind}">', *(f"    {each}" for each in inputs), f"  </{node}>"])


def _gltf(made: Bake, material: Any, files: dict[str, str]) -> str:
    written: dict[str, Any] = {"name": made.name or "material"}
    extensions: dict[str, dict[str, Any]] = {}
    for parameter, value in _written(made):
        core = not parameter.within.startswith("KHR_")
        part = written if core else extensions
        number = [*value, 1.0] if parameter.name == "baseColorFactor" and isinstance(value, tuple) else value
        part.setdefault(parameter.within, {})[parameter.name] = number
    for name, image in made.images.items():  # of the base's colour alone
        core = written.setdefault("pbrMetallicRoughness", {})
        core |= {name: [*_three(image.factor), 1.0], "baseColorTexture": {"index": 0}}
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
    if files:
        document["images"] = [{"uri": quote(file)} for file in files.values()]
        document["textures"] = [{"source": 0}]
    document["materials"] = [written]
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _blender(made: Bake, material: Any, files: dict[str, str]) -> str:
    values = {name: (*value, 1.0) if isinstance(value, tuple) else value for name, value in made.values.items()}
    return "\n".join(
        [
            *(f"# {remark(line)}" for line in _comment(made)),
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
            *(_BLENDER_TANGENT if made.values["Anisotropic"] else []),
            *(_BLENDER_IMAGE if made.images else []),
            *(
                f"multiplied({name!r}, {files[name]!r}, {_space(image)!r}, {_factor(image)})"
                for name, image in made.images.items()
            ),
            "",
        ]
    )


# Without one the tangent runs around the middle of the object
_BLENDER_TANGENT = """\
tangent = material.node_tree.nodes.new("ShaderNodeTangent")
tangent.direction_type = "UV_MAP"
material.node_tree.links.new(tangent.outputs["Tangent"], node.inputs["Tangent"])
""".splitlines()

_BLENDER_IMAGE = """

def multiplied(name, path, space, factor, channel=None):
    nodes, links = material.node_tree.nodes, material.node_tree.links
    image = nodes.new("ShaderNodeTexImage")
    image.image = bpy.data.images.load(path)
    image.image.colorspace_settings.name = space
    product, source = nodes.new("ShaderNodeVectorMath"), image.outputs["Color"]
    if channel is not None:  # roughness is the root of the image's channel
        parts, root = nodes.new("ShaderNodeSeparateColor"), nodes.new("ShaderNodeMath")
        root.operation = "SQRT"
        links.new(source, parts.inputs[0])
        links.new(image.outputs["Alpha"] if channel == 3 else parts.outputs[channel], root.inputs[0])
        source = root.outputs[0]
    product.operation = "MULTIPLY"
    product.inputs[1].default_value = factor
    links.new(source, product.inputs[0])
    links.new(product.outputs["Vector"], node.inputs[name])

""".splitlines()


def _three(factor: float | RGB) -> RGB:
    return factor if isinstance(factor, tuple) else (factor, factor, factor)


def _space(image: Carried) -> str:
    return "sRGB" if image.texture.encoding == "srgb" else "Non-Color"


def _factor(image: Carried) -> str:
    """The last arguments of `multiplied`."""
    if isinstance(image.factor, tuple):
        return repr(image.factor)
    return f"{_three(image.factor)!r}, {image.channel}"


def _mitsuba(made: Bake, material: Any, files: dict[str, str]) -> str:
    values = [
        f'        <{"rgb" if isinstance(value, tuple) else "float"} name="{parameter.name}" value="{_text(value)}"/>'
        for parameter, value in _written(made)
    ]
    body = ['    <bsdf type="principled" id="material">', *values, "    </bsdf>", "</scene>", ""]
    return _xml(['<scene version="3.0.0">'], made, material, body)


def _xml(head: list[str], made: Bake, material: Any, body: list[str]) -> str:
    """A document with the loss in a comment, and the stack in another."""
    above = "\n".join([*head, *xml_comment(_comment(made))])
    return f"{above}\n  {embedded.in_xml(material, chr(10).join(body))}"


_PRINTERS: dict[str, Callable[[Bake, Any, dict[str, str]], str]] = {
    "openpbr": _openpbr,
    "gltf": _gltf,
    "blender-principled": _blender,
    "mitsuba-principled": _mitsuba,
}
