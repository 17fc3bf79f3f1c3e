"""Pigments: as written, the coefficients that they give, and Kubelka and Munk's theory beside transport."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks import benchmark

import velatura as vt
from velatura.errors import InvalidInput
from velatura.optics import kubelka_munk
from velatura.stack import Spectrum, dumps, json_schema, load, loads, rgb, save, spectrum
from velatura.stack.pigments import Pigment, absorption, scattering

WHITE = {"name": "white", "K": 0.01, "S": 4.0}
BLUE = {"name": "blue", "K": [3.0, 0.8, 0.1], "S": [0.3, 0.4, 0.6]}
CSV = "# a blue\nwavelength_nm,K,S\n400,0.1,0.6\n500,0.2,0.5\n600,2,0.3\n700,3,0.3\n"
TABLE = {"K": {"spectrum": [[380, 0.1], [450, 0.1], [700, 2.0]]}, "S": {"spectrum": [[400, 1.0], [700, 2.0]]}}

#: Opaque paint of S = 1, as iadpython 0.5.3 (MIT) has it by adding-doubling with 16 nodes, beyond which it loses light:
#: K, g, and the reflectance of diffuse light without a surface, and along the normal under one of index 1.5.
ADDING_DOUBLING = np.array(
    [
        (0.003183, 0.0, 0.92352, 0.82886),
        (0.004361, 0.6, 0.91113, 0.80412),
        (0.03815, 0.8, 0.76105, 0.55194),
        (0.08923, 0.3, 0.6606, 0.42498),
        (0.2292, 0.0, 0.52023, 0.29312),
        (0.4592, 0.0, 0.40431, 0.2092),
        (0.5486, 0.8, 0.37319, 0.17558),
        (0.8127, 0.0, 0.30957, 0.15481),
        (1.716, 0.6, 0.19681, 0.09014),
        (3.387, 0.0, 0.12234, 0.07587),
        (3.888, 0.3, 0.10799, 0.06492),
        (4.293, 0.6, 0.09865, 0.05859),
    ]
)
BENCHMARK = benchmark("pigments")


def paint(pigments: list[dict[str, Any]], **values: Any) -> vt.Stack:
    return vt.Stack([vt.Interface(eta=1.5), vt.Medium(pigments=pigments, **values), vt.Diffuse(albedo=0.3)])


def sigma(stack: vt.Stack) -> tuple[Any, Any]:
    flat = stack.flat()
    return flat["layer1_sigma_a"], flat["layer1_sigma_s"]


# What a medium has of its pigments


def test_coefficients_follow_from_k_and_s() -> None:
    """K = 2 sigma_a and S = 3/4 (1 - g) sigma_s (Gate 1974), for any way to write the asymmetry."""
    assert sigma(paint([WHITE])) == pytest.approx((0.005, 4 / 3 * 4))
    assert sigma(paint([WHITE], g=0.5)) == pytest.approx((0.005, 8 / 3 * 4))
    two_lobes = {"forward": 0.8, "backward": -0.2, "share": 0.7}
    assert sigma(paint([WHITE], phase=two_lobes))[1] == pytest.approx(4 / 3 * 4 / (1 - 0.5))
    assert sigma(paint([WHITE], phase="rayleigh"))[1] == pytest.approx(4 / 3 * 4)


def test_mixtures_are_linear_in_concentrations() -> None:
    rng = np.random.default_rng(1)
    mixtures: list[list[dict[str, Any]]] = [
        [WHITE, BLUE],
        [TABLE, {"K": {"spectrum": [[500, 1.0], [600, 0.5]]}, "S": 0.4}],
    ]
    for each in mixtures:
        a, b = rng.uniform(0, 2, (2, 2))
        of = [sigma(paint([{**p, "concentration": c} for p, c in zip(each, x)])) for x in (a, b, a + b)]
        one, other, both = ([values(x) for x in found] for found in of)
        np.testing.assert_allclose(np.add(one, other), both, rtol=1e-12)


def values(found: Any) -> np.ndarray:
    """A coefficient as a colour, or at some wavelengths."""
    if isinstance(found, Spectrum):
        return np.interp([380, 450, 550, 650], *spectrum(found))
    return np.broadcast_to(found, 3)


def test_numbers_colours_and_spectra_mix() -> None:
    assert sigma(paint([WHITE, BLUE]))[0] == pytest.approx((1.505, 0.405, 0.055))
    mixed = sigma(paint([WHITE, {**TABLE, "concentration": 2.0}]))[0]
    assert isinstance(mixed, Spectrum)
    assert np.interp([300, 450, 575, 900], *spectrum(mixed)) == pytest.approx([0.105, 0.105, 1.055, 2.005])
    grey = vt.Stack([vt.Medium(pigments=[{"K": {"spectrum": [[400, 1], [700, 1]]}, "S": 1}]), vt.Diffuse()])
    assert rgb(grey.flat()["layer0_sigma_a"]) == pytest.approx((0.5, 0.5, 0.5))


def test_a_file_of_pigments_is_relative_to_the_material(tmp_path: Path) -> None:
    (tmp_path / "blue.csv").write_text(CSV, encoding="utf-8")
    (tmp_path / "paint.yaml").write_text(
        "layers: [{medium: {pigments: [{pigment: blue.csv, concentration: 0.5}]}}, {diffuse: {}}]", encoding="utf-8"
    )
    found = load(tmp_path / "paint.yaml")
    assert np.interp(500, *spectrum(found.flat()["layer0_sigma_a"])) == pytest.approx(0.05)
    assert np.interp(700, *spectrum(found.flat()["layer0_sigma_s"])) == pytest.approx(0.2)
    (tmp_path / "elsewhere").mkdir()
    save(found, tmp_path / "elsewhere" / "paint.yaml")
    assert load(tmp_path / "elsewhere" / "paint.yaml") == found


def test_a_material_with_pigments_is_written_and_read_back() -> None:
    for each in ([WHITE, {**BLUE, "concentration": 0.2}], [TABLE]):
        found = paint(each, depth=2.0, g=0.3)
        assert loads(dumps(found, "yaml")) == found
        assert loads(dumps(found, "json"), "material.json") == found
        assert vt.Stack.from_flat(found.kinds, found.flat()).flat() == found.flat()


def test_values_take_the_place_of_pigments_and_the_other_way_round() -> None:
    found = paint([WHITE, BLUE])
    absorbing = found.replace(layer1_sigma_a=0.3)
    assert sigma(absorbing) == (0.3, sigma(found)[1])
    assert "pigments" not in absorbing.to_dict()["layers"][1]["medium"]
    assert sigma(absorbing.replace(layer1_pigments=[WHITE, BLUE])) == sigma(found)
    assert sigma(found.replace(layer1_g=0.5))[1] == pytest.approx(2 * np.array(sigma(found)[1]))


def test_a_concentration_is_set_by_its_flat_name() -> None:
    found = paint([WHITE, BLUE])
    changed = found.replace(layer1_pigment1_concentration=0.5, layer1_pigment0_concentration=2)
    assert sigma(changed) == sigma(paint([{**WHITE, "concentration": 2.0}, {**BLUE, "concentration": 0.5}]))
    for name, message in {
        "layer1_pigment2_concentration": "layer 1 (medium): pigment2_concentration: the last pigment is pigment 1",
        "layer1_pigment0_K": "layer1_pigment0_K: layer 1 (medium) has no pigment0_K",
        "layer0_pigment0_concentration": "layer0_pigment0_concentration: layer 0 (dielectric) has no",
    }.items():
        with pytest.raises(InvalidInput) as caught:
            found.replace(**{name: 0.1})
        assert message in str(caught.value)
    with pytest.raises(InvalidInput, match="there are no pigments"):
        vt.Stack([vt.Medium(), vt.Diffuse()]).replace(layer0_pigment0_concentration=0.1)
    with pytest.raises(InvalidInput, match="pigments: pigment 1: concentration: must lie in 0 to 1e9, got -1"):
        found.replace(layer1_pigment1_concentration=-1)


def test_lossless_pigments_are_known() -> None:
    assert vt.Medium(pigments=[{"K": 0, "S": 1}]).lossless
    assert not vt.Medium(pigments=[WHITE]).lossless


@pytest.mark.parametrize(
    ("medium", "message"),
    [
        ({"pigments": [{"K": 1}]}, "pigments: pigment 0: S: missing; write K and S, or pigment"),
        ({"pigments": [WHITE, {"K": -1, "S": 1}]}, "pigments: pigment 1: K: must lie in 0 to 1e9, got -1"),
        ({"pigments": [WHITE], "sigma_a": 0.1}, "sigma_a: not together with pigments, which give it"),
        ({"pigments": [WHITE], "sigma_s": [0, 1, 0]}, "sigma_s: not together with pigments, which give it"),
        ({"pigments": [BLUE, TABLE]}, "pigments: K: is [r, g, b] of one pigment and a spectrum of another"),
        ({"pigments": [{"K": 1, "S": 1e9, "concentration": 5}]}, "pigments: sigma_s: must lie in 0 to 1e9"),
        ({"pigments": [{"K": 1, "S": 1, "concentration": -1}]}, "pigments: pigment 0: concentration: must lie in 0"),
        ({"pigments": [{"K": {"texture": "a.png"}, "S": 1}]}, "pigments: pigment 0: K: must be a number, [r, g, b], a"),
        ({"pigments": [{"K": {"spectrum": [[500, 1], [400, 1]]}, "S": 1}]}, "K: spectrum: wavelengths must ascend"),
        ({"pigments": [{"K": {"spectrum": [[500, -1], [600, 1]]}, "S": 1}]}, "K: spectrum: must lie in 0 to 1e9"),
        ({"pigments": [{"pigment": "blue.csv", "K": 1}]}, "pigments: pigment 0: pigment: file not found"),
        ({"pigments": [WHITE] * 17}, "pigments: must be at most 16 pigments, got 17"),
        ({"pigments": "white"}, "pigments: must be a list of pigments, got 'white'"),
        (
            {"pigments": [{**WHITE, "name": "\x1b[31mred"}]},
            "pigments: pigment 0: name: must be one line without control",
        ),
        ({"pigments": [{**WHITE, "hue": 1}]}, "pigments: pigment 0: unknown key 'hue'"),
    ],
)
def test_what_is_no_mixture_is_refused_in_one_line(medium: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        vt.Medium.from_dict(medium)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_asymmetry_that_varies_gives_no_one_scattering(tmp_path: Path) -> None:
    (tmp_path / "g.png").touch()
    with pytest.raises(InvalidInput, match="g: must be a number together with pigments"):
        vt.Medium(pigments=[WHITE], g={"texture": str(tmp_path / "g.png")})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("400 1", "line 1: must be a wavelength in nanometres, K and S"),
        ("nm,K,S\n400,1,1", "line 1: must be a wavelength in nanometres, K and S"),
        ("400,1,1\nwavelength_nm,K,S", "line 2: must be a wavelength in nanometres, K and S"),
        ("400,1,1\n400,1,1", "line 2: wavelengths must ascend"),
        ("400,1,nan\n500,1,1", "line 1: must be finite"),
        ("400,1,-1\n500,1,1", "K and S must lie in 0 to 1e+09"),
        ("400,1,1", "a list of 2 to 4096 rows"),
        ("1000,1,1\n2000,1,1", "must hold values at two wavelengths or more"),
        ("\x00", "line 1: must be a wavelength"),
        ("\n".join(f"{400 + n / 100},1,1" for n in range(5000)), "must hold at most 4096 rows, got 5000"),
    ],
)
def test_a_file_that_holds_no_pigment_is_refused_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "pigment.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        Pigment(pigment=path)
    assert str(path) in str(caught.value)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_schema_declares_pigments() -> None:
    schema = json_schema()
    assert set(schema["$defs"]["pigment"]["properties"]) == {"name", "pigment", "K", "S", "concentration"}


# Kubelka and Munk


def test_kubelka_and_munks_film_obeys_its_own_laws() -> None:
    """Expected: films without absorption as known, one film upon another, the opaque limit, and the way back."""
    k, s = np.array([[0.001, 0.1, 1.0, 5.0], [3.0, 1.0, 0.5, 0.2]])
    assert kubelka_munk.over(0.0, 2.0, 0.75, 0.0) == pytest.approx(1.5 / 2.5)  # S d / (1 + S d), Kubelka 1948
    below = kubelka_munk.over(k, s, 0.3, 0.6)
    np.testing.assert_allclose(kubelka_munk.over(k, s, 0.4, below), kubelka_munk.over(k, s, 0.7, 0.6), rtol=1e-9)
    np.testing.assert_allclose(kubelka_munk.over(k, s, 1e4, 0.2), kubelka_munk.opaque(k, s), rtol=1e-9)
    np.testing.assert_allclose(kubelka_munk.ratio(kubelka_munk.opaque(k, s)), k / s, rtol=1e-9)
    black, white = (kubelka_munk.over(k, s, 0.7, ground) for ground in (0.05, 0.8))
    np.testing.assert_allclose(kubelka_munk.coefficients(black, white, 0.05, 0.8, 0.7), [k, s], rtol=1e-6)


def test_the_surface_of_saundersons_correction() -> None:
    """Reflectances of 1.5 along the normal, and of diffuse light from inside: .0400 and .596 (Judd 1942)."""
    assert kubelka_munk.surface(1.5) == pytest.approx((0.04, 0.5963), abs=5e-5)
    assert kubelka_munk.surface(1.0) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert kubelka_munk.below(kubelka_munk.outside(0.4, 1.5), 1.5) == pytest.approx(0.4)


def test_opaque_paint_reflects_what_adding_doubling_has() -> None:
    for g in np.unique(ADDING_DOUBLING[:, 1]):
        k, _, diffuse, normal = ADDING_DOUBLING[ADDING_DOUBLING[:, 1] == g].T
        inside, outside = (BENCHMARK.opaque(k, np.ones_like(k), g, eta) for eta in (1.0, 1.5))
        np.testing.assert_allclose(BENCHMARK.diffuse(inside), diffuse, atol=3e-4)
        np.testing.assert_allclose(outside[:, -1], normal, atol=8e-4)


def test_opaque_paint_reflects_what_chandrasekhars_function_gives() -> None:
    """Diffuse light on a semi-infinite medium that scatters evenly: 1 - 2 sqrt(1 - w) times the integral of mu H."""
    k = np.array([1e-4, 1e-3, 3.183e-3, 0.03, 0.3, 3.0])
    x, weights = np.polynomial.legendre.leggauss(200)
    mu, weights = (x + 1) / 2, weights / 2
    albedo = scattering(1.0, 0.0) / (scattering(1.0, 0.0) + absorption(k))[:, None]
    h = np.ones((len(k), len(mu)))
    for _ in range(500):
        step = 1 / (np.sqrt(1 - albedo) + albedo / 2 * (h * mu * weights) @ (1 / (mu[:, None] + mu)))
        h = (h + step) / 2
    exact = 1 - 2 * np.sqrt(1 - albedo[:, 0]) * (h @ (mu * weights))
    np.testing.assert_allclose(BENCHMARK.diffuse(BENCHMARK.opaque(k, np.ones_like(k), 0.0)), exact, atol=3e-4)


def test_kubelka_and_munks_reflectance_of_mixtures_errs_by_what_is_known() -> None:
    k, s = BENCHMARK.mixtures(100, 35)
    for g, most in {0.0: 0.0091, 0.8: 0.0075}.items():
        error = BENCHMARK.diffuse(BENCHMARK.opaque(k, s, g)) - kubelka_munk.opaque(k, s)
        assert error.min() > 0 and error.max() < most
