"""Gradients of random stacks through `vt.bsdf`, by every kind of number, against differences of light that leaves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

import velatura as vt
from fuzzing import Failure
from fuzzing.stacks import drawn_anew, random_stack
from velatura import kernel
from velatura.renderer.differentiated import RELATIVE, RELATIVES, STEPS
from velatura.stack import Address

Array = NDArray[np.floating]

PATTERNS = 12  # stacks whose BSDFs, and so whose kernels, most trials share
OWN = 0.1  # share of trials with a BSDF of their own
MOST = 4  # values of a stack that are tried
SAMPLES = 1 << 14
SMOOTH = 0.01  # roughness of stacks that are not tried
OFF = 0.1  # of a difference, by which a gradient may be off
CLOSE, STAYS = 0.01, 0.25  # share of a step, and of the light that changes over the whole one, where light jumps
ERRORS = 3  # standard ones, by which a mean over samples may be off
UNEVEN = 2e-3  # of the light, by which values of either end may be off


def trial(rng: np.random.Generator) -> list[Failure]:
    """Some values of a tame random stack that is not smooth: mostly of a pattern, whose kernels other trials share."""
    if rng.random() < OWN:
        return tried(_rough_stack(rng), rng)
    pattern = _rough_stack(np.random.default_rng((int(rng.integers(PATTERNS)), *b"pattern")))
    return tried(drawn_anew(pattern, rng), rng, pattern)


def _rough_stack(rng: np.random.Generator) -> vt.Stack:
    while True:
        stack = random_stack(rng, most=2)
        if any(x > SMOOTH for at, x in stack.values() if "alpha" in at.role and isinstance(x, float)):
            return stack


def tried(stack: vt.Stack, rng: np.random.Generator, pattern: vt.Stack | None = None) -> list[Failure]:
    """Failures of the gradients of a stack: of its own BSDF, or that of a pattern which is given its values."""
    case = {"material": stack.to_dict()}
    try:
        return [Failure(kind, detail, case) for kind, detail in _found(stack, rng, pattern)]
    except Exception as error:
        return [Failure(f"raised {type(error).__name__}", str(error).strip().splitlines()[-1], case)]


def _found(stack: vt.Stack, rng: np.random.Generator, pattern: vt.Stack | None) -> list[tuple[str, str]]:
    mi = kernel.mitsuba("llvm_ad_rgb")
    import drjit as dr

    bsdf = vt.bsdf(pattern or stack)
    parameters = mi.traverse(bsdf)
    before = pattern.flat() if pattern else stack.flat()
    for name, value in stack.flat().items():
        if value != before[name]:
            parameters[name] = (mi.Color3f if isinstance(value, tuple) else mi.Float)(value)
    parameters.update()
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

    # Called as in renderings: gradients of a plain call compile one kernel for each use of a number
    called = dr.opaque(mi.BSDFPtr, bsdf, SAMPLES)

    def lights() -> Any:
        return dr.mean(called.eval(context, si, drawn.wo)) * share

    def light() -> Any:
        return dr.sum(lights())

    whole = float(light()[0])
    found: list[tuple[str, str]] = []
    for at in chosen:
        x = given[at]

        def variable(at: Address = at, x: Array = x) -> Any:
            scale = mi.Float(1)
            dr.enable_grad(scale)
            parameters[at.name] = (mi.Color3f if len(x) > 1 else mi.Float)(x.tolist()) * scale
            parameters.update()
            return scale

        def noise(variable: Callable[[], Any] = variable) -> float:
            scale, each = variable(), lights()
            dr.forward(scale, flags=dr.ADFlag.Default | dr.ADFlag.AllowNoGrad)
            return float(np.std(np.array(dr.grad(each))) * np.sqrt(SAMPLES))

        scale = variable()
        dr.backward(light(), flags=dr.ADFlag.Default | dr.ADFlag.AllowNoGrad)
        gradient = float(dr.grad(scale)[0])

        def scaled(by: float, at: Address = at, x: Array = x) -> float:
            parameters[at.name] = (mi.Color3f if len(x) > 1 else mi.Float)((by * x).tolist())
            parameters.update()
            return float(light()[0])

        step = max(RELATIVES.get(at.role, RELATIVE), STEPS.get(at.role, 0) / float(np.abs(x).max()))
        low, high = sorted(end / x.max() for end in at.declared.within)  # g may be negative
        ends = max(1 - step, low), min(1 + step, high)
        found += judged(at, gradient, scaled, ends, whole, noise)
        scaled(1)
    return found


def judged(
    at: Address,
    gradient: float,
    light: Callable[[float], float],
    ends: tuple[float, float],
    whole: float,
    noise: Callable[[], float] = lambda: 0.0,
) -> Iterator[tuple[str, str]]:
    """Faults of a gradient by the scale of a value, and of the light between two scales.

    Where it is no difference, light may be curved or have a kink: a gradient is between the slopes of both sides, over
    the step and half of it, but for its `noise`: about critical angles it grows as a root. Or light jumps, which is an
    error of its own: of a change a share stays over a small step.
    """
    low, high = map(light, ends)
    over = ends[1] - ends[0]
    detail = f"{at.name}: {over * gradient:.4g} over the step, expected {high - low:.4g} of {whole:.4g}"
    if not np.isfinite(gradient):
        yield "gradient is not finite", detail
        return
    if abs(over * gradient - (high - low)) <= OFF * abs(high - low) + UNEVEN * whole:
        return
    slopes = []
    for end, far in zip(ends, (low, high)):
        if end == 1:  # a bound of the value leaves one side alone
            continue
        half, close = 0.5 * (end - 1), CLOSE * (end - 1)
        jump = light(1 + close) - whole
        if abs(jump) > max(UNEVEN * whole, STAYS * abs(far - whole)):
            yield f"light jumps at a value of {at.key}", f"{at.name}: by {jump:.4g} of {whole:.4g}"
            return
        slopes += [(far - whole) / (end - 1), (light(1 + half) - whole) / half]
    least, most = over * min(slopes), over * max(slopes)
    margin = OFF * max(abs(least), abs(most)) + UNEVEN * whole + ERRORS * over * noise()
    if not least - margin <= over * gradient <= most + margin:
        yield f"gradient of {at.key} is no difference", f"{detail}; slopes of both sides {least:.4g} to {most:.4g}"
