"""The printed shader, run in headless Chromium, against NumPy.

The text is compiled, and its values are compared: the same random stacks and directions go through both.
`benchmarks/shader.py` does it for 10^4 of them and all patterns.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import pytest
from agreement import (
    PATTERNS,
    compare,
    differences,
    in_browser,
    in_javascript,
    in_numpy,
    mixed_case,
    placed,
    random_case,
    read_back,
)

import velatura as vt
from velatura.model import named
from velatura.model.context import at_a_point
from velatura.model.papers import bsdf
from velatura.shader import record, shader, structure
from velatura.stack import Material

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

# Every kind of layer and every shape; merged lobes; the form that looks at pairs of directions
CASES: list[tuple[int, str, dict[str, str]]] = [
    (0, "weier2020", {}),
    (4, "realtime", {}),
    (8, "yamaguchi2019", {}),
    (9, "velatura", {}),
    (18, "velatura", {}),
    (24, "velatura", {"form": "symmetric"}),
    (10, "belcour2018", {}),
    (20, "yamaguchi2019", {"form": "symmetric"}),
    (23, "belcour2018", {}),
    (29, "weier2020", {}),
    (48, "realtime", {}),
]


@pytest.fixture(scope="module")
def page() -> Iterator[chromium.Browser]:
    with chromium.browser() as opened:
        yield opened


@pytest.mark.parametrize(("pattern", "model", "switches"), CASES)
def test_the_shader_is_the_model(pattern: int, model: str, switches: dict[str, str], page: chromium.Browser) -> None:
    """Expected: energies and roughnesses within 1e-4, values and densities within 1e-3 where roughnesses reach .05."""
    found = compare(PATTERNS[pattern], model, 60, 7, page, **switches)
    assert found.energy < 1e-4
    assert found.alpha < 1e-4
    assert found.value < 1e-3
    assert found.density < 1e-3
    assert found.drawn < 1e-4


@pytest.mark.parametrize(("patterns", "model"), [((9, 0, 18), "velatura"), ((9, 15, 9), "weier2020")])
def test_the_shader_of_a_mixture_is_the_model(patterns: tuple[int, ...], model: str, page: chromium.Browser) -> None:
    """Expected: values, densities and samples within the same bounds, of a solved mixture and of one in closed form."""
    case = mixed_case([PATTERNS[k] for k in patterns], 60, np.random.default_rng(7))
    found, _, _ = in_browser(case.whole, None, shader(case.whole.stack, model), page)
    truth = case.in_numpy(model)
    apart = differences(truth, replace(found, energy=truth.energy, alpha=truth.alpha))
    assert max(apart.value, apart.density) < 1e-3
    assert apart.drawn < 1e-4


def test_facets_wider_across_the_tangent_are_not_turned(page: chromium.Browser) -> None:
    """Drivers may take the angle of -0 and a negative number for 0, by which an interface without rotation among turned
    ones lay across."""
    case = random_case(PATTERNS[11], 60, np.random.default_rng(7))
    values, keys = case.values, ("layer0_alpha_u", "layer0_alpha_v")
    across = dict(zip(keys, np.sort([values[key] for key in keys], axis=0)), layer0_rotation=np.zeros(60))
    case = replace(case, values={**values, **across})
    recording = record(case.stack, "weier2020")
    found, _, _ = in_browser(case, recording, shader(case.stack, "weier2020"), page)
    assert differences(in_numpy(case, recording), found).value < 1e-3


# One metal, two dielectrics over one, a pane, each of a model that looks films up in its own way; what is solved
COATED: list[tuple[int, str, dict[str, str]]] = [
    (0, "weier2020", {}),
    (10, "belcour2018", {}),
    (11, "velatura", {}),
    (18, "yamaguchi2019", {"form": "symmetric"}),
    (18, "velatura", {}),
    (20, "realtime", {}),
]


@pytest.mark.parametrize(("pattern", "model", "switches"), COATED)
def test_films_are_those_of_the_model(
    pattern: int, model: str, switches: dict[str, str], page: chromium.Browser
) -> None:
    """Expected: the same bounds; films are numbers, and all values live but the indices beside them."""
    found = compare(PATTERNS[pattern], model, 60, 7, page, films=True, **switches)
    assert found.energy < 1e-4
    assert found.alpha < 1e-4
    assert found.value < 1e-3
    assert found.density < 1e-3
    assert found.drawn < 1e-4


def test_a_shader_knows_its_material(page: chromium.Browser) -> None:
    """Expected: `vt_material` holds the numbers of the file, so that the text draws as it is."""
    stack = vt.preset("coated-gold")
    made = shader(stack, "belcour2018")
    main = """
