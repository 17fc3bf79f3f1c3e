"""Gradients of random stacks through `vt.bsdf`, by every kind of number, against differences of light that leaves."""

from __future__ import annotations

from typing import Any

import numpy as np

import velatura as vt
from fuzzing import Failure
from fuzzing.stacks import random_stack
from velatura import kernel
from velatura.renderer.differentiated import RELATIVE, RELATIVES, STEPS

MOST = 4  # values of a stack that are tried
SAMPLES = 4096
SMOOTH = 0.01  # roughness of stacks that are not tried
OFF = 0.1  # of a difference, by which a gradient may be off
UNEVEN = 2e-3  # of the light, by which values of either end may be off


def trial(rng: np.random.Generator) -> list[Failure]:
    """One tame random stack that is not smooth, and some of its values."""
    while True:
        stack = random_stack(rng, most=2)
        if any(x > SMOOTH for at, x in stack.values() if "alpha" in at.role and isinstance(x, float)):
            return tried(stack, rng)


def tried(stack: vt.Stack, rng: np.random.Generator) -> list[Failure]:
    """What is wrong with the gradients of a stack."""
    case = {"material": stack.to_dict()}
    try:
        return [Failure(kind, detail, case) for kind, detail in _found(stack, rng)]
    except Exception as error:
        return [Failure(f"raised {type(error).__name__}", str(error).strip().splitlines()[-1], case)]


def _found(stack: vt.Stack, rng: np.random.Generator) -> list[tuple[str, str]]:
    mi = kernel.mitsuba("llvm_ad_rgb")
    import drjit as dr

    bsdf = vt.bsdf(stack)
    parameters = mi.traverse(bsdf)
    given = {at: np.ravel(parameters[at.name]).astype(float) for at, _ in stack.values() if at.declared.differentiable}
    given = {at: x for at, x in given.items() if x.any()}
    chosen = [list(given)[k] for k in rng.permutation(len(given))[:MOST]]

    # Ask for light in directions that the stack draws
    si, context = dr.zeros(mi.SurfaceInteraction3f, SAMPLES), mi.BSDFContext()
    z, phi = rng.uniform(0.1, 1, SAMPLES), rng.uniform(0, 2 * np.pi, SAMPLES)
    up = -1.0 if stack.transmits and rng.random() < 0.5 else 1.0
    si.wi = mi.Vector3f(np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), up * z)
    u = rng.random((3, SAMPLES))
    drawn, _ = bsdf.sample(context, si, mi.Float(u[0]), mi.Point2f(u[1:]))
    share = dr.select(drawn.pdf > 0, (1 + drawn.wo.x) / (SAMPLES * dr.maximum(drawn.pdf, 1e-6)), 0)
    dr.eval(si.wi, drawn.wo, share)

    def light(bsdf: Any) -> Any:
        return dr.sum(dr.mean(bsdf.eval(context, si, drawn.wo)) * share)

    whole, found = float(light(bsdf)[0]), []
    for at in chosen:
        x, scale = given[at], mi.Float(1)
        dr.enable_grad(scale)
        parameters[at.name] = (mi.Color3f if len(x) > 1 else mi.Float)(x.tolist()) * scale
        parameters.update()
        dr.backward(light(bsdf), flags=dr.ADFlag.Default | dr.ADFlag.AllowNoGrad)
        gradient = float(dr.grad(scale)[0])
        step = max(RELATIVES.get(at.role, RELATIVE), STEPS.get(at.role, 0) / float(np.abs(x).max()))
        low, high = at.declared.within
        scales = max(1 - step, low / x.max()), min(1 + step, high / x.max())
        ends = []
        for end in (*scales, 1):
            parameters[at.name] = (mi.Color3f if len(x) > 1 else mi.Float)((end * x).tolist())
            parameters.update()
            ends.append(float(light(bsdf)[0]))
        difference, expected = (scales[1] - scales[0]) * gradient, ends[1] - ends[0]
        detail = f"{at.name}: {difference:.4g} over the step, expected {expected:.4g} of {whole:.4g}"
        if not np.isfinite(gradient):
            found.append(("gradient is not finite", detail))
        elif abs(difference - expected) > OFF * abs(expected) + UNEVEN * whole:
            found.append((f"gradient of {at.key} is no difference", detail))
    return found
