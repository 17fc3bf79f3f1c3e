"""Cost of the truth: the reference's efficiency with next-event estimation, and its statistics.

    python benchmarks/reference.py [--part model error efficiency statistics] [--renders 24]

- model: a picture by the statistical model against one by the reference, of a coated anisotropic conductor under an
  environment: time for equal samples per pixel, and for equal noise (variance x time), which is equal RMSE to what each
  of them converges to. Yamaguchi et al. 2019 report 13 times for equal samples.
- error: of presets, the time in which the reference has the error of the model, that is in which its noise has fallen
  to the root mean square difference of the two converged pictures, over the time in which the model's noise has; both
  from variance x time, interleaved.
- efficiency: 1 / (variance x time) of `layered_reference` under one disc light of 5 degrees, with the light sampled and
  connected through the interfaces, over that of its walk alone. Reach: 4 at alpha .1.
- statistics: 10^6 paths (or `--paths`) through two interfaces, with a warm kernel. Reach: 2 s.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from rows import parsed, row

import velatura as vt
from velatura import kernel, scenes
from velatura.stack import Interface, Stack, dumps

ALPHAS = (0.05, 0.1, 0.2)
SIZE, SAMPLES = 128, 16
DISTANCE, HALF_ANGLE = 100.0, np.radians(2.5)
MODEL_SAMPLES = 64

ERRORS = ("bare-gold", "coated-gold", "frosted-metal", "pearl-lacquer")  # presets of the part `error`

Picture = Callable[[int], Any]  # rendered from a seed


class Cost(NamedTuple):
    """Variance of a pixel (mean), seconds (median), the mean picture, and how many pictures it is of."""

    variance: float
    seconds: float
    picture: np.ndarray
    renders: int


def coated_metal(alpha: float) -> Stack:
    """A coat over a metal, both of roughness alpha."""
    return Stack([Interface(eta=1.5, alpha=alpha), Interface(eta=0.2, k=3.9, alpha=alpha)])


def model(options: argparse.Namespace) -> None:
    metal = Interface(conductor="Au", alpha=(0.1, 0.3), rotation=30)
    stack = Stack([Interface(eta=1.5, alpha=0.05), metal])
    mi = kernel.mitsuba("llvm_ad_rgb")

    def picture(name: str) -> Picture:
        scene = mi.load_dict(scenes.scene_dict("ball", "studio", vt.bsdf(stack, name), (options.size, options.size)))
        return lambda seed: mi.render(scene, spp=MODEL_SAMPLES, seed=seed)

    names = ("reference", vt.model.DEFAULT)
    slow, fast = costs([picture(name) for name in names], options.renders)
    row("reference", "time for equal samples", slow.seconds / fast.seconds, f"x {names[1]}")
    noise = slow.variance * slow.seconds / (fast.variance * fast.seconds)
    means = f"means {slow.picture.mean():.5f} and {fast.picture.mean():.5f}"
    row("reference", "time for equal noise", noise, f"x {names[1]}", means)


def error(options: argparse.Namespace) -> None:
    mi = kernel.mitsuba("llvm_ad_rgb")

    def picture(preset: str, name: str) -> Picture:
        scene = mi.load_dict(scenes.scene_dict("ball", "studio", vt.bsdf(preset, name), (options.size, options.size)))
        return lambda seed: mi.render(scene, spp=MODEL_SAMPLES, seed=seed)

    for preset in options.presets:
        truth, fast = costs([picture(preset, name) for name in ("reference", vt.model.DEFAULT)], options.renders)
        difference = float(np.mean((truth.picture - fast.picture) ** 2))
        error2 = difference - sum(each.variance / each.renders for each in (truth, fast))
        if error2 <= 0:
            row("error", preset, 0, "rms", f"below the noise of {options.renders} renders")
            continue
        slow_s, fast_s = (each.seconds * each.variance / error2 for each in (truth, fast))
        remark = f"{slow_s:.2g} and {fast_s:.2g} s at {options.size} x {options.size}; rms error {np.sqrt(error2):.4f}"
        row("equal error", preset, slow_s / fast_s, f"x {vt.model.DEFAULT}", remark)


def efficiency(options: argparse.Namespace) -> None:
    mi = kernel.mitsuba("llvm_ad_rgb")

    def picture(scene: Any, emitter_samples: int) -> Picture:
        integrator = mi.load_dict({"type": "direct", "bsdf_samples": 1, "emitter_samples": emitter_samples})
        return lambda seed: mi.render(scene, integrator=integrator, spp=SAMPLES, seed=seed)

    for alpha in ALPHAS:
        scene = sphere_under_disc(coated_metal(alpha))
        connected, alone = costs([picture(scene, emitter_samples) for emitter_samples in (1, 0)], options.renders)
        gain = alone.variance * alone.seconds / (connected.variance * connected.seconds)
        remark = (
            f"variance {alone.variance / connected.variance:.1f} times lower, time"
            f" {connected.seconds / alone.seconds:.2f} times as long,"
            f" means {connected.picture.mean():.5f} and {alone.picture.mean():.5f}"
        )
        row("efficiency", f"alpha {alpha:4.2f}", gain, "x the walk's", remark)


def sphere_under_disc(stack: Stack) -> Any:
    """A sphere that fills the picture, under one disc light."""
    mi = kernel.mitsuba("llvm_ad_rgb")
    vt.register()
    to_world = mi.ScalarTransform4f()
    camera = to_world.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    light = to_world.look_at([0.5 * DISTANCE, 0.5 * DISTANCE, 0.7 * DISTANCE], [0, 0, 0], [0, 1, 0])
    radius = float(np.tan(HALF_ANGLE) * np.sqrt(0.99) * DISTANCE)
    return mi.load_dict(
        {
            "type": "scene",
            "sphere": {
                "type": "sphere",
                "bsdf": {"type": "layered_reference", "material": dumps(stack, "json")},
            },
            "light": {
                "type": "disk",
                "to_world": light @ to_world.scale(radius),
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 100.0}},
            },
            "sensor": {
                "type": "perspective",
                "fov": 23,
                "to_world": camera,
                "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}},
            },
        }
    )


def costs(pictures: list[Picture], renders: int) -> list[Cost]:
    """The cost of each, rendered by turns."""
    found: list[list[np.ndarray]] = [[] for _ in pictures]
    times: list[list[float]] = [[] for _ in pictures]
    for seed in range(renders + 1):
        for k, picture in enumerate(pictures):
            start = time.perf_counter()
            found[k].append(np.array(picture(seed)).astype(float))
            times[k].append(time.perf_counter() - start)

    def cost(images: list[np.ndarray], seconds: list[float]) -> Cost:
        variance = np.var(images[1:], axis=0, ddof=1).mean()  # the first one compiles
        return Cost(float(variance), float(np.median(seconds[1:])), np.mean(images[1:], axis=0), renders)

    return [cost(images, seconds) for images, seconds in zip(found, times)]


def statistics(options: argparse.Namespace) -> None:
    stack = coated_metal(0.1)
    vt.reference.statistics(stack, 1.0, paths=options.paths)
    for microsurface in (False, True):
        times = []
        for seed in range(5):
            start = time.perf_counter()
            vt.reference.statistics(stack, 1.0, paths=options.paths, seed=seed, microsurface=microsurface)
            times.append(time.perf_counter() - start)
        name = "many events between facets" if microsurface else "one event at an interface"
        row("statistics", f"{options.paths:g} paths, {name}", times)


PARTS = {"model": model, "error": error, "efficiency": efficiency, "statistics": statistics}


def main() -> None:
    options = parsed(
        __doc__,
        part=(list(PARTS), "", PARTS),
        renders=(24, "of each picture"),
        size=(256, "of the pictures of the parts `model` and `error`"),
        presets=(list(ERRORS), "of the part `error`"),
        paths=(10**6, "of the statistics"),
    )
    for part in options.part:
        PARTS[part](options)


if __name__ == "__main__":
    main()
