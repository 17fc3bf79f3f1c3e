"""Docstrings begin with a noun or a verb."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACES = ("src/velatura", "benchmarks", "tests/shared", "tools")
DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
# Prepositions, and a relative pronoun without its noun
HEADLESS = {
    *("about", "above", "after", "along", "among", "as", "at", "before", "below", "beside", "between", "by", "for"),
    *("from", "in", "into", "of", "on", "over", "per", "through", "to", "towards", "under", "until", "with", "without"),
    "what",
}


def docstrings(path: Path) -> Iterator[tuple[int, str]]:
    """The line and the text of every docstring of a file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, DOCUMENTED) and (text := ast.get_docstring(node)):
            yield node.body[0].lineno, text


@pytest.mark.parametrize("place", PLACES)
def test_a_docstring_begins_with_a_noun_or_a_verb(place: str) -> None:
    """Rationale: CONTRIBUTING, "Style of the text". Expected: the first line says what is returned or done."""
    files = [path for path in sorted((ROOT / place).rglob("*.py")) if "node_modules" not in path.parts]
    assert files
    headless = [
        f"{path.relative_to(ROOT)}:{line}: {text.splitlines()[0]}"
        for path in files
        for line, text in docstrings(path)
        if text.split()[0].strip(",.:").lower() in HEADLESS
    ]
    assert not headless, "\n".join(headless)
