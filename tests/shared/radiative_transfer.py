"""Plane-parallel media as stacks, with the light that outside solvers find (`radiative_transfer.json`), and errors."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import velatura as vt
from velatura.model import named
from velatura.model.context import Context
from velatura.model.solved import solve
from velatura.model.variance import variance_kind
from velatura.stack import Material

Array = NDArray[np.float64]

KNOWN: dict[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
TABLES = ("slabs", "plates", "walks", "disort_64", "phases", "mie", "rayleigh", "semi_infinite")
DEPTHS = (1e2, 1e4, 1e6)  # of media that are semi-infinite
AZIMUTHS = (0.3, 1.2, 2.5)  # of light that is the same at all
SOURCES = {
    "plates": "iadpython48",
    "walks": "walk",
    "disort_64": "disort64",
    "phases": "phases, mie",
    "mie": "phases, mie",
    "rayleigh": "rayleigh",
    "semi_infinite": "chandrasekhar",
}
GAUSS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Row:
    """A stack, its name and its source among those of `KNOWN`, cosines of incidence (N,), or None for even light, and
    what is known of shares of the incident light: reflected and passed ones, (N,) or None."""

    source: str
    name: str
    stack: vt.Stack
    cosines: Array | None
    reflected: Array | None
    passed: Array | None

    @property
    def known(self) -> Array:
        """All shares that are known, reflected ones first."""
        return np.concatenate([truth for truth in (self.reflected, self.passed) if truth is not None])

    @cached_property
    def errors(self) -> Array:
        """Errors (found less known) of the default model, in the order of `known`."""
        even = 0.5 * (GAUSS[0] + 1)
        lobes = vt.lobes(self.stack, even if self.cosines is None else self.cosines)
        found = [np.sum([*lobes.energy, lobes.remainder], axis=0)[0], lobes.passed[0]]
        if self.cosines is None:
            found = [np.atleast_1d(GAUSS[1] @ (even * each)) for each in found]
        known = zip(found, (self.reflected, self.passed))
        return np.concatenate([value - truth for value, truth in known if truth is not None])


@cache
def rows(table: str) -> tuple[Row, ...]:
    """Those of a table; `semi_infinite` ones at every depth."""
    return tuple(_rows(table))


def _rows(table: str) -> Iterator[Row]:
    for number, row in enumerate(KNOWN[table]):
        source = row.get("source", SOURCES.get(table))
        name = row.get("id", f"{table}-{number}")
        if table == "slabs":
            step, media = [row["n"]] if row["n"] != 1 else [], [_medium(*each) for each in row["media"]]
            deep = row.get("semi_infinite", False)
            stack = _stack(step, media, 0.0 if deep else [1.0])
            yield Row(source, name, stack, _array(row.get("cos")), _array(row["R"]), _array(row["T"]))
        elif table in ("plates", "walks"):  # a slab of index n, or that between plates of glass; light at the normal
            plate = [] if row["glass"] is None else [row["glass"]]
            stack = _stack([*plate, row["n"]], [_medium(row["b"], row["a"], row["g"])], [*plate, 1.0])
            names = ("UR1", "UT1") if table == "plates" else ("R", "T")
            yield Row(source, name, stack, np.ones(1), *(_array(row[each]) for each in names))
        elif "mu0" in row:
            media = [_medium(*each) for each in zip(row["depth"], row["omega"], row.get("phase", row.get("g")))]
            below = [1.0] if row["base_albedo"] is None else row["base_albedo"]
            yield Row(
                source, name, _stack([], media, below), _array(row["mu0"]), _array(row["R"]), _array(row.get("T"))
            )
        else:
            for depth in DEPTHS:
                stack = _stack([], [_medium(depth, row["omega"], 0.0)], 0.0)
                known = np.array(row["mu"]), np.array(row["albedo"])
                yield Row(source, f"albedo {row['omega']}, depth {depth:g}", stack, *known, None)


def radiances(form: str) -> dict[str, Array]:
    """Relative errors (azimuths, cosines of incidence) of values of van de Hulst's slab, by `reflected` and
    `transmitted_diffuse`, in a form of the default model. The slab ends in an interface without a step of the index."""
    (known,) = KNOWN["radiance"]
    slab = _medium(known["depth"], known["albedo"], known["g"])
    material = Material.of(vt.Stack([slab, vt.Interface(eta=1.0, alpha=0)])).solid()
    body = solve.solve(material, named("velatura", form=form), variance_kind(material), Context())
    mu, phi, found = known["mu"], np.array(AZIMUTHS)[:, None], {}
    for part, side in (("reflected", 1), ("transmitted_diffuse", -1)):
        mu_0, value = np.array(known[part]["mu0"]), np.array(known[part]["value"])
        sine, shape = np.sqrt(1 - mu * mu), np.broadcast_shapes(phi.shape, mu_0.shape)
        w = np.sqrt(1 - mu_0 * mu_0), 0 * mu_0, mu_0, sine * np.cos(phi), sine * np.sin(phi), np.array(side * mu)
        x_i, y_i, z_i, x_o, y_o, z_o = (np.broadcast_to(each, shape).ravel() for each in w)
        seen, _ = body.eval_pdf((x_i, y_i, z_i), (x_o, y_o, z_o))
        found[part] = np.pi * np.reshape(seen[0], shape) / mu / value - 1
    return found


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
