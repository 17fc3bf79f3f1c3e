"""How near the stacks of the inverse are, by random walks, to the lobes that were asked for.

    python benchmarks/inverse_walk.py [--paths 100000] [--models bati2021 velatura] [--wishes 60] [--seed 0]

The targets are those of figures 15 to 20 of Bati et al. 2021; each model finds its own stacks. Prints the table of the
manual: energies and alphas asked, those of the walk through the stacks of each model, and the mean deviations. Then,
of random wishes of `benchmarks/refusals.py` that have a stack, here of up to three interfaces a lobe, quantiles of the
deviations of what is visible, again after every ten wishes. With `velatura` half of the energies must be within 1 % of
what was asked, and half of the roughnesses within 4 %. Wishes beyond lobes are walked by `benchmarks/wishes.py`.
"""

from __future__ import annotations

import sys
from functools import partial
from itertools import islice

import numpy as np
from refusals import wish
from rows import counted, parsed

from velatura.figures import bati2021_25
from velatura.figures.bati2021_targets import FIGURES
from velatura.inverse import invert
from velatura.inverse.lobes.target import MOST_INTERFACES
from velatura.model import DEFAULT, named

SEEN = 0.01  # energy that the noise of walks leaves visible
FAR = (0.1, 0.15)  # deviations that are printed each
FIRST, LAST = 15, 20
BOUNDS = (0.01, 0.04)  # of energies and roughnesses, relative, at the median
QUANTILES = (0.5, 0.9, 1.0)
EVERY = 10  # wishes after which what is known so far is printed


def numbers(values: list[float]) -> str:
    """Three digits of a colour, once where it is grey."""
    written = [f"{value:.3f}".removeprefix("0") for value in values]
    return written[0] if len(set(written)) == 1 else ", ".join(written)


def width(alpha: float) -> str:
    return f"{alpha:.4f}".removeprefix("0") if alpha else "0"


def wished(count: int, seed: int, model: str, paths: int) -> tuple[list[float], list[float]]:
    """Relative deviations of energies, by channel, and of roughnesses, of lobes of random wishes; prints them."""
    rng, energies, alphas = np.random.default_rng(seed), list[float](), list[float]()
    targets = iter(partial(wish, rng, interfaces=MOST_INTERFACES), None)
    found = ((target, invert.search(target, named(model))) for target in targets)
    met = ((target, solution.stack) for target, solution in found if solution and not solution.reached)
    for n, (target, stack) in enumerate(counted(islice(met, count), count, "wishes")):
        for row, _ in bati2021_25.compared(target, stack, model, paths, count - 1 - n):
            asked, asked_alpha = np.array(row["energy"]["expected"]), row["alpha"]["expected"]
            energy = np.abs(row["energy"]["walk"] / asked - 1)[asked > SEEN]
            alpha = [abs(row["alpha"]["walk"] / asked_alpha - 1)] if asked_alpha and asked.mean() > SEEN else []
            energies += energy.tolist()
            alphas += alpha
            if max([0, *energy]) > FAR[0] or max([0, *alpha]) > FAR[1]:
                print(f"far: {row}\n  of {target.to_dict()['lobes']}", flush=True)
        if (n + 1) % EVERY == 0 or n + 1 == count:
            each = " and ".join(", ".join(f"{100 * q:.1f}" for q in quantiles(x)) for x in (energies, alphas))
            counts = f"{n + 1} wishes, {len(energies)} and {len(alphas)} energies and alphas"
            print(f"{model}, {counts}: {each} % (medians, nine in ten, all)", flush=True)
    return energies, alphas


def quantiles(x: list[float]) -> list[float]:
    """Those that are printed, NaN of nothing."""
    return np.quantile(x or [np.nan], QUANTILES).tolist()


def table(models: list[str], paths: int) -> None:
    """Print the table of the manual."""
    targets = [name for name in FIGURES if FIRST <= int(name.split()[0]) <= LAST]
    rows = {m: bati2021_25.compute(targets, paths, model=m)["rows"] for m in models}
    each = " | ".join(models)
    print(f"| figure: lobe | energy asked | {each} | alpha asked | {each} |")
    print("|---" * (3 + 2 * len(rows)) + "|")
    apart: dict[str, list[list[float]]] = {m: [[], []] for m in rows}
    for same in zip(*rows.values()):
        asked_energy, asked = same[0]["energy"]["expected"], same[0]["alpha"]["expected"]
        energies = " | ".join(numbers(row["energy"]["walk"]) for row in same)
        alphas = " | ".join(width(row["alpha"]["walk"]) for row in same)
        name = f"{same[0]['target']}: {same[0]['lobe']}"
        print(f"| {name} | {numbers(asked_energy)} | {energies} | {width(asked)} | {alphas} |")
        for model, row in zip(rows, same):
            apart[model][0].append(float(np.abs(np.divide(row["energy"]["walk"], asked_energy) - 1).mean()))
            if asked:
                apart[model][1].append(abs(row["alpha"]["walk"] / asked - 1))
    energy, blur = (" | ".join(f"{100 * np.mean(apart[m][n]):.1f} %" for m in rows) for n in (0, 1))
    print(f"| mean deviation |  | {energy} |  | {blur} |")


def main() -> int:
    wishes, figures = (60, "at random, beside those of figures"), (True, "with the table of these")
    models, seed = ["bati2021", "velatura"], (0, "of the wishes")
    options = parsed(__doc__, paths=400_000, models=models, wishes=wishes, figures=figures, seed=seed)
    if options.figures:
        table(options.models, options.paths)

    failed = False
    for model in options.models if options.wishes else ():
        off = wished(options.wishes, options.seed, model, options.paths)
        failed |= model == DEFAULT and any(quantiles(x)[0] > bound for x, bound in zip(off, BOUNDS))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
