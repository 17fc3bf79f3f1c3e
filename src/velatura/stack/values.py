"""The types of parameters: words, files, names of materials, numbers, colours, and textures in their place."""

from __future__ import annotations

import ctypes
import functools
import math
import numbers
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import PrivateAttr, model_validator

from velatura.errors import InvalidInput, within
from velatura.stack import substances
from velatura.stack.schema import Parameter, Record, Taken, by_default, parameters, show, unknown
from velatura.stack.spectra import MIRROR, Measured, Named, Table, names, of_rows, read, rgb, source

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

RGB: TypeAlias = tuple[float, float, float]

# Numbers as they are given; float or tuples of it are kept
if TYPE_CHECKING:
    NumberLike: TypeAlias = float | np.floating[Any] | np.integer[Any]
    NumbersLike: TypeAlias = Sequence[NumberLike] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
    RowsLike: TypeAlias = Sequence[NumbersLike] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
else:  # pydantic evaluates annotations, and NumPy is slow to import
    NumberLike = NumbersLike = RowsLike = Any

Written: TypeAlias = Mapping[str, Any]  # a record as a file holds it

LISTED = "`velatura schema` lists all"

# Words, switches and files -------------------------------------------------------------------------------------------


#: Characters that garble terminals, break lines of code, or that XML does not hold.
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufffe\uffff]")


def cleaned(text: str) -> str:
    """Text of a foreign file without the characters that `Text` refuses."""
    return _CONTROL.sub(" ", text).strip() if _CONTROL.search(text) else text


@dataclass(frozen=True)
class Text(Parameter):
    """Free text on one line, or on several `lines`."""

    lines: bool = False

    what = "text (in quotes)"

    def check(self, value: Any) -> str:
        if not isinstance(value, str) or not _encodable(value):
            raise self.refuse(value)
        if _CONTROL.search(re.sub(r"[\n\t]", "", value) if self.lines else value):
            raise ValueError(
                f"must be {'text' if self.lines else 'one line'} without control characters, got {show(value)}"
            )
        return value

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string"}


class Flag(Parameter):
    """True or false."""

    what = "true or false"

    def check(self, value: Any) -> bool:
        if not isinstance(value, bool):
            raise self.refuse(value)
        return value

    def json_schema(self) -> dict[str, Any]:
        return {"type": "boolean"}


@dataclass(frozen=True)
class Whole(Parameter):
    """A whole number in a range."""

    low: int = 0
    high: int = 1

    @property
    def values(self) -> str:
        return f"a whole number from {self.low} to {self.high}"

    def check(self, value: Any) -> int:
        whole = isinstance(value, int) or hasattr(value, "__index__")  # NumPy's, which need not be loaded
        if isinstance(value, bool) or not whole or not self.low <= value <= self.high:
            raise self.refuse(value)
        return int(value)


@dataclass(frozen=True)
class Choice(Parameter):
    """One of a few words."""

    options: tuple[str, ...] = ()

    @property
    def values(self) -> str:
        return "one of " + ", ".join(self.options)

    def check(self, value: Any) -> str:
        if not isinstance(value, str) or value not in self.options:
            raise self.refuse(value)
        return value

    def json_schema(self) -> dict[str, Any]:
        return {"enum": list(self.options)}


class File(Parameter):
    """A file that exists; kept as an absolute path."""

    what = "the path of a file"

    def check(self, value: Any) -> Path:
        if not isinstance(value, str | Path) or not str(value) or not _encodable(str(value)):
            raise self.refuse(value)
        # Not by methods of Path, some of which raise where links form a loop or a name is too long
        path = Path(os.path.realpath(value))
        if not os.path.isfile(path):
            raise ValueError(f"file not found: {path}")
        if _CONTROL.search(str(path)):
            raise ValueError(f"must be a path without control characters, got {show(str(path))}")
        return path

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string"}


class PageName(Parameter):
    """A page of the refractiveindex.info database: shelf/book/page, or the path of its file."""

    what = "shelf/book/page of refractiveindex.info, or the path of its YAML file"

    def check(self, value: Any) -> str | Path:
        if not isinstance(value, str | Path) or not _encodable(str(value)):
            raise self.refuse(value)
        if substances.is_path(value):
            return File(self.doc).check(value)
        substances.entry(str(value))
        return str(value)

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string", "examples": list(substances.names())}


