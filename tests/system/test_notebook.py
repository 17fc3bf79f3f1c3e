"""The tutorial notebooks: they run, print the numbers that they were stored with, and are fit to be shipped."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import velatura

# Not imported here, since all workers read all files of tests, and these take seconds
LACKS = [name for name in ("nbformat", "nbclient", "anywidget") if not find_spec(name)]
pytestmark = pytest.mark.skipif(bool(LACKS), reason=f"missing: {LACKS}")

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "tutorials").glob("*.ipynb"))
LARGEST = 700_000  # bytes

QUICKLY = Path(__file__).parents[1] / "shared" / "quickly"

each = pytest.mark.parametrize("notebook", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])


def stored(notebook: Path) -> Any:
    import nbformat

    return nbformat.read(notebook, as_version=4)


def printed(cell: Any) -> str:
    return "".join(output.text for output in cell.get("outputs", []) if output.output_type == "stream")


@each
def test_a_notebook_runs_and_prints_what_it_has_stored(
    notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """What is printed is rounded so that it is the same everywhere, and where samples are few; of pictures it counts
    that there are any."""
    import nbclient

    cache = getattr(request.config, "cache", None)
    monkeypatch.setenv("DRJIT_CACHE_DIR", str(cache.mkdir("kernels") if cache else tmp_path / "kernels"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, (QUICKLY, Path(velatura.__file__).parents[1]))))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    profile = tmp_path / "ipython" / "profile_default"
    profile.mkdir(parents=True)
    # Not a file of "startup", whose names the notebook would have
    (profile / "ipython_kernel_config.py").write_text("import few_in_notebooks")
    expected, run = stored(notebook), stored(notebook)
    nbclient.NotebookClient(run, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    for cell, before in zip(run.cells, expected.cells):
        assert printed(cell) == printed(before)
        kinds, kinds_before = ([sorted(o.get("data", {})) for o in c.get("outputs", [])] for c in (cell, before))
        assert kinds == kinds_before


@each
def test_a_notebook_is_small_and_names_no_place(notebook: Path) -> None:
    text = notebook.read_text(encoding="utf-8")
    assert len(text) < LARGEST
    assert not re.search(r"/(home|root|tmp|work|usr|Users)/|site-packages| at 0x[0-9a-f]+", text)
    assert all(cell.get("outputs") is not None for cell in stored(notebook).cells if cell.cell_type == "code")
    assert "widgets" not in stored(notebook).metadata
