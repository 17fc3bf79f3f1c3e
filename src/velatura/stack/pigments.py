"""Pigments of a medium as written in files, by Kubelka and Munk's coefficients of absorption, K, and scattering, S.

The coefficients of a mixture are the sums of those of its pigments by concentration (Duncan 1940), and give the
medium's: K = 2 sigma_a and S = 3/4 (1 - g) sigma_s (Gate 1974, Thennadil 2008).
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import PrivateAttr, model_validator

from velatura.errors import InvalidInput, within
from velatura.stack import tables
from velatura.stack.schema import Parameter, Record, Taken, by_default
from velatura.stack.values import (
    LARGEST,
    MOST_ROWS,
    RGB,
    Colour,
    File,
    NumberLike,
    NumbersLike,
    Spectrum,
    Text,
    Written,
    number,
)

#: A coefficient that is the same at all points.
Coefficient: TypeAlias = float | RGB | Spectrum
CoefficientLike: TypeAlias = NumberLike | NumbersLike | Spectrum | Written | None

COLUMNS = "wavelength_nm", "K", "S"  # of a file


def absorption(k: Any) -> Any:
    """The absorption coefficient of Kubelka and Munk's K: diffuse light goes twice as far (Gate 1974)."""
    return k / 2


def scattering(s: Any, g: Any) -> Any:
    """The scattering coefficient of Kubelka and Munk's S, for an asymmetry g (Gate 1974, Thennadil 2008)."""
    return 4 * s / (3 * (1 - g))


class CoefficientOf(Colour):
    """A colour or a spectrum, without textures."""

    spectral = True


#: Kubelka and Munk's coefficients have no gradients of their own; those of the medium have.
coefficient = functools.partial(CoefficientOf, unit="1/length", low=0, texturable=False, differentiable=False)


class Pigment(Record):
    """A pigment, by its coefficients K and S per concentration, which are also read from a file.

    The file is a text of three columns, wavelength in nanometres, K and S, under these names or none, with comments
    after #. It is read once, when the record is made.

    Raises:
        InvalidInput: neither a file nor both coefficients, or both; no such file, or it holds no such table.
    """

    holds = "pigment, or K and S, with their concentration"

    name: Annotated[str, Text("name of the pigment")] = ""
    pigment: Annotated[
        Taken[str | Path | None, Path | None],
        File("table of wavelength (nm), K and S, in place of these; relative to the material file"),
    ] = by_default(None)
    K: Annotated[
        Taken[CoefficientLike, Coefficient | None], coefficient("Kubelka and Munk's absorption at a concentration of 1")
    ] = by_default(None)
    S: Annotated[
        Taken[CoefficientLike, Coefficient | None], coefficient("Kubelka and Munk's scattering at a concentration of 1")
    ] = by_default(None)
    concentration: Annotated[float, number("factor on K and S", low=0, typical=0.1)] = 1.0
    _coefficients: tuple[Coefficient, Coefficient] = PrivateAttr()

    @model_validator(mode="after")
    def _read_once(self) -> Pigment:
        if self.pigment is None:
            for key, value in (("K", self.K), ("S", self.S)):
                if value is None:
                    raise ValueError(f"{key}: missing; write K and S, or pigment")
        for key in ("K", "S"):
            if self.pigment is not None and getattr(self, key) is not None:
                raise ValueError(f"{key}: not together with pigment, a file that has it")
        self._coefficients = (self.K, self.S) if self.pigment is None else read(self.pigment)  # type: ignore[assignment]
        return self

    @property
    def coefficients(self) -> tuple[Coefficient, Coefficient]:
        """K and S at a concentration of 1."""
        return self._coefficients


