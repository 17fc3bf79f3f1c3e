"""Belcour 2018, figure 7: rough refraction, and the rough reflection that stands for it.

The reflection is that of the refracted direction from below, by a roughness scaled with the real cosines (Belcour 2018,
Eq. 10, in magnitudes) or as at normal incidence, as the released code has it. Lobes and widths are those of figure 6;
indices, alpha (0.1) and angles are chosen here. The scale of Kulla and Conty 2017, which the paper shows beside its
own, is not printed in it and left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.api import lobes
from velatura.figures import Progress, canvas, disc
from velatura.figures.belcour2018_06 import ALPHA, width
from velatura.stack import Interface, Stack

ANGLES = tuple(range(0, 85, 5))  # degrees
INDICES = ((1.0, 1.5), (1.0, 2.0), (1.5, 1.0))  # above and below
SCALES = ("angles", "shipped")
SHOWN = 30  # degrees, of the lobes


def compute(
    alpha: float = ALPHA, angles: Sequence[float] = ANGLES, count: int = 4001, progress: Progress | None = None
) -> dict[str, Any]:
    """A list of `curves` by `above` and `below`: over `angle` (degrees), the `width` of refraction and of each scale's.

    `lobes` are those of the first at 30 degrees, over `sine`.
    """
    x = np.linspace(-1, 1, count + 2)[1:-1]
    numbers: dict[str, Any] = {"curves": [], "sine": x[::10].tolist()}
    for above, below in canvas.track(INDICES, progress):
        n = below / above
        inside = [float(angle) for angle in angles if np.sin(np.radians(angle)) < 0.98 * min(n, 1)]
        each = [_lobes(x, above, below, alpha, angle) for angle in inside]
        widths = {name: [width(x, lobe[name]) for lobe in each] for name in ("refracted", *SCALES)}
        numbers["curves"].append({"above": above, "below": below, "angle": inside, "width": widths})
    shown = _lobes(x, *INDICES[0], alpha, SHOWN)
    return {**numbers, "lobes": {name: lobe[::10].tolist() for name, lobe in shown.items()}}


def _lobes(x: Any, above: float, below: float, alpha: float, angle: float) -> dict[str, Any]:
    stack = Stack([Interface(eta=below, alpha=alpha)], exterior=above)
    sine, zero = float(np.sin(np.radians(angle))), np.zeros_like(x)
    found = {"refracted": disc.refracted(disc.incidence(angle, 180), x, zero, alpha, alpha, below / above)}
    inside = disc.incidence(np.degrees(np.arcsin(sine * above / below)), 180)
    for scale in SCALES:
        modelled = lobes(stack, np.sqrt(1 - sine**2), model="belcour2018", reflectance="fgd", scale=scale).transmitted
        assert modelled is not None
        scaled = float(modelled.alpha[0, 0])
        found[scale] = disc.reflected(inside, x, zero, scaled, scaled)
    return found


@canvas.page(10, 4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The lobes at one angle, and the widths of the stand-ins over that of refraction."""
    left, right = figure.subplots(1, 2)
    for (name, lobe), colour in zip(numbers["lobes"].items(), ("C0", "C2", "C1")):
        left.plot(numbers["sine"], lobe, color=colour, label=name)
    left.set(title=f"index 1 to 1.5, incidence {SHOWN}°", xlabel="sine of the outgoing angle", xlim=(0, 0.8))
    for n, curve in enumerate(numbers["curves"]):
        for scale, style in zip(SCALES, ("-", "--")):
            ratio = np.divide(curve["width"][scale], curve["width"]["refracted"])
            label = f"{curve['above']:g} to {curve['below']:g}, {scale}"
            right.plot(curve["angle"], ratio, color=f"C{n}", linestyle=style, label=label)
    right.axhline(1, color="0.7", linewidth=1)
    right.set(title="width over that of refraction", xlabel="angle of incidence (°)", ylim=(0, 2))
    left.legend(fontsize="small")
    right.legend(fontsize="small")
