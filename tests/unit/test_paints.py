"""K and S from measurements, and concentrations for a wished colour, against random walks and known mixtures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import inverse, reference
from velatura.errors import InvalidInput
from velatura.inverse import paints
from velatura.inverse.fitting import simplify
from velatura.stack import Named, load, spectrum

NM = np.arange(400, 701, 20.0)
K = 0.05 + 4 * np.exp(-(((NM - 600) / 60) ** 2))
S = 3 - (NM - 400) / 300
BLACK, WHITE, DEPTH = 0.04, 0.83, 0.4
COS_8 = np.cos(np.radians(8))


def spectral(values: Any) -> dict[str, Any]:
    return {"spectrum": np.stack([NM, values + 0 * NM], axis=1)}


def bump(nm: float, width: float) -> Any:
    return np.exp(-(((NM - nm) / width) ** 2))


COLOURED = [
    {"name": "white", "K": 0.02, "S": 60},
    {"name": "blue", "K": [60, 25, 4], "S": [2, 3, 6]},
    {"name": "red", "K": [2, 30, 40], "S": [8, 3, 2]},
    {"name": "yellow", "K": [0.5, 3, 50], "S": [12, 10, 2]},
]
SPECTRAL = [
    {"name": "white", "K": spectral(0.02), "S": spectral(60)},
    {"name": "blue", "K": spectral(60 * bump(620, 80)), "S": spectral(3)},
    {"name": "red", "K": spectral(50 * bump(490, 80)), "S": spectral(4)},
]


def paint(pigments: list[dict[str, Any]], shares: Any = None, depth: float = 0.1) -> vt.Stack:
    shares = np.ones(len(pigments)) if shares is None else shares
    mixed = [{**pigment, "concentration": float(c)} for pigment, c in zip(pigments, shares)]
    return vt.Stack([vt.Interface(eta=1.5), vt.Medium(depth=depth, pigments=mixed), vt.Diffuse(albedo=0.8)])


# K and S from measurements


def readings(g: float, interface: vt.Interface, specular: bool) -> list[np.ndarray]:
    """Reflectances of the film over both grounds, wavelength by wavelength."""
    found: list[list[float]] = [[], []]
    for k, s in zip(K, S):
        for ground, each in zip((BLACK, WHITE), found):
            film = vt.Medium(depth=DEPTH, pigments=[{"K": float(k), "S": float(s)}], g=g)
            lobes = vt.lobes(vt.Stack([interface, film, vt.Diffuse(albedo=ground)]), COS_8)
            each.append(float((specular * lobes.energy[0] + lobes.remainder)[0, 0]))
    return [np.array(each) for each in found]


@pytest.mark.parametrize(("g", "alpha", "specular"), [(0.0, 0.0, True), (0.6, 0.2, False)])
def test_a_pigment_is_found_from_its_film_over_black_and_white(g: float, alpha: float, specular: bool) -> None:
    """Also that Kubelka and Munk's formulas alone err by a fifth: light below a surface is not diffuse at first."""
    interface = vt.Interface(eta=1.5, alpha=alpha)
    black, white = readings(g, interface, specular)
    found = inverse.fit_pigment(NM, black, white, DEPTH, BLACK, WHITE, interface, g, specular)
    np.testing.assert_allclose(found.K, K, rtol=2e-3)
    np.testing.assert_allclose(found.S, S, rtol=2e-3)
    assert np.abs(found.error).max() < 1e-6
    assert 0.1 < np.abs(found.guess / [K, S] - 1).max() < 0.7
    assert np.all(found.spread < 0.05)


def test_a_pigment_is_found_from_random_walks() -> None:
    """Three films by the walk, 400,000 paths each: K and S within 4.5 standard errors and .5 % (as the energies')."""
    k, s = np.array([[0.1, 1.0, 3.0], [3.0, 2.0, 1.5]])
    film = vt.Medium(depth=DEPTH, sigma_a=tuple(k / 2), sigma_s=tuple(4 / 3 * s))
    seen, noise = [], []
    for seed, ground in enumerate((BLACK, WHITE)):
        stack = vt.Stack([vt.Interface(eta=1.5), film, vt.Diffuse(albedo=ground)])
        walked = reference.statistics(stack, COS_8, paths=400_000, seed=seed)
        assert walked.standard_error is not None
        seen.append(np.sum(walked.energy, axis=0)[:, 0])
        noise.append(np.linalg.norm(walked.standard_error.energy, axis=0)[:, 0])
    found = inverse.fit_pigment([450, 550, 650], seen[0], seen[1], DEPTH, BLACK, WHITE)
    allowed = 4.5 * found.spread * np.max(noise, axis=0) / paints.READING + 0.005
    assert np.all(np.abs(np.log([found.K / k, found.S / s])) < allowed)
    assert np.all(allowed < 0.12)


