"""The cost of BSDFs alone, without a renderer: of value and density, and of a sample, in directions that all differ."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel
from velatura.checks.probe import Probe
from velatura.figures import canvas
from velatura.figures.canvas import Array
from velatura.stack import Stack

Costs = dict[str, dict[str, dict[str, Any]]]

FUNCTIONS = ("eval_pdf", "sample")
LANES = 2**20  # directions of a round


def textured(stack: Stack, folder: Path) -> Stack:
    """The stack, the roughness of its first surface read from images of a single value, one for each axis that differs.

    So the layers are added up at every point, where those of a uniform isotropic stack are prepared once in tables.
    """
    name = f"layer{stack.surfaces[0]}_alpha"
    alphas = [stack.flat()[f"{name}_{axis}"] for axis in "uv"]
    images = {alpha: canvas.texture(folder / f"{alpha}.exr", np.full((2, 2), alpha)) for alpha in alphas}
    read = [images[alpha] for alpha in alphas]
    return stack.replace(**{name: read[0] if len(images) == 1 else read})


@kernel.exclusive
def timed(bsdfs: Mapping[str, Any], rounds: int, seed: int, lanes: int) -> dict[str, dict[str, Array]]:
    """The processor's seconds (rounds,) by function and BSDF, of evaluating it in as many `lanes`.

    Directions of light and view are uniform over the hemisphere. BSDFs take turns. Recording a function in Python,
    which happens once in a rendering, does not count; nor does a first round, in which it is compiled.
    """
    import drjit as dr

    mi = kernel.mitsuba()
    u = np.random.default_rng(seed).random((5, lanes), np.float32)
    lights, views = _directions(u[:2]), _directions(u[2:4])
    times: dict[str, dict[str, Array]] = {name: {each: np.zeros(rounds) for each in bsdfs} for name in FUNCTIONS}
    probes = {name: Probe(bsdf) for name, bsdf in bsdfs.items()}
    for i in range(rounds + 1):
        for function in FUNCTIONS:
            for name, probe in probes.items():
                si, wo = probe.interaction(lights), probe.vector(views)
                numbers = [probe.floats(each) for each in u]
                si.uv = mi.Point2f(numbers[0], numbers[2])
                given = (wo,) if function == "eval_pdf" else (numbers[4], mi.Point2f(numbers[3], numbers[1]))
                dr.eval(si, given)
                asked = getattr(probe.bsdf, function)(probe.context, si, *given, True)
                dr.sync_thread()
                start = time.process_time()
                dr.eval(asked)
                dr.sync_thread()
                if i:
                    times[function][name][i - 1] = time.process_time() - start
    return times


def costs(bsdfs: Mapping[str, Any], others: Mapping[str, str], rounds: int, seed: int, lanes: int) -> Costs:
    """The ratio of a BSDF's time to that of another one, which `others` names, by function and name.

    Of the ratios of all rounds, `median` and `quartiles`.
    """
    times = timed(bsdfs, rounds, seed, lanes)
    return {
        function: {name: _spread(seconds[name] / seconds[other]) for name, other in others.items()}
        for function, seconds in times.items()
    }


def bars(axes: Any, columns: Mapping[str, Mapping[str, Any]], labels: Sequence[str]) -> None:
    """Groups of bars, one for each label: by title numbers by name, or what `costs` returns for a function."""
    width = 0.8 / len(columns)
    for n, (title, found) in enumerate(columns.items()):
        places = np.arange(len(found)) + (n - (len(columns) - 1) / 2) * width
        medians = [each["median"] if isinstance(each, dict) else each for each in found.values()]
        axes.bar(places, medians, width, label=title)
        for place, each in zip(places, found.values()):
            if isinstance(each, dict):
                axes.plot([place, place], each["quartiles"], color="black", linewidth=1)
    axes.set_xticks(range(len(labels)), labels, fontsize="small")


def _spread(values: Array) -> dict[str, Any]:
    lower, median, upper = np.quantile(values, (0.25, 0.5, 0.75)).tolist()
    return {"median": median, "quartiles": [lower, upper]}


def _directions(u: Array) -> Array:
    """Directions (n, 3), uniform over the upper hemisphere, of uniform numbers (2, n)."""
    z, azimuth = np.maximum(u[0], 1e-3), 2 * np.pi * u[1]
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=-1)
