"""A newcomer's first hour: the commands of a tutorial, in an empty home and an empty folder.

Rationale: other tests run in this process, with caches that are warm and settings that are made. Expected: no section
takes more than four commands, each succeeds, and leaves what the page promises. Kernels are compiled as those of tests,
all of them anew.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sysconfig
from pathlib import Path

import pytest
from manual import ROOT, blocks, written

import velatura as vt

PAGE = "docs/tutorials/four-steps.md"
QUICKLY = Path(__file__).parents[1] / "shared" / "quickly"
STEPS, MOST = 4, 4  # sections, and commands of one


def commands() -> list[str]:
    return [line for text in written(PAGE, "sh") for line in text.splitlines()]


def test_the_steps_lead_from_an_empty_home_to_a_data_set(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    home, folder = tmp_path / "home", tmp_path / "here"
    home.mkdir()
    folder.mkdir()
    for language, text in blocks(PAGE):
        if language in ("python", "yaml"):
            name = text.splitlines()[0].removeprefix("# ")
            (folder / name).write_text(text)
    path = f"{sysconfig.get_path('scripts')}{os.pathsep}{os.defpath}"
    sources = os.pathsep.join(map(str, (QUICKLY, Path(vt.__file__).parents[1])))
    environment = {"HOME": str(home), "PATH": path, "PYTHONPATH": sources, "LANG": "C.UTF-8"}
    printed = ""
    for command in commands():
        done = subprocess.run(shlex.split(command), cwd=folder, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
        assert "Traceback" not in done.stderr
        printed += done.stdout
    assert (folder / "gold.png").stat().st_size > 1000
    assert "depth 1.0" in printed
    assert (folder / "gold.glb").read_bytes()[:4] == b"glTF"
    assert xarray.open_zarr(folder / "gold.zarr").sizes["point"] == 16


def test_each_step_takes_few_commands() -> None:
    _, *sections = re.split(r"^## ", (ROOT / PAGE).read_text(encoding="utf-8"), flags=re.MULTILINE)
    counts = [sum(command in section for command in commands()) for section in sections]
    assert len(counts) == STEPS and sum(counts) == len(commands()) and max(counts) <= MOST
