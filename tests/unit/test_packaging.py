"""What the package says of itself: licences, extras, types."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import velatura

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "src" / "velatura" / "editor" / "page"


def test_every_part_that_the_page_carries_has_its_licence() -> None:
    licences = (ROOT / "THIRD-PARTY-LICENSES.txt").read_text()
    carried = [*json.loads((PAGE / "package.json").read_text())["dependencies"], "fflate", "@pmndrs/assets"]
    for name in carried:
        assert f"\n\n{name}\n\n" in licences


def test_the_package_is_typed() -> None:
    assert (Path(velatura.__file__).with_name("py.typed")).is_file()


def test_the_citation_names_this_version() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert (cited["version"], cited["license"]) == (velatura.__version__, "BSD-3-Clause")


@pytest.mark.parametrize(("missing", "extra", "command"), [("uvicorn", "editor", ["edit", "--no-browser"])])
def test_a_missing_extra_is_named_with_its_command(missing: str, extra: str, command: list[str]) -> None:
    script = f"import sys; sys.modules[{missing!r}] = None; from velatura.cli import main; main()"
    run = subprocess.run([sys.executable, "-c", script, *command], capture_output=True, text=True)
    mend = f'{sys.executable} -m pip install "velatura[{extra}]"'
    assert (run.returncode, run.stderr) == (1, f"velatura: {missing} is not installed: run `{mend}`\n")
