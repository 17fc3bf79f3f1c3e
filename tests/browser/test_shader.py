"""The printed shader, run in headless Chromium, against NumPy.

Rationale: only a compiler of shaders tells whether the text is GLSL, and only numbers tell whether it is the model. The
same random stacks and directions go through both. `benchmarks/shader.py` does it for 10^4 of them and all patterns.
"""

from __future__ import annotations

from collections.abc import Iterator

import chromium
import numpy as np
import pytest
from agreement import PATTERNS, compare, differences, in_browser, in_numpy, random_case

import velatura as vt
from velatura.shader import record, shader

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

# Every kind of layer and every shape; merged lobes; the form that looks at pairs of directions
CASES: list[tuple[int, str, dict[str, str]]] = [
    (0, "weier2020", {}),
    (4, "realtime", {}),
    (8, "yamaguchi2019", {}),
    (9, "velatura", {}),
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


def test_a_shader_knows_its_material(page: chromium.Browser) -> None:
    """Expected: `vt_material` holds the numbers of the file, so that the text draws as it is."""
    stack = vt.preset("coated-gold")
    made = shader(stack)
    main = """
out vec4 result;
void main() {
    VtMaterial m = vt_material(vec2(0.0));
    result = vec4(vt_lobes(m, vec3(0.6, 0.0, 0.8)).reflected[1].energy, 1.0);
}
"""
    drawn = page.draw(f"#version 300 es\n{made.text}{main}", {"vt_tables": made.tables}, 1, 1)
    expected = vt.lobes(stack, cos_theta=0.8).energy[1][:, 0]
    np.testing.assert_allclose(drawn.pixels[0, 0, :3], expected, atol=1e-5)


def test_a_wrong_constant_is_seen(page: chromium.Browser) -> None:
    """The comparison can fail: a shader of a slightly other material differs by more than the bounds."""
    case = random_case(PATTERNS[9], 60, np.random.default_rng(7))
    wrong = case.stack.replace(exterior=1.01)
    recording = record(case.stack, "weier2020")
    found, _, _ = in_browser(case, recording, shader(wrong, "weier2020", ["exterior"]), page)
    assert differences(in_numpy(case, recording), found).energy > 1e-4
