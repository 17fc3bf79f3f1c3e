"""How far the model of a fit is from random walks of its stack: no fit by it can be known closer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from velatura.inverse.fitting import angles
from velatura.inverse.fitting.angles import Directions, compressed
from velatura.inverse.fitting.descent import Fit
from velatura.inverse.lobes.partial_stack import Array

BATCH = 2**20  # estimates at once
HALVES = 2  # of the walks, whose noise is independent
SMOOTHEST = 1e-3  # roughness that interfaces have at least, since walks do not evaluate what is perfectly smooth


@dataclass(frozen=True)
class ModelError:
    """How far a model is from walks of the same stack, in the error of the fit, and the walks' own noise in it.

    error: root mean square of the difference of log(1 + f cos theta_o), from which the noise is taken off: products of
    the differences from either half of the walks, whose mean may be below 0, and then is 0.
    """

    error: float
    noise: float
    walks: int


def model_error(found: Fit, directions: Directions, walks: int = 1000, seed: int = 0) -> ModelError:
    """Error of the model of a fit, beside so many walks of its stack for each of the directions of a table.

    Raises:
        MissingTool: there is no Mitsuba, or no LLVM for it.
    """
    from velatura import api, kernel

    stack = found.stack
    rough = {
        f"layer{k}_{key}": max(value, SMOOTHEST)
        for k, layer in enumerate(stack.layers)
        for key, value in layer.flat().items()
        if key in ("alpha_u", "alpha_v") and isinstance(value, int | float)
    }
    stack = stack.replace(**rough)
    model = angles.table_of(stack, directions, found.model).value * directions.wo[2]
    mi = kernel.mitsuba()
    with kernel.exclusive:
        bsdf = api.bsdf(stack, "reference", microsurface=found.model.microsurface, seed=seed)
        one, other = (_half(mi, bsdf, directions, max(walks // HALVES, 1), half) for half in range(HALVES))
    first, second = compressed(model) - compressed(one), compressed(model) - compressed(other)
    noise = float(np.sqrt(np.mean((first - second) ** 2))) / 2
    return ModelError(float(np.sqrt(max(float(np.mean(first * second)), 0.0))), noise, walks)


def _half(mi: Any, bsdf: Any, directions: Directions, count: int, half: int) -> Array:
    """The mean (3, N) of so many estimates of f cos theta_o; others for each `half`."""
    total, done = np.zeros(directions.wo.shape), 0
    while done < count:
        now = min(max(BATCH // directions.wo.shape[1], 1), count - done)
        si = mi.SurfaceInteraction3f()
        si.p = mi.Point3f(np.zeros((3, now * directions.wo.shape[1])))
        si.wi = mi.Vector3f(np.tile(directions.wi, now))
        # The random numbers of an estimate follow from where it is asked for
        which = np.arange(done, done + now) + half * count
        si.uv = mi.Point2f(np.repeat(which, directions.wo.shape[1]).astype(np.float32), 0)
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(np.tile(directions.wo, now))))
        total += value.reshape(3, now, -1).sum(axis=1)
        done += now
    return np.asarray(total / count)
