"""How much light models lose in a scattering medium below a coat, against random walks.

    python benchmarks/media.py [--paths 20000]

A coat of index 1.5 and alpha .1, a medium, and below it a metal or a dielectric of index 1.52, both of alpha .2. The
medium's single-scattering albedo is .5, .9 or .99, its asymmetry g 0, .5, .8 or .95, its optical depth .1, .5, 2 or 10.
Printed: the mean of |albedo / true - 1| at cosines 1 and .5, by g and by depth. Facets are met any number of times.
"""

from __future__ import annotations

import argparse
from itertools import product
from typing import Any

import numpy as np
from rich.progress import track

import velatura as vt

COSINES = (1.0, 0.5)
ALBEDOS, ASYMMETRIES, DEPTHS = (0.5, 0.9, 0.99), (0.0, 0.5, 0.8, 0.95), (0.1, 0.5, 2.0, 10.0)
BASES = {"metal": vt.Interface(eta=0.2, k=3.5, alpha=0.2), "dielectric": vt.Interface(eta=1.52, alpha=0.2)}
MODELS: dict[str, dict[str, Any]] = {
    "velatura": {"model": "velatura"},
    "belcour2018": {"model": "belcour2018"},
    "belcour2018, doubled": {"model": "belcour2018", "medium": "doubled"},
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--paths", type=int, default=20_000)
    paths = parser.parse_args().paths

    shape = len(ALBEDOS), len(ASYMMETRIES), len(DEPTHS), len(COSINES)
    for base, below in BASES.items():
        errors: dict[str, list[Any]] = {name: [] for name in MODELS}
        for albedo, g, depth in track(list(product(ALBEDOS, ASYMMETRIES, DEPTHS)), description=base):
            medium = vt.Medium(depth=depth, sigma_s=albedo, sigma_a=1 - albedo, g=g)
            stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), medium, below])
            truth = np.sum(vt.reference.statistics(stack, COSINES, 0.0, paths, 0, microsurface=True).energy, axis=0)
            for name, choices in MODELS.items():
                albedos = np.sum(vt.lobes(stack, COSINES, **choices).energy, axis=0)
                errors[name].append(abs(albedos / truth - 1).mean(axis=0))
        print(
            f"{base:24s}    all" + "".join(f"  g {g:4g}" for g in ASYMMETRIES) + "".join(f" d {d:4g}" for d in DEPTHS)
        )
        for name, each in errors.items():
            values = np.array(each).reshape(shape)
            cells = (values.mean(), *values.mean(axis=(0, 2, 3)), *values.mean(axis=(0, 1, 3)))
            print(f"{name:24s}" + "".join(f"{x:7.3f}" for x in cells))


if __name__ == "__main__":
    main()
