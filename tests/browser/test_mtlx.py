"""GLSL that MaterialX generates of exported graphs, in headless Chromium, against NumPy."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import chromium
import numpy as np
import pytest
from benchmarks import benchmark
from materialx import document, drawing, generated

import velatura as vt
from velatura.model import named
from velatura.model.papers import bsdf
from velatura.optics import fresnel
from velatura.shader import closures
from velatura.shader.closures import Closure
from velatura.shader.polynomials import PolynomialFit
from velatura.shader.recorder import recording
from velatura.stack import Material

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

COUNT = 400

# The masking of MaterialX has one roughness. Light that passes comes from an environment there: here from one
# direction, through facets that let out again what they block (Walter 2007, Eq. 21)
_OWN = """
vec3 vt_wo;

float vt_masking(vec3 w, vec2 alpha) { return sqrt(1.0 + dot(alpha * w.xy, alpha * w.xy) / (w.z * w.z)); }

vec3 mx_environment_radiance(vec3 N, vec3 V, vec3 X, vec2 alpha, int distribution, FresnelData fd) {
    X = normalize(X - dot(X, N) * N);
    mat3 frame = transpose(mat3(X, cross(N, X), N));
    vec3 i = frame * V, o = frame * vt_wo;
    float eta = fd.ior.x;
    vec3 h = normalize(i + eta * o);
    h *= sign(h.z);
    float c = dot(i, h), d = dot(o, h);
    if (!fd.refraction || o.z > 0.0 || c <= 0.0 || d >= 0.0) { return vec3(0.0); }
    float jacobian = eta * eta * -d / ((c + eta * d) * (c + eta * d));
    float seen = 2.0 / (vt_masking(i, alpha) + vt_masking(o, alpha));
    return (1.0 - mx_compute_fresnel(c, fd)) * mx_ggx_NDF(h, alpha) * seen * c / i.z * jacobian;
}
"""
_G1 = "vt_masking(vec3(dot({0}, X), dot({0}, Y), Ndot{0}), safeAlpha)"
_G2 = f"2.0 / ({_G1.format('V')} + {_G1.format('L')})"

_MAIN = """
uniform highp sampler2D inputs;

vec4 vt_read(int column) {{ return texelFetch(inputs, ivec2(column, int(gl_FragCoord.y)), 0); }}

void main() {{
    vec3 wi = vt_read(0).xyz, n = vec3(0.0, 0.0, 1.0);
    vt_wo = vt_read(1).xyz;
    positionWorld = vec3(0.0);
    u_viewPosition = wi;
    int passes = vt_wo.z < 0.0 ? CLOSURE_TYPE_TRANSMISSION : CLOSURE_TYPE_REFLECTION;
    BSDF bsdf;
    {node}(makeClosureData(passes, vt_wo, wi, n, vec3(0.0), 1.0), {values}n, vec3(1.0, 0.0, 0.0), bsdf);
    {result} = vec4(bsdf.response, 0.0);
}}
"""


@pytest.fixture(scope="module")
def browser() -> Iterator[chromium.Browser]:
    with chromium.browser() as opened:
        yield opened


def directions(seed: int, through: bool) -> tuple[np.ndarray, np.ndarray]:
    """wi above, and wo above or, `through` a material, on either side, (3, N) each."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.15, 1, (2, COUNT)), rng.uniform(0, 2 * np.pi, (2, COUNT))
    z[1] *= np.where(rng.random(COUNT) < 0.7, -1, 1) if through else 1
    sine = np.sqrt(1 - z * z)
    wi, wo = np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=1)
    return wi, wo


