"""The code of docs/how-to/engines.md, run against integrals of the shader that it uses."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from machines import MACHINES

import velatura as vt
from velatura.shader import shader
from velatura.shader.printers.glsl import Vulkan

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "engines.md"

# An engine by brute force: GGX of reflectance 1 with separable masking, an environment, and a light that is a cone
ENGINE = """
const int N = 96;

vec3 environment(vec3 w) { return vec3(1.0, 1.0 + 0.6 * w.x, 0.5 + 0.5 * w.z * w.z); }
float light(vec3 w) { return smoothstep(0.80, 0.86, dot(w, vec3(-0.6, 0.0, 0.8))); }

vec3 direction(int i, int j) {
    float z = (float(i) + 0.5) / float(N), phi = 6.2831853 * (float(j) + 0.5) / float(N);
    return vec3(sqrt(1.0 - z * z) * vec2(cos(phi), sin(phi)), z);
}
const float CELL = 6.2831853 / float(N * N);

float masking(float z, float alpha) { return 2.0 * z / (z + sqrt(alpha * alpha + (1.0 - alpha * alpha) * z * z)); }
float ggx(vec3 wi, vec3 wo, float alpha) {
    vec3 m = normalize(wi + wo);
    float q = (m.x * m.x + m.y * m.y) / (alpha * alpha) + m.z * m.z;
    float facets = 1.0 / (3.14159265 * alpha * alpha * q * q);
    return facets * masking(wi.z, alpha) * masking(wo.z, alpha) / (4.0 * wi.z);
}
vec2 split_sum(float z, float alpha) {
    vec3 wi = vec3(sqrt(1.0 - z * z), 0.0, z);
    float sum = 0.0;
    for (int k = 0; k < N * N; k++) sum += ggx(wi, direction(k / N, k % N), alpha) * CELL;
    return vec2(0.4 * sum, 0.6 * sum);
}
vec3 blurred(vec3 mirrored, float alpha) {
    vec3 sum = vec3(0.0), wi = vec3(-mirrored.xy, mirrored.z);
    float whole = 0.0;
    for (int k = 0; k < N * N; k++) {
        vec3 wo = direction(k / N, k % N);
        sum += ggx(wi, wo, alpha) * environment(wo);
        whole += ggx(wi, wo, alpha);
    }
    return sum / whole;
}
vec3 diffused() {
    vec3 sum = vec3(0.0);
    for (int k = 0; k < N * N; k++) {
        vec3 wo = direction(k / N, k % N);
        sum += environment(wo) * wo.z * CELL / 3.14159265;
    }
    return sum;
}
float share(vec3 wi, float alpha) {
    float sum = 0.0;
    for (int k = 0; k < N * N; k++) {
        vec3 wo = direction(k / N, k % N);
        sum += light(wo) * ggx(wi, wo, alpha) * CELL;
    }
    return sum;
}
"""
MAIN = [
    "float z = 0.95 - 0.12 * float(row);",
    "vec3 wi = vec3(sqrt(1.0 - z * z), 0.0, z), around = vec3(0.0), lit = vec3(0.0);",
    "VtMaterial m = vt_material(vec2(0.5));",
    "VtLobes l = vt_lobes(m, wi);",
    "for (int k = 0; k < N * N; k++) {",
    "    vec3 wo = direction(k / N, k % N), f = vt_eval(m, l, wi, wo) * CELL;",
    "    around += f * environment(wo);",
    "    lit += f * light(wo);",
    "}",
    "if (row < 6) {",
    "    results[4 * row] = vec4(from_environment(l, wi) + diffuse, 0.0);",
    "    results[4 * row + 1] = vec4(around, 0.0);",
    "    results[4 * row + 2] = vec4(from_area_light(l, wi), 0.0);",
    "    results[4 * row + 3] = vec4(lit, 0.0);",
    "}",
]


@pytest.mark.parametrize("base", ["metal", "paint"])
def test_lobes_meet_environments_and_area_lights(base: str) -> None:
    """Expected: the integrals of `vt_eval`; over a diffuse base, through which less light gets at grazing angles,
    within 2 percent."""
    machine = MACHINES["vulkan"]
    if why := machine.missing():
        pytest.skip(why)
    coat, tint = vt.Interface(eta=1.5, alpha=0.3), vt.Medium(depth=0.3, sigma_a=(0.1, 0.4, 0.9))
    below = vt.Interface(conductor="Cu", alpha=0.4) if base == "metal" else vt.Diffuse(albedo=(0.6, 0.3, 0.2))
    made = shader(vt.Stack([coat, tint, below]), "weier2020", printer=Vulkan(), baking=True)
    assert made.columns is not None
    code = re.findall(r"```glsl\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    diffuse = "l.base_energy * diffused()" if base == "paint" else "vec3(0.0)"
    lines = [line.replace("diffuse,", f"{diffuse},") for line in MAIN]
    parts = [made.text, machine.declarations(24), ENGINE, *code, machine.main(lines)]
    textures = {"vt_baked": made.columns, "vt_given": np.zeros((1, 1, 4))}
    found = machine.run("\n".join(parts), 6, 4, textures)[..., :3]
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=1e-4 if base == "metal" else 0.02)
    if base == "metal":
        np.testing.assert_allclose(found[:, 2], found[:, 3], rtol=1e-4)
