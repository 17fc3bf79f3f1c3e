"""Pigments as a user types them: files that other verbs read, and one line for each failure."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from velatura.stack import load

Run = Callable[..., tuple[int, str, str]]

FILM = """wavelength_nm,black,white
450,0.6126,0.7189
550,0.2907,0.3250
650,0.1303,0.1347
"""
PAINT = """layers:
  - interface: {eta: 1.5}
  - medium:
      depth: 1
      pigments:
        - {name: white, K: 0.01, S: 4}
        - {pigment: blue.csv}
  - diffuse: {}
"""
FIT = "pigment", "film.csv", "--depth", "0.4", "--black", "0.04", "--white", "0.83"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a measurement."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "film.csv").write_text(FILM, encoding="utf-8")
    (tmp_path / "paint.yaml").write_text(PAINT, encoding="utf-8")
    return tmp_path


def test_a_measurement_becomes_a_pigment_and_that_a_paint(run: Run, folder: Path) -> None:
    status, out, err = run(*FIT, "--json")
    assert (status, err) == (0, "")
    found = json.loads(out)
    assert np.abs(found["error"]).max() < 1e-4
    status, out, err = run(*FIT, "-o", "blue.csv")
    assert (status, err) == (0, "") and "blue.csv" in out
    rows = np.loadtxt("blue.csv", delimiter=",", skiprows=2)
    np.testing.assert_allclose(rows[:, 1], found["K"], rtol=1e-5)
    status, out, err = run("paint", "paint.yaml", "--colour", "#8090c0", "-o", "grey.yaml")
    assert (status, err) == (0, "")
    assert all(word in out for word in ("white", "blue.csv", "colour difference", "grey.yaml"))
    white, blue = load("grey.yaml").layers[1].pigments  # type: ignore[union-attr]
    assert blue.concentration > 0 and white.concentration > 0


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ((*FIT[:-1], "0.01"), "white: must be a brighter ground than black at every wavelength"),
        (("pigment", "none.csv", *FIT[2:]), "none.csv: file not found"),
        (("pigment", "percent.csv", *FIT[2:]), "percent.csv: reflectances over black: must lie in 0 to 1 (100 % is 1)"),
        (("pigment", "text.csv", *FIT[2:]), "text.csv: line 1: must be a wavelength in nanometres, reflectances over"),
        ((*FIT, "-o", "blue.yaml"), "blue.yaml: a file of a pigment ends in .csv"),
        (("paint", "plain.yaml", "--colour", "#8090c0"), "layers: no medium has pigments"),
        (("paint", "coloured.yaml"), "--colour: write --colour or --reflectance, one of them"),
        (("paint", "coloured.yaml", "--colour", "blue"), "--colour blue: needs #rrggbb, or three numbers"),
        (("paint", "coloured.yaml", "--colour", "2,0,0"), "colour: must lie in 0 to 1"),
        (("paint", "coloured.yaml", "--reflectance", "none.csv"), "spectrum: file not found"),
        (("paint", "coloured.yaml", "--colour", "#8090c0", "--set", "tir=off"), "--set tir: is a switch of models"),
    ],
)
def test_what_cannot_be_fitted_or_mixed_gets_one_line(
    typed: tuple[str, ...], message: str, run: Run, folder: Path
) -> None:
    Path("percent.csv").write_text("400,50,60\n500,40,70\n", encoding="utf-8")
    Path("text.csv").write_text("\x1b[31m,1,2\n", encoding="utf-8")
    Path("plain.yaml").write_text("layers: [{diffuse: {}}]", encoding="utf-8")
    Path("coloured.yaml").write_text("layers: [{medium: {pigments: [{K: 1, S: 2}]}}, {diffuse: {}}]", encoding="utf-8")
    before = set(folder.iterdir())
    status, out, err = run(*typed)
    assert (status, out) == (2, "")
    assert message in err and err.count("\n") == 1 and "\x1b" not in err
    assert set(folder.iterdir()) == before
