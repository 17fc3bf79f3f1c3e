"""Phase functions of media as written in files, beside Henyey and Greenstein's, which is written by its `g`.

Each gives its asymmetry, the mean cosine of the scattering angle, which is all that some models read; what light does
by it is in `velatura.media`. Those that are tabulated have values per solid angle, in any unit, at some cosines, joined
by straight lines.
"""

from __future__ import annotations

import functools
import math
from abc import abstractmethod
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import PrivateAttr, model_validator

from velatura.errors import needs
from velatura.stack import tables
from velatura.stack.schema import Parameter, Record, Taken, unknown
from velatura.stack.tables import Table
from velatura.stack.values import LARGEST, Rows, RowsLike, number

RAYLEIGH = "rayleigh"  # of particles that are far smaller than the wavelength

SIZES = 1e-3, 200.0  # parameters of spheres; a greater one has more peaks than a table of some size holds
ANGLES = 1024  # intervals of a table of Mie's phase function at least
PER_PEAK = 40  # and for each peak


class PhaseRecord(Record):
    """A phase function that is written with keys."""

    @property
    @abstractmethod
    def asymmetry(self) -> float:
        """Mean cosine of the scattering angle."""


class TwoLobes(PhaseRecord):
    """Two of Henyey and Greenstein's phase functions, most often one forwards and one backwards."""

    holds = "forward, backward and share"

    forward: Annotated[float, number("asymmetry of one lobe", low=-1, high=1, strict=True, typical=0.8)]
    backward: Annotated[float, number("asymmetry of the other lobe", low=-1, high=1, strict=True, typical=-0.3)]
    share: Annotated[float, number("share of scattered light in the forward lobe", low=0, high=1, typical=0.8)]

    @property
    def asymmetry(self) -> float:
        return self.share * self.forward + (1 - self.share) * self.backward


class TabulatedPhase(PhaseRecord):
    """A phase function that is known at some cosines."""

    @abstractmethod
    def tabulated(self) -> Table:
        """Cosines, ascending from -1 to 1, and values there."""

    @property
    def asymmetry(self) -> float:
        total, first = _moments(self.tabulated())
        return first / total


class PhaseTable(TabulatedPhase):
    """A phase function by its values per solid angle, in any unit, at angles in degrees, which ascend.

    The values at the ends hold beyond them. A file of two columns, with comments after #, is read once, when the record
    is made.

    Raises:
        InvalidInput: no such file, or there is no such table; one line that names the file.
    """

    holds = "table"

    table: Annotated[
        Taken[str | Path | RowsLike, Path | tuple[tuple[float, float], ...]],
        Rows(
            "value per solid angle, in any unit, over the angle of scattering",
            unit="degrees",
            place=number("angle", low=0, high=180),
            value=number("value", low=0),
        ),
    ]
    _read: Table = PrivateAttr()

    @model_validator(mode="after")
    def _read_once(self) -> PhaseTable:
        if isinstance(self.table, Path):
            where = f"{self.table}: "
            rows = tables.read(self.table, "an angle in degrees", "angles")
            for angle, value in rows:
                if not (0 <= angle <= 180 and 0 <= value <= LARGEST):
                    raise ValueError(f"{where}angles must lie in 0 to 180, and values in 0 to {LARGEST:g}")
            if len(rows) < 2:
                raise ValueError(f"{where}must hold values at two angles or more")
        else:
            where, rows = "table: ", list(self.table)
            if any(b <= a for (a, _), (b, _) in pairwise(rows)):
                raise ValueError(f"{where}angles must ascend")
        ends = [(0.0, rows[0][1])] * (rows[0][0] > 0), [(180.0, rows[-1][1])] * (rows[-1][0] < 180)
        angles, values = zip(*reversed([*ends[0], *rows, *ends[1]]))
        self._read = tuple(math.cos(math.radians(angle)) for angle in angles), values
        if _moments(self._read)[0] <= 0:
            raise ValueError(f"{where}must have a value above 0")
        return self

    def tabulated(self) -> Table:
        return self._read


