"""How a rough coat blurs, darkens and colours its base: rules in use and our law, against random walks.

    python benchmarks/coat.py [--walk] [--csv docs/explanation/coat-walks.csv] [--paths 200000]
                              [--sets random,brushed] [--store FOLDER] [--workers N] [--plot FILE] [--json]

Prints the tables of docs/explanation/coat.md from the walks in the CSV. With `--walk` it makes that file first: the
same one for the same paths, as materials and walks are seeded. Walks are sweeps; FOLDER keeps them, and one that was
interrupted goes on. `--plot` draws the picture of the page.

Widths are of walks that meet a facet once per interface, as renderers do, and energies of walks that meet any number.
Printed: of log(alpha / true alpha) and of energy / true energy - 1 the mean and the 90th percentile of their sizes, and
the bias. The law is that of docs/explanation/coat.md, whose numbered equations the comments name.
"""

from __future__ import annotations

import csv
import itertools
import json
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rows import parsed

import velatura as vt
from velatura.optics import fresnel
from velatura.stack import Interface, Medium, Stack

Array = NDArray[np.floating]

CSV = Path(__file__).parents[1] / "docs" / "explanation" / "coat-walks.csv"
COSINES = (1.0, 0.75, 0.5, 0.3)
GOLD = {"eta": (0.18, 0.42, 1.37), "k": (3.42, 2.35, 1.77)}  # of the grid

PARTS = {"coat_alpha": "uv", "tau": "rgb", "base_alpha": "uv", "eta": "rgb", "k": "rgb"}
MEASURED = {"alpha": "uv", "energy": "rgb"}
MATERIAL = ["coat_ior", *(f"{name}_{x}" for name, parts in PARTS.items() for x in parts)]
FOUND = [f"{name}_{x}" for name, parts in MEASURED.items() for x in parts]
COLUMNS = ["set", "material", *MATERIAL, "cos_theta", "phi_deg", *FOUND, *(f"{name}_se" for name in FOUND)]
ABOUT = """\
Random walks through a clear or absorbing rough coat over a rough conductor, by Velatura (BSD-3-Clause).
Made by: python benchmarks/coat.py --walk --paths {paths}. One row per material and direction.
set: random, brushed, absorbing, grid, and fit, which the constants of the law were fitted to
material: number of the material in its set
coat_ior: index of refraction of the coat, in air
coat_alpha_u, coat_alpha_v: GGX alpha (roughness squared) of the coat along the tangent and the bitangent
tau_r, tau_g, tau_b: optical depth of the coat along its normal, once through
base_alpha_u, base_alpha_v: GGX alpha of the conductor along the same axes
eta_r, eta_g, eta_b; k_r, k_g, k_b: real and imaginary part of the conductor's index of refraction, in air
cos_theta, phi_deg: direction of the view: cosine to the normal; azimuth from the tangent, degrees
alpha_u, alpha_v: GGX alpha of the one reflection whose half-vectors have the median slope of the base's light
energy_r, energy_g, energy_b: share of the light that the base returns through the coat, all bounces
..._se: standard error of the column of that name"""


@dataclass(frozen=True)
class Walks:
    """Rows of the CSV, by column; N of them."""

    columns: dict[str, Sequence[str]]

    def of(self, name: str, parts: str = "") -> Array:
        """A column (N,), or those of some parts (len(parts), N)."""
        if parts:
            return np.array([self.of(f"{name}_{part}") for part in parts])
        return np.array([float(x) for x in self.columns[name]])

    @cached_property
    def n(self) -> Array:
        return self.of("coat_ior")

    @cached_property
    def cosine(self) -> Array:
        return self.of("cos_theta")

    @cached_property
    def phi(self) -> Array:
        return np.radians(self.of("phi_deg"))

    @cached_property
    def coat(self) -> Array:
        return self.of("coat_alpha", "uv")

    @cached_property
    def base(self) -> Array:
        return self.of("base_alpha", "uv")

    @cached_property
    def alpha(self) -> Array:
        return self.of("alpha", "uv")

    @cached_property
    def energy(self) -> Array:
        return self.of("energy", "rgb")

    @cached_property
    def sets(self) -> list[str]:
        return list(dict.fromkeys(self.columns["set"]))

    def where(self, chosen: Sequence[bool] | NDArray[np.bool_]) -> Walks:
        return Walks({name: list(itertools.compress(column, chosen)) for name, column in self.columns.items()})

    def materials(self) -> list[tuple[Stack, list[int]]]:
        """Materials, each with its rows."""
        rows: dict[tuple[str, ...], list[int]] = {}
        for row, key in enumerate(zip(*(self.columns[name] for name in MATERIAL))):
            rows.setdefault(key, []).append(row)
        return [(stack(dict(zip(MATERIAL, map(float, key)))), places) for key, places in rows.items()]


