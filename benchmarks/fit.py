"""Whether `fit` recovers stacks of three and four layers from walks with noise.

    python benchmarks/fit.py [--cases 10] [--seed 0] [--model velatura] [--noise 0.03] [--samples 4096] [--first 0]

Of each random stack a table is walked, with noise in proportion to every value. Descents start from stacks with lobes
that are up to a quarter off. The stack that is found must approximate the table at least as well as the true one does
by the model, and nine in ten of the true values must lie in their intervals of 95 %.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np
from rows import parsed

import velatura as vt
from velatura.checks import Probe
from velatura.inverse import Directions, Fit, Infeasible, ReflectanceTable, fit_target
from velatura.inverse.fitting.angles import compressed, table_of
from velatura.model import DEFAULT
from velatura.stack import Stack

JITTER = 1e-4  # of directions, so that a walk begins anew
AS_WELL = 1.02  # ratio of errors that count as alike
SHARE = 0.9  # of the true values


def drawn(rng: np.random.Generator) -> Stack:
    """A random stack: a coat, absorption, a metal, and with four layers another interface."""

    def rough(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    layers: list[dict[str, Any]] = [{"interface": {"eta": float(rng.uniform(1.3, 1.8)), "alpha": rough(0.08, 0.2)}}]
    if rng.uniform() < 0.5:
        eta = float(layers[0]["interface"]["eta"] * rng.uniform(1.15, 1.4))
        layers.append({"interface": {"eta": eta, "alpha": rough(0.1, 0.3)}})
    layers.append({"medium": {"sigma_a": rng.uniform(0, 0.5, 3).tolist(), "depth": 1.0}})
    metal = {"eta": rng.uniform(0.3, 1.5, 3).tolist(), "k": rng.uniform(2, 5, 3).tolist()}
    layers.append({"interface": {**metal, "alpha": rough(0.15, 0.4)}})
    return Stack.from_dict({"layers": layers})


def walked(stack: Stack, directions: Directions, samples: int, rng: np.random.Generator) -> np.ndarray:
    """f(wi, wo) by walks, with facets that are met often, (3, N)."""
    probe = Probe(vt.bsdf(stack, "reference", microsurface=True))
    total = np.zeros(directions.wo.shape)
    chunk = 64
    for _ in range(samples // chunk):
        wi, wo = (np.repeat(w.T, chunk, axis=0) for w in (directions.wi, directions.wo))
        wi, wo = (w + JITTER * rng.standard_normal(w.shape) for w in (wi, wo))
        wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
        value = probe.eval_pdf(wi, wo).value.reshape(len(directions.theta_i), chunk, 3)
        total += value.mean(axis=1).T
    return total / (samples // chunk) / directions.wo[2]


def guess(stack: Stack, model: str, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Its lobes at normal incidence, up to a quarter off, as a target."""
    found, lobes = vt.lobes(stack, 1.0, model=model), []

    def off(x: Any) -> Any:
        return x * np.exp(rng.uniform(-0.25, 0.25))

    for k, layer in enumerate(stack.interfaces):
        energy, alpha = off(found.energy[k][:, 0]), float(min(off(found.alpha[k][0, 0]), 0.9))
        lobes.append({"energy": float(energy.mean()) if k == 0 else tuple(energy.tolist()), "alpha": alpha})
        lobes[-1]["base"] = "conductor" if layer.opaque else "dielectric"
    return lobes


def held(found: Fit, true: Stack) -> list[tuple[str, bool]]:
    """Which of the true values lie in their intervals."""
    rows, flat, number = [], true.flat(), {place: n for n, place in enumerate(places(true))}
    for one in found.estimates:
        name, _, channel = one.name.partition(" ")
        layer, _, key = name.removeprefix("layer").partition("_")
        n = number.get(places(found.stack)[int(layer)])
        value = (
            0.0 if n is None else flat[f"layer{n}_{key}" + "_u" * (key == "alpha")]
        )  # a medium that is clear in truth
        own = float(np.broadcast_to(np.array(value, float), 3)["rgb".find(channel) if channel else 0])
        rows.append((one.name, one.low <= own <= one.high))
    return rows


def places(stack: Stack) -> list[tuple[str, int]]:
    """The kind of every layer, and below how many interfaces it lies."""
    found, above = [], 0
    for layer in stack.layers:
        found.append((layer.kind, above))
        above += layer.surface
    return found


def recovered(
    case: int, seed: int = 0, model: str = DEFAULT, noise: float = 0.03, samples: int = 4096, starts: int = 4
) -> tuple[Stack, Fit, float]:
    """A random stack, the fit to its walks with noise, and the error of the stack itself."""
    rng = np.random.default_rng((seed, case))
    true, directions = drawn(rng), Directions.about_lobes(False)
    value = walked(true, directions, samples, rng)
    table = ReflectanceTable(directions, value * (1 + noise * rng.standard_normal(value.shape)))
    found = fit_target(table, guess(true, model, rng), starts, model)
    own, wanted = (compressed(t.value * directions.wo[2]) for t in (table_of(true, directions, model), table))
    return true, found, float(np.sqrt(np.mean((own - wanted) ** 2)))


def main() -> int:
    options = parsed(
        __doc__,
        cases=10,
        first=(0, "number of the first case"),
        seed=0,
        model=DEFAULT,
        noise=0.03,
        samples=(4096, "walks for each pair of directions"),
    )

    worse, refused, inside = 0, 0, list[tuple[str, bool]]()
    for case in range(options.first, options.first + options.cases):
        start = time.process_time()
        try:
            true, found, error = recovered(case, options.seed, options.model, options.noise, options.samples)
        except Infeasible as error_of_guess:
            print(f"case {case}: the guess has no stack, {error_of_guess.why}", flush=True)
            refused += 1
            continue
        rows = held(found, true)
        worse += found.error > AS_WELL * error
        inside += rows
        outside = ", ".join(name for name, within in rows if not within) or "none"
        print(
            f"case {case}: {len(true.layers)} layers, error {found.error:.4f} (the true stack: {error:.4f}; starts: "
            f"{', '.join(f'{x:.4f}' for x in found.errors)}), outside: {outside}; {time.process_time() - start:.0f} s",
            flush=True,
        )
    share = float(np.mean([within for _, within in inside]))
    print(
        f"{options.model}: {worse} of {options.cases - refused} fits are worse than the true stack; {share:.1%} of",
        end=" ",
    )
    print(f"{len(inside)} true values lie in their intervals (bound {SHARE:.0%})")
    return int(worse > 0 or share < SHARE)


if __name__ == "__main__":
    sys.exit(main())
