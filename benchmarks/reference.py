"""What the truth costs: the reference's efficiency with next-event estimation, and its statistics.

    python benchmarks/reference.py [--part model efficiency statistics]

- model: a picture by the statistical model against one by the reference, of a coated anisotropic conductor under an
  environment: time for equal samples per pixel, and for equal noise (variance x time), which is equal RMSE to what each
  of them converges to. Yamaguchi et al. 2019 report 13 times for equal samples.
- efficiency: 1 / (variance x time) of `layered_reference` under one disc light of 5 degrees, with the light sampled and
  connected through the interfaces, over that of its walk alone. Reach: 4 at alpha .1.
- statistics: 10^6 paths through two interfaces, with a warm kernel. Reach: 2 s.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import velatura as vt
from velatura import kernel, scenes
from velatura.stack import Interface, Stack, dumps

ALPHAS = (0.05, 0.1, 0.2)
SIZE, SAMPLES, RENDERS = 128, 16, 24
DISTANCE, HALF_ANGLE = 100.0, np.radians(2.5)
MODEL_SIZE, MODEL_SAMPLES, MODEL_RENDERS = (256, 256), 64, 8

Picture = Callable[[int], Any]  # rendered from a seed


def coated_metal(alpha: float) -> Stack:
    """A coat over a metal, both of roughness alpha."""
    return Stack([Interface(eta=1.5, alpha=alpha), Interface(eta=0.2, k=3.9, alpha=alpha)])


def model() -> None:
    metal = Interface(conductor="Au", alpha=(0.1, 0.3), rotation=30)
    stack = Stack([Interface(eta=1.5, alpha=0.05), metal])
    mi = kernel.mitsuba("llvm_ad_rgb")

    def picture(name: str) -> Picture:
        scene = mi.load_dict(scenes.scene_dict("ball", "studio", vt.bsdf(stack, name), MODEL_SIZE))
        return lambda seed: mi.render(scene, spp=MODEL_SAMPLES, seed=seed)

    names = ("reference", vt.model.DEFAULT)
    slow, fast = costs([picture(name) for name in names], MODEL_RENDERS)
    noise = slow[0] * slow[1] / (fast[0] * fast[1])
    print(
        f"{names[1]}: the reference takes {slow[1] / fast[1]:.1f} times as long for equal samples,"
        f" {noise:.1f} times for equal noise (variance {slow[0] / fast[0]:.1f} times higher,"
        f" means {slow[2]:.5f} and {fast[2]:.5f})"
    )


def efficiency() -> None:
    mi = kernel.mitsuba("llvm_ad_rgb")

    def picture(scene: Any, emitter_samples: int) -> Picture:
        integrator = mi.load_dict({"type": "direct", "bsdf_samples": 1, "emitter_samples": emitter_samples})
        return lambda seed: mi.render(scene, integrator=integrator, spp=SAMPLES, seed=seed)

    for alpha in ALPHAS:
        scene = sphere_under_disc(coated_metal(alpha))
        connected, alone = costs([picture(scene, emitter_samples) for emitter_samples in (1, 0)], RENDERS)
        gain = alone[0] * alone[1] / (connected[0] * connected[1])
        print(
            f"alpha {alpha:4.2f}: efficiency {gain:6.1f} times the walk's"
            f" (variance {alone[0] / connected[0]:.1f} times lower, time {connected[1] / alone[1]:.2f} times as long,"
            f" means {connected[2]:.5f} and {alone[2]:.5f})"
        )


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


def costs(pictures: list[Picture], renders: int) -> list[tuple[float, float, float]]:
    """Mean variance of a pixel, seconds (median), and the mean radiance of each, rendered by turns."""
    found: list[list[np.ndarray]] = [[] for _ in pictures]
    times: list[list[float]] = [[] for _ in pictures]
    for seed in range(renders + 1):
        for k, picture in enumerate(pictures):
            start = time.perf_counter()
            found[k].append(np.array(picture(seed)).astype(float))
            times[k].append(time.perf_counter() - start)

    def cost(images: list[np.ndarray], seconds: list[float]) -> tuple[float, float, float]:
        variance = np.var(images[1:], axis=0, ddof=1).mean()  # the first one compiles
        return float(variance), float(np.median(seconds[1:])), float(np.mean(images[1:]))

    return [cost(images, seconds) for images, seconds in zip(found, times)]


def statistics() -> None:
    stack = coated_metal(0.1)
    vt.reference.statistics(stack, 1.0, paths=10**6)
    for microsurface in (False, True):
        times = []
        for seed in range(5):
            start = time.perf_counter()
            vt.reference.statistics(stack, 1.0, paths=10**6, seed=seed, microsurface=microsurface)
            times.append(time.perf_counter() - start)
        name = "many events between facets" if microsurface else "one event at an interface"
        print(f"statistics, 10^6 paths, {name}: {np.median(times):.2f} s")


PARTS = {"model": model, "efficiency": efficiency, "statistics": statistics}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", nargs="+", choices=PARTS, default=list(PARTS))
    for part in parser.parse_args().part:
        PARTS[part]()


if __name__ == "__main__":
    main()
