"""How near the stacks of the inverse are, by random walks, to the lobes that were asked for.

    python benchmarks/inverse_walk.py [--paths 100000] [--models bati2021 velatura]

The targets are those of figures 15 to 20 of Bati et al. 2021; each model finds its own stacks. Prints the table of the
manual: energies and alphas asked, those of the walk through the stacks of each model, and the mean deviations.
"""

from __future__ import annotations

import argparse

import numpy as np

from velatura.figures import bati2021_25
from velatura.inverse.figure_targets import FIGURES

FIRST, LAST = 15, 20


def numbers(values: list[float]) -> str:
    """Three digits of a colour, once where it is grey."""
    written = [f"{value:.3f}".removeprefix("0") for value in values]
    return written[0] if len(set(written)) == 1 else ", ".join(written)


def width(alpha: float) -> str:
    return f"{alpha:.4f}".removeprefix("0") if alpha else "0"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--paths", type=int, default=100_000)
    parser.add_argument("--models", nargs="+", default=["bati2021", "velatura"])
    options = parser.parse_args()

    targets = [name for name in FIGURES if FIRST <= int(name.split()[0]) <= LAST]
    rows = {m: bati2021_25.compute(targets, options.paths, model=m)["rows"] for m in options.models}
    each = " | ".join(options.models)
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


if __name__ == "__main__":
    main()
