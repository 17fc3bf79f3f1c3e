"""Yamaguchi et al. 2019, figure 5: the extra cost of a covariance over a variance, over the samples of a pixel.

The model of Belcour 2018 with the choices of Yamaguchi's, on two isotropic layers, and Yamaguchi's on two brushed ones,
turned apart; a sphere in the studio. Indices and roughnesses are those chosen for figure 4 (a) and (d). Where nothing
is anisotropic or textured the lobes are prepared once for all pixels here, which they are not in the paper: `textured`
has one interface whose roughness is read from an image of a single value. Seconds are the processor's.

The paper's two other times are here as ratios: that of the random walk to the model, at as many samples and at as much
noise, and that of a picture of one sample in light from one direction to one in the studio.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel, scenes
from velatura.figures import canvas
from velatura.figures.yamaguchi2019_04 import COLUMNS, SPREAD, stack
from velatura.stack import Stack

COUNTS = (16, 32, 64)
_CHOICES = COLUMNS["yamaguchi2019"][1]


def compute(
    counts: Sequence[int] = COUNTS,
    size: int = 128,
    repeats: int = 15,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Over `samples` of a pixel, the `seconds` of a picture (the median of `repeats`) by material.

    `overhead` is what `anisotropic` takes more than the other two, as a share of each, `overhead_error` its standard
    error. `walk` and `directional` have the `ratio` of the two other times to that of `anisotropic` at most samples,
    and its `ratio_error`; `equal_noise` is that of the walk for as much variance of the pixels.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    with tempfile.TemporaryDirectory() as folder:
        texture = canvas.texture(Path(folder) / "alpha.exr", np.full((2, 2), 0.1))
        isotropic = stack(0.1, 0.0, 0.1, 0.0)
        materials: dict[str, tuple[Stack, str]] = {
            "isotropic": (isotropic, "belcour2018"),
            "textured": (isotropic.replace(layer0_alpha=texture), "belcour2018"),
            "anisotropic": (stack(SPREAD, 60.0, SPREAD, 0.0), "yamaguchi2019"),
        }
        loaded = {}
        for name, (material, model) in materials.items():
            bsdf = canvas.bsdf(material, model, **_CHOICES)
            loaded[name] = _scene(bsdf, size)
    others = ("isotropic", "textured")
    numbers: dict[str, Any] = {"samples": list(counts), "seconds": {name: [] for name in materials}}
    numbers |= {name: {other: [] for other in others} for name in ("overhead", "overhead_error")}
    for count in canvas.track(counts, progress):
        _, times = canvas.timed(loaded, count, repeats, seed)
        for name, each in times.items():
            numbers["seconds"][name].append(float(np.median(each)))
        for other in others:
            ratio, error = canvas.ratio(times["anisotropic"], times[other])
            numbers["overhead"][other].append(ratio - 1)
            numbers["overhead_error"][other].append(error)

    # Compare the walk, and one sample in light from one direction
    stacked, model = materials["anisotropic"]
    walk = _scene(canvas.bsdf(stacked, "reference"), size)
    beam = _scene(bsdf, size, light={"type": "directional", "direction": [1.0, -1.0, -1.0]})
    _, times = canvas.timed({"walk": walk, "model": loaded["anisotropic"]}, counts[-1], repeats, seed)
    _, single = canvas.timed({"directional": beam}, 1, repeats, seed)
    for name, seconds in (("walk", times["walk"]), ("directional", single["directional"])):
        numbers[name] = dict(zip(("ratio", "ratio_error"), canvas.ratio(seconds, times["model"])))
    true, modelled = (
        canvas.spheres(stacked, name, "studio", size, counts[-1], seed, **choices).var(axis=0, ddof=1).mean()
        for name, choices in (("reference", {}), (model, _CHOICES))
    )
    numbers["walk"]["equal_noise"] = float(numbers["walk"]["ratio"] * true / modelled)
    return numbers


def _scene(bsdf: Any, size: int, **changes: Any) -> Any:
    """A sphere in the studio, or in what else is given, loaded."""
    return kernel.load_dict(scenes.scene_dict("sphere", "studio", bsdf, (size, size)) | changes)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """The seconds, and the overhead, over the samples.

    Raises:
        InvalidInput: the file cannot be written.
    """
    figure = canvas.canvas(9, 4)
    left, right = figure.subplots(1, 2)
    for name, seconds in numbers["seconds"].items():
        left.plot(numbers["samples"], seconds, marker=".", label=name)
    for other, overhead in numbers["overhead"].items():
        error = 100 * np.array(numbers["overhead_error"][other])
        right.errorbar(numbers["samples"], 100 * np.array(overhead), error, marker=".", label=f"over {other}")
    right.axhline(2.5, color="0.7", linestyle="--", label="paper, about")
    left.set(title="processor seconds of a picture", xlabel="samples of a pixel", ylim=(0, None))
    right.set(title="overhead (%)", xlabel="samples of a pixel")
    left.legend()
    right.legend()
    canvas.save(figure, path)


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-05.png")