out vec4 result;
void main() {
    VtMaterial m = vt_material(vec2(0.0));
    result = vec4(vt_lobes(m, vec3(0.6, 0.0, 0.8)).reflected[1].energy, 1.0);
}
"""
    drawn = page.draw(f"#version 300 es\n{made.text}{main}", {"vt_tables": made.tables}, 1, 1)
    expected = vt.lobes(stack, cos_theta=0.8, model="belcour2018").energy[1][:, 0]
    np.testing.assert_allclose(drawn.pixels[0, 0, :3], expected, atol=1e-5)


READ_TABLES = """
async ({ text, bytes }) => {
  const gl = document.createElement('canvas').getContext('webgl2');
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  let asked, width, height;
  const given = gl.texImage2D.bind(gl);
  gl.texImage2D = (...all) => { [width, height] = all.slice(3, 5); given(...all); };
  const fetched = async (name) => { asked = name; return new Response(Uint8Array.from(bytes)); };
  const block = Object.getPrototypeOf(async () => {}).constructor('gl', 'fetch', text);
  await block(gl, fetched);
  gl.getExtension('EXT_color_buffer_float');
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  const texels = new Float32Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, texels);
  return { asked, width, height, error: gl.getError(), texels: [...texels] };
}
"""


def test_tables_are_read_as_the_manual_has_it(page: chromium.Browser, tmp_path: Path) -> None:
    """Expected: the texture holds the columns of the material of the page."""
    text = (Path(__file__).parents[2] / "docs" / "how-to" / "shaders.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```js\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    vt.export("coated-gold", "glsl").save(tmp_path / "gold.glsl")
    columns = shader(vt.preset("coated-gold"), "velatura").columns
    assert columns is not None
    found = page.page.evaluate(READ_TABLES, {"text": block, "bytes": [*(tmp_path / "gold.tables.bin").read_bytes()]})
    assert (found["asked"], found["error"]) == ("gold.tables.bin", 0)
    read = np.reshape(found["texels"], (found["height"], found["width"], 4))
    # A material that is solved anew is the same to rounding
    np.testing.assert_allclose(read, columns, rtol=1e-6, atol=1e-15)


STEEP = {"interface": {"eta": 1.5, "alpha": 0.15}}
BRUSHED = {"interface": {"eta": [0.2, 0.9, 1.3], "k": [3.9, 2.5, 2.2], "alpha": [0.1, 0.4], "rotation": 30}}
TINTED = {"medium": {"depth": 0.5, "sigma_a": [0.1, 0.4, 1.0], "sigma_s": 0.2, "g": 0.7}}
WATER = {"interface": {"eta": 1.33, "alpha": 0.3}}
PAINT = {"diffuse": {"albedo": [0.7, 0.2, 0.1]}}


@pytest.mark.parametrize("model", ["belcour2018", "weier2020"])
@pytest.mark.parametrize(
    "layers", [[STEEP, TINTED, BRUSHED], [STEEP, PAINT], [STEEP, TINTED, WATER]], ids=["metal", "paint", "pane"]
)
def test_lobes_that_are_drawn_once_are_the_lobes(layers: list, model: str, page: chromium.Browser) -> None:
    """Expected: for 99 of 100 directions energies within 1e-3 and alphas within 2e-3 of what is worked out; for
    all within five times as much.

    From below a pane, away from the critical angle, at whose kink an interpolation rounds off.
    """
    stack = vt.Stack.from_dict({"layers": layers})
    made = shader(stack, model, values="uniforms")
    rng = np.random.default_rng(4)
    z, phi = rng.uniform(0.02, 1, 300), rng.uniform(0, 2 * np.pi, 300)
    if stack.transmits:
        critical = np.sqrt(1 - 1 / 1.33**2)
        z = np.where((rng.random(300) < 0.5) & (abs(z - critical) > 0.1), -z, z)
    wi = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])
    found = read_back(stack, made, wi, page)

    body = bsdf.body(Material.of(stack), named(model), structure(stack), at_a_point())
    seen = bsdf.scattered(body, tuple(wi))
    parts: list[Any] = [*seen.reflected, *filter(None, [seen.base, seen.transmitted])]
    for part, (*energy, alpha_u, alpha_v, _) in zip(parts, found, strict=True):
        missed = [np.abs(energy - part.energy).max(axis=0) / 1e-3]
        if hasattr(part, "roughness"):
            lit = np.max(energy, axis=0) > 1e-3
            u, v = part.roughness[:2]
            missed += [np.where(lit, np.abs(alpha - truth), 0) / 2e-3 for alpha, truth in ((alpha_u, u), (alpha_v, v))]
        assert np.quantile(missed, 0.99) < 1
        assert np.max(missed) < 5


def test_quick_lobes_are_those_of_every_second_direction(page: chromium.Browser) -> None:
    """Expected: the same at these, and near enough for something that moves between them."""
    stack = vt.Stack.from_dict({"layers": [STEEP, TINTED, BRUSHED]})
    made = shader(stack, "belcour2018", values="uniforms")
    fine, quick = (
        in_javascript(made, placed(stack, made), page, quick).reshape(-1, 49, 95, 4) for quick in (False, True)
    )
    np.testing.assert_array_equal(quick[:, ::2, ::2], fine[:, ::2, ::2])
    assert np.any(quick != fine)
    np.testing.assert_allclose(quick, fine, atol=0.02)


def test_a_wrong_constant_is_seen(page: chromium.Browser) -> None:
    """The comparison can fail: a shader of a slightly other material differs by more than the bounds."""
    case = random_case(PATTERNS[9], 60, np.random.default_rng(7))
    wrong = case.stack.replace(exterior=1.01)
    recording = record(case.stack, "weier2020")
    found, _, _ = in_browser(case, recording, shader(wrong, "weier2020", ["exterior"]), page)
    assert differences(in_numpy(case, recording), found).energy > 1e-4
