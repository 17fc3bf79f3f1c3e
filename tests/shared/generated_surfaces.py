"""Surfaces that MaterialX generates code for, in Chromium: values of directional light, for many parameters at once."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import MaterialX.PyMaterialXGenShader as gen
import numpy as np
from chromium import Browser
from materialx import document, generated

from velatura.programs.gltf import formulas as gltf
from velatura.programs.openpbr import formulas as openpbr


@dataclass(frozen=True)
class Choice:
    """A departure of MaterialX from a specification: patterns of its code, and what the specification has there."""

    what: str
    changes: tuple[tuple[str, str], ...]

    def undone(self, code: str) -> str:
        for pattern, instead in self.changes:
            code, count = re.subn(pattern, instead, code)
            assert count, f"MaterialX has changed: {self.what}"
        return code


MASKING = Choice(
    "brushed facets are masked as by one roughness",
    (
        (
            r"mx_ggx_smith_G2\(NdotL, NdotV, avgAlpha\)",
            "2.0 / (vt_masking(V, NdotV, X, Y, safeAlpha) + vt_masking(L, NdotL, X, Y, safeAlpha))",
        ),
        (
            r"precision highp float;",
            r"""\g<0>
float vt_masking(vec3 w, float z, vec3 x, vec3 y, vec2 alpha) {
    vec2 slope = alpha * vec2(dot(w, x), dot(w, y)) / z;
    return sqrt(1.0 + dot(slope, slope));
}""",
        ),
    ),
)
BACKWARDS = Choice(
    "for rough diffuse light, a negative cosine between both directions counts as 0",
    ((r"float LdotV = clamp\(dot\(L, V\), M_FLOAT_EPS, 1.0\)", "float LdotV = dot(L, V)"),),
)
HALVES = Choice("metals reflect half as much below a film", ((r"(R23[ps]) = 0\.5 \* f;", r"\1 = f;"),))
CHANNELS = Choice(
    "red, green and blue of a metal below a film count as X, Y and Z",
    (
        (r"Sm  = 2\.0 \* (mx_eval_sensitivity\(.*\));", r"Sm = 2.0 * mx_matrix_mul(XYZ_TO_RGB, \1);"),
        (r"clamp\(mx_matrix_mul\(XYZ_TO_RGB, I\), 0\.0, 1\.0\)", "clamp(I, 0.0, 1.0)"),
    ),
)
BEYOND = Choice(
    "a tinted metal may reflect less than nothing",
    ((r"return (mix\(fd\.F0, fd\.F90, pow\(1\.0 - x, .*);", r"return clamp(\1, 0.0, 1.0);"),),
)
MULTIPLE = Choice(
    "light that facets scatter many times is compensated",
    ((r"(vec3 comp) = mx_ggx_energy_compensation\(.*\);", r"\1 = vec3(1.0);"),),
)
LAYERS = Choice(
    "layers let pass what their albedos leave, not what facets and the normal leave by Fresnel",
    (
        (r"(float avgDirAlbedo) = .*;", r"\1 = max(F.r, max(F.g, F.b));"),
        (
            r"vec3 dirAlbedo = mx_ggx_dir_albedo\(NdotV, avgAlpha, F0, 1\.0\) \* comp;",
            "F = vec3(mx_fresnel_schlick(NdotV, F0)); vec3 dirAlbedo = F;",
        ),
    ),
)

PAINT = {"base_color": (0.6, 0.3, 0.1), "specular_roughness": 0.5}
METAL = {**PAINT, "base_metalness": 1.0}
GLTF_METAL = {"baseColorFactor": (0.6, 0.3, 0.1), "metallicFactor": 1.0, "roughnessFactor": 0.5}
GLTF_PAINT = {**GLTF_METAL, "metallicFactor": 0.0}


@dataclass(frozen=True)
class Surface:
    """A node of MaterialX, our formulas for it, and materials.

    names: of its inputs, where ours differ. choices: by which the node departs from the specification.
    """

    node: str
    target: ModuleType
    names: Mapping[str, str]
    choices: tuple[Choice, ...]
    materials: Mapping[str, Mapping[str, Any]]


OPENPBR = Surface(
    "open_pbr_surface",
    openpbr,
    {},
    (MASKING, BACKWARDS, HALVES, CHANNELS, BEYOND),
    {
        "paint": PAINT,
        "paint, rough": {**PAINT, "specular_roughness": 0.9, "specular_ior": 2.2},
        "paint, tinted": {**PAINT, "specular_color": (0.9, 0.5, 0.2), "specular_weight": 0.7, "specular_ior": 1.8},
        "rough diffuse": {**PAINT, "base_diffuse_roughness": 0.8},
        "no interface": {**PAINT, "specular_weight": 0.0},
        "metal": METAL,
        "metal, rough and tinted": {**METAL, "specular_roughness": 0.8, "specular_color": (0.9, 0.5, 0.2)},
        "metal, brushed": {**METAL, "specular_roughness_anisotropy": 0.7},
        "half metal": {**METAL, "base_metalness": 0.5},
        "coat on metal": {**METAL, "coat_weight": 1.0, "coat_roughness": 0.4},
        "coat on paint": {**PAINT, "coat_weight": 1.0, "coat_roughness": 0.4, "coat_darkening": 0.5},
        "part of a tinted coat": {
            **PAINT,
            "coat_weight": 0.6,
            "coat_roughness": 0.5,
            "coat_color": (0.9, 0.6, 0.3),
            "coat_ior": 1.7,
        },
        "film on paint": {**PAINT, "thin_film_weight": 1.0, "thin_film_thickness": 0.3},
        "film on metal": {**METAL, "thin_film_weight": 1.0, "thin_film_thickness": 0.3},
    },
)
GLTF = Surface(
    "gltf_pbr",
    gltf,
    {
        "baseColorFactor": "base_color",
        "metallicFactor": "metallic",
        "roughnessFactor": "roughness",
        "anisotropyStrength": "anisotropy_strength",
        "anisotropyRotation": "anisotropy_rotation",
        "specularFactor": "specular",
        "specularColorFactor": "specular_color",
        "clearcoatFactor": "clearcoat",
        "clearcoatRoughnessFactor": "clearcoat_roughness",
        "iridescenceFactor": "iridescence",
        "iridescenceIor": "iridescence_ior",
        "iridescenceThicknessMaximum": "iridescence_thickness",
    },
    (MASKING, HALVES, CHANNELS, MULTIPLE, LAYERS),
    {
        "paint": GLTF_PAINT,
        "paint, tinted": {
            **GLTF_PAINT,
            "ior": 1.9,
            "specularFactor": 0.7,
            "specularColorFactor": (0.9, 0.5, 0.2),
        },
        "metal": GLTF_METAL,
        "metal, rough": {**GLTF_METAL, "roughnessFactor": 0.9},
        "metal, brushed": {**GLTF_METAL, "anisotropyStrength": 0.6, "anisotropyRotation": 0.5},
        "half metal": {**GLTF_METAL, "metallicFactor": 0.5},
        "coat on metal": {**GLTF_METAL, "clearcoatFactor": 0.8, "clearcoatRoughnessFactor": 0.5},
        "coat on paint": {**GLTF_PAINT, "clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.5},
        "film on paint": {**GLTF_PAINT, "iridescenceFactor": 1.0, "iridescenceThicknessMaximum": 300.0},
        "film on metal": {**GLTF_METAL, "iridescenceFactor": 1.0, "iridescenceThicknessMaximum": 300.0},
    },
)


def values(browser: Browser, surface: Surface, wi: Any, wo: Any, undone: Iterable[Choice] = ()) -> np.ndarray:
    """f |cos theta_o| (M, 3, N) of the generated code for M materials and N directions, with some choices undone."""
    code, defaults = _code(surface.node)
    for choice in undone:
        code = choice.undone(code)
    function, declared = _match(rf"void (\w*{surface.node}\w*)\((.*), out surfaceshader", code)
    (result,) = _match(r"out vec4 (.*);", code)
    inputs = [each.split() for each in declared.split(", ")]
    component = {"float": "{}.x", "vec3": "{}.xyz", "bool": "({}.x > 0.5)", "int": "int({}.x)"}
    arguments = [component[kind].format(f"given({n})") for n, (kind, _) in enumerate(inputs)]
    main = f"""
