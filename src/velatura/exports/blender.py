"""A Python script that makes a material in Blender, of the shader in Open Shading Language."""

from __future__ import annotations

from velatura.exports.request import Export, Request, headed, stated
from velatura.shader.printers.osl import osl


def write(request: Request) -> Export:
    """The script; the shader is in it, and in the file that is saved by Blender."""
    made = osl(request.material, request.model)
    return Export(
        _SCRIPT.format(
            name=request.material.name.strip() or "Velatura", turns=made.turns, shader=_literal(headed(made.text))
        ),
        facts={"loss": stated(made.losses)},
    )


def _literal(text: str) -> str:
    """A text as Python's source, line by line."""
    return "\n".join(["(", *(f"    {line!r}" for line in text.splitlines(keepends=True)), ")"])


_SCRIPT = """\
\"\"\"Written by `velatura export`: makes a material for Cycles, on the CPU, with a shader in Open Shading Language.

Run it in Blender, by Run Script on the page Scripting, or by `blender --python` and its name.
\"\"\"

import bpy

NAME = {name!r}
TURNS = {turns}  # with the tangent, which follows the UV map
SHADER = {shader}


def make():
    if not bpy.app.build_options.cycles_osl:
        raise SystemExit("Cycles has no Open Shading Language in this Blender; builds of blender.org have")
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.shading_system = True
    material = bpy.data.materials.new(NAME)
    if material.node_tree is None:
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()

    # The shader compiles as it is put into the node
    text = bpy.data.texts.new(f"{{NAME}}.osl")
    text.write(SHADER)
    script = nodes.new("ShaderNodeScript")
    script.script = text
    if "BSDF" not in script.outputs:
        raise SystemExit(f"{{text.name}}: did not compile; see the console")
    output = nodes.new("ShaderNodeOutputMaterial")
    output.location = 300, 0
    links.new(script.outputs["BSDF"], output.inputs["Surface"])

    # Tangents and texture coordinates are those of the UV map
    if TURNS:
        tangent = nodes.new("ShaderNodeTangent")
        tangent.direction_type = "UV_MAP"
        tangent.location = -300, 0
        links.new(tangent.outputs["Tangent"], script.inputs["Tangent"])
    if "UV" in script.inputs:
        coordinates = nodes.new("ShaderNodeTexCoord")
        coordinates.location = -300, -200
        links.new(coordinates.outputs["UV"], script.inputs["UV"])
    return material


if __name__ == "__main__":
    print(f"Made the material {{make().name}}")
"""
