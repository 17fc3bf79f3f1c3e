"""Pages of the refractiveindex.info database: measured indices of substances (Polyanskiy 2024).

A page is a YAML file of tables and dispersion formulas over wavelengths in micrometres, and is called by its names in
the catalogue, shelf/book/page. Some come with the package, as a small copy of the database; those of a whole copy are
read from the folder that the environment's VELATURA_REFRACTIVEINDEX names.
"""

from __future__ import annotations

import functools
import html
import math
import os
import re
from bisect import bisect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, TypeAlias

from velatura.errors import InvalidInput, one_line, within
from velatura.files import number, text_of
from velatura.stack.schema import show, unknown
from velatura.stack.spectra import VISIBLE_NM
from velatura.stack.tables import Table
from velatura.stack.text import parsed

PACKAGED = Path(str(resources.files("velatura.stack") / "refractiveindex"))
COPY = "VELATURA_REFRACTIVEINDEX"  # in the environment: the folder of a copy
CATALOG = "catalog-nk.yml"  # of a copy, beside its folder `data`
ENDINGS = (".yml", ".yaml")  # of pages that are read by path

#: A substance is opaque if k exceeds this in the mean over wavelengths of visible light: micrometres absorb it.
OPAQUE_K, SEEN_NM = 0.01, range(400, 701, 50)

_VISIBLE_UM = (VISIBLE_NM[0] * 1e-3, VISIBLE_NM[1] * 1e-3)
_LARGEST = 2**22  # bytes of a file
_PER_UM = 2000  # wavelengths of a formula in a spectrum: straight lines err by 1e-6
_COEFFICIENTS = 32  # of a formula; the database has up to 17


# A page --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rows:
    """Values at wavelengths in micrometres, ascending, joined by straight lines."""

    um: tuple[float, ...]
    values: tuple[float, ...]

    @property
    def range_um(self) -> tuple[float, float]:
        return self.um[0], self.um[-1]

    def at(self, um: float) -> float:
        """The value at a wavelength; beyond the ends the last one holds."""
        i = bisect(self.um, um)
        if i in (0, len(self.um)):
            return self.values[min(i, len(self.um) - 1)]
        (a, b), (u, v) = self.um[i - 1 : i + 1], self.values[i - 1 : i + 1]
        return u + (v - u) * (um - a) / (b - a)

    def between(self, low: float, high: float) -> list[float]:
        """The wavelengths that the table has there, with those next to the ends."""
        return list(self.um[max(bisect(self.um, low) - 1, 0) : bisect(self.um, high) + 1])


@dataclass(frozen=True)
class Formula:
    """A dispersion formula of the database, by its number and coefficients, in a range of wavelengths (micrometres)."""

    formula: int
    coefficients: tuple[float, ...]
    range_um: tuple[float, float]

    def at(self, um: float) -> float:
        """The index at a wavelength; beyond the range that at its end holds.

        Raises:
            InvalidInput: the formula has none there.
        """
        um = min(max(um, self.range_um[0]), self.range_um[1])
        try:
            index = FORMULAS[self.formula](self.coefficients, um)
            if math.isfinite(index):
                return index
        except (ArithmeticError, ValueError, TypeError):  # a power of a negative number is complex
            pass
        raise InvalidInput(f"formula {self.formula} has no index at {um * 1e3:.4g} nm")

    def between(self, low: float, high: float) -> list[float]:
        """Wavelengths there, so near that straight lines between are the formula, with the ends of the range."""
        low, high = max(low, self.range_um[0]), min(high, self.range_um[1])
        inside = range(math.floor(low * _PER_UM) + 1, math.ceil(high * _PER_UM))
        return [low, *(place / _PER_UM for place in inside), high]


Curve: TypeAlias = Rows | Formula


@dataclass(frozen=True)
class Page:
    """The index n + i k of a substance, each part None where it was not measured, and a `reference` in plain text.

    `doi` is the reference's; empty if it names none.
    """

    n: Curve | None
    k: Curve | None
    reference: str
    doi: str

    @property
    def opaque(self) -> bool:
        """Whether visible light passes no thickness that is seen: the mean of k exceeds `OPAQUE_K`."""
        if self.k is None or not is_visible(self.k):
            return False
        return sum(self.k.at(nm * 1e-3) for nm in SEEN_NM) > OPAQUE_K * len(SEEN_NM)


def is_visible(curve: Curve) -> bool:
    """Whether visible light lies between the wavelengths that it holds."""
    low, high = curve.range_um
    return low < high and low < _VISIBLE_UM[1] and high > _VISIBLE_UM[0]


def visible(curve: Curve) -> Table:
    """Visible wavelengths in nanometres, and the values there.

    Raises:
        InvalidInput: it has fewer than two, or a formula has no index there.
    """
    if not is_visible(curve):
        raise InvalidInput("must hold values at two wavelengths or more of visible light")
    places = curve.between(*_VISIBLE_UM)
    return tuple(um * 1e3 for um in places), tuple(map(curve.at, places))


