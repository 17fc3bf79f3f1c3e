"""Citations for a picture: entries of `references.bib`, which comes with the package, and sources of indices."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from importlib.resources import files

from velatura.errors import InvalidInput
from velatura.model import DEFAULT, MODELS
from velatura.stack import substances
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
DATABASE = "polyanskiy2024"  # of pages

_ENTRY = re.compile(r"^@\w+\{(\w+),\n.*?^\}", re.MULTILINE | re.DOTALL)
_FIELD = re.compile(r"^  (\w+) *= \{(.*?)\},?$(?=\n  \w+ *=|\n\})", re.MULTILINE | re.DOTALL)
_ACCENT = re.compile(r"""\{?\\([`'^"~v])\s*\{?(\w)\}?\}?""")
_MARKS = {"`": "\u0300", "'": "\u0301", "^": "\u0302", "~": "\u0303", '"': "\u0308", "v": "\u030c"}


def bibliography() -> str:
    """The file, BibTeX, with this version of Velatura."""
    text = (files("velatura") / "references.bib").read_text(encoding="utf-8")
    return text.replace("@software{velatura,", f"@software{{velatura,\n  version = {{{__version__}}},")


def entries(used: Sequence[str] = ()) -> dict[str, str]:
    """BibTeX by key of the papers of what was used, or of the default model, and of the programs.

    Args:
        used: names of models; pages of refractiveindex.info, by shelf/book/page or the path of a file.

    Raises:
        InvalidInput: a name that is neither a model's, nor `reference` or `weidlich_wilkie`, nor that of a page.
    """
    names = list(dict.fromkeys([*(model.name for model in MODELS), *PAPERS]))
    known = {match[1]: match[0] for match in _ENTRY.finditer(bibliography())}
    keys: list[str] = []
    for name in used or (DEFAULT,):
        if "/" in name or substances.is_path(name):
            known[name] = _of_page(name)
            keys += (name, DATABASE)
        elif name in names:
            keys += PAPERS.get(name, (name,))
        else:
            raise InvalidInput(unknown("model", name, names))
    return {key: known[key] for key in dict.fromkeys([*keys, *PROGRAMS])}


def _of_page(name: str) -> str:
    """An entry with the reference that a page of refractiveindex.info states."""
    page = substances.page(name)
    fields = {"title": name, "howpublished": "refractiveindex.info", "note": page.reference, "doi": page.doi}
    lines = (f"  {key:12} = {{{value if key == 'doi' else _tex(value)}}}" for key, value in fields.items() if value)
    return f"@misc{{{re.sub(r'[^A-Za-z0-9./_+-]', '-', name)},\n" + ",\n".join(lines) + "\n}"


def text(entry: str) -> str:
    """An entry as a line of plain text: authors, year, title, and where it appeared; of a page, its reference."""
    found = {match[1]: _plain(match[2]) for match in _FIELD.finditer(entry)}
    version = f", version {found['version']}" if "version" in found else ""
    numbers = found.get("volume", "") + (f"({found['number']})" if "number" in found else "")
    places = [found.get(key, "") for key in ("journal", "booktitle", "howpublished", "publisher")]
    where = ", ".join(filter(None, [" ".join(filter(None, [*places[:1], numbers])), *places[1:], found.get("pages")]))
    link = f"https://doi.org/{found['doi']}" if "doi" in found else found.get("url", "")
    if "author" not in found:
        return " ".join(filter(None, [found.get("note"), link, f"({found['title']} of {found['howpublished']})"]))
    authors = found["author"].replace(" and ", "; ")
    return " ".join(
        filter(None, [f"{authors} ({found['year']}).", f"{found['title']}{version}.", where and f"{where}.", link])
    )


def _tex(value: str) -> str:
    """A plain text as TeX; signs that are rare in names and titles are left out."""
    return re.sub(r"([&%#_$])", r"\\\1", re.sub(r"[\\{}^~]", " ", value))


def _plain(value: str) -> str:
    """A value without TeX."""
    accented = _ACCENT.sub(lambda m: unicodedata.normalize("NFC", m[2] + _MARKS[m[1]]), value)
    return " ".join(re.sub(r"[{}]|\\(?=[&%#_$])", "", accented).replace("--", "\u2013").split())
