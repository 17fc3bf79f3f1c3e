"""Programs of `benchmarks`, of which tests run a slice, and of `tools`."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "benchmarks"
sys.path.append(str(FOLDER))  # at the end: modules here may have the names of programs


def benchmark(name: str) -> Any:
    """A program of `benchmarks` as a module."""
    return _loaded(FOLDER / f"{name}.py")


def tool(name: str) -> Any:
    """A program of `tools` as a module."""
    return _loaded(ROOT / "tools" / f"{name}.py")


def _loaded(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(f"{path.parent.name}_{path.stem}", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
