"""Processor time of a step of an optimisation (`prb`, there and back): the first, with nothing compiled, and later.

python benchmarks/gradients.py        # all cases, each in a process of its own that has no kernels of an earlier one
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np
from rows import row

STEPS = 10
GOLD = {"conductor": "Au", "alpha": 0.2}
COAT = {"interface": {"eta": 1.5, "alpha": 0.05}}
CASES: dict[str, tuple[list[dict[str, Any]], str]] = {  # layers, and the value that is optimised
    "roughconductor": ([], "alpha"),
    "roughconductor, alpha textured": ([], "alpha texture"),
    "gold": ([{"interface": GOLD}], "layer0_alpha"),
    "gold, alpha textured": ([{"interface": GOLD}], "layer0_alpha texture"),
    "coated gold": ([COAT, {"interface": GOLD}], "layer1_alpha"),
    "coated gold, alpha textured": ([COAT, {"interface": GOLD}], "layer1_alpha texture"),
    "paint under lacquer, colour textured": ([COAT, {"diffuse": {"albedo": 0.5}}], "layer1_albedo texture"),
}


def main() -> None:
    for name in CASES:
        with tempfile.TemporaryDirectory() as home:
            command = [sys.executable, __file__, name]
            run = subprocess.run(command, env={**os.environ, "HOME": home}, check=True, stdout=subprocess.PIPE)
        first, later = json.loads(run.stdout)
        row("first step", name, first)
        row("later steps", name, later)


def measure(name: str) -> tuple[float, float]:
    """Seconds of all cores, of the first step and the median of later ones: 64x64 pixels, 16 samples each, one bounce.

    Processor time, since other work may share the machine; compiling runs on one core, rendering on all.
    """
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    import drjit as dr

    import velatura as vt

    vt.register()
    layers, place = CASES[name]
    value, textured = place.removesuffix(" texture"), place.endswith("texture")
    texels = np.full((8, 8, 3 if "albedo" in value else 1), 0.2, np.float32)
    given: Any = {"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True} if textured else 0.2
    bsdf = {"type": "layered", "material": json.dumps({"layers": layers})} if layers else {"type": "roughconductor"}
    begin = time.process_time()
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 2},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, -4, 1], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 64, "height": 64},
            },
            "light": {"type": "constant"},
            "shape": {"type": "sphere", "bsdf": {**bsdf, value: given}},
        }
    )
    parameters = mi.traverse(scene)
    keys = [key for key in parameters.keys() if f".{value}" in key and not key.endswith("to_uv")]  # noqa: SIM118
    seconds = []
    for step in range(STEPS):
        for key in keys:
            parameters[key] = type(parameters[key])(parameters[key]) + 1e-4
            dr.enable_grad(parameters[key])
        parameters.update()
        dr.backward(dr.mean(mi.render(scene, parameters, spp=16, seed=step), axis=None))
        dr.eval([dr.grad(parameters[key]) for key in keys])
        dr.sync_thread()
        seconds.append(time.process_time() - begin)
        begin = time.process_time()
    return seconds[0], statistics.median(seconds[1:])


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(measure(sys.argv[1])))
    else:
        main()
