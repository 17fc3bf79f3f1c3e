"""Fitting and simplifying as a user types it: materials that the other verbs read, and one line for each failure."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import inverse
from velatura.errors import MissingTool
from velatura.inverse import Directions, table_of
from velatura.model import named
from velatura.stack import Diffuse, Interface, Stack, save

Run = Callable[..., tuple[int, str, str]]

PAIR = Stack([Interface(eta=1.5, alpha=0.1), Interface(eta=1.5, alpha=0.3), Interface(eta=1.0, k=3.0, alpha=0.2)])
ONE = Stack([Interface(eta=1.8, alpha=0.2)])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a material, a table of another one, and targets."""
    monkeypatch.chdir(tmp_path)
    save(PAIR, tmp_path / "pair.yaml")
    angles = [(i, o, phi) for i in (0.0, 30.0, 60.0) for o in (0.0, 20.0, 40.0, 60.0) for phi in (150.0, 180.0)]
    value = table_of(ONE, Directions.of(*map(np.array, zip(*angles))), named("bati2021")).value
    rows = [",".join(map(str, (*angle, *rgb))) for angle, rgb in zip(angles, value.T)]
    (tmp_path / "table.csv").write_text("\n".join(["theta_i,theta_o,phi,r,g,b", *rows]))
    (tmp_path / "target.yaml").write_text("lobes:\n  - {energy: 0.1, alpha: 0.1}\n")
    return tmp_path


def test_a_table_becomes_a_material(run: Run, folder: Path) -> None:
    """Expected: the stack that the table is of, in a file that other verbs read."""
    status, out, err = run("fit", "table.csv", "target.yaml", "--model", "bati2021", "-o", "found.yaml")
    assert (status, err) == (0, "")
    assert out.splitlines()[-1] == "found.yaml"
    (found,) = vt.load("found.yaml").interfaces
    assert (found.eta, found.alpha) == pytest.approx((1.8, 0.2), rel=1e-4)


def test_a_fit_says_what_the_table_determines(run: Run, folder: Path) -> None:
    """Expected: every parameter with its interval, as a table and as JSON; pairs that trade places; other stacks."""
    arguments = ("fit", "table.csv", "target.yaml", "--model", "bati2021")
    out = run(*arguments)[1]
    assert "layer0_alpha" in out and "layer0_eta" in out
    report = json.loads(run(*arguments, "--json")[1])
    assert [one["name"] for one in report["parameters"]] == ["layer0_alpha", "layer0_eta"]
    assert all(one["low"] <= one["value"] <= one["high"] for one in report["parameters"])
    assert {"trades", "others"} <= report.keys()
    assert report["model_error"]["walks"] == 1000 and "itself beside walks of this stack" in out
    assert "model_error" not in json.loads(run(*arguments, "--json", "--walks", "0")[1])


def test_a_set_of_tables_is_fitted_once_each(run: Run, folder: Path) -> None:
    """Expected: a material and a report for each table; one that fails is named, and the rest done; a table that is
    known is not fitted again, but one that has changed is."""
    tables = folder / "tables"
    tables.mkdir()
    for name in ("one", "two"):
        (tables / f"{name}.csv").write_text((folder / "table.csv").read_text())
    (tables / "bad.csv").write_text("theta_i,theta_o,phi,r,g,b\n95,0,0,1,1,1\n")
    (tables / "notes.txt").write_text("no table")
    arguments = ("fit", "tables", "target.yaml", "--model", "bati2021", "--starts", "1", "--walks", "0", "-o", "fits")
    status, out, err = run(*arguments)
    assert status == 1
    assert err.startswith("velatura: tables/bad.csv: line 2") and err.count("\n") == 1
    assert [line.partition(": error")[0] for line in out.splitlines()] == ["tables/one.csv", "tables/two.csv"]
    assert sorted(path.name for path in (folder / "fits").iterdir()) == ["one.json", "one.yaml", "two.json", "two.yaml"]
    assert vt.load("fits/two.yaml").interfaces[0].eta == pytest.approx(1.8, rel=1e-4)

    (tables / "bad.csv").unlink()
    changed = (tables / "two.csv").read_text().replace("30.0,", "31.0,")
    (tables / "two.csv").write_text(changed)
    status, out, err = run(*arguments)
    assert (status, err) == (0, "")
    assert [line.endswith("(known)") for line in out.splitlines()] == [True, False]
    for broken in ('{"error": NaN}', "[" * 10**5, '{"error": 1.0, "model_error": 3}', "\x00"):
        (folder / "fits" / "two.json").write_text(broken)
        status, out, err = run(*arguments)
        assert (status, err, out.splitlines()[1].endswith("(known)")) == (0, "", False)
    report = json.loads(run(*arguments, "--json")[1])
    assert report["tables/one.csv"] == json.loads((folder / "fits" / "one.json").read_text())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("table.csv", "other.csv", "target.yaml"), "-o: needs a folder for the results of several tables"),
        (("table.csv", "other.csv", "target.yaml", "-o", "found.yaml"), "-o found.yaml: needs a folder"),
        (("empty", "target.yaml", "-o", "fits"), "empty: holds no table (.csv, .binary, .bsdf, .pbsdf, .astm)"),
        (("table.csv", "empty/../sub/table.csv", "target.yaml", "-o", "fits"), "has the name of table.csv; fit them"),
    ],
)
def test_a_set_that_cannot_be_is_refused(run: Run, folder: Path, arguments: tuple[str, ...], words: str) -> None:
    (folder / "empty").mkdir()
    status, out, err = run("fit", *arguments)
    assert (status, out) == (2, "")
    assert words in err and err.count("\n") == 1
    assert not (folder / "fits").exists()


