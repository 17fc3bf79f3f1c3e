"""Measured spectra: the names, the values, and their reduction to RGB as Mitsuba reduces spectra."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import velatura as vt
from velatura.errors import InvalidInput, MissingTool
from velatura.stack import Named, Spectrum, addressed, dumps, load, loads, names, rgb, save, spectra, spectrum

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

    wavelengths_nm, weights = spectra.srgb_weights()
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


# Tables of one's own -------------------------------------------------------------------------------------------------

FLAT = "# nm, eta\n400, 1.5\n\n700 1.5 # held beyond\n"


def table(path: Path, named: Named) -> Spectrum:
    path.write_text("\n".join(f"{nm} {value}" for nm, value in zip(*named.table())))
    return Spectrum(spectrum=path)


def test_a_table_is_used_as_a_name_is(tmp_path: Path) -> None:
    """Expected: the lobes of gold, indices of a table of its own; and of an absorption that is the same everywhere."""
    eta, k = (table(tmp_path / f"own.{part}.spd", Named("Au", part)) for part in ("eta", "k"))
    (tmp_path / "flat.txt").write_text(FLAT)
    flat = Spectrum(spectrum=tmp_path / "flat.txt")
    coat = vt.Interface(eta=1.5, alpha=0.1)
    gold = vt.Stack([coat, vt.Medium(sigma_a=1.5), vt.Interface(conductor="Au", alpha=0.2)])
    expected = vt.lobes(gold, 0.6)
    found = vt.lobes(vt.Stack([coat, vt.Medium(sigma_a=flat), vt.Interface(eta=eta, k=k, alpha=0.2)]), 0.6)
    np.testing.assert_allclose(found.energy, expected.energy, rtol=1e-12)
    (tmp_path / "red.txt").write_text("580 0\n620 0.9")
    red, green, blue = rgb(Spectrum(spectrum=tmp_path / "red.txt"))
    assert red > 0.7 and green < 0.1 and blue < 0.1
    (tmp_path / "green.txt").write_text("500 0\n510 1\n530 1\n540 0")  # more saturated than sRGB holds
    saturated = Spectrum(spectrum=tmp_path / "green.txt")
    assert rgb(saturated)[0] < 0 == addressed("layer1_albedo")[0].declared.reduced(saturated)[0]


def test_a_table_stays_with_its_material(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: named relative to the material file, in YAML and JSON; read once; unequal when it has changed."""
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables/flat.spd").write_text(FLAT)
    (tmp_path / "m.yaml").write_text("layers: [{interface: {eta: {spectrum: tables/flat.spd}}}]")
    monkeypatch.chdir(tmp_path / "tables")
    stack = load("../m.yaml")
    for name in ("again.json", "again.yaml"):
        save(stack, tmp_path / name)
        assert load(tmp_path / name) == stack == loads(dumps(stack)) == stack.replace(**stack.flat())
    assert "{spectrum: tables/flat.spd}" in (tmp_path / "again.yaml").read_text()
    (tmp_path / "tables/flat.spd").write_text(FLAT.replace("1.5", "1.6"))
    assert load("../m.yaml") != stack
    expected = vt.lobes(vt.Stack([vt.Interface(eta=1.5)]), 1.0)
    np.testing.assert_allclose(vt.lobes(stack, 1.0).energy[0], expected.energy[0], rtol=1e-12)


@pytest.mark.parametrize(
    "text, reason",
    [
        ("400 1.5\n700 1.5 1.6", "line 2: must be a wavelength in nanometres and a value"),
        ("nm eta\n400 1.5", "line 1: must be a wavelength in nanometres and a value"),
        ("700 1.5\n400 1.5", "line 2: wavelengths must ascend"),
        ("400 1.5\n500 nan", "line 2: must be finite"),
        ("500 1.5", "must hold values at two wavelengths or more, in nanometres, of visible light"),
        ("0.4 1.5\n0.7 1.5", "must hold values at two wavelengths or more, in nanometres, of visible light"),
        ("400 1.5\n700 -1", "must lie in 0.001 to 1e4, got -1.0"),
        (b"\xff\xfe\x00", "is not UTF-8 text (byte 0)"),
        ("#" * 2**20 + "#", "is larger than 1 MiB"),
    ],
)
def test_what_is_no_table_is_refused_in_a_line(text: str | bytes, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "own.spd"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    (tmp_path / "m.yaml").write_text("layers: [{interface: {eta: {spectrum: own.spd}}}]")
    with pytest.raises(InvalidInput) as caught:
        load(tmp_path / "m.yaml")
    where = f"{tmp_path / 'm.yaml'}: layer 0 (interface): eta: "
    assert str(caught.value).replace("spectrum: ", "") == f"{where}{path}: {reason}"


def test_only_colours_have_tables(tmp_path: Path) -> None:
    (tmp_path / "flat.spd").write_text(FLAT)
    for text, reason in (
        ("eta: 1.5, alpha: {spectrum: flat.spd}", r"alpha: unknown key 'spectrum' .*"),
        ("eta: {spectrum: none.spd}", r"eta: spectrum: file not found: .*none\.spd"),
        ("eta: {spectrum: flat.spd, scale: 2}", r"eta: unknown key 'scale' .*"),
    ):
        with pytest.raises(InvalidInput, match=rf"^material\.yaml: layer 0 \(interface\): {reason}$"):
            loads(f"layers: [{{interface: {{{text}}}}}]", folder=tmp_path)
