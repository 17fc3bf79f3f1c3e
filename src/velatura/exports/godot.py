"""A material as a resource of Godot 4: a ShaderMaterial with its shader and textures within, which lights meet.

Godot hands its filtered sky to no shader of a surface, so that only lights are met. The code is that of
`velatura.exports.real_time`.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass

import numpy as np

from velatura.exports import real_time
from velatura.exports.request import Export, Request, origin
from velatura.exports.shader import facts_of
from velatura.shader.material import title
from velatura.shader.printers.glsl import Glsl
from velatura.shader.program import described


@dataclass(frozen=True)
class GodotShading(Glsl):
    """The shading language of Godot 4, as far as the model's functions need it."""

    language = "Godot shading language 4"
    helping = {  # noqa: RUF012
        "Choices": {
            (("select", "number"),): "float vt_choice(bool where, float a, float b) { return where ? a : b; }\n",
            (("select", "colour"),): "vec3 vt_choice(bool where, vec3 a, vec3 b) { return where ? a : b; }\n",
            (("select", "condition"),): "bool vt_choice(bool where, bool a, bool b) { return where ? a : b; }\n",
        },
    }

    def texture(self, name: str, place: int) -> str:
        return f"uniform sampler2D {name} : filter_nearest, repeat_disable;\n"


def write(request: Request) -> Export:
    """The resource, in text.

    Raises:
        InvalidInput: a material with textures.
    """
    printer = GodotShading(half=True)
    made = real_time.lit(request, printer).bare
    shading = _SHADER.format(
        model=described(request.model),
        origin=origin(),
        culled="cull_disabled" if made.two_sided else "cull_back",
        outwards="FRONT_FACING ? NORMAL : -NORMAL" if made.two_sided else "NORMAL",
        above="" if made.two_sided else "\n    wi = normalize(vec3(wi.xy, max(wi.z, 1e-3)));",
        code=made.code.strip(),
        frame=made.frame.strip(),
    )
    images = "".join(_image(name, texels) for name, texels in made.textures.items())
    named = "".join(f'shader_parameter/{name} = SubResource("{name}")\n' for name in made.textures)
    text = _RESOURCE.format(
        name=_string(title(request.material)), code=_string(_products(shading)), images=images, textures=named
    )
    return Export(text, facts=facts_of(made.shader, printer.language, request.folder))


def _image(name: str, texels: np.ndarray) -> str:
    """A texture of halves of floats, and its image."""
    height, width, _ = texels.shape
    return _IMAGE.format(name=name, width=width, height=height, data=real_time.halves(texels))


def _products(code: str) -> str:
    """Code with small numbers as products, since Godot hands on 14 decimals of each."""

    def product(found: re.Match[str]) -> str:
        sixes, rest = divmod(int(found[2]), 6)
        first = f"{found[1]}e-{rest}" if rest else f"{found[1].rstrip('.')}{'' if '.' in found[1] else '.0'}"
        return f"({first}{' * 1e-6' * sixes})" if sixes else found[0]

    return re.sub(r"(?<![\w.])(\d+\.?\d*)e-(\d+)", product, code)


def _string(text: str) -> str:
    """A string of a resource, which has the escapes of JSON."""
    return json.dumps(text, ensure_ascii=False)


_RESOURCE = """\
[gd_resource type="ShaderMaterial" format=3]

[sub_resource type="Shader" id="shader"]
code = {code}

{images}[resource]
resource_name = {name}
shader = SubResource("shader")
{textures}"""

_IMAGE = """\
[sub_resource type="Image" id="{name}_image"]
data = {{
"data": PackedByteArray("{data}"),
"format": "RGBAHalf",
"height": {height},
"mipmaps": false,
"width": {width}
}}

[sub_resource type="ImageTexture" id="{name}"]
image = SubResource("{name}_image")

"""

_SHADER = """\
// By the model {model}; for Godot 4.4 and later.
// {origin}
//
// It meets lights and their shadows; not the sky, which Godot filters for its own materials alone. Brushed layers
// follow the texture coordinates.
shader_type spatial;
render_mode ambient_light_disabled, {culled};

varying mat3 vt_frame;

{code}

{frame}

void fragment() {{
    vt_frame = vt_frame_of({outwards}, VERTEX, UV, 1.0);
    ALBEDO = vec3(0.0);
    SPECULAR = 0.0;
}}

void light() {{
    vec3 wi = VIEW * vt_frame;{above}
    VtMaterial material = vt_material(UV);
    VtLobes lobes = vt_lobes(material, wi);
    SPECULAR_LIGHT += ATTENUATION * LIGHT_COLOR * vt_eval(material, lobes, wi, LIGHT * vt_frame);
}}
"""
