"""All interfaces that give the same lobe at normal incidence (Bati et al. 2021, section 5)."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from velatura.inverse.lobes import interface, pair, smooth_pair
from velatura.inverse.lobes.interface import DENSER, DIELECTRIC, RARER, Choice
from velatura.inverse.lobes.partial_stack import Above, Array, Batch, Layers, Mask, mapped, take
from velatura.inverse.lobes.roots import bisect, intervals
from velatura.inverse.lobes.smooth_pair import Interval
from velatura.model.variance import Roughness, Variance
from velatura.ops import Value
from velatura.stack.values import Film

NODES, NODES_COATED = 512, 32  # on which a set without a closed form is looked for, and one below films
ROUGHLY, ATTEMPTS = 16, 8  # halvings of a range that need not be exact, and draws of members
NOTHING, VANISHED = 2e-3, 10.0  # logarithm of a step of the index that is no interface, and the cost of that
MODERATE = 1.5  # an index that many media have; members near it, clear and with interfaces that show, are preferred


@dataclass(frozen=True)
class Coordinate:
    """A free coordinate of a class: its name, and the least and the largest value, by channel where it is a colour."""

    name: str
    low: float | tuple[float, ...]
    high: float | tuple[float, ...]


@dataclass(frozen=True)
class EquivalenceClass:
    """The interfaces that give one lobe below one stack.

    A member is identified by its free coordinates, which `coordinates` names: the indices eta_1 and eta_2 of
    dielectrics, the optical depths tau_0 of the medium above a pair or a conductor and tau_1 of that between a pair's
    dielectric and its conductor, and a conductor's tint. Everything else follows from them: roughnesses, a conductor's
    index, and above a dielectric that ends a lobe the optical depths that its index leaves to absorb.

    above: the stack (N = 1). energy: (C, 1). variance: in the space of the model's map, a number if all axes are alike.
    tau: given depths of the medium above a pair, None where they are free. choice: the last interface, and what is
    given of it. films: on the upper interface of a pair; those on the last one are in its choice.
    """

    above: Above
    energy: Array
    variance: float | Variance
    interfaces: int = 1
    choice: Choice = DIELECTRIC
    tau: Value | None = None
    films: tuple[Film, ...] = ()

    # Members ---------------------------------------------------------------------------------------------------------

    @property
    def free(self) -> int:
        """The number of free indices."""
        return self.interfaces - (self.choice.kind != "dielectric")

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The free coordinates, none if the class is empty.

        Ranges are those without absorption that is not needed: of indices all values, of a depth those of the
        `chosen` indices. Not every point within them is a member, and where tau_0 is larger, indices may be, too.
        """
        chosen, found = self.chosen, []
        if chosen is None:
            return ()
        for name, spans in (("eta_1", self.indices_1()), ("eta_2", [(1.0, self.choice.eta_max)]))[: self.free]:
            found.append(Coordinate(name, spans[0][0], spans[-1][1]))
        found += self.depths(chosen)
        if self._tinted:
            found.append(Coordinate("tint", 0.0, 1.0))
        return tuple(found)

    def held(
        self, tau_0: ArrayLike | None = None, tau_1: ArrayLike | None = None, tint: ArrayLike | None = None
    ) -> EquivalenceClass:
        """The members with given optical depths, and of a given tint: numbers, or of depths colours (C,).

        Raises:
            ValueError: a depth that follows from an index, tau_1 of one interface, tint of a dielectric.
        """
        last, choice = self.interfaces - 1, self.choice
        if (tint is not None and choice.kind != "conductor") or (tau_1 is not None and not last):
            raise ValueError("tint is of conductors, tau_1 of pairs")
        if tint is not None:
            choice = dataclasses.replace(choice, tint=tint)
        depth = tau_1 if last else tau_0
        if depth is not None:
            if choice.kind == "dielectric":
                raise ValueError(f"tau_{last} follows from the index of a dielectric")
            choice = dataclasses.replace(choice, tau=_colours(depth))
        above = self.tau if tau_0 is None or not last else _colours(tau_0)
        return dataclasses.replace(self, choice=choice, tau=above)

    def member(
        self,
        eta_1: ArrayLike | None = None,
        eta_2: ArrayLike | None = None,
        tau_0: ArrayLike | None = None,
        tau_1: ArrayLike | None = None,
        tint: ArrayLike | None = None,
    ) -> tuple[Layers, ...]:
        """The interfaces of given coordinates from the top; check `.feasible` for membership.

        Indices and tint are numbers or (N,), depths numbers, colours (C,) or (C, N). Depths that are not given are the
        least possible; the last index is that of least absorption, on the side of `choice`.

        Raises:
            ValueError: as `held`, or an index that is missing or one too many.
        """
        eta = [np.atleast_2d(np.asarray(index, float)) for index in (eta_1, eta_2) if index is not None]
        if not self.interfaces - 1 <= len(eta) <= self.free:
            raise ValueError(f"takes {self.interfaces - 1} to {self.free} indices, got {len(eta)}")
        here = self.held(tau_0, tau_1, tint)
        given = len(eta) == self.free > 0 and self.choice.kind == "dielectric"
        choice = dataclasses.replace(here.choice, eta=eta.pop()) if given else here.choice
        if self.interfaces == 1:
            return (interface.solve(self.above, self.energy, self._blur, choice).layers,)
        upper, lower = pair.solve(self.above, self.energy, self._blur, eta[0], here._tau, choice, coated=self.films)
        return upper.layers, lower.layers

    def contains(self, *indices: ArrayLike, channel: int | None = None, **depths: ArrayLike) -> Mask:
        """Whether members have these indices, (N,) each; in one channel, or in all (their intersection).

        depths: other coordinates, as of `member`.
        """
        each = [np.atleast_1d(np.asarray(x, float)) for x in np.broadcast_arrays(*indices)]
        if depths or (channel is None and (self.choice.kind != "dielectric" or self.above.model.tir != "off")):
            return np.asarray(np.logical_and.reduce([part.feasible for part in self.member(*each, **depths)]))
        below, rest, possible = self._last(*each[: self.interfaces - 1])
        optical = _depth(below, rest, each[-1], self.choice.films)
        ok = (possible >= 0) & (optical >= -self.choice.slack)
        ok = ok & ((optical <= self.choice.slack) | (not self._clear))
        within = [interface.within(eta[None], self.choice.eta_max) >= 0 for eta in each]
        return np.asarray(np.logical_and.reduce([*within, *ok[self._channels(channel)]]))

    def grid(self, eta_1: Array, eta_2: Array) -> Array:
        """Optical depths between pairs of indices, (C, len(eta_1), len(eta_2)): negative, or NaN, in no member."""
        depths = np.full((len(self.energy), len(eta_1), len(eta_2)), np.nan)
        below, rest, possible = self._last(eta_1)
        some = np.flatnonzero((possible >= 0).any(axis=0))
        if not len(some):
            return depths
        columns, of_columns = (mapped(take(x, some, len(eta_1)), lambda x: x[..., None]) for x in (below, rest))
        eta = np.broadcast_to(eta_2, (len(some), len(eta_2)))
        depths[:, some] = _depth(columns, of_columns, eta, self.choice.films)
        depths[np.broadcast_to(possible, depths.shape[:2]) < 0] = np.nan
        return depths

    # Sets of indices -------------------------------------------------------------------------------------------------

    @property
    def empty(self) -> bool:
        """Whether there is no member."""
        if self.interfaces == 2 and not self._smooth_in_one_medium:
            return not bool((self._margin(self._axis) >= 0).any() or self.indices_1())
        return not self.indices_1() if self.free else not bool(self.member()[0].feasible.all())

    def indices_1(self, channel: int | None = None) -> list[Interval]:
        """All values of the first free index, as disjoint intervals; in one channel, or in all.

        N1 of Bati et al. 2021, Eq. 12.
        """
        if self.interfaces == 1:
            return self._beyond(channel)
        if self._smooth_in_one_medium:
            e = (self.energy * np.exp(2 * np.asarray(self._tau)))[self._channels(channel)]
            return smooth_pair.indices_1(self._eta_0, float(e.min()), float(e.max()), self.choice.eta_max)
        return intervals(lambda eta: self._margin(eta, channel), self._axis, self._rounds)

    def indices_2(self, eta_1: float, channel: int | None = None) -> list[Interval]:
        """All values of the second index below a pair's first one: N2 of Bati et al. 2021, Eq. 14."""
        return self._beyond(channel, np.array([eta_1]))

    def indices_blur(self) -> list[Interval]:
        """All values of a pair's first index for which its second interface need not be smoother than smooth: V of
        Bati et al. 2021, section 5.2.2."""
        return intervals(lambda eta: self._last(eta)[1].blur, self._axis, self._rounds)

    def depths_1(self, eta_1: Array) -> tuple[Array, Array]:
        """The least and the largest optical depths (C, N) of the medium above the last interface, by the first index.

        Of a dielectric both are what its own index needs, of a pair that which least absorption leaves.
        """
        if not self._free_depth:
            tau = np.broadcast_to(self.member(eta_1)[-1].tau, (len(self.energy), len(eta_1)))
            return tau, tau
        below, rest, _ = self._last(*([eta_1] if self.interfaces == 2 else []))
        return metal_depths(below, rest.r, rest.roughness, self.choice, (len(self.energy), len(eta_1)))

    @cached_property
    def highest(self) -> float:
        """The largest energy, equal in all channels, of a lobe with as many interfaces and the same blur."""
        if self._smooth_in_one_medium and np.all(np.asarray(self._tau) == 0):
            return smooth_pair.highest(self._eta_0, self.choice.eta_max)
        return self._highest()

    def _highest(self, roughly: bool = False) -> float:
        """`highest`, or `roughly` that of few indices."""
        low, high = 0.0, 1.0
        for _ in range(ROUGHLY if roughly else 40):
            middle = (low + high) / 2
            one = dataclasses.replace(self, energy=np.full((1, 1), middle))
            possible = bool(np.any(one._margin(self._coarse) >= 0)) if roughly else not one.empty
            low, high = (middle, high) if possible else (low, middle)
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

    def draw(self, count: int, seed: int = 0) -> dict[str, Array]:
        """Members drawn at random over all free coordinates, as arguments of `member`: indices and tint (N,), depths
        (C, N).

        Half of them have each depth at its least, a quarter more in all channels alike. Empty where the class is.
        """
        if self.empty:
            return {}
        rng = np.random.default_rng(seed)
        parts, missing = list[dict[str, Array]](), count
        for _ in range(ATTEMPTS):
            drawn = self._drawn(count, rng)
            layers = self.member(**drawn)
            ok = np.logical_and.reduce(np.broadcast_arrays(np.ones(count, bool), *(x.feasible for x in layers)))
            parts.append({name: values[..., ok] for name, values in drawn.items()})
            missing -= np.count_nonzero(ok)
            if missing <= 0 or not drawn:
                break
        return {name: np.concatenate([part[name] for part in parts], axis=-1)[..., :count] for name in parts[0]}

    def _drawn(self, count: int, rng: np.random.Generator) -> dict[str, Array]:
        """Points drawn at random, of which almost all are members."""
        last, found = self.interfaces - 1, dict[str, Array]()
        here = self
        if self._tinted:
            found["tint"] = rng.random(count)
            here = self.held(tint=found["tint"])
        if last:
            found["eta_1"], tau_0 = self._drawn_below(count, rng)
            if self.tau is None:
                found["tau_0"], here = tau_0, here.held(tau_0=tau_0)
        if self.choice.kind == "dielectric":
            if self.choice.films and not last:
                return found | {"eta_1": _draw(self.indices_1(), rng.random(count))}
            rarer, denser = here._roots(None, *([found["eta_1"]] if last else []))
            rarer, denser = (np.broadcast_to(root, count) for root in (rarer, denser))
            eta = np.where(rng.random(count) < 0.5, rarer, denser)
            eta = np.where(np.isnan(eta), np.where(np.isnan(rarer), denser, rarer), eta)
            if not (self._clear or self.choice.eta is not None):
                eta = _draw_between(rarer, denser, self.choice.eta_max, rng.random(count))
            found[f"eta_{last + 1}"] = eta
        elif self._free_depth:
            below, rest, _ = here._last(*([found["eta_1"]] if last else []))
            low, high = metal_depths(below, rest.r, rest.roughness, here.choice, (len(self.energy), count))
            found[f"tau_{last}"] = low + random_depths(high - low, rng)
        return found

    def _drawn_below(self, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """First indices, (N,), of pairs drawn at random, and depths above these, (C, N), where they are free."""
        spans, colours = self.indices_1(), len(self.energy)
        eta, tau = _draw(spans, rng.random(count)), np.zeros((colours, count))
        if self.tau is not None:
            return eta, tau

        # As far along a random direction as there is an index
        tau = random_depths(np.broadcast_to(self._deepest_above()[:, None], (colours, count)), rng)
        some = np.flatnonzero(np.any(tau > 0, axis=0))
        nodes = np.unique(np.concatenate([self._coarse, *(np.linspace(*span, 16) for span in spans)]))

        def inside(share: Array) -> Mask:
            """Which nodes (some, nodes) have members at shares of the depths."""
            depths = np.repeat(share * tau[:, some], len(nodes), axis=1)
            margin = self.held(tau_0=depths)._margin(np.tile(nodes, len(some)))
            return np.reshape(margin >= 0, (len(some), -1))

        share = bisect(lambda x: np.any(inside(x), axis=1), np.zeros(len(some)), np.ones(len(some)), rounds=8)
        tau[:, some] *= share * rng.random(len(some))
        found = inside(np.ones(len(some)))
        for n, own in zip(some, found):
            eta[n] = rng.choice(nodes[own]) if own.any() else eta[n]
            tau[:, n] *= own.any()
        near = eta * np.exp((rng.random(count) - 0.5) * np.log(nodes[1] / nodes[0]))
        near = np.clip(near, 1.0, self.choice.eta_max)
        return np.where(self.held(tau_0=tau)._margin(near) >= 0, near, eta), tau

    def boundary(self, count: int = 256, channel: int | None = None) -> list[Array]:
        """The curves of pairs of dielectrics without absorption, (n, 2) each: in one channel, or of all."""
        curves = []
        for low, high in self.indices_1(channel):
            columns = low + (high - low) * (1 - np.cos(np.linspace(0, np.pi, count))) / 2  # close where curves turn
            for eta in self._roots(channel, columns):
                found = np.flatnonzero(~np.isnan(eta))
                for run in np.split(found, np.flatnonzero(np.diff(found) > 1) + 1):
                    curves.append(np.stack([columns[run], eta[run]], axis=1))
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
    def _blur(self) -> Variance:
        if isinstance(self.variance, Variance):
            return self.variance
        return self.above.variance.uniform(np.atleast_1d(np.asarray(self.variance, float)))

    @property
    def _eta_0(self) -> float:
        return float(np.mean(self.above.eta))

    @cached_property
    def _axis(self) -> Array:
        """Points to search for an index: everywhere, and that of the medium above, where an interface vanishes."""
        eta_max, nodes = self.choice.eta_max, NODES_COATED if self._coated else NODES
        return np.unique(np.r_[np.geomspace(1, eta_max, nodes), np.clip(self._eta_0, 1, eta_max)])

    @property
    def _coated(self) -> bool:
        """Whether its interfaces have films, of which reflectances are known roughly, and take longer."""
        return bool(self.films or self.choice.films)

    @property
    def _rounds(self) -> int:
        """Halvings of the ends of a set."""
        return ROUGHLY if self._coated else 50

    @property
    def _coarse(self) -> Array:
        """Few of these points."""
        some = 4 if self._coated else 16
        return np.unique(np.r_[self._axis[::some], self._axis[-1], np.clip(self._eta_0, 1, self.choice.eta_max)])

    @property
    def _tau(self) -> Value:
        """Optical depth of the medium above a pair."""
        return 0.0 if self.tau is None else self.tau

    @property
    def _tinted(self) -> bool:
        return self.choice.kind == "conductor" and self.choice.eta is None and self.choice.kappa is None

    @property
    def _free_depth(self) -> bool:
        """Whether the medium above a conductor may absorb more than the lobe needs."""
        several = self.choice.eta is None or self.choice.kappa is None
        return self.choice.kind == "conductor" and several and not self._clear

    def depths(self, member: tuple[Layers, ...]) -> list[Coordinate]:
        """The coordinates tau_0 and tau_1, as far as these are free, with their ranges at the indices of a member."""
        found, last = dict[int, tuple[Array, Array]](), self.interfaces - 1
        if last and self.tau is None:
            most = self._deepest_above()
            found[0] = np.zeros_like(most), most
        if self._free_depth:
            below, rest, _ = self._last(*([np.ravel(member[0].eta)] if last else []))
            low, high = metal_depths(below, rest.r, rest.roughness, self.choice, (len(self.energy), 1))
            found[last] = low[:, 0], high[:, 0]
        return [Coordinate(f"tau_{n}", *(tuple(end.tolist()) for end in ends)) for n, ends in found.items()]

    def _deepest_above(self) -> Array:
        """The largest depths above a pair of each channel by itself, (C,): Bati et al. 2021, Eq. 16."""
        energy, state = self.energy[:, 0], self.above.state
        each = [np.broadcast_to(x, (len(energy), 1)) for x in (state.t_0i, state.t_i0, state.r_i0)]
        alike = all(np.ptp(x) <= interface.SLACK for x in each)
        own = (
            [self] if alike else [dataclasses.replace(self, above=_channel(self.above, c)) for c in range(len(energy))]
        )
        most = [one.highest if one._smooth_in_one_medium else one._highest(roughly=True) for one in own]
        return 0.5 * np.log(np.maximum(np.array(most) / np.maximum(energy, interface.ENERGY_MIN), 1.0))

    @property
    def _smooth_in_one_medium(self) -> bool:
        alone = self.above.over is None and not self._coated
        open_ = self.choice.kind == "dielectric" and self.choice.eta is None and self.choice.tau is None
        return bool(alone and open_ and self.interfaces == 2 and self.variance == 0)

    @property
    def _clear(self) -> bool:
        """Whether absorption is allowed only where it is given."""
        return self.choice.tau is not None or not self.choice.absorbs

    def _channels(self, channel: int | None) -> slice:
        return slice(None) if channel is None else slice(channel, channel + 1)

    def _last(self, *eta_1: Array) -> tuple[Above, _Rest, Array]:
        """The stack above the last interface, the demands on that, and by which margin they can be met, (C, N).

        Below a pair's first interface of indices eta_1, and the medium under it.
        """
        above, left, blur = self.above, self.energy, np.zeros(1)
        if eta_1:
            eta_max, coated = self.choice.eta_max, self.films
            upper = pair.top(above, self.energy, self._blur, eta_1[0][None], self._tau, eta_max, coated=coated)
            above, left, blur = upper.below, self.energy - upper.energy, upper.layers.margins["blur"]
        bright = interface.attenuated(above, left)
        if self.choice.tau is not None:
            above = above.through(self.choice.tau)
        r = interface.attenuated(above, left)
        s_r = interface.reflected(above, self._blur, r, bright)
        blur = np.minimum(blur, interface.margin(interface.least(s_r)))
        possible = np.minimum(left / np.maximum(self.energy, interface.ENERGY_MIN), blur)
        return above, _Rest(left, r, interface.floor(s_r).roughness(above.f), blur), possible

    def _margin(self, eta_1: Array, channel: int | None = None) -> Array:
        """The margin, (N,), with which a pair's second interface can reflect the energy that the first one leaves."""
        below, rest, possible = self._last(eta_1)
        some = self._channels(channel)
        found = np.array(np.min(possible[some], axis=0))
        if self.choice.kind != "dielectric" or self.choice.eta is not None or self._clear:
            ok = found >= 0
            above, energy = take((below, rest.energy), ok, len(ok))
            # What is given to absorb there is part of the stack above already
            choice = self.choice if self.choice.tau is None else dataclasses.replace(self.choice, tau=0.0)
            layers = interface.solve(above, energy, self._blur, choice).layers
            found[ok] = np.minimum(found[ok], np.min(np.broadcast_arrays(*layers.margins.values()), axis=0))
            return found
        films = self.choice.films
        last = (1.0, self.choice.eta_max) if not films else self._coarse
        ends = [_depth(below, rest, np.full(len(eta_1), eta), films)[some] for eta in last]
        return np.minimum(found, interface.margin(np.max(np.min(ends, axis=1), axis=0), self.choice.slack))

    def _roots(self, channel: int | None, *eta_1: Array) -> tuple[Array, Array]:
        """Last indices that need least absorption, (N,) on either side, NaN if there is none."""
        below, rest, possible = self._last(*eta_1)
        some, found = self._channels(channel), []
        for side in (RARER, DENSER):
            choice = dataclasses.replace(self.choice, side=side)
            layers = interface.dielectric(below, rest.r[some], rest.roughness, choice)
            ok = layers.feasible & np.all(possible[some] >= 0, axis=0)
            if self._clear:  # then one index must do for all channels
                depth = _depth(below, rest, np.ravel(layers.eta), self.choice.films)[some]
                ok = ok & (np.ptp(depth, axis=0) <= self.choice.slack)
            found.append(np.where(ok, np.ravel(layers.eta), np.nan))
        return found[0], found[1]

    def _beyond(self, channel: int | None, *eta_1: Array) -> list[Interval]:
        """All last indices: those that need least absorption, and those beyond them if more absorption is allowed."""
        if self.choice.films and not self._clear and self.choice.eta is None:
            below, rest, possible = self._last(*eta_1)
            some, depth = self._channels(channel), functools.partial(_depth, below, rest, coated=self.choice.films)
            if np.any(possible[some] < 0):
                return []
            return intervals(lambda eta: np.min(depth(eta)[some], axis=0) + self.choice.slack, self._axis, ROUGHLY)
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
    almost = 0.5 * np.maximum(1 - step / 0.2, 0) + VANISHED * (step < NOTHING)
    return absorbs + 0.2 * extreme + almost


def _depth(below: Above, rest: _Rest, eta: Array, coated: tuple[Film, ...]) -> Array:
    """Optical depths (C, N) with which dielectrics of given indices reflect enough."""
    layers = Layers("dielectric", eta[None], None, rest.roughness, 0.0, films=coated)
    return interface.optical_depth(below.reflectance(layers), rest.r, interface.ENERGY_MIN)


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


def metal_depths(
    above: Above, r: Array, roughness: Roughness, choice: Choice, shape: tuple[int, int]
) -> tuple[Array, Array]:
    """The least and the largest optical depths (C, N) above conductors that are to reflect r below them."""
    metals = interface.Metals(above, roughness, choice, shape[0])
    ends = metals.ends
    if choice.films:  # of any metal between these
        ends = tuple(ends[0] + share * (ends[1] - ends[0]) for share in np.linspace(0, 1, interface.NODES_COATED))
    each = [metals.reflectance(np.broadcast_to(end, shape)) for end in ends]
    dark, bright = np.min(each, axis=0), np.max(each, axis=0)
    low, high = (0.5 * np.log(np.maximum(x / r, 1.0)) for x in (dark, bright))
    return np.broadcast_to(low, shape), np.broadcast_to(high, shape)


def random_depths(most: Array, rng: np.random.Generator) -> Array:
    """Optical depths (C, N) up to the largest: half of them 0, a quarter alike in all channels, others coloured."""
    alike = np.min(most, axis=0) * rng.random(most.shape[1])
    kind = rng.integers(4, size=most.shape[1])
    return np.select(
        [kind < 2, kind == 2], [np.zeros_like(most), np.broadcast_to(alike, most.shape)], most * rng.random(most.shape)
    )


def _colours(value: ArrayLike) -> Value:
    """A number, or colours (C, N), of one colour (C,) too."""
    value = np.asarray(value, float)
    return float(value) if value.ndim == 0 else value.reshape(len(value), -1)


def _channel(above: Above, channel: int) -> Above:
    """Stacks as one channel sees them."""
    return mapped(above, lambda x: x[channel : channel + 1] if x.ndim == 2 and len(x) > 1 else x)
