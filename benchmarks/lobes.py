"""How far lobes in their own media and the remainder are from random walks, by kind of stack, without a renderer.

    python benchmarks/lobes.py [--half fit] [--kind NAME]... [--stacks 12] [--paths 1000000] [--seed 0] [--truth FOLDER]
        [--fitted NAME=VALUE]...

Walks are those of `walks.py`, of stacks that are lit from above and let no light pass. Energies are those of
`velatura.model.solved.energies`, widths those of `velatura.model.solved.lobes.widths`. Columns, means over stacks and
directions: half the sum of the absolute differences over 40 by 40 bins of the projected disc, over the true energy, and
the part of it that the walks make; |energy / true energy - 1|, its mean and the greatest.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from fidelity import symmetric
from numpy.typing import NDArray
from walks import FOLDER, HALVES, arguments, chosen, every

from velatura import tables
from velatura.model.rough_interface import Facets
from velatura.model.solved.energies.adding import parts
from velatura.model.solved.energies.energies import INCIDENCES, energies
from velatura.model.solved.lobes import refracted_lobe, remainder, widths
from velatura.model.solved.lobes.refracted_lobe import RefractedLobe
from velatura.model.solved.lobes.remainder import Remainder
from velatura.model.variance import Roughness
from velatura.stack import Material, Stack

Array = NDArray[np.floating]

BINS, FINE = 40, 6  # of the projected disc, and points across each
SAMPLES, STEP = 46368, 28657  # of narrow lobes; Fibonacci numbers
NARROW = 0.1  # alpha
FAINT = 0.02  # true energy that is left out


@cache
def over_the_disc() -> tuple[tuple[Array, Array, Array], Array]:
    """Directions within the projected disc, and the number of the bin of each."""
    u = (np.arange(BINS * FINE) + 0.5) / (0.5 * BINS * FINE) - 1
    x, y = (each.ravel() for each in np.meshgrid(u, u, indexing="ij"))
    above = x * x + y * y < 1
    x, y = x[above], y[above]
    return (x, y, np.sqrt(1 - x * x - y * y)), binned(x, y)


def binned(x: Array, y: Array) -> Any:
    i, j = (np.minimum((0.5 * (u + 1) * BINS).astype(int), BINS - 1) for u in (x, y))
    return i * BINS + j


def of_lobe(lobe: RefractedLobe, wi: tuple[float, float, float]) -> Array:
    """Light of a lobe on the bins, of energy 1."""
    if min(lobe.roughness.alpha_u, lobe.roughness.alpha_v) > NARROW:
        wo, cell = over_the_disc()
        value, _ = refracted_lobe.eval_pdf(lobe, tuple(np.full(len(cell), x) for x in wi), wo)
        light = np.bincount(cell, value / wo[2], BINS * BINS)
    else:
        k = np.arange(SAMPLES)
        full = tuple(np.full(SAMPLES, x) for x in wi)
        wo = refracted_lobe.sample(lobe, full, (k * (STEP / SAMPLES) + 0.5 / SAMPLES) % 1, (k + 0.5) / SAMPLES)
        value, pdf = refracted_lobe.eval_pdf(lobe, full, wo)
        weight = np.where(pdf > 0, value / np.where(pdf > 0, pdf, 1), 0)
        light = np.bincount(binned(wo[0], wo[1]), weight, BINS * BINS)
    return np.asarray(light.reshape(BINS, BINS) / max(light.sum(), 1e-30))


def modelled(stack: Stack, cosines: Array, azimuth: float, often: bool) -> Array:
    """Light that is reflected, by colour and cosine (3, N, bins, bins)."""
    material = Material.of(stack)
    found = parts(material)
    facets = [part for part in found if isinstance(part, Facets)]
    known, phi = tables.load() if often else None, np.full_like(cosines, azimuth)
    all_cosines = np.concatenate([cosines, INCIDENCES])
    around = np.concatenate([phi, 0 * INCIDENCES])
    solved = energies(material, all_cosines, around, known, widths.nearly_straight)
    lobes, veils, rest = (x[..., : len(cosines)] for x in (solved.lobes, solved.veils, solved.rest))
    albedos = (solved.lobes.sum(axis=0) + solved.veils.sum(axis=0) + solved.rest)[:, len(cosines) :]
    polynomial, _ = remainder.fit(solved.nodes, solved.remainder, INCIDENCES, np.broadcast_to(albedos, (len(rest), 8)))
    by_colour = Remainder(*(np.reshape(number, (-1, 1)) for number in vars(polynomial).values()))
    each = widths.each(found, cosines, phi, lobes.mean(axis=1))

    wo, cell = over_the_disc()
    light = np.zeros((3, len(cosines), BINS, BINS))
    for i, cosine in enumerate(cosines):
        sine = float(np.sqrt(1 - cosine**2))
        wi = sine * float(np.cos(azimuth)), sine * float(np.sin(azimuth)), float(cosine)
        for k, (tensor, near, tail) in enumerate(each):
            lit = [(near, lobes[k, :, i]), (widths.veil(found, k, cosines, tensor), veils[k, :, i])]
            if tail:
                lit = [(near, (1 - tail.share[i]) * lit[0][1]), (tail.tensor, tail.share[i] * lit[0][1]), lit[1]]
            for shape, energy in lit:
                if energy.max() > 1e-6:
                    roughness = Roughness(*(float(x[i]) for x in shape.roughness(phi)))
                    light[:, i] += energy[:, None, None] * of_lobe(lobe_of(facets, k, roughness), wi)
        value = by_colour.value(wi, wo) / wo[2] * (2 / (BINS * FINE)) ** 2
        light[:, i] += np.array([np.bincount(cell, each, BINS * BINS).reshape(BINS, BINS) for each in value])
    return light


def lobe_of(facets: Sequence[Facets], k: int, roughness: Roughness) -> RefractedLobe:
    """The lobe of an interface, for the mean over colours."""

    def reflected(cos2: Array) -> Array:
        return np.asarray(facets[k].reflectance(np.sqrt(cos2)).mean(axis=0))

    def leaving(cosine: Array) -> Array:
        assert first is not None
        cos2 = np.maximum(1 - (1 - cosine * cosine) / np.mean(facets[first].above) ** 2, 0)
        above = np.sqrt(cos2 + widths.steeper(facets[first].alpha_u, facets[first].alpha_v, of_metal) * (1 - cos2))
        return np.asarray(1 - facets[first].reflectance(above).mean(axis=0))

    first = widths.first_step([each.step for each in facets[:k]])
    n, last = float(np.mean(facets[k].above)), facets[-1]
    of_metal = (last.alpha_u, last.alpha_v) if facets[k] is last and last.opaque and last.brushed else None
    if first is None:
        return RefractedLobe(1.0, roughness, n, reflected)
    return RefractedLobe(1.0, roughness, n, None if facets[k].opaque else reflected, leaving)


def main() -> None:
    options = arguments(__doc__, half=(HALVES[0], "", HALVES), truth=(FOLDER, "keeps the walks")).parse_args()
    kinds = [kind for kind in chosen(options.kind) if not kind.passes]
    rows: dict[str, list[tuple[float, ...]]] = {kind.name: [] for kind in kinds}
    for kind, walks in every(kinds, (options.half,), options.stacks, options.paths, options.seed, options.truth):
        cosines = np.array([each.cosine for each in walks.incidences])
        light = modelled(walks.stack, cosines, kind.light.azimuth, kind.often)
        for i, cosine in enumerate(cosines):
            mine, *halves = (
                symmetric(walks.stack, cosine, grid) for grid in (light[:, i], *walks.grids[:, 0, :, i].astype(float))
            )
            truth = (halves[0] + halves[1]) / 2
            energy = truth.sum()
            if energy < 3 * FAINT:
                continue
            noise = np.abs(halves[0] - halves[1]).sum() / 4 / energy
            albedo = np.abs(mine.sum(axis=(1, 2)) / truth.sum(axis=(1, 2)) - 1)
            rows[kind.name].append(
                (np.abs(mine - truth).sum() / 2 / energy, noise, albedo.mean(), albedo.max(), cosine)
            )
    print(f"{'':24}{'variation':>10}{'at 1':>8}{'.7':>8}{'.35':>8}{'noise':>8}{'albedo':>8}{'worst':>8}")
    for name, found in rows.items():
        variation, noise, albedo, worst, cosine = np.array(found).T
        at = "".join(f"{variation[cosine == c].mean():8.4f}" for c in np.unique(cosine)[::-1])
        print(f"{name:24}{variation.mean():10.4f}{at}{noise.mean():8.4f}{albedo.mean():8.4f}{worst.max():8.4f}")


if __name__ == "__main__":
    main()
