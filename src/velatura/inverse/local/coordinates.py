"""A stack as coordinates: numbers that change while its lobes are dragged, their bounds, and their reading by a model.

Of the last interface of a lobe, the reflectance at normal incidence that it has when smooth, per channel; of every
interface, a variance; these are free. The index between two interfaces and absorption that no reflectance needs are
coordinates, too, that are kept as long as they can be.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import Any

import numpy as np

from velatura import ops
from velatura.errors import InvalidInput
from velatura.inverse.lobes import coatings
from velatura.inverse.lobes.interface import (
    CONDUCTOR_MAX,
    CONDUCTOR_MIN,
    ENERGY_MIN,
    conductor_extinction,
    conductor_index,
    conductor_tint,
    least,
)
from velatura.inverse.lobes.partial_stack import NORMAL, Array, Layers, Mask, named_as, read_whole, variance_of, whole
from velatura.inverse.lobes.target import Target
from velatura.inverse.reasons import UNMET, because
from velatura.model import Model
from velatura.model.guards import VARIANCE_MAX
from velatura.model.papers.adding import lobes
from velatura.model.papers.prepare import prepare
from velatura.model.roughness_maps import AS_IT_IS, MAPS
from velatura.model.variance import Covariance, Isotropic, Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.stack import Film, InterfaceValues, Kind, Material, MediumValues, Stack, number

SLACK = 1e-8  # by which a bound may be broken
INDEX_REACH = 0.2  # the longest step of the logarithm of an index
STEP = 1e-5  # of a coordinate, to see how the lobes change
NEAR = 1e-3  # coordinates above which it is to smaller values
SAME = 1e-6  # difference of tints that count as equal
SMOOTH = 1e-10  # variance below which an interface is smooth
REFLECTANCE_MAX = 0.95  # of a dielectric
ODDS = MAPS["belcour-release"]  # from x to x / (1 - x)
DEEP = 50.0  # an optical depth that nothing passes
CLEARED, OUTSIDE = 1e-7, 1e-4  # optical depths below 0: that are none, and that are read on the way
SHIFT = 0.01  # change of an index, a reflectance or a tint, to see how what films reflect follows
FLAT = 0.2  # slope of that over the reflectance of a conductor, as logarithms, below which its tint changes, too
TURN = 3.0  # slope of the tint over that logarithm, at most


@dataclass(frozen=True)
class InterfaceCoordinates:
    """One interface, and the indices of its coordinates.

    side: 1 denser, -1 rarer than what is above. tint: of a conductor, (3, 1). kept: optical depths (3, 1) of the medium
    above that its reflectances do not need. absorbs: whether that medium takes away what its reflectances need.
    axis: near that of its roughness that comes first, in radians.
    scatters: the medium above, if that scatters; it stays, and absorbs as the coordinates say.
    films: on it; then the index of a dielectric follows from the reflectance of the channel `reference`: that of least
    absorption, or where nothing absorbs that in which an index shows most. darkest: the least reflectances (3, 1) of a
    conductor; what is to reflect less is below more that absorbs. turn: by which its tint (3, 1) changes with the
    logarithm of its reflectance over `pivot`, where films let that alone change nothing.
    variance, depth, reflectances, log_index: indices of the entries of the variance, of the factor on `kept` (None
    where that is pinned), of the reflectances by channel or the one of all (None where the index itself is a
    coordinate), and of the logarithm of the index.
    """

    kind: Kind
    lobe: int
    side: int
    tint: Array
    kept: Array
    absorbs: bool
    variance: slice
    axis: float
    depth: int | None = None
    reflectances: slice | None = None
    log_index: int | None = None
    scatters: MediumValues | None = None
    films: tuple[Film, ...] = ()
    reference: int = 0
    darkest: Array | None = None
    turn: Array | None = None
    pivot: Array | None = None

    def rounded(self, digits: int) -> InterfaceCoordinates:
        """The same, numbers that are kept rounded to so many digits."""
        kept: dict[str, Any] = {
            name: rounded(value, digits) for name, value in vars(self).items() if isinstance(value, np.ndarray)
        }
        return dataclasses.replace(self, **kept)


@dataclass(frozen=True)
class Bound:
    """A bound on a coordinate, on the logarithm of an interface's index, or the optical depth above it in a `channel`,
    or on the least variance of the entries `axes`: `sign` times it is at least `sign * at`.

    lobe, reason: the lobe that cannot be given beyond the bound, and why, a key of `REASONS`. missing: the share of a
    goal that the nearest stack of a search misses which ends there.
    """

    lobe: int
    reason: str
    sign: int
    at: float
    coordinate: int | None = None
    interface: int | None = None
    axes: slice | None = None
    channel: int | None = None
    missing: float = field(default=np.inf, compare=False)

    def why(self, target: Target) -> str:
        """The reason, in words, why a target is not met."""
        return because(self.lobe, self.reason, target)


@dataclass(frozen=True)
class Reading:
    """Energies of all lobes, then variances of all interfaces, of V entries each: (3 K + V I,), and their derivatives
    (3 K + V I, free)."""

    value: Array
    slopes: Array


@dataclass(frozen=True)
class Space:
    """The space of coordinates of stacks of one form, below an index `exterior`, as a model reads them.

    Points x have shape (D,), or (D, N) for N stacks. factors: of readings, (3 K + V I,), where a model in closed form
    stands in for another one. kind: of the variances. quick: whether films are known roughly, of many points at once.
    folded: whether entries of variances s are those of s / (1 + s), which is at most 1.
    """

    model: Model
    exterior: float
    interfaces: tuple[InterfaceCoordinates, ...]
    bounds: tuple[Bound, ...]
    factors: Array | None = None
    kind: type[Variance] = Isotropic
    quick: bool = False
    folded: bool = False

    # Points as layers, and as the model reads them -------------------------------------------------------------------

    def layers(self, x: Array) -> list[Layers]:
        """The interfaces of N points."""
        return [
            Layers(
                own.kind,
                eta,
                kappa,
                self._roughness(x[own.variance], own.axis),
                tau,
                scatters=own.scatters,
                films=own.films,
            )
            for own, (eta, kappa, tau) in zip(self.interfaces, self._values(x))
        ]

    def index(self, x: Array, n: int) -> float:
        """The index of the n-th interface, a dielectric, at a point (D,)."""
        eta, *_ = next(islice(self._values(x[:, None]), n, None))
        return float(np.mean(eta))

    def _values(self, x: Array) -> Iterator[tuple[Array, Array | None, Value]]:
        """Absolute eta and kappa of each interface of N points, and the optical depths above it."""
        eta_1 = np.full((1, x.shape[1]), self.exterior)
        for own in self.interfaces:
            tau = own.kept if own.depth is None else own.kept * x[own.depth]
            kappa = None
            if own.log_index is not None:
                eta = np.exp(x[own.log_index][None])
            elif own.kind == "conductor":
                eta, kappa, absorbed = _conductor(own, x[own.reflectances])
                eta, kappa, tau = eta * eta_1, kappa * eta_1, tau + absorbed
            elif own.kind == "mirror":
                eta = np.ones((1, x.shape[1]))
                if own.reflectances is not None:
                    tau = tau - 0.5 * np.log(np.maximum(x[own.reflectances], ENERGY_MIN))
            else:
                eta, absorbed = _dielectric(own, x[own.reflectances])
                eta, tau = eta * eta_1, np.maximum(tau + absorbed, -OUTSIDE) if own.films else tau + absorbed
            yield eta, kappa, tau
            if own.kind == "dielectric":
                eta_1 = eta

    def _roughness(self, entries: Array, axis: float) -> Roughness:
        """The roughness of a variance, smooth where that is next to nothing, the axis first that is nearer to one."""
        f = MAPS[self.model.map]
        u, v, rotation = named_as(self._unfolded(entries).roughness(f), axis)
        smooth = f.roughness(SMOOTH)
        return Roughness(np.where(u < smooth, 0.0, u), np.where(v < smooth, 0.0, v), rotation + 0.0 * u)

    def _unfolded(self, entries: Array) -> Variance:
        """The variance itself of its entries in a point."""
        s = self.kind(*entries)
        return self.kind.of(s.roughness(AS_IT_IS), ODDS) if self.folded else s

    def refolded(self, x: Array) -> Array:
        """A point (D,) of this space in the one that is folded if this one is not, and the other way round."""
        x = x.copy()
        for own in self.interfaces:
            s = self.kind(*x[own.variance])
            there = self._unfolded(x[own.variance]) if self.folded else self.kind.of(s.roughness(ODDS), AS_IT_IS)
            x[own.variance] = list(vars(there).values())
        return x

    def read(self, x: Array) -> Array:
        """Energies of all lobes, then variances of all interfaces, (3 K + V I, N), of N points."""
        if self.slow:
            return np.stack([self._solved(point[:, None]) for point in x.T], axis=-1)
        material = whole(self.layers(x), self.exterior)
        reflected, _ = lobes(prepare(material, self.model, self.kind), NORMAL)
        return self.sorted(x, [(lobe.energy, lobe.roughness) for lobe in reflected])

    def _solved(self, x: Array) -> Array:
        """The same of one point (D, 1), by a model that reads one material at a time, (3 K + V I,)."""
        found = read_whole(self.layers(x), self.exterior, self.model)
        roughnesses = [Roughness(alpha[0], alpha[1], rotation) for alpha, rotation in zip(found.alpha, found.rotation)]
        return self.sorted(x, list(zip(found.energy, roughnesses)))[:, 0]

    def sorted(self, x: Array, reflected: Sequence[tuple[Value, Roughness]]) -> Array:
        """Energies and roughnesses of interfaces as they are read."""
        energy = np.zeros((3 * self.lobes, x.shape[1]))
        variance = np.empty((len(self.interfaces), self.entries, x.shape[1]))
        for n, (own, (reflects, roughness)) in enumerate(zip(self.interfaces, reflected)):
            energy[3 * own.lobe : 3 * own.lobe + 3] += reflects
            s = variance_of(roughness, MAPS[self.model.map], self.kind)
            variance[n] = [self._brightest(own, x, entry) for entry in vars(s).values()]
        found = np.vstack([energy, np.minimum(variance, VARIANCE_MAX).reshape(-1, x.shape[1])])
        return found if self.factors is None else self.factors[:, None] * found

    def differences(self, x: Array, free: Array) -> Reading:
        """The reading at a point, by differences of the model itself along some coordinates.

        Differences are to smaller values, away from the singular indices of the darkest metals, except near 0.
        """
        points = np.repeat(x[:, None], len(free) + 1, axis=1)
        points[free, 1 + np.arange(len(free))] += np.where(x[free] > NEAR, -STEP, STEP) * units(x[free])
        read = self.read(points)
        return Reading(read[:, 0], (read[:, 1:] - read[:, :1]) / (points[free, 1 + np.arange(len(free))] - x[free]))

    def reading(self, x: Array, free: Array, before: tuple[Array, Reading] | None = None) -> Reading:
        """The reading at a point, by differences along some coordinates.

        Of a model that is slow, the differences are those of the nearest one that adds up layers, in proportion; or, if
        another point and its reading `before` are given, Broyden's, which follow from the change of the reading.
        """
        closed = not self.slow
        if before and not closed:
            value, step = self.read(x[:, None])[:, 0], x[free] - before[0][free]
            along = step / units(x[free]) ** 2
            missed = value - before[1].value - before[1].slopes @ step
            return Reading(value, before[1].slopes + np.outer(missed, ops.divide(along, along @ step)))
        near = self.quickly.differences(x, free)
        if closed:
            return near
        value = self.read(x[:, None])[:, 0]
        ratio = self._sizes(value) / np.maximum(self._sizes(near.value), ENERGY_MIN)
        return Reading(value, near.slopes * np.clip(ratio, 0.1, 10)[:, None])

    def _sizes(self, value: Array) -> Array:
        """Sizes of a reading: of energies, and of the variances of every interface, for each of their entries."""
        energies, variances = np.split(value, [3 * self.lobes])
        sizes = np.abs(variances).reshape(-1, self.entries).sum(axis=1)
        return np.r_[energies, np.repeat(sizes, self.entries)]

    def goal(self, wish: Target) -> Array:
        """The reading, (3 K + V I,), with which a target is met."""
        f = MAPS[self.model.map]
        s = [np.ravel(list(vars(wish.lobes[own.lobe].blur(f, self.kind)).values())) for own in self.interfaces]
        return np.concatenate([[max(e, ENERGY_MIN) for lobe in wish.lobes for e in lobe.colour], *s])

    def target_of(self, reading: Array, form: Target) -> Target:
        """The target of a form with lobes as they are read, of several interfaces with their mean variance."""
        variances = reading[3 * self.lobes :].reshape(len(self.interfaces), -1)
        for k in range(self.lobes):
            s = np.mean([variances[n] for n, own in enumerate(self.interfaces) if own.lobe == k], axis=0)
            roughness = named_as(self.kind(*s).roughness(MAPS[self.model.map]), form.lobes[k].axes.rotation)
            form = form.with_lobe(k, energy=tuple(reading[3 * k : 3 * k + 3].tolist()))
            form = form.with_roughness(k, roughness)
        return form

    def _brightest(self, own: InterfaceCoordinates, x: Array, s: Array) -> Array:
        """The variance of the channel in which the lobe must reflect most, if every channel has its own."""
        if np.ndim(s) < 2 or len(s) == 1:
            return np.ravel(s) if np.ndim(s) > 1 else s
        spans = [o.reflectances for o in self.interfaces if o.lobe == own.lobe and o.reflectances is not None]
        brightest = np.argmax(np.round(x[spans[0]], 9), axis=0) if spans else np.zeros(x.shape[1], int)
        return np.take_along_axis(s, np.broadcast_to(brightest, (1, x.shape[1])), axis=0)[0]

    # Coordinates -----------------------------------------------------------------------------------------------------

    @property
    def lobes(self) -> int:
        """The number of lobes."""
        return self.interfaces[-1].lobe + 1

    @property
    def slow(self) -> bool:
        """Whether one point is read at a time."""
        return not self.quick and (not self.model.closed_form or self.coated)

    @property
    def coated(self) -> bool:
        """Whether there are films."""
        return any(own.films for own in self.interfaces)

    @property
    def quickly(self) -> Space:
        """The space as the nearest model reads it that adds up layers, many points at a time."""
        return dataclasses.replace(self, model=self.model.surrogate, quick=True)

    @property
    def winds(self) -> bool:
        """Whether readings wind as coordinates change, as those of a slow model do of lobes with axes."""
        return self.entries > 1 and not self.model.closed_form

    @property
    def entries(self) -> int:
        """The number of entries of a variance."""
        return len(dataclasses.fields(self.kind))

    @cached_property
    def free(self) -> Array:
        """Indices of the coordinates that always move: reflectances, then variances."""
        spans = [own.reflectances for own in self.interfaces if own.reflectances is not None]
        spans += [own.variance for own in self.interfaces]
        return np.array([n for span in spans for n in range(span.start, span.stop)])

    @cached_property
    def counted(self) -> Array:
        """Which readings count: of energies one channel where nothing absorbs, and all variances."""
        found = []
        for own in self.interfaces:
            if own.reflectances is not None:
                channels = own.reflectances.stop - own.reflectances.start
                found += [3 * own.lobe + c for c in (range(3) if channels == 3 else (own.reference,))]
        return np.array([*found, *(3 * self.lobes + n for n in range(self.entries * len(self.interfaces)))])

    @cached_property
    def followed(self) -> Mask:
        """Mask of what coordinates readings follow, (3 K + V I, D): those of the interface that reflects, and of
        all above."""
        last = [max(n for n, own in enumerate(self.interfaces) if own.lobe == k) for k in range(self.lobes)]
        lowest = np.r_[np.repeat(last, 3), np.repeat(np.arange(len(self.interfaces)), self.entries)]
        found = np.zeros((len(lowest), len(self.box[0])), bool)
        for n, own in enumerate(self.interfaces):
            found[:, _coordinates(own)] = (lowest >= n)[:, None]
        return found

    def reach(self, x: Array, share: float, least: float) -> Array:
        """The longest steps, (D,): of reflectances a share of them, `least` at least, and of logarithms of indices."""
        reach = np.full(len(x), np.inf)
        for own in self.interfaces:
            if own.reflectances is not None:
                reach[own.reflectances] = np.maximum(share * x[own.reflectances], least)
            if own.log_index is not None:
                reach[own.log_index] = INDEX_REACH
        return reach

    # Bounds ----------------------------------------------------------------------------------------------------------

    def clipped(self, x: Array) -> Array:
        """The point (D,) within the bounds on coordinates, and where no medium over films absorbs less than nothing."""
        x = np.clip(x, *self.box)
        for own in self.interfaces:
            if own.films and own.absorbs and own.kind == "dielectric" and own.reflectances and own.depth:
                span = x[own.reflectances]
                x[own.reflectances] = np.minimum(span, span[own.reference] * np.exp(2 * min(x[own.depth], DEEP)))
        return x

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """The least and the largest values of all coordinates, (D,) each."""
        size = 1 + max(bound.coordinate for bound in self.bounds if bound.coordinate is not None)
        low, high = np.full(size, -np.inf), np.full(size, np.inf)
        for bound in self.bounds:
            if bound.coordinate is not None:
                (low if bound.sign > 0 else high)[bound.coordinate] = bound.at
        return low, high

    def margins(self, bounds: Sequence[Bound], x: Array) -> Array:
        """Distances of N points from bounds, negative outside, (bounds, N)."""
        indices, depths = zip(*((np.log(eta[0]), tau) for eta, _, tau in self._values(x)))
        found = np.empty((len(bounds), x.shape[1]))
        for n, bound in enumerate(bounds):
            if bound.coordinate is not None:
                value = x[bound.coordinate]
            elif bound.axes is not None:
                value = least(self.kind(*x[bound.axes]))
            else:
                assert bound.interface is not None
                value = indices[bound.interface] if bound.channel is None else depths[bound.interface][bound.channel]
            found[n] = bound.sign * (value - bound.at)
        return found

    def margin_slopes(self, bound: Bound, x: Array, free: Array) -> tuple[float, Array]:
        """Distance of a point (D,) from a bound, and its derivatives along some coordinates, (free,).

        An index follows the largest of an interface's reflectances: where some are equal, they share its derivative.
        """
        tied = np.eye(len(x), dtype=bool)
        for own in self.interfaces:
            if own.kind == "dielectric" and own.reflectances is not None and not own.films:
                span = x[own.reflectances]
                largest = span > span.max() - SLACK
                tied[own.reflectances, own.reflectances] |= largest[:, None] & largest
        together = tied[:, free]
        steps = STEP * units(x[free])
        (margins,) = self.margins([bound], np.c_[x, x[:, None] + steps * together])
        return float(margins[0]), (margins[1:] - margins[0]) / (steps * together.sum(axis=0))

    def broken(self, x: Array, met: Bound | None) -> Bound | None:
        """The bound that a point violates most, except the one that it lies on; None if all hold."""
        others = [bound for bound in self.bounds if bound != met]
        margins = self.margins(others, x[:, None])[:, 0]
        worst = int(np.argmin(margins))
        return others[worst] if margins[worst] < -SLACK else None

    def unmet(self, reading: int) -> Bound:
        """Reason that stops a search that misses a reading most, where no bound is in its way."""
        energies = 3 * self.lobes
        if reading < energies:
            return dataclasses.replace(self.bounds[0], lobe=reading // 3, reason=UNMET[0])
        own = self.interfaces[(reading - energies) // self.entries]
        return dataclasses.replace(self.bounds[0], lobe=own.lobe, reason=UNMET[1])

    def bound_at(self, coordinate: int, x: Array) -> Bound:
        """The bound on a coordinate that a point violates."""
        outside = (b for b in self.bounds if b.coordinate == coordinate and b.sign * (x[coordinate] - b.at) < 0)
        return next(outside, None) or next(
            bound
            for n, own in enumerate(self.interfaces)
            for bound in self.bounds
            if own.reflectances and bound.interface == n and bound.channel == coordinate - own.reflectances.start
        )


def _coordinates(own: InterfaceCoordinates) -> list[int]:
    """The indices of the coordinates of an interface."""
    spans = [span for span in (own.variance, own.reflectances) if span is not None]
    places = [n for span in spans for n in range(span.start, span.stop)]
    return [*places, *(n for n in (own.depth, own.log_index) if n is not None)]


@dataclass(frozen=True)
class Point:
    """A stack: a point x, (D,), of a space. known: how the model reads it, where that is known already."""

    space: Space
    x: Array
    known: Reading | None = None

    @cached_property
    def reading(self) -> Reading:
        """The model's reading of it."""
        return self.known or self.space.reading(self.x, self.space.free)

    @property
    def refolded(self) -> Point:
        """The same stack, where variances are folded if they are not here, and the other way round."""
        space, known = self.space, self.known
        if known:
            steps = STEP * units(self.x[space.free])
            here, there = space.refolded(self.x), np.empty((len(space.free), len(space.free)))
            for n, c in enumerate(space.free):
                x = self.x.copy()
                x[c] += steps[n]
                there[:, n] = (space.refolded(x) - here)[space.free] / steps[n]
            known = Reading(known.value, known.slopes @ np.linalg.pinv(there))
        return Point(dataclasses.replace(space, folded=not space.folded), space.refolded(self.x), known)

    @cached_property
    def layers(self) -> list[Layers]:
        """Its interfaces, each with the medium above it."""
        return self.space.layers(self.x[:, None])


