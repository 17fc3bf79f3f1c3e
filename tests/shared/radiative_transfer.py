"""Plane-parallel media as stacks, with the light that outside solvers find (`radiative_transfer.json`)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import velatura as vt

Array = NDArray[np.float64]

KNOWN: dict[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
DEPTHS = (1e2, 1e4, 1e6)  # of media that are semi-infinite
GAUSS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Row:
    """A stack, its table and name, cosines of incidence (N,), or None for even light, and what is known of shares of
    the incident light: reflected and passed ones, (N,) or None."""

    table: str
    name: str
    stack: vt.Stack
    cosines: Array | None
    reflected: Array | None
    passed: Array | None

    def errors(self) -> Array:
        """Absolute errors of the default model."""
        even = 0.5 * (GAUSS[0] + 1)
        lobes = vt.lobes(self.stack, even if self.cosines is None else self.cosines)
        found = [np.sum([*lobes.energy, lobes.remainder], axis=0)[0], lobes.passed[0]]
        if self.cosines is None:
            found = [np.atleast_1d(GAUSS[1] @ (even * each)) for each in found]
        known = zip(found, (self.reflected, self.passed))
        return np.concatenate([value - truth for value, truth in known if truth is not None])


def rows(table: str) -> Iterator[Row]:
    """Those of a table; `semi_infinite` ones at every depth."""
    for number, row in enumerate(KNOWN[table]):
        name = row.get("id", f"{table}-{number}")
        if table == "slabs":
            step, media = [row["n"]] if row["n"] != 1 else [], [_medium(*each) for each in row["media"]]
            deep = row.get("semi_infinite", False)
            stack = _stack(step, media, 0.0 if deep else [1.0])
            yield Row(table, name, stack, _array(row.get("cos")), _array(row["R"]), _array(row["T"]))
        elif table in ("plates", "walks"):  # a slab of index n, or that between plates of glass; light at the normal
            plate = [] if row["glass"] is None else [row["glass"]]
            stack = _stack([*plate, row["n"]], [_medium(row["b"], row["a"], row["g"])], [*plate, 1.0])
            names = ("UR1", "UT1") if table == "plates" else ("R", "T")
            yield Row(table, name, stack, np.ones(1), *(_array(row[each]) for each in names))
        elif "mu0" in row:
            media = [_medium(*each) for each in zip(row["depth"], row["omega"], row.get("phase", row.get("g")))]
            below = [1.0] if row["base_albedo"] is None else row["base_albedo"]
            stack, reflected, passed = _stack([], media, below), _array(row["R"]), _array(row.get("T"))
            yield Row(table, name, stack, _array(row["mu0"]), reflected, passed)
        else:
            for depth in DEPTHS:
                stack = _stack([], [_medium(depth, row["omega"], 0.0)], 0.0)
                known = np.array(row["mu"]), np.array(row["albedo"])
                yield Row(table, f"albedo {row['omega']}, depth {depth:g}", stack, *known, None)


def _array(value: float | None) -> Array | None:
    return None if value is None else np.array([value])


def _medium(depth: float, albedo: float, phase: Any) -> vt.Medium:
    """A medium by its asymmetry, or by another phase function."""
    key = "g" if isinstance(phase, int | float) else "phase"
    return vt.Medium(depth=depth, sigma_s=albedo, sigma_a=1 - albedo, **{key: phase})


def _stack(above: list[float], media: list[vt.Medium], below: list[float] | float) -> vt.Stack:
    """Smooth interfaces to indices `above`, media, and interfaces to indices `below`, or a base of an albedo."""
    layers: list[Any] = [*(vt.Interface(eta=each, alpha=0) for each in above), *media]
    last = [vt.Diffuse(albedo=below)] if isinstance(below, float) else [vt.Interface(eta=x, alpha=0) for x in below]
    return vt.Stack([*layers, *last])
