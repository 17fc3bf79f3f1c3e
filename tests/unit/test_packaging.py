"""The metadata of the package: licences, extras, types."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
import yaml

import velatura

ROOT = Path(__file__).parents[2]
INSTALL = re.compile(r"pip\s+install\s+(-e )?\\?\"([^\"[]*)\[([^]]*)\]")  # also as JSON has it
PAGE = ROOT / "src" / "velatura" / "editor" / "page"


def test_every_part_that_the_page_carries_has_its_licence() -> None:
    licences = (ROOT / "THIRD-PARTY-LICENSES.txt").read_text()
    carried = [*json.loads((PAGE / "package.json").read_text())["dependencies"], "fflate", "@pmndrs/assets"]
    for name in carried:
        assert f"\n\n{name}\n\n" in licences


@pytest.mark.parametrize("form", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("[!c]*.yml")), ids=lambda x: x.stem)
def test_a_form_of_issues_asks_for_something(form: Path) -> None:
    fields = yaml.safe_load(form.read_text(encoding="utf-8"))
    assert fields["name"] and fields["description"]
    assert any(each.get("validations", {}).get("required") for each in fields["body"])


def test_the_paper_cites_what_the_references_have() -> None:
    text = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
    cited = set(re.findall(r"@([a-z]+\d*)", text))
    known = set(re.findall(r"^@\w+{(\w+),", (ROOT / "src" / "velatura" / "references.bib").read_text(), re.MULTILINE))
    assert len(cited) > 8 and cited <= known


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


def test_commands_of_the_manual_that_install_need_no_index_but_for_dependencies() -> None:
    """Rationale: the package is on no index.

    Expected: where nothing is installed yet, on the first pages, they install from a clone; elsewhere they add extras,
    which pip takes from the metadata of what is installed.
    """
    offered = set(metadata.metadata("velatura").get_all("Provides-Extra") or ())
    first = ROOT / "README.md", ROOT / "docs" / "index.md"
    added = set()
    for page in (*first, *(path for path in (ROOT / "docs").rglob("*.*") if path.suffix in {".md", ".rst", ".ipynb"})):
        commands = INSTALL.findall(page.read_text())
        for option, what, extras in commands:
            assert set(extras.split(",")) <= offered, page
            assert (option, what) == (("-e ", ".") if page in first else ("", "velatura")), page
            added |= set() if page in first else {f"{what}[{extras}]"}
        assert commands or page not in first, page
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-index", "--no-deps", *added]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and "Would install" not in done.stdout, done.stderr


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
