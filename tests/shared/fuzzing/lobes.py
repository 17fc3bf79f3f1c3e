"""Random stacks through `vt.lobes`: numbers that must be finite, energy that must not grow, and continuity."""

from __future__ import annotations

import time
import warnings
from typing import Any

import numpy as np

import velatura as vt
from fuzzing import Failure
from fuzzing.filmed import filmed
from fuzzing.models import described, random_model
from fuzzing.stacks import random_stack
from velatura.model.base import Model
from velatura.model.lobe_statistics import StackLobes

FILMED = 0.02  # share of stacks with thin films, which take longer
SLOW = 8.0  # seconds of processor time that no stack may take, far above what most do: clocks of busy machines err
COSINES = (1.0, 0.9, 0.7, 0.5, 0.2, 0.03, 1e-3, 1e-6)
GAIN = 1e-3  # of energy, by which tables may err
STEP = 1e-6  # relative change of one value,
JUMP = 1e-3  # the change of an energy that it must not make,
JUMP_APART = 0.05  # nor where equal indices come apart: tables err by .001 there, and light that is trapped repeats it,
STEADY = 6  # at the first so many cosines: at grazing, equal indices that come apart do reflect all


def trial(rng: np.random.Generator) -> list[Failure]:
    """One random stack with a random model; half of them absurd."""
    absurd = rng.random() < 0.5
    stack, model = random_stack(rng, absurd), random_model(rng)
    if rng.random() < FILMED:
        stack = filmed(stack, rng, absurd)
    return tried(stack, model, rng, continuous=not absurd)


def tried(stack: vt.Stack, model: Model, rng: np.random.Generator, continuous: bool = True) -> list[Failure]:
    """Failures of the lobes of a stack."""
    case: dict[str, Any] = {**described(model), "material": stack.to_dict()}
    phi = rng.uniform(-np.pi, np.pi, len(COSINES))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            start = time.thread_time()
            found = vt.lobes(stack, COSINES, phi, model)
            seconds = time.thread_time() - start
            wrong = _wrong(found)
            if seconds > SLOW:
                wrong.append(("slow", f"{seconds:.1f} s of processor time"))
            if continuous and not wrong and (name := _changeable(stack, rng)):
                value: Any = stack.flat()[name]
                changed = stack.replace(**{name: value * (1 + STEP)})
                jump = np.abs(_energies(vt.lobes(changed, COSINES, phi, model)) - _energies(found)).max(initial=0)
                if jump > (JUMP_APART if _equal_to_another(stack, name) else JUMP):
                    wrong.append(("energy jumps", f"by {jump:.3g} when {name} changes by {STEP:g}"))
    except Exception as error:
        wrong = [(f"raised {type(error).__name__}", str(error))]
    return [Failure(kind, detail, case) for kind, detail in wrong]


def _wrong(found: StackLobes) -> list[tuple[str, str]]:
    lobes = {field: list(getattr(found, field)) for field in ("energy", "covariance", "alpha", "rotation")}
    if found.transmitted:
        lobes = {field: [*values, getattr(found.transmitted, field)] for field, values in lobes.items()}
    wrong = []
    for field, values in lobes.items():
        if not all(np.isfinite(value).all() for value in values):
            wrong.append((f"{field} is not finite", ""))
    least = min((value.min() for value in lobes["energy"]), default=0.0)
    if least < 0:
        wrong.append(("negative energy", f"{least:.3g}"))
    total = sum(lobes["energy"], np.zeros((3, len(COSINES))))
    if total.max() > 1 + GAIN:
        cosine = COSINES[int(total.max(axis=0).argmax())]
        wrong.append(("more energy than arrives", f"{total.max():.6g} at cosine {cosine:g}"))
    alphas = np.array([extreme for value in lobes["alpha"] for extreme in (value.min(), value.max())])
    if len(alphas) and not (alphas.min() >= 0 and alphas.max() <= 1):
        wrong.append(("alpha beyond 0 to 1", f"{alphas.min():.6g} to {alphas.max():.6g}"))
    return wrong


def _energies(found: StackLobes) -> np.ndarray:
    energies = [*found.energy, *([found.transmitted.energy] if found.transmitted else [])]
    return np.array([energy[:, :STEADY] for energy in energies])


def _changeable(stack: vt.Stack, rng: np.random.Generator) -> str | None:
    """A value that may be changed: a number above 0, and not the end of a range."""
    names = [k for k, v in stack.flat().items() if isinstance(v, float) and v > 0 and (v < 1 or "alpha" not in k)]
    names = [k for k in names if not (k.endswith("albedo") and stack.flat()[k] == 1)]
    return str(rng.choice(names)) if names else None


def _equal_to_another(stack: vt.Stack, name: str) -> bool:
    """Whether a value is an index that another medium has as well."""
    if not name.endswith(("eta", "exterior")):
        return False
    indices = [value for key, value in stack.flat().items() if key.endswith(("eta", "exterior"))]
    return indices.count(stack.flat()[name]) > 1
