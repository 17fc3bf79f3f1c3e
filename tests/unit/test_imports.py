"""Who may import whom. The tables are the architecture; the tests read every import in the package against them."""

from __future__ import annotations

import ast
import functools
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

SOURCE = Path(__file__).parents[2] / "src" / "velatura"

# Part of the package -> the parts it may import. Every part may import `errors`, `files`, `results` and `version`; a
# part that is not here may import anything.
MAY_IMPORT = {
    "errors": "",
    "files": "",
    "results": "",
    "version": "",
    "readers": "",
    "ops": "",
    "kernel": "pictures",
    "pictures": "",
    "stack": "readers ops",
    "optics": "ops",
    "renderer": "stack optics ops kernel",
    "films": "stack optics ops renderer",
    "media": "stack optics ops renderer",
    "tables": "optics ops renderer",
    "metals": "stack optics",
    "model": "stack optics tables ops renderer films media metals",
    "binding": "stack films kernel",
    "plugins": "stack optics tables model ops kernel binding renderer reference programs",
    "shader": "stack optics tables model ops renderer films media",
    "programs": "light stack optics renderer model reference binding kernel pictures",
    "bakes": "programs",  # and `imports`: public names
    "imports": "programs",
    "exports": "stack model shader programs scenes api kernel",
    "inverse": "stack optics tables model ops films api kernel",
    "light": "renderer",
    "reference": "light stack optics ops kernel binding renderer films media metals",
    "checks": "renderer kernel",
    "scenes": "ops renderer kernel",
    "comparison": "light stack optics model reference renderer checks scenes api kernel bakes",
    "benchmark": "light stack optics model reference checks comparison api kernel bakes programs",
    "progress": "",
    "sweeps": "stack optics model inverse reference checks api kernel progress",
    "figures": "stack optics ops films model inverse reference checks scenes comparison benchmark api kernel",
}

# Room of the default model -> those of its rooms that it may import, which do not import it.
MODEL_ROOMS = {"energies": "", "lobes": "energies", "transmission": "energies lobes"}
BELOW_ROOMS = {"guards", "sample_allocation"}  # files that all of them may import

# The ends of the stream -> who may import them.
IMPORTED_BY = {
    "benchmark": "__init__ cli figures",
    "cli": "__main__",
    "editor": "__init__ cli",
    "comparison": "__init__ figures cli benchmark overview",
    "exports": "__init__ cli editor",
    "imports": "__init__ cli editor",
    "figures": "cli editor",
    "overview": "__init__ cli editor",
    "sweeps": "__init__ cli",
}

# The renderer -> who may import it, and inside functions only: importing Velatura must not load it.
RENDERER = {
    "mitsuba": "kernel",
    "drjit": "kernel ops renderer films tables binding plugins reference checks scenes benchmark figures",
}

# Modules -> what importing them must not load.
LOADS_NO = {
    "velatura": "mitsuba drjit numpy pydantic typing",
    "velatura.cli": "mitsuba drjit numpy pydantic scipy matplotlib yaml rich",
    "velatura.stack": "mitsuba drjit",
    "velatura.optics": "mitsuba drjit",
    "velatura.tables": "mitsuba drjit scipy matplotlib",
    "velatura.model": "mitsuba drjit scipy matplotlib",
    "velatura.kernel": "mitsuba drjit",
    "velatura.scenes": "mitsuba drjit",
    "velatura.exports": "mitsuba drjit numpy",
    "velatura.imports": "mitsuba drjit numpy",
    "velatura.bakes": "mitsuba drjit scipy matplotlib",
    "velatura.plugins": "mitsuba drjit",
    "velatura.sweeps": "mitsuba drjit matplotlib xarray zarr dask distributed",
    "velatura.comparison": "mitsuba drjit matplotlib",
    "velatura.benchmark": "mitsuba drjit matplotlib",
    "velatura.figures": "mitsuba drjit matplotlib",
    "velatura.editor.server": "mitsuba drjit scipy matplotlib",
}

FILES = sorted(SOURCE.rglob("*.py"))
PARTS = {path.relative_to(SOURCE).parts[0].removesuffix(".py") for path in FILES}


def module_of(path: Path) -> str:
    return ".".join(("velatura", *path.relative_to(SOURCE).with_suffix("").parts)).removesuffix(".__init__")


MODULES = {module_of(path) for path in FILES}


def part_of(path: Path) -> str:
    return path.relative_to(SOURCE).parts[0].removesuffix(".py")


@functools.cache  # reading all sources takes two seconds
def imports(path: Path, text: str = "", types: bool = True) -> tuple[tuple[str, bool], ...]:
    """Every module that a file imports, by its full name, and whether that happens when the file is imported.

    A file that calls `import_module` imports every module that it names in a text. `types`: also what only checkers of
    types import.
    """

    tree = ast.parse(text or path.read_text(encoding="utf-8"))
    by_name = any(isinstance(node, ast.Name) and node.id == "import_module" for node in ast.walk(tree))

    def visit(node: ast.AST, at_import: bool) -> Iterator[tuple[str, bool]]:
        if for_type_checkers(node) and not types:
            return
        if isinstance(node, ast.Import):
            yield from ((alias.name, at_import) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((f"{origin(node)}.{alias.name}", at_import) for alias in node.names)
        elif by_name and isinstance(node, ast.Constant) and node.value in MODULES and node.value != "velatura":
            yield node.value, False
        inside = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda) or for_type_checkers(node)
        for child in ast.iter_child_nodes(node):
            yield from visit(child, at_import and not inside)

    def origin(node: ast.ImportFrom) -> str:
        if not node.level:
            return node.module or ""
        package = ("velatura", *path.relative_to(SOURCE).parent.parts)
        return ".".join([*package[: len(package) - node.level + 1], *filter(None, [node.module])])

    return tuple(visit(tree, True))


