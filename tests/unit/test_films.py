"""Thin films: against `tmm`, by the laws of optics, and in the numbers of a renderer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import tmm

import velatura as vt
from velatura import kernel
from velatura.films.of_material import films_of
from velatura.optics import films, fresnel
from velatura.optics.coatings import Coating, ColouredFilm, quadrature
from velatura.optics.films import OpticalFilm
from velatura.shader import shader
from velatura.stack import Material
from velatura.stack.spectra import srgb_sensitivity, srgb_weights
from velatura.tables.microsurface_walks import shares_in_the_end

COSINES = np.linspace(0.01, 1, 34)


def random_stack(rng: np.random.Generator, clear: bool = False) -> dict[str, Any]:
    """Light, up to four films, and the media around them; half of the lower ones absorb, and a third of the films."""
    metal = not clear and rng.random() < 0.5
    return {
        "cos_theta": float(rng.uniform(0.001, 1)),
        "wavelength_nm": float(rng.uniform(360, 830)),
        "eta_1": float(rng.uniform(1, 2.5)),
        "films": [
            OpticalFilm(
                float(rng.uniform(1, 3)),
                0.0 if clear or rng.random() < 0.7 else float(rng.uniform(0, 3)),
                0.0 if rng.random() < 0.1 else float(rng.uniform(0, 5000) * rng.random() ** 3),
            )
            for _ in range(rng.integers(0, 5))
        ],
        "eta_2": float(rng.uniform(0.05, 4) if metal else rng.uniform(1, 2.5)),
        "k_2": float(rng.uniform(0, 8)) if metal else 0.0,
    }


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_three_thousand_random_stacks_are_those_of_tmm() -> None:
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(3_000):
        stack = random_stack(rng)
        found = films.coherent(**stack)
        index = [stack["eta_1"], *(f.eta + 1j * f.k for f in stack["films"]), stack["eta_2"] + 1j * stack["k_2"]]
        depth = [np.inf, *(f.thickness_nm for f in stack["films"]), np.inf]
        s, p = (tmm.coh_tmm(x, index, depth, np.arccos(stack["cos_theta"]), stack["wavelength_nm"]) for x in "sp")
        errors += [found.reflected_s - s["R"], found.reflected_p - p["R"]]
        errors += [found.transmitted_s - s["T"], found.transmitted_p - p["T"]]
    assert np.abs(errors).max() < 1e-6


def test_clear_films_lose_no_light() -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        stack = random_stack(rng, clear=True)
        found = films.coherent(**stack)
        assert found.reflected_s + found.transmitted_s == pytest.approx(1, abs=1e-9)
        assert found.reflected_p + found.transmitted_p == pytest.approx(1, abs=1e-9)


def test_as_much_passes_from_either_side() -> None:
    """At the same tangential momentum, also of films that absorb; beyond the critical angle, nothing."""
    rng = np.random.default_rng(2)
    for _ in range(300):
        stack = random_stack(rng)
        above, below = stack["eta_1"], stack["eta_2"]
        downwards = films.coherent(**{**stack, "k_2": 0.0})
        sin2 = (above / below) ** 2 * (1 - stack["cos_theta"] ** 2)
        if sin2 >= 1:
            assert downwards.transmitted == pytest.approx(0, abs=1e-9)
            continue
        upwards = films.coherent(np.sqrt(1 - sin2), stack["wavelength_nm"], below, stack["films"][::-1], above)
        assert upwards.transmitted_s == pytest.approx(downwards.transmitted_s, abs=1e-9)
        assert upwards.transmitted_p == pytest.approx(downwards.transmitted_p, abs=1e-9)


@pytest.mark.parametrize("eta", [0.6, 1.5, 2.4])
def test_a_thickness_of_0_is_no_film(eta: float) -> None:
    none = films.coherent(COSINES, 550.0, 1.0, [OpticalFilm(1.8, 0.3, 0.0)], eta)
    assert none.reflected == pytest.approx(fresnel.dielectric(COSINES, eta), abs=1e-9)
    metal = films.coherent(COSINES, 550.0, 1.0, [OpticalFilm(1.8, 0.3, 0.0)], eta, 2.0)
    assert metal.reflected == pytest.approx(fresnel.conductor(COSINES, eta, 2.0), abs=1e-9)


def test_a_quarter_wave_takes_away_the_reflection() -> None:
    """Of an index that is the mean of its neighbours' (Born and Wolf 1999, section 1.6)."""
    found = films.coherent(1.0, 550.0, 1.0, [OpticalFilm(1.5, 0.0, 550 / 6)], 2.25)
    assert found.reflected == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("thickness_nm", [0.0, 40.0, 700.0])
