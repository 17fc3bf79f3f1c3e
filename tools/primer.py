"""The formulas of the figure in docs/explanation/primer.md, written to docs/_static/primer-data.js.

The functions of the model are recorded for a coat over a metal, as the editor's are, into steps that the page carries
out: `lobes` from the values of the layers and the direction of light, `value` from the lobes and both directions.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import velatura as vt
from velatura.model import named
from velatura.shader import record
from velatura.shader.recorder.symbol import Operand
from velatura.shader.recorder.tape import tape

DATA = Path(__file__).parents[1] / "docs" / "_static" / "primer-data.js"
MODEL = named("belcour2018", reflectance="fresnel", tir="off")  # without tables
LIVE = ("layer0_eta", "layer0_alpha_u", "layer1_depth", "layer2_alpha_u")


def coated(index: float, coat: float, depth: float, metal: float) -> vt.Stack:
    """A grey coat over a metal: its index, its roughness, its optical depth, and the roughness of the metal."""
    return vt.Stack(
        [
            vt.Interface(eta=index, alpha=coat),
            vt.Medium(depth=depth, sigma_a=1.0),
            vt.Interface(eta=0.2, k=3.9, alpha=metal),
        ]
    )


def formulas() -> dict[str, Any]:
    """Both tapes; inputs and outputs are named as in shaders (`m.layer0.eta`, `wi.z`, `l.reflected[0].energy`)."""
    stack = coated(1.5, 0.1, 0.5, 0.2)
    recording = record(stack, MODEL, constant=[name for name in stack.flat() if name not in LIVE])
    lobes = _steps(list(recording.lobes.values()))
    return {"lobes": {**lobes, "names": [f"l.{name}" for name in recording.lobes]}, "value": _steps([recording.value])}


def _steps(outputs: list[Operand]) -> dict[str, Any]:
    found = tape(outputs)
    return {name: getattr(found, name) for name in ("inputs", "constants", "steps", "outputs")}


def text() -> str:
    """The file, for pages that no server hands out."""
    return f"globalThis.primer = {json.dumps(formulas(), separators=(',', ':'))};\n"


if __name__ == "__main__":
    DATA.write_text(text(), encoding="utf-8")
    print(f"{DATA}: {DATA.stat().st_size} bytes")
