"""Balls that `--to three` draws by prefiltered environments, against means over samples of the model.

three.js draws in headless Chromium, NumPy the samples, as many of the model's as of the environment's. For each preset
and environment: the root mean square of the difference as displays have it, sRGB from 0 to 1, with the exposure that
brings the mean to .25. Pixels whose centres lie within a thousandth of the radius of the edge are left out: there the
mesh's interpolated normals are not the ball's. Noise of the samples is in it. Prints the table of
docs/how-to/engines.md.

    python benchmarks/environments.py [--presets bare-gold,...] [--environments studio,...] [--samples 768]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rows import parsed

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
import in_three

import velatura as vt
from velatura import kernel
from velatura.scenes.environments import PHOTOGRAPHS, studio

PRESETS = (
    "bare-gold,car-paint,red-enamel,varnished-paint,wet-copper,anodised-titanium,pearl-lacquer,"
    "coated-gold,turned-brushing,frosted-glass"
)
WIDTH = 1024  # texels of the studio across; photographs have 512


def environment(name: str) -> np.ndarray:
    """An environment, from the top, (height, width, 3)."""
    if name == "studio":
        return studio(WIDTH)
    return np.maximum(np.array(kernel.bitmap(PHOTOGRAPHS[name])), 0)[..., :3].astype(np.float32)


def main() -> None:
    options = parsed(
        __doc__, presets=PRESETS, environments="studio,sunset,city,lobby,workshop", samples=768, size=48, tilt=0.6
    )
    if why := chromium.missing():
        print(f"skipped: {why}")
        return
    skies = {name: environment(name) for name in options.environments.split(",")}
    print(f"| preset | {' | '.join(skies)} |\n|---|{'---|' * len(skies)}")
    with in_three.stage() as stage:
        for preset in options.presets.split(","):
            module = vt.export(preset, "three").text
            truths = in_three.sampled(preset, [*skies.values()], options.size, options.samples, options.tilt)
            found = [
                in_three.matched(truth, stage.ball(module, sky, options.size, tilt=options.tilt))
                for truth, sky in zip(truths, skies.values())
            ]
            print(f"| {preset} | {' | '.join(f'{x:.3f}' for x in found)} |", flush=True)


if __name__ == "__main__":
    main()
