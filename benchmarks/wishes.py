"""How near the answers to further wishes are, by random walks, to what was asked for.

    python benchmarks/wishes.py [--kinds grazing passed body film mixture] [--wishes 10] [--paths 100000] [--seed 0]

Wishes are what another random stack of the same form shows: energies at a second angle of another stack with the same
lobes, what a pane of another tint and blur passes, the colours of another base, of another thickness, and of other
weights. So each has an answer, though the search may not find it. Prints, for each kind, quantiles of how far the walk
through the answer is from what was asked, relative to it, and of the processor's time of an answer. A film is held
against the nearest colour, which the answer states. Fails if half of the energies of a kind are more than 2 %
away, or half of the roughnesses more than 5 %.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rows import parsed, row

from velatura import reference
from velatura.inverse import Infeasible, Target, alternatives, answer
from velatura.inverse.wishes.mixture import MixtureColour
from velatura.inverse.wishes.passed import haze
from velatura.model import named
from velatura.model.registry import stack_lobes
from velatura.reference import batches
from velatura.stack import Diffuse, Interface, Medium, Mix, Stack
from velatura.stack.values import Film

MODEL = "velatura"
BOUNDS = {"energy": 0.02, "alpha": 0.05}
FAINT = 0.01  # energy that the noise of walks leaves visible


def colour(rng: np.random.Generator, low: float, high: float) -> tuple[float, float, float]:
    r, g, b = rng.uniform(low, high, 3).tolist()
    return r, g, b


def shown(stack: Stack, angle: float) -> Any:
    return stack_lobes(stack, np.cos(np.radians(angle)), model=MODEL)


def grazing(rng: np.random.Generator) -> dict[str, Any]:
    """The energy at 60 to 80 degrees of another member of the class of a pair, above metal in half of the wishes."""
    lobes: list[dict[str, Any]] = [{"energy": rng.uniform(0.1, 0.3), "alpha": rng.uniform(0, 0.2), "interfaces": 2}]
    if rng.random() < 0.5:
        alpha = rng.uniform(0.25, 0.4)
        lobes.append({"energy": colour(rng, 0.05, 0.3), "alpha": alpha, "base": "conductor"})
    angle = float(rng.uniform(60, 80))
    other = alternatives(lobes, 6, MODEL, int(rng.integers(2**31)))[-1].stack
    seen = shown(other, angle)
    energy = np.sum(seen.energy, axis=0)[:, 0] + seen.remainder[:, 0]
    return {"lobes": lobes, "grazing": {"angle": angle, "energy": tuple(energy.tolist())}}


def pane(rng: np.random.Generator) -> Stack:
    smooth = rng.uniform(0.02, 0.25)
    layers = [Interface(eta=rng.uniform(1.3, 1.8), alpha=smooth), Medium(depth=1.0, sigma_a=colour(rng, 0, 1))]
    return Stack([*layers, Interface(eta=1.0, alpha=smooth)])


def passed(rng: np.random.Generator) -> dict[str, Any]:
    """The tint and the blur of another pane of the same index."""
    present, other = pane(rng), pane(rng)
    seen = shown(other.replace(layer0_eta=present.interfaces[0].eta), 0)
    energy, alpha = tuple(seen.passed[:, 0].tolist()), float(seen.transmitted.alpha.mean())
    return {"start": present, "passed": {"energy": energy, "alpha": alpha}}


def body(rng: np.random.Generator) -> dict[str, Any]:
    """The colour of another base under the same coat, half of them under a medium that scatters."""
    layers: list[Any] = [Interface(eta=rng.uniform(1.3, 1.8), alpha=rng.uniform(0, 0.3))]
    if rng.random() < 0.5:
        layers.append(Medium(depth=1.0, sigma_a=0.1, sigma_s=rng.uniform(0.1, 1.0), g=rng.uniform(-0.5, 0.5)))
    present, other = (Stack([*layers, Diffuse(albedo=colour(rng, 0.05, 0.9))]) for _ in range(2))
    angle = float(rng.uniform(0, 60))
    return {"start": present, "body": {"angle": angle, "energy": tuple(shown(other, angle).remainder[:, 0].tolist())}}


def film(rng: np.random.Generator) -> dict[str, Any]:
    """The colour of another thickness of a film on a metal."""

    def filmed() -> Stack:
        film = Film(eta=eta, thickness_nm=rng.uniform(20, 400))
        return Stack([Interface(eta=(2.7, 2.5, 2.2), k=(3.8, 3.4, 3.0), alpha=0.1, films=(film,))])

    eta = rng.uniform(1.4, 2.6)
    present, other = filmed(), filmed()
    return {"start": present, "film": {"energy": tuple(np.sum(shown(other, 0).energy, axis=0)[:, 0].tolist())}}


def mixture(rng: np.random.Generator) -> dict[str, Any]:
    """The colour of other weights of two coated bases and a metal."""
    coated = [
        Stack([Interface(eta=rng.uniform(1.3, 1.8), alpha=rng.uniform(0, 0.3)), Diffuse(albedo=colour(rng, 0.05, 0.9))])
        for _ in range(2)
    ]
    parts = [*coated, Stack([Interface(eta=colour(rng, 0.2, 2.0), k=3.0, alpha=rng.uniform(0.05, 0.3))])]
    present, other = (Mix(zip(rng.dirichlet(np.ones(3)).tolist(), parts)) for _ in range(2))
    angle = float(rng.uniform(0, 60))
    wish = MixtureColour(energy=0.5, angle=angle).had_by(other, named(MODEL))
    return {"start": present, "mixture": wish.to_dict()}


KINDS: dict[str, Callable[[np.random.Generator], dict[str, Any]]] = {
    "grazing": grazing,
    "passed": passed,
    "body": body,
    "film": film,
    "mixture": mixture,
}


def walked(kind: str, stack: Stack | Mix, angle: float, paths: int, seed: int) -> dict[str, Any]:
    """Energy (3,) and roughness of what a wish is about, by walks."""
    if isinstance(stack, Mix):
        each = (share * walked(kind, part, angle, paths, seed)["energy"] for share, part in stack.weighted(""))
        return {"energy": sum(each)}
    found = reference.statistics(stack, np.cos(np.radians(angle)), paths=paths, seed=seed, microsurface=True)
    if kind == "passed":
        assert found.transmitted
        energy = found.transmitted.energy[:, 0]
        return {"energy": energy, "alpha": found.transmitted.alpha.mean(), "haze": walked_haze(stack, paths, seed)}
    energy = np.sum(found.energy, axis=0)[:, 0]
    if kind == "body":  # walks count it for the surface below it
        energy = energy - np.sum(shown(stack, angle).energy, axis=0)[:, 0]
    return {"energy": energy}


def walked_haze(stack: Stack, paths: int, seed: int) -> float:
    """Share of the light passing at normal incidence that is turned by more than 2.5 degrees, by walks."""
    ends = batches.ends(stack, np.array([0.0, 0.0, 1.0]), paths, seed, True, False)
    passed, weight = ends.w[2] < 0, ends.weight.mean(axis=0)
    turned = passed & (ends.w[2] > -np.cos(np.radians(2.5)))
    return float(weight[turned].sum() / weight[passed].sum())


def main() -> int:
    options = parsed(__doc__, kinds=(list(KINDS), "of wishes", list(KINDS)), wishes=10, paths=100_000, seed=0)
    failed = False
    for kind in options.kinds:
        rng, times, refused = np.random.default_rng(options.seed), list[float](), 0
        apart: dict[str, list[float]] = {"energy": [], "alpha": []}
        hazes: list[float] = []
        for n in range(options.wishes):
            wish = Target(**KINDS[kind](rng))
            begun = time.process_time()
            try:
                found = answer(wish, MODEL)
            except Infeasible:
                refused += 1
                continue
            times.append(time.process_time() - begun)
            (asked,) = getattr(found.reached if kind == "film" else wish, kind)
            has = walked(kind, found.stack, asked.angle, options.paths, n)
            energy = np.broadcast_to(asked.energy, 3)
            apart["energy"] += np.abs(has["energy"] / energy - 1)[energy > FAINT].tolist()
            if "alpha" in has:
                apart["alpha"].append(abs(has["alpha"] / asked.alpha - 1))
                hazes.append(abs(has["haze"] - haze(asked.alpha)))
        for key, off in apart.items():
            if off:
                row("wishes", f"{kind}: {key} off by", [100 * x for x in off], "%", f"{100 * max(off):.1f} at most")
                failed |= float(np.median(off)) > BOUNDS[key]
        if hazes:
            row("wishes", f"{kind}: haze off by", hazes, "", f"{max(hazes):.3f} at most")
        row("wishes", f"{kind}: an answer", times, remark=f"{max(times):.1f} at most; {refused} refused")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
