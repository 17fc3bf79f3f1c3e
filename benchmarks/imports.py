"""Materials of other programs as stacks: which files of a folder are read, what is left of them, and whether laws hold.

Without a folder: how far stacks of materials of OpenPBR are from that model's own formulas, lobe by lobe.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import velatura as vt
from velatura import imports
from velatura.optics import ggx
from velatura.sampling.low_discrepancy import square
from velatura.targets import openpbr
from velatura.targets.closures import Pair

COPPER = {"base_metalness": 1.0, "base_color": (0.926, 0.721, 0.504), "specular_color": (0.996, 0.957, 0.823)}
PAINT = {"base_color": (0.6, 0.2, 0.1), "specular_roughness": 0.4}
MATERIALS: dict[str, dict[str, Any]] = {
    "copper": {**COPPER},
    "copper, smooth coat": {**COPPER, "coat_weight": 1.0},
    "copper, rough coat": {**COPPER, "coat_weight": 1.0, "coat_roughness": 0.5},
    "copper, film of 300 nm": {**COPPER, "thin_film_weight": 1.0, "thin_film_thickness": 0.3},
    "copper, film, smooth coat": {
        **COPPER,
        "thin_film_weight": 1.0,
        "thin_film_thickness": 0.3,
        "coat_weight": 1.0,
    },
    "paint": {**PAINT},
    "paint, coat of equal index": {**PAINT, "coat_weight": 1.0, "coat_ior": 1.5},
    "paint, coat": {**PAINT, "coat_weight": 1.0},
    "paint, coat, no darkening": {**PAINT, "coat_weight": 1.0, "coat_darkening": 0.0},
    "paint, tinted rough coat": {
        **PAINT,
        "coat_weight": 1.0,
        "coat_color": (0.9, 0.7, 0.4),
        "coat_roughness": 0.4,
    },
    "paint, half a coat": {**PAINT, "coat_weight": 0.5},
    "paint, film of 300 nm": {**PAINT, "thin_film_weight": 1.0, "thin_film_thickness": 0.3},
}
COSINES = (1.0, 0.5)
SAMPLES = 2**15  # of each of three densities
LEAST = 1e-3  # alpha of lobes that are evaluated
LOBES = ("coat", "base", "diffuse", "darkening")
Lobes = dict[str, tuple[float, float | None]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", help="of files to import, with those in folders below it")
    parser.add_argument("--no-check", action="store_true", help="read them only")
    arguments = parser.parse_args()
    if arguments.folder:
        files(arguments.folder, not arguments.no_check)
    else:
        differences()
    print(f"\n{time.process_time():.0f} s of processor time")


# Files ---------------------------------------------------------------------------------------------------------------


def files(folder: Path, checked: bool) -> None:
    counts = {"read": 0, "refused": 0, "broken": 0}
    print("| file | material | layers | left | laws |\n|---|---|---|---|---|")
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in imports.FORMATS:
            for row in rows(path, counts, checked):
                print(f"| {path.name} | {' | '.join(row)} |", flush=True)
    print("\n" + ", ".join(f"{count} {kind}" for kind, count in counts.items()))


def rows(path: Path, counts: dict[str, int], checked: bool) -> list[tuple[str, str, str, str]]:
    try:
        readers: Mapping[str, Callable[..., Any]] = import_module(imports.FORMATS[path.suffix.lower()]).materials(path)
    except vt.InvalidInput as error:
        counts["refused"] += 1
        return [("", f"refused: {error}", "", "")]
    found = []
    for name in readers:
        try:
            made = imports.read(path, name)
        except vt.InvalidInput as error:
            counts["refused"] += 1
            found.append((name, f"refused: {error}", "", ""))
            continue
        counts["read"] += 1
        laws = ""
        if checked:
            report = vt.check(made.stack)
            laws = "kept" if report.passed else ", ".join(report.broken)
            counts["broken"] += not report.passed
        layers = ", ".join(made.stack.kinds) + (", thin" if made.stack.thin else "")
        found.append((name, layers, ", ".join(each.parameter for each in made.left), laws))
    return found


# Differences ---------------------------------------------------------------------------------------------------------


def differences() -> None:
    heads = [f"{what}, {cosine:g}" for what in ("energy", "alpha") for cosine in COSINES]
    print(f"| material | lobe | {' | '.join(heads)} |\n|---|---|{'---|' * len(heads)}")
    for name, parameters in MATERIALS.items():
        theirs, ours = ([of(parameters, cosine) for cosine in COSINES] for of in (of_formulas, of_stack))
        if parameters.get("coat_weight") and parameters.get("coat_darkening") != 0:
            for of, found in ((of_formulas, theirs), (of_stack, ours)):
                for cosine, lobes in zip(COSINES, found):
                    lobes["darkening"] = darkening(of, parameters, lobes, cosine), None
        for lobe in (name for name in LOBES if any(name in each for each in (*ours, *theirs))):
            cells = [
                cell([each.get(lobe, (0.0, None))[kind] for each in pair])
                for kind in (0, 1)
                for pair in zip(theirs, ours)
            ]
            print(f"| {name} | {lobe} | {' | '.join(cells)} |")


def cell(pair: Sequence[float | None]) -> str:
    """Both numbers, with what there is of them."""
    texts = ["" if x is None else f"{x:.3f}".removeprefix("0") for x in pair]
    return ", ".join(texts) if any(texts) else ""


def darkening(of: Callable[..., Lobes], parameters: Mapping[str, Any], lobes: Lobes, cosine: float) -> float:
    """The energy of what lies below the coat over that without darkening."""
    plain = of({**parameters, "coat_darkening": 0.0}, cosine)
    below, bright = (sum(energy for name, (energy, _) in each.items() if name != "coat") for each in (lobes, plain))
    return below / bright


def of_stack(parameters: Mapping[str, Any], cosine: float) -> Lobes:
    """Energies, in the mean of colours, and roughness of the lobes of an imported stack."""
    stack = vt.from_openpbr(**parameters).stack
    found = vt.lobes(stack, cosine)
    names = ["coat", "base"] if parameters.get("coat_weight") else ["base"]
    lobes: Lobes = {
        name: (float(np.mean(energy)), float(np.mean(alpha)))
        for name, energy, alpha in zip(names, found.energy, found.alpha)
    }
    rest = float(np.mean(found.remainder))
    return {**lobes, "diffuse": (rest, None)} if stack.base else lobes


def of_formulas(parameters: Mapping[str, Any], cosine: float) -> Lobes:
    """The same of OpenPBR's formulas: parts of the value follow from weights that are set to 0."""
    wi, wo, density = directions(parameters, cosine)
    pair = Pair(wi, wo)

    def energy(**changed: float) -> float:
        return float(np.mean(openpbr.value({**parameters, **changed}, pair) / density))

    coat = energy(base_weight=0.0, specular_weight=0.0, thin_film_weight=0.0)
    metal = parameters.get("base_metalness", 0.0) == 1
    over = (energy() if metal else energy(base_weight=0.0)) - coat
    rough, coat_rough = alphas(parameters)
    weight = parameters.get("coat_weight", 0.0)
    lobes: Lobes = {"coat": (coat, coat_rough)} if weight else {}
    lobes["base"] = (over, rough)
    return lobes if metal else {**lobes, "diffuse": (energy() - coat - over, None)}


