"""What to cite for a picture: entries of `references.bib`, which comes with the package."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from importlib.resources import files

from velatura.errors import InvalidInput
from velatura.model import DEFAULT, MODELS
from velatura.stack.schema import unknown
from velatura.version import __version__

#: Keys of the papers behind a model, where that is not the one paper of its name.
PAPERS: dict[str, tuple[str, ...]] = {
    "velatura": (),
    "realtime": ("belcour2018", "weier2020"),
    "reference": ("guo2018", "heitz2016"),
    "weidlich_wilkie": ("weidlich2007",),
}
PROGRAMS = ("velatura", "mitsuba3")  # of every picture

_ENTRY = re.compile(r"^@\w+\{(\w+),\n.*?^\}", re.MULTILINE | re.DOTALL)
_FIELD = re.compile(r"^  (\w+) *= \{(.*?)\},?$(?=\n  \w+ *=|\n\})", re.MULTILINE | re.DOTALL)
_ACCENT = re.compile(r"""\{?\\([`'^"~v])\s*\{?(\w)\}?\}?""")
_MARKS = {"`": "\u0300", "'": "\u0301", "^": "\u0302", "~": "\u0303", '"': "\u0308", "v": "\u030c"}


def bibliography() -> str:
    """The file, BibTeX, with this version of Velatura."""
    text = (files("velatura") / "references.bib").read_text(encoding="utf-8")
    return text.replace("@software{velatura,", f"@software{{velatura,\n  version = {{{__version__}}},")


def entries(models: Sequence[str] = ()) -> dict[str, str]:
    """BibTeX by key of the papers of some models, or of the default one, and of the programs.

    Raises:
        InvalidInput: a name that is neither a model's, nor `reference` or `weidlich_wilkie`.
    """
    names = list(dict.fromkeys([*(model.name for model in MODELS), *PAPERS]))
    keys: list[str] = []
    for model in models or (DEFAULT,):
        if model not in names:
            raise InvalidInput(unknown("model", model, names))
        keys += PAPERS.get(model, (model,))
    known = {match[1]: match[0] for match in _ENTRY.finditer(bibliography())}
    return {key: known[key] for key in dict.fromkeys([*keys, *PROGRAMS])}


def text(entry: str) -> str:
    """An entry as a line of plain text: authors, year, title, and where it appeared."""
    found = {match[1]: _plain(match[2]) for match in _FIELD.finditer(entry)}
    version = f", version {found['version']}" if "version" in found else ""
    numbers = found.get("volume", "") + (f"({found['number']})" if "number" in found else "")
    places = [found.get(key, "") for key in ("journal", "booktitle", "howpublished", "publisher")]
    where = ", ".join(filter(None, [" ".join(filter(None, [*places[:1], numbers])), *places[1:], found.get("pages")]))
    link = f"https://doi.org/{found['doi']}" if "doi" in found else found.get("url", "")
    authors = found["author"].replace(" and ", "; ")
    return " ".join(
        filter(None, [f"{authors} ({found['year']}).", f"{found['title']}{version}.", where and f"{where}.", link])
    )


def _plain(value: str) -> str:
    """A value without TeX."""
    accented = _ACCENT.sub(lambda m: unicodedata.normalize("NFC", m[2] + _MARKS[m[1]]), value)
    return " ".join(re.sub(r"[{}]|\\(?=&)", "", accented).replace("--", "\u2013").split())