def rounded(x: Array, digits: int) -> Array:
    """Numbers of so many digits, and of no more decimals than numbers of their least unit, .01, have then. A search of
    many steps may end elsewhere where a number differs by rounding, as those do that are written to a file and read, or
    computed by kernels and by NumPy: by 1e-16, which next to 0 is a digit."""
    return np.array([round(float(f"{each:.{digits}g}"), digits + 2) for each in x.flat]).reshape(x.shape)


def units(x: Array) -> Array:
    """Units of coordinates: their sizes, and a little."""
    return np.abs(x) + 0.01


def _conductor(own: InterfaceCoordinates, reflectances: Array) -> tuple[Array, Array, Value]:
    """Relative eta and kappa of conductors, and what absorbs where they cannot reflect as little."""
    darkest = CONDUCTOR_MIN + 1e-12 if own.darkest is None else own.darkest
    u = np.clip(reflectances, darkest, CONDUCTOR_MAX)
    tint = own.tint
    if own.turn is not None and own.pivot is not None:
        tint = np.clip(tint + own.turn * np.log(u / own.pivot), 0.0, 1.0)
    n = conductor_index(u, tint)
    return n, np.maximum(conductor_extinction(u, n), n), 0.5 * np.log(u / np.minimum(reflectances, u))


def _dielectric(own: InterfaceCoordinates, reflectances: Array) -> tuple[Array, Value]:
    """Relative indices of dielectrics, and what absorbs in the channels that reflect less than the most."""
    known = reflectances[own.reference][None] if own.films and own.absorbs else reflectances
    most = np.clip(np.max(known, axis=0, keepdims=True), 0.0, REFLECTANCE_MAX)
    root = np.sqrt(most)
    eta = ((1 + root) / (1 - root)) ** own.side
    if not own.absorbs:
        return eta, 0.0
    if own.films:
        return eta, 0.5 * np.log(np.maximum(most, ENERGY_MIN) / np.maximum(reflectances, ENERGY_MIN))
    least = np.clip(reflectances, ENERGY_MIN, most + ENERGY_MIN)
    return eta, 0.5 * np.log(np.maximum(most, ENERGY_MIN) / least)


