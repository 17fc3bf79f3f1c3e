"""The code of the manual and the README, as their pages print it."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = ["README.md", *sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^( *)(?:```|~~~)([\w{}-]*)[^\n]*\n(.*?)^ *(?:```|~~~)$", re.MULTILINE | re.DOTALL)


def blocks(page: str) -> list[tuple[str, str]]:
    """The fenced blocks of a page: language, text."""
    found = BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))
    return [(language, textwrap.dedent(text)) for _, language, text in found if not language.startswith("{")]


def written(page: str, language: str) -> list[str]:
    """The texts of a language on a page."""
    return [text for found, text in blocks(page) if found == language]
