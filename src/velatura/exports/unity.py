"""A material for Unity: functions in HLSL for a Custom Function node of Shader Graph, and a class in C# that hands the
graph its texture.

Unity was not run with them; their code is compiled, and run without the engine, in the tests. The code is that of
`velatura.exports.real_time`.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass

import numpy as np

from velatura.errors import remark
from velatura.exports import real_time
from velatura.exports.request import Export, Request, origin
from velatura.exports.shader import facts_of
from velatura.shader.material import title
from velatura.shader.printers.hlsl import Hlsl
from velatura.shader.program import PREFIX, described, prefixed


@dataclass(frozen=True)
class UnityHlsl(Hlsl):
    """HLSL with textures that the engine binds by their names."""

    def bound(self, declared: str, register: str) -> str:
        return declared


def write(request: Request) -> Export:
    """The functions; beside them the class, where they read a texture.

    Raises:
        InvalidInput: a material with textures.
    """
    printer, prefix = UnityHlsl(half=True), request.options.get("prefix", PREFIX)
    made = real_time.lit(request, printer)
    mark = digest(made)
    textures = {f"{name}_{mark}": texels for name, texels in made.textures.items()}
    code = re.sub(rf"\b({'|'.join(made.textures) or 'none'})\b", rf"\1_{mark}", made.code)
    entry = "Velatura" if prefix == PREFIX else prefix
    text = prefixed(
        _HLSL.format(
            name=remark(title(request.material)),
            model=described(request.model),
            origin=origin(),
            entry=entry,
            mark=mark.upper(),
            with_class=_WITH_CLASS if textures else "",
            code=code.strip(),
            above="" if made.two_sided else ABOVE,
        ),
        prefix,
    )
    sharp = _SHARP.format(
        name=remark(title(request.material)),
        origin=origin(),
        mark=mark,
        loaded="\n".join(f'        Shader.SetGlobalTexture("{name}", {_texture(x)});' for name, x in textures.items()),
    )
    facts = facts_of(made.shader, printer.language, request.folder)
    described_textures = [
        {"name": name, "width": x.shape[1], "height": x.shape[0], "format": "RGBA16F", "filter": "nearest"}
        for name, x in textures.items()
    ]
    return Export(
        text,
        {".cs": sharp.encode()} if textures else {},
        facts={**facts, "exports": [f"{entry}_float"], "globals": described_textures, "run": False},
    )


def digest(made: real_time.Lit) -> str:
    """A short name of the code and the textures of a material, which does not depend on the material's."""
    found = hashlib.sha256(made.bare.code.encode())
    for texels in made.textures.values():
        found.update(np.ascontiguousarray(texels, "<f4").tobytes())
    return found.hexdigest()[:12]


def _texture(texels: np.ndarray) -> str:
    height, width, _ = texels.shape
    return f'Made({width}, {height}, "{real_time.halves(texels)}")'


#: A statement that keeps the view above the surface.
ABOVE = "\n    wi = normalize(float3(wi.xy, max(wi.z, 1e-3)));"

_HLSL = """\
// {name}, by the model {model}; a function for Unity's Shader Graph, in HDRP and URP.
// {origin}
//
// NOT RUN IN UNITY: compiled as HLSL, and its numbers compared with the model, without the engine.
//
// Put it {with_class}into the project. In an Unlit graph, a Custom Function node of type File takes it
// as its source, with the name {entry}, these inputs and the output Value, and precision Single:
//     View       Vector 3, from View Direction in world space
//     Light      Vector 3, from Main Light Direction, negated: towards the light
//     Normal     Vector 3, from Normal Vector in world space
//     Tangent    Vector 3, from Tangent Vector in world space
//     Bitangent  Vector 3, from Bitangent Vector in world space
//     UV         Vector 2, from UV
// Value is f(wi, wo) |cos theta_o|: light of irradiance E on a surface that faces it leaves as E times Value. One light
// is met; neither its shadow nor an environment.

#ifndef VT_{mark}_INCLUDED
#define VT_{mark}_INCLUDED

{code}

void {entry}_float(
        float3 View, float3 Light, float3 Normal, float3 Tangent, float3 Bitangent, float2 UV, out float3 Value) {{
    float3 n = normalize(Normal), t = normalize(Tangent - dot(Tangent, n) * n), b = cross(n, t);
    b = dot(b, Bitangent) < 0.0 ? -b : b;
    float3x3 frame = float3x3(t, b, n);
    float3 wi = normalize(mul(frame, View)), wo = normalize(mul(frame, Light));{above}
    VtMaterial material = vt_material(UV);
    Value = vt_eval(material, vt_lobes(material, wi), wi, wo);
}}

#endif
"""

_WITH_CLASS = "and the class beside it "

_SHARP = """\
// The texture of {name}.
// {origin}
//
// NOT RUN IN UNITY. The class needs no object: it loads itself in the editor and in the player.

using System;
using UnityEngine;

static class Velatura_{mark}
{{
#if UNITY_EDITOR
    [UnityEditor.InitializeOnLoadMethod]
#endif
    [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.BeforeSceneLoad)]
    static void Load()
    {{
{loaded}
    }}

    static Texture2D Made(int width, int height, string halves)
    {{
        var texture = new Texture2D(width, height, TextureFormat.RGBAHalf, false, true)
        {{
            filterMode = FilterMode.Point,
            wrapMode = TextureWrapMode.Clamp,
            hideFlags = HideFlags.HideAndDontSave,
        }};
        texture.LoadRawTextureData(Convert.FromBase64String(halves));
        texture.Apply(false, true);
        return texture;
    }}
}}
"""