# From a stack --------------------------------------------------------------------------------------------------------


@dataclass
class Reader:
    """The coordinates of interfaces, from the top."""

    target: Target
    model: Model
    kind: type[Variance]
    interfaces: list[InterfaceCoordinates] = field(default_factory=list)
    bounds: list[Bound] = field(default_factory=list)
    x: list[float] = field(default_factory=list)
    eta_1: float = 0.0

    def __post_init__(self) -> None:
        self.eta_1 = self.target.exterior

    @property
    def space(self) -> Space:
        """The space of the interfaces so far."""
        return Space(self.model, self.target.exterior, tuple(self.interfaces), tuple(self.bounds), kind=self.kind)

    def add(self, k: int, n: int, part: Layers) -> None:
        """The n-th interface of the k-th lobe."""
        lobe, first, last = self.target.lobes[k], not self.interfaces, n == self.target.lobes[k].interfaces - 1
        pinned = lobe.fixed.of("tau", n)
        tau = np.broadcast_to(np.reshape(part.tau if pinned is None else pinned, (-1, 1)).astype(float), (3, 1))
        ratio = np.asarray(part.eta, float) / self.eta_1
        values: dict[str, Any] = {
            "kind": part.kind,
            "lobe": k,
            "side": -1 if float(np.mean(ratio)) < 1 else 1,
            "tint": np.full((3, 1), lobe.tint),
            "kept": tau,
            "absorbs": last and not first,
            "variance": self._blur(k, part.roughness),
            "axis": lobe.axes.rotation,
            "scatters": part.scatters,
            "films": part.films,
        }
        if not last:
            own = self._upper(k, n, float(np.mean(ratio)), values)
        elif part.kind == "mirror":
            own = self._mirror(k, values)
        elif part.kind == "dielectric":
            own = self._dielectric(k, float(np.mean(ratio)), values)
        else:
            own = self._conductor(k, ratio, np.asarray(part.kappa, float) / self.eta_1, values)
        self.interfaces.append(own)
        if own.log_index is not None:
            self.eta_1 = float(np.exp(self.x[own.log_index]))
        elif own.kind == "dielectric":
            self.eta_1 = self.eta_1 * float(np.mean(ratio))

    def _upper(self, k: int, n: int, ratio: float, values: dict[str, Any]) -> InterfaceCoordinates:
        """The n-th interface of a lobe, below which are others of it."""
        pinned, top = self.target.lobes[k].fixed.of("eta", n), float(np.log(self.target.eta_max))
        index = self._coordinate(k, float(np.log(pinned or self.eta_1 * ratio)), "index", 0.0, top)
        return InterfaceCoordinates(**values, log_index=index)

    def _dielectric(self, k: int, ratio: float, values: dict[str, Any]) -> InterfaceCoordinates:
        """The last interface of a lobe, a dielectric: what all channels absorb alike is kept."""
        tau, most, depth = values["kept"], fresnel.normal_incidence(ratio), None
        reflectances = [most]
        if values["absorbs"]:
            least = float(tau.min())
            reflectances = (most * np.exp(-2 * (tau - least)))[:, 0].tolist()
        span = self._colour(k, reflectances, "upper", 0.0)
        if values["absorbs"]:
            depth, values["kept"] = self._coordinate(k, least, "absorption", 0.0), np.ones((3, 1))
        here = len(self.interfaces)
        for sign, at in ((1, 0.0), (-1, float(np.log(self.target.eta_max)))):
            self.bounds.append(Bound(k, "energy", sign, at, interface=here))
        if values["films"]:
            values["reference"] = int(np.argmin(tau)) if values["absorbs"] else self._shown_by(ratio, values["films"])
            for c in range(3) if values["absorbs"] else ():
                self.bounds.append(Bound(k, "absorption", 1, -CLEARED, interface=here, channel=c))
        return InterfaceCoordinates(**values, depth=depth, reflectances=span)

    def _shown_by(self, ratio: float, coated: tuple[Film, ...]) -> int:
        """The channel in which an index below films shows most."""
        eta = self.eta_1 * ratio * np.array([[1 - SHIFT, 1 + SHIFT]])
        r = coatings.AtNormal(coatings.values(coated), self.eta_1, eta, None).at(1.0, None)
        return int(np.argmax(np.abs(r[:, 1] - r[:, 0])))

    def _mirror(self, k: int, values: dict[str, Any]) -> InterfaceCoordinates:
        """A mirror: what absorbs above it makes its colour, and nothing does above one on top."""
        if not values["absorbs"]:
            return InterfaceCoordinates(**values)
        span = self._colour(k, np.exp(-2 * values["kept"][:, 0]).tolist(), "upper", ENERGY_MIN, 1.0)
        values["kept"] = np.zeros((3, 1))
        return InterfaceCoordinates(**values, reflectances=span)

    def _conductor(self, k: int, ratio: Array, kappa: Array, values: dict[str, Any]) -> InterfaceCoordinates:
        """The last interface of a lobe, a conductor: all that absorbs is kept."""
        reflectance = np.broadcast_to(fresnel.normal_incidence(ratio, kappa), (3, 1))
        low, why = (ENERGY_MIN, "upper") if values["absorbs"] else (float(CONDUCTOR_MIN), "metal")
        reflectances = np.maximum(reflectance[:, 0], low).tolist()
        span = self._colour(k, reflectances, why, low, float(CONDUCTOR_MAX))
        depth = self._coordinate(k, 1.0, "absorption", 0.0, 1.0) if values["absorbs"] else None
        values["tint"] = np.broadcast_to(conductor_tint(ratio, kappa), (3, 1))
        if values["films"]:
            by_u, by_tint = self._responses(reflectance, values)
            flat = np.abs(by_u) < FLAT
            if values["absorbs"]:
                absorbed = (by_u < FLAT) & (values["kept"] > 0)
                darker = np.where(absorbed, np.exp(-2 * values["kept"]), 1.0)[:, 0]
                self.x[span] = (np.array(self.x[span]) * darker).tolist()
                values["darkest"] = np.where(absorbed, reflectance, CONDUCTOR_MIN + 1e-12)
                values["kept"] = np.where(absorbed, 0.0, values["kept"])
                flat = flat & ~absorbed
            values["turn"] = np.where(flat, np.clip(ops.divide(1 - by_u, by_tint), -TURN, TURN), 0.0)
            values["pivot"] = reflectance
        return InterfaceCoordinates(**values, depth=depth, reflectances=span)

    def _responses(self, reflectance: Array, values: dict[str, Any]) -> tuple[Array, Array]:
        """Changes (3, 1) of the logarithm of what a conductor below films reflects: by that of its own reflectance, and
        by its tint."""
        tint, own = values["tint"], coatings.values(values["films"])
        u = np.clip(reflectance, CONDUCTOR_MIN + 1e-12, CONDUCTOR_MAX / (1 + SHIFT)) * np.array([[1, 1 + SHIFT, 1]])
        turned = np.where(tint > 0.5, -SHIFT, SHIFT)
        eta = conductor_index(u, tint + turned * np.array([[0, 0, 1]]))
        kappa = np.maximum(conductor_extinction(u, eta), eta)
        r = np.log(coatings.AtNormal(own, self.eta_1, eta * self.eta_1, kappa * self.eta_1).at(1.0, None) + ENERGY_MIN)
        return (r[:, 1:2] - r[:, :1]) / np.log1p(SHIFT), (r[:, 2:] - r[:, :1]) / turned

    def _blur(self, lobe: int, roughness: Roughness) -> slice:
        """The entries of a variance."""
        first, entries = len(self.x), vars(variance_of(roughness, MAPS[self.model.map], self.kind))
        for name, value in entries.items():
            self._coordinate(lobe, float(value), "blur", -np.inf if name == "xy" else 0.0)
        span = slice(first, len(self.x))
        if self.kind is Covariance:
            self.bounds.append(Bound(lobe, "blur", 1, 0.0, axes=span))
        return span

    def _coordinate(self, lobe: int, value: float, reason: str, low: float, high: float | None = None) -> int:
        n = len(self.x)
        self.x.append(value)
        self.bounds.append(Bound(lobe, reason, 1, low, n))
        if high is not None:
            self.bounds.append(Bound(lobe, ABOVE.get(reason, "energy"), -1, high, n))
        return n

    def _colour(self, lobe: int, values: Sequence[float], reason: str, low: float, high: float | None = None) -> slice:
        first = len(self.x)
        for value in values:
            self._coordinate(lobe, float(value), reason, low, high)
        return slice(first, len(self.x))


