"""Neighbours' films and coats, as the figure of films has them, against exact sums and the laws of any BSDF."""

from __future__ import annotations

import numpy as np
import pytest

import velatura as vt
from velatura.figures import films_under_coats, neighbours
from velatura.figures.neighbours import FilmedMetal
from velatura.optics import fresnel
from velatura.optics.films import OpticalFilm, coherent
from velatura.stack.spectra import srgb_weights

COSINES = np.array([1.0, 0.8, 0.5, 0.2])
TITANIUM = films_under_coats.TITANIUM


def summed(metal: FilmedMetal, n_1: float) -> np.ndarray:
    """The exact reflectance (N, 3), as colours in light of equal energy."""
    wavelengths_nm, weights = srgb_weights(d65=False)
    film = [OpticalFilm(metal.film_eta, 0.0, metal.thickness_nm)]
    each = [coherent(COSINES[:, None], wavelengths_nm, n_1, film, n, k).reflected for n, k in zip(metal.eta, metal.k)]
    return np.stack([found @ row for found, row in zip(each, weights)], axis=-1)


@pytest.mark.parametrize("n_1", [1.0, 1.5])
@pytest.mark.parametrize("thickness_nm", [0.0, 50.0, 160.0, 400.0])
def test_sums_over_orders_are_those_of_all_orders(
    n_1: float, thickness_nm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: exact with many orders; three miss some at grazing angles, and Gaussians are not the CIE's observer."""
    metal = FilmedMetal(TITANIUM.eta, TITANIUM.k, 0.1, TITANIUM.film_eta, thickness_nm)
    exact = np.clip(summed(metal, n_1), 0, 1)
    for sensitivity, error in ((neighbours.tabled, 0.05), (neighbours.fitted, 0.08)):
        assert neighbours.interference(COSINES, n_1, metal, sensitivity) == pytest.approx(exact, abs=error)
    monkeypatch.setattr(neighbours, "ORDERS", 30)
    assert neighbours.interference(COSINES, n_1, metal, neighbours.tabled) == pytest.approx(exact, abs=1e-3)


def test_colours_of_a_metal_stand_for_its_index() -> None:
    """Expected: without a film, in a vacuum, they are reflected at the normal and at the edge."""
    bare = FilmedMetal(TITANIUM.eta, TITANIUM.k, 0.1, 1.0, 0.0)
    cosines = np.array([1.0, fresnel.EDGE])
    found = neighbours.interference(cosines, 1.0, bare, neighbours.tabled, by_colours=True)
    expected = [[fresnel.conductor(c, n, k) for n, k in zip(bare.eta, bare.k)] for c in cosines]
    assert found == pytest.approx(np.array(expected), abs=1e-6)


@pytest.mark.parametrize("who", neighbours.NEIGHBOURS)
def test_only_reciprocity_is_broken(who: str) -> None:
    """Rationale: sampling, density and value belong together. Expected: albedo scaling favours one of two directions;
    false alarms .1 %."""
    parts = neighbours.NEIGHBOURS[who](TITANIUM, films_under_coats.COATS["rough coat"])
    assert vt.check(neighbours.bsdf(parts)).broken == ("reciprocity",)