def test_films_that_leave_a_value_open_say_so() -> None:
    """A film that hides its ground has a ratio of K and S; one that does not scatter has K alone."""
    hides = inverse.fit_pigment([500, 600], [0.4, 0.3], [0.4, 0.3], DEPTH, BLACK, WHITE)
    assert np.abs(hides.error).max() < 2e-3
    assert np.all(hides.spread > 1)
    clear = inverse.fit_pigment([500, 600], [0.042, 0.041], [0.45, 0.3], DEPTH, 0.0, WHITE)
    assert np.abs(clear.error).max() < 2e-3
    assert np.all(clear.spread[0] < 0.05) and np.all(clear.spread[1] > 0.1)


def test_a_pigment_is_written_for_materials_to_name(tmp_path: Path) -> None:
    found = inverse.PigmentFit(NM, K, S, np.zeros((2, 16)), np.zeros((2, 16)), np.stack([K, S]))
    found.save(tmp_path / "blue.csv", "blue\nK, S\x1b[31m")
    (tmp_path / "paint.json").write_text(
        '{"layers": [{"medium": {"pigments": [{"pigment": "blue.csv"}]}}, {"diffuse": {}}]}'
    )
    written, kept = load(tmp_path / "paint.json"), vt.Medium(pigments=[found.pigment])
    for key in ("sigma_a", "sigma_s"):
        np.testing.assert_allclose(written.layers[0].written(key).table(), kept.written(key).table(), rtol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wavelengths_nm": [500, 400]}, "wavelengths: must be two or more, in nanometres, which ascend"),
        ({"over_black": [0.1]}, "reflectances over black: must be 2, one for each wavelength, got 1"),
        ({"over_white": [50, 60]}, "reflectances over white: must lie in 0 to 1 (100 % is 1), got 50"),
        ({"over_white": [np.nan, 0.6]}, "reflectances over white: must lie in 0 to 1"),
        ({"black": 0.9}, "white: must be a brighter ground than black at every wavelength"),
        ({"white": [0.8, 0.8, 0.8]}, "white: must be a number in 0 to 1, or 2 of them"),
        ({"depth": 0.0}, "depth: must be above 0"),
        ({"interface": vt.Interface(conductor="Au")}, "nothing may lie below"),
    ],
)
def test_what_is_no_measurement_is_refused(change: dict[str, Any], message: str) -> None:
    given = {"wavelengths_nm": [400, 500], "over_black": [0.1, 0.2], "over_white": [0.5, 0.6], "depth": 1.0}
    with pytest.raises(InvalidInput) as caught:
        inverse.fit_pigment(**{**given, "black": BLACK, "white": WHITE, **change})
    assert message in str(caught.value)


# Concentrations


@pytest.mark.parametrize(("pigments", "depth"), [(COLOURED[:3], 0.1), (SPECTRAL, 0.5)], ids=["colours", "spectra"])
def test_a_mixtures_colour_is_reached_again(pigments: list[dict[str, Any]], depth: float) -> None:
    shares = np.array([0.5, 0.1, 0.2])
    mixed = paint(pigments, shares, depth)
    wished = seen(mixed)
    found = inverse.paint(paint(pigments, depth=depth), wished, total=float(shares.sum()))
    np.testing.assert_allclose(found.concentrations, shares, atol=2e-3)
    assert found.difference < 0.02
    np.testing.assert_allclose(seen(found.stack), wished, atol=2e-4)


def seen(stack: vt.Stack) -> np.ndarray:
    """Its colour without the surface's reflection, by wavelengths if it has spectra."""
    nm, weights = paints.observer()
    if not hasattr(stack.flat()["layer1_sigma_a"], "table"):
        return np.asarray(vt.lobes(stack, COS_8).remainder[:, 0])
    material = paints.at_wavelengths(stack, nm)
    return np.asarray(weights @ paints.reflectance(material, specular=False))


def test_a_wished_spectrum_is_reached() -> None:
    shares = np.array([0.3, 0.2, 0.1])
    nm, _ = paints.observer()
    mixed = paint(SPECTRAL, shares)
    material = paints.at_wavelengths(mixed, nm)
    wish = vt.Spectrum(spectrum=np.stack([nm, paints.reflectance(material)], axis=1))
    found = inverse.paint(paint(SPECTRAL), wish, specular=True)
    np.testing.assert_allclose(found.concentrations, shares, rtol=0.02)
    assert found.difference < 0.05


