"""What the source cites: `Author Year`, by the keys of references.bib."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

ROOT = Path(__file__).parents[2]

# One author, two, or several, and a year; lines are joined before they are searched
CITATION = re.compile(r"\b([A-Z][a-zà-ÿ]+)(?:(?: and | & )[A-Z][a-zà-ÿ]+| et al\.)? \(?((?:19|20)\d\d)\b")
EQUATIONS = re.compile(CITATION.pattern + r", Eqs?\. (\d+(?:(?:-|, | and )\d+)*)")

#: Equations of Belcour 2018 by file, each compared with the print when it was put here.
OF_BELCOUR_2018 = {
    "model/adding.py": {"28-31", "34-35", "38, 49-51"},
    "model/maps.py": {"6"},
    "model/mixture.py": {"39-40"},
    "model/momentum.py": {"21", "28-31"},
    "model/operators.py": {"7-13", "10", "15-17, 21-24"},
    "tables/build/quadrature.py": {"2"},
    "tables/build/single_scattering.py": {"2"},
    "tables/fetch.py": {"2"},
}


def source() -> dict[str, str]:
    """Text by file of the package, every run of white space and comment signs as one space."""
    package = ROOT / "src/velatura"
    files = [path for path in package.rglob("*.py") if "node_modules" not in path.parts]
    return {str(p.relative_to(package)): re.sub(r"\s+(#\s+)?", " ", p.read_text(encoding="utf-8")) for p in files}


def key(author: str, year: str) -> str:
    letters = unicodedata.normalize("NFKD", author).encode("ascii", "ignore").decode()
    return letters.lower() + year


def test_every_citation_has_an_entry() -> None:
    entries = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "references.bib").read_text(encoding="utf-8"), re.MULTILINE))
    cited = {(key(m[1], m[2]), file) for file, text in source().items() for m in CITATION.finditer(text)}
    assert len({found for found, _ in cited}) > 10
    assert sorted(pair for pair in cited if pair[0] not in entries) == []


def test_equations_are_those_that_were_read_in_print() -> None:
    found: dict[str, set[str]] = {}
    for file, text in source().items():
        for citation in EQUATIONS.finditer(text):
            if key(citation[1], citation[2]) == "belcour2018":
                found.setdefault(file, set()).add(citation[3])
    assert found == OF_BELCOUR_2018