def read(path: Path) -> tuple[Spectrum, Spectrum]:
    """K and S over wavelength, of a file.

    Raises:
        ValueError: there is no such table; one line that names the file.
    """
    rows = tables.read(path, "a wavelength in nanometres", "wavelengths", COLUMNS[1:], COLUMNS)
    if len(rows) > MOST_ROWS:
        raise ValueError(f"{path}: must hold at most {MOST_ROWS} rows, got {len(rows)}")
    if any(not 0 <= value <= LARGEST for row in rows for value in row[1:]):
        raise ValueError(f"{path}: K and S must lie in 0 to {LARGEST:g}")
    with within(str(path), ValueError):
        k, s = (Spectrum(spectrum=tuple((row[0], row[column]) for row in rows)) for column in (1, 2))
    return k, s


class Pigments(Parameter):
    """Pigments of one medium."""

    what = "a list of pigments"
    most: ClassVar[int] = 16

    def check(self, value: Any) -> tuple[Pigment, ...]:
        if isinstance(value, str | Mapping) or not isinstance(value, list | tuple):
            raise self.refuse(value)
        if len(value) > self.most:
            raise ValueError(f"must be at most {self.most} pigments, got {len(value)}")
        return tuple(self._pigment(n, entry) for n, entry in enumerate(value))

    def _pigment(self, n: int, entry: Any) -> Pigment:
        if isinstance(entry, Pigment):
            return entry
        with within(f"pigment {n}", ValueError):
            return Pigment.from_dict(entry)

    def json_schema(self) -> dict[str, Any]:
        return {"type": "array", "items": {"$ref": "#/$defs/pigment"}, "maxItems": self.most}


def mixed(pigments: Sequence[Pigment]) -> tuple[Coefficient, Coefficient]:
    """K and S of a mixture (Duncan 1940).

    Raises:
        InvalidInput: a coefficient is a colour of one pigment and a spectrum of another, or spectra have too many
            wavelengths.
    """
    k, s = ([(pigment.concentration, pigment.coefficients[part]) for pigment in pigments] for part in (0, 1))
    return _sum("K", k), _sum("S", s)


@functools.lru_cache(256)
def coefficients(pigments: tuple[Pigment, ...], g: float) -> tuple[Coefficient, Coefficient]:
    """Absorption and scattering of a medium with pigments, of an asymmetry g.

    Raises:
        InvalidInput: as `mixed`.
    """
    k, s = mixed(pigments)
    return _sum("K", [(absorption(1.0), k)]), _sum("S", [(scattering(1.0, g), s)])


def _sum(key: str, weighted: Sequence[tuple[float, Coefficient]]) -> Coefficient:
    """The sum of coefficients times numbers."""
    if any(isinstance(value, Spectrum) for _, value in weighted):
        return _sum_of_spectra(key, weighted)
    colours = [value if isinstance(value, tuple) else (value,) * 3 for _, value in weighted]
    weights = [weight for weight, _ in weighted]
    red, green, blue = (math.fsum(map(operator.mul, weights, channel)) for channel in zip(*colours))
    return (red, green, blue) if any(isinstance(value, tuple) for _, value in weighted) else red


def _sum_of_spectra(key: str, weighted: Sequence[tuple[float, Coefficient]]) -> Spectrum:
    import numpy as np  # slow to import, and most stacks have numbers alone

    if any(isinstance(value, tuple) for _, value in weighted):
        raise InvalidInput(f"{key}: is [r, g, b] of one pigment and a spectrum of another; write spectra or colours")
    nm = np.unique(np.concatenate([value.table()[0] for _, value in weighted if isinstance(value, Spectrum)]))
    if len(nm) > MOST_ROWS:
        raise InvalidInput(f"{key}: must have at most {MOST_ROWS} wavelengths of all pigments together, got {len(nm)}")
    total = np.zeros(len(nm))
    for weight, value in weighted:
        total += weight * (np.interp(nm, *value.table()) if isinstance(value, Spectrum) else value)  # type: ignore[operator]
    return Spectrum(spectrum=tuple(zip(nm.tolist(), total.tolist())))