def test_a_colour_that_no_mixture_has_is_approached_within_the_bounds() -> None:
    found = inverse.paint(paint(COLOURED[:2]), [0.9, 0.1, 0.0], most=0.3)
    assert found.difference > 10
    assert json.loads(json.dumps(found.to_dict()))["wished"] == [0.9, 0.1, 0.0]
    assert np.all((found.concentrations >= 0) & (found.concentrations <= 0.3))


@pytest.mark.parametrize(
    ("stack", "wish", "options", "message"),
    [
        (vt.Stack([vt.Diffuse()]), [0.1, 0.1, 0.1], {}, "layers: no medium has pigments"),
        (paint(COLOURED), [0.1, 0.1], {}, "colour: must be three numbers, got 2"),
        (paint(COLOURED), [0.1, 0.1, 1.2], {}, "colour: must lie in 0 to 1"),
        (paint(COLOURED), [0.1, np.nan, 0.2], {}, "colour: must lie in 0 to 1"),
        (paint(COLOURED), vt.Spectrum(spectrum=[[400, 0.1], [700, 0.2]]), {}, "pigments: K and S are [r, g, b]"),
        (paint(COLOURED), [0.1, 0.1, 0.1], {"most": 0.0}, "most: must lie in 0 to 1e6"),
        (paint(COLOURED), [0.1, 0.1, 0.1], {"total": 5.0}, "total: must lie in 0 to 4"),
        (paint(SPECTRAL).replace(layer2_albedo=(0.1, 0.2, 0.3)), [0.1] * 3, {}, "layer2_albedo: is [r, g, b]"),
    ],
)
def test_what_is_no_wish_is_refused(stack: vt.Stack, wish: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        inverse.paint(stack, wish, **options)
    assert message in str(caught.value)


def test_a_simpler_stack_has_the_colours_of_pigments() -> None:
    """A spectrum that is flat is a number; depths add up."""
    media = [vt.Medium(depth=0.5, pigments=[{"K": spectral(2), "S": 3}]), vt.Medium(sigma_a=(1, 2, 3))]
    merged = simplify._merged(media)
    assert merged.sigma_a == pytest.approx((1.5, 2.5, 3.5))
    assert merged.sigma_s == pytest.approx(2.0)


def test_a_colour_is_that_of_all_wavelengths_by_themselves() -> None:
    """A spectral paint over a named metal, under a film, against stacks of numbers.

    (Under a named varnish all wavelengths are refracted by its mean index, and differ by up to .004 below a film.)
    """
    nm, weights = paints.observer()

    def stack(pigment: dict[str, Any], **metal: Any) -> vt.Stack:
        coat = vt.Interface(eta=1.5, alpha=0.1, films=[vt.Film(eta=1.8, thickness_nm=200)])
        return vt.Stack([coat, vt.Medium(depth=0.02, pigments=[pigment]), vt.Interface(**metal, alpha=0.2)])

    painted = stack(SPECTRAL[1], conductor="Au")
    material = paints.at_wavelengths(painted, nm)
    assert paints.paint_colour(painted) == pytest.approx(weights @ paints.reflectance(material, specular=False))
    eta, k = (np.interp(nm, *spectrum(Named("Au", part))) for part in ("eta", "k"))
    absorbed, together = np.interp(nm, NM, 60 * bump(620, 80)), paints.reflectance(material)
    for n in (0, 12, 24, 35):
        alone = stack({"K": float(absorbed[n]), "S": 3}, eta=float(eta[n]), k=float(k[n]))
        (one,) = paints.reflectance(paints.at_wavelengths(alone, nm[n : n + 1]))
        assert together[n] == pytest.approx(one, abs=3e-4)


def test_mixtures_of_materials_have_a_colour_and_no_recipe() -> None:
    parts = paint(COLOURED), vt.Stack([vt.Diffuse(albedo=(0.1, 0.2, 0.3))])
    mix = vt.Mix([(0.25, parts[0]), (0.75, parts[1])])
    of_parts = [paints.paint_colour(part) for part in parts]
    assert paints.paint_colour(mix) == pytest.approx(0.25 * of_parts[0] + 0.75 * of_parts[1])
    with pytest.raises(InvalidInput, match="paint: takes a single stack, not a mixture"):
        inverse.paint(mix, [0.2, 0.2, 0.2])
