"""Loss of the presets as parameters of other programs: the tables of docs/how-to/bakes.md.

    python benchmarks/bakes.py [--presets NAME ...] [--targets NAME ...] [--round-trips N]

For each preset and target: total variation in percent of the reflected light, the mean over cosines of incidence 1, .7
and .35, and the greatest error of the albedo, over colours and cosines; of panes, in brackets, also that of the light
that passes.
Then means over presets, and CPU seconds for each target. Every preset takes four seconds in all.

With --round-trips, N random materials of glTF become stacks, and these become glTF again, by numbers alone: for how
many of them each parameter changes, and by how much, of numbers above 1 as a share.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from rows import parsed

import velatura as vt
from velatura.bakes import TARGETS, Bake, bake
from velatura.programs.gltf import formulas as gltf
from velatura.programs.gltf import read as imported
from velatura.programs.parameters import complete

SAME = 0.02  # a smaller change counts as none
#: Parameters that have an effect only beside a weight.
EFFECTIVE = {
    "clearcoatFactor": ("clearcoatRoughnessFactor",),
    "anisotropyStrength": ("anisotropyRotation",),
    "iridescenceFactor": ("iridescenceIor", "iridescenceThicknessMaximum"),
}


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


def material(rng: np.random.Generator) -> dict[str, Any]:
    """A metal, a paint, or a pane of glTF, half of them below a clearcoat, some brushed or with a film."""
    metal, clear = ((1.0, 0.0), (0.0, 0.0), (0.0, 1.0))[rng.choice(3, p=(0.4, 0.4, 0.2))]
    values: dict[str, Any] = {
        "baseColorFactor": tuple(rng.uniform(0.05, 0.95, 3)),
        "metallicFactor": metal,
        "roughnessFactor": rng.uniform(0.1, 0.9),
        "transmissionFactor": clear,
    }
    if rng.random() < 0.5:
        values |= {"clearcoatFactor": rng.choice([0.4, 1.0]), "clearcoatRoughnessFactor": rng.choice([0.0, 0.3, 0.6])}
    if rng.random() < 0.25:
        values |= {"anisotropyStrength": rng.uniform(0.2, 0.8), "anisotropyRotation": rng.uniform(-1.5, 1.5)}
    if not metal and rng.random() < 0.4:
        values["ior"] = rng.uniform(1.2, 2.2)
    if rng.random() < 0.2:
        values |= {
            "iridescenceFactor": 1.0,
            "iridescenceIor": rng.uniform(1.2, 2.0),
            "iridescenceThicknessMaximum": rng.uniform(150, 500),
        }
    return values


def changes(drawn: dict[str, Any]) -> dict[str, float]:
    """Changes of a material's numbers after a stack, of numbers above 1 as a share; none of what has no effect."""
    given, made = complete(gltf.PARAMETERS, drawn), bake(imported.read(drawn).stack, "gltf").values
    idle = {name for weight, names in EFFECTIVE.items() if given[weight] == made[weight] == 0 for name in names}
    found = {}
    for each in gltf.PARAMETERS:
        if each.name not in idle and np.all(np.isfinite(each.default)):
            apart = np.abs(np.subtract(made[each.name], given[each.name])) / np.maximum(given[each.name], 1)
            found[each.name] = float(np.max(apart))
    return found


def round_trips(count: int) -> None:
    rng = np.random.default_rng(0)
    found = [changes(material(rng)) for _ in range(count)]
    print("| parameter | materials with it | changed | median change of those | largest |\n|---|---|---|---|---|")
    for name in (each.name for each in gltf.PARAMETERS):
        each = [change[name] for change in found if name in change]
        moved = [x for x in each if x > SAME]
        if moved or name in {"metallicFactor", "transmissionFactor", "clearcoatFactor", "iridescenceFactor"}:
            sizes = f"{np.median(moved):.2f} | {max(moved):.2f}" if moved else " | "
            print(f"| `{name}` | {len(each)} | {len(moved)} | {sizes} |")


def main() -> None:
    args = parsed(
        __doc__,
        presets=list(vt.presets(mixtures=False)),
        targets=(list(TARGETS), "", list(TARGETS)),
        round_trips=(int, "N materials, in place of presets"),
    )
    if args.round_trips:
        round_trips(args.round_trips)
        return
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
