"""Random stacks through `vt.bsdf`: what must hold of its answers wherever it is asked, on either side, at any angle."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import velatura as vt
from fuzzing import Failure, pictures
from fuzzing.models import described, random_model
from fuzzing.stacks import random_stack, textured
from velatura.checks.grid import HemisphereGrid, integrate
from velatura.checks.probe import Array, Probe
from velatura.model.base import Model

TEXTURED = 0.05  # share of stacks: varying values are compiled anew, which takes long
COSINES = (1.0, 0.8, 0.5, 0.2, 0.02, 1e-4, 1e-6)
SAMPLES = 512  # at each of them, on either side
OFF = 1e-2  # two numbers that should be equal are not where they differ by this share
FEW = 4e-3  # samples that may be off: at alpha .001 single precision does not hold the half vector
FULL = 1e-2  # by which the integral of a density may be above 1, beside the error of the quadrature
UNSEEN = 1e-6  # values of which single precision may hold no density
INTEGRATED = (0.7, -0.7)  # cosines where densities are integrated


def trial(rng: np.random.Generator) -> list[Failure]:
    """One random stack with a random model; one in three is absurd, and a few have textures."""
    model = random_model(rng, keep=["channels"])
    if rng.random() >= TEXTURED:
        return tried(random_stack(rng, absurd=rng.random() < 1 / 3), model, rng)
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder, "texture.png")
        image.write_bytes(pictures.png())
        return tried(textured(random_stack(rng, most=1), rng, str(image)), model, rng)


def tried(stack: vt.Stack, model: Model, rng: np.random.Generator) -> list[Failure]:
    """Failures of the BSDF of a stack."""
    case = {**described(model), "material": stack.to_dict()}
    try:
        return [Failure(kind, detail, case) for kind, detail in _found(vt.bsdf(stack, model), rng)]
    except Exception as error:
        return [Failure(f"raised {type(error).__name__}", str(error).strip().splitlines()[-1], case)]


def _found(bsdf: Any, rng: np.random.Generator) -> list[tuple[str, str]]:
    probe = Probe(bsdf)
    found: list[tuple[str, str]] = []

    # Sample from everywhere, and ask about what was drawn
    cosines = np.repeat([*COSINES, *(-c for c in COSINES)], SAMPLES)
    wi = _directions(cosines, rng)
    drawn = probe.sample(wi, rng.random((len(wi), 3), dtype=np.float32))
    asked, both = probe.eval_and_pdf(wi, drawn.wo), probe.eval_pdf(wi, drawn.wo)
    looked_at = drawn.weight.any(axis=1) & ~drawn.delta
    comparisons = {
        "density is not that of the sample": (drawn.pdf, asked.pdf),
        "weight is not value over density": (drawn.weight * drawn.pdf[:, None], asked.value),
        "eval is not eval_pdf": (asked.value, both.value),
        "pdf is not eval_pdf": (asked.pdf, both.pdf),
    }
    for kind, (a, b) in comparisons.items():
        off = _differ(a, b) & looked_at
        if off.sum() > FEW * looked_at.sum():
            at = np.flatnonzero(off)[0]
            found.append((kind, f"{off.sum()} of {looked_at.sum()}; at cosine {wi[at, 2]:g}: {a[at]} and {b[at]}"))

    # Ask about other pairs: at random, the way back, the mirror direction, straight through, at and below the horizon
    flat = wi * (1, 1, 0)
    others = (_directions(rng.uniform(-1, 1, len(wi)), rng), wi, wi * (-1, -1, 1), -wi, flat, -flat)
    there, back = np.concatenate([wi] * len(others)), np.concatenate(others)
    i, o = np.concatenate([there, back]), np.concatenate([back, there])
    values = probe.eval_pdf(i, o)
    lost = (values.pdf == 0) & (values.value.max(axis=1) > UNSEEN)
    if lost.any():
        at = np.flatnonzero(lost)[0]
        found.append(("value without density", f"{values.value[at]} for {i[at]} and {o[at]}"))
    if not (probe.two_sided or not drawn.weight[cosines < 0].any()):
        found.append(("light from below", "of what is not lit from there"))

    # Integrate densities
    if looked_at.any():
        for cosine in INTEGRATED if probe.two_sided else INTEGRATED[:1]:
            integral, error = _integral(probe, cosine, rng)
            if integral > 1 + FULL + 6 * error:
                found.append(("density integrates to more than 1", f"{integral:.4f} +- {error:.4f} at {cosine}"))

    # Say what was no number, negative, or of another length than 1
    for wrong in probe.wrong:
        kind = "direction is not of length 1" if "length" in wrong.function else "not finite, or negative"
        found.append((kind, f"{wrong.function}: {wrong.answer[0]:g} for {wrong.wi[0]} and {wrong.wo[0]}"))
    return found


def _directions(cosines: Array, rng: np.random.Generator) -> Array:
    """Directions (n, 3) of these heights, all round."""
    sine, phi = np.sqrt(1 - cosines**2), rng.uniform(0, 2 * np.pi, len(cosines))
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), cosines], axis=-1)


def _differ(a: Array, b: Array) -> Array:
    """Which rows differ (n,)."""
    off = np.abs(a - b) > OFF * np.maximum(np.abs(a), np.abs(b)) + 1e-30
    return off.reshape(len(a), -1).any(axis=1)


def _integral(probe: Probe, cosine: float, rng: np.random.Generator) -> tuple[float, float]:
    """The integral of the density over all directions, and its standard error."""
    (wi,) = _directions(np.array([cosine]), rng)
    each = np.repeat(wi[None], 2**14, axis=0)
    drawn = probe.sample(each, rng.random((len(each), 3), dtype=np.float32))
    usable = drawn.weight.any(axis=1) & ~drawn.delta
    total, variance = 0.0, 0.0
    for side in (1, -1):
        wo, areas = HemisphereGrid.around(wi, drawn.wo[usable], drawn.pdf[usable], side).nodes(rng)
        cells, errors = integrate(probe.eval_pdf(np.repeat(wi[None], len(wo), axis=0), wo).pdf * areas)
        total, variance = total + float(cells.sum()), variance + float(errors.sum())
    return total, float(np.sqrt(variance))
