"""The Python of the manual and the README passes strict type checkers, and types are as wide as what runs.

Rationale: a user's own checker reads the snippet that was copied. Expected: mypy, strict, and pyright find nothing in
all Python of the pages, one function a page, nor in `WIDE`, whose refusals both must have.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from manual import PAGES, written

import velatura

SOURCES = str(Path(velatura.__file__).parents[1])

# What packages use within, which no page imports: mypy would read it for as long as all else
WITHIN = (
    *("anyio", "dask", "distributed", "fsspec", "ipykernel", "IPython", "jinja2", "jupyter_client", "jupyter_server"),
    *("PIL", "prompt_toolkit", "pyparsing", "rich", "tornado", "zarr", "zmq"),
)

# What is taken and given, run as well; the lines with `ignore` must be errors of types, and are not run
WIDE = """
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from typing_extensions import assert_type

import velatura as vt
from velatura.model.lobe_statistics import StackLobes

film = {"eta": 1.4, "thickness_nm": 300}
other = vt.Film(eta=[1.3, 1.4, 1.5], thickness_nm=100)
glass = vt.Interface(eta=np.float32(1.5), alpha=[0.1, np.float64(0.2)], films=[film, other])
tint = {"spectrum": [[400, 1], [700, 2]]}
medium = vt.Medium(depth=np.float32(0.5), sigma_a=np.array([0.1, 0.2, 0.3]), sigma_s=tint)
stack = vt.Stack([glass, medium, {"interface": {"conductor": "Au"}}])
mixture = vt.Mix([(np.float32(0.25), "bare-gold"), (None, stack)])
space = vt.Space(material="coated-gold", vary={"layer0_alpha": {"range": [0.1, 0.3], "steps": 3}})
axis = vt.Axis(values=np.linspace(0.1, 0.3, 3))
paint = vt.Pigment(K=[1, 2, 3], S=np.array([3.0, 2.0, 1.0]))
assert_type(glass.films, tuple[vt.Film, ...])
assert_type(vt.Medium().depth, float | vt.Texture)
assert_type(mixture.mix[0].material, vt.Stack | vt.Mix)
assert_type(axis.values, tuple[Any, ...] | None)


def not_run() -> None:
    assert_type(vt.render("coated-gold"), NDArray[np.float32])
    assert_type(vt.bsdf("coated-gold"), mi.BSDF)
    assert_type(vt.lobes(Path("gold.yaml"), [1.0, 0.5]), StackLobes | Any)
    vt.check(vt.bsdf(stack), expected="coated-gold")
    vt.Medium(depth="thick")  # type: ignore
    vt.Interface(eta=1.5, alpha="rough")  # type: ignore
    vt.Interface(eta=3 + 1j)  # type: ignore
    vt.Interface(eta=1.5, film=[film])  # type: ignore
    vt.Stack([1.5])  # type: ignore
    vt.check(3)  # type: ignore
"""


@pytest.fixture(scope="module")
def snippets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with all Python of the manual."""
    path = tmp_path_factory.mktemp("types") / "snippets.py"
    text = ["from __future__ import annotations", WIDE]
    for page in PAGES:
        if found := written(page, "python"):
            name = re.sub("[^a-z0-9]", "_", page.lower())
            text.append(f"def {name}() -> None:\n" + textwrap.indent("\n".join(found), "    "))
    path.write_text("\n\n".join(text), encoding="utf-8")
    return path


def test_mypy_finds_nothing(snippets: Path, request: pytest.FixtureRequest) -> None:
    cache = getattr(request.config, "cache", None)
    folder = cache.mkdir("mypy") if cache else snippets.parent
    imported = re.findall(r"^\s*(?:import|from) (\w+)", snippets.read_text(encoding="utf-8"), re.MULTILINE)
    assert not set(imported) & set(WITHIN)
    within = ",".join(f"{name}.*" for name in WITHIN)
    (snippets.parent / "mypy.ini").write_text(f"[mypy]\n[mypy-{within}]\nfollow_imports = skip\n")
    # Without a warning where a power of floats is returned, which is Any
    options = ["--strict", "--no-warn-return-any", "--follow-imports=silent", "--config-file=mypy.ini", "--cache-dir"]
    command = [sys.executable, "-m", "mypy", *options, folder, snippets.name]
    paths = {**os.environ, "MYPYPATH": SOURCES}
    run = subprocess.run(command, capture_output=True, text=True, cwd=snippets.parent, env=paths)
    assert run.returncode == 0, run.stdout + run.stderr


def test_pyright_finds_nothing(snippets: Path) -> None:
    pytest.importorskip("pyright")
    settings = {
        "include": [snippets.name],
        "extraPaths": [SOURCES],
        "reportUnusedExpression": False,  # pages name what there is
        "reportUnnecessaryTypeIgnoreComment": True,
    }
    (snippets.parent / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    command = [sys.executable, "-m", "pyright", "--pythonpath", sys.executable, "--project", snippets.parent]
    run = subprocess.run(command, capture_output=True, text=True, cwd=snippets.parent)
    assert run.returncode == 0, run.stdout + run.stderr


def test_what_types_allow_runs() -> None:
    exec(WIDE, {})
