"""Metals with a thin film, bare and under coats: ours, neighbours' formulas, and random walks.

Not a figure of a paper. Titanium is anodised to 50 nm of oxide, the tantalum mirror to 160 nm; they lie bare, under a
smooth varnish, and under a rough coat. Facets are met once in all. What neighbours do is in
`velatura.figures.neighbours`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from velatura import scenes
from velatura.figures import Progress, canvas, neighbours
from velatura.figures.neighbours import ClearCoat, FilmedMetal
from velatura.optics import films
from velatura.optics.coatings import RANGE_NM, Coating, ColouredFilm
from velatura.stack import Film, Interface, Named, Stack, rgb, srgb_sensitivity
from velatura.stack.spectra import lab

Array = canvas.Array

COSINES = tuple(round(0.1 * k, 1) for k in range(10, 0, -1))
TRUTH = "reference"
OURS = "velatura"
COLUMNS = (TRUTH, OURS, *neighbours.NEIGHBOURS)
THICKNESSES_NM = tuple(range(0, 5001, 50))  # of the oxide of titanium, for whose colours integrals are compared
FINE = 12_000  # wavenumbers of the integral that they are compared with
PRIMARIES_NM = (611.4, 549.1, 464.2)  # dominant wavelengths of the primaries of sRGB
BANDS = 40  # height of a strip of colours, in pixels

# Titanium: Johnson and Christy 1974; its oxide at 550 nm: Siefke et al. 2016. Tantalum: Ta of the files in Mitsuba's
# wheel; its oxide at 550 nm: Gao et al. 2012.
TITANIUM = FilmedMetal((2.737, 2.507, 2.236), (3.828, 3.397, 3.010), 0.15, 2.435, 50.0)
MIRROR = FilmedMetal(rgb(Named("Ta", "eta")), rgb(Named("Ta", "k")), 0.01, 2.157, 160.0)
METALS = {"titanium": TITANIUM, "tantalum": MIRROR}
COATS = {"bare": None, "varnish": ClearCoat(1.5, 0.01), "rough coat": ClearCoat(1.5, 0.3)}


def stack_of(metal: FilmedMetal, coat: ClearCoat | None) -> Stack:
    """The same as a stack."""
    film = Film(eta=metal.film_eta, thickness_nm=metal.thickness_nm)
    base = Interface(eta=metal.eta, k=metal.k, alpha=metal.alpha, films=(film,))
    return Stack([Interface(eta=coat.eta, alpha=coat.alpha), base] if coat else [base])


def compute(
    metals: Sequence[str] = tuple(METALS),
    coats: Sequence[str] = tuple(COATS),
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    paths: int = 200_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Numbers of each metal and coat, by `name`, and of each column but the truth:

    `rmse` and `rmse_error` of its picture; of the colour of all reflected light the `difference` to that of the truth
    over `cosines` (CIE 1976), at the `normal` and `mean` over the cosines; and the mean over colours of its `energy`
    less that of the truth, at the `normal` and the `worst`. `albedo` has all colours, those of the truth with noise.
    Of ways to integrate over wavelengths the `integration` errors. And `pictures`.
    """
    cells, pictures = [], []
    each = [(f"{metal}, {coat}", METALS[metal], COATS[coat]) for metal in metals for coat in coats]
    for name, metal, coat in canvas.track(each, progress):
        stack = stack_of(metal, coat)
        made = {who: canvas.bsdf(stack, who) for who in (TRUTH, OURS)}
        made |= {who: neighbours.bsdf(show(metal, coat)) for who, show in neighbours.NEIGHBOURS.items()}
        albedo = {
            who: [canvas.sampled(one, cosine, paths, seed).weight.mean(axis=0) for cosine in COSINES]
            for who, one in made.items()
        }
        images = {who: canvas.taken(one, who, "sphere", "studio", size, spp, seed) for who, one in made.items()}
        pictures.append({who: passes.mean(axis=0).tolist() for who, passes in images.items()})
        cell: dict[str, Any] = {"name": name, "albedo": {who: np.array(x).tolist() for who, x in albedo.items()}}
        truth, seen = np.array(albedo.pop(TRUTH)), images.pop(TRUTH)
        cell |= canvas.errors(images, seen)
        cell |= {"difference": {}, "normal": {}, "mean": {}, "energy": {}, "worst": {}}
        for who, colours in albedo.items():
            difference = colour_difference(np.array(colours), truth)
            energy = (np.array(colours) - truth).mean(axis=-1)
            cell["difference"][who] = difference.tolist()
            cell["normal"][who], cell["mean"][who] = float(difference[0]), float(difference.mean())
            cell["energy"][who], cell["worst"][who] = float(energy[0]), float(energy[np.abs(energy).argmax()])
        cells.append(cell)
    return {"cosines": list(COSINES), "cells": cells, "integration": integration(), "pictures": pictures}


