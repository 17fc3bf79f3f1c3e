"""Fit the model `velatura` to random walks through random stacks, and say how far it is from those held out.

    python benchmarks/calibrate.py [--stacks 160] [--paths 300000] [--truth FOLDER] [--reflectance fgd] [--report]

Stacks have 2 to 5 interfaces, alpha 0 to .5, indices 1 to 2.5, over metals, mirrors and dielectrics, isotropic,
anisotropic and turned, a third of them with absorbing media. Every second one is held out. The constants of
`velatura.model.calibration` are fitted to the roughness along both axes and to the energy of every lobe of the
others, at cosines 1, .75, .5, .3 and .17, and printed with the uncertainty of the fit. `fgd` is held against walks that
meet one facet per interface, `fgd-multi` against walks between the facets. The walks take half an hour; they are kept
in FOLDER. `--report` fits nothing, and measures the constants as they are.
"""

from __future__ import annotations

import argparse
import dataclasses
import pickle
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import track
from scipy.optimize import least_squares

import velatura as vt
from velatura.comparison.evaluated_lobes import along
from velatura.model.calibration import CALIBRATIONS, Calibration
from velatura.model.models import Model, named
from velatura.model.recursion import Momentum
from velatura.reference import WalkedLobe
from velatura.stack import Interface, Medium, Stack

Array = NDArray[np.floating]

COSINES = (1.0, 0.75, 0.5, 0.3, 0.1736)
WEIGHTS = np.array([1.3, 1.0, 1.0, 1.0, 0.6])  # of the cosines
FAINT = 2e-3  # energy of lobes whose roughness is not looked at
NOISY = 0.05  # relative error of a true roughness, likewise
OUTLYING = 0.08  # logarithm of a ratio beyond which it counts less

LARGEST = {"rare": 1.0, "entering": 5.0}  # of constants that have an upper bound

RIVALS: dict[str, dict[str, Any]] = {
    "belcour2018, fresnel, no TIR": {"model": "belcour2018", "reflectance": "fresnel", "tir": "off"},
    "weier2020": {"model": "weier2020"},
}
AVERAGED = ("velatura", "belcour2018", "bati2021")  # take the reflectance that the walks have


def random_stack(rng: np.random.Generator, number: int) -> Stack:
    """A stack as described above; roughness is given along two axes throughout, so that the walk measures both."""
    kind = ("isotropic", "isotropic", "anisotropic", "turned")[number % 4]

    def roughness() -> float:
        u = rng.uniform()
        return 0.0 if u < 0.15 else rng.uniform(0, 0.5) if u < 0.7 else 10 ** rng.uniform(-2.3, -0.3)

    def interface(**index: Any) -> Interface:
        if kind == "isotropic" or ("conductor" not in index and rng.uniform() < 0.3):
            one = roughness()
            alpha: Any = (one, one * (1 + 1e-6)) if one > 0 else 0.0
        else:
            alpha = max(roughness(), 0.01), max(roughness(), 0.01)
        return Interface(alpha=alpha, rotation=rng.uniform(0, 180) if kind == "turned" else 0.0, **index)

    layers: list[Interface | Medium] = []
    absorbing = rng.uniform() < 0.35
    for _ in range(rng.integers(1, 5 if number % 2 else 3)):
        layers.append(interface(eta=rng.uniform(1, 2.5)))
        if absorbing and rng.uniform() < 0.6:
            layers.append(Medium(depth=1.0, sigma_a=tuple(rng.uniform(0, 0.6, 3))))
    base = rng.uniform()
    if base < 0.75:
        layers.append(interface(eta=tuple(rng.uniform(0.2, 2.5, 3)), k=tuple(rng.uniform(1.5, 5, 3))))
    elif base < 0.9:
        layers.append(interface(conductor="mirror"))
    else:
        layers.append(interface(eta=rng.uniform(1, 2.5)))
    return Stack(layers)


def walked(count: int, paths: int, microsurface: bool, folder: Path | None) -> list[tuple[Stack, Any]]:
    """Stacks and their truths, from the folder where they are there."""
    file = folder / f"{'multi' if microsurface else 'single'}-{count}-{paths}.pickle" if folder else None
    if file and file.exists():
        return list(pickle.loads(file.read_bytes()))
    rng = np.random.default_rng(2026)
    stacks = [random_stack(rng, i) for i in range(count)]
    truths = [
        (stack, vt.reference.statistics(stack, COSINES, 0.0, paths, seed, microsurface))
        for seed, stack in enumerate(track(stacks, description="walking"))
    ]
    if file:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(pickle.dumps(truths))
    return truths