def drawn(
    browser: chromium.Browser,
    text: str,
    wi: np.ndarray,
    wo: np.ndarray,
    compensated: bool = False,
    values: Mapping[str, np.ndarray] | None = None,
) -> np.ndarray:
    """What the node of a document reflects and passes, (3, N), for `values` of its inputs by name.

    Facets have masking for two roughnesses; the factor for light that they reflect again is left out unless it is
    `compensated` by weights.
    """
    code = generated(document(text), "essl")
    ((node, arguments),) = re.findall(r"void (NG_velatura_lobes\w+)\(ClosureData closureData, (.*)vec3 normal", code)
    code = re.sub(r"^in (\w+ \w+;)", r"\1", code, flags=re.M).replace(
        "uniform vec3 u_viewPosition", "vec3 u_viewPosition"
    )
    code = code.replace("vec3 mx_environment_radiance(", f"{_OWN}\nvec3 mx_environment(", 1)
    if not compensated:
        code = code.replace("mx_ggx_energy_compensation(NdotV, avgAlpha, F)", "vec3(1.0)")
    before, reflection = code.split("void mx_generalized_schlick_bsdf(")
    assert "mx_ggx_smith_G2(NdotL, NdotV, avgAlpha)" in reflection
    reflection = reflection.replace("mx_ggx_smith_G2(NdotL, NdotV, avgAlpha)", _G2)
    code = f"{before}void mx_generalized_schlick_bsdf({reflection.replace('void main()', 'void unused()')}"
    rows, read = [wi, wo], ""
    for kind, name in re.findall(r"(\w+) (\w+),", arguments):
        rows.append(np.broadcast_to((values or {})[name], (3, COUNT)))
        read += f"vt_read({len(rows) - 1}).{'xyz' if kind == 'vec3' else 'x'}, "
    main = _MAIN.format(node=node, values=read, result=re.search(r"out vec4 (\w+);", code)[1])
    inputs = np.pad(np.stack(rows).transpose(2, 0, 1), ((0, 0), (0, 0), (0, 1))).astype(np.float32)
    unused = {name: [0.0] * (3 if kind == "vec3" else 1) for kind, name in re.findall(r"uniform (\w+) (\w+)", code)}
    pixels = browser.draw(f"{code}{main}", {"inputs": inputs}, 1, COUNT, unused).pixels
    return pixels[:, 0, :3].T


def of_closures(found: list[Closure], wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    value, _ = closures.evaluate(found, tuple(wi), tuple(wo))
    return np.broadcast_to(value, (3, COUNT))


@pytest.mark.parametrize(("preset", "model"), [("turned-brushing", "velatura"), ("tinted-plate", "weier2020")])
def test_generated_glsl_has_the_values_of_the_closures(browser: chromium.Browser, preset: str, model: str) -> None:
    """All of the shader compiles; what is reflected and passed is as in NumPy. Generators write six digits after the
    point."""
    stack = vt.preset(preset)
    wi, wo = directions(11, stack.transmits)
    fit = PolynomialFit(closures.tabulated(Material.of(stack), named(model), conserving=True))
    found = drawn(browser, vt.export(stack, "mtlx", model).text, wi, wo)
    np.testing.assert_allclose(found, of_closures(fit.above(tuple(wi)), wi, wo), rtol=0.02, atol=1e-4)


@pytest.mark.parametrize(
    ("preset", "varies"),
    [("coated-gold", ("layer0_alpha", "layer0_eta")), ("tinted-plate", ("layer1_sigma_a", "layer2_alpha"))],
)
def test_layers_of_a_graph_have_the_values_of_the_model(
    browser: chromium.Browser, tmp_path: Path, preset: str, varies: tuple[str, str]
) -> None:
    """Expected: closures of the values that the inputs take, drawn at random, in NumPy. Generated code has single
    precision, and constants of six digits after the point."""
    (tmp_path / "map.png").touch()
    stack = vt.preset(preset)
    text = vt.export(
        stack.replace(**{name: {"texture": str(tmp_path / "map.png")} for name in varies}), "mtlx", "weier2020"
    ).text
    wi, wo = directions(12, stack.transmits)
    rng = np.random.default_rng(3)
    ranges = {"alpha_u": (0.1, 0.6), "alpha_v": (0.1, 0.6), "eta": (1.2, 1.9), "sigma_a": (0, 1.5), "depth": (0.1, 1)}
    values: dict[str, np.ndarray] = {}
    for name, x in Material.of(stack).flat().items():
        values[name] = np.broadcast_to(x, (3 if np.ndim(x) else 1, COUNT))
        low, high = ranges.get(name.partition("_")[2], (None, None))
        if low is not None and not (stack.transmits and name == "layer2_eta"):
            values[name] = rng.uniform(low, high, (3 if np.ndim(x) else 1, COUNT))
    for name in ("layer0_alpha", "layer2_alpha"):
        if recording.variance(stack).__name__ == "Isotropic":
            values[f"{name}_v"] = values[f"{name}_u"]
    material = Material.from_flat(stack, {name: x if len(x) == 3 else x[0] for name, x in values.items()})
    body = bsdf.body(material, named("weier2020"), recording.variance(stack))
    expected = of_closures(closures.of_body(body, tuple(wi), straight=stack.transmits), wi, wo)
    found = drawn(browser, text, wi, wo, compensated=True, values=values)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-4)


