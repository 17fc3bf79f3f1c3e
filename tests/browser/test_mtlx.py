"""GLSL that MaterialX generates of an exported graph, in headless Chromium, against NumPy."""

from __future__ import annotations

import re

import chromium
import numpy as np
import pytest
from materialx import document, generated

import velatura as vt
from velatura.model import named
from velatura.shader import closures
from velatura.shader.polynomials import Fit
from velatura.stack import Material

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

# The masking of MaterialX knows one roughness, and its reflections let out again what they block: others have neither
_MASKING = """
float vt_masking(vec3 w, vec2 alpha) { return sqrt(1.0 + dot(alpha * w.xy, alpha * w.xy) / (w.z * w.z)); }
"""
_G1 = "vt_masking(vec3(dot({0}, X), dot({0}, Y), Ndot{0}), safeAlpha)"
_G2 = f"2.0 / ({_G1.format('V')} + {_G1.format('L')})"


PRESET = "turned-brushing"


def test_generated_glsl_has_the_values_of_the_closures() -> None:
    """All of the shader compiles; the node reflects as NumPy says. Generators write six digits after the point."""
    text = generated(document(vt.export(PRESET, "mtlx").text), "essl")
    node = re.search(r"void (NG_velatura_lobes\w+)\(", text)[1]
    text = re.sub(r"^in (\w+ \w+;)", r"\1", text, flags=re.M).replace(
        "uniform vec3 u_viewPosition", "vec3 u_viewPosition"
    )
    text = text.replace("mx_ggx_energy_compensation(NdotV, avgAlpha, F)", "vec3(1.0)")
    before, reflection = text.split("void mx_generalized_schlick_bsdf(")
    assert "mx_ggx_smith_G2(NdotL, NdotV, avgAlpha)" in reflection
    reflection = reflection.replace("mx_ggx_smith_G2(NdotL, NdotV, avgAlpha)", _G2)
    text = f"{before}{_MASKING}void mx_generalized_schlick_bsdf({reflection.replace('void main()', 'void unused()')}"
    rng = np.random.default_rng(11)
    z, phi = rng.uniform(0.15, 1, (2, 400)), rng.uniform(0, 2 * np.pi, (2, 400))
    sine = np.sqrt(1 - z * z)
    wi, wo = np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=1)
    result = re.search(r"out vec4 (\w+);", text)[1]
    main = f"""
uniform highp sampler2D inputs;

void main() {{
    vec3 wi = texelFetch(inputs, ivec2(0, int(gl_FragCoord.y)), 0).xyz;
    vec3 wo = texelFetch(inputs, ivec2(1, int(gl_FragCoord.y)), 0).xyz;
    vec3 n = vec3(0.0, 0.0, 1.0);
    positionWorld = vec3(0.0);
    u_viewPosition = wi;
    BSDF bsdf;
    {node}(makeClosureData(CLOSURE_TYPE_REFLECTION, wo, wi, n, vec3(0.0), 1.0), n, vec3(1.0, 0.0, 0.0), bsdf);
    {result} = vec4(bsdf.response, 0.0);
}}
"""
    inputs = np.pad(np.stack([wi.T, wo.T], axis=1), ((0, 0), (0, 0), (0, 1))).astype(np.float32)
    unused = {name: [0.0] * (3 if kind == "vec3" else 1) for kind, name in re.findall(r"uniform (\w+) (\w+)", text)}
    with chromium.browser() as browser:
        drawn = browser.draw(f"{text}{main}", {"inputs": inputs}, 1, 400, unused)
    found = drawn.pixels[:, 0, :3].T
    fit = Fit(closures.tabulated(Material.of(vt.preset(PRESET)), named("velatura"), conserving=True))
    expected, _ = closures.evaluate(fit.above(tuple(wi)), tuple(wi), tuple(wo))
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-4)