def test_light_that_grazes_a_film_is_nothing_special(thickness_nm: float) -> None:
    """At the critical angle of a film, its field is linear over its depth."""
    critical = np.sqrt(1 - (1.3 / 1.6) ** 2)
    around = [
        films.coherent(critical + d, 550.0, 1.6, [OpticalFilm(1.3, 0.0, thickness_nm)], 1.6) for d in (-1e-7, 0, 1e-7)
    ]
    for below, at, above in zip(*([x.reflected_s, x.reflected_p] for x in around)):
        assert at == pytest.approx(0.5 * (below + above), abs=1e-6)


def test_no_thickness_overflows() -> None:
    found = films.coherent(COSINES, 400.0, 1.0, [OpticalFilm(1.5, 3.0, 1e6)], 1.5)
    assert found.reflected == pytest.approx(fresnel.conductor(COSINES, 1.5, 3.0), abs=1e-9)
    assert found.transmitted == pytest.approx(np.zeros_like(COSINES), abs=1e-30)


def test_a_renderer_has_the_same_values_and_gradients() -> None:
    mi = kernel.mitsuba("llvm_ad_rgb")
    import drjit as dr

    def reflected(thickness: Any, eta: Any, cosine: Any) -> Any:
        stack = [OpticalFilm(1.4, 0.0, 120.0), OpticalFilm(eta, 0.05, thickness)]
        return films.coherent(cosine, 550.0, 1.0, stack, 0.9, 6.0).reflected

    cosine, thickness, eta = mi.Float(COSINES), mi.Float(480.0), mi.Float(2.3)
    dr.enable_grad(thickness, eta)
    found = reflected(thickness, eta, cosine)
    assert found.numpy() == pytest.approx(reflected(480.0, 2.3, COSINES), abs=2e-5)
    dr.backward(dr.sum(found))
    for value, step, at in ((thickness, 1e-3, (1, 0)), (eta, 1e-6, (0, 1))):
        ends = [reflected(480.0 + x * at[0], 2.3 + x * at[1], COSINES).sum() for x in (-step, step)]
        assert dr.grad(value)[0] == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-3)


# Colours


def white(value: float) -> tuple[float, float, float]:
    return (value, value, value)


def finely(coating: Coating, cosines: np.ndarray) -> np.ndarray:
    """Its reflectance over wavelengths .1 nm apart, with straight lines between the CIE's values."""
    at, weights = srgb_weights()
    wavelengths_nm = np.arange(360, 830.001, 0.1)
    found = []
    for c in range(3):
        stack = [OpticalFilm(film.eta[c], film.k[c], film.thickness_nm) for film in coating.films]
        media = coating.eta_1[c], stack, coating.eta_2[c], coating.k_2[c]
        spectrum = films.coherent(cosines[:, None], wavelengths_nm, *media).reflected
        weight = np.interp(wavelengths_nm, at, weights[c])
        found.append(spectrum @ weight / weight.sum())
    return np.clip(found, 0, 1)


@pytest.mark.parametrize("thickness_nm", [1.0, 90.0, 320.0, 777.0, 1500.0, 2900.0, 5000.0])
@pytest.mark.parametrize(
    ("eta", "k", "eta_2", "k_2"),
    [
        (1.46, 0.0, (0.81, 0.97, 1.12), (6.0, 5.3, 4.5)),
        (2.4, 0.0, white(1.5), white(0.0)),
        (1.33, 0.0, white(1.5), white(0.0)),
        (2.2, 0.05, (2.7, 2.5, 2.3), (3.8, 3.4, 3.1)),
    ],
)
def test_colours_are_those_of_a_fine_integration(
    thickness_nm: float, eta: float, k: float, eta_2: Any, k_2: Any
) -> None:
    cosines = np.array([1.0, 0.6, 0.2, 0.03])
    coating = Coating((ColouredFilm(white(eta), white(k), thickness_nm),), white(1.0), eta_2, k_2)
    found = coating.reflectance(cosines, srgb_sensitivity)
    assert np.abs(found - finely(coating, cosines)).max() < 1e-3


def test_a_harmonic_that_a_step_and_its_half_take_for_the_mean_is_seen() -> None:
    """Of a film of a high index on a metal, whose fifth harmonic has a hundredth of the light."""
    coating = Coating((ColouredFilm(white(2.5335), white(0.0), 3781.08),), white(1.0), white(0.94), white(3.484))
    for cosine in (np.array([1.0]), np.array([0.9])):
        assert np.abs(coating.reflectance(cosine, srgb_sensitivity) - finely(coating, cosine)).max() < 1e-3


