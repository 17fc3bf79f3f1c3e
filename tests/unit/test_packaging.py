"""The metadata of the package: licences, extras, types."""

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


@pytest.mark.parametrize(
    ("missing", "extra", "command"),
    [
        ("uvicorn", "editor", ["edit", "--no-browser"]),
        ("matplotlib", "plots", ["compare", "bare-gold", "--plot", "gold.png"]),
        ("matplotlib", "plots", ["check", "bare-gold", "--plots", "laws"]),
        ("matplotlib", "plots", ["figure", "belcour2018-13"]),
        ("matplotlib", "plots", ["invert", "target.yaml", "--plot", "-o", "stack.yaml"]),
        ("matplotlib", "plots", ["explore", "target.yaml", "--sheet"]),
    ],
)
def test_a_missing_extra_is_named_with_its_command(
    missing: str, extra: str, command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: before anything slow, and with nothing left behind."""
    monkeypatch.chdir(tmp_path)
    Path("target.yaml").write_text("lobes: [{energy: 0.04}]")
    script = f"import sys; sys.modules[{missing!r}] = None; from velatura.cli import main; main()"
    run = subprocess.run([sys.executable, "-c", script, *command], capture_output=True, text=True)
    mend = f'{sys.executable} -m pip install "velatura[{extra}]"'
    assert (run.returncode, run.stderr) == (1, f"velatura: {missing} is not installed: run `{mend}`\n")
    assert [path.name for path in tmp_path.iterdir()] == ["target.yaml"]


def test_what_needs_no_extra_runs_without_any(tmp_path: Path) -> None:
    """Expected: lobes, a check and an inversion, and doctor, which says what each missing extra is for."""
    extras = ("matplotlib", "uvicorn", "starlette", "websockets", "anywidget")
    code = (
        f"import sys; sys.modules.update(dict.fromkeys({extras}))\n"
        "import velatura as vt\n"
        "from velatura import *\n"
        "vt.lobes('coated-gold', 1.0), vt.check('bare-gold'), vt.inverse.invert_stack([{'energy': 0.04}])\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)