def alphas(parameters: Mapping[str, Any]) -> tuple[float, float]:
    """Roughness of the base, with what the coat adds (OpenPBR 1.1, "Roughening"), and of the coat."""
    base, coat = parameters.get("specular_roughness", 0.3), parameters.get("coat_roughness", 0.0)
    weight = parameters.get("coat_weight", 0.0)
    rough = (1 - weight) * base + weight * min(base**4 + 2 * coat**4, 1) ** 0.25
    return rough**2, coat**2


def directions(parameters: Mapping[str, Any], cosine: float) -> tuple[Any, Any, Any]:
    """A view, directions drawn from three densities alike often, and the mean of those densities."""
    view = (np.sqrt(1 - cosine**2), 0.0, cosine)
    u, v = square(SAMPLES)
    wi = tuple(np.full(3 * len(u), x) for x in view)
    widths = [max(alpha, LEAST) for alpha in alphas(parameters)]
    drawn = [
        np.stack(np.broadcast_arrays(*ggx.reflect(view, ggx.sample_visible(view, alpha, alpha, u, v))))
        for alpha in widths
    ]
    radius, angle = np.sqrt(u), 2 * np.pi * v
    drawn.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - u)]))
    wo = np.concatenate(drawn, axis=1)
    h = ggx.normalize(tuple(np.stack(wi) + wo))
    density = np.maximum(wo[2], 0) / np.pi
    for alpha in widths:
        density = density + ggx.ndf(h, alpha, alpha) * ggx.masking(wi, alpha, alpha) / (4 * cosine)
    return np.stack(wi), wo, np.maximum(density / 3, 1e-12) * np.where(wo[2] > 0, 1, np.inf)


if __name__ == "__main__":
    main()