def test_colours_of_several_films_are_those_of_a_fine_integration() -> None:
    """From either side of them; resonances between films ask for many wavelengths."""
    rng = np.random.default_rng(3)
    cosines = np.array([1.0, 0.5, 0.1])
    for _ in range(12):
        stack = tuple(
            ColouredFilm(tuple(rng.uniform(1.2, 2.6, 3)), white(0.0), float(rng.uniform(0, 1500))) for _ in range(3)
        )
        coating = Coating(stack, white(float(rng.choice([1.0, 1.5]))), tuple(rng.uniform(1.1, 2, 3)))
        found = coating.reflectance(cosines, srgb_sensitivity)
        assert np.abs(found - finely(coating, cosines)).max() < 3e-3


def test_a_film_of_no_thickness_has_no_colour() -> None:
    media = white(1.0), (0.81, 0.97, 1.12), (6.0, 5.3, 4.5)
    found = Coating((ColouredFilm(white(1.46), white(0.0), 0.0),), *media).reflectance(COSINES, srgb_sensitivity)
    for c in range(3):
        assert found[c] == pytest.approx(fresnel.conductor(COSINES, media[1][c], media[2][c]), abs=1e-9)


@pytest.mark.parametrize(
    ("eta", "k", "others", "base", "cosine"),
    [
        (1.5, 0.0, (), (2.2, 0.0), 1.0),
        (1.5, 0.0, (), (2.2, 0.0), 0.1),
        (1.9, 0.02, (ColouredFilm(white(1.38), white(0.0), 600.0),), (0.9, 5.0), 0.4),
    ],
)
def test_colours_change_with_thickness_as_they_do_with_fine_integration(
    eta: float, k: float, others: tuple[ColouredFilm, ...], base: tuple[float, float], cosine: float
) -> None:
    """No steps between numbers of wavelengths, and no ringing: of neighbours, differences are as they should be."""
    at = np.array([cosine])
    coatings = [
        Coating((ColouredFilm(white(eta), white(k), float(x)), *others), white(1.0), white(base[0]), white(base[1]))
        for x in np.linspace(0, 5000, 101)
    ]
    found = np.array([x.reflectance(at, srgb_sensitivity)[:, 0] for x in coatings])
    exact = np.array([finely(x, at)[:, 0] for x in coatings])
    assert np.abs(np.diff(found, axis=0) - np.diff(exact, axis=0)).max() < 1e-3


def random_films(rng: np.random.Generator, absorb: bool) -> tuple[vt.Film, ...]:
    """One to three, of any thickness; some coloured, and of those that absorb, two in three."""
    return tuple(
        vt.Film(
            eta=tuple(map(float, rng.uniform(1.2, 2.6, 3))) if rng.random() < 0.3 else float(rng.uniform(1.2, 2.6)),
            k=float(rng.uniform(0, 0.6)) if absorb and rng.random() < 0.7 else 0.0,
            thickness_nm=float(rng.uniform(0, 5000)),
        )
        for _ in range(rng.integers(1, 4))
    )


@pytest.mark.parametrize("kind", ["metal", "glass", "glass from inside"])
def test_what_is_sampled_is_a_fine_integration_at_any_angle(kind: str) -> None:
    """Also between samples and at grazing incidence; from inside, light beyond the critical angle is all reflected."""
    rng = np.random.default_rng([5, len(kind)])
    for _ in range(5):
        on_it = random_films(rng, kind == "metal")
        n = float(rng.uniform(1.2, 2.2))
        if kind == "metal":
            layer = vt.Interface(eta=(0.3, 0.9, 1.1), k=(3.5, 2.5, 2.2), films=on_it)
        else:
            layer = vt.Interface(eta=n if kind == "glass" else 1.0, films=on_it)
        stack = vt.Stack([layer], exterior=n if kind == "glass from inside" else 1.0)
        (sampled,) = films_of(Material.of(stack))
        assert sampled and sampled.coating
        cosines = np.array([*rng.uniform(0, 1, 8), *rng.uniform(1e-3, 0.05, 4), 1.0])
        assert np.abs(sampled.at(cosines, 1.0) - finely(sampled.coating, cosines)).max() < 3e-3
        if kind == "glass from inside":
            beyond = sampled.between(np.linspace(0, np.sqrt(1 - 1 / n**2), 9), np.zeros(9), 1.0)
            assert beyond == pytest.approx(np.ones((3, 9)), abs=1e-6)


# Thick films