def test_a_fit_is_kept_where_there_is_nothing_to_walk_with(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: the material, and one line about the walks."""

    def missing(*_: Any) -> None:
        raise MissingTool("LLVM is missing")

    monkeypatch.setattr(inverse, "model_error", missing)
    status, _, err = run("fit", "table.csv", "target.yaml", "--model", "bati2021", "-o", "found.yaml")
    assert (status, err) == (0, "velatura: no walks: LLVM is missing\n")
    assert vt.load("found.yaml").interfaces[0].eta == pytest.approx(1.8, rel=1e-4)


def test_a_brushed_table_is_read(run: Run, folder: Path) -> None:
    """Expected: azimuths of both directions are read from seven columns, and the material is brushed."""
    true = Stack([Interface(conductor="Al", alpha=(0.1, 0.3), rotation=120)])
    at = Directions.about_lobes(True)
    value = table_of(true, at, named("bati2021")).value
    angles = np.degrees([x for w in (at.wi, at.wo) for x in (np.arccos(w[2]), np.arctan2(w[1], w[0]))])
    rows = [",".join(map(str, [*angles[:, n], *value[:, n]])) for n in range(value.shape[1])]
    Path("brushed.csv").write_text("\n".join(["theta_i,phi_i,theta_o,phi_o,r,g,b", *rows]))
    Path("metal.yaml").write_text("lobes:\n  - {energy: 0.85, alpha: 0.2, base: conductor}\n")
    status, _, err = run("fit", "brushed.csv", "metal.yaml", "--starts", "1", "--model", "bati2021", "-o", "found.yaml")
    assert (status, err) == (0, "")
    found: Any = vt.load("found.yaml").interfaces[0]
    assert (*found.alpha, found.rotation) == pytest.approx((0.1, 0.3, 120), rel=1e-2)


def test_a_material_becomes_a_simpler_one(run: Run, folder: Path) -> None:
    """Expected: JSON with the material and its error by angle; an interface that does nothing is gone."""
    arguments = ("simplify", "pair.yaml", "--interfaces", "2", "--model", "bati2021")
    status, out, err = run(*arguments, "--json")
    report = json.loads(out)
    assert (status, err) == (0, "")
    assert len(vt.Stack.from_dict(report["stack"]).interfaces) == 2
    assert report["error"] < 1e-4
    assert len(report["by_angle"]) == 5
    assert report["energies"][0]["after"] == pytest.approx(report["energies"][0]["before"], abs=1e-3)
    assert "Energy that is reflected" in run(*arguments, "--plot")[1]
    assert (folder / "pair.png").stat().st_size > 10_000


def test_a_mixture_becomes_one_of_simpler_stacks(run: Run, folder: Path) -> None:
    """Expected: a report and a picture for each stack that is simplified, and one file."""
    arguments = ("simplify", "half-metallic-paint", "--interfaces", "1", "--model", "bati2021")
    report = json.loads(run(*arguments, "--json")[1])
    assert list(report["parts"]) == ["part0"] and report["parts"]["part0"]["error"] > 0
    status, out, err = run(*arguments, "--plot", "-o", "simple.yaml")
    assert (status, err, out.splitlines()[-2:]) == (0, "", ["simple.yaml", "half-metallic-paint-part0.png"])
    assert out.startswith("part0:\n") and (folder / "half-metallic-paint-part0.png").stat().st_size > 10_000
    assert vt.load("simple.yaml") == vt.Mix.from_dict(report["material"])


def test_a_coat_tells_of_a_diffuse_base(run: Run, folder: Path) -> None:
    """Expected: the energy that is kept, as JSON and as a row of the table."""
    save(Stack([Interface(eta=1.4), Diffuse(albedo=0.4)]), folder / "plastic.yaml")
    arguments = ("coat", "plastic.yaml", "--keep-appearance")
    diffuse = json.loads(run(*arguments, "--json")[1])["diffuse"]
    assert diffuse["energy_after"] == pytest.approx(diffuse["energy_before"], abs=1e-9)
    assert "diffuse" in run(*arguments)[1]


def test_paint_without_an_interface_is_coated(run: Run, folder: Path) -> None:
    """Expected: nothing is said of lobes that it does not have."""
    save(Stack([Diffuse(albedo=0.4)]), folder / "paint.yaml")
    status, out, err = run("coat", "paint.yaml", "--keep-appearance", "-o", "coated.yaml")
    assert (status, err, out.splitlines()[-1]) == (0, "", "coated.yaml")


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["fit", "none.csv", "target.yaml"], 2, "none.csv: file not found"),
        (["fit", "target.yaml", "target.yaml"], 2, "target.yaml: line 1: must be theta_i"),
        (["fit", "table.csv", "none.yaml"], 2, "none.yaml"),
        (["fit", "table.csv", "target.yaml", "-o", "found.txt"], 2, "found.txt: a material file ends in"),
        (["simplify", "pair.yaml", "--interfaces", "3"], 2, "interfaces: must be at least 1, and fewer than the 3"),
        (["simplify", "bare-gold", "--interfaces", "1"], 2, "interfaces: the material has one, and none"),
        (["simplify", "pair.yaml", "--interfaces", "0"], 2, "--interfaces"),
        (["simplify", "pair.yaml"], 2, "--interfaces"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(
    run: Run, folder: Path, arguments: list[str], status: int, words: str
) -> None:
    found, out, err = run(*arguments)
    assert (found, out) == (status, "")
    assert err.count("\n") == 1 and words in err
    assert not (folder / "found.yaml").exists()