class Conductor(Parameter):
    """A metal by name, or the perfect mirror."""

    what = "the name of a metal"

    def check(self, value: Any) -> str | None:
        if value is None:
            return None
        if isinstance(value, Mapping | Substance) or (isinstance(value, str) and "/" in value):
            raise ValueError(f"must be {self.what}; or write eta: {{refractiveindex: shelf/book/page}}")
        if not isinstance(value, str):
            raise self.refuse(value)
        conductors, dielectrics = names()
        if value in dielectrics:
            raise ValueError(f"{value} is a dielectric; write eta: {value}")
        if value not in (MIRROR, *conductors):
            raise ValueError(unknown("metal", value, (MIRROR, *conductors), f"{LISTED}; or write eta and k"))
        return value

    def json_schema(self) -> dict[str, Any]:
        conductors = names()[0]
        return {
            "enum": [MIRROR, *conductors],
            "enumDescriptions": ["reflects all light", *map(source, conductors)],  # as text editors show them
        }


def _encodable(text: str) -> bool:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


# Numbers -------------------------------------------------------------------------------------------------------------


#: Magnitude of a number that has no nearer bound: single precision, in which is rendered, holds products of several.
LARGEST = 1e9

#: The range of an absolute index of refraction, and the upper end of extinction's: powers of ratios fit as well.
INDEX_LOW, INDEX_HIGH = 1e-3, 1e4

#: The greatest thickness of a film.
THICKEST_NM = 5000.0


@dataclass(frozen=True)
class Scalar(Parameter):
    """A number in a range, or a texture; an angle is kept within one turn."""

    low: float = -LARGEST
    high: float = LARGEST
    strict: bool = False  # the ends of the range are excluded
    differentiable: bool = True
    texturable: bool = True
    typical: float | None = None  # in place of an unknown value; None: the default

    what = "a number"
    channel: ClassVar[str] = "r"  # of a texture that names none

    @property
    def within(self) -> tuple[float, float]:
        """The range, a little inside where its ends are excluded."""
        margin = 1e-3 if self.strict else 0.0
        return self.low + margin, self.high - margin

    def reduced(self, measured: Measured) -> RGB:
        """A spectrum as the colour that it gives the value; where sRGB does not hold it, the nearest."""
        low, high = self.within
        red, green, blue = (min(max(channel, low), high) for channel in rgb(measured))
        return red, green, blue

    def parts(self, key: str) -> tuple[str, ...]:
        """Keys of the single values that a value under this key stands for."""
        return (key,)

    def single(self, value: Any) -> tuple[Any, ...]:
        """The values of `parts`."""
        return (value,)

    @property
    def expects(self) -> str:
        return f"{self.values}{' or a texture' if self.texturable else ''}, and {self._limits}"

    @property
    def bounds(self) -> str:
        low, high = map(_short, (self.low, self.high))
        return f"({low}, {high})" if self.strict else f"[{low}, {high}]"

    @property
    def _limits(self) -> str:
        return f"lie in {_short(self.low)} to {_short(self.high)}" + (", both excluded" if self.strict else "")

    def check(self, value: Any) -> Any:
        value = value.tolist() if hasattr(value, "tolist") else value
        if self.texturable and isinstance(value, Mapping | Texture):
            return self._texture(value)
        return self._check_value(value)

    def _check_value(self, value: Any) -> Any:
        return self._number(value, value)

    def _number(self, value: Any, whole: object) -> float:
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise self.refuse(whole)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ValueError(f"must be finite, got {number}")
        ends = (self.low, self.high) if self.strict else ()
        if not self.low <= number <= self.high or ctypes.c_float(number).value in ends:  # as it is rendered
            raise ValueError(f"must {self._limits}, got {show(value)}")
        # Single precision would lose the angle among many turns
        return math.fmod(number, 360.0) + 0.0 if self.unit == "degrees" else number

    def _texture(self, value: Any) -> Texture:
        texture = value if isinstance(value, Texture) else Texture.from_dict(value)
        if texture.channel is None:
            return texture.model_copy(update={"channel": self.channel})
        if texture.channel == "rgb" and self.channel != "rgb":
            raise ValueError("channel: must be one of r, g, b, a for a single number, got 'rgb'")
        return texture

    def json_schema(self) -> dict[str, Any]:
        forms = [*self._forms(), *([{"$ref": "#/$defs/texture"}] if self.texturable else [])]
        return forms[0] if len(forms) == 1 else {"anyOf": forms}

    def _forms(self) -> list[dict[str, Any]]:
        low, high = ("exclusiveMinimum", "exclusiveMaximum") if self.strict else ("minimum", "maximum")
        return [{"type": "number", low: self.low, high: self.high}]