def test_colours_of_thick_films_are_means_over_a_fine_spectrum() -> None:
    """Of optical thicknesses from 20 micrometres to 5 centimetres, alone, with a thin film and with another thick one;
    wavenumbers at random have no step that waves could follow."""
    rng = np.random.default_rng(8)
    wavenumber = rng.uniform(1 / 830, 1 / 360, 300_000)
    weights = srgb_sensitivity(1 / wavenumber) / wavenumber**2
    for index, thickness_nm, others, k in (
        (4.5, 5000.0, (), 0.0),
        (6.0, 4321.0, (), 1e-3),
        (9.0, 4990.0, (ColouredFilm(white(1.4), white(0.0), 120.0),), 0.0),
        (30.0, 4000.0, (), 0.0),
        (1000.0, 5000.0, (ColouredFilm(white(2.2), white(0.0), 300.0),), 0.0),
        (1e4, 5000.0, (), 0.0),
        (5.0, 5000.0, (ColouredFilm(white(8.0), white(0.0), 4700.0),), 0.0),
    ):
        coating = Coating((ColouredFilm(white(index), white(k), thickness_nm), *others), white(1.0), white(1.5))
        (found,) = coating.shares(["reflected"], np.array([0.7]), srgb_sensitivity)
        each = [OpticalFilm(film.eta[0], film.k[0], film.thickness_nm) for film in coating.films]
        exact = weights @ films.coherent(0.7, 1 / wavenumber, 1.0, each, 1.5).reflected / weights.sum(axis=1)
        # Resonances between faces that reflect nearly all are sharper than the wavelengths that they are given
        assert np.abs(found[:, 0] - exact).max() < (4e-3 if index < 10 else 7e-3)


def test_the_number_of_wavelengths_is_bounded() -> None:
    """Of the thickest films of the highest index, eight of them, from the least cosines to the greatest."""
    most = ColouredFilm(white(1e4), white(0.0), 5000.0)
    met = 0

    def sensitivity(wavelengths_nm: np.ndarray) -> np.ndarray:
        nonlocal met
        met += len(wavelengths_nm)
        return srgb_sensitivity(wavelengths_nm)

    Coating((most,) * 8, white(1.0), white(1.5)).reflectance(COSINES[:3], sensitivity)
    assert met < 5000
    assert len(quadrature(8 * 1e4 * 5000, srgb_sensitivity)[0]) < 5000


# Between facets


def test_of_light_between_facets_a_mirror_reflects_all_and_a_black_film_nothing() -> None:
    """A channel may be clipped to 0 at some angles."""
    cosines, alphas = np.array([0.2, 0.6, 1.0]), np.full(3, 0.4)

    def metal(cosine: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.stack([0 * cosine, cosine > 0.5, 0 * cosine + 1]), 0 * cosine

    (black, half, mirror), _ = shares_in_the_end(metal, None, cosines, alphas, 512)
    assert black == pytest.approx(np.zeros(3))
    assert np.all((half > 0.05) & (half < 0.95))
    assert mirror == pytest.approx(np.ones(3), abs=0.02)


@pytest.mark.parametrize("thickest_nm", [300.0, 5000.0])
def test_a_fixed_quadrature_has_the_colours_of_a_fine_one(thickest_nm: float) -> None:
    """Of random films on metals and glass, some of which absorb."""
    rng, off = np.random.default_rng(3), list[float]()
    for _ in range(40):
        k = float(rng.uniform(0, 1)) if rng.random() < 0.4 else 0.0
        film = OpticalFilm(float(rng.uniform(1.05, 3)), k, float(rng.uniform(0, thickest_nm)))
        below = float(rng.uniform(1.1, 3)), float(rng.uniform(0, 5) * (rng.random() < 0.5))
        cosine = np.array(rng.uniform(0.02, 1))

        fine = 1 / np.linspace(1 / 830, 1 / 360, 1 << 14)[1:-1]
        sensitivity = srgb_sensitivity(fine) * fine**2
        exact = fine, sensitivity / sensitivity.sum(axis=1, keepdims=True)
        both = (exact, quadrature(film.eta * film.thickness_nm, srgb_sensitivity))
        a, b = (np.clip(w @ films.coherent(cosine, nm, 1.0, [film], *below).reflected, 0, 1) for nm, w in both)
        off.append(float(np.abs(a - b).max()))
    assert max(off) < 4e-3 and np.mean(off) < 4e-4


@pytest.mark.parametrize("preset", [name for name in vt.presets(mixtures=False) if not any(vt.preset(name).films)])
def test_interfaces_without_films_have_no_tables(preset: str) -> None:
    """Neither rows of reflectances, nor a texture beside a shader."""
    assert not any(films_of(Material.of(vt.preset(preset))))
    assert shader(vt.preset(preset), "belcour2018").films is None
