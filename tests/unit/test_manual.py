"""The manual's placeholders: numbers that the figures printed, and nothing that is typed."""

from __future__ import annotations

import json
import operator
import pydoc
import re
from pathlib import Path
from types import ModuleType

import pytest
from benchmarks import tool

import velatura
from velatura.figures import FIGURES
from velatura.figures.bati2021_targets import FIGURES as FIGURES_OF_LOBES

ROOT = Path(__file__).parents[2]


@pytest.fixture
def hooks() -> ModuleType:
    return tool("docs_hooks")


@pytest.fixture
def example(hooks: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The hooks, with one figure's numbers."""
    cell = {"name": "a coat, .5", "rmse": {"forward": 0.04973, "fine": 0.0135}}
    cell["rmse_error"] = {"forward": 0.00169, "fine": 0.00086}
    numbers = {"cells": [cell], "angles": [1.0, 0.25], "energy": {"red": -0.1234}}
    (tmp_path / "some-figure.json").write_text(json.dumps(numbers))
    monkeypatch.setattr(hooks, "NUMBERS", (tmp_path,))
    return hooks


@pytest.mark.parametrize(
    ("placeholder", "printed"),
    [
        ("some-figure: cells/a coat, .5/rmse/forward", ".0497 ± .0017"),
        ("some-figure: cells/0/rmse/fine", ".0135 ± .0009"),
        ("some-figure: angles", "1.000, .250"),
        ("some-figure: angles/1 to 1", ".2"),
        ("some-figure: energy/red", "-.123"),
    ],
)
def test_a_placeholder_becomes_a_number(example: ModuleType, placeholder: str, printed: str) -> None:
    assert example.replaced(f"| {{{{{placeholder}}}}} |") == f"| {printed} |"


def test_a_link_to_a_script_becomes_one_to_its_page(hooks: ModuleType) -> None:
    assert hooks.replaced("[a](../examples/some_coat.py)") == "[a](../gallery/some_coat.rst)"


@pytest.mark.parametrize(
    "placeholder",
    ["other-figure: angles", "some-figure: angle", "some-figure: angles/7", "some-figure: cells/b/rmse", "angles", ""],
)
def test_an_unknown_placeholder_ends_the_build(example: ModuleType, placeholder: str) -> None:
    with pytest.raises(LookupError, match=re.escape(f"{{{{{placeholder}}}}}")):
        example.replaced(f"{{{{{placeholder}}}}}")


def test_generated_pages_of_names_that_are_gone_are_removed(
    hooks: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pages = tmp_path / "reference" / "api"
    pages.mkdir(parents=True)
    (pages.parent / "api.rst").write_text(".. autosummary::\n\n   velatura.lobes\n")
    for name in ("velatura.lobes", "velatura.gone"):
        (pages / f"{name}.rst").touch()
    monkeypatch.setattr(hooks, "DOCS", tmp_path)
    hooks.forget_old_pages(None)
    assert [page.stem for page in pages.iterdir()] == ["velatura.lobes"]


@pytest.mark.parametrize(
    "page", sorted(p for p in (ROOT / "docs").rglob("*.md") if "{{" in p.read_text()), ids=lambda p: p.stem
)
def test_every_placeholder_of_a_page_resolves(hooks: ModuleType, page: Path) -> None:
    assert not re.search(r"\{\{|<!-- table", hooks.replaced(page.read_text()))


def test_a_list_of_numbers_becomes_a_table(example: ModuleType, tmp_path: Path) -> None:
    values = (3, 0.00123), (None, 1e-7), (1234.5, 12.3)
    rows = [{"name": name, "numbers": number, "worst_case": worst} for name, (number, worst) in zip("abc", values)]
    (tmp_path / "other.json").write_text(json.dumps({"rows": rows}))
    printed = ["|  | numbers | worst case |", "| --- | --- | --- |", "| a | 3 | .0012 |", "| b |  | 1e-07 |"]
    printed.append("| c | 1234 | 12 |")
    assert example.replaced("<!-- table other: rows -->").splitlines() == printed


def test_the_page_shows_every_figure_beside_its_numbers() -> None:
    """Expected: each described, none heavy for the pixels that it has; numbers of none but these."""
    page = (ROOT / "docs" / "reference" / "figures.md").read_text()
    shown = re.findall(r"!\[(.+?)\]\(\.\./figures/([a-z0-9-]+)\.webp\)", page)
    assert sorted(name for _, name in shown) == sorted(FIGURES) and len({words for words, _ in shown}) == len(FIGURES)
    assert set(re.findall(r"\{\{([a-z0-9-]+): ", page)) <= set(FIGURES)
    files = {path.name: path.stat().st_size for path in (ROOT / "docs" / "figures").iterdir()}
    assert set(files) == {f"{name}.{ending}" for name in FIGURES for ending in ("json", "webp")}
    pictures = [size for name, size in files.items() if name.endswith(".webp")]
    assert max(pictures) < 600_000 and sum(pictures) < 9_000_000


@pytest.mark.parametrize("part", ["tutorials", "how-to", "explanation", "reference"])
def test_the_first_page_of_a_part_lists_its_pages(part: str) -> None:
    folder = ROOT / "docs" / part
    pages = {path.name for path in (*folder.glob("*.md"), *folder.glob("*.ipynb"))}
    linked = set(re.findall(r"\]\(([^)#]+)\)", (folder / "index.md").read_text()))
    assert pages - {"index.md"} <= linked


def test_the_editor_in_the_manual_is_where_the_build_writes_it() -> None:
    """Expected: the parts of the manual are folders, side by side with that of the editor."""
    page, makefile = (ROOT / "docs" / "how-to" / "editor.md").read_text(), (ROOT / "Makefile").read_text()
    assert 'src="../try/index.html"' in page
    assert "velatura edit --static site/try\n" in makefile


def test_the_files_that_contributing_names_exist() -> None:
    """Expected: each path in its table is in the package or in the root, the folder of a new one too, and each
    `NAME` of a file stands in that file.
    """
    rows = [line for line in (ROOT / "CONTRIBUTING.md").read_text().splitlines() if line.startswith("| a")]
    assert len(rows) == 25
    package = ROOT / "src" / "velatura"
    for row in rows:
        paths = re.findall(r"`((?:[\w.-]+/)*[\w-]+\.(?:py|js|md|yaml))`", row)
        assert paths, row
        for path in paths:
            existing = path.partition("NAME")[0]
            assert (package / existing).exists() or (ROOT / existing).exists(), path
        for name, path in re.findall(r"`(\w+)` of `([\w/.-]+)`", row):
            file = package / path if (package / path).exists() else ROOT / path
            assert re.search(rf"\b{name}\b", file.read_text()), (name, path)


def test_the_reference_has_every_public_name() -> None:
    page = (ROOT / "docs" / "reference" / "api.rst").read_text()
    listed = re.findall(r"^(?:   |\.\. py:data:: )velatura\.(\S+)$", page, re.MULTILINE)
    assert {*velatura.__all__, "Editor"} <= set(listed)
    for name in listed:
        assert operator.attrgetter(name)(velatura) is not None


def test_the_names_that_pages_give_exist() -> None:
    """Expected: `velatura.x.y` is a module, or what one has."""
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    names = {name for page in pages for name in re.findall(r"`(velatura\.[\w.]+)(?:\(\))?`", page.read_text())}
    assert len(names) > 10
    for name in names:
        assert pydoc.locate(name) is not None, name


def test_the_gallery_orders_every_example(hooks: ModuleType) -> None:
    assert sorted(hooks.EXAMPLES) == sorted(path.stem for path in (ROOT / "docs" / "examples").glob("*.py"))


def test_every_preset_has_its_distance_and_its_picture() -> None:
    distances = json.loads((ROOT / "docs" / "reference" / "presets.json").read_text())
    pictures = ROOT / "src" / "velatura" / "editor" / "page" / "thumbnails"
    assert tuple(distances) == velatura.presets()
    assert {path.stem for path in pictures.glob("*.jpg")} == set(velatura.presets())


def test_the_retrieved_layers_are_those_of_every_figure(hooks: ModuleType) -> None:
    """Expected: a file of its own for each, and stacks for each figure of Bati et al. 2021 that shows lobes found."""
    found = hooks.retrieved("bati2021")
    assert len({hooks._retrieved_file(name, "bati2021") for name in found}) == len(found)
    shown = {name.split()[0] for name in FIGURES_OF_LOBES} - {"23"}  # whose stacks are those of 15 (b)
    assert shown <= {name.split()[0] for name in found}
    assert "eta 1.287, alpha 0.0628; depth 0.8227 0.2582 0; eta 2.273, alpha 0.04033" in hooks._retrieved("bati2021")


def test_manuals_of_versions_stand_side_by_side(tmp_path: Path) -> None:
    """Expected: the newest first, by version; one of the same version takes the place of the old one."""
    keep = tool("keep_manual").keep
    site, folder = tmp_path / "site", tmp_path / "manual"
    (site / "bench").mkdir(parents=True)
    for number, name in enumerate(("0.9.0", "0.10.0", "0.9.0", "1.0rc1")):
        (site / "index.html").write_text(str(number))
        keep(site, folder, name)
    (folder / "notes").mkdir()
    assert {path.name for path in folder.iterdir()} == {"index.html", "notes", "0.9.0", "0.10.0", "1.0rc1"}
    assert (folder / "0.9.0" / "index.html").read_text() == "2" and not (folder / "0.9.0" / "bench").exists()
    listed = re.findall('href="(.+?)/index.html"', (folder / "index.html").read_text())
    assert listed == ["1.0rc1", "0.10.0", "0.9.0"]
