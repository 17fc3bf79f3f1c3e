"""Printed shaders in every language but GLSL ES, run on the CPU, against NumPy.

Rationale: only a compiler tells whether a text is of its language, and only numbers tell whether it is the model. GLSL
ES runs in Chromium (tests/browser/test_shader.py); `benchmarks/shader.py` runs 10^4 stacks of all patterns.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from agreement import PATTERNS, compare, differences, in_numpy, on_machine, random_case
from machines import MACHINES

from velatura.shader import record, shader

# Patterns that together have every kind of layer and every shape; merged lobes, films, brushed `velatura`, and the form
# that looks at pairs of directions
CASES: dict[str, list[tuple[int, str, bool, dict[str, str]]]] = {
    "glsl450": [(0, "weier2020", False, {}), (4, "realtime", False, {}), (16, "belcour2018", False, {})],
    "vulkan": [(9, "belcour2018", False, {}), (18, "velatura", True, {}), (20, "yamaguchi2019", False, {})],
    "hlsl": [(10, "belcour2018", True, {}), (29, "weier2020", False, {}), (11, "velatura", False, {})],
    "slang": [(10, "belcour2018", False, {}), (18, "yamaguchi2019", False, {"form": "symmetric"})],
    "wgsl": [(10, "belcour2018", False, {}), (20, "realtime", True, {}), (18, "velatura", False, {})],
}
EVERY = [(name, *case) for name, cases in CASES.items() for case in cases]


@pytest.mark.parametrize(("name", "pattern", "model", "films", "switches"), EVERY)
def test_every_language_is_the_model(
    name: str, pattern: int, model: str, films: bool, switches: dict[str, Any]
) -> None:
    """Expected: energies and roughnesses within 1e-4, values and densities within 1e-3 where roughnesses reach .05."""
    if why := MACHINES[name].missing():
        pytest.skip(why)
    found = compare(PATTERNS[pattern], model, 60, 7, MACHINES[name], films=films, **switches)
    assert found.energy < 1e-4
    assert found.alpha < 1e-4
    assert found.value < 1e-3
    assert found.density < 1e-3
    assert found.drawn < 1e-4


@pytest.mark.parametrize("name", MACHINES)
def test_a_wrong_constant_is_seen(name: str) -> None:
    """The comparison can fail: a shader of a slightly other material differs by more than the bounds."""
    if why := MACHINES[name].missing():
        pytest.skip(why)
    case = random_case(PATTERNS[9], 60, np.random.default_rng(7))
    wrong = shader(case.stack.replace(exterior=1.01), "weier2020", ["exterior"], printer=MACHINES[name].printer)
    recording = record(case.stack, "weier2020")
    found = on_machine(case, recording, wrong, MACHINES[name])
    assert differences(in_numpy(case, recording), found).energy > 1e-4