def stack(values: dict[str, float]) -> Stack:
    """The material of a row."""
    of = {name: tuple(values[f"{name}_{x}"] for x in parts) for name, parts in PARTS.items()}
    coat, base = (a[0] if a[0] == a[1] else a for a in (of["coat_alpha"], of["base_alpha"]))
    medium = [Medium(depth=1.0, sigma_a=of["tau"])] if any(of["tau"]) else []
    below = Interface(eta=of["eta"], k=of["k"], alpha=base)
    return Stack([Interface(eta=values["coat_ior"], alpha=coat), *medium, below])


def read(path: Path) -> Walks:
    lines = (line for line in path.read_text().splitlines() if not line.startswith("#"))
    rows = list(csv.DictReader(lines))
    return Walks({name: [row[name] for row in rows] for name in COLUMNS})


# The law


def roughness(w: Walks) -> Array:
    """Roughness (2, N) that the base appears to have: Equations 1 to 5."""
    n, cosine, sin2 = w.n, w.cosine, 1 - w.cosine**2
    b = np.sqrt(n**2 - sin2)
    coat = w.coat / (1 + 3.2 * w.coat**2)
    width = ((b * w.base) ** 1.5 + 2 * ((b - cosine) / 2 * coat) ** 1.5) ** (2 / 3)
    bent = 12.4 * np.sqrt(1 - 1 / n**2) * sin2 * width**2
    alpha = width * np.sqrt(2 / (cosine**2 + np.sqrt(cosine**4 + bent)))
    return np.asarray(alpha / np.sqrt(1 + (1 - 1 / n**2) * (alpha / (0.57 * (1 + 2.9 * sin2))) ** 2))


def kept(w: Walks) -> Array:
    """Share (N,) of the light going up that the coat keeps: Equations 6 to 8."""
    sin2 = 1 - w.cosine**2
    b = np.sqrt(w.n**2 - sin2)
    width2 = np.mean((b * w.base) ** 2 + (0.75 * (b - w.cosine) * w.coat) ** 2, axis=0)
    x = width2 / (0.41 * (1 - 0.94 * sin2)) ** 2
    sharp, wide = fresnel.dielectric(w.cosine, w.n), materialx_kept(w)
    return np.asarray(wide - (wide - sharp) / (1 + x) ** 2.4)


def below_coat(w: Walks) -> Array:
    """Reflectance (3, N) of the base in the coat, at the refracted angle."""
    refracted = np.sqrt(1 - (1 - w.cosine**2) / w.n**2)
    return np.asarray(fresnel.conductor(refracted, w.of("eta", "rgb") / w.n, w.of("k", "rgb") / w.n))


def darkened(w: Walks, k: Array) -> Array:
    """Energy (3, N) of the base where the coat keeps a share k of the light going up: Equations 9 and 10."""
    passed = np.exp(-2 * w.of("tau", "rgb") / np.sqrt(1 - (1 - w.cosine**2) / w.n**2))
    base = below_coat(w)
    return np.asarray((1 - fresnel.dielectric(w.cosine, w.n)) * base * passed * (1 - k) / (1 - base * passed * k))


# Rules in use


def openpbr(factor: Callable[[Array], Array | float]) -> Callable[[Walks], Array]:
    # r'^4 = r_B^4 + X r_C^4 with r = sqrt(alpha); 2 in OpenPBR 1.1 and in MaterialX 1.39, at most 1
    return lambda w: scaled(w, np.sqrt(np.minimum(1, mean2(w.base) + factor(w.n) * mean2(w.coat))))


def openpbr_proposed(w: Walks) -> Array:
    # OpenPBR, pull request 261 (2026-03-31), whose 1.05 is fitted to random walks
    blur = 1.05 * (w.n - 1) * np.sqrt(1 + w.n**2) / w.n
    return scaled(w, 0.85 * np.tanh(np.sqrt(w.n**2 * mean2(w.base) + blur**2 * mean2(w.coat)) / 0.85))


def mean2(alpha: Array) -> Array:
    """Square of the roughness that OpenPBR calls isotropic, of two axes."""
    return np.asarray(np.mean(alpha**2, axis=0))


def scaled(w: Walks, alpha: Array) -> Array:
    """Both axes of the base, whose ratio OpenPBR keeps."""
    return np.asarray(w.base * alpha / np.sqrt(mean2(w.base)))


