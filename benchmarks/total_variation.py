"""Total variation between the light of models and of random walks, beside the best that a sum of GGX lobes can do.

    python benchmarks/total_variation.py [--stacks 18] [--paths 3000000] [--seed 77] [--truth FOLDER]

Stacks are those of `calibrate.py`, cosines 1, .7 and .35; facets are met once. Total variation is half the sum of the
absolute differences over 40 by 40 bins of the projected disc, over the true energy. The best sum has one lobe per
interface about the mirror direction, whose energy and two roughnesses are searched for from where `velatura` has them.
FOLDER keeps the walks, one file for each choice of stacks, paths and seed.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from calibrate import random_stack
from numpy.typing import NDArray
from rich.progress import track
from scipy.optimize import minimize, nnls

import velatura as vt
from velatura.comparison.evaluated_lobes import account
from velatura.model.models import named
from velatura.optics import ggx
from velatura.reference.distribution import BINS
from velatura.stack import Stack

Array = NDArray[np.floating]

COSINES = (1.0, 0.7, 0.35)
SAMPLES = 1 << 14  # of each lobe in the search
OURS: dict[str, dict[str, Any]] = {
    "velatura": {"model": "velatura", "reflectance": "fgd"},
    "velatura (symmetric)": {"model": "velatura", "reflectance": "fgd", "form": "symmetric"},
}
PUBLISHED: dict[str, dict[str, Any]] = {
    "bati2021": {"model": "bati2021", "reflectance": "fgd"},
    "bati2021 (symmetric)": {"model": "bati2021", "reflectance": "fgd", "form": "symmetric"},
    "belcour2018 (fgd)": {"model": "belcour2018", "reflectance": "fgd"},
    "belcour2018 (fgd, symmetric)": {"model": "belcour2018", "reflectance": "fgd", "form": "symmetric"},
    "belcour2018 (fresnel, no TIR)": {"model": "belcour2018", "reflectance": "fresnel", "tir": "off"},
    "weier2020": {"model": "weier2020"},
}
BEST = "best sum of lobes"


def walked(count: int, paths: int, seed: int, folder: Path | None) -> tuple[list[Stack], list[Array]]:
    """Random stacks, and the true energies (3, N, bins, bins) of each, from the folder where they are there."""
    rng = np.random.default_rng(seed)
    stacks = [random_stack(rng, i) for i in range(count)]
    file = folder / f"total-variation-{count}-{paths}-{seed}.npz" if folder else None
    if file and file.exists():
        with np.load(file) as kept:
            return stacks, list(kept["energy"])
    truths = [
        vt.reference.distribution(stack, COSINES, 0.0, paths, seed=5).reflected
        for stack in track(stacks, description="walking")
    ]
    if file:
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(file, energy=np.array(truths))
    return stacks, truths


def apart(found: Array, true: Array) -> Array:
    """Total variation, of shape (N,), of energies (3, N, bins, bins), mean of the colours."""
    p, q = found.mean(axis=0), true.mean(axis=0)
    return np.asarray(0.5 * np.abs(p - q).sum(axis=(1, 2)) / q.sum(axis=(1, 2)))


def best(stack: Stack, cosine: float, true: Array) -> float:
    """The least total variation found for a sum of lobes, against energies (bins, bins); energies by least squares."""
    lobes = vt.lobes(stack, cosine, model="velatura", reflectance="fgd")
    start = np.log(np.clip(np.array([alpha[:, 0] for alpha in lobes.alpha]), 5e-3, 1))
    rotation = [turn[0] for turn in lobes.rotation]
    wi = (np.sqrt(1 - cosine**2), 0.0, cosine)
    total = true.sum()

    def drawn(x: Array) -> Array:
        return np.array([_histogram(wi, *np.exp(pair), turn) for pair, turn in zip(x.reshape(-1, 2), rotation)])

    def distance(x: Array) -> float:
        if np.any(x > 0.3) or np.any(x < np.log(1e-3)):
            return 1.0
        lobes = drawn(x).reshape(len(rotation), -1)
        energy, _ = nnls(lobes.T, true.ravel())
        return float(0.5 * np.abs(energy @ lobes - true.ravel()).sum() / total)

    found = minimize(distance, start.ravel(), method="Nelder-Mead", options={"maxfev": 60 * start.size, "xatol": 1e-2})
    return min(float(found.fun), distance(start.ravel()))


def _histogram(wi: tuple[float, float, float], alpha_u: float, alpha_v: float, rotation: float) -> Array:
    i = np.arange(SAMPLES)
    u_1, u_2 = (0.5 + i * 0.7548776662466927) % 1, (0.5 + i * 0.5698402909980532) % 1
    local = ggx.rotate(wi, rotation)
    wo = ggx.reflect(local, ggx.sample_visible(local, alpha_u, alpha_v, u_1, u_2))
    weight = np.where(wo[2] > 0, ggx.masking(wo, alpha_u, alpha_v), 0) / SAMPLES
    x, y, _ = ggx.rotate(wo, -rotation)
    x, y = (np.clip((0.5 * (p + 1) * BINS).astype(int), 0, BINS - 1) for p in (x, y))
    return np.bincount(x * BINS + y, weight, BINS * BINS).reshape(BINS, BINS)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stacks", type=int, default=18)
    parser.add_argument("--paths", type=int, default=3_000_000)
    parser.add_argument("--seed", type=int, default=77)
    parser.add_argument("--truth", type=Path, help="folder that keeps the walks")
    options = parser.parse_args()

    stacks, truths = walked(options.stacks, options.paths, options.seed, options.truth)
    models = {name: named(**choices) for name, choices in (OURS | PUBLISHED).items()}
    rows: dict[str, list[Any]] = {name: [] for name in models} | {BEST: []}
    for stack, true in track(list(zip(stacks, truths)), description="comparing"):
        for name, model in models.items():
            rows[name].append(apart(account(stack, COSINES, model).distribution, true))
        rows[BEST].append([best(stack, c, true[:, i].mean(axis=0)) for i, c in enumerate(COSINES)])
    print(f"{'total variation':32s}" + "".join(f"{c:>9g}" for c in COSINES) + "     mean    worst")
    for name, each in rows.items():
        values = np.array(each)
        cells = "".join(f"{x:9.3f}" for x in values.mean(axis=0))
        print(f"{name:32s}{cells}{values.mean():9.3f}{values.max():9.3f}")

    # Compare with the best published model: differences by stack, since all models see the same ones
    mean = {name: np.mean(each, axis=1) for name, each in rows.items()}
    rival = min(PUBLISHED, key=lambda name: mean[name].mean())
    for name in OURS:
        less = mean[rival] - mean[name]
        way = less.mean() / (mean[rival] - mean[BEST]).mean()
        print(
            f"{name}: less than {rival} by {less.mean():.3f} +- {less.std(ddof=1) / np.sqrt(less.size):.3f}, "
            f"on {np.sum(less > 0)} of {less.size} stacks; {way:.0%} of the way to the best sum"
        )


if __name__ == "__main__":
    main()