#: Reasons for an upper bound, where the lower one has another: of indices, and of the reflectance of conductors.
ABOVE = {"index": "index", "metal": "bright", "upper": "bright"}


def retinted(tint: Array, now: float, then: float) -> Array:
    """Tints of all channels moved, within 0..1, as from one value to another."""
    if abs(now - then) < SAME:
        return tint
    return tint * (then / now) if then < now else 1 - (1 - tint) * ((1 - then) / (1 - now))


def plain(stack: Stack) -> list[Layers]:
    """The interfaces of a stack, each with the medium above it; a dielectric has one index for all channels.

    Raises:
        InvalidInput: a layer that no target can have, in one line.
    """
    if stack.thin:
        raise InvalidInput(
            "thin: behind a pane is what lies in front, and dragging lobes changes that; turn thin off to drag them"
        )
    found: list[Layers] = []
    tau: Array | float = 0.0
    scatters: MediumValues | None = None
    base = len(stack.layers) - 1 if stack.base else None
    coatings = [layer.films for layer in stack.interfaces]
    material = Material.of(stack, lambda at, value: value if at.layer == base else number(at, value))
    for n, layer in enumerate(material.layers[:base]):
        if isinstance(layer, MediumValues):
            if n and isinstance(material.layers[n - 1], MediumValues):
                raise InvalidInput(f"layer {n} (medium): a target has one medium above an interface, not two in a row")
            tau = np.broadcast_to(layer.sigma_a * layer.depth, (3, 1))
            scatters = layer if np.any(layer.sigma_s * layer.depth > 0) else None
            continue
        if not isinstance(layer, InterfaceValues):
            raise InvalidInput(f"layer {n} ({layer.kind}): a target has interfaces and media only")
        eta = layer.eta
        if layer.kind != "conductor":
            eta = np.full((1, 1), 1.0 if layer.kind == "mirror" else np.mean(layer.eta))
        roughness = Roughness(layer.alpha_u, layer.alpha_v, np.radians(layer.rotation))
        coated = coatings[len(found)]
        found.append(Layers(layer.kind, eta, layer.k, roughness, tau, scatters=scatters, films=coated))
        tau, scatters = 0.0, None
    if not found:
        raise InvalidInput("layers: no interface; without one there is no lobe")
    return found