def openpbr_kept(w: Walks) -> Array:
    # OpenPBR 1.1, section Darkening: K = lerp(K_s, K_r, r_b), where r_b is the roughness of a metal
    cosine = np.linspace(0.0005, 0.9995, 1000)
    average = np.array([np.mean(2 * cosine * fresnel.dielectric(cosine, n)) for n in w.n])
    rough, smooth = 1 - (1 - average) / w.n**2, fresnel.dielectric(w.cosine, w.n)
    return np.asarray(smooth + (rough - smooth) * mean2(w.base) ** 0.25)


def materialx_kept(w: Walks) -> Array:
    # open_pbr_surface.mtlx of MaterialX 1.39: Kcoat = 1 - (1 - F0) / n^2
    return np.asarray(1 - (1 - ((w.n - 1) / (w.n + 1)) ** 2) / w.n**2)


# The model


def by_model(w: Walks, wanted: Callable[[Any], Array], **switches: str) -> Array:
    parts = []
    for material, rows in w.materials():
        found = vt.lobes(material, w.cosine[rows], w.phi[rows], model="velatura", **switches)
        parts.append((rows, wanted(found)))
    whole = np.empty((len(parts[0][1]), len(w.n)))
    for rows, part in parts:
        whole[:, rows] = part
    return whole


def model_roughness(w: Walks) -> Array:
    """Roughness (2, N) of the model's lobe; where all layers are isotropic, of the round one with its area."""
    found = by_model(w, along_axes, reflectance="fgd")
    isotropic = (w.base[0] == w.base[1]) & (w.coat[0] == w.coat[1])
    return np.where(isotropic, np.sqrt(found[0] * found[1]), found)


def along_axes(found: Any) -> Array:
    """Roughness of the base's lobe along the tangent and the bitangent."""
    alpha = np.array(found.alpha[-1])
    across = np.abs(np.sin(np.array(found.rotation[-1]))) > np.sqrt(0.5)
    return np.where(across, alpha[::-1], alpha)


Rule = Callable[[Walks], Array]

BLURS: dict[str, Rule] = {
    "the law": roughness,
    "the law, at normal incidence": lambda w: roughness(Walks(w.columns | {"cos_theta": ["1"] * len(w.n)})),
    "model velatura (fgd)": model_roughness,
    "OpenPBR, pull request 261": openpbr_proposed,
    "OpenPBR 1.1, MaterialX: X = 2": openpbr(lambda n: 2.0),
    "OpenPBR, X = 1 - 1/n": openpbr(lambda n: 1 - 1 / n),
    "the larger of both": lambda w: np.maximum(w.base, w.coat),
    "no roughening": lambda w: w.base,
}
ENERGIES: dict[str, Rule] = {
    "the law": lambda w: darkened(w, kept(w)),
    "model velatura": lambda w: by_model(w, lambda found: np.array(found.energy[-1] + found.remainder)),
    "OpenPBR 1.1, pull request 261": lambda w: darkened(w, openpbr_kept(w)),
    "MaterialX: K = 1 - (1 - F0)/n^2": lambda w: darkened(w, materialx_kept(w)),
    "K = F": lambda w: darkened(w, fresnel.dielectric(w.cosine, w.n)),
    "no bounces": lambda w: darkened(w, np.zeros_like(w.n)),
}


# Walks


def drawn(kind: str) -> tuple[list[dict[str, float]], list[tuple[float, float]]]:
    """Materials of a set, and its directions (cosine, azimuth in degrees)."""
    if kind == "grid":
        alphas = itertools.product((1.1, 1.3, 1.5, 1.8), (0.0, 0.05, 0.1, 0.2, 0.3, 0.5), (0.05, 0.1, 0.2, 0.3, 0.5))
        materials = [_values(n, (c, c), (b, b), (0.0,) * 3, **GOLD) for n, c, b in alphas]
        return materials, [(c, 0.0) for c in (1.0, 0.85, 0.7, 0.5, 0.35, 0.2)]
    count, seed = {"random": (150, 0), "fit": (80, 1), "brushed": (60, 2), "absorbing": (50, 3)}[kind]
    rng = np.random.default_rng(seed)
    azimuths = (0.0, 90.0) if kind == "brushed" else (0.0,)
    return [_draw(rng, kind) for _ in range(count)], [(c, phi) for c in COSINES for phi in azimuths]


SETS = ("random", "brushed", "absorbing", "grid", "fit")


