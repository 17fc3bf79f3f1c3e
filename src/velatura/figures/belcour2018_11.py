"""Belcour 2018, figure 11: colour saturates as light bounces between the interfaces.

The model beside two references: one with all bounces, one with a single reflection at each interface. The paper prints
neither material nor scene: here it is a coat of index 2.4 over copper, both of alpha 0.05, on a sphere in the studio.
The higher the index, the more light comes back to the metal, and takes on more of its colour. The model has the
symmetric form, which the paper renders; the forward one stands beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.stack import Interface, Stack

ETA, METAL, ALPHA = 2.4, "Cu", 0.05
COSINES = (1.0, 0.7, 0.4)

#: One reflection at each interface: a path meets the coat, the metal, and the coat again.
SINGLE = {"max_depth": 3}
COLUMNS: dict[str, tuple[str, dict[str, Any]]] = canvas.FORMS | {
    "all": ("reference", {}),
    "single": ("reference", SINGLE),
}


def compute(
    alpha: float = ALPHA,
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    paths: int = 300_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Reflected light over `cos`, of both forms, and of the reference with `all` bounces and with `single` ones.

    `albedo` by colour, `saturation` as 1 - blue / red, and `canvas.errors` against all bounces; `pictures`.
    """
    stack = Stack([Interface(eta=ETA, alpha=alpha), Interface(conductor=METAL, alpha=alpha)])
    numbers: dict[str, Any] = {"eta": ETA, "conductor": METAL, "alpha": alpha, "cos": list(COSINES)}
    numbers |= {"albedo": {}, "saturation": {}}
    images = {}
    for column in canvas.track(list(COLUMNS), progress):
        name, options = COLUMNS[column]
        made = canvas.bsdf(stack, name, **options)
        samples = [canvas.sampled(made, cosine, paths, seed) for cosine in COSINES]
        albedo = np.array([s.weight.mean(axis=0) for s in samples])
        numbers["albedo"][column] = albedo.tolist()
        numbers["saturation"][column] = (1 - albedo[:, 2] / albedo[:, 0]).tolist()
        images[column] = canvas.taken(made, name, "sphere", "studio", size, spp, seed + (column == "single"))

    numbers["pictures"] = {column: passes.mean(axis=0).tolist() for column, passes in images.items()}
    true = images.pop("all")
    numbers |= canvas.errors(images, true)
    return numbers


@canvas.page(16, 3.3)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The spheres, and the saturation of what they reflect over the angle of incidence."""
    *spheres, plot = figure.subplots(1, 5, width_ratios=(1, 1, 1, 1, 1.2))
    titles = {name: f"belcour2018, {name}" for name in canvas.FORMS}
    titles |= {"all": "reference, all bounces", "single": "reference, one reflection a layer"}
    styles = canvas.STYLES | {"all": {"color": "black"}, "single": {"color": "black", "linestyle": "--"}}
    angles = np.degrees(np.arccos(numbers["cos"]))
    seen = canvas.shown(numbers["pictures"])
    for axes, (column, title) in zip(spheres, titles.items()):
        canvas.show(axes, seen[column], title)
        plot.plot(angles, numbers["saturation"][column], marker=".", label=title, **styles[column])
    plot.set(title="saturation, 1 - blue / red", xlabel="angle of incidence (°)", ylim=(0, None))
    plot.legend(fontsize="small")
