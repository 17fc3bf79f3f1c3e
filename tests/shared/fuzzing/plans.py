"""Mutated plans of sweeps: refused in one line that names the file, or points of it, and what is asked, are made."""

from __future__ import annotations

import tempfile
import traceback
from pathlib import Path

import numpy as np

from fuzzing import Failure, files
from velatura.errors import InvalidInput, VelaturaError
from velatura.sweeps import load_plan

PLANS = (
    "material: coated-gold\nvary:\n  layer0_alpha: {range: [0.01, 0.5]}\n  layer1_sigma_a: {range: [0.1, 3.0], "
    "distribution: log-uniform, per_channel: true}\n  layer2_conductor: {values: [Au, Cu]}\n"
    "sampling: sobol\ncount: 100\nwhat: lobes\noptions: {cos_theta: [1, 0.5]}\nchunk: 7\n",
    "material: bare-gold\nvary:\n  layer0_alpha: {range: [0.01, 0.5], steps: 4}\n  layer0_rotation: {values: [0, 30]}\n"
    "what: albedo\noptions: {cos_theta: 0.7, model: belcour2018, tir: off}\nseed: 3\n",
    "material: [{interface: {eta: 1.5}}]\nvary:\n  layer0_eta: {distribution: normal, mean: 1.5, std: 0.2}\n"
    "sampling: random\ncount: 3\nwhat: statistics\noptions: {cos_theta: 1, paths: 10}\n",
)


def trial(rng: np.random.Generator) -> list[Failure]:
    """A plan with one to three changes of its text."""
    text = PLANS[rng.integers(len(PLANS))]
    for _ in range(rng.integers(1, 4)):
        text = files.changed(text, rng)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "plan.yaml")
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        wrong = _wrong(path)
    return [Failure(*wrong, {"plan": text})] if wrong else []


def _wrong(path: Path) -> tuple[str, str] | None:
    try:
        plan = load_plan(path)
        numbers = [0, int(np.prod(plan.shape)) - 1]
    except InvalidInput as error:
        message = str(error)
        return None if message.startswith(f"{path}: ") and "\n" not in message else ("refused otherwise", message[:300])
    except Exception:
        return "traceback", traceback.format_exc().splitlines()[-1]
    try:
        for values in plan.points(numbers):
            plan.stack(values)
    except VelaturaError:  # a point may fail, which its reason says
        pass
    except Exception:
        return "traceback of a point", traceback.format_exc().splitlines()[-1]
    return None