class Mie(TabulatedPhase):
    """Scattering by spheres of one size in a medium, at one wavelength (Mie 1908), by the package `miepython`.

    Raises:
        InvalidInput: neither a radius nor a size parameter, or both; or spheres that are too small or too large.
    """

    holds = "eta, and radius_um or size"

    eta: Annotated[float, number("absolute index of refraction of the spheres", low=0.01, high=100, typical=1.5)]
    k: Annotated[float, number("absolute extinction of the spheres", low=0, high=100)] = 0.0
    radius_um: Annotated[float | None, number("radius", unit="micrometres", low=0, typical=0.5)] = None
    size: Annotated[
        float | None,
        number(
            "size parameter, circumference over the wavelength in the medium, in place of radius_um",
            low=SIZES[0],
            high=SIZES[1],
        ),
    ] = None
    medium: Annotated[float, number("absolute index of refraction of the medium around them", low=0.01, high=100)] = 1.0
    wavelength_nm: Annotated[float, number("wavelength outside, for all colours", unit="nm", low=100, high=1e5)] = 550.0

    @model_validator(mode="after")
    def _one_size(self) -> Mie:
        if (self.radius_um is None) == (self.size is None):
            raise ValueError("radius_um: write radius_um or size, one of them")
        low, high = SIZES
        if not low <= self.size_parameter <= high:
            raise ValueError(
                f"radius_um: the circumference over the wavelength in the medium must lie in {low:g} to {high:g}, "
                f"got {self.size_parameter:.4g}"
            )
        return self

    @property
    def size_parameter(self) -> float:
        """Circumference over the wavelength in the medium."""
        if self.size is not None:
            return self.size
        assert self.radius_um is not None
        return 2 * math.pi * self.radius_um * 1e3 * self.medium / self.wavelength_nm

    def tabulated(self) -> Table:
        """Cosines, ascending from -1 to 1, and values there.

        Raises:
            MissingTool: `miepython` is not installed; the message holds the command that installs it.
        """
        return _mie(complex(self.eta, -self.k) / self.medium, self.size_parameter)


@functools.lru_cache(64)
def _mie(m: complex, size: float) -> Table:
    """Mie's phase function, for unpolarised light, of spheres of relative index m and a size parameter."""
    import numpy as np

    with needs("mie"):
        import miepython
    cosines = np.cos(np.linspace(np.pi, 0, 1 + max(ANGLES, math.ceil(PER_PEAK * size))))
    values = miepython.i_unpolarized(m, size, cosines, norm="one")
    return tuple(cosines.tolist()), tuple(values.tolist())


def _moments(table: Table) -> tuple[float, float]:
    """Integrals over the cosine of a table, and of it times the cosine."""
    total = first = 0.0
    for (a, p), (b, q) in pairwise(zip(*table)):
        total += (b - a) * (p + q) / 2
        first += (b - a) * (a * (2 * p + q) + b * (p + 2 * q)) / 6
    return total, first


#: A phase function as written: a word, or a record; by `g` it is none of these.
WrittenPhase: TypeAlias = str | PhaseRecord

#: The records by their names in the schema and the manual. Its first key identifies each.
RECORDS: dict[str, type[PhaseRecord]] = {"two_lobes": TwoLobes, "phase_table": PhaseTable, "mie": Mie}


def asymmetry(phase: WrittenPhase) -> float:
    """Mean cosine of the scattering angle."""
    return phase.asymmetry if isinstance(phase, PhaseRecord) else 0.0


class Phase(Parameter):
    """A phase function, by a word or by keys."""

    first: ClassVar[Mapping[str, type[PhaseRecord]]] = {next(iter(x.model_fields)): x for x in RECORDS.values()}
    what = f"{RAYLEIGH}, or keys of which one is {', '.join(first)}"

    def check(self, value: Any) -> WrittenPhase | None:
        if value is None or isinstance(value, PhaseRecord):
            return value
        if isinstance(value, str) and value != RAYLEIGH:
            raise ValueError(f"{unknown('phase function', value, [RAYLEIGH])}; or write keys")
        if isinstance(value, str):
            return value
        record = (
            next((self.first[key] for key in self.first if key in value), None) if isinstance(value, Mapping) else None
        )
        if record is None:
            raise self.refuse(value)
        return record.from_dict(value)

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [{"enum": [RAYLEIGH]}, *({"$ref": f"#/$defs/{name}"} for name in RECORDS)]}