def _short(number: float) -> str:
    """A number as short as it can be written: 1e9, 0.5."""
    plain, power = f"{number:g}", re.sub(r"e([-+])0?", lambda sign: "e" + sign[1].strip("+"), f"{number:.0e}")
    return power if float(power) == number and len(power) + 1 < len(plain) else plain


class Angle(Scalar):
    """A number, a texture, or the angle of a field of directions."""

    what = "a number, a brushing"

    def check(self, value: Any) -> Any:
        if isinstance(value, Mapping) and "brushing" in value:
            return Brushing.from_dict(value)
        return value if isinstance(value, Brushing) else super().check(value)

    def _texture(self, value: Any) -> Texture:
        texture = super()._texture(value)
        return texture.model_copy(update={"offset": math.fmod(texture.offset, 360.0)})

    def _forms(self) -> list[dict[str, Any]]:
        return [*super()._forms(), {"$ref": "#/$defs/brushing"}]


class Colour(Scalar):
    """A number for all channels, one for each of red, green and blue, or one for each wavelength of a table.

    What takes no texture takes no table either, unless its type says so.
    """

    what = "a number, [r, g, b]"
    channel = "rgb"

    @property
    def spectral(self) -> bool:
        """Whether it takes tables."""
        return self.texturable

    @property
    def values(self) -> str:
        return self.what + (", a spectrum" if self.spectral else "")

    def check(self, value: Any) -> Any:
        if self.spectral and isinstance(value, Mapping) and "spectrum" in value:
            value = Spectrum.from_dict(value)
        if self.spectral and isinstance(value, Spectrum):
            self._check_table(value, value.spectrum if isinstance(value.spectrum, Path) else "spectrum")
            return value
        return super().check(value)

    def _check_table(self, measured: Measured, where: str | Path) -> None:
        with within(str(where), ValueError):
            for value in measured.table()[1]:
                self._number(value, value)

    def _check_value(self, value: Any) -> Any:
        if isinstance(value, list | tuple):
            if len(value) != 3:
                raise self.refuse(value)
            return tuple(self._number(entry, value) for entry in value)
        return self._number(value, value)

    def _forms(self) -> list[dict[str, Any]]:
        (number,) = super()._forms()
        table = [{"$ref": "#/$defs/spectrum"}] if self.spectral else []
        return [number, {"type": "array", "items": number, "minItems": 3, "maxItems": 3}, *table]


@dataclass(frozen=True)
class Index(Colour):
    """A colour, the name of a measured spectrum, or a page of the refractiveindex.info database."""

    part: Literal["eta", "k"] = "eta"

    what = "a number, [r, g, b], a name, a page of refractiveindex.info"

    def check(self, value: Any) -> Any:
        if value is None:
            return None
        if isinstance(value, Named):
            if value.part != self.part:
                raise self.refuse(value)
            value = value.name
        if isinstance(value, str):
            if value not in self._names():
                raise ValueError(unknown("name", value, self._names(), f"{LISTED}; or write numbers"))
            return value
        if isinstance(value, Mapping) and "refractiveindex" in value:
            value = Substance.from_dict(value)
        if isinstance(value, Substance):
            value = value.of(self.part)
            self._check_table(value, value.refractiveindex)
            return value
        return super().check(value)

    def single(self, value: Any) -> tuple[Any, ...]:
        return (Named(value, self.part) if isinstance(value, str) else value,)

    def _names(self) -> tuple[str, ...]:
        conductors, dielectrics = names()
        return conductors + dielectrics if self.part == "eta" else conductors

    def _forms(self) -> list[dict[str, Any]]:
        return [*super()._forms(), {"$ref": "#/$defs/substance"}, {"enum": list(self._names())}]


class Pair(Scalar):
    """A number for both tangent axes, or one for each; equal ones are kept as one number."""

    what = "a number, [u, v]"

    def parts(self, key: str) -> tuple[str, ...]:
        return f"{key}_u", f"{key}_v"

    def single(self, value: Any) -> tuple[Any, ...]:
        return value if isinstance(value, tuple) else (value, value)

    def _check_value(self, value: Any) -> Any:
        if not isinstance(value, list | tuple):
            return self._number(value, value)
        if len(value) != 2:
            raise self.refuse(value)
        u, v = (
            self._texture(entry)
            if self.texturable and isinstance(entry, Mapping | Texture)
            else self._number(entry, value)
            for entry in value
        )
        return u if u == v else (u, v)

    def _forms(self) -> list[dict[str, Any]]:
        (number,) = super()._forms()
        entry = {"anyOf": [number, {"$ref": "#/$defs/texture"}]} if self.texturable else number
        return [number, {"type": "array", "items": entry, "minItems": 2, "maxItems": 2}]


