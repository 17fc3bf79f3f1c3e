"""Slices of `benchmarks/fidelity.py` and `benchmarks/walks.py`: they hold what is exact to be exact."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import velatura as vt
from velatura import kernel

pytestmark = pytest.mark.usefixtures("one_thread")

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
PATHS = 200_000


@pytest.fixture(scope="module")
def fidelity() -> Iterator[ModuleType]:
    """The benchmark, and `walks` that it imports, as a program finds them, with fewer samples."""
    sys.path.append(BENCHMARKS)
    found = importlib.import_module("fidelity")
    sys.path.remove(BENCHMARKS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(found, "SAMPLES", 16)
        patch.setattr(found, "IN_GLASS", 2**14)
        yield found


def kind(fidelity: ModuleType, name: str):
    (found,) = fidelity.chosen([name])
    return found


@pytest.mark.parametrize(
    ("name", "eta"), [("isotropic, once", {"eta": 0.2, "k": 3.0}), ("passing, once", {"eta": 1.5})]
)
def test_mitsubas_rough_interfaces_are_at_the_noise(fidelity, name, eta) -> None:
    """Rationale: a single interface whose facets are met once is Mitsuba's own, from both sides and beyond the critical
    angle. Expected: variation at the noise, which is a mean over 1600 bins, and albedo within 6 standard errors of the
    walk (2e-9 a number)."""
    mi = kernel.mitsuba()
    rough = {"distribution": "ggx", "alpha": 0.2}
    made = {
        "isotropic, once": {"type": "roughconductor", "eta": 0.2, "k": 3.0, **rough},
        "passing, once": {"type": "roughdielectric", "int_ior": 1.5, "ext_ior": 1.0, **rough},
    }[name]
    of = kind(fidelity, name)
    walks = importlib.import_module("walks").walked(of, vt.Stack([vt.Interface(**eta, alpha=0.2)]), PATHS)
    records = fidelity.compared(of, walks, mi.load_dict(made))
    assert len(records) == (3 if name == "isotropic, once" else 3 + 5 + 5)
    for record in records:
        assert record.variation < 1.4 * record.noise + record.own_noise
        for error, energy in zip(record.albedo, record.energy):
            assert abs(error) < 6 * np.sqrt(max(1 / energy - 1, 0.1) / PATHS) + 2e-3


def test_a_sphere_of_smooth_glass_keeps_all_energy(fidelity) -> None:
    """Expected: 1 but for what has not left after 40 meetings; a coat of a metal's reflectance, for one, keeps less."""
    glass = kernel.mitsuba().load_dict({"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
    energy, _, _ = fidelity.furnace(glass)
    assert energy == pytest.approx(1, abs=1e-4)


def test_rough_glass_reflects_light_inside_as_walks_do(fidelity) -> None:
    """Rationale: inside a denser medium, light that facets reflect again is diffuse. Expected: variation little above
    the noise at all momenta; with that light in the lobe it is .06 to .13 above."""
    of = kind(fidelity, "passing, often")
    stack = vt.Stack([vt.Interface(eta=1.8, alpha=0.4)])
    walks = importlib.import_module("walks").walked(of, stack, PATHS)
    bsdf = vt.bsdf(stack, fidelity.of_kind(of, "velatura", {}))
    for record in fidelity.compared(of, walks, bsdf):
        if record.row == "passing, often: back inside":
            assert record.variation < record.noise + record.own_noise + 0.035


def test_walks_are_kept(fidelity, tmp_path, monkeypatch) -> None:
    """Expected: a second call reads the file, independent of the walk; the halves share no stack; the energies by
    interface add up to the grid's, within 5 standard errors of either."""
    walks, of = importlib.import_module("walks"), kind(fidelity, "absorbing, often")
    first = walks.kept(of, "fit", 0, 5000, 0, tmp_path)
    assert first.energy.sum(axis=0) == pytest.approx(first.grids[:, 0].mean(axis=0).sum(axis=(2, 3)), abs=0.05)
    monkeypatch.setattr(walks, "walked", None)
    again = walks.kept(of, "fit", 0, 5000, 0, tmp_path)
    assert np.array_equal(first.grids, again.grids) and again.stack == first.stack
    assert again.incidences == first.incidences
    (text,) = tmp_path.rglob("*.yaml")
    assert vt.load(text) == first.stack
    for each in walks.KINDS:
        fit, test = ([each.stack(0, half, n).flat() for n in range(4)] for half in walks.HALVES)
        assert not any(stack in test for stack in fit)


def test_textures_of_one_value_change_little(fidelity) -> None:
    """Expected: the energy of the uniform material, within 1 %, though the model tabulates less."""
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(conductor="Au", alpha=0.2)])
    model = fidelity.of_kind(kind(fidelity, "isotropic, often"), "velatura", {})
    oblique = fidelity.Incidence(0.7, False, 0.71)
    energies = [
        fidelity.seen(fidelity.probe_of(bsdf), oblique)[0].mean(axis=0).sum(axis=(0, 2, 3))
        for bsdf in (vt.bsdf(stack, model), fidelity.textured(stack, model))
    ]
    assert energies[0] == pytest.approx(energies[1], rel=0.01)


def test_the_table_by_model_and_form(fidelity, tmp_path, monkeypatch, capsys) -> None:
    """Expected: a row for each kind, the spheres, and the same numbers in the file."""
    file = tmp_path / "fidelity.json"
    monkeypatch.setattr(fidelity, "GLASS", (0.2,))
    options = ["--form", "symmetric", "--kind", "isotropic, once", "--stacks", "2", "--paths", "20000"]
    monkeypatch.setattr(sys, "argv", ["fidelity.py", *options, "--truth", str(tmp_path), "--json", str(file)])
    fidelity.main()
    out = capsys.readouterr().out
    assert "isotropic, once" in out and "roughdielectric" in out
    found = json.loads(file.read_text())
    assert found["form"] == "symmetric" and len(found["records"]) == found["table"]["isotropic, once"]["records"]
    energy, _, _ = found["spheres"]["roughdielectric"]["0.2"]
    assert 0.8 < energy < 0.9  # light that would meet a second facet is lost
