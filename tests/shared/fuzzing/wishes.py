"""Random wishes to `coat`, `simplify`, `explore` and `fit`: each ends as a command line does, and no answer is nan."""

from __future__ import annotations

import numpy as np

from fuzzing import Failure, commands, targets
from fuzzing.stacks import random_stack
from velatura.model import MODELS
from velatura.stack import dumps

HOSTILE = """
nan inf -inf -0.0 -1 0 1e-400 1e-300 1e-9 0.999999 1.000001 1e9 1e400 9007199254740993 2e0 0x2 1,5 ٣
"""
ODD = 0.15  # share of numbers that are hostile
DIRECTIONS = 24  # of a table


def trial(rng: np.random.Generator) -> list[Failure]:
    """A wish of any of the four kinds."""
    return tried(str(rng.choice([*WISHES])), rng)


def tried(verb: str, rng: np.random.Generator) -> list[Failure]:
    """Failures of how a random wish of a kind ends."""
    words, inputs = WISHES[verb](rng)
    if rng.random() < 0.5:
        words += ["--model", str(rng.choice([model.name for model in MODELS]))]
    if verb != "explore":
        words += ["--json"] * (rng.random() < 0.2) + ["-o", "new.yaml"] * (rng.random() < 0.5)
    return commands.tried([verb, *words], {**commands.INPUTS, **inputs})


def _coat(rng: np.random.Generator) -> tuple[list[str], dict[str, str]]:
    words = ["material.yaml", "--eta", _number(rng, 1, 3), "--alpha", _number(rng, 0, 1)]
    return words + ["--keep-appearance"] * (rng.random() < 0.6), {"material.yaml": _material(rng)}


def _simplify(rng: np.random.Generator) -> tuple[list[str], dict[str, str]]:
    count = str(rng.integers(1, 4)) if rng.random() < 1 - ODD else _number(rng, 0, 9)
    return ["material.yaml", "--interfaces", count], {"material.yaml": _material(rng)}


def _explore(rng: np.random.Generator) -> tuple[list[str], dict[str, str]]:
    words = ["target.yaml", "--count", str(rng.integers(1, 5)), "--seed", str(rng.integers(10))]
    return words, {"target.yaml": _target(rng)}


def _fit(rng: np.random.Generator) -> tuple[list[str], dict[str, str]]:
    return ["table.csv", "target.yaml", "--starts", "1"], {
        "table.csv": _table(rng),
        "target.yaml": _target(rng),
    }


WISHES = {"coat": _coat, "simplify": _simplify, "explore": _explore, "fit": _fit}


def _target(rng: np.random.Generator) -> str:
    """A target with two lobes that most often has a stack, or any other, mutated."""
    if rng.random() < 0.5:
        return targets.mutated(rng)
    coat, (r, g, b) = 10 ** rng.uniform(-2, -1), rng.uniform(0.1, 0.7, 3)
    base = f"[{r:.3f}, {g:.3f}, {b:.3f}], alpha: {rng.uniform(0.05, 0.4):.3f}, base: conductor"
    return f"lobes:\n  - {{energy: {coat:.4f}, alpha: {rng.uniform(0, 0.2):.3f}}}\n  - {{energy: {base}}}\n"


def _number(rng: np.random.Generator, low: float, high: float) -> str:
    return str(rng.choice(HOSTILE.split())) if rng.random() < ODD else f"{rng.uniform(low, high):.6g}"


def _material(rng: np.random.Generator) -> str:
    return dumps(random_stack(rng, absurd=rng.random() < 0.3, most=3))


def _table(rng: np.random.Generator) -> str:
    """A table of reflectance about a lobe; now and then with a hostile number, or in one direction alone."""
    theta_i, theta_o = rng.uniform(0, 80, (2, DIRECTIONS if rng.random() < 0.9 else 1))
    phi = rng.choice([0.0, 90.0, 180.0], len(theta_i))
    width, height = rng.uniform(2, 40), 10 ** rng.uniform(-3, 2)
    off = np.where(phi == 180, theta_o - theta_i, np.hypot(theta_o, theta_i))
    values = np.outer(height * np.exp(-((off / width) ** 2)) + rng.uniform(0, 0.3), rng.uniform(0, 1, 3))
    if rng.random() < 0.2:
        values[:] = rng.choice([0.0, 1e-30, 1e30, 0.3])
    rows = [[f"{x:.6g}" for x in (*angles, *row)] for *angles, row in zip(theta_i, theta_o, phi, values)]
    if rng.random() < 2 * ODD:
        rows[rng.integers(len(rows))][rng.integers(6)] = str(rng.choice(HOSTILE.split()))
    return "\n".join(["theta_i,theta_o,phi,r,g,b", *map(",".join, rows)]) + "\n"
