"""Yamaguchi et al. 2019, figure 5: the extra cost of a covariance over a variance, over the samples of a pixel.

The model of Belcour 2018 with the choices of Yamaguchi's, on two isotropic layers, and Yamaguchi's on two brushed ones,
turned apart; a sphere in the studio. Indices and roughnesses are those chosen for figure 4 (a) and (d). The lobes of a
uniform material are prepared once for all pixels here, which they are not in the paper: `textured` is the isotropic
material with a roughness that is read from an image of a single value. Seconds are the processor's, and most of them
the renderer's. So BSDFs are timed alone, too, all of them uniform, and all with a textured roughness.

The paper's two other times are here as ratios: that of the random walk to the model, at as many samples and at as much
noise, and that of a picture of one sample in light from one direction to one in the studio.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel, scenes
from velatura.figures import Progress, canvas, evaluation
from velatura.figures.yamaguchi2019 import CHOICES, PLAIN, SPREAD, stack
from velatura.stack import Stack

COUNTS = (16, 32, 64)
PAPER = {"anisotropic": 1.025, "walk": 587.8 / 45.1}


def compute(
    counts: Sequence[int] = COUNTS,
    size: int = 128,
    repeats: int = 15,
    lanes: int = evaluation.LANES,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The `seconds` of a picture (the median of `repeats`) by material, over `samples` of a pixel.

    `overhead` is what `anisotropic` takes more than the other two, as a share of each, `overhead_error` its standard
    error. `walk` and `directional` have the `ratio` of the two other times to that of `anisotropic` at most samples,
    and its `ratio_error`; `equal_noise` is that of the walk for as much variance of the pixels. `evaluation` has what
    BSDFs cost alone, `uniform` and `textured` ones (`evaluation.costs`): `anisotropic` over the isotropic one, and the
    `walk` over the anisotropic one.
    """
    isotropic, brushed = PLAIN, stack(SPREAD, 60.0, SPREAD, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        uniform = _bsdfs(isotropic, brushed)
        textured = _bsdfs(*(evaluation.textured(each, Path(folder)) for each in (isotropic, brushed)))
    shown = {name: uniform[name] for name in ("isotropic", "anisotropic")} | {"textured": textured["isotropic"]}
    loaded = {name: _scene(bsdf, size) for name, bsdf in shown.items()}
    others = ("isotropic", "textured")
    numbers: dict[str, Any] = {"samples": list(counts), "seconds": {name: [] for name in loaded}}
    numbers |= {name: {other: [] for other in others} for name in ("overhead", "overhead_error")}
    over = {"anisotropic": "isotropic", "walk": "anisotropic"}
    numbers["evaluation"] = {
        kind: evaluation.costs(bsdfs, over, repeats, seed, lanes)
        for kind, bsdfs in (("uniform", uniform), ("textured", textured))
    }
    for count in canvas.track(counts, progress):
        _, times = canvas.timed(loaded, count, repeats, seed)
        for name, each in times.items():
            numbers["seconds"][name].append(float(np.median(each)))
        for other in others:
            ratio, error = canvas.ratio(times["anisotropic"], times[other])
            numbers["overhead"][other].append(ratio - 1)
            numbers["overhead_error"][other].append(error)

    # Compare the walk, and one sample in light from one direction
    walk = _scene(uniform["walk"], size)
    beam = _scene(uniform["anisotropic"], size, light={"type": "directional", "direction": [1.0, -1.0, -1.0]})
    _, times = canvas.timed({"walk": walk, "model": loaded["anisotropic"]}, counts[-1], repeats, seed)
    _, single = canvas.timed({"directional": beam}, 1, repeats, seed)
    for name, seconds in (("walk", times["walk"]), ("directional", single["directional"])):
        numbers[name] = dict(zip(("ratio", "ratio_error"), canvas.ratio(seconds, times["model"])))
    true, modelled = (
        canvas.spheres(brushed, name, "studio", size, counts[-1], seed, **choices).var(axis=0, ddof=1).mean()
        for name, choices in (("reference", {}), ("yamaguchi2019", CHOICES))
    )
    numbers["walk"]["equal_noise"] = float(numbers["walk"]["ratio"] * true / modelled)
    return numbers


def _bsdfs(isotropic: Stack, brushed: Stack) -> dict[str, Any]:
    """Belcour's model of the isotropic material, Yamaguchi's and the walk of the brushed one."""
    return {
        "isotropic": canvas.bsdf(isotropic, "belcour2018", **CHOICES),
        "anisotropic": canvas.bsdf(brushed, "yamaguchi2019", **CHOICES),
        "walk": canvas.bsdf(brushed, "reference"),
    }


def _scene(bsdf: Any, size: int, **changes: Any) -> Any:
    """A sphere in the studio, or in what else is given, loaded."""
    return kernel.load_dict(scenes.scene_dict("sphere", "studio", bsdf, (size, size)) | changes)


@canvas.page(14, 4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The seconds and the overhead of pictures over the samples, and the overhead of an evaluation."""
    left, middle, third, last = figure.subplots(1, 4)
    for name, seconds in numbers["seconds"].items():
        left.plot(numbers["samples"], seconds, marker=".", label=name)
    for other, overhead in numbers["overhead"].items():
        error = 100 * np.array(numbers["overhead_error"][other])
        middle.errorbar(numbers["samples"], 100 * np.array(overhead), error, marker=".", label=f"over {other}")
    middle.axhline(100 * (PAPER["anisotropic"] - 1), color="0.7", linestyle="--", label="paper, about")
    left.set(title="processor seconds of a picture", xlabel="samples of a pixel", ylim=(0, None))
    middle.set(title="overhead of a picture (%)", xlabel="samples of a pixel")
    for axes, column, title in (
        (third, "anisotropic", "anisotropic over isotropic"),
        (last, "walk", "walk over model"),
    ):
        shown = {
            kind: {function: costs[function][column] for function in evaluation.FUNCTIONS}
            for kind, costs in numbers["evaluation"].items()
        }
        evaluation.bars(axes, shown, evaluation.FUNCTIONS)
        axes.axhline(PAPER[column], color="0.7", linestyle="--", label="paper, a frame")
        axes.set(title=f"BSDF alone: {title}", ylim=(0, None))
        axes.legend()
    left.legend()
    middle.legend()