# The formulas --------------------------------------------------------------------------------------------------------


Coefficients: TypeAlias = Sequence[float]


def _pairs(c: Coefficients, term: Callable[[float, float], float], first: int = 1) -> float:
    """The sum of a term of two coefficients each."""
    return sum(term(a, b) for a, b in zip(c[first::2], c[first + 1 :: 2], strict=True))


def _sellmeier(c: Coefficients, um: float) -> float:
    return math.sqrt(1 + c[0] + _pairs(c, lambda b, pole: b * um**2 / (um**2 - pole**2)))


def _sellmeier_2(c: Coefficients, um: float) -> float:
    return math.sqrt(1 + c[0] + _pairs(c, lambda b, pole2: b * um**2 / (um**2 - pole2)))


def _polynomial(c: Coefficients, um: float) -> float:
    return math.sqrt(c[0] + _pairs(c, lambda b, power: b * um**power))


def _refractiveindex_info(c: Coefficients, um: float) -> float:
    poles = sum(c[i] * um ** c[i + 1] / (um**2 - c[i + 2] ** c[i + 3]) for i in (1, 5) if len(c) > i)
    return math.sqrt(c[0] + poles + _pairs(c, lambda b, power: b * um**power, first=9))


def _cauchy(c: Coefficients, um: float) -> float:
    return c[0] + _pairs(c, lambda b, power: b * um**power)


def _gases(c: Coefficients, um: float) -> float:
    return 1 + c[0] + _pairs(c, lambda b, pole: b / (pole - um**-2))


def _herzberger(c: Coefficients, um: float) -> float:
    near = 1 / (um**2 - 0.028)
    return c[0] + c[1] * near + c[2] * near**2 + sum(b * um ** (2 * i) for i, b in enumerate(c[3:], start=1))


def _retro(c: Coefficients, um: float) -> float:
    ratio = c[0] + c[1] * um**2 / (um**2 - c[2]) + c[3] * um**2
    return math.sqrt((1 + 2 * ratio) / (1 - ratio))


def _exotic(c: Coefficients, um: float) -> float:
    return math.sqrt(c[0] + c[1] / (um**2 - c[2]) + c[3] * (um - c[4]) / ((um - c[4]) ** 2 + c[5]))


#: Polyanskiy 2024, "Dispersion formulas": the index of coefficients and a wavelength in micrometres.
FORMULAS: dict[int, Callable[[Coefficients, float], float]] = {
    1: _sellmeier,
    2: _sellmeier_2,
    3: _polynomial,
    4: _refractiveindex_info,
    5: _cauchy,
    6: _gases,
    7: _herzberger,
    8: _retro,
    9: _exotic,
}

#: How many coefficients a formula must have: from, to, in steps of.
_COUNTS = {4: (1, 9, 4), 7: (3, 6, 1), 8: (4, 4, 1), 9: (6, 6, 1)}


# Reading -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Entry:
    """A page in the catalogue of a copy of the database: its book and its title in plain text, and its file."""

    book: str
    title: str
    path: Path

    @property
    def short(self) -> str:
        """The substance, and in brackets who measured it, as a menu has them."""
        words = re.search(r" \((.+)\)$", self.book)
        substance = (words[1] if words else self.book).split(", ")[0]
        measured = re.sub(r"n(,k)?(\(o\))? [\d.e–]+ µm(; )?", "", self.title).strip(" :;")
        return f"{substance} ({measured})"


def names() -> tuple[str, ...]:
    """The names, shelf/book/page, of the pages that come with the package."""
    return tuple(catalog(PACKAGED))


def entries() -> Mapping[str, Entry]:
    """All pages by name: those of the package, then those of a copy that the environment names.

    Raises:
        InvalidInput: there is no such copy.
    """
    folder = os.environ.get(COPY)
    if not folder:
        return catalog(PACKAGED)
    copy = Path(folder)
    if not (copy / CATALOG).is_file():
        copy /= "database"  # of the whole repository
    with within(COPY):
        return {**catalog(copy), **catalog(PACKAGED)}  # a material is the same with and without a copy


def entry(name: str) -> Entry:
    """The page of a name.

    Raises:
        InvalidInput: there is none.
    """
    known = catalog(PACKAGED)
    if name not in known:
        known = entries()
    if name not in known:
        listed = f"`velatura substances` lists all; others are read from a copy of the database, {COPY}"
        raise InvalidInput(unknown("page of refractiveindex.info", name, known, listed))
    return known[name]


def page(name: str | Path) -> Page:
    """The page of a name, or in a file.

    Raises:
        InvalidInput: there is none, or the file holds none; one line that names the file.
    """
    path = Path(name) if is_path(name) else entry(str(name)).path
    return _page(text_of(path, _LARGEST), str(path))


