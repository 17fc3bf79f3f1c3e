"""Measured spectra: the names, the values, and their reduction to RGB as Mitsuba reduces spectra."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from velatura.errors import InvalidInput, MissingTool
from velatura.stack import Named, names, rgb, spectra, spectrum

CONDUCTORS, DIELECTRICS = names()

# Mitsuba keeps one variant a process: ask it in another one. Spectra that end within the visible range are held.
ASK_MITSUBA = """
import json, sys
import mitsuba as mi
mi.set_variant("scalar_rgb")
import velatura.stack as stack
answers = {}
for name in json.loads(sys.argv[1]):
    for part in ("eta", "k"):
        nm, values = (a.tolist() for a in stack.spectrum(stack.Named(name, part)))
        inside = [(w, v) for w, v in zip(nm, values) if 350 < w < 840]
        nm, values = zip((350, inside[0][1]), *inside, (840, inside[-1][1]))
        answers[f"{name}.{part}"] = list(mi.spectrum_list_to_srgb(list(nm), list(values), False, True))
print(json.dumps(answers))
"""


def test_the_names_an_artist_expects_are_there() -> None:
    assert {"Au", "Ag", "Al", "Cu", "Cr", "W", "gold", "silver", "copper", "aluminium"} <= set(CONDUCTORS)
    assert {"bk7", "water", "acrylic", "pmma", "diamond", "polyurethane", "lacquer", "glass"} <= set(DIELECTRICS)
    assert not set(CONDUCTORS) & set(DIELECTRICS)


def test_rgb_is_what_mitsuba_makes_of_the_spectrum() -> None:
    metals = [name for name in CONDUCTORS if name not in ("gold", "silver")]
    result = subprocess.run(
        [sys.executable, "-c", ASK_MITSUBA, json.dumps(metals)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    answers = json.loads(result.stdout.splitlines()[-1])
    assert len(answers) == 2 * len(metals)
    for key, expected in answers.items():
        name, part = key.rsplit(".", 1)
        ours = rgb(Named(name, part))
        assert np.abs(np.subtract(ours, expected)).max() < 0.01 * max(expected), key


@pytest.mark.parametrize("name", CONDUCTORS)
def test_every_metal_has_a_valid_index(name: str) -> None:
    assert min(rgb(Named(name, "eta"))) > 0
    assert min(rgb(Named(name, "k"))) >= 0
    wavelengths_nm, eta = spectrum(Named(name, "eta"))
    assert wavelengths_nm.shape == eta.shape
    assert np.all(np.diff(wavelengths_nm) > 0)


@pytest.mark.parametrize("name", DIELECTRICS)
def test_every_dielectric_has_a_valid_index(name: str) -> None:
    red, green, blue = rgb(Named(name, "eta"))
    assert 1 < red <= green + 1e-9 <= blue + 2e-9 < 4


@pytest.mark.parametrize(
    "name, index_d",  # at the helium d line, 587.56 nm: catalogue values
    [
        ("bk7", 1.51680),
        ("sf11", 1.78472),
        ("fused-silica", 1.45846),
        ("sapphire", 1.76823),
        ("water", 1.3333),
        ("pmma", 1.491),
        ("polycarbonate", 1.585),
        ("polystyrene", 1.592),
        ("diamond", 2.4175),
    ],
)
def test_refractive_index_at_the_d_line(name: str, index_d: float) -> None:
    assert np.interp(587.56, *spectrum(Named(name, "eta"))) == pytest.approx(index_d, abs=4e-4)


def test_a_flat_spectrum_stays_flat() -> None:
    assert rgb(Named("varnish", "eta")) == pytest.approx((1.5, 1.5, 1.5), abs=1e-12)


@pytest.mark.parametrize("name", ["Ag", "Al", "Cr", "Cu", "W"])
def test_reflectance_from_rgb_indices_is_near_that_of_the_whole_spectrum(name: str) -> None:
    def reflectance(eta: np.ndarray, k: np.ndarray) -> np.ndarray:
        return ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)

    wavelengths_nm, weights = spectra._srgb_weights()
    eta, k = (np.interp(wavelengths_nm, *spectrum(Named(name, part))) for part in ("eta", "k"))
    whole = weights @ reflectance(eta, k)
    reduced = reflectance(np.array(rgb(Named(name, "eta"))), np.array(rgb(Named(name, "k"))))
    assert reduced == pytest.approx(whole, abs=0.012)


def test_an_alias_is_the_same_material() -> None:
    assert rgb(Named("gold", "k")) == rgb(Named("Au", "k"))
    assert rgb(Named("glass", "eta")) == rgb(Named("bk7", "eta"))


@pytest.mark.parametrize("named", [Named("xyzzy", "eta"), Named("bk7", "k"), Named("mirror", "k"), Named("AlAs", "k")])
def test_what_has_no_spectrum_is_refused(named: Named) -> None:
    with pytest.raises(InvalidInput) as caught:
        spectrum(named)
    assert str(caught.value) == f"there is no spectrum of {named.part} for {named.name!r}"


@pytest.fixture
def no_mitsuba(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    cached = (spectra.names, spectra._folder)
    monkeypatch.setattr(spectra.PathFinder, "find_spec", lambda name: None)
    for function in cached:
        function.cache_clear()
    yield
    for function in cached:
        function.cache_clear()


def test_a_missing_wheel_is_named_with_the_command(no_mitsuba: None) -> None:
    with pytest.raises(MissingTool, match=r"pip install mitsuba$"):
        names()
