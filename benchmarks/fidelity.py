"""How far the light of a model is from random walks, by kind of stack: where it goes, how much, how noisy samples are.

    python benchmarks/fidelity.py [--model velatura] [--form forward] [--half fit] [--kind NAME]... [--stacks 12]
        [--paths 1000000] [--seed 0] [--truth FOLDER] [--textured] [--json FILE] [--fitted NAME=VALUE]...

Stacks and walks are those of `walks.py`; FOLDER keeps them (`walks`). The model is asked through its plugin, as a
renderer asks it: directions are sampled, so that lobes of any width are resolved. Models whose reflectance averages
over facets take that which the walks have (`fgd`: met once, `fgd-multi`: met often). With `--textured` the roughnesses
of the first two isotropic interfaces come from textures, of one value each.

Columns, means over stacks and directions of incidence:

- variation: half the sum of the absolute differences over 40 by 40 bins of the projected disc, over the true energy;
  grids of symmetric stacks are made symmetric first, since a mirror's light lies on the border of bins;
- noise: the part of it that the walks make, and that the samples make, from halves of either;
- albedo, worst: |energy / true energy - 1|, mean and greatest over colours, and the part of it that the walks make;
- spread, heaviest: variance of the weight of samples over the square of their mean, and the greatest weight.

Light that is less than .02 of what comes in is left out, of what passes less than .03. Last, a solid sphere of rough
glass in a white furnace, of index 1.5: the energy that comes out, after 40 meetings with its surface at most, what is
still inside then, and the relative variance of a path's weight, beside those of `roughdielectric`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc
from walks import FOLDER, HALVES, Incidence, Kind, Walks, arguments, chosen, every

import velatura as vt
from velatura import kernel
from velatura.benchmark.candidates import evenly, probe_of
from velatura.benchmark.entrants import with_bounces
from velatura.checks.probe import Probe
from velatura.comparison.evaluated_lobes import LightPoints, distribution
from velatura.errors import InvalidInput
from velatura.model import DEFAULT, Model, named
from velatura.stack import Material, Stack, as_described, dumps

Array = NDArray[np.floating]

SAMPLES = 19  # power of 2, twice for each direction of incidence
FAINT = {"reflected": 0.02, "passed": 0.03}
SPHERE = 1.5  # index
GLASS = (0.05, 0.2, 0.4)  # its alpha
MEETINGS, IN_GLASS = 40, 2**17  # of a path with its surface, and paths
#: What is aimed at, by row: total variation, albedo error, and the worst of it.
GOALS: dict[str, tuple[float, float, float | None]] = {
    "isotropic, once": (0.034, 0.004, 0.03),
    "isotropic, often": (0.038, 0.006, None),
    "turned, once": (0.040, 0.008, 0.04),
    "turned, often": (0.044, 0.008, None),
    "absorbing, often": (0.030, 0.006, None),
    "scattering, often": (0.040, 0.010, 0.05),
    "diffuse base, often": (0.018, 0.006, None),
    "passing, once": (0.055, 0.010, None),
    "passing, often": (0.055, 0.010, None),
    "passing scattering, often": (0.075, 0.010, None),
    "passing, once: from inside": (0.055, 0.010, None),
    "passing, often: from inside": (0.055, 0.010, None),
    "passing scattering, often: from inside": (0.075, 0.010, None),
    "brushed under lacquer": (0.035, 0.004, 0.015),
    "crossed brushing": (0.035, 0.004, 0.015),
    "frosted pane": (0.045, 0.004, 0.015),
    "very rough": (0.035, 0.004, 0.015),
    "passing, once: beyond the critical angle": (0.10, 0.05, None),
    "passing, often: beyond the critical angle": (0.10, 0.05, None),
}


@dataclass(frozen=True)
class Record:
    """One direction of incidence on one stack, and one side that light leaves to.

    energy: the true one, by colour; variation and both noises: as total variations; albedo and its noise: relative, by
    colour, None where there is too little light; spread and heaviest: of the weights of all samples.
    """

    row: str
    stack: str
    thin: bool
    cosine: float
    inside: bool
    momentum: float
    energy: list[float]
    variation: float
    noise: float
    own_noise: float
    albedo: list[float | None]
    albedo_noise: list[float | None]
    spread: float
    heaviest: float


# The model -----------------------------------------------------------------------------------------------------------


def of_kind(kind: Kind, model: str, switches: dict[str, str]) -> Model:
    """The model, with the reflectance that the walks have if it averages over facets."""
    return with_bounces(named(model, **switches), kind.often)


def textured(stack: Stack, model: Model) -> Any:
    """The plugin with the roughness of two isotropic interfaces from textures."""
    mi = kernel.mitsuba()
    vt.register()
    flat, maps = stack.flat(), {}
    for n, kind in enumerate(stack.kinds):
        alphas = {flat.get(f"layer{n}_alpha_u"), flat.get(f"layer{n}_alpha_v")}
        if kind in ("dielectric", "conductor", "mirror") and len(alphas) == 1 and len(maps) < 2:
            image = np.full((2, 2, 1), alphas.pop(), np.float32)
            maps[f"layer{n}_alpha"] = {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True}
    switches = {"model": model.name, "reflectance": model.reflectance, "form": model.form}
    return kernel.load_dict({"type": "layered", "material": dumps(stack, "json"), **switches, **maps})


def seen(probe: Probe, incidence: Incidence, azimuth: float = 0.0) -> tuple[Array, Array]:
    """Energies (2, 2, 3, bins, bins) as `Walks.grids` has them, and the weights (n,) of all samples."""
    z = -incidence.cosine if incidence.inside else incidence.cosine
    sine = np.sqrt(1 - z * z)
    wi = (sine * np.cos(azimuth), sine * np.sin(azimuth), z)
    halves, weights = [], []
    for half in range(2):
        u = evenly(SAMPLES, half)
        drawn = probe.sample(np.broadcast_to(wi, u.shape), u)
        back = (drawn.wo[:, 2] > 0) != incidence.inside
        lights = [LightPoints(drawn.wo[side, :2].T, drawn.weight[side].T / len(u)) for side in (back, ~back)]
        halves.append([distribution(light) for light in lights])
        weights.append(drawn.weight.mean(axis=1))
    return np.array(halves), np.concatenate(weights)


# Beside the walks ----------------------------------------------------------------------------------------------------


def symmetric(stack: Stack, cosine: float, grids: Array) -> Array:
    """Grids (..., bins, bins) with the symmetries that those of the stack have."""
    interfaces = Material.of(stack, as_described).interfaces
    isotropic = all(i.alpha_u == i.alpha_v for i in interfaces)
    if isotropic or all(i.alpha_u == i.alpha_v or i.rotation % 90 == 0 for i in interfaces):
        grids = (grids + grids[..., ::-1]) / 2
    if cosine == 1:
        grids = (grids + grids[..., ::-1, ::-1]) / 2
        grids = (grids + grids.swapaxes(-1, -2)) / 2 if isotropic else grids
    return grids


def compared(kind: Kind, walks: Walks, bsdf: Any) -> list[Record]:
    """Every direction of incidence, and the sides that are looked at."""
    probe, found = probe_of(bsdf), []
    for n, incidence in enumerate(walks.incidences):
        grids, weights = seen(probe, incidence, kind.light.azimuth)
        modelled, true = grids, walks.grids[:, :, :, n]
        if not kind.light.azimuth:
            modelled, true = (symmetric(walks.stack, incidence.cosine, g) for g in (modelled, true))
        spread = float(weights.var() / max(weights.mean(), 1e-9) ** 2)
        for side, name in enumerate(FAINT):
            row = _row(kind, incidence, name)
            if row and true[:, side].mean(axis=0).sum() / 3 > FAINT[name]:
                about = asdict(incidence) | {"stack": walks.stack.name, "thin": walks.stack.thin}
                about |= _distances(modelled[:, side], true[:, side], FAINT[name])
                found.append(Record(row, **about, spread=spread, heaviest=float(weights.max())))
    return found


def _row(kind: Kind, incidence: Incidence, side: str) -> str | None:
    """Where a record belongs in the table."""
    if side == "reflected":
        back = f"{kind.name}: back inside" if incidence.inside else None
        return back if kind.passes else kind.name
    if not kind.passes:
        return None
    if not incidence.inside:
        return kind.name
    return f"{kind.name}: {'beyond the critical angle' if incidence.momentum > 1 else 'from inside'}"


def _distances(halves: Array, walked: Array, faint: float) -> dict[str, Any]:
    """Distances between energies (2, 3, bins, bins) by halves: those of a model, and those of walks."""
    model, true = halves.mean(axis=0), walked.mean(axis=0)
    energy, of_halves = true.sum(axis=(1, 2)), walked.sum(axis=(2, 3))
    lit = energy > faint

    def relative(difference: Array) -> list[float | None]:
        return [float(d / e) if bright else None for d, e, bright in zip(difference, energy, lit)]

    return {
        "energy": energy.tolist(),
        "variation": _variation(model - true, true),
        "noise": _variation((walked[0] - walked[1]) / 2, true),
        "own_noise": _variation((halves[0] - halves[1]) / 2, true),
        "albedo": relative(model.sum(axis=(1, 2)) - energy),
        "albedo_noise": relative((of_halves[0] - of_halves[1]) / 2),
    }


def _variation(difference: Array, true: Array) -> float:
    return float(0.5 * np.abs(difference.mean(axis=0)).sum() / true.mean(axis=0).sum())


# Glass ---------------------------------------------------------------------------------------------------------------


def furnace(bsdf: Any) -> tuple[float, float, float]:
    """Energy that comes out of a solid sphere, lit evenly, what is still inside, and the relative variance of a path's
    weight.

    A chord makes the same angle with the normal at both ends, and an isotropic surface has no azimuth, so that light
    meets the surface next as it left it last.
    """
    probe, rng = probe_of(bsdf), np.random.default_rng(0)
    u = qmc.Sobol(2, seed=0).random(IN_GLASS)
    radius, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
    w = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - u[:, 0])], axis=1)
    weight, out = np.ones(IN_GLASS), np.zeros(IN_GLASS)
    path = np.arange(IN_GLASS)
    for _ in range(MEETINGS):
        drawn = probe.sample(w, rng.random((len(w), 3)))
        weight = weight * drawn.weight.mean(axis=1)
        leaves = drawn.wo[:, 2] > 0
        out[path[leaves]] = weight[leaves]
        on = ~leaves & (weight > 0)
        path, weight, w = path[on], weight[on], drawn.wo[on]
        if not len(path):
            break
    return float(out.mean()), float(weight.sum() / IN_GLASS), float(out.var() / out.mean() ** 2)


def spheres(model: str, switches: dict[str, str]) -> dict[str, dict[str, list[float]]]:
    """Results of `furnace` by what is in it, and alpha."""
    mi = kernel.mitsuba()
    found: dict[str, dict[str, list[float]]] = {}
    for alpha in GLASS:
        glass = Stack([vt.Interface(eta=SPHERE, alpha=alpha)])
        rough = {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha, "int_ior": SPHERE, "ext_ior": 1.0}
        made = {"roughdielectric": mi.load_dict(rough)}
        for reflectance in ("fgd", "fgd-multi"):
            try:
                chosen = named(model, reflectance=reflectance, **switches)
            except InvalidInput:
                continue
            made[reflectance] = vt.bsdf(glass, chosen)
        for name, bsdf in made.items():
            found.setdefault(name, {})[f"{alpha:g}"] = list(furnace(bsdf))
    return found


# The table -----------------------------------------------------------------------------------------------------------


def summary(records: list[Record]) -> dict[str, float]:
    """The columns of a row."""
    albedo = [abs(a) for r in records for a in r.albedo if a is not None]
    noise = [abs(a) for r in records for a in r.albedo_noise if a is not None]

    def mean(of: Callable[[Record], float]) -> float:
        return float(np.mean([of(r) for r in records]))

    return {
        "records": len(records),
        "variation": mean(lambda r: r.variation),
        "noise": mean(lambda r: r.noise),
        "own noise": mean(lambda r: r.own_noise),
        "albedo": float(np.mean(albedo)),
        "worst": float(np.max(albedo)),
        "its noise": float(np.mean(noise)),
        "spread": mean(lambda r: r.spread),
        "heaviest": float(max(r.heaviest for r in records)),
    }


def printed(table: dict[str, dict[str, float]], glass: dict[str, dict[str, list[float]]]) -> None:
    """The table, with goals in parentheses, and the spheres."""
    print(f"{'':52s}   n  variation        noise   own  albedo          worst        noise spread heaviest")
    for name, row in table.items():
        goals = [f"({g:.3f})" if g else "" for g in GOALS.get(name, (None,) * 3)]
        print(
            f"{name:52s}{row['records']:4d}  {row['variation']:.3f} {goals[0]:8s}{row['noise']:.3f}"
            f" {row['own noise']:.3f}  {row['albedo']:.4f} {goals[1]:8s}{row['worst']:.3f} {goals[2]:8s}"
            f"{row['its noise']:.4f} {row['spread']:6.2f} {row['heaviest']:7.2f}"
        )
    print(f"\n{'sphere of glass in a white furnace':52s}" + "".join(f"{f'alpha {a:g}':>21s}" for a in GLASS))
    for name, found in glass.items():
        columns = (f"  {energy:.3f} {inside:.4f} {spread:5.2f}" for energy, inside, spread in found.values())
        print(f"{name:52s}" + "".join(columns))


def main() -> None:
    options = arguments(
        __doc__,
        half=("fit", "", HALVES),
        model=DEFAULT,
        form=(str, "forward or symmetric; else the model's own"),
        truth=(FOLDER, "folder that keeps the walks"),
        textured=(False, "two roughnesses from textures"),
        json=(Path, "file for all numbers"),
    ).parse_args()

    switches = {"form": options.form} if options.form else {}
    kinds = chosen(options.kind)
    rows: dict[str, list[Record]] = {}
    truths = every(kinds, [options.half], options.stacks, options.paths, options.seed, options.truth)
    for kind, walks in truths:
        model = of_kind(kind, options.model, switches)
        bsdf = textured(walks.stack, model) if options.textured else vt.bsdf(walks.stack, model)
        for record in compared(kind, walks, bsdf):
            rows.setdefault(record.row, []).append(record)
    order = sorted(rows, key=lambda name: (":" in name, [k.name for k in kinds].index(name.split(":")[0])))
    table = {name: summary(rows[name]) for name in order}
    glass = spheres(options.model, switches)
    printed(table, glass)
    if options.json:
        about = {
            name: getattr(options, name) for name in ("model", "form", "half", "stacks", "paths", "seed", "textured")
        }
        records = [asdict(record) for name in order for record in rows[name]]
        options.json.write_text(json.dumps({**about, "table": table, "spheres": glass, "records": records}, indent=1))


if __name__ == "__main__":
    main()
