"""Reflectance over angles: pairs of directions, tables of reflectance in files, and the reflectance of a model."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from velatura.errors import InvalidInput
from velatura.inverse.partial_stack import Array, take
from velatura.model import Model, bsdf, mixture, named
from velatura.ops import Value
from velatura.stack import Material, MaterialLike, load

COLUMNS = ("theta_i", "theta_o", "phi", "r", "g", "b")
GRAZING, BRIGHTEST = 90.0, 1e9  # degrees: directions must be above the surface; 1/sr: more than any lobe has
TILTS = (0.0, *np.geomspace(0.006, 1.6, 10))  # of half-vectors, as slopes: so that every lobe is met, sharp or blurred
TURNS = 4  # azimuths of half-vectors over half a turn
ANGLES = (0.0, 20.0, 40.0, 55.0, 70.0)  # of incidence, where stacks are compared
AZIMUTHS = (0.0, 45.0, 100.0)  # of incidence, where a stack has a direction


@dataclass(frozen=True)
class Directions:
    """N pairs of unit vectors wi and wo, (3, N), both above the surface, and theta_i in degrees, (N,)."""

    wi: Array
    wo: Array
    theta_i: Array

    @cached_property
    def lit(self) -> Array:
        """The distinct directions wi."""
        return self._different[0]

    @cached_property
    def which(self) -> NDArray[np.intp]:
        """The index in `lit` of the wi of each pair."""
        return self._different[1]

    @cached_property
    def _different(self) -> tuple[Array, NDArray[np.intp]]:
        different, which = np.unique(self.wi, axis=1, return_inverse=True)
        return different, which.ravel()

    @classmethod
    def of(cls, theta_i: Array, theta_o: Array, phi: Array, azimuth: Array | float = 0.0) -> Directions:
        """From angles in degrees: phi is the azimuth from wi to wo, 180 for the mirror direction."""
        return cls(_direction(theta_i, azimuth), _direction(theta_o, azimuth + phi), theta_i)

    @classmethod
    def about_lobes(cls, turned: bool) -> Directions:
        """Pairs at several angles of incidence, near the mirror direction and far from it; `turned`: also azimuths."""
        wi, wo, theta = [], [], []
        turns = np.linspace(0, 180, TURNS) if not turned else np.linspace(0, 360, 2 * TURNS, endpoint=False)
        tilt, turn = (x.ravel() for x in np.meshgrid(np.degrees(np.arctan(TILTS)), turns))
        h = _direction(tilt, turn)
        for angle in ANGLES:
            for azimuth in AZIMUTHS if turned else (0.0,):
                i = _direction(np.full(len(tilt), angle), azimuth)
                o = 2 * np.sum(i * h, axis=0) * h - i
                kept = (o[2] > 1e-3) & (np.sum(i * h, axis=0) > 0)
                wi.append(i[:, kept])
                wo.append(o[:, kept])
                theta.append(np.full(np.count_nonzero(kept), angle))
        return cls(np.concatenate(wi, axis=1), np.concatenate(wo, axis=1), np.concatenate(theta))


@dataclass(frozen=True)
class ReflectanceTable:
    """Reflectance f in 1/sr, without the cosine, of N pairs of directions: (3, N)."""

    directions: Directions
    value: Array


def load_table(path: str | Path) -> ReflectanceTable:
    """The table in a CSV file whose first line is `theta_i,theta_o,phi,r,g,b`.

    Angles in degrees, theta in 0 to 90 (excluded), phi the azimuth from wi to wo (180: the mirror direction); r, g, b
    the BRDF in 1/sr, without the cosine.

    Raises:
        InvalidInput: no such file, or a line that is none of that; one line that names file, line and column.
    """
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            lines = list(csv.reader(file))
    except UnicodeDecodeError as error:
        raise InvalidInput(f"{path}: is not UTF-8 text (byte {error.start})") from None
    except (OSError, ValueError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidInput(f"{path}: cannot be read: {reason.lower()}") from None
    if not lines or tuple(cell.strip() for cell in lines[0]) != COLUMNS:
        raise InvalidInput(f"{path}: line 1: must be {','.join(COLUMNS)}")
    rows = [_row(f"{path}: line {n}", line) for n, line in enumerate(lines[1:], 2) if line]
    if not rows:
        raise InvalidInput(f"{path}: holds no directions")
    theta_i, theta_o, phi, *value = np.array(rows).T
    return ReflectanceTable(Directions.of(theta_i, theta_o, phi), np.array(value))


def table_of(stack: MaterialLike, directions: Directions, model: str | Model) -> ReflectanceTable:
    """Reflectance of a material by a model (a stack, a file, or a preset's name).

    Raises:
        InvalidInput: not a valid material, an unknown model, or a texture, which has no one value.
    """
    stack = load(stack)
    seen = bsdf.body(Material.of(stack), named(model))
    value = radiance(seen, directions) / directions.wo[2]
    return ReflectanceTable(directions, np.broadcast_to(value, (3, len(directions.theta_i))))


def radiance(seen: bsdf.Lobed, directions: Directions) -> Value:
    """f(wi, wo) cos theta_o of a stack that is prepared: colours, over directions on the last axis."""
    wi, wo = tuple(directions.wi), tuple(directions.wo)
    if seen.above.model.form == "symmetric":
        return seen.eval_pdf(wi, wo, bsdf.Asked(transmission=False))[0]
    # The lobes depend on wi alone, which many pairs have in common
    lit = bsdf.scattered(seen, tuple(directions.lit))
    reflected, base = take((tuple(lit.reflected), lit.base), directions.which, directions.lit.shape[-1])
    return mixture.eval_pdf(reflected, base, wi, wo)[0]


def report(wanted: ReflectanceTable, found: ReflectanceTable) -> list[dict[str, float]]:
    """For every angle of incidence `theta_i`: root mean squares of f cos theta_o (`wanted`), and of its error.

    `error` is that of all of it, `relative` its share of `wanted`.
    """
    cosine, rows = wanted.directions.wo[2], []
    for angle in np.unique(wanted.directions.theta_i):
        own = wanted.directions.theta_i == angle
        one, other = (x.value[:, own] * cosine[own] for x in (wanted, found))
        size, error = (float(np.sqrt(np.mean(x * x))) for x in (one, other - one))
        relative = error / size if size > 0 else 0.0
        rows.append({"theta_i": float(angle), "wanted": size, "error": error, "relative": relative})
    return rows


def _direction(theta: Array, phi: Array | float) -> Array:
    sine, azimuth = np.sin(np.radians(theta)), np.radians(phi)
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(np.radians(theta))])


def _row(where: str, line: Sequence[str]) -> list[float]:
    """The numbers of a line."""
    if len(line) != len(COLUMNS):
        raise InvalidInput(f"{where}: must hold {len(COLUMNS)} numbers, {','.join(COLUMNS)}, got {len(line)}")
    numbers: Mapping[str, float] = {name: _number(f"{where}: {name}", cell) for name, cell in zip(COLUMNS, line)}
    for name in ("theta_i", "theta_o"):
        if not 0 <= numbers[name] < GRAZING:
            raise InvalidInput(f"{where}: {name}: must lie in 0 to 90 (excluded) degrees, got {numbers[name]:g}")
    if not -360 <= numbers["phi"] <= 360:
        raise InvalidInput(f"{where}: phi: must lie in -360 to 360 degrees, got {numbers['phi']:g}")
    for name in "rgb":
        if not 0 <= numbers[name] <= BRIGHTEST:
            raise InvalidInput(f"{where}: {name}: must lie in 0 to {BRIGHTEST:g}, got {numbers[name]:g}")
    return list(numbers.values())


def _number(where: str, text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = float("nan")
    if not np.isfinite(found):
        raise InvalidInput(f"{where}: must be a finite number, got {text.strip()!r}")
    return found