uniform highp sampler2D materials, rays;
vec4 given(int n) {{ return texelFetch(materials, ivec2(n, int(gl_FragCoord.x)), 0); }}

void main() {{
    normalWorld = vec3(0.0, 0.0, 1.0);
    u_viewPosition = texelFetch(rays, ivec2(0, int(gl_FragCoord.y)), 0).xyz;
    vt_light = texelFetch(rays, ivec2(1, int(gl_FragCoord.y)), 0).xyz;
    surfaceshader shader;
    {function}({", ".join(arguments)}, shader);
    {result} = vec4(shader.color, 0.0);
}}
"""
    materials = []
    for material in surface.materials.values():
        given = {**defaults, **{surface.names.get(name, name): value for name, value in material.items()}}
        materials.append([np.broadcast_to(given[name], 3) for _, name in inputs])
    textures = {
        name: np.pad(texels, ((0, 0), (0, 0), (0, 1))).astype(np.float32)
        for name, texels in (("materials", np.array(materials)), ("rays", np.stack([wi.T, wo.T], axis=1)))
    }
    drawn = browser.draw(f"{code}{main}", textures, len(materials), wi.shape[1])
    return drawn.pixels[..., :3].transpose(1, 2, 0)


def _match(pattern: str, code: str) -> tuple[str, ...]:
    found = re.search(pattern, code)
    assert found, f"MaterialX has changed: {pattern}"
    return found.groups()


def _code(node: str) -> tuple[str, dict[str, Any]]:
    """GLSL of a node under one light along `vt_light`, without a `main`; and the defaults of its inputs."""
    made = document(f"""<materialx version="1.39" colorspace="lin_rec709">
  <{node} name="surface" type="surfaceshader" />
  <surfacematerial name="material" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="surface" />
  </surfacematerial>
</materialx>""")
    code = generated(made, "essl", gen.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_NONE)
    for pattern, instead in (
        (r"void main\(\)", "void unused()"),
        (r"(?m)^in (\w+ \w+;)", r"\1"),
        (r"uniform (vec3 u_viewPosition;)", r"\1\nvec3 vt_light;\nbool u_refractionTwoSided;"),
        (r"return min\(u_numActiveLightSources, MAX_LIGHT_SOURCES\)", "return 1"),
        (r"(result\.intensity) = .*;", r"\1 = vec3(1.0);"),
        (r"(result\.direction) = .*;", r"\1 = vt_light;"),
    ):
        code, count = re.subn(pattern, instead, code)
        assert count, pattern
    inputs = made.getNodeDef(f"ND_{node}_surfaceshader").getActiveInputs()
    defaults = {each.getName(): _numbers(each) for each in inputs}
    return code, defaults


def _numbers(declared: Any) -> tuple[float, ...]:
    """The default of an input; the frame of the surface, of directions."""
    if not declared.getValueString():
        return (1.0, 0.0, 0.0) if "tangent" in declared.getName() else (0.0, 0.0, 1.0)
    text = declared.getValueString().replace("true", "1").replace("false", "0")
    return tuple(map(float, text.split(",")))