def test_values_of_textures_are_read_as_the_material_has_them(browser: chromium.Browser, tmp_path: Path) -> None:
    """Expected: the texel's channel, scaled and kept within the bounds of a roughness; the angle of brushing."""
    (tmp_path / "map.png").touch()
    rough = {"texture": str(tmp_path / "map.png"), "channel": "g", "scale": 2.0, "offset": -0.5}
    brushing = {"brushing": "concentric", "u": 0.25, "v": 0.6, "offset": 10}
    stack = vt.Stack([vt.Interface(eta=1.5, k=1, alpha=[rough, 0.2], rotation=brushing)])
    made = document(vt.export(stack, "mtlx", "weier2020").text)
    (lobes,) = [node for node in made.getNodes() if node.getCategory().startswith("velatura_lobes")]
    image = np.random.default_rng(5).random((4, 4, 4)).astype(np.float32)
    x, y = (np.arange(4) + 0.5) / 4, (np.arange(4) + 0.5)[:, None] / 4
    expected = {
        "layer0_alpha_u": np.clip(2 * image[..., 1] - 0.5, 0, 1),
        "layer0_rotation": np.degrees(np.arctan2(y - 0.6, x - 0.25)) + 100,
    }
    for name, values in expected.items():
        code = drawing(made, lobes.getInput(name).getConnectedNode().getName())
        code = re.sub(r"^in vec2 texcoord_0;", "vec2 texcoord_0;", code, flags=re.M)
        code = code.replace("void main()\n{", "void main()\n{\n    texcoord_0 = gl_FragCoord.xy / 4.0;")
        textures = {sampler: image for sampler in re.findall(r"uniform sampler2D (\w+);", code)}
        found = browser.draw(code, textures, 4, 4).pixels
        np.testing.assert_allclose(found[..., 0], values, atol=1e-4)


def test_generated_glsl_has_the_values_of_the_coat_law(browser: chromium.Browser) -> None:
    """Of 400 rows of the walks, in single precision: widths, and what is left of the base's light."""
    law = benchmark("coat")
    walks = law.read(law.CSV)
    walks = walks.where(np.random.default_rng(5).permutation(len(walks.n)) < 400)
    text = generated(document(law.CSV.with_name("coat-law.mtlx").read_text()), "essl")
    node = re.search(r"void (NG_coated_base\w*)\(", text)[1]
    text = re.sub(r"^in (\w+ \w+;)", r"\1", text, flags=re.M).replace("void main()", "void unused()")
    text = text.replace("uniform vec3 u_viewPosition", "vec3 u_viewPosition")
    result = re.search(r"out vec4 (\w+);", text)[1]
    main = f"""
uniform highp sampler2D inputs;

void main() {{
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 widths = texelFetch(inputs, ivec2(0, at.y), 0);
    vec4 base = texelFetch(inputs, ivec2(1, at.y), 0), coat = texelFetch(inputs, ivec2(2, at.y), 0);
    positionWorld = vec3(0.0);
    u_viewPosition = vec3(sqrt(1.0 - base.a * base.a), 0.0, base.a);
    vec2 roughness;
    vec3 attenuation;
    {node}(widths.xy, base.rgb, widths.zw, coat.a, coat.rgb, vec3(0.0, 0.0, 1.0), roughness, attenuation);
    {result} = at.x == 0 ? vec4(roughness, 0.0, 0.0) : vec4(attenuation, 0.0);
}}
"""
    below, passed = law.below_coat(walks), np.exp(-2 * walks.of("tau", "rgb"))
    rows = [[*walks.base, *walks.coat], [*below, walks.cosine], [*passed, walks.n]]
    unused = {name: [0.0] * (3 if kind == "vec3" else 1) for kind, name in re.findall(r"uniform (\w+) (\w+)", text)}
    inputs = {"inputs": np.array(rows).transpose(2, 0, 1).astype(np.float32)}
    drawn = browser.draw(f"{text}{main}", inputs, 2, 400, unused)
    np.testing.assert_allclose(drawn.pixels[:, 0, :2].T, np.minimum(law.roughness(walks), 1), rtol=1e-4)
    expected = law.darkened(walks, law.kept(walks)) / ((1 - fresnel.dielectric(walks.cosine, walks.n)) * below)
    np.testing.assert_allclose(drawn.pixels[:, 1, :3].T, expected, rtol=1e-4)
