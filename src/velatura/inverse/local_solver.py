"""The stack nearest to a given one that has given lobes, quick enough for dragging.

The interfaces of a stack are told by coordinates: of the last one of a lobe the reflectance at normal incidence that
it has when smooth, per channel, of all interfaces a variance, and, kept as they are, the index between two interfaces
and what absorbs without need. Newton's method moves the former until the model reads the lobes that are wished for.
Where a bound is in the way, one of the latter gives way just as far as it must, or else the wish does, along the way
to it. Bati et al. 2021 have the classes in which this moves; all of it holds for any model.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.inverse.coats import scattered
from velatura.inverse.explain import REASONS
from velatura.inverse.interface import CONDUCTOR_MAX, CONDUCTOR_MIN, ENERGY_MIN, conductor_index, conductor_tint
from velatura.inverse.partial_stack import NORMAL, Above, Array, Layers, whole
from velatura.inverse.target import Fixed, Target, TargetLobe
from velatura.model import Model, lobes, prepare
from velatura.model.roughness_maps import MAPS, VARIANCE_MAX
from velatura.model.variance import Isotropic, Roughness
from velatura.optics import fresnel
from velatura.stack import (
    Diffuse,
    Interface,
    InterfaceValues,
    Kind,
    Layer,
    Material,
    MediumValues,
    Stack,
    Varying,
    number,
)

ROUNDS, ATTEMPTS = 8, 4  # of Newton's method, and bounds that are tried on the way
ALMOST, ENOUGH = 1e-5, 1e-8  # missing share that one more round makes good; also where Newton's method is slow
SLACK = 1e-8  # by which a bound may be broken
FAR = 0.1  # share of a wish that is a long way
STEP = 1e-5  # of a coordinate, to see how the lobes change
SAME = 1e-6  # tints that are not told apart
SMOOTH = 1e-10  # variance below which an interface is smooth
REFLECTANCE_MAX = 0.95  # of a dielectric


@dataclass(frozen=True)
class Place:
    """One interface, and where its coordinates are.

    side: 1 denser, -1 rarer than what is above. tint: of a conductor, (3, 1). kept: optical depths (3, 1) of the medium
    above that are not needed; the coordinate `share` scales them, unless they are pinned. u: reflectances, or the one
    of all channels; None where the index itself is the coordinate `index`, its logarithm. s: the variance.
    """

    kind: Kind
    lobe: int
    side: int
    tint: Array
    kept: Array
    absorbs: bool
    s: int
    u: slice | None = None
    index: int | None = None
    share: int | None = None


@dataclass(frozen=True)
class Bound:
    """A bound on a coordinate, or on the index of an interface (`place`): `sign` times it is at least `sign * at`."""

    lobe: int
    reason: str
    sign: int
    at: float
    coordinate: int | None = None
    place: int | None = None

    def why(self, target: Target) -> str:
        """In words, why a target is not met."""
        return f"lobe {self.lobe + 1}: {REASONS[self.reason].format(eta_max=target.eta_max)}"


@dataclass(frozen=True)
class Nearby:
    """A stack as coordinates z (the last one: how far the wish is met), below nothing but its exterior medium.

    tail: layers below the last interface, which are kept. diffuse: energy of a diffuse base among
    them, None where there is none, or it has a texture.
    """

    model: Model
    target: Target
    places: tuple[Place, ...]
    z: Array
    tail: tuple[Layer, ...] = ()
    name: str = ""
    bounds: tuple[Bound, ...] = ()
    start: _Known | None = None
    diffuse: tuple[float, ...] | None = None

    # From and to materials -------------------------------------------------------------------------------------------

    @classmethod
    def of(cls, stack: Stack, target: Target, model: Model) -> Nearby | None:
        """The stack, its interfaces shared out among the lobes of a target; None where these do not fit together.

        Raises:
            InvalidInput: a layer that no target can have.
        """
        layers = plain(stack)
        if len(layers) != sum(lobe.interfaces for lobe in target.lobes) or any(
            _pinned(lobe, n == 0) for n, lobe in enumerate(target.lobes)
        ):
            return None
        reader = _Reader(target, model)
        for k, lobe in enumerate(target.lobes):
            own, layers = layers[: lobe.interfaces], layers[lobe.interfaces :]
            if [part.kind for part in own] != ["dielectric"] * (lobe.interfaces - 1) + [lobe.base]:
                return None
            for n, part in enumerate(own):
                reader.add(k, n, part)
        last = max(n for n, layer in enumerate(stack.layers) if isinstance(layer, Interface))
        z = np.array([*reader.z, 1.0])
        tail = stack.layers[last + 1 :]
        diffuse = None
        if tail and isinstance(tail[-1], Diffuse) and not isinstance(tail[-1].albedo, Varying):
            diffuse = tuple(scattered(stack, model).tolist())
        places, bounds = tuple(reader.places), tuple(reader.bounds)
        return cls(model, target, places, z, tail, stack.name, bounds, diffuse=diffuse)

    @cached_property
    def stack(self) -> Stack:
        """The material."""
        layers = [layer for part in map(self._rounded, self._layers(self.z[:, None])) for layer in part.written(0)]
        return Stack([*layers, *self.tail], name=self.name, exterior=self.target.exterior)

    def _rounded(self, part: Layers) -> Layers:
        """With an index that only rounding takes out of bounds."""
        within = np.clip(part.eta, 1.0, self.target.eta_max)
        near = part.kind == "dielectric" and np.abs(np.log(part.eta / within)).max() <= SLACK
        return dataclasses.replace(part, eta=within) if near else part

    # What the model reads --------------------------------------------------------------------------------------------

    def _layers(self, z: Array) -> list[Layers]:
        """The interfaces of N columns of coordinates."""
        eta_1 = np.full((1, z.shape[1]), self.target.exterior)
        found = []
        for place in self.places:
            tau = place.kept if place.share is None else place.kept * z[place.share]
            s = np.where(z[place.s] < SMOOTH, 0.0, np.maximum(z[place.s], 0.0))
            alpha = MAPS[self.model.map].roughness(s)
            kappa = None
            if place.index is not None:
                eta = np.exp(z[[place.index]])
            elif place.u is not None and place.kind == "conductor":
                u = np.clip(z[place.u], CONDUCTOR_MIN + 1e-12, CONDUCTOR_MAX)
                n = conductor_index(u, place.tint)
                kappa = np.sqrt(np.maximum(u * (n + 1) ** 2 - (n - 1) ** 2, 0) / (1 - u)) * eta_1
                kappa, eta = np.maximum(kappa, n * eta_1), n * eta_1
                tau = tau + 0.5 * np.log(u / np.minimum(z[place.u], u))
            elif place.u is not None:
                u = z[place.u]
                most = np.clip(np.max(u, axis=0, keepdims=True), 0.0, REFLECTANCE_MAX)
                root = np.sqrt(most)
                eta = eta_1 * ((1 + root) / (1 - root)) ** place.side
                if place.absorbs:
                    tau = tau + 0.5 * np.log(np.maximum(most, ENERGY_MIN) / np.clip(u, ENERGY_MIN, most + ENERGY_MIN))
            found.append(Layers(place.kind, eta, kappa, Roughness(alpha, alpha, np.zeros_like(alpha)), tau))
            if place.kind == "dielectric":
                eta_1 = eta
        return found

    def read(self, z: Array) -> Array:
        """For N columns of coordinates energies of all lobes, then variances of all interfaces, (3 K + I, N)."""
        material = whole(self._layers(z), self.target.exterior)
        reflected, _ = lobes(prepare(material, self.model, Isotropic), NORMAL)
        energy = np.zeros((3 * len(self.target.lobes), z.shape[1]))
        variance = np.empty((len(self.places), z.shape[1]))
        for n, (place, lobe) in enumerate(zip(self.places, reflected)):
            energy[3 * place.lobe : 3 * place.lobe + 3] += lobe.energy
            s = MAPS[self.model.map].variance(lobe.roughness.alpha_u)
            variance[n] = self._brightest(place, z, s)
        return np.vstack([energy, np.minimum(variance, VARIANCE_MAX)])

    def _brightest(self, place: Place, z: Array, s: Array) -> Array:
        """Where every channel has a variance of its own, that of the one in which the lobe must reflect most."""
        if np.ndim(s) < 2 or len(s) == 1:
            return np.ravel(s) if np.ndim(s) > 1 else s
        of_lobe = next(p.u for p in self.places if p.lobe == place.lobe and p.u is not None)
        brightest = np.argmax(np.round(z[of_lobe], 9), axis=0)
        return np.take_along_axis(s, np.broadcast_to(brightest, (1, z.shape[1])), axis=0)[0]

    def in_closed_form(self) -> Nearby:
        """The same stack, and its lobes, as the model reads them that has a closed form."""
        model = self.model.in_closed_form
        if model == self.model:
            return self
        seen = dataclasses.replace(self, model=model, start=None)
        return seen.renamed(seen._target_of(seen.read(self.z[:, None])[:, 0]))

    # Towards a wish --------------------------------------------------------------------------------------------------

    def towards(self, wish: Target) -> tuple[Nearby, Bound | None]:
        """The stack with the lobes of a target of the same form, or of one on the way there, and then what stops it."""
        goal = _Goal(self, self.wanted(wish))
        found, bound = self._met(goal)
        if found:
            return found.renamed(wish), None
        return self._part_of_the_way(wish, goal, bound)

    def far(self, wish: Target) -> bool:
        """Whether it is a long way to the lobes of a target."""
        return float(np.max(np.abs(_Goal(self, self.wanted(wish)).way))) > FAR

    def _met(self, goal: _Goal, held: Sequence[int] = ()) -> tuple[Nearby | None, Bound]:
        """The stack that meets the goal; where a bound is in the way, what is kept gives way, if it can."""
        found, bound = self._newton(goal)
        for coordinate in [] if found else self._giving(bound, held):
            found, _ = self._newton(goal, bound, coordinate)
            if found:
                break
        return found, bound

    def _part_of_the_way(self, wish: Target, goal: _Goal, bound: Bound) -> tuple[Nearby, Bound]:
        """As far towards a wish as one bound after the other allows."""
        for _ in range(ATTEMPTS):
            found, other = self._newton(goal, bound, len(self.z) - 1)
            if found:
                return found.renamed(self.between(wish, float(found.z[-1]))), bound
            if other == bound:
                break
            bound = other
        return self.renamed(self.now(wish)), bound

    def achromatic(self, wish: Target) -> Target:
        """A wish, its first lobe without the colours that need absorption where nothing may absorb."""
        first = self.places[0]
        if first.u is None or first.absorbs or first.kind != "dielectric":
            return wish
        passes = np.exp(-2 * np.broadcast_to(first.kept, (3, 1))[:, 0])
        own = np.array(wish.lobes[0].colour)
        possible = passes * np.mean(own / passes)
        return wish if np.max(np.abs(possible - own)) < SLACK else wish.with_lobe(0, energy=tuple(possible.tolist()))

    # Other members of a class ----------------------------------------------------------------------------------------

    def member(self, k: int, point: Sequence[float]) -> tuple[Nearby, Bound | None]:
        """The stack with another member of a lobe's class, or the nearest to it, and then the bound that is met.

        point: as `point_of` gives it: free indices of dielectrics from the top, then a conductor's tint.
        """
        here, there = np.array(self.point_of(k)), np.array(point, float)
        found, met, why = self, 0.0, None
        for step in (1.0, *(0.5**n for n in range(1, ATTEMPTS))):
            share = met + step
            if share > 1:
                continue
            moved, bound = found._moved(k, here + share * (there - here))
            if moved is not None:
                found, met = moved, share
            else:
                why = why or bound
            if met == 1:
                return found, None
        return found, why

    def point_of(self, k: int) -> list[float]:
        """Where in the class of a lobe its member is."""
        point = []
        for place, part in zip(self.places, self._layers(self.z[:, None])):
            if place.lobe == k:
                point.append(float(part.eta[0, 0]) if place.kind == "dielectric" else float(np.mean(place.tint)))
        return point

    def indices(self, n: int) -> tuple[Array, Array | None]:
        """Absolute eta and k of the n-th interface, (3, 1) or (1, 1)."""
        part = self._layers(self.z[:, None])[n]
        return part.eta, part.kappa

    def index_above(self, n: int) -> float:
        """Index of the medium above the n-th interface."""
        return float(self.indices(n - 1)[0][0, 0]) if n else self.target.exterior

    def tint_by(self, n: int, channel: int, tint: float) -> float:
        """The mean tint of the n-th interface when one channel has this one."""
        own = self.places[n].tint
        return float(np.mean(retinted(own, float(own[channel, 0]), tint)))

    def above(self, n: int) -> Above:
        """What lies above the n-th interface."""
        above = Above.nothing(self.model, self.target.exterior)
        for part in self._layers(self.z[:, None])[:n]:
            above, _ = above.below(part)
        return above

    def _moved(self, k: int, point: Array) -> tuple[Nearby | None, Bound]:
        """With the member of a class at a point; None where there is none."""
        z, places, level, share = self.z.copy(), list(self.places), None, None
        held: list[int] = []
        eta_1 = self.target.exterior
        layers = self._layers(self.z[:, None])
        for n, (place, part) in enumerate(zip(self.places, layers)):
            if place.lobe == k:
                x = point[len(held)]
                if place.index is not None:
                    z[place.index] = np.log(x)
                    held.append(place.index)
                elif place.kind == "conductor":
                    places[n] = dataclasses.replace(place, tint=retinted(place.tint, float(np.mean(place.tint)), x))
                else:
                    assert place.u is not None
                    root = (x - eta_1) / (x + eta_1)
                    places[n] = dataclasses.replace(place, side=-1 if root < 0 else 1)
                    most, wanted = np.max(z[place.u]), max(root * root, ENERGY_MIN)
                    z[place.u] = wanted * (z[place.u] / most if most > 0 else 1.0)
                    share, level = place.share, Bound(k, "absorption", 1, float(np.log(x)), place=n)
            if place.kind == "dielectric":
                eta_1 = np.exp(z[place.index]) if place.index is not None else float(part.eta[0, 0])
        moved = dataclasses.replace(self, z=z, places=tuple(places), start=None)
        goal = _Goal(moved, self.wanted(self.target))
        if share is not None:
            found, bound = moved._newton(goal, level, share)
            if found:
                return found, bound
            if bound.reason != "absorption":
                return None, bound
            z[share] = 0.0
            moved = dataclasses.replace(moved, z=z, start=None)
            held.append(share)
        return moved._met(_Goal(moved, goal.end), held)

    def renamed(self, target: Target) -> Nearby:
        """With all of a target that it has, and no more than that."""
        return dataclasses.replace(self, target=target)

    def between(self, wish: Target, t: float) -> Target:
        """A target on the way from the lobes that are to those that are wished for, in energies and variances."""
        now = self.known.reading
        return self.renamed(wish)._target_of(now + t * (self.wanted(wish) - now))

    def now(self, wish: Target) -> Target:
        """The lobes that are, in the form of a target."""
        return self.between(wish, 0.0)

    def _target_of(self, reading: Array) -> Target:
        """The target with lobes as they are read."""
        found, count = self.target, len(self.target.lobes)
        for k in range(count):
            s = np.mean([reading[3 * count + n] for n, place in enumerate(self.places) if place.lobe == k])
            alpha, energy = float(MAPS[self.model.map].roughness(s)), tuple(reading[3 * k : 3 * k + 3].tolist())
            found = found.with_lobe(k, energy=energy, alpha=alpha, variance=None)
        return found

    @cached_property
    def known(self) -> _Known:
        """What the model reads here, and how that changes."""
        return self.start or self._look(self.z, self._free)[0]

    def _look(self, z: Array, free: Array) -> tuple[_Known, Array]:
        """What the model reads at some coordinates, and how that changes with the free ones; where it was read."""
        columns = np.repeat(z[:, None], len(free) + 1, axis=1)
        steps = STEP * (np.abs(z[free]) + 0.01)
        columns[free, 1 + np.arange(len(free))] += steps
        read = self.read(columns)
        return _Known(read[:, 0], (read[:, 1:] - read[:, :1]) / steps), columns

    def _giving(self, bound: Bound, held: Sequence[int]) -> list[int]:
        """Coordinates that are kept, and may yet give way to a bound: those of the nearest lobe first."""
        found = []
        for place in reversed([p for p in self.places if p.lobe <= bound.lobe]):
            if place.share is not None and self.z[place.share] > 0 and np.any(place.kept):
                found.append(place.share)
            if place.index is not None and self.target.lobes[place.lobe].fixed.of("eta", 0) is None:
                found.append(place.index)
        return [coordinate for coordinate in found if coordinate not in held]

    @cached_property
    def _free(self) -> Array:
        reflectances = [n for place in self.places if place.u for n in range(place.u.start, place.u.stop)]
        return np.array([*reflectances, *(place.s for place in self.places)])

    def wanted(self, wish: Target) -> Array:
        """What the model must read, for a target to be met."""
        s = [MAPS[self.model.map].variance(wish.lobes[place.lobe].roughness) for place in self.places]
        return np.array([*(max(e, ENERGY_MIN) for lobe in wish.lobes for e in lobe.colour), *s])

    def _newton(
        self, goal: _Goal, bound: Bound | None = None, giving: int | None = None
    ) -> tuple[Nearby | None, Bound]:
        """The stack that meets the goal, and lies on a bound if one is given, for which `giving` moves as well.

        Where there is none, the bound that is in the way.
        """
        part, low, high = giving == len(self.z) - 1, *self._box
        free = self._free if giving is None else np.r_[self._free, giving]
        z, blocked = self.z.copy(), set[int]()
        z[-1] = 0.0 if part else 1.0
        for n in range(ROUNDS):
            # See what is missing, and how that changes
            known, columns = (self.known, z[:, None]) if n == 0 and bound is None else self._look(z, free)
            missing, slopes = goal.missing(known.reading, z[-1]), goal.scaled(known.slopes)
            if part:
                slopes[:, -1] = -goal.way
            if bound is not None:
                margins = self._margin(bound, columns)
                change = (margins[1:] - margins[0]) / (columns[free, 1 + np.arange(len(free))] - z[free])
                missing, slopes = np.r_[missing, margins[0]], np.vstack([slopes, change])
            if not np.all(np.isfinite(slopes)):
                break

            # Move, within bounds
            full = z.copy()
            moved = np.linalg.lstsq(slopes, -missing, rcond=1e-12)[0]
            full[free] += np.clip(moved, -goal.reach[free], goal.reach[free])
            z = np.clip(full, low, high)
            outside = {int(c) for c in free if abs(full[c] - z[c]) > SLACK}
            if n > 0 and np.max(np.abs(missing)) < (ALMOST if bound is None else ENOUGH) and not outside:
                other = self._broken(z, bound)
                slopes = known.slopes[:, : len(self._free)]
                met = dataclasses.replace(self, z=z, start=_Known(goal.reading(z[-1]), slopes))
                return (met, bound or self.bounds[0]) if other is None else (None, other)
            if outside & blocked - {len(z) - 1}:
                return None, self._bound_at(min(outside & blocked - {len(z) - 1}), full)
            blocked = outside
        return None, self._broken(z, bound) or bound or self.bounds[0]

    @cached_property
    def _box(self) -> tuple[Array, Array]:
        low, high = np.full(len(self.z), -np.inf), np.full(len(self.z), np.inf)
        for bound in self.bounds:
            if bound.coordinate is not None:
                (low if bound.sign > 0 else high)[bound.coordinate] = bound.at
        low[-1], high[-1] = 0.0, 1.0
        return low, high

    def _margin(self, bound: Bound, z: Array) -> Array:
        if bound.coordinate is not None:
            return bound.sign * (z[bound.coordinate] - bound.at)
        assert bound.place is not None
        return bound.sign * (np.log(self._layers(z)[bound.place].eta[0]) - bound.at)

    def _broken(self, z: Array, met: Bound | None) -> Bound | None:
        """The bound that is broken most, None where all hold."""
        margins = [float(self._margin(bound, z[:, None])[0]) for bound in self.bounds if bound != met]
        worst = int(np.argmin(margins))
        return [bound for bound in self.bounds if bound != met][worst] if margins[worst] < -SLACK else None

    def _bound_at(self, coordinate: int, z: Array) -> Bound:
        return next(b for b in self.bounds if b.coordinate == coordinate and b.sign * (z[coordinate] - b.at) < 0)


@dataclass(frozen=True)
class _Known:
    """What the model reads of a stack, and how that changes with its free coordinates."""

    reading: Array
    slopes: Array


@dataclass(frozen=True)
class _Goal:
    """Lobes on the way from those that are to those that are wished for."""

    nearby: Nearby
    end: Array

    @cached_property
    def rows(self) -> Array:
        """What counts: of energies one channel where nothing absorbs."""
        places, k = self.nearby.places, len(self.nearby.target.lobes)
        energies = [3 * place.lobe + c for place in places if place.u for c in range(place.u.stop - place.u.start)]
        return np.array([*energies, *(3 * k + n for n in range(len(places)))])

    @cached_property
    def scale(self) -> Array:
        """Energies are seen against the brightest channel of their lobe."""
        k = 3 * len(self.nearby.target.lobes)
        brightest = np.repeat(self.end[:k].reshape(-1, 3).max(axis=1), 3)
        return np.r_[np.maximum(brightest, 1e-3), self.end[k:] + 0.01][self.rows]

    @cached_property
    def reach(self) -> Array:
        """The longest step of every coordinate in one round."""
        reach = np.full(len(self.nearby.z), np.inf)
        for place in self.nearby.places:
            if place.u is not None:
                reach[place.u] = np.maximum(0.5 * self.nearby.z[place.u], 0.05)
            if place.index is not None:
                reach[place.index] = 0.2
        return reach

    @property
    def way(self) -> Array:
        return self.scaled(self.end - self.nearby.known.reading)

    def reading(self, t: float) -> Array:
        """What is to be read after a part of the way."""
        return self.end if t == 1 else self.nearby.known.reading + t * (self.end - self.nearby.known.reading)

    def missing(self, reading: Array, t: float) -> Array:
        return self.scaled(reading - self.reading(t))

    def scaled(self, x: Array) -> Array:
        """Of readings, or their slopes, what counts, in units of what is wished for."""
        return (x[self.rows].T / self.scale).T


@dataclass
class _Reader:
    """Coordinates of interfaces, from the top."""

    target: Target
    model: Model
    places: list[Place] = field(default_factory=list)
    bounds: list[Bound] = field(default_factory=list)
    z: list[float] = field(default_factory=list)
    eta: float = 0.0

    def add(self, k: int, n: int, part: Layers) -> None:
        """The n-th interface of the k-th lobe."""
        lobe, first = self.target.lobes[k], not self.places
        eta_1 = self.eta or self.target.exterior
        pinned = lobe.fixed.of("tau", n)
        tau = np.broadcast_to(np.reshape(part.tau if pinned is None else pinned, (-1, 1)).astype(float), (3, 1))
        ratio = np.asarray(part.eta, float) / eta_1
        last, own = n == lobe.interfaces - 1, float(np.mean(ratio))
        fields: dict[str, Any] = {
            "kind": part.kind,
            "lobe": k,
            "side": -1 if own < 1 else 1,
            "tint": np.full((3, 1), lobe.tint),
        }
        s = self._coordinate(k, float(MAPS[self.model.map].variance(float(part.alpha))), "blur", 0.0)
        absorbs = last and not first
        if not last:
            top = float(np.log(self.target.eta_max))
            index = self._coordinate(k, float(np.log(lobe.fixed.of("eta", 0) or eta_1 * own)), "index", 0.0, top)
            self.places.append(Place(**fields, kept=tau, absorbs=False, s=s, index=index))
        elif part.kind == "dielectric":
            most = ((own - 1) / (own + 1)) ** 2
            least = float(tau.min()) if absorbs else 0.0
            reflectances = (most * np.exp(-2 * (tau - least)))[:, 0] if absorbs else [most]
            u = self._colour(k, list(reflectances), "upper", 0.0)
            share = self._coordinate(k, least, "absorption", 0.0) if absorbs else None
            kept = np.ones((3, 1)) if absorbs else tau
            for limit in ((1, 0.0), (-1, float(np.log(self.target.eta_max)))):
                self.bounds.append(Bound(k, "energy", *limit, place=len(self.places)))
            self.places.append(Place(**fields, kept=kept, absorbs=absorbs, s=s, u=u, share=share))
        else:
            kappa = np.asarray(part.kappa, float) / eta_1
            reflectance = np.broadcast_to(fresnel.normal_incidence(ratio, kappa), (3, 1))
            tint = conductor_tint(ratio, kappa)
            tint = retinted(tint, float(np.mean(tint)), lobe.tint)
            low, why = (ENERGY_MIN, "upper") if absorbs else (float(CONDUCTOR_MIN), "metal")
            u = self._colour(k, list(np.maximum(reflectance[:, 0], CONDUCTOR_MIN)), why, low, float(CONDUCTOR_MAX))
            share = self._coordinate(k, 1.0, "absorption", 0.0, 1.0) if absorbs else None
            fields["tint"] = np.broadcast_to(tint, (3, 1))
            self.places.append(Place(**fields, kept=tau, absorbs=absorbs, s=s, u=u, share=share))
        if part.kind == "dielectric":
            self.eta = eta_1 * own if last else float(np.exp(self.z[self.places[-1].index or 0]))

    def _coordinate(self, lobe: int, value: float, reason: str, low: float, high: float | None = None) -> int:
        n = len(self.z)
        self.z.append(value)
        self.bounds.append(Bound(lobe, reason, 1, low, n))
        if high is not None:
            self.bounds.append(Bound(lobe, "energy" if reason != "index" else reason, -1, high, n))
        return n

    def _colour(self, lobe: int, values: Sequence[float], reason: str, low: float, high: float | None = None) -> slice:
        first = len(self.z)
        for value in values:
            self._coordinate(lobe, float(value), reason, low, high)
        return slice(first, len(self.z))


def _pinned(lobe: TargetLobe, first: bool) -> bool:
    """Whether more is fixed of a lobe than what is a constant here: media above the first and of pairs, their index."""
    last = lobe.interfaces - 1
    pins = [("eta", last), ("k", last), *(("alpha", n) for n in range(lobe.interfaces))]
    pins += [("tau", last)] if last or not first else []
    return any(lobe.fixed.of(key, n) is not None for key, n in pins)


def retinted(tint: Array, now: float, then: float) -> Array:
    """Tints of all channels moved, within 0..1, as from one value to another."""
    if abs(now - then) < SAME:
        return tint
    return tint * (then / now) if then < now else 1 - (1 - tint) * ((1 - then) / (1 - now))


def seen(stack: Stack, target: Target, model: Model) -> Target:
    """A target with the energies and blurs that a stack of its form has."""
    form = target
    for k in range(len(target.lobes)):
        form = form.with_lobe(k, fixed=Fixed())
    near = Nearby.of(stack, form, model)
    assert near is not None
    return near.renamed(target)._target_of(near.read(near.z[:, None])[:, 0])


def plain(stack: Stack) -> list[Layers]:
    """The interfaces of a stack, each with the medium above it; a dielectric has one index for all channels.

    Raises:
        InvalidInput: a layer that no target can have, in one line.
    """
    if stack.thin:
        raise InvalidInput("thin: a pane ends in the index outside; a target has no such last index")
    found: list[Layers] = []
    tau: Array | float = 0.0
    base = len(stack.layers) - 1 if stack.base else None
    material = Material.of(stack, lambda at, value: value if at.layer == base else number(at, value))
    for n, layer in enumerate(material.layers[:base]):
        where = f"layer {n} ({layer.kind})"
        if isinstance(layer, MediumValues):
            if np.any(layer.sigma_s > 0):
                raise InvalidInput(f"{where}: scatters light; the media of a target only absorb")
            tau = np.broadcast_to(layer.sigma_a * layer.depth, (3, 1))
            continue
        if not isinstance(layer, InterfaceValues):
            raise InvalidInput(f"{where}: a target has interfaces and media only")
        if layer.kind == "mirror":
            raise InvalidInput(f"{where}: reflects all light whatever its index; a target has a conductor there")
        if layer.alpha_u != layer.alpha_v:
            raise InvalidInput(f"{where}: is brushed; the lobes of a target are round")
        eta = layer.eta if layer.kind == "conductor" else np.full((1, 1), np.mean(layer.eta))
        found.append(Layers(layer.kind, eta, layer.k, Roughness(layer.alpha_u, layer.alpha_u, 0.0), tau))
        tau = 0.0
    if not found:
        raise InvalidInput("layers: no interface; without one there is no lobe")
    return found