#: A number that is the same at all points, without gradients.
number = functools.partial(Scalar, texturable=False, differentiable=False)

MOST_ROWS = 4096  # of a table that is written out

_CELL = number("value")


@dataclass(frozen=True)
class Rows(Parameter):
    """A table: a file, or its rows of a place and a value."""

    place: Scalar = _CELL
    value: Scalar = _CELL

    @property
    def values(self) -> str:
        return f"a file, or a list of 2 to {MOST_ROWS} rows [{self.place.doc}, {self.value.doc}]"

    def check(self, value: Any) -> Path | tuple[tuple[float, float], ...]:
        value = value.tolist() if hasattr(value, "tolist") else value
        if isinstance(value, str | Path):
            path: Path = File(self.doc).check(value)
            return path
        if not isinstance(value, list | tuple) or not 2 <= len(value) <= MOST_ROWS:
            raise self.refuse(value)
        if not all(isinstance(row, list | tuple) and len(row) == 2 for row in value):
            raise self.refuse(value)
        return tuple((self.place.check(place), self.value.check(value)) for place, value in value)

    def json_schema(self) -> dict[str, Any]:
        cells = [{"type": "number", "minimum": each.low, "maximum": each.high} for each in (self.place, self.value)]
        row = {"type": "array", "prefixItems": cells, "items": False, "minItems": 2}
        rows = {"type": "array", "items": row, "minItems": 2, "maxItems": MOST_ROWS}
        return {"anyOf": [{"type": "string"}, rows]}


class Spectrum(Record, Measured):
    """A value for every wavelength, by a table; files and the plugins use it as they do a measured name.

    The table is written as rows, or is a text of two columns, wavelength in nanometres and value (as Mitsuba's .spd
    files), with comments after #. Wavelengths ascend. A file is read once, when the record is made; values must lie in
    the range of the parameter.

    Raises:
        InvalidInput: no such file, or there is no such table; one line that names the file.
    """

    spectrum: Annotated[
        Taken[str | Path | RowsLike, Path | tuple[tuple[float, float], ...]],
        Rows(
            "table of wavelength (nm) and value; a file is relative to the material file",
            place=number("wavelength", low=0, high=1e5),
        ),
    ]
    _read: Table = PrivateAttr()

    @model_validator(mode="after")
    def _read_once(self) -> Spectrum:
        rows = self.spectrum
        self._read = read(rows) if isinstance(rows, Path) else of_rows(rows, "spectrum")
        return self

    def table(self) -> Table:
        return self._read


class Substance(Record, Measured):
    """The index of a substance in the refractiveindex.info database; in the place of `eta` its n, and of `k` its k.

    Where its page has a k that lets no visible light pass, `eta` alone is a metal; else it is a dielectric. The page is
    read once, when the record is made.

    Raises:
        InvalidInput: there is no such page, or its file holds none; one line that names it.
    """

    refractiveindex: Annotated[
        str | Path, PageName("shelf/book/page, or the path of a page's YAML file, relative to the material file")
    ]
    _page: substances.Page = PrivateAttr()
    _part: Literal["eta", "k"] = PrivateAttr("eta")

    @model_validator(mode="after")
    def _read_once(self) -> Substance:
        self._page = substances.page(self.refractiveindex)
        return self

    @property
    def opaque(self) -> bool:
        """Whether it is a metal, which no light passes."""
        return self._page.opaque

    def of(self, part: Literal["eta", "k"]) -> Substance:
        """The part of the index that stands in a place."""
        made = self.model_copy()
        made._part = part
        return made

    def table(self) -> Table:
        """Visible wavelengths in nanometres, and the values of this part there.

        Raises:
            InvalidInput: the page has no such part.
        """
        curve = self._page.n if self._part == "eta" else self._page.k
        if curve is None:
            raise InvalidInput(f"has no {'n' if self._part == 'eta' else 'k'}")
        return substances.visible(curve)


class Varying(Record):
    """A value that differs from point to point of a surface."""

    what: ClassVar[str]