def errors(stack: Stack, truth: Any, model: Model) -> tuple[Array, Array, Array, Array]:
    """Logarithms of ratios to the truth: roughness (K, 2, N), energy (K, 3, N), albedo (3, N); true shares (K, N).

    The first lobe is exact where the model says so. NaN where there is nothing to compare.
    """
    found = vt.lobes(stack, COSINES, model=model)
    widths, energies = [], []
    for k, energy in enumerate(truth.energy):
        names = {f.name: getattr(truth, f.name)[k] for f in dataclasses.fields(WalkedLobe)}
        true, nothing = WalkedLobe(**names), np.full_like(names["mean"], np.nan)
        mine = WalkedLobe(found.energy[k], found.alpha[k], found.rotation[k], nothing, nothing)
        alpha, widest = along(mine, true).alpha, np.minimum(true.alpha, 1.0)  # a GGX lobe gets no wider
        clear = (truth.standard_error.alpha[k] < NOISY * true.alpha) & (energy.mean(axis=0) > FAINT) & (alpha > 0)
        clear &= true.alpha > FAINT
        width = np.where(clear, np.log(np.where(clear, alpha, 1) / np.where(clear, widest, 1)), np.nan)
        widths.append(0 * width if k == 0 and model.recursion.has_gain else width)
        seen = energy > FAINT
        energies.append(np.where(seen, np.log(np.maximum(mine.energy, 1e-9) / np.where(seen, energy, 1)), np.nan))
    total = sum(truth.energy)
    shares = np.array([energy.mean(axis=0) for energy in truth.energy]) / total.mean(axis=0)
    return np.array(widths), np.array(energies), np.log(sum(found.energy) / total), shares


def fitted(truths: list[tuple[Stack, Any]], model: Model, start: Calibration) -> tuple[Calibration, Calibration]:
    """The constants that fit best, and their standard errors."""
    names = [f.name for f in dataclasses.fields(Calibration) if getattr(start, f.name) != 0]
    x_0 = np.array([min(getattr(start, name), 0.999 * LARGEST.get(name, 40.0)) for name in names])

    def residuals(x: Array) -> Array:
        calibration = dataclasses.replace(start, **dict(zip(names, x.tolist())))
        tried = dataclasses.replace(model, recursion=Momentum({model.reflectance: calibration}))
        rows = []
        for stack, truth in truths:
            width, energy, albedo, share = errors(stack, truth, tried)
            parts = width[1:], 0.5 * energy * np.sqrt(share)[:, None], 2 * albedo
            rows += [(np.nan_to_num(part) * WEIGHTS).ravel() for part in parts]
        return np.clip(np.concatenate(rows), -1.5, 1.5)

    largest = [LARGEST.get(name, 40.0) for name in names]
    scale = np.maximum(x_0, 0.1)
    options: dict[str, Any] = {"loss": "soft_l1", "f_scale": OUTLYING, "diff_step": 1e-3, "max_nfev": 8, "verbose": 1}
    found = least_squares(residuals, x_0, bounds=(0, largest), x_scale=scale, **options)
    noise = 2 * found.cost / max(np.count_nonzero(found.fun) - len(names), 1)
    sigma = np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)) * noise)
    nothing = {name: 0.0 for name in vars(start)}
    return (
        dataclasses.replace(start, **dict(zip(names, found.x.tolist()))),
        Calibration(**{**nothing, **dict(zip(names, sigma.tolist()))}),
    )


def report(truths: list[tuple[Stack, Any]], rivals: dict[str, dict[str, Any]]) -> None:
    """Print how far models are from the truth, by cosine."""
    print(f"{'':44s}" + "".join(f"{c:>9.2f}" for c in COSINES) + "   first four")
    for name, choices in rivals.items():
        model = named(choices["model"], **{k: v for k, v in choices.items() if k != "model"})
        every = [errors(stack, truth, model) for stack, truth in truths]
        widths = np.concatenate([each[0].reshape(-1, len(COSINES)) for each in every])
        albedo = np.abs(np.expm1(np.array([each[2] for each in every])))
        rows = {
            "|log roughness|, mean": np.nanmean(abs(widths), axis=0),
            "its bias": np.nanmean(widths, axis=0),
            "|albedo - true|/true, mean": albedo.mean(axis=(0, 1)),
            "its 95th percentile": np.quantile(albedo, 0.95, axis=(0, 1)),
            "its largest": albedo.max(axis=(0, 1)),
        }
        for label, row in rows.items():
            print(f"{name + ': ' + label:44s}" + "".join(f"{x:9.4f}" for x in row) + f"{row[:4].mean():10.4f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stacks", type=int, default=160)
    parser.add_argument("--paths", type=int, default=300_000)
    parser.add_argument("--truth", type=Path, help="folder that keeps the walks")
    parser.add_argument("--reflectance", choices=sorted(CALIBRATIONS), default="fgd-multi")
    parser.add_argument("--report", action="store_true", help="measure only")
    options = parser.parse_args()

    truths = walked(options.stacks, options.paths, options.reflectance == "fgd-multi", options.truth)
    model = named("velatura", reflectance=options.reflectance)
    if not options.report:
        best, sigma = fitted(truths[::2], model, CALIBRATIONS[options.reflectance])
        for name, value in vars(best).items():
            print(f"{name:20s}{value:10.4f} +- {getattr(sigma, name):.4f}")
        CALIBRATIONS[options.reflectance] = best  # of which the report is
    print(f"{len(truths[1::2])} stacks held out")
    report(truths[1::2], {name: {"model": name, "reflectance": options.reflectance} for name in AVERAGED} | RIVALS)


if __name__ == "__main__":
    main()
