"""Thin films on interfaces that polarise light: against `tmm`, s and p apart, at one wavelength.

Walks are compared at 4.5 standard errors (a false alarm in 150 000), about 150 times: they fail by chance for one
choice of seeds in 1 000. The seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import tmm
from mixed_films import light_of, random_mixed

from velatura.films import polarised
from velatura.optics import fresnel
from velatura.optics.coatings import Coating, ColouredFilm
from velatura.reference import statistics, stokes
from velatura.stack import Film, Interface, Stack, srgb_sensitivity

WAVELENGTH = 540.0  # nm
SIGMAS = 4.5
SAMPLED = 5e-4  # what samples of a reflectance over the cosine leave

Array = np.ndarray


@pytest.fixture
def one_wavelength() -> Iterator[None]:
    with light_of(WAVELENGTH):
        yield


@pytest.mark.usefixtures("one_wavelength")
@pytest.mark.parametrize(
    ("depths_nm", "k"), [([], 0.0), ([130.0], 0.0), ([90.0, 210.0, 40.0], 0.0), ([90.0, 60.0], 0.3)]
)
def test_matrices_are_those_of_the_amplitudes(depths_nm: list[float], k: float) -> None:
    """From both sides, under total reflection too: shares of s and p, and their phases. The first film may absorb."""
    n = [1.1, *[2.0 + 1j * k, 1.4, 2.3][: len(depths_nm)], 1.7]
    films = tuple(ColouredFilm((float(np.real(x)),) * 3, (float(np.imag(x)),) * 3, d) for x, d in zip(n[1:], depths_nm))
    found = polarised.polarised_films(Coating(films, (1.1,) * 3, (1.7,) * 3), False, srgb_sensitivity)
    for indices, depths in ((n, depths_nm), (n[::-1], depths_nm[::-1])):
        eta = indices[-1] / indices[0]
        for cosine in (0.05, 0.3, 0.55, 0.76, 0.9, 1.0):
            s, p = (
                tmm.coh_tmm(kind, indices, [np.inf, *depths, np.inf], np.arccos(cosine), WAVELENGTH) for kind in "sp"
            )
            cos_t = float(fresnel.cos_transmitted(cosine, eta))
            cosines = np.array([cosine]), np.array([cos_t])
            reflection, refraction = found.dielectric(np.array(eta > 1), *cosines, eta, np.ones(1))
            product = reflection.real[0, 0] + 1j * reflection.imaginary[0, 0]
            assert product == pytest.approx(s["r"] * np.conj(p["r"]), abs=2e-3)
            assert reflection.s[0, 0] == pytest.approx(s["R"], abs=1e-3)
            assert reflection.p[0, 0] == pytest.approx(p["R"], abs=1e-3)
            if cos_t > 0:
                assert refraction.s[0, 0] == pytest.approx(s["T"], abs=1e-3)
                through = s["t"] * np.conj(p["t"]) / abs(s["t"] * p["t"]) * np.sqrt(s["T"] * p["T"])
                assert refraction.real[0, 0] + 1j * refraction.imaginary[0, 0] == pytest.approx(through, abs=2e-3)


def test_smooth_stacks_with_films_are_those_of_tmm() -> None:
    """Both kinds of light, reflected and transmitted: films between media that are thick, clear or absorb, and films
    that absorb over metals."""
    rng = np.random.default_rng(8)
    for _ in range(12):
        mixed, cosine = random_mixed(rng, thickest_nm=800)  # of one wavelength, thick films have fine fringes
        cosine = max(cosine, 0.1)
        with light_of(mixed.wavelength_nm):
            found = stokes(mixed.stack, cosine, phi=rng.uniform(0, 6), paths=60_000)
        error = found.standard_error
        assert error is not None
        sides = [(found.reflected, error.reflected)]
        if found.transmitted is not None and error.transmitted is not None:
            sides.append(([found.transmitted], [error.transmitted]))
        s, p = (mixed.exact(kind, cosine) for kind in "sp")
        for k, (lobes, errors) in enumerate(sides):
            total, noise = np.sum(lobes, axis=0)[:, 0], np.sqrt(np.sum(np.square(errors), axis=0))[:, 0]
            # The intensity, and how much more is s than p
            for found_it, of_noise, expected in zip(total, noise, (0.5 * (s[k] + p[k]), 0.5 * (s[k] - p[k]))):
                assert abs(found_it[0] - expected) < SIGMAS * of_noise[0] + SAMPLED, (mixed, cosine)


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
