"""Yamaguchi et al. 2019, figure 2: a distribution of normals and the lobe that it reflects, on the projected disc.

Incidence is at 45 degrees, as printed; the roughness (0.05, 0.2), turned by 30 degrees from the plane of incidence, is
chosen here. Axes are those of the spots that are at least half as high as the peak.
"""

from __future__ import annotations

from typing import Any

from velatura.figures import Progress, canvas, disc

ALPHA, TURN = (0.05, 0.2), 30.0
THETA = 45.0
SHOWN = 100


def compute(count: int = 500, progress: Progress | None = None) -> dict[str, Any]:
    """The `aspect`, mean `size` and `turn` (degrees, from the bitangent) of `normals` and `reflected`; `pictures`.

    `size_by_jacobian` is 2 cos theta, the ratio of their sizes by Yamaguchi et al. 2019, Eq. 4.
    """
    x, y = disc.grid(count)
    wi = disc.incidence(THETA, -TURN)  # in the frame of the roughness
    lobes = {"normals": disc.normals(x, y, *ALPHA), "reflected": disc.reflected(wi, x, y, *ALPHA)}
    numbers: dict[str, Any] = {"size_by_jacobian": float(2 * wi[2]), "pictures": {}}
    step = max(count // SHOWN, 1)
    for name, lobe in canvas.track(list(lobes.items()), progress):
        spot = disc.ellipse(x, y, lobe)
        numbers[name] = {"aspect": spot.aspect, "size": spot.size, "turn": spot.turn}
        numbers["pictures"][name] = lobe[::step, ::step].tolist()
    return numbers


@canvas.page(7, 3.8)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Both, side by side, in the frame of the roughness."""
    for axes, (name, lobe) in zip(figure.subplots(1, 2), numbers["pictures"].items()):
        spot = numbers[name]
        disc.show(axes, lobe, f"{name}: aspect {spot['aspect']:.2f}, turned by {spot['turn']:.1f}°")
