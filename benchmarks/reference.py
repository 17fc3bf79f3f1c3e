"""What the truth costs: the reference's efficiency with next-event estimation, and its statistics.

    python benchmarks/reference.py [--part efficiency statistics]

- efficiency: 1 / (variance x time) of `layered_reference` under one disc light of 5 degrees, with the light sampled and
  connected through the interfaces, over that of its walk alone. Reach: 4 at alpha .1.
- statistics: 10^6 paths through two interfaces, with a warm kernel. Reach: 2 s.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

import velatura.reference
from velatura import kernel
from velatura.stack import Interface, Stack, dumps

ALPHAS = (0.05, 0.1, 0.2)
SIZE, SAMPLES, RENDERS = 128, 16, 24
DISTANCE, HALF_ANGLE = 100.0, np.radians(2.5)


def coated_metal(alpha: float) -> Stack:
    """A coat over a metal, both of roughness alpha."""
    return Stack([Interface(eta=1.5, alpha=alpha), Interface(eta=0.2, k=3.9, alpha=alpha)])


def efficiency() -> None:
    for alpha in ALPHAS:
        scene = sphere_under_disc(coated_metal(alpha))
        connected, alone = (cost(scene, emitter_samples) for emitter_samples in (1, 0))
        gain = alone[0] * alone[1] / (connected[0] * connected[1])
        print(
            f"alpha {alpha:4.2f}: efficiency {gain:6.1f} times the walk's"
            f" (variance {alone[0] / connected[0]:.1f} times lower, time {connected[1] / alone[1]:.2f} times as long,"
            f" means {connected[2]:.5f} and {alone[2]:.5f})"
        )


def sphere_under_disc(stack: Stack) -> Any:
    """A sphere that fills the picture, under one disc light."""
    mi = kernel.mitsuba("llvm_ad_rgb")
    kernel.register()
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


def cost(scene: Any, emitter_samples: int) -> tuple[float, float, float]:
    """Mean variance of a pixel, seconds for a picture (median), and the mean radiance."""
    mi = kernel.mitsuba()
    integrator = mi.load_dict({"type": "direct", "bsdf_samples": 1, "emitter_samples": emitter_samples})
    pictures, times = [], []
    for seed in range(RENDERS + 1):
        start = time.perf_counter()
        pictures.append(np.array(mi.render(scene, integrator=integrator, spp=SAMPLES, seed=seed)).astype(float))
        times.append(time.perf_counter() - start)
    variance = np.var(pictures[1:], axis=0, ddof=1).mean()
    return float(variance), float(np.median(times[1:])), float(np.mean(pictures[1:]))  # the first one compiles


def statistics() -> None:
    stack = coated_metal(0.1)
    velatura.reference.statistics(stack, 1.0, paths=10**6)
    for microsurface in (False, True):
        times = []
        for seed in range(5):
            start = time.perf_counter()
            velatura.reference.statistics(stack, 1.0, paths=10**6, seed=seed, microsurface=microsurface)
            times.append(time.perf_counter() - start)
        name = "many events between facets" if microsurface else "one event at an interface"
        print(f"statistics, 10^6 paths, {name}: {np.median(times):.2f} s")


PARTS = {"efficiency": efficiency, "statistics": statistics}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", nargs="+", choices=PARTS, default=list(PARTS))
    for part in parser.parse_args().part:
        PARTS[part]()


if __name__ == "__main__":
    main()