def _draw(rng: np.random.Generator, kind: str) -> dict[str, float]:
    """Coats of index 1.2 to 2 (1 to 2 for the fit) and alpha 0 to .5, on metals of alpha .01 to .5."""
    axes = 2 if kind == "brushed" else 1
    coat, base = (rng.uniform(least, 0.5, axes)[[0, -1]] for least in (0.0, 0.01))
    eta, k = (rng.uniform(*limits, 3) for limits in ((0.2, 2.0), (0.7, 5.0)))
    n = rng.uniform(1.0 if kind == "fit" else 1.2, 2.0)
    tau = rng.uniform(0, 1, 3) if kind == "absorbing" else np.zeros(3)
    return _values(n, coat, base, tau, eta, k)


def _values(n: float, coat: Any, base: Any, tau: Any, eta: Any, k: Any) -> dict[str, float]:
    return dict(zip(MATERIAL, (round(float(x), 4) for x in (n, *coat, *tau, *base, *eta, *k)), strict=True))


def walked(
    stack: Stack, seed: int, paths: int, cosines: tuple[float, ...], azimuths: tuple[float, ...]
) -> dict[str, Any]:
    """Light that the metal reflects below the coat; the name of the stack is the seed of its walks."""
    once, often = (
        vt.reference.statistics(stack, cosines, np.radians(azimuths), paths, int(stack.name), microsurface)
        for microsurface in (False, True)
    )
    pairs = {"": (once, often), "_se": (once.standard_error, often.standard_error)}
    return {
        f"{name}{end}": getattr(found, name)[-1] for end, both in pairs.items() for name, found in zip(MEASURED, both)
    }


def walk(kind: str, paths: int, store: Path, count: int | None = None, workers: int | None = None) -> list[list[str]]:
    """Rows of a set."""
    materials, directions = drawn(kind)
    materials = materials[:count]
    stacks = [stack(values).replace(name=str(number)) for number, values in enumerate(materials)]
    space = vt.Space(material=stacks[0], vary={"material": {"values": stacks}})
    cosines, azimuths = zip(*directions)
    found = vt.sweep(
        space,
        walked,
        store=store / f"{kind}.zarr",
        chunk=1,
        workers=workers,
        paths=paths,
        cosines=cosines,
        azimuths=azimuths,
    ).load()
    rows = []
    for number, values in enumerate(materials):
        for place, (cosine, phi) in enumerate(directions):
            measured = [
                x for end in ("", "_se") for name in MEASURED for x in found[f"{name}{end}"].values[number, :, place]
            ]
            numbers = [*values.values(), cosine, phi]
            rows.append([kind, str(number), *(f"{x:g}" for x in numbers), *(f"{x:.4g}" for x in measured)])
    return rows


def write(path: Path, paths: int, rows: Sequence[Sequence[str]]) -> None:
    with path.open("w", newline="") as file:
        file.writelines(f"# {line}\n" for line in ABOUT.format(paths=paths).splitlines())
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])


# What is printed


def _summary(errors: Array) -> str:
    sizes = abs(errors)
    return f"{sizes.mean():.3f} {np.quantile(sizes, 0.9):.3f} {errors.mean():+.3f}"


def errors(w: Walks) -> dict[str, dict[str, Array]]:
    """Errors by quantity and rule: log(alpha / true) of both axes and energy / true - 1 of the colours, by rows."""
    return {
        "roughness": {name: np.log(rule(w) / w.alpha) for name, rule in BLURS.items()},
        "energy": {name: rule(w) / w.energy - 1 for name, rule in ENERGIES.items()},
    }


def noise(w: Walks) -> dict[str, Array]:
    """Relative standard errors of the walks, by quantity."""
    return {
        "roughness": np.array([w.of(f"alpha_{x}_se") for x in "uv"]) / w.alpha,
        "energy": np.array([w.of(f"energy_{x}_se") for x in "rgb"]) / w.energy,
    }


PLAIN = {"coat_ior": "index", "coat_alpha_u": "coat", "base_alpha_u": "base", "cos_theta": "cosine"}
AXES = {
    "cos_theta": "angle of the view, degrees",
    "coat_alpha_u": "alpha of the coat",
    "base_alpha_u": "alpha of the base",
}
CURVES = {"the law": "C0", "OpenPBR, pull request 261": "C1", "OpenPBR 1.1, MaterialX: X = 2": "C3"}
DARK = {"the law": "C0", "OpenPBR 1.1, pull request 261": "C1", "MaterialX: K = 1 - (1 - F0)/n^2": "C2"}


