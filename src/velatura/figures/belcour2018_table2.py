"""Belcour 2018, table 2: the cost of three scenes by the model and by the baseline of Weidlich and Wilkie 2007.

Frosted metal (figure 13) and the white furnace (figure 12) with direct light only, and the dragon (figure 14) with
all of it. Objects and sizes are chosen here: spheres, and a carved urn for the dragon. So are the roughness of the
furnace's dielectrics, 0.1, since wholly smooth stacks are mirrors here and cost nothing, and the depth of the medium
over the dragon's gold. Weidlich and Wilkie know no scattering: their medium only absorbs, as much as it should scatter.
In parentheses the paper gives its times without interpolation in the tables of FGD and TIR; here the model does without
tables then (`reflectance=fresnel`, `tir=off`). Times are the processor's here, so that ratios are compared.

A picture takes its time in the renderer, mostly, and what a uniform material needs is worked out once here, which it is
not in the paper. So each BSDF is timed alone as well, with a roughness that is read from a texture.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel
from velatura.figures import Progress, canvas, evaluation
from velatura.stack import Stack, preset

WITHOUT_TABLES = {"reflectance": "fresnel", "tir": "off"}
BASELINE = "weidlich_wilkie"
COLUMNS: dict[str, tuple[str, dict[str, str]]] = {
    "belcour2018": ("belcour2018", {}),
    "without tables": ("belcour2018", WITHOUT_TABLES),
    BASELINE: (BASELINE, {}),
    "reference": ("reference", {}),
}

#: By scene: material, object, environment, and the longest path in surfaces met (None: the stage's own).
SCENES: dict[str, tuple[str, str, str, int | None]] = {
    "frosted metal": ("frosted-metal", "sphere", "studio", 2),
    "white furnace": ("furnace-rough", "sphere", "furnace", 2),
    "dragon": ("scattering-medium-over-gold", "urn", "studio", None),
}

#: The paper's times in units of that of Weidlich and Wilkie.
PAPER = {
    "frosted metal": {"belcour2018": 46 / 17, "without tables": 24 / 17},
    "white furnace": {"belcour2018": 108 / 20, "without tables": 35 / 20},
    "dragon": {"belcour2018": 1.84 / 1.60, "without tables": 1.64 / 1.60},
}


def compute(
    names: Sequence[str] = tuple(SCENES),
    size: int = 256,
    spp: int = 16,
    repeats: int = 15,
    lanes: int = evaluation.LANES,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The `evaluation` of BSDFs alone by scene, over the baseline's (`evaluation.costs`), and the ratio in the `paper`.

    Of pictures: `seconds` (the median of `repeats`), their `ratio` to the baseline's with its standard error
    `ratio_error`, and `mean`, the mean radiance of the `pictures`. The paper has no reference in its table.
    """
    numbers: dict[str, Any] = {"scenes": {}, "pictures": {}}
    for name in canvas.track(names, progress):
        images, times = _rendered(name, size, spp, repeats, seed)
        ratios = {column: canvas.ratio(each, times[BASELINE]) for column, each in times.items()}
        numbers["scenes"][name] = {
            "evaluation": _evaluated(name, repeats, lanes, seed),
            "seconds": {column: float(np.median(each)) for column, each in times.items()},
            "ratio": {column: ratio for column, (ratio, _) in ratios.items()},
            "ratio_error": {column: error for column, (_, error) in ratios.items()},
            "paper": PAPER[name],
            "mean": {column: float(image.mean()) for column, image in images.items()},
        }
        numbers["pictures"][name] = {column: image.tolist() for column, image in images.items()}
    return numbers


def _rendered(name: str, size: int, spp: int, repeats: int, seed: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """The pictures of a scene by column, and the seconds: see `canvas.timed`."""
    mi = kernel.mitsuba()
    material, shape, env, depth = SCENES[name]
    loaded = {}
    for column, (model, switches) in COLUMNS.items():
        bsdf = canvas.bsdf(_for(model, preset(material)), model, **switches)
        described = canvas.staged(bsdf, shape, env, size)
        integrator = described["integrator"]
        loaded[column] = mi.load_dict(described | {"integrator": integrator | ({"max_depth": depth} if depth else {})})
    return canvas.timed(loaded, spp, repeats, seed)


def _evaluated(name: str, rounds: int, lanes: int, seed: int) -> evaluation.Costs:
    """Costs of BSDFs of a scene's material over the baseline's, all of them with a texture."""
    with tempfile.TemporaryDirectory() as folder:
        stack = evaluation.textured(preset(SCENES[name][0]), Path(folder))
        bsdfs = {column: canvas.bsdf(_for(model, stack), model, **made) for column, (model, made) in COLUMNS.items()}
    return evaluation.costs(bsdfs, dict.fromkeys(COLUMNS, BASELINE), rounds, seed, lanes)


def _for(model: str, stack: Stack) -> Stack:
    """The stack, its media absorbing instead of scattering for the baseline."""
    if model != BASELINE:
        return stack
    scattering = {name: value for name, value in stack.flat().items() if name.endswith("_sigma_s")}
    absorbing = {name.replace("_sigma_s", "_sigma_a"): value for name, value in scattering.items()}
    return stack.replace(**absorbing, **dict.fromkeys(scattering, 0.0))


@canvas.page(15, 9)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for each scene: its pictures, and costs in units of the baseline's, with those of the paper."""
    widths = (1,) * len(COLUMNS) + (1.8,)
    rows = figure.subplots(len(numbers["scenes"]), len(widths), squeeze=False, width_ratios=widths)
    shown = [column for column in COLUMNS if column != BASELINE]
    for row, (name, found) in zip(rows, numbers["scenes"].items()):
        for plot, (column, picture) in zip(row, canvas.shown(numbers["pictures"][name]).items()):
            canvas.show(plot, 0.5 * picture, column)
        given = {"paper": found["paper"], **found["evaluation"], "a picture, untextured": found["ratio"]}
        groups = {title: {key: each.get(key, np.nan) for key in shown} for title, each in given.items()}
        evaluation.bars(row[-1], groups, ["model", "no tables", "walk"])
        row[-1].set(title=f"{name}: cost over the baseline's", yscale="log", ylim=(0.5, 50))
        row[-1].axhline(1, color="black", linewidth=0.5)
    rows[0, -1].legend(fontsize="small")
