"""Numerical guards of an engine stand in one file, and so do the constants that were fitted."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import velatura
from velatura.model import fitted

MODELS = Path(velatura.__file__).parent / "model"
GUARD = re.compile(r"GRAZING|TINY|.*_EPS|(ALPHA|COS|SIN|G|ENERGY|MOMENTUM|VARIANCE)(_\w+)?_(MIN|MAX)")


def test_no_module_of_the_models_has_a_guard_of_its_own() -> None:
    """Expected: bounds beyond which values are evaluated as these, in `guards.py` of the engine under one name each."""
    others = set[tuple[str, str]]()
    for path in MODELS.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [x.id for x in node.targets if isinstance(x, ast.Name)] if isinstance(node, ast.Assign) else []
            owned = [x for x in names if GUARD.fullmatch(x) and path.name not in ("guards.py", "fitted.py")]
            again = [x for x in names if hasattr(fitted, x) and path.name != "fitted.py"]
            others |= {(path.name, x) for x in (*owned, *again)}
    assert others == set()
