"""Random stacks through `vt.bsdf` in `scalar_rgb`, where numbers are Python's: a division by zero raises there."""

from __future__ import annotations

from typing import Any

import numpy as np

import velatura as vt
from fuzzing import Failure
from fuzzing.models import described, random_model
from fuzzing.stacks import random_stack
from velatura import kernel
from velatura.model.base import Model

HEIGHTS = (1.0, 0.6, 0.02, 1e-4, 1e-6)  # cosines, on either side
SAMPLES = 6  # at each of them
OFF = 1e-2  # share by which two numbers that should be equal may differ
FEW = 2  # samples of a stack that may be off: where lobes are narrow, single precision does not hold the half-vector
UNSEEN = 1e-6  # values without a density that count for none

Vector = tuple[float, float, float]


def trial(rng: np.random.Generator) -> list[Failure]:
    """One random stack with a random model; half of them are absurd."""
    return tried(random_stack(rng, absurd=rng.random() < 0.5), random_model(rng, keep=["channels"]), rng)


def tried(stack: vt.Stack, model: Model, rng: np.random.Generator) -> list[Failure]:
    """Failures of the BSDF of a stack in `scalar_rgb`."""
    case: dict[str, Any] = {**described(model), "material": stack.to_dict()}
    before = kernel.mitsuba().variant()
    try:
        kernel.mitsuba("scalar_rgb")
        found = _found(vt.bsdf(stack, model), rng)
    except Exception as error:
        found = [(f"raised {type(error).__name__}", str(error).strip().splitlines()[-1])]
    finally:
        kernel.mitsuba(before)
    return [Failure(kind, detail, case) for kind, detail in dict(found).items()]


def _found(bsdf: Any, rng: np.random.Generator) -> list[tuple[str, str]]:
    mi = kernel.mitsuba()
    context, found, off = mi.BSDFContext(), list[tuple[str, str]](), list[str]()

    def hit(wi: Vector) -> Any:
        si = mi.SurfaceInteraction3f()
        si.wi, si.uv = mi.Vector3f(*wi), mi.Point2f(0.5, 0.5)
        si.n, si.sh_frame = mi.Normal3f(0, 0, 1), mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1])
        si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
        return si

    def asked(wi: Vector, wo: Vector) -> tuple[np.ndarray, float]:
        value, pdf = bsdf.eval_pdf(context, hit(wi), mi.Vector3f(*wo))
        value = np.array(value)
        if not np.isfinite([*value, pdf]).all() or min(*value, pdf) < 0:
            found.append(("not finite, or negative", f"{value} and {pdf} for {wi} and {wo}"))
        if pdf == 0 and value.max() > UNSEEN:
            found.append(("value without density", f"{value} for {wi} and {wo}"))
        return value, pdf

    for height in (*HEIGHTS, *(-c for c in HEIGHTS)):
        phi, sine = rng.uniform(0, 2 * np.pi), np.sqrt(1 - height * height)
        x, y, z = wi = (float(sine * np.cos(phi)), float(sine * np.sin(phi)), float(height))
        # The way back, straight through, the mirror direction on either side, the normals, and at the horizon
        for wo in (wi, (-x, -y, -z), (-x, -y, z), (x, y, -z), (0, 0, 1), (0, 0, -1), (1, 0, 0), _anywhere(rng)):
            value, pdf = asked(wi, wo)
            apart = np.array(bsdf.eval(context, hit(wi), mi.Vector3f(*wo)))
            if _differ(apart, value) or _differ(bsdf.pdf(context, hit(wi), mi.Vector3f(*wo)), pdf):
                found.append(("eval or pdf is not eval_pdf", f"{apart} and {value} for {wi} and {wo}"))
            asked(wo, wi)
        for u in rng.random((SAMPLES, 3)):
            drawn, weight = bsdf.sample(context, hit(wi), u[0], mi.Point2f(*u[1:]))
            weight, wo = np.array(weight), tuple(drawn.wo)
            if not np.isfinite([*weight, drawn.pdf if weight.any() else 0.0]).all() or weight.min() < 0:
                found.append(("not finite, or negative", f"weight {weight}, density {drawn.pdf} for {wi}"))
            if not weight.any() or mi.has_flag(mi.BSDFFlags(drawn.sampled_type), mi.BSDFFlags.Delta):
                continue
            if abs(np.linalg.norm(wo) - 1) > 1e-3:
                found.append(("direction is not of length 1", f"{wo} for {wi}"))
            value, pdf = asked(wi, wo)
            if _differ(drawn.pdf, pdf) or _differ(weight * drawn.pdf, value):
                off.append(f"{drawn.pdf} and {pdf}, {weight * drawn.pdf} and {value} for {wi} and {wo}")
    if len(off) > FEW:
        found.append(("sample is not eval_pdf", f"{len(off)}; {off[0]}"))
    return found


def _anywhere(rng: np.random.Generator) -> Vector:
    x, y, z = (w := rng.normal(size=3)) / np.linalg.norm(w)
    return float(x), float(y), float(z)


def _differ(a: Any, b: Any) -> bool:
    return bool(np.any(np.abs(np.subtract(a, b)) > OFF * np.maximum(np.abs(a), np.abs(b)) + 1e-30))