def for_type_checkers(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def siblings(path: Path) -> set[str]:
    """The parts of the package that a file imports, other than its own."""
    names = (name.split(".") for name, _ in imports(path))
    found = {name[1] if len(name) > 1 and name[1] in PARTS else "__init__" for name in names if name[0] == "velatura"}
    return found - {part_of(path)}


@pytest.mark.parametrize("part", [part for part in MAY_IMPORT if part in PARTS])
def test_a_part_imports_what_stands_above_it(part: str) -> None:
    allowed = {"errors", "files", "results", "version", *MAY_IMPORT[part].split()}
    offences = {str(path): siblings(path) - allowed for path in FILES if part_of(path) == part}
    assert not {path: names for path, names in offences.items() if names}


@pytest.mark.parametrize("part", IMPORTED_BY)
def test_nothing_imports_the_ends_of_the_stream(part: str) -> None:
    importers = {part_of(path) for path in FILES if part in siblings(path)}
    assert importers <= set(IMPORTED_BY[part].split())


def test_no_more_than_two_files_import_each_other_in_a_circle() -> None:
    """Imports inside functions count, and so do the names that the public surface imports at their first use."""
    paths = dict(zip(map(module_of, FILES), FILES))
    number = {name: n for n, name in enumerate(paths)}
    arrows = np.zeros((len(paths), len(paths)), bool)
    for name, path in paths.items():
        for imported, _ in imports(path, types=name == "velatura"):
            above = [imported.rsplit(".", n)[0] for n in range(imported.count(".") + 1)]
            arrows[number[name], [number[each] for each in above if each in number][:1]] = True
    count, circle = connected_components(arrows, connection="strong")
    circles = [[name for name in paths if circle[number[name]] == n] for n in range(count)]
    assert not [names for names in circles if len(names) > 2]


def test_the_rooms_of_the_models_know_no_other_room() -> None:
    """What stands at the door of `model` imports no room, but for the registry, which has every engine."""
    rooms = [path.name for path in (SOURCE / "model").iterdir() if (path / "__init__.py").exists()]
    offences = [
        (str(path), name)
        for path in FILES
        if part_of(path) == "model" and path.name != "registry.py"
        for name, _ in imports(path)
        for room in rooms
        if f"{name}.".startswith(f"velatura.model.{room}.") and SOURCE / "model" / room not in path.parents
    ]
    assert len(rooms) > 1 and not offences


@pytest.mark.parametrize("room", MODEL_ROOMS)
def test_the_rooms_of_the_default_model_stand_on_each_other(room: str) -> None:
    allowed = {room, *MODEL_ROOMS[room].split(), *BELOW_ROOMS}
    files = sorted((SOURCE / "model" / "solved" / room).glob("*.py"))
    names = {name for path in files for name, _ in imports(path) if name.startswith("velatura.model.solved.")}
    assert files and {name.split(".")[3] for name in names} <= allowed


@pytest.mark.parametrize("library", RENDERER)
def test_the_renderer_is_imported_inside_functions_of_few(library: str) -> None:
    uses = [(part_of(path), at_import) for path in FILES for name, at_import in imports(path) if _is(name, library)]
    assert {part for part, at_import in uses} <= set(RENDERER[library].split())
    assert not any(at_import for _, at_import in uses)


@pytest.mark.parametrize("module", LOADS_NO)
def test_importing_loads_little(module: str) -> None:
    script = f"import {module}, sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout.split()
    assert not set(LOADS_NO[module].split()) & set(loaded)


def test_the_reader_of_imports_sees_every_form() -> None:
    """The rules are only as good as the reader, so it is tried on a file with all the ways to break them."""
    path = SOURCE / "optics" / "example.py"
    text = """
import velatura.model as m
from velatura.tables.fetch import Table
from velatura import stack, load
from ..plugins import layered
from . import fresnel
if TYPE_CHECKING:
    import mitsuba
def f():
    import drjit as dr
    import_module("velatura.api")
TABLE = {"bake": "velatura.shader.lookups.bake"}
"""
    found = dict(imports(path, text))
    assert found == {
        "velatura.model": True,
        "velatura.tables.fetch.Table": True,
        "velatura.stack": True,
        "velatura.load": True,
        "velatura.plugins.layered": True,
        "velatura.optics.fresnel": True,
        "mitsuba": False,
        "drjit": False,
        "velatura.api": False,
        "velatura.shader.lookups.bake": False,
    }


def _is(name: str, library: str) -> bool:
    return name == library or name.startswith(f"{library}.")
