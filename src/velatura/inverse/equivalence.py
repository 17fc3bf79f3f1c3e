"""All interfaces that give the same lobe at normal incidence (Bati et al. 2021, section 5)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from velatura.inverse import interface, pair, smooth_pair
from velatura.inverse.interface import DENSER, DIELECTRIC, RARER, Choice
from velatura.inverse.partial_stack import Above, Array, Batch, Layers, Mask, mapped, take
from velatura.inverse.roots import intervals
from velatura.inverse.smooth_pair import Interval
from velatura.model.variance import Isotropic, Roughness
from velatura.ops import Value

NODES = 512  # on which a set without a closed form is looked for
MODERATE = 1.5  # an index that many media have; members near it, clear and with interfaces that show, are preferred


@dataclass(frozen=True)
class EquivalenceClass:
    """The interfaces that give one lobe below one stack.

    A member is identified by its free indices of dielectrics: (eta_1, eta_2) of a pair, eta_1 of a pair over a
    conductor or of one dielectric, none of one conductor. Everything else follows from them.

    above: the stack (N = 1). energy: (C, 1). variance: in the space of the model's map. tau: of the medium above a
    pair. choice: the last interface, and what is given of it.
    """

    above: Above
    energy: Array
    variance: float
    interfaces: int = 1
    choice: Choice = DIELECTRIC
    tau: Value = 0.0

    # Members ---------------------------------------------------------------------------------------------------------

    @property
    def free(self) -> int:
        """The number of free indices."""
        return self.interfaces - (self.choice.kind != "dielectric")

    def member(self, *indices: ArrayLike) -> tuple[Layers, ...]:
        """The interfaces of given indices, (N,) each, from the top; check `.feasible` for membership.

        Without the last index it is the one that needs least absorption, on the side of `choice`.
        """
        eta = [np.atleast_2d(np.asarray(index, float)) for index in indices]
        given = len(eta) == self.free > 0 and self.choice.kind == "dielectric"
        choice = dataclasses.replace(self.choice, eta=eta.pop()) if given else self.choice
        if self.interfaces == 1:
            return (interface.solve(self.above, self.energy, self._blur, choice).layers,)
        upper, lower = pair.solve(self.above, self.energy, self._blur, eta[0], self.tau, choice)
        return upper.layers, lower.layers

    def contains(self, *indices: ArrayLike, channel: int | None = None) -> Mask:
        """Whether members have these indices, (N,) each; in one channel, or in all (their intersection)."""
        each = [np.atleast_1d(np.asarray(x, float)) for x in np.broadcast_arrays(*indices)]
        if channel is None and (self.choice.kind != "dielectric" or self.above.model.tir != "off"):
            return np.asarray(np.logical_and.reduce([part.feasible for part in self.member(*each)]))
        below, rest, possible = self._last(*each[: self.interfaces - 1])
        depths = _depth(below, rest, each[-1])
        ok = possible & (depths >= -interface.NEGLIGIBLE) & ((depths <= interface.NEGLIGIBLE) | (not self._clear))
        within = [interface.within(eta[None], self.choice.eta_max) >= 0 for eta in each]
        return np.asarray(np.logical_and.reduce([*within, *ok[self._channels(channel)]]))

    def grid(self, eta_1: Array, eta_2: Array) -> Array:
        """Optical depths between pairs of indices, (C, len(eta_1), len(eta_2)): negative, or NaN, in no member."""
        depths = np.full((len(self.energy), len(eta_1), len(eta_2)), np.nan)
        below, rest, possible = self._last(eta_1)
        some = np.flatnonzero(possible.any(axis=0))
        if not len(some):
            return depths
        columns, of_columns = (mapped(take(x, some, len(eta_1)), lambda x: x[..., None]) for x in (below, rest))
        depths[:, some] = _depth(columns, of_columns, np.broadcast_to(eta_2, (len(some), len(eta_2))))
        depths[~np.broadcast_to(possible, depths.shape[:2])] = np.nan
        return depths

    # Sets of indices -------------------------------------------------------------------------------------------------

    @property
    def empty(self) -> bool:
        """Whether there is no member."""
        if self.interfaces == 2 and not self._smooth_in_one_medium:
            return not bool(self._reachable(self._axis, None).any())
        return not self.indices_1() if self.free else not bool(self.member()[0].feasible.all())

    def indices_1(self, channel: int | None = None) -> list[Interval]:
        """All values of the first free index, as disjoint intervals; in one channel, or in all.

        N1 of Bati et al. 2021, Eq. 12.
        """
        if self.interfaces == 1:
            return self._beyond(channel)
        if self._smooth_in_one_medium:
            e = self.energy[self._channels(channel)]
            return smooth_pair.indices_1(self._eta_0, float(e.min()), float(e.max()), self.choice.eta_max)
        return intervals(lambda eta: self._reachable(eta, channel), self._axis)

    def indices_2(self, eta_1: float, channel: int | None = None) -> list[Interval]:
        """All values of the second index below a pair's first one: N2 of Bati et al. 2021, Eq. 14."""
        return self._beyond(channel, np.array([eta_1]))

    def indices_blur(self) -> list[Interval]:
        """All values of a pair's first index for which its second interface need not be smoother than smooth: V of
        Bati et al. 2021, section 5.2.2."""
        return intervals(lambda eta: self._last(eta)[1].blur >= 0, self._axis)

    @cached_property
    def highest(self) -> float:
        """The largest energy, equal in all channels, of a lobe with as many interfaces and the same blur."""
        if self._smooth_in_one_medium:
            return smooth_pair.highest(self._eta_0, self.choice.eta_max)
        low, high = 0.0, 1.0
        for _ in range(40):
            middle = (low + high) / 2
            empty = dataclasses.replace(self, energy=np.full((1, 1), middle)).empty
            low, high = (low, middle) if empty else (middle, high)
        return low

    @property
    def depth_above(self) -> list[Interval]:
        """Optical depths that a medium above all of the stack may have in every channel (Bati et al. 2021, Eq. 16)."""
        return [(0.0, 0.5 * float(np.log(self.highest / e))) for e in self.energy[:, 0] if e <= self.highest]

    # Points ----------------------------------------------------------------------------------------------------------

    def sample(self, count: int, seed: int = 0) -> Array:
        """Members drawn at random, (count, free indices): each index evenly on a logarithmic scale, one by one.

        Empty, of shape (0, free), where the class is.
        """
        if not self.free:
            return np.empty((0 if self.empty else count, 0))
        rng = np.random.default_rng(seed)
        columns = _draw(self.indices_1(), rng.random(count))
        if self.free < 2 or not len(columns):
            return columns.reshape(-1, self.free)
        rarer, denser = self._roots(None, columns)
        return np.stack([columns, _draw_between(rarer, denser, self.choice.eta_max, rng.random(count))], axis=1)

    def boundary(self, count: int = 256, channel: int | None = None) -> list[Array]:
        """The curves of pairs of dielectrics without absorption, (n, 2) each: in one channel, or of all."""
        curves = []
        for low, high in self.indices_1(channel):
            columns = low + (high - low) * (1 - np.cos(np.linspace(0, np.pi, count))) / 2  # close where curves turn
            for eta in self._roots(channel, columns):
                kept = ~np.isnan(eta)
                curves.append(np.stack([columns[kept], eta[kept]], axis=1))
        return [curve for curve in curves if len(curve)]

    def nearest(self, *indices: float) -> Array:
        """The member with the nearest indices, by ratio, (free,). Empty if the class is."""
        spans = self.indices_1()
        if not spans:
            return np.empty(0)
        if self.free == 1:
            ends = np.array([np.clip(indices[0], *span) for span in spans])
            return ends[[np.argmin(np.abs(np.log(ends / indices[0])))]]
        best, width = None, np.inf
        for _ in range(5):
            low, high = (1.0, self.choice.eta_max) if best is None else best[0] * np.exp([-width, width])
            columns = np.r_[indices[0], np.geomspace(low, high, NODES)]
            columns = np.unique(np.concatenate([np.clip(columns, *span) for span in spans]))
            rarer, denser = self._roots(None, columns)
            parts = [np.minimum(indices[1], rarer), np.clip(indices[1], denser, self.choice.eta_max)]
            found = np.concatenate([np.stack([columns, part], axis=1) for part in parts])
            distance = np.hypot(*np.log(found / np.array(indices)).T)
            best = found[np.nanargmin(distance)]
            width = 3 * np.log(self.choice.eta_max) / NODES if width == np.inf else 6 * width / NODES
        assert best is not None
        return best

    @cached_property
    def chosen(self) -> tuple[Layers, ...] | None:
        """The preferred member: clear, and of moderate indices; None if the class is empty."""
        found: list[tuple[float, tuple[Layers, ...]]] = []
        if self.empty:
            return None
        columns = []
        if self.interfaces == 2:
            columns = [np.concatenate([np.geomspace(*span, 32) for span in self.indices_1()])]
        for side in (DENSER, RARER) if self.choice.kind == "dielectric" else (DENSER,):
            one = dataclasses.replace(self, choice=dataclasses.replace(self.choice, side=side))
            layers = one.member(*columns)
            ok = np.logical_and.reduce(np.broadcast_arrays(*(part.feasible for part in layers)))
            if ok.any():
                above = (self.above.eta, *(part.eta for part in layers))
                cost = np.where(ok, sum(dislike(eta, part) for eta, part in zip(above, layers)), np.inf)
                best = np.array([np.argmin(cost)])
                found.append((float(cost[best[0]]), take(layers, best, len(cost))))
        return min(found, key=lambda entry: entry[0])[1] if found else None

    def to_dict(self) -> dict[str, Any]:
        """Sets for a report: those of all channels, and of each."""
        report: dict[str, Any] = {"interfaces": self.interfaces, "base": self.choice.kind}
        if self.free:
            report["eta_1"] = self.indices_1()
            report["channels"] = [{"eta_1": self.indices_1(c)} for c in range(len(self.energy))]
        return report

    def _repr_png_(self) -> bytes:
        """The class in a cell of a notebook."""
        from velatura.inverse import plots

        return plots.png(self)

    # How it is found -------------------------------------------------------------------------------------------------

    @property
    def _blur(self) -> Isotropic:
        return Isotropic(np.atleast_1d(np.asarray(self.variance, float)))

    @property
    def _eta_0(self) -> float:
        return float(np.mean(self.above.eta))

    @cached_property
    def _axis(self) -> Array:
        """Points to search for an index: everywhere, and that of the medium above, where an interface vanishes."""
        eta_max = self.choice.eta_max
        return np.unique(np.r_[np.geomspace(1, eta_max, NODES), np.clip(self._eta_0, 1, eta_max)])

    @property
    def _smooth_in_one_medium(self) -> bool:
        alone = self.above.over is None and np.all(np.asarray(self.tau) == 0)
        open_ = self.choice.kind == "dielectric" and self.choice.eta is None and self.choice.tau is None
        return bool(alone and open_ and self.interfaces == 2 and self.variance == 0)

    @property
    def _clear(self) -> bool:
        """Whether absorption is allowed only where it is given."""
        return self.choice.tau is not None or not self.choice.absorbs

    def _channels(self, channel: int | None) -> slice:
        return slice(None) if channel is None else slice(channel, channel + 1)

    def _last(self, *eta_1: Array) -> tuple[Above, _Rest, Mask]:
        """The stack above the last interface, the demands on that, and the channels that can meet them, (C, N).

        Below a pair's first interface of indices eta_1, and the medium under it.
        """
        above, left, blur = self.above, self.energy, np.zeros(1)
        if eta_1:
            upper = pair.top(above, self.energy, self._blur, eta_1[0][None], self.tau, self.choice.eta_max)
            above, left, blur = upper.below, self.energy - upper.energy, upper.layers.margins["blur"]
        bright = interface.attenuated(above, left)
        if self.choice.tau is not None:
            above = above.through(self.choice.tau)
        r = interface.attenuated(above, left)
        s_r = interface.reflected(above, self._blur, r, bright)
        blur = np.minimum(blur, interface.margin(interface.least(s_r)))
        return above, _Rest(left, r, interface.floor(s_r).roughness(above.f), blur), (left >= 0) & (blur >= 0)

    def _reachable(self, eta_1: Array, channel: int | None) -> Mask:
        """Whether the second interface of a pair can reflect the energy that the first one leaves."""
        below, rest, possible = self._last(eta_1)
        some = self._channels(channel)
        ok: Mask = np.all(possible[some], axis=0)
        if self.choice.kind != "dielectric" or self.choice.eta is not None or self._clear:
            above, energy = take((below, rest.energy), ok, len(ok))
            ok[ok] = interface.solve(above, energy, self._blur, self.choice).layers.feasible
            return ok
        ends = [_depth(below, rest, np.full(len(eta_1), eta))[some] for eta in (1.0, self.choice.eta_max)]
        return np.asarray(ok & (np.max(np.min(ends, axis=1), axis=0) >= -interface.NEGLIGIBLE))

    def _roots(self, channel: int | None, *eta_1: Array) -> tuple[Array, Array]:
        """Last indices that need least absorption, (N,) on either side, NaN if there is none."""
        below, rest, possible = self._last(*eta_1)
        some, found = self._channels(channel), []
        for side in (RARER, DENSER):
            choice = dataclasses.replace(self.choice, side=side)
            layers = interface.dielectric(below, rest.r[some], rest.roughness, choice)
            ok = layers.feasible & np.all(possible[some], axis=0)
            if self._clear:  # then one index must do for all channels
                ok = ok & (np.ptp(_depth(below, rest, np.ravel(layers.eta))[some], axis=0) <= interface.NEGLIGIBLE)
            found.append(np.where(ok, np.ravel(layers.eta), np.nan))
        return found[0], found[1]

    def _beyond(self, channel: int | None, *eta_1: Array) -> list[Interval]:
        """All last indices: those that need least absorption, and those beyond them if more absorption is allowed."""
        ends = (float(eta[0]) for eta in self._roots(channel, *eta_1))
        bounds = (1.0, self.choice.eta_max)
        alone = self._clear or self.choice.eta is not None
        spans = [(e, e) if alone else (min(e, bound), max(e, bound)) for e, bound in zip(ends, bounds) if e == e]
        return smooth_pair.union(spans)


