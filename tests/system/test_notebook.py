"""The tutorial notebook: it runs, prints the numbers that it was stored with, and is fit to be shipped."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import velatura

# Not imported here, since all workers read all files of tests, and these take seconds
LACKS = [name for name in ("nbformat", "nbclient", "anywidget") if not find_spec(name)]
pytestmark = pytest.mark.skipif(bool(LACKS), reason=f"missing: {LACKS}")

NOTEBOOK = Path(__file__).parents[2] / "docs" / "tutorials" / "inverse-design.ipynb"
LARGEST = 600_000  # bytes


def stored() -> Any:
    import nbformat

    return nbformat.read(NOTEBOOK, as_version=4)


def printed(cell: Any) -> str:
    return "".join(output.text for output in cell.get("outputs", []) if output.output_type == "stream")


def test_the_notebook_runs_and_prints_what_it_has_stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is printed is rounded so that it is the same everywhere; of pictures it counts that there are any."""
    import nbclient

    monkeypatch.setenv("PYTHONPATH", str(Path(velatura.__file__).parents[1]))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    expected, run = stored(), stored()
    nbclient.NotebookClient(run, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    for cell, before in zip(run.cells, expected.cells):
        assert printed(cell) == printed(before)
        kinds, kinds_before = ([sorted(o.get("data", {})) for o in c.get("outputs", [])] for c in (cell, before))
        assert kinds == kinds_before


def test_the_notebook_is_small_and_names_no_place() -> None:
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert len(text) < LARGEST
    assert not re.search(r"/(home|root|tmp|work|usr|Users)/|site-packages| at 0x[0-9a-f]+", text)
    assert all(cell.get("outputs") is not None for cell in stored().cells if cell.cell_type == "code")
    assert "widgets" not in stored().metadata
