"""Balls that `--to three` or `babylon` draws by prefiltered environments, against means over samples of the model.

The engine draws in headless Chromium, NumPy the samples, as many of the model's as of the environment's. For each
preset and environment, which is turned about the vertical by each of some parts of a turn: the greatest root mean
square of the difference as displays have it, sRGB from 0 to 1, with the exposure that brings the mean to .25. Pixels
whose centres lie within a thousandth of the radius of the edge are left out: there the mesh's interpolated normals are
not the ball's. Noise of the samples is in it. Prints the tables of docs/how-to/engines.md.

    python benchmarks/environments.py [--to three] [--presets bare-gold,...] [--environments studio,...] [--turns 4]
                                      [--samples 768]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rows import parsed

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
import in_babylon
import in_three

import velatura as vt
from velatura import kernel
from velatura.scenes.environments import PHOTOGRAPHS, studio

PRESETS = (
    "bare-gold,car-paint,red-enamel,varnished-paint,wet-copper,anodised-titanium,pearl-lacquer,"
    "coated-gold,turned-brushing,frosted-glass"
)
ENGINES = {"three": in_three.THREE, "babylon": in_babylon.engine(128)}
WIDTH = 1024  # texels of the studio across; photographs have 512


def environment(name: str) -> np.ndarray:
    """An environment, from the top, (height, width, 3)."""
    if name == "studio":
        return studio(WIDTH)
    return np.maximum(np.array(kernel.bitmap(PHOTOGRAPHS[name])), 0)[..., :3].astype(np.float32)


def main() -> None:
    options = parsed(
        __doc__,
        to="three",
        presets=PRESETS,
        environments="studio,sunset,city,lobby,workshop",
        turns=4,
        samples=768,
        size=48,
        tilt=0.6,
    )
    if why := chromium.missing():
        print(f"skipped: {why}")
        return
    names = options.environments.split(",")
    print(f"| preset | {' | '.join(names)} |\n|---|{'---|' * len(names)}")
    skies = [
        np.roll(sky, turn * sky.shape[1] // options.turns, axis=1)
        for sky in map(environment, names)
        for turn in range(options.turns)
    ]
    with in_three.stage(ENGINES[options.to]) as stage:
        for preset in options.presets.split(","):
            module = vt.export(preset, options.to).text
            truths = in_three.sampled(preset, skies, options.size, options.samples, options.tilt)
            missed = [
                in_three.matched(truth, stage.ball(module, sky, options.size, tilt=options.tilt))
                for truth, sky in zip(truths, skies)
            ]
            worst = np.reshape(missed, (len(names), options.turns)).max(axis=1)
            print(f"| {preset} | {' | '.join(f'{x:.3f}' for x in worst)} |", flush=True)


if __name__ == "__main__":
    main()
