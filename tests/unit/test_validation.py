"""Media against van de Hulst, Chandrasekhar, DISORT, adding-doubling of others and walks, interfaces against Mitsuba,
and the page *Validation*: its numbers are those of the program now, and the README promises no more."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import slab_radiances
from benchmarks import benchmark
from radiative_transfer import TABLES, radiances, rows

from velatura.stack import Interface

ROOT = Path(__file__).parents[2]
PAGE: dict[str, Any] = json.loads((ROOT / "docs" / "explanation" / "validation.json").read_text(encoding="utf-8"))
MOST, MEAN = 2e-3, 5e-4  # errors of energies, of the incident light
SAME = 1e-4  # of the light, to which numbers of the page are those of the program
PROMISE = "to a tenth of a percent of the incident light ([Validation](docs/explanation/validation.md))"

validation = benchmark("validation")


@pytest.mark.parametrize("table", TABLES)
def test_energies_are_those_of_outside_solvers(table: str) -> None:
    errors = {row.name: np.abs(row.errors) for row in rows(table)}
    assert {name: error for name, error in errors.items() if error.max() > MOST} == {}
    assert np.concatenate([*errors.values()]).mean() < MEAN


@pytest.mark.parametrize("form", ["forward", "symmetric"])
def test_radiance_of_a_slab_is_that_of_van_de_hulst(form: str) -> None:
    """Isotropic scattering: the same at all azimuths."""
    found = radiances(form)
    assert np.abs(found["reflected"]).max() < 0.012
    assert np.abs(found["transmitted_diffuse"]).max() < 0.045


@pytest.mark.parametrize("form", ["forward", "symmetric"])
def test_values_of_slabs_are_those_of_disort(form: str) -> None:
    """Bounds are those of `benchmarks/slabs.py`, where all cases are."""
    some = [case for case in slab_radiances.cases() if case.medium.depth == 1 and case.medium.sigma_s == 0.9]
    errors = np.array([slab_radiances.errors(case, form) for case in some])
    most = {"Rayleigh": 0.015, "g 0": 0.015, "g 0.5": 0.03, "g 0.8": 0.07, "g 0.9": 0.12}
    assert np.all(errors.max(axis=1) < [most[case.name] for case in some])
    assert np.all(errors.mean(axis=0) < (0.035, 0.02))


def test_media_are_as_the_page_has_them() -> None:
    """Expected: the same errors of all numbers, and the promise of the README."""
    found = validation.media()
    for mine, printed in zip(found["truths"], PAGE["media"]["truths"]):
        assert mine["name"] == printed["name"] and mine["numbers"] == printed["numbers"]
        assert [mine[key] - printed[key] for key in ("mean", "worst")] == pytest.approx([0, 0], abs=SAME)
    for part, error in found["radiance"].items():
        assert error == pytest.approx(PAGE["media"]["radiance"][part], abs=2e-3)
    everything = PAGE["media"]["truths"][-1]
    assert everything["name"] == "all" and everything["worst"] < 1e-3
    assert PROMISE in " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())


def test_interfaces_are_as_the_page_has_them() -> None:
    """Two of them, against Mitsuba. Expected: the same numbers, and densities that are Mitsuba's where light passes."""
    kept = {each["name"]: each for each in PAGE["interfaces"]["rows"]}
    validation.kernel.mitsuba("llvm_ad_rgb")
    inside = [-np.sqrt(1 - (p / validation.GLASS) ** 2) for p in validation.MOMENTA]
    glass, metal = Interface(eta=validation.GLASS, alpha=0.1), Interface(**validation.METAL, alpha=0.3)
    found = [
        *validation._compared("roughdielectric", validation._case(glass, (*validation.COSINES, *inside))),
        *validation._compared("roughconductor", validation._case(metal, validation.COSINES)),
    ]
    assert len(found) == 5
    for each in found:
        for key in ("variation", "worst", "energy", "density"):
            assert each[key] == pytest.approx(kept[each["name"]][key], abs=5 * SAME), (each["name"], key)
        assert each["variation"] < 0.006 and each["density"] < 0.01
        assert "passed" not in each["name"] or each["density"] < 1e-4


def test_the_page_has_all_parts_measured_with_the_same_versions(tmp_path: Path) -> None:
    """Expected: a date and versions of each part, and a picture of what is printed."""
    assert list(PAGE) == list(validation.PARTS)
    assert any(each["name"].startswith("Mitsuba's tests") for each in PAGE["interfaces"]["rows"])
    for part in PAGE.values():
        assert set(part["measured"]) == {"date", "commit", *validation.PACKAGES}
        assert part["measured"] | {"date": "", "commit": ""} == PAGE["media"]["measured"] | {"date": "", "commit": ""}
    validation.draw(PAGE, tmp_path / "validation.webp")
    assert (tmp_path / "validation.webp").stat().st_size > 10_000