@dataclass(frozen=True)
class _Rest(Batch):
    """Demands on last interfaces: energy of the lobe, reflectance and roughness of their own, margin of that."""

    energy: Array
    r: Array
    roughness: Roughness
    blur: Array


def dislike(eta_0: Value, layers: Layers) -> Array:
    """Cost of interfaces below an index eta_0, (N,): clear media and moderate indices are preferred."""
    absorbs = np.mean(np.atleast_2d(layers.tau), axis=0)
    if layers.kind != "dielectric":
        return absorbs
    extreme, step = (np.abs(np.log(np.atleast_2d(layers.eta / eta)))[0] for eta in (MODERATE, eta_0))
    return absorbs + 0.2 * extreme + 0.5 * np.maximum(1 - step / 0.2, 0)  # the last: the interface almost vanishes


def _depth(below: Above, rest: _Rest, eta: Array) -> Array:
    """Optical depths (C, N) with which dielectrics of given indices reflect enough (Bati et al. 2021, Eq. 13)."""
    layers = Layers("dielectric", eta[None], None, rest.roughness, 0.0)
    found = below.reflectance(layers)
    return 0.5 * np.log(np.maximum(found, interface.ENERGY_MIN) / rest.r)


def _draw(spans: list[Interval], u: Array) -> Array:
    """Points evenly over the logarithm of intervals, from uniform numbers; none if there are no intervals."""
    if not spans:
        return np.empty(0)
    low, high = np.log(spans).T
    edges = np.r_[0.0, np.cumsum(high - low)]
    at = u * edges[-1]
    n = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(spans) - 1)
    return np.exp(low[n] + np.minimum(at - edges[n], high[n] - low[n]))


def _draw_between(rarer: Array, denser: Array, eta_max: float, u: Array) -> Array:
    """Points evenly over the logarithms of [1, rarer] and [denser, eta_max]."""
    first = np.where(np.isnan(rarer), 0.0, np.log(rarer))
    second = np.where(np.isnan(denser), 0.0, np.log(eta_max / denser))
    at = u * (first + second)
    in_first = ~np.isnan(rarer) & ((at < first) | np.isnan(denser))
    return np.where(in_first, np.exp(at), np.where(np.isnan(denser), 1.0, denser) * np.exp(at - first))
