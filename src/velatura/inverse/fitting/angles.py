"""Reflectance over angles: pairs of directions, tables of reflectance, and the reflectance of a model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.inverse.lobes.partial_stack import Array, take
from velatura.model import Model, named
from velatura.model.base import Query
from velatura.model.papers import bsdf, mixture
from velatura.ops import Value
from velatura.results import Fields
from velatura.stack import Material, MaterialLike, single

TILTS = (0.0, *np.geomspace(0.006, 1.6, 10))  # of half-vectors, as slopes: so that every lobe is met, sharp or blurred
TURNS = 4  # azimuths of half-vectors over half a turn
ANGLES = (0.0, 20.0, 40.0, 55.0, 70.0)  # of incidence, where stacks are compared
AZIMUTHS = (0.0, 45.0, 100.0)  # of incidence, where a stack has a direction
LOWEST = 1e-3  # cosine of directions
GROUPS, GROUP = 12, 10.0  # angles of incidence that are reported one by one; degrees of a group where there are more


@dataclass(frozen=True, repr=False)
class Directions(Fields):
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

    @cached_property
    def incidence(self) -> tuple[Array, Array]:
        """The angles of incidence of the distinct wi, (A,), and the weights (M, A) that average over their azimuths."""
        each = np.round(np.degrees(np.arccos(np.clip(self.lit[2], -1, 1))), 6)
        theta_i, which = np.unique(each, return_inverse=True)
        own = which.reshape(-1, 1) == np.arange(len(theta_i))
        return theta_i, own / own.sum(axis=0)

    @classmethod
    def of(cls, theta_i: Array, theta_o: Array, phi: Array, azimuth: Array | float = 0.0) -> Directions:
        """Directions from angles in degrees; phi is the azimuth from wi to wo, 180 for the mirror direction."""
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
                o = _mirrored(i, h)
                kept = (o[2] > LOWEST) & (np.sum(i * h, axis=0) > 0)
                wi.append(i[:, kept])
                wo.append(o[:, kept])
                theta.append(np.full(np.count_nonzero(kept), angle))
        return cls(np.concatenate(wi, axis=1), np.concatenate(wo, axis=1), np.concatenate(theta))

    @classmethod
    def about_halves(cls, tilt: Array, apart: Array, turn: Array) -> Directions:
        """Directions from half-vector and difference angles, in degrees (Rusinkiewicz 1998).

        tilt: of half-vectors from the normal. apart, turn: of wi from those.

        The azimuth of wi is 0. Some may lie below the surface.
        """
        h, i = _direction(tilt, 0.0), _direction(apart, turn)
        i = np.array([i[0] * h[2] + i[2] * h[0], i[1], i[2] * h[2] - i[0] * h[0]])
        azimuth = np.degrees(np.arctan2(i[1], i[0]))
        return cls(i, _mirrored(i, h), np.degrees(np.arccos(np.clip(i[2], -1, 1)))).turned(-azimuth)

    @property
    def above(self) -> NDArray[np.bool_]:
        """Whether both directions lie above the surface, (N,)."""
        return np.asarray(np.minimum(self.wi[2], self.wo[2]) > LOWEST)

    @property
    def brushed(self) -> bool:
        """Whether light comes from several azimuths, so that the direction of brushing shows."""
        tilted = self.wi[:, np.hypot(*self.wi[:2]) > LOWEST]
        return tilted.shape[1] > 0 and bool(np.ptp(np.arctan2(tilted[1], tilted[0])) > LOWEST)

    @cached_property
    def tilt(self) -> Array:
        """The angle from the normal to the half-vector, in degrees, (N,)."""
        h = self.wi + self.wo
        return np.asarray(np.degrees(np.arctan2(np.hypot(h[0], h[1]), h[2])))

    def take(self, kept: NDArray[np.bool_]) -> Directions:
        """Some of the pairs."""
        return Directions(self.wi[:, kept], self.wo[:, kept], self.theta_i[kept])

    def turned(self, azimuth: Array | float) -> Directions:
        """The pairs turned about the normal, by degrees."""
        c, s = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
        wi, wo = (np.array([c * w[0] - s * w[1], s * w[0] + c * w[1], w[2]]) for w in (self.wi, self.wo))
        return Directions(wi, wo, self.theta_i)


@dataclass(frozen=True, repr=False)
class ReflectanceTable(Fields):
    """Reflectance f in 1/sr, without the cosine, of N pairs of directions: (3, N).

    energy: of all that is reflected from each of M directions wi, `directions.lit`, (3, M), where that counts.
    """

    directions: Directions
    value: Array
    energy: Array | None = None


def compressed(x: Array) -> Array:
    """log(1 + x) of f cos theta_o, continued as an odd function to what noise makes negative (Low et al. 2012)."""
    return np.asarray(np.sign(x) * np.log1p(np.abs(x)))


def table_of(
    stack: MaterialLike, directions: Directions, model: str | Model, with_energy: bool = False
) -> ReflectanceTable:
    """Reflectance of a material by a model (a stack, a file, or a preset's name).

    Raises:
        InvalidInput: not a valid material, an unknown model, or a texture, which has no one value.
    """
    value, energy = read(Material.of(single(stack, "the inverse")), directions, named(model))
    value = np.broadcast_to(value / directions.wo[2], (3, len(directions.theta_i)))
    return ReflectanceTable(
        directions, value, np.broadcast_to(energy, (3, directions.lit.shape[1])) if with_energy else None
    )


def read(material: Material, directions: Directions, model: Model) -> tuple[Value, Value]:
    """Reflected radiance and energy, like `radiance`, of a material with values of NumPy by any model."""
    lit = tuple(directions.lit)
    seen = model.lit(material, lit)
    every = seen(np.arange(len(lit[0])))
    if isinstance(every, bsdf.Lobed):
        return radiance(every, directions)
    reflected = Query(transmission=False)
    value, _ = seen(directions.which).eval_pdf(tuple(directions.wi), tuple(directions.wo), reflected)
    return value, every.albedo(lit, reflected)


def radiance(seen: bsdf.Lobed, directions: Directions) -> tuple[Value, Value]:
    """f(wi, wo) cos theta_o of a stack that is prepared, and the energy that it reflects from each lit direction.

    Both are colours, over directions on the last axis.
    """
    wi, wo = tuple(directions.wi), tuple(directions.wo)
    # The lobes depend on wi alone, which many pairs have in common
    lit = bsdf.scattered(seen, tuple(directions.lit))
    energy = sum(part.energy for part in (*lit.reflected, lit.base) if part)
    if seen.above.model.form == "symmetric":
        return seen.eval_pdf(wi, wo, Query(transmission=False))[0], energy
    reflected, base = take((tuple(lit.reflected), lit.base), directions.which, directions.lit.shape[-1])
    return mixture.eval_pdf(reflected, base, wi, wo)[0], energy


def report(wanted: ReflectanceTable, found: ReflectanceTable) -> list[dict[str, float]]:
    """Root mean squares of f cos theta_o (`wanted`), and of its error, for every angle of incidence `theta_i`.

    `error` is that of all of it, `relative` its share of `wanted`. Many angles are put into groups, by their middle.
    """
    cosine, rows, theta_i = wanted.directions.wo[2], [], grouped(wanted.directions.theta_i)
    for angle in np.unique(theta_i):
        own = theta_i == angle
        one, other = (x.value[:, own] * cosine[own] for x in (wanted, found))
        size, error = (float(np.sqrt(np.mean(x * x))) for x in (one, other - one))
        relative = error / size if size > 0 else 0.0
        rows.append({"theta_i": float(angle), "wanted": size, "error": error, "relative": relative})
    return rows


def _direction(theta: Array, phi: Array | float) -> Array:
    sine, azimuth = np.sin(np.radians(theta)), np.radians(phi)
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(np.radians(theta))])


def energies(before: ReflectanceTable, after: ReflectanceTable) -> list[dict[str, Any]]:
    """Energies of two tables, [r, g, b], of the mean azimuth, for every angle of incidence `theta_i`."""
    assert before.energy is not None and after.energy is not None
    theta_i, mean = before.directions.incidence
    rows = zip(theta_i.tolist(), (before.energy @ mean).T.tolist(), (after.energy @ mean).T.tolist())
    return [{"theta_i": angle, "before": one, "after": other} for angle, one, other in rows]


def evenly(count: int, most: int) -> NDArray[np.intp]:
    """Numbers below count: all, or where these are more than `most` evenly many, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.intp))


def grouped(theta_i: Array) -> Array:
    """Angles of incidence as they are reported: as they are where they are few, else the middles of groups."""
    if len(np.unique(np.round(theta_i, 6))) <= GROUPS:
        return np.round(theta_i, 6)
    return GROUP * (np.floor(theta_i / GROUP) + 0.5)


def _mirrored(w: Array, h: Array) -> Array:
    return 2 * np.sum(w * h, axis=0) * h - w
