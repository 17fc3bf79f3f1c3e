"""A script that makes a material of Blender's Principled BSDF."""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura.errors import remark
from velatura.programs.blender import formulas
from velatura.programs.blender.parameters import PARAMETERS
from velatura.programs.program import Bake, Carried, Fitted, Program, burley, mean_alpha, own_maps, product, rgb
from velatura.programs.program import roughness as rough
from velatura.programs.surface import Surface


def start(surface: Surface) -> Fitted:
    """Parameters of a surface."""
    values: Fitted = {
        "Base Color": product(surface.tint, surface.tint) if surface.clear else rgb(surface.colour),
        "Metallic": surface.metalness,
        **burley(surface.alpha, "Roughness", "Anisotropic"),
        "Anisotropic Rotation": float(np.radians(surface.rotation) / (2 * np.pi) % 1),
        "IOR": surface.eta,
        "Transmission Weight": surface.clear,
    }
    if surface.coated:
        values |= {
            "Coat Weight": surface.coat.share,
            "Coat Roughness": rough(mean_alpha(surface.coat.alpha)),
            "Coat IOR": surface.coat.eta,
            "Coat Tint": rgb(surface.coat.colour),
        }
    if surface.film:
        n, nm = surface.film
        values |= {"Thin Film IOR": n, "Thin Film Thickness": float(nm)}  # type: ignore[arg-type]
    return values


def text(made: Bake, material: Any, files: dict[str, str]) -> str:
    """A script for Blender, which finds no files beside it."""
    values = {name: (*value, 1.0) if isinstance(value, tuple) else value for name, value in made.values.items()}
    return "\n".join(
        [
            *(f"# {remark(line)}" for line in made.comment),
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
            *(_TANGENT if made.values["Anisotropic"] else []),
            *(_IMAGE if made.images else []),
            *(f"multiplied({name!r}, {files[name]!r}, {_read(image)})" for name, image in made.images.items()),
            "",
        ]
    )


# Without one the tangent runs around the middle of the object
_TANGENT = """\
tangent = material.node_tree.nodes.new("ShaderNodeTangent")
tangent.direction_type = "UV_MAP"
material.node_tree.links.new(tangent.outputs["Tangent"], node.inputs["Tangent"])
""".splitlines()

_IMAGE = """

def multiplied(name, path, space, factor, channel=None, root=False):
    nodes, links = material.node_tree.nodes, material.node_tree.links
    image = nodes.new("ShaderNodeTexImage")
    image.image = bpy.data.images.load(path)
    image.image.colorspace_settings.name = space
    product, source = nodes.new("ShaderNodeVectorMath"), image.outputs["Color"]
    if channel is not None:
        parts = nodes.new("ShaderNodeSeparateColor")
        links.new(source, parts.inputs[0])
        source = image.outputs["Alpha"] if channel == 3 else parts.outputs[channel]
    if root:  # roughness is the root of the image's channel
        power = nodes.new("ShaderNodeMath")
        power.operation = "SQRT"
        links.new(source, power.inputs[0])
        source = power.outputs[0]
    product.operation = "MULTIPLY"
    product.inputs[1].default_value = factor
    links.new(source, product.inputs[0])
    links.new(product.outputs["Vector"], node.inputs[name])

""".splitlines()


def _read(image: Carried) -> str:
    """The last arguments of `multiplied`."""
    space = "sRGB" if image.texture.encoding == "srgb" else "Non-Color"
    if isinstance(image.factor, tuple):
        return f"{space!r}, {image.factor!r}"
    return f"{space!r}, {(image.factor,) * 3!r}, {image.channel}{', root=True' * image.root}"


PROGRAM = Program(
    "Blender's Principled BSDF",
    PARAMETERS,
    formulas.value,
    start,
    text,
    coat_eta=True,
    coat_colour=True,
    coat_depth=True,
    turned=True,
    colour="Base Color",
    roughness="Roughness",
    maps=own_maps(PARAMETERS, ("Anisotropic Rotation",)),
    anywhere=True,
)