@dataclass(frozen=True)
class Curve(Parameter):
    """Values at equal steps of a texel from 0 to 1, joined by straight lines; None: the texel itself."""

    what = "a list of 2 to 1025 numbers"

    def check(self, value: Any) -> tuple[float, ...] | None:
        if value is None:
            return None
        if not isinstance(value, list | tuple) or not 2 <= len(value) <= 1025:
            raise self.refuse(value)
        entry = Scalar(self.doc, texturable=False)
        return tuple(entry.check(number) for number in value)

    def json_schema(self) -> dict[str, Any]:
        return {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 1025}


class Texture(Varying):
    """A number or colour read from an image: `scale * texel + offset`, with the texel replaced by `curve` if given.

    Values outside the parameter's range after scale and offset are the reader's business to clamp: the image is not
    opened here.
    """

    what: ClassVar[str] = "texture"

    texture: Annotated[Taken[str | Path, Path], File("image file, relative to the material file")]
    channel: Annotated[
        str | None, Choice("channel that is read; rgb for colours, otherwise r", options=("r", "g", "b", "a", "rgb"))
    ] = None
    scale: Annotated[float, Scalar("factor on the texel", texturable=False, differentiable=False)] = 1.0
    offset: Annotated[float, Scalar("added after the factor", texturable=False, differentiable=False)] = 0.0
    encoding: Annotated[str, Choice("how the texel is stored", options=("linear", "srgb"))] = "linear"
    curve: Annotated[
        Taken[NumbersLike | None, tuple[float, ...] | None],
        Curve("values for texels from 0 to 1, in equal steps, in place of the texel"),
    ] = by_default(None)


class Brushing(Varying):
    """The angle of a field of directions on a surface: away from a centre, or around it.

    An image of angles would be torn where they pass from 360 degrees to 0.
    """

    what: ClassVar[str] = "brushing"

    brushing: Annotated[
        str, Choice("where the tangent runs: away from the centre, or around it", options=("radial", "concentric"))
    ]
    u: Annotated[float, Scalar("centre, in texture coordinates", texturable=False, differentiable=False)] = 0.5
    v: Annotated[float, Scalar("centre, in texture coordinates", texturable=False, differentiable=False)] = 0.5
    offset: Annotated[float, Scalar("added to the angle", unit="degrees", texturable=False, differentiable=False)] = 0.0


# Values as they are given
ScalarLike: TypeAlias = NumberLike | Texture | Written
ColourLike: TypeAlias = NumberLike | NumbersLike | Spectrum | Texture | Written
IndexLike: TypeAlias = ColourLike | str | Substance

# Values as they are kept
ColourValue: TypeAlias = float | RGB | Spectrum | Texture
IndexValue: TypeAlias = ColourValue | str | Substance


class Film(Record):
    """A thin film: it changes what its interface reflects, by interference, and nothing else."""

    holds = "eta and thickness_nm"

    eta: Annotated[
        Taken[IndexLike, IndexValue],
        Index(
            "absolute index of refraction",
            low=INDEX_LOW,
            high=INDEX_HIGH,
            part="eta",
            typical=1.5,
        ),
    ]
    k: Annotated[
        Taken[IndexLike, IndexValue],
        Index(
            "absolute extinction",
            low=0,
            high=INDEX_HIGH,
            part="k",
        ),
    ] = by_default(0.0)
    thickness_nm: Annotated[
        Taken[ScalarLike, float | Texture], Scalar("thickness", unit="nm", low=0, high=THICKEST_NM, typical=300.0)
    ]

    @property
    def absorbs(self) -> bool:
        """Whether it may absorb light."""
        return self.k not in (0.0, (0.0, 0.0, 0.0))

    @property
    def varying(self) -> str | None:
        """The key of a value that differs from point to point; None without one."""
        return next((key for key in parameters(Film) if isinstance(getattr(self, key), Varying)), None)


class Films(Parameter):
    """Thin films, from the top."""

    what = "a list of films"
    most: ClassVar[int] = 8

    def check(self, value: Any) -> tuple[Film, ...]:
        if isinstance(value, str | Mapping) or not isinstance(value, list | tuple):
            raise self.refuse(value)
        if len(value) > self.most:
            raise ValueError(f"must be at most {self.most} films, got {len(value)}")
        return tuple(self._film(k, entry) for k, entry in enumerate(value))

    def _film(self, k: int, entry: Any) -> Film:
        if isinstance(entry, Film):
            return entry
        with within(f"film {k}", ValueError):
            return Film.from_dict(entry)

    def json_schema(self) -> dict[str, Any]:
        return {"type": "array", "items": {"$ref": "#/$defs/film"}, "maxItems": self.most}
