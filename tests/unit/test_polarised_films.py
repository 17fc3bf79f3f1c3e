"""Thin films on interfaces that polarise light: against `tmm`, s and p apart, at one wavelength.

Walks are compared at 4.5 standard errors (a false alarm in 150 000), about 150 times: they fail by chance for one
choice of seeds in 1 000. The seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import tmm

from velatura.optics import coatings, fresnel
from velatura.optics.coatings import Coating, ColouredFilm
from velatura.reference import statistics, stokes
from velatura.sampling import coated, polarised_films
from velatura.stack import Film, Interface, Layer, Medium, Stack, srgb_sensitivity

WAVELENGTH = 540.0  # nm
SIGMAS = 4.5
SAMPLED = 5e-4  # what samples of a reflectance over the cosine leave
THICK = 1e6  # nm, of a medium

Array = np.ndarray


@pytest.fixture
def one_wavelength(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Colours are those of light of one wavelength."""

    def at(share: Any, cosines: Array, *_: Any) -> Array:
        return np.repeat(share(np.array([WAVELENGTH]), cosines).T, 3, axis=0)

    def forget() -> None:
        coated._coated.cache_clear()
        polarised_films.polarised_films.cache_clear()

    monkeypatch.setattr(coatings, "integrated", at)
    forget()
    yield
    forget()


@pytest.mark.usefixtures("one_wavelength")
@pytest.mark.parametrize("depths_nm", [[], [130.0], [90.0, 210.0, 40.0]])
def test_matrices_are_those_of_the_amplitudes(depths_nm: list[float]) -> None:
    """From both sides, under total reflection too: shares of s and p, and their phases."""
    n = [1.1, *[2.0, 1.4, 2.3][: len(depths_nm)], 1.7]
    films = tuple(ColouredFilm((x,) * 3, (0.0,) * 3, d) for x, d in zip(n[1:-1], depths_nm))
    found = polarised_films.polarised_films(Coating(films, (1.1,) * 3, (1.7,) * 3), False, srgb_sensitivity)
    for indices, depths in ((n, depths_nm), (n[::-1], depths_nm[::-1])):
        eta = indices[-1] / indices[0]
        for cosine in (0.05, 0.3, 0.55, 0.76, 0.9, 1.0):
            s, p = (
                tmm.coh_tmm(kind, indices, [np.inf, *depths, np.inf], np.arccos(cosine), WAVELENGTH) for kind in "sp"
            )
            cos_t = float(fresnel.cos_transmitted(cosine, eta))
            reflection, refraction = found.dielectric(np.array([cosine]), np.array([cos_t]), eta, np.ones(1))
            product = reflection.real[0, 0] + 1j * reflection.imaginary[0, 0]
            assert product == pytest.approx(s["r"] * np.conj(p["r"]), abs=2e-3)
            assert reflection.s[0, 0] == pytest.approx(s["R"], abs=1e-3)
            assert reflection.p[0, 0] == pytest.approx(p["R"], abs=1e-3)
            if cos_t > 0:
                through = s["t"] * np.conj(p["t"]) / abs(s["t"] * p["t"]) * np.sqrt(s["T"] * p["T"])
                assert refraction.real[0, 0] + 1j * refraction.imaginary[0, 0] == pytest.approx(through, abs=2e-3)


@pytest.mark.usefixtures("one_wavelength")
def test_smooth_stacks_with_films_are_those_of_tmm() -> None:
    """Both kinds of light, reflected and transmitted: films between media that are thick, clear or absorb, and films
    that absorb over metals."""
    rng = np.random.default_rng(8)
    for _ in range(12):
        layers, indices, lengths = random_stack(rng)
        cosine = float(rng.uniform(0.15, 0.95))
        found = stokes(Stack(layers), cosine, phi=rng.uniform(0, 6), paths=60_000)
        error = found.standard_error
        assert error is not None
        kinds = ["i" if x in (THICK, np.inf) else "c" for x in lengths]
        sides = [(found.reflected, error.reflected, "R")]
        if found.transmitted is not None and error.transmitted is not None:
            sides.append(([found.transmitted], [error.transmitted], "T"))
        exact = [tmm.inc_tmm(kind, indices, lengths, kinds, np.arccos(cosine), WAVELENGTH) for kind in "sp"]
        for lobes, errors, name in sides:
            total, noise = np.sum(lobes, axis=0)[:, 0], np.sqrt(np.sum(np.square(errors), axis=0))[:, 0]
            # Unpolarised light is light of both kinds, whose means and difference are known; light that passes tells
            # them apart at the last surface alone
            expected = np.mean([x[name] for x in exact])
            assert abs(total[0, 0] - expected) < SIGMAS * noise[0, 0] + SAMPLED, (indices, lengths, cosine)
            of_q = 0.5 * (exact[0][name] - exact[1][name])
            assert abs(total[1, 0] - of_q) < SIGMAS * noise[1, 0] + SAMPLED, (indices, lengths, cosine)


def random_stack(rng: np.random.Generator) -> tuple[list[Layer], list[complex], list[float]]:
    """Layers, and indices and thicknesses as `tmm` has them."""
    layers: list[Layer] = []
    indices: list[complex] = [1.0]
    lengths = [np.inf]
    count = int(rng.integers(1, 4))
    opaque = rng.uniform() < 0.5
    for k in range(count):
        metal = opaque and k == count - 1
        n = complex(rng.uniform(0.2, 2), rng.uniform(0.5, 4)) if metal else complex(rng.uniform(1.1, 2.2))
        films = [
            Film(eta=rng.uniform(1.2, 2.5), k=rng.uniform(0, 0.5) if metal else 0.0, thickness_nm=rng.uniform(20, 500))
            for _ in range(rng.integers(0, 3))
        ]
        layers.append(Interface(eta=n.real, k=n.imag if metal else None, films=films))
        indices += [complex(film.eta, film.k) for film in films]
        lengths += [float(film.thickness_nm) for film in films]
        tau = 0.0
        if k < count - 1 and rng.uniform() < 0.5:
            tau = rng.uniform(0, 0.5)
            layers.append(Medium(depth=tau, sigma_a=1.0))
        last = k == count - 1
        indices.append(n if last else n + 1j * tau * WAVELENGTH / (4 * np.pi * THICK))
        lengths.append(np.inf if last else THICK)
    return layers, indices, lengths


@pytest.mark.parametrize("alpha", [0.0, 0.3])
def test_one_interface_with_films_reflects_the_same_with_polarisation(alpha: float) -> None:
    """Unpolarised light that meets a facet once."""
    film = Film(eta=(1.9, 2.0, 2.1), thickness_nm=400)
    for layer, exterior in (
        (Interface(eta=1.5, alpha=alpha, films=[film]), 1.0),
        (Interface(eta=1.0, alpha=alpha, films=[film]), 1.5),
        (Interface(conductor="Al", alpha=alpha, films=[film]), 1.0),
    ):
        stack = Stack([layer], exterior=exterior)
        plain, polarised = (statistics(stack, [0.9, 0.3], paths=20_000, polarised=x) for x in (False, True))
        assert polarised.energy[0] == pytest.approx(plain.energy[0], abs=2e-3)
