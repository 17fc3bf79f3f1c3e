"""Our formulas of OpenPBR and glTF against shaders that MaterialX generates: the tables of docs/bakes.md.

For each material the light that is in other places in MaterialX's shader (total variation, percent, the mean over
cosines of incidence 1, .7 and .35), and the greatest difference of albedos; then both with the departures of MaterialX
from the specifications undone. Shaders run in headless Chromium.

    python benchmarks/materialx.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rows import parsed

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
from generated_surfaces import GLTF, OPENPBR, Surface, values

from velatura.optics.directions import directions
from velatura.programs.closures import ViewAndLight
from velatura.renderer.low_discrepancy import square

COSINES = (1.0, 0.7, 0.35)
NODES = 2048  # directions of reflection, drawn by the cosine


def rays() -> tuple[np.ndarray, np.ndarray]:
    """Directions wi and wo (3, N), those of each cosine in turn."""
    u, v = square(NODES)
    wo = directions(np.sqrt(1 - u), 2 * np.pi * v).T
    wi = directions(COSINES).T
    return np.repeat(wi, NODES, axis=1), np.tile(wo, len(COSINES))


def differences(browser: chromium.Browser, surface: Surface) -> list[str]:
    wi, wo = rays()
    ours = [surface.target.value(given, ViewAndLight(wi, wo)) for given in surface.materials.values()]
    columns = []
    for undone in ((), surface.choices):
        cells = []
        for theirs, own in zip(values(browser, surface, wi, wo, undone), ours):
            # (channel, cosine, direction), of which the cosine is the density
            a, b = (x.reshape(3, len(COSINES), NODES) / wo[2, :NODES] * np.pi for x in (theirs, own))
            variation = 0.5 * np.abs(a - b).mean(axis=(0, 2)) / b.mean(axis=(0, 2))
            cells.append(f"{100 * variation.mean():.1f} / {np.abs(a.mean(axis=2) - b.mean(axis=2)).max():.3f}")
        columns.append(cells)
    return [f"| {name} | {' | '.join(row)} |" for name, *row in zip(surface.materials, *columns)]


def main() -> None:
    parsed(__doc__)
    with chromium.browser() as browser:
        for surface in (OPENPBR, GLTF):
            print(f"\n| {surface.node} | as generated | departures undone |\n|---|---|---|")
            print("\n".join(differences(browser, surface)))
            print("\nUndone: " + "; ".join(choice.what for choice in surface.choices) + ".")


if __name__ == "__main__":
    main()
