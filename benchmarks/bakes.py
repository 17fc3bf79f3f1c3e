"""What the presets lose as parameters of other programs: the tables of docs/how-to/bakes.md.

    python benchmarks/bakes.py [--presets NAME ...] [--targets NAME ...]

For each preset and target: total variation in percent of the reflected light, the mean over cosines of incidence 1, .7
and .35, and the greatest error of the albedo, over colours and cosines; of panes, in brackets, also that of the light
that passes.
Then means over presets, and CPU seconds for each target. Every preset takes four seconds in all.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np

import velatura as vt
from velatura.bakes import TARGETS, Bake, bake


def cell(made: Bake) -> str:
    """The loss of a bake, as an entry of the table."""
    passed = np.abs(made.baked_passed - made.passed).max()
    below = f" ({passed:.2f})" if made.passed.any() else ""
    return f"{100 * made.total_variation.mean():.1f} / {np.abs(made.baked_albedo - made.albedo).max():.2f}{below}"


def rows(presets: Sequence[str], targets: Sequence[str]) -> tuple[list[list[str]], dict[str, list[tuple[Bake, float]]]]:
    """Rows of the table, and by target every bake with its CPU seconds."""
    table: list[list[str]] = []
    made: dict[str, list[tuple[Bake, float]]] = {target: [] for target in targets}
    for preset in presets:
        row = [vt.preset(preset).name]
        for target in targets:
            start = time.process_time()
            found = bake(preset, target)
            made[target].append((found, time.process_time() - start))
            row.append(cell(found))
        table.append(row)
    return table, made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--presets", nargs="+", default=vt.presets())
    parser.add_argument("--targets", nargs="+", default=list(TARGETS), choices=list(TARGETS))
    args = parser.parse_args()
    table, made = rows(args.presets, args.targets)
    print(f"| preset | {' | '.join(TARGETS[target].title for target in args.targets)} |")
    print("|---" * (len(args.targets) + 1) + "|")
    for row in table:
        print(f"| {' | '.join(row)} |")
    print()
    for target, each in made.items():
        variation = 100 * np.array([found.total_variation.mean() for found, _ in each])
        albedo = np.array([np.abs(found.baked_albedo - found.albedo).mean() for found, _ in each])
        seconds = [taken for _, taken in each]
        print(
            f"{target}: total variation {np.median(variation):.1f} % (median), {variation.max():.1f} % (worst); "
            f"albedo {albedo.mean():.3f} off in the mean; {np.median(seconds):.1f} s, {max(seconds):.1f} s at most"
        )


if __name__ == "__main__":
    main()