def plot(w: Walks, path: Path) -> None:
    """The law and the rules in use against walks of the grid, over the angle and over the coat's roughness."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(11, 6.4), constrained_layout=True)

    def panel(axis: Any, varied: tuple[str, ...], rules: dict[str, str], quantity: str, **values: float) -> None:
        found = w.where(np.all([np.isclose(w.of(name), value) for name, value in values.items()], axis=0))
        name, part = {"roughness": ("alpha_u", 0), "energy": ("energy_g", 1)}[quantity]
        x = found.of(varied[0])
        fine = [str(value) for value in np.linspace(x.min(), x.max(), 100)]
        curve = Walks({each: fine if each in varied else [column[0]] * 100 for each, column in found.columns.items()})

        def shown(of: Walks) -> Array:
            return np.degrees(np.arccos(of.cosine)) if varied[0] == "cos_theta" else of.of(varied[0])

        axis.errorbar(shown(found), found.of(name), 3 * found.of(f"{name}_se"), fmt="k.", capsize=2,
                      label="walk, 3 standard errors")  # fmt: skip
        for rule, colour in rules.items():
            each = {"roughness": BLURS, "energy": ENERGIES}[quantity][rule]
            axis.plot(shown(curve), each(curve)[part], color=colour, label=rule)
        axis.set_title(", ".join(f"{PLAIN[key]} {value:g}" for key, value in values.items()), fontsize=10)
        axis.set(xlabel=AXES[varied[0]], ylim=(0, None) if quantity == "roughness" else None)

    coats = ("coat_alpha_u", "coat_alpha_v")
    for axis, (coat, base) in zip(axes[0], ((0.1, 0.05), (0.2, 0.1), (0.5, 0.2))):
        panel(axis, ("cos_theta",), CURVES, "roughness", coat_ior=1.5, coat_alpha_u=coat, base_alpha_u=base)
    for axis, cosine in zip(axes[1], (1.0, 0.5)):
        panel(axis, coats, CURVES, "roughness", coat_ior=1.5, base_alpha_u=0.1, cos_theta=cosine)
    bases = ("base_alpha_u", "base_alpha_v")
    panel(axes[1, 2], bases, DARK, "energy", coat_ior=1.5, coat_alpha_u=0.2, cos_theta=0.7)
    for axis in (axes[0, 0], axes[1, 0]):
        axis.set_ylabel("alpha that the base appears to have")
    axes[1, 2].set_ylabel("green light of the base")
    axes[0, 0].legend(fontsize=7)
    axes[1, 2].legend(fontsize=7, loc="upper right")
    figure.savefig(path, dpi=110)


def main() -> None:
    options = parsed(
        __doc__,
        walk=(False, "walk, and write the CSV"),
        csv=CSV,
        paths=(200_000, "for each direction"),
        sets=",".join(SETS),
        count=(int, "of materials of a set; all without"),
        store=(Path, "keeps the walks"),
        workers=(int, "processes that walk; one for each core without"),
        plot=Path,
        json=False,
    )
    sets = options.sets.split(",")
    if options.walk:
        with tempfile.TemporaryDirectory() as folder:
            store = options.store or Path(folder)
            rows = [row for kind in sets for row in walk(kind, options.paths, store, options.count, options.workers)]
        write(options.csv, options.paths, rows)

    walks = read(options.csv)
    if options.plot:
        plot(walks.where([name == "grid" for name in walks.columns["set"]]), options.plot)
        return
    for kind in sets:
        chosen = walks.where([name == kind for name in walks.columns["set"]])
        report(chosen, kind, options.json)


def report(walks: Walks, kind: str, as_json: bool) -> None:
    """Print the errors on a set by cosine."""
    cosines = sorted(set(walks.cosine), reverse=True)
    at = [walks.cosine == cosine for cosine in cosines]
    found, own = errors(walks), noise(walks)
    if as_json:
        means = {q: {n: [abs(e[:, i]).mean() for i in at] for n, e in rules.items()} for q, rules in found.items()}
        print(json.dumps({"set": kind, "cos": cosines, **means}))
        return
    for quantity, rules in found.items():
        print(f"{f'{kind}, {quantity}: mean, 90 %, bias':34s}" + "".join(f"{c:>22g}" for c in cosines))
        for name, e in rules.items():
            print(f"{name:34s}" + "".join(f"{_summary(e[:, i]):>22s}" for i in at))
        print(f"{'standard error of the walks':34s}" + "".join(f"{own[quantity][:, i].mean():>22.4f}" for i in at))


if __name__ == "__main__":
    main()
