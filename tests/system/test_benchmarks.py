"""The programs of `benchmarks`, at sizes that take a moment, and the report of `make bench`."""

from __future__ import annotations

import json
import re
import shlex
import sys
from pathlib import Path
from typing import Any

import pytest
from benchmarks import benchmark, tool

ROOT = Path(__file__).parents[2]


bench = tool("bench")


@pytest.mark.parametrize("name", [name for name in bench.SMOKE if name not in ("coat", "startup")])
def test_benchmarks_run(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """In this process, which loads the renderer once. What notes rows prints each of them."""
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *shlex.split(bench.SMOKE[name])])
    monkeypatch.setenv("VELATURA_BENCH_ROWS", str(tmp_path / "rows.jsonl"))
    benchmark(name).main()
    printed = capsys.readouterr().out
    assert printed
    notes = tmp_path / "rows.jsonl"
    rows = [json.loads(line) for line in notes.read_text().splitlines()] if notes.exists() else []
    assert bool(rows) == bool(re.search(r"from rows import .*\brow\b", (bench.FOLDER / f"{name}.py").read_text()))
    for row in rows:
        assert row["name"] in printed and row["low"] <= row["median"] <= row["high"]


def test_the_report_has_what_ran_and_goes_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A second run repeats nothing of the same commit, and keeps what there is."""
    command = ["bench.py", "--smoke", "--folder", str(tmp_path)]
    ran, run = [], bench.run

    def noted(name: str, options: str) -> Any:
        ran.append(name)
        return run(name, options)

    monkeypatch.setattr(bench, "run", noted)
    monkeypatch.setattr(bench, "commit", lambda: "0123456789ab")
    for names in (["coat"], ["startup", "coat"]):
        monkeypatch.setattr(sys, "argv", [*command, *names])
        bench.main()
    assert ran == ["coat", "startup"]
    report = json.loads((tmp_path / "report.json").read_text())
    assert {"processor", "cores", "memory", "Python", "mitsuba"} <= set(report["machine"])
    assert list(report["benchmarks"]) == ["coat", "startup"]
    (row,) = report["benchmarks"]["startup"]["runs"][0]["rows"]
    assert 0 < row["median"] < 60
    text = (tmp_path / "report.md").read_text()
    assert f"| start-up | {row['name']} | {row['median']:.3g} s |" in text
    assert "absorbing, energy: mean, 90 %, bias" in text


def test_commands_of_the_report_are_those_of_the_manual() -> None:
    """Every benchmark that a page names is one, and takes the options that the page gives it."""
    programs = bench.names()
    assert {*bench.COMMANDS, *bench.SMOKE} <= {*programs}
    for page in (ROOT / "docs").rglob("*.md"):
        for name in re.findall(r"benchmarks/(\w+)\.py", page.read_text()):
            assert name in programs, (page, name)