def integration(cosines: Sequence[float] = (1.0, 0.5)) -> dict[str, Any]:
    """Errors of colours of films of 0 to 5,000 nm, at `most` and the `mean`: of ours, of Gaussians fitted to the
    observer with three orders, and of three wavelengths. The film is that on titanium."""
    at = np.array(cosines)
    wavenumbers = np.linspace(1 / RANGE_NM[1], 1 / RANGE_NM[0], FINE)
    weights = srgb_sensitivity(1 / wavenumbers) / wavenumbers**2
    weights /= weights.sum(axis=1, keepdims=True)
    errors: dict[str, list[Array]] = {"ours": [], "Gaussians": [], "three wavelengths": []}
    for thickness_nm in THICKNESSES_NM:
        metal = replace(TITANIUM, thickness_nm=float(thickness_nm))
        film, media = [films.OpticalFilm(metal.film_eta, 0.0, metal.thickness_nm)], list(zip(metal.eta, metal.k))
        spectra = [films.coherent(at[:, None], 1 / wavenumbers, 1.0, film, n, k).reflected for n, k in media]
        exact = np.clip(np.stack([found @ row for found, row in zip(spectra, weights)]), 0, 1)
        colours = ColouredFilm((metal.film_eta,) * 3, (0.0,) * 3, metal.thickness_nm)
        coating = Coating((colours,), (1.0,) * 3, metal.eta, metal.k)
        errors["ours"].append(coating.reflectance(at, srgb_sensitivity) - exact)
        errors["Gaussians"].append(neighbours.interference(at, 1.0, metal, neighbours.fitted).T - exact)
        each = [films.coherent(at, nm, 1.0, film, n, k).reflected for nm, (n, k) in zip(PRIMARIES_NM, media)]
        errors["three wavelengths"].append(np.stack(each) - exact)
    return {
        who: {"most": float(np.abs(found).max()), "mean": float(np.abs(found).mean())} for who, found in errors.items()
    }


def colour_difference(a: Array, b: Array) -> Array:
    """Distance in L*a*b* of colours (..., 3) in linear sRGB, white being that of D65 (CIE 1976)."""
    return np.asarray(np.linalg.norm(lab(a) - lab(b), axis=-1))


@canvas.page()
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for each material: spheres, and the colours of all reflected light from the normal to grazing angles."""
    figure.set_size_inches(2.1 * (len(COLUMNS) + 1), 2.2 * len(numbers["cells"]))
    axes = figure.subplots(len(numbers["cells"]), len(COLUMNS) + 1, squeeze=False)
    for row, cell, pictures in zip(axes, numbers["cells"], numbers["pictures"]):
        seen = canvas.shown(pictures)
        for axis, who in zip(row, COLUMNS):
            canvas.show(axis, seen[who], "")
            said = cell["name"] if who == TRUTH else canvas.error_label(cell, who)
            axis.set_title(f"{who}\n{said}", fontsize=8)
        strips = [np.repeat(np.array(cell["albedo"][who])[None], BANDS, axis=0) for who in COLUMNS]
        picture = np.repeat(np.concatenate(strips), BANDS * len(COLUMNS) // len(COSINES), axis=1)
        row[-1].imshow(scenes.tone_map(picture))
        row[-1].set(xticks=(), yticks=[BANDS * (k + 0.5) for k in range(len(COLUMNS))], yticklabels=COLUMNS)
        row[-1].tick_params(labelsize=6, length=0)
        row[-1].set_title("colour, normal to cos .1", fontsize=8)
