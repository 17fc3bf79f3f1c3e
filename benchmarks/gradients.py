"""Processor time of a step of an optimisation (`prb`, there and back): the first, with nothing compiled, and later.
How smooth values are in a roughness, and how near its gradient is to their slope. Gradients by an index
that is the outside's.

python benchmarks/gradients.py        # all cases, each in a process of its own that has no kernels of an earlier one
python benchmarks/gradients.py smooth # roughness alone
python benchmarks/gradients.py kink   # the index of the outside alone
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

COATED = {"layer0_eta": 1.5, "layer0_alpha_u": 0.1, "layer0_alpha_v": 0.1}
ROUGH: dict[str, dict[str, Any]] = {
    "gold under a coat": {**COATED, "layer1_conductor": "Au", "layer1_alpha_u": 0.3, "layer1_alpha_v": 0.3},
    "brushed aluminium under a coat": {
        **COATED,
        "layer1_conductor": "Al",
        "layer1_alpha_u": 0.1,
        "layer1_alpha_v": 0.35,
        "layer1_rotation": 30.0,
    },
}
WHITE: dict[str, dict[str, Any]] = {
    "rough mirror": {"interface": {"conductor": "mirror", "alpha": 1.0}},
    "diffuse base": {"diffuse": {"albedo": 1.0}},
}
SLANTS = 30, 70  # degrees
LIT, SEEN = 48, (96, 192)  # directions of light, and those (angles, azimuths) over which what leaves is integrated


def main() -> None:
    for name in CASES:
        with tempfile.TemporaryDirectory() as home:
            command = [sys.executable, __file__, name]
            run = subprocess.run(command, env={**os.environ, "HOME": home}, check=True, stdout=subprocess.PIPE)
        first, later = json.loads(run.stdout)
        row("first step", name, first)
        row("later steps", name, later)
    smooth()
    kink()


def smooth() -> None:
    """Light that leaves towards a broad lamp, for each roughness over 21 steps of 1 %: the residual of a cubic, and the
    gradient in the middle beside the cubic's, both times the roughness over the light."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    import drjit as dr

    import velatura as vt

    # Light from all sides of a sphere, without noise
    wo, area = outwards()
    z, phi = np.sqrt((np.arange(LIT) + 0.5) / LIT), 2 * np.pi * 0.618034 * np.arange(LIT)
    wi = np.array([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])
    lamp = mi.Float(np.tile(area * (1 + 4 * np.clip(np.array([0.48, 0.36, 0.8]) @ wo, 0, 1) ** 8), LIT) / LIT)
    si = dr.zeros(mi.SurfaceInteraction3f, LIT * area.size)
    si.wi, towards = mi.Vector3f(np.repeat(wi, area.size, axis=1)), mi.Vector3f(np.tile(wo, LIT))

    def light(bsdf: Any) -> Any:
        return dr.mean(bsdf.eval(mi.BSDFContext(), si, towards)) * lamp

    places = np.arange(-10, 11)
    for name, flat in ROUGH.items():
        for key in (key for key in flat if "alpha" in key):
            values = []
            for place in places:
                bsdf = vt.bsdf(vt.Stack.from_flat(None, {**flat, key: flat[key] * float(1 + 0.01 * place)}))
                values.append(np.array(light(bsdf), float).sum())
            cubic = np.polynomial.Polynomial.fit(places, values, 3)
            bsdf = vt.bsdf(vt.Stack.from_flat(None, flat))
            parameters = mi.traverse(bsdf)
            dr.enable_grad(parameters[key])
            parameters.update()
            dr.backward(dr.sum(light(bsdf)))
            share = flat[key] / values[len(values) // 2]
            slope = float(cubic.deriv()(0)) * 100 / flat[key] * share
            row("unevenness", f"{name}, {key}", float(np.std(values - cubic(places)) / np.mean(values)), "of the light")
            row("gradient", f"{name}, {key}", float(dr.grad(parameters[key])[0]) * share, "", f"of a cubic {slope:.3g}")


def kink() -> None:
    """Light that white materials reflect: its gradient by an index that is the outside's, and the slope over 2 %."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    import drjit as dr

    import velatura as vt

    wo, area = outwards()
    towards, si = mi.Vector3f(wo), dr.zeros(mi.SurfaceInteraction3f, area.size)

    def light(bsdf: Any) -> Any:
        return dr.sum(dr.mean(bsdf.eval(mi.BSDFContext(), si, towards)) * mi.Float(area))

    for name, base in WHITE.items():
        same, denser = (
            vt.Stack.from_dict({"layers": [{"interface": {"eta": eta, "alpha": 0.1}}, base]}) for eta in (1.0, 1.02)
        )
        bsdf, eta = vt.bsdf(same), mi.Float(1.0)
        parameters = mi.traverse(bsdf)
        for slant in SLANTS:
            si.wi = mi.Vector3f(float(np.sin(np.radians(slant))), 0.0, float(np.cos(np.radians(slant))))
            slope = float((light(vt.bsdf(denser)) - light(vt.bsdf(same)))[0]) / 0.02
            dr.enable_grad(eta)
            parameters["layer0_eta"] = eta
            parameters.update()
            dr.clear_grad(eta)
            dr.backward(light(bsdf))
            row("gradient", f"{name}, {slant} degrees", float(dr.grad(eta)[0]), "", f"of differences {slope:.3f}")


def outwards() -> tuple[np.ndarray, np.ndarray]:
    """Directions (3, N) of a quadrature over the hemisphere, and their solid angles (N,)."""
    x, weights = np.polynomial.legendre.leggauss(SEEN[0])
    theta, turn = np.meshgrid((x + 1) * np.pi / 4, (np.arange(SEEN[1]) + 0.5) / SEEN[1] * 2 * np.pi, indexing="ij")
    wo = np.array([np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), np.cos(theta)]).reshape(3, -1)
    return wo, (np.sin(theta) * weights[:, None]).ravel() * np.pi**2 / (2 * SEEN[1])


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
        alone = {"smooth": smooth, "kink": kink}.get(sys.argv[1])
        alone() if alone else print(json.dumps(measure(sys.argv[1])))
    else:
        main()
