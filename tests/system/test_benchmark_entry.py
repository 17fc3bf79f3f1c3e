"""How a model is entered into the benchmark: the programs of its page, run, and the command line."""

from __future__ import annotations

import csv
import json
import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from velatura import benchmark
from velatura.stack import DiffuseValues, InterfaceValues, Material

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "benchmark.md"
IN_PYTHON, IN_ANY_LANGUAGE = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)


def ran(text: str, folder: Path) -> dict[str, Any]:
    program = folder / "program.py"
    program.write_text(text, encoding="utf-8")
    return runpy.run_path(str(program))


def test_a_function_is_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Expected: the albedo error that follows from the shipped table of energies, as the function's albedo is known."""
    summary = ran(IN_PYTHON, tmp_path)["found"].summary()
    assert summary == eval(capsys.readouterr().out)
    assert summary["records"] == summary["asked"] == 40
    painted = [case for case in benchmark.edition() if case.kind == "diffuse base"]
    albedos = {case.id: case.stack.base.albedo for case in painted if case.stack.base}
    with (benchmark.EDITIONS[1].data / "energies.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["stack"] in albedos]
    energy = np.array([[float(row[f"energy_{c}"]) for c in "rgb"] for row in rows])
    errors = np.array([np.broadcast_to(albedos[row["stack"]], 3) for row in rows]) / energy - 1
    assert summary["albedo"] == pytest.approx(np.abs(errors[energy > 0.02]).mean(), rel=1e-4)


def test_values_of_a_program_in_any_language_are_scored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run) -> None:
    """Expected: of the stacks that the program knows all records, and scores that do not depend on the way in."""
    monkeypatch.chdir(tmp_path)
    assert run("benchmark", "pairs", "-o", "task")[0] == 0
    ran(IN_ANY_LANGUAGE, tmp_path)
    status, out, _ = run("benchmark", "score", "--values", "task/mine.npy", "--json", "--plot", "mine.png")
    assert status == 0 and (tmp_path / "mine.png").stat().st_size > 1000
    (found,) = json.loads(out)

    def in_python(case: benchmark.Case):
        if case.stack.kinds != ("dielectric", "diffuse"):
            return None
        coat, base = Material.of(case.stack).layers
        assert isinstance(coat, InterfaceValues) and isinstance(base, DiffuseValues)
        albedo = ((1 - ((coat.eta - 1) / (coat.eta + 1)) ** 2) ** 2 * base.albedo)[:, 0]
        return lambda wi, wo: albedo / np.pi * wo[:, 2:]

    expected = benchmark.score(in_python).summary()
    assert expected["records"] > 0
    assert {key: found["summary"]["all"][key] for key in expected} == pytest.approx(expected, rel=1e-4)
    np.save("short.npy", np.zeros((3, 3)))
    status, _, err = run("benchmark", "score", "--values", "short.npy")
    assert status == 2 and "shape" in err
    Path("none.npy").write_text("no numbers")
    assert run("benchmark", "score", "--values", "none.npy")[0] == 2
    np.save("velatura.npy", np.load("task/mine.npy", mmap_mode="r")[:3])
    _, _, err = run("benchmark", "score", "--values", "velatura.npy", "--model", "velatura")
    assert err == "velatura: velatura.npy: --values: has the name of an entrant; rename the file\n"


def test_the_table_lists_what_was_scored(run) -> None:
    status, out, _ = run("benchmark", "score", "--kind", "one interface", "--model", "rough-interface,roughplastic")
    assert status == 0
    first, second = out.splitlines()[1:]
    assert first.split()[0] == "rough-interface" and second.split()[:2] == ["roughplastic", "0/"]
