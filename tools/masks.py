"""Draws the mask of the presets that are worn or dusty: `python tools/masks.py`.

A height by seeded noise, whose spectrum falls as a power of the frequency, with scratches. Its values are ranks: each
covers the same area, so that of a texture of it with a factor s and an offset -s (1 - w) the share w of the surface is
above 0. It repeats without seams. The values are what a paint wears off by, from the last to go to the first.
"""

from pathlib import Path

import mitsuba as mi
import numpy as np
from scipy.ndimage import gaussian_filter

FILE = Path(__file__).parents[1] / "src/velatura/stack/presets/wear.png"
SIZE = 256
SEED = 7
ROUGH, FINE = 1.2, 0.8  # powers of the frequency, of chips and of grain
SCRATCHES = 50


def noise(random: np.random.Generator, power: float) -> np.ndarray:
    """Noise of variance 1 whose amplitudes fall as a power of the frequency."""
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(SIZE), np.fft.fftfreq(SIZE)))
    frequency[0, 0] = np.inf
    spectrum = np.fft.fft2(random.normal(size=(SIZE, SIZE))) * frequency**-power
    found = np.fft.ifft2(spectrum).real
    return np.asarray(found / found.std())


def scratches(random: np.random.Generator) -> np.ndarray:
    """Straight thin lines of random length, direction and depth."""
    found = np.zeros((SIZE, SIZE))
    for _ in range(SCRATCHES):
        start, angle = random.uniform(0, SIZE, 2), random.normal(0.6, 0.5)
        length, depth = random.exponential(0.16) * SIZE, random.uniform(0.2, 1.0)
        along = np.arange(0, length, 0.5)
        x, y = (
            np.round(start[k] + along * way).astype(int) % SIZE for k, way in enumerate((np.cos(angle), np.sin(angle)))
        )
        found[y, x] = np.maximum(found[y, x], depth)
    return np.asarray(gaussian_filter(found, 0.6, mode="wrap"))


def main() -> None:
    random = np.random.default_rng(SEED)
    height = noise(random, ROUGH) + 0.2 * noise(random, FINE) + 1.6 * scratches(random)
    ranks = height.ravel().argsort().argsort().reshape(SIZE, SIZE) / (SIZE * SIZE - 1)
    mi.Bitmap(np.round(255 * ranks).astype(np.uint8)).write(str(FILE))
    print(FILE)


if __name__ == "__main__":
    main()