def is_path(name: str | Path) -> bool:
    """Whether a page is called by the path of its file."""
    return isinstance(name, Path) or name.lower().endswith(ENDINGS)


def catalog(copy: Path) -> Mapping[str, Entry]:
    """The pages in a copy of the database.

    Raises:
        InvalidInput: it holds no catalogue.
    """
    path = copy / CATALOG
    return _catalog(text_of(path, _LARGEST), path)


@functools.lru_cache(4)
def _catalog(text: str, path: Path) -> Mapping[str, Entry]:
    found: dict[str, Entry] = {}
    data = path.parent / "data"
    try:
        for shelf in parsed(text, "yaml", path):
            for book in shelf.get("content", ()):
                for each in book.get("content", ()):
                    if "PAGE" not in each:
                        continue
                    name = f"{shelf['SHELF']}/{book['BOOK']}/{each['PAGE']}"
                    if ".." in Path(each["data"]).parts or Path(each["data"]).is_absolute():
                        raise InvalidInput(f"{path}: {show(name)} lies outside of the database")
                    entry = Entry(_plain(book["name"]), _plain(each["name"]), data / each["data"])
                    found.setdefault(name, entry)
    except (TypeError, KeyError, AttributeError):
        raise InvalidInput(f"{path}: is no catalogue of the refractiveindex.info database") from None
    return found


@functools.lru_cache(256)
def _page(text: str, where: str) -> Page:
    fields = parsed(text, "yaml", where)
    if not isinstance(fields, Mapping) or not isinstance(fields.get("DATA"), list):
        raise InvalidInput(f"{where}: is no page of the refractiveindex.info database: it has no DATA")
    found: dict[str, Curve] = {}
    with within(where):
        for block in fields["DATA"]:
            found.update(_curves(block))
        if not found:
            raise InvalidInput("DATA: holds neither n nor k")
    reference = str(fields.get("REFERENCES") or "")
    doi = re.search(r"doi\.org/(10\.[^\s\"'<>)]+)", reference)
    return Page(found.get("n"), found.get("k"), _plain(reference), doi[1] if doi else "")


def _curves(block: Any) -> dict[str, Curve]:
    """The parts of the index, n and k, that a block of data holds."""
    kind = block.get("type") if isinstance(block, Mapping) else None
    word, _, which = str(kind).partition(" ")
    if word == "tabulated" and which in ("nk", "n", "k"):
        columns = _columns(block.get("data"), 1 + len(which))
        return {part: Rows(columns[0], values) for part, values in zip(which, columns[1:])}
    if word == "formula" and which in map(str, FORMULAS):
        return {"n": _formula(int(which), block)}
    raise InvalidInput(f"DATA: type: must be tabulated nk, n or k, or formula 1 to 9, got {show(kind)}")


def _columns(text: Any, count: int) -> list[tuple[float, ...]]:
    """The columns of a table, wavelengths first and ascending; of rows at the same wavelength the first one is kept."""
    rows: dict[float, tuple[float, ...]] = {}
    for at, line in enumerate(str(text).splitlines(), start=1):
        if not line.strip():
            continue
        row = _numbers(line, f"data: line {at}")
        if len(row) != count or row[0] <= 0:
            values = "a value" if count == 2 else "two values"
            raise InvalidInput(f"DATA: data: line {at}: must be a wavelength in micrometres and {values}")
        rows.setdefault(row[0], row)
    if not rows:
        raise InvalidInput("DATA: data: holds no rows")
    return list(zip(*(rows[um] for um in sorted(rows))))


def _formula(formula: int, block: Mapping[str, Any]) -> Formula:
    coefficients = _numbers(block.get("coefficients"), "coefficients")
    low, high, step = _COUNTS.get(formula, (1, _COEFFICIENTS, 2))
    count = len(coefficients)
    if formula == 4 and count > high:  # powers follow
        low, high, step = high, _COEFFICIENTS, 2
    if not low <= count <= high or (count - low) % step:
        raise InvalidInput(f"DATA: coefficients: formula {formula} has no {count} of them")
    ends = _numbers(block.get("wavelength_range"), "wavelength_range")
    if len(ends) != 2 or not 0 < ends[0] < ends[1]:
        raise InvalidInput("DATA: wavelength_range: must be two wavelengths in micrometres, which ascend")
    return Formula(formula, coefficients, (ends[0], ends[1]))


def _numbers(text: Any, key: str) -> tuple[float, ...]:
    """The finite numbers in a text."""
    try:
        found = tuple(map(number, str(text).split()))
        if all(map(math.isfinite, found)):
            return found
    except ValueError:
        pass
    raise InvalidInput(f"DATA: {key}: must be finite numbers")


def _plain(text: str) -> str:
    """A text of the database without its marks of HTML and Markdown, on one line."""
    text = re.sub(r"<[^>]*>", "", re.sub(r"<br */?>", " ", text))
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text).replace("**", "")
    return one_line(" ".join(html.unescape(text).split()))
