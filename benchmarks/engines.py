"""What shaders cost an engine: instructions and bytes per pixel, counted in SPIR-V, for presets and models.

Instructions are those of SPIR-V that compute, on vectors counted once, as glslangValidator writes them, in all rounds
of loops and on both sides of branches; bytes are those of fetched texels. Of a pixel with one light: `vt_lobes` and
`vt_eval_pdf`, once each. Prints the table of docs/how-to/engines.md.

    python benchmarks/engines.py [--presets coated-gold,varnished-paint,frosted-glass]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

from machines import MACHINES
from spirv import counts

import velatura
from velatura.model import MODELS, Model
from velatura.shader import shader
from velatura.shader.glsl import Vulkan

PRESETS = "coated-gold,varnished-paint,frosted-glass"
TEXEL = 16  # bytes, of RGBA32F


def row(preset: str, model: Model, baking: bool) -> str:
    made = shader(velatura.preset(preset), model, printer=Vulkan(), baking=baking)
    found = counts(made.text)
    instructions, fetched = (found["vt_lobes"][k] + found["vt_eval_pdf"][k] for k in range(2))
    read = made.columns if made.columns is not None else made.tables if made.looked_up else None
    size = 0 if read is None else read.nbytes / 1000
    baked = ", baked" if baking else ""
    lines = made.text.count("\n")
    drawn = found["vt_sample"][0]
    return f"| {preset} | `{model.name}`{baked} | {lines} | {instructions} | {drawn} | {TEXEL * fetched} | {size:.0f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--presets", default=PRESETS)
    arguments = parser.parse_args()
    if why := MACHINES["vulkan"].missing():
        print(f"skipped: {why}")
        return
    print("| preset | model | lines | instructions | of a sample | bytes fetched | kB of textures |")
    print("|---|---|---|---|---|---|---|")
    for preset in arguments.presets.split(","):
        for model in MODELS:
            for baking in (False, True) if model.recursion.closed_form else (False,):
                print(row(preset, model, baking), flush=True)


if __name__ == "__main__":
    main()
