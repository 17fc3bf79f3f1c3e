"""Rough interfaces in numbers: their facets, and what these do to light that meets them first.

Light meets visible normals on a lattice. Light that the facets block meets two more, at heights of the Smith
microsurface; where films lie on these, walks say what becomes of it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films.reflectance import dielectric_between, dielectric_passing
from velatura.films.tables import Coated
from velatura.model import fitted
from velatura.model.guards import ALPHA_MIN, COS_AT_FACETS_MIN, SIN_AT_FACETS_MAX
from velatura.ops import Value
from velatura.optics import fresnel, ggx, microsurface, refraction
from velatura.optics.ggx import Direction
from velatura.renderer import compiled
from velatura.renderer.compiled import Found, Number
from velatura.renderer.kept import Kept
from velatura.renderer.low_discrepancy import fibonacci
from velatura.stack import InterfaceValues
from velatura.tables import coordinates
from velatura.tables.microsurface_walks import shares_in_the_end

Array = NDArray[np.floating]

DIGITS = 9  # of indices that are alike
BRUSHED = 0.05  # difference of two roughnesses, as share of the larger, from which normals do not turn with the light
WALKED = 16  # directions of walks between facets with films
PATHS = 2048  # from each
ONWARD_FROM = 0.1, 0.2  # roughness of dielectrics from which later events are looked at, and all light leaves by them
# Steps of the numbers of second and third events: of 738 sets of roots of primes one by which few normals say nearly
# what walks through single interfaces do
STEPS = tuple(prime**0.5 % 1 for prime in (103, 73, 89, 83, 19, 59, 37))
# Values of facets that kernels read, or that change nothing of first events
NUMBERS = ("above", "below", "k", "alpha_u", "alpha_v", "rotation", "final", "films")
KEPT = Kept(128 << 20)  # layers, and what they are made of


def in_units(values: Any, unit: float) -> bytes:
    """Indices or momenta as multiples of a unit: equal where they are alike."""
    return np.round(np.asarray(values) / unit, DIGITS).tobytes()


def colours(value: Any) -> Array:
    """A colour of shape (3,), or (1,) where all are alike."""
    flat = np.asarray(value, float).reshape(-1)
    return flat[:1] if (flat == flat[0]).all() else flat


@dataclass(frozen=True)
class Facets:
    """An interface between indices `above` and `below`, by colour (C,); `k` is None for a dielectric, and `below` too
    for a mirror. Roughnesses, and a rotation in radians. `final` says that nothing sends back what it lets through.
    `films` are thin films on it.
    """

    above: Array
    below: Array | None
    k: Array | None
    alpha_u: float
    alpha_v: float
    rotation: float = 0.0
    final: bool = False
    films: Coated | None = None

    @classmethod
    def of(cls, layer: InterfaceValues, above: Any, outside: float, films: Coated | None) -> Facets:
        """An interface of NumPy's values below an index `above`, with indices relative to the `outside`."""
        below = None if layer.kind == "mirror" else colours(layer.eta) / outside
        k = colours(layer.k) / outside if layer.kind == "conductor" else None
        alpha, angle = (float(layer.alpha_u), float(layer.alpha_v)), float(np.radians(layer.rotation))
        return cls(colours(above) / outside, below, k, *alpha, angle, films=films or None)

    def key(self, unit: float = 1.0) -> Hashable:
        """All values, with indices as multiples of a unit: equal for facets that act alike."""

        def of(value: Any) -> Hashable:
            if isinstance(value, Coated):
                return value.key
            return in_units(value, unit) if isinstance(value, np.ndarray) else value

        return tuple(map(of, vars(self).values()))

    @property
    def opaque(self) -> bool:
        return self.below is None or self.k is not None

    @property
    def outcomes(self) -> int:
        """How many things facets do to light: they reflect it, and unless they are opaque refract it."""
        return 1 if self.opaque else 2

    @property
    def is_exit(self) -> bool:
        """Whether it may reflect all light, of a denser medium above."""
        return not self.opaque and self.below is not None and bool(ops.mean(self.below) < ops.mean(self.above))

    @property
    def brushed(self) -> float:
        """How long facets are along an axis, from 0 towards 1."""
        return float(brushed(self.alpha_u, self.alpha_v))

    @property
    def across(self) -> float:
        """0 for isotropic facets, 1 for those so long that light keeps its momentum along them."""
        return min(self.brushed / fitted.BRUSHED_FROM, 1)

    @property
    def onward(self) -> float:
        """Share of the light that meets facets of a dielectric often which leaves as it does after second and third
        events: all where they are rough enough to block some."""
        if self.opaque:
            return 0.0
        begin, whole = ONWARD_FROM
        return min(max((mean_alpha(self) - begin) / (whole - begin), 0.0), 1.0)

    @property
    def ratio(self) -> float:
        """The greater of both roughnesses over the lesser."""
        return max(self.alpha_u, self.alpha_v, ALPHA_MIN) / max(min(self.alpha_u, self.alpha_v), ALPHA_MIN)

    @property
    def smooth(self) -> float:
        """Share of light whose direction it does not change: all where facets turn none, and the less the rougher
        they are, up to the least roughness that is resolved."""
        stepless = not self.opaque and bool((self.above == self.below).all())
        return 1.0 if stepless else max(1 - (max(self.alpha_u, self.alpha_v) / ALPHA_MIN) ** 2, 0.0)

    @property
    def step(self) -> float:
        """Step of the logarithm of the index, for light that it lets through."""
        if self.below is None or self.opaque:
            return 0.0
        return float(abs(np.log(ops.mean(self.below) / ops.mean(self.above))))

    def straight(self, often: bool) -> float:
        """Share of refracted light that meets further facets and still passes: a small step hardly turns it."""
        return float(np.exp(-self.step / fitted.STRAIGHT_STEP[often]))

    def share(self, p: Array, transmitted: bool) -> Array:
        """Share (C, ...) of light of momenta p that it reflects or transmits where it is smooth."""
        n = float(ops.mean(self.above))
        cosine = np.sqrt(np.maximum(1 - (p / n) ** 2, COS_AT_FACETS_MIN**2))
        return self.passing(cosine) if transmitted else self.reflectance(cosine)

    def reversed(self) -> Facets:
        assert self.below is not None
        films = self.films and self.films.reversed()
        return Facets(self.below, self.above, None, self.alpha_u, self.alpha_v, self.rotation, False, films)

    def reflectance(self, cosine: Array) -> Array:
        """Fresnel reflectance (C, ...) of facets."""
        if self.below is None:
            return np.ones((1, *np.shape(cosine)))
        if self.k is None:
            return np.asarray(dielectric_between(self.films, *self._between(cosine)))
        shape = (-1, *(1,) * np.ndim(cosine))
        eta = (self.below / self.above).reshape(shape)
        if self.films is not None:
            return np.asarray(self.films.at(cosine, eta))
        return np.asarray(fresnel.conductor(cosine, eta, (self.k / self.above).reshape(shape)))

    def passing(self, cosine: Array) -> Array:
        """Share (C, ...) of light that facets let pass."""
        if self.opaque:
            return np.zeros((1, *np.shape(cosine)))
        return np.asarray(dielectric_passing(self.films, *self._between(cosine)))

    def shares(self, cosine: Array, outside: Array | np.bool_ = np.True_) -> tuple[Array, Array]:
        """Shares (C, ...) of light that facets reflect, and let pass; with films also of light from below, where it is
        not `outside`."""
        if self.films is None or self.opaque:
            return self.reflectance(cosine), self.passing(cosine)
        return self.films.shares(outside, *self._between(cosine, outside))

    def _between(self, cosine: Array, outside: Array | np.bool_ = np.True_) -> tuple[Array, Array, Array]:
        """Cosines on both sides of a facet of a dielectric, and the relative index by colour."""
        assert self.below is not None
        n12 = float(ops.mean(self.below) / ops.mean(self.above))
        cos_t = fresnel.cos_transmitted(cosine, np.where(outside, n12, 1 / n12))
        return cosine, np.asarray(cos_t), (self.below / self.above).reshape(-1, *(1,) * np.ndim(cosine))


class Light(NamedTuple):
    """Samples of light: components of their momentum, and weights."""

    x: Value
    y: Value
    weights: Sequence[Value]


#: Of sources (p, psi), samples of a lattice and numbers: light, and values that are summed up
Scatter = Callable[[Sequence[Value], Sequence[Value], Sequence[Value]], tuple[Sequence[Light], Sequence[Value]]]


@dataclass(frozen=True)
class FirstShares:
    """Shares (C, sources) of light at first events: reflected (`kept`), refracted (`passed`), what masking blocks of
    either, and what it would block (1, sources) if all were reflected; and what second events reflect past other facets
    (`second`), and towards them (`third`), 0 where these are not looked at."""

    kept: Array
    passed: Array
    blocked_reflected: Array
    blocked_refracted: Array
    whole: Array
    second: Array
    third: Array

    @classmethod
    def of(cls, facets: Facets, p: Array, samples: int, often: bool, again: bool = False) -> FirstShares:
        """Shares of light of lengths p that meets facets without axes, once or often, by samples."""
        lengths, places = np.unique(p, return_inverse=True)
        events = FirstEvents(facets, (often,), again)

        def totals(*values: Any) -> Found:
            lights, others = events(*values)
            return Found([*(weight for light in lights for weight in light.weights), *others])

        of_lengths = lengths, 0 * lengths
        found, _, _ = compiled.over(totals, of_lengths, fibonacci(samples), events.numbers(samples), kind=events.kind)
        count = events.lights * events.colours
        lights = found[:count, places].reshape(events.lights, events.colours, len(p))
        return cls.beside(facets, [*lights], found[count:, places])

    @classmethod
    def beside(cls, facets: Facets, lights: Sequence[Array], others: Array) -> FirstShares:
        """Shares of the lights of `FirstEvents`, (C, sources) each, and those that it has besides: (L, sources)."""
        first, colours, nothing = facets.outcomes, len(lights[0]), 0 * lights[0]
        kept, passed = (*lights[:first], nothing)[:2]
        *blocked, rest = np.split(others, [colours * (k + 1) for k in range(first)])
        second, twice = (lights[first], rest[1:]) if len(lights) > first else (nothing, nothing)
        reflected, refracted = (*blocked, nothing)[:2]
        return cls(kept, passed, reflected, refracted, rest[:1], second, twice - second)


class _Way(NamedTuple):
    """Light that leaves a facet, as it is seen from its own medium, which lies upside down below the interface: its
    direction of travel, the rank of the facet's height, weights by colour, and the shares of it that others have let
    come to that facet, and that meets no other one."""

    w: Direction
    rank: Value
    weights: Sequence[Value]
    comes: Value
    leaves: Value

    def light(self, n: Value) -> Light:
        """Light that leaves, in a medium of index n."""
        return Light(n * self.w[0], n * self.w[1], [self.comes * self.leaves * weight for weight in self.weights])


@dataclass(frozen=True)
class FirstEvents:
    """First events: light that facets reflect, and refract, weighted for each of the ways to mask it, by colour; and
    the shares of `FirstShares` that the last way blocks.

    `ways` says whether masking is correlated with the height of facets, as what follows needs (Heitz et al. 2016);
    otherwise it is separable. With `again`, there is also the light of second and third events, of what the last way
    blocks, of each outcome of each outcome, reflected ones before refracted ones.
    """

    facets: Facets
    ways: tuple[bool, ...]
    again: bool = False

    @cached_property
    def colours(self) -> int:
        """Channels of reflectances, 1 where all are alike."""
        return len(self.facets.reflectance(np.ones(1)))

    @property
    def lights(self) -> int:
        """How many lights there are: each outcome of each first one, of second events, and of third ones."""
        first = self.facets.outcomes
        return first + (first**2 + first**3 if self.again else 0)

    @property
    def kind(self) -> Hashable:
        """All that is no number, and values of the facets that `numbers` leaves out."""
        facets = self.facets
        others = tuple(value for name, value in vars(facets).items() if name not in NUMBERS)
        return FirstEvents, facets.opaque, facets.below is None, self.colours, self.ways, self.again, others

    def numbers(self, samples: int) -> tuple[Any, ...]:
        """All numbers, and films, as `__call__` reads them."""
        facets, n = self.facets, float(ops.mean(self.facets.above))
        alpha = max(facets.alpha_u, ALPHA_MIN), max(facets.alpha_v, ALPHA_MIN)
        # The same normals from all sides where facets have no axes, with azimuths from the plane of incidence; else
        # about the normal, where light has no side; and with a steady change between
        turns = max(1 - facets.brushed / BRUSHED, 0) / (2 * np.pi)
        eta = 1.0 if facets.opaque or facets.below is None else float(ops.mean(facets.below)) / n
        indices = (np.broadcast_to(x / facets.above, self.colours) for x in (facets.below, facets.k) if x is not None)
        straight = facets.straight(self.ways[-1])
        share = 1 / len(fibonacci(samples)[0])
        found = n, *alpha, turns, eta, straight, share, *np.concatenate([*indices, []])
        return [*map(Number, found)], facets.films

    def __call__(
        self, sources: Sequence[Value], samples: Sequence[Value], numbers: Any
    ) -> tuple[list[Light], list[Value]]:
        """Events of light of momenta of length p at azimuths psi, in the frame of the interface's axes.

        Momenta are of the direction of travel, which a mirror leaves alone.
        """
        (p, psi), (u_1, u_2) = sources, samples
        values, _ = numbers
        n, alpha_u, alpha_v, turns, eta, straight, share, *colours = values
        alpha = alpha_u, alpha_v
        sin = ops.minimum(p / n, SIN_AT_FACETS_MAX)
        # Light comes from wi, and travels to -wi
        wi = -sin * ops.cos(psi), -sin * ops.sin(psi), ops.sqrt(1 - sin * sin)
        turn = turns * psi
        h = ggx.sample_visible(wi, *alpha, u_2 + turn, u_1)
        cosine = ops.minimum(ggx.dot(wi, h), 1.0)
        o, here = ggx.reflect(wi, h), _smith(wi, alpha)
        reflectance, passing = self._divided(cosine, eta, colours)
        kept = [ops.select(o[2] > 0, self._escape(o, here, alpha, often), 0.0) for often in self.ways]
        lights = [Light(n * o[0], n * o[1], [r * share * each for each in kept for r in reflectance])]
        blocked = 1 - kept[-1]
        others = [r * share * blocked for r in reflectance]
        if not self.facets.opaque:
            x, y, z = refraction.refract_at(wi, h, cosine, eta)
            through = []
            for often in self.ways:
                both = self._escape((x, y, z), here, alpha, often, through=True)
                through.append(ops.select(z < 0, both + straight * (1 - both), 0.0))
            below = n * eta
            lights.append(Light(below * x, below * y, [t * share * each for each in through for t in passing]))
            others += [t * share * (1 - through[-1]) for t in passing]
        again, twice = self._later(wi, h, u_2 / share, turn, values) if self.again else ([], [])
        return [*lights, *again], [*others, blocked * share, *twice]

    def _later(
        self, wi: Direction, h: Direction, number: Value, turn: Value, values: Sequence[Value]
    ) -> tuple[list[Light], list[Value]]:
        """Light of second and third events of samples of running numbers, which first meet normals h, by normals that
        turn as the first ones; and all that is reflected twice."""
        n, alpha_u, alpha_v, _, eta, straight, share, *colours = values
        alpha = alpha_u, alpha_v
        u = [number * step - ops.floor(number * step) for step in STEPS]
        sides = [(self, eta, colours)]
        if not self.facets.opaque:
            # What lies below is seen upside down
            sides.append((replace(self, facets=self.facets.reversed()), 1 / eta, [1 / index for index in colours]))
        rank = microsurface.fly((-wi[0], -wi[1], -wi[2]), 1.0, *alpha, u[0])
        first = self._outcomes(wi, h, rank, [share] * self.colours, 1.0, alpha, eta, colours)
        # A share of what is refracted passes all other facets
        met = [way._replace(comes=1 - straight * k) for k, way in enumerate(first)]
        now, each = list(enumerate(met)), []
        for fly, azimuth, height in (u[1:4], u[4:]):
            then = []
            for side, way in now:
                events, *indices = sides[side]
                rank = ops.minimum(microsurface.fly(way.w, way.rank, *alpha, fly * (1 - way.leaves)), 1.0)
                back = -way.w[0], -way.w[1], -way.w[2]
                h = ggx.sample_visible(back, *alpha, azimuth + turn, height)
                outcomes = events._outcomes(back, h, rank, way.weights, way.comes * (1 - way.leaves), alpha, *indices)
                then += [((side + k) % 2, outcome) for k, outcome in enumerate(outcomes)]
            now = then
            each += now
        (_, twice), *others = each
        if self.facets.opaque:
            # Means over heights are known; outcomes of others have the same heights, and so their proportions
            comes, leaves = _reflected_twice(wi, first[0].w, twice.w, alpha)
            twice = twice._replace(comes=comes, leaves=leaves)
        lights = [twice.light(n), *(way.light(n * eta if side else n) for side, way in others)]
        return lights, [twice.comes * weight for weight in twice.weights]

    def _outcomes(
        self,
        wi: Direction,
        h: Direction,
        rank: Value,
        weights: Sequence[Value],
        comes: Value,
        alpha: tuple[Value, Value],
        eta: Value,
        colours: Sequence[Value],
    ) -> list[_Way]:
        """Ways of light that a facet of normal h reflects, and unless it is opaque refracts."""
        cosine = ops.minimum(ggx.dot(wi, h), 1.0)
        reflectance, passing = self._divided(cosine, eta, colours)
        o = ggx.reflect(wi, h)
        ways = [(o, rank, reflectance)]
        if not self.facets.opaque:
            x, y, z = refraction.refract_at(wi, h, cosine, eta)
            ways.append(((x, y, -1 * z), 1 - rank, passing))
        return [
            _Way(w, at, [share * x for share, x in zip(shares, weights)], comes, microsurface.escape(w, at, *alpha))
            for w, at, shares in ways
        ]

    def _divided(self, cosine: Value, eta: Value, colours: Sequence[Value]) -> tuple[list[Value], list[Value]]:
        """Shares that facets reflect, and let pass, by colour."""
        facets, count = self.facets, self.colours
        if facets.films:
            reflectance, passing = facets.shares(cosine)
            return list(reflectance), list(passing)
        if facets.below is None:
            return [1.0], []
        if facets.opaque:
            return [fresnel.conductor(cosine, *index) for index in zip(colours[:count], colours[count:])], []
        cos_t = fresnel.cos_transmitted(cosine, eta)
        found = [fresnel.dielectric_between(cosine, cos_t, index) for index in colours]
        return found, [1 - each for each in found]

    def _escape(
        self, w: Direction, here: Value, alpha: tuple[Value, Value], often: bool, through: bool = False
    ) -> Value:
        """Share of light that leaves towards w, or -w, past other facets."""
        towards = w[0], w[1], ops.absolute(w[2])
        if not often:
            return ggx.masking(towards, *alpha)
        there = _smith(towards, alpha)
        if not through:
            return (1 + here) / (1 + here + there)
        return ops.exp(ops.log_gamma(2 + here) + ops.log_gamma(1 + there) - ops.log_gamma(2 + here + there))


def _smith(w: Direction, alpha: tuple[Value, Value]) -> Value:
    """Smith's Lambda."""
    x, y = alpha[0] * w[0], alpha[1] * w[1]
    z = ops.maximum(w[2], COS_AT_FACETS_MIN * 0.1)
    return 0.5 * (ops.sqrt(1 + (x * x + y * y) / (z * z)) - 1)


def _reflected_twice(
    wi: Direction, first: Direction, second: Direction, alpha: tuple[Value, Value]
) -> tuple[Value, Value]:
    """Shares, means over heights, of light from wi that is reflected towards `first` and meets another facet, and of
    that which then leaves towards `second`.

    From above light meets a facet below a rank r in the share r^a, a = 1 + Lambda(wi). It leaves upwards in the share
    r^b, b = Lambda(first); downwards it goes on to a rank below s in the share (s / r)^b, b = 1 + Lambda(first).
    """
    a, b, c = 1 + _smith(wi, alpha), *(_smith((w[0], w[1], ops.absolute(w[2])), alpha) for w in (first, second))
    up = first[2] > 0
    comes = ops.select(up, b / (a + b), 1.0)
    leaves = ops.select(second[2] > 0, a / (a + c) * ops.select(up, 1.0, (1 + b) / (1 + b + c)), 0.0)
    return comes, leaves


def brushed(alpha_u: Value, alpha_v: Value) -> Value:
    """0 for facets of equal roughnesses, towards 1 for those that are long along an axis, in any dialect."""
    low, high = ops.minimum(alpha_u, alpha_v), ops.maximum(alpha_u, alpha_v)
    return 1 - ops.maximum(low, ALPHA_MIN) / ops.maximum(high, ALPHA_MIN)


def mean_alpha(facets: Facets) -> float:
    return float(np.clip(0.5 * (facets.alpha_u + facets.alpha_v), ALPHA_MIN, 1))


def shares_of_films(facets: Facets, p: Array) -> tuple[Array, Array]:
    """Shares (C, sources) of blocked light of lengths p that films reflect, and let pass, in the end, by walks, since
    no table has them."""
    mean = mean_alpha(facets)
    assert facets.below is not None and facets.films
    # Walk in directions that crowd where shares bend
    places = (np.arange(WALKED) + 0.5) / WALKED
    critical = np.arcsin(float(ops.mean(facets.below) / ops.mean(facets.above))) if facets.is_exit else None

    def walked() -> tuple[Array, Array]:
        eta = None if facets.opaque else float(ops.mean(facets.below) / ops.mean(facets.above))
        cosines = coordinates.to_cosine(places) if critical is None else coordinates.to_angle(places, critical)
        alpha = np.full(WALKED, mean)
        return shares_in_the_end(facets.shares, eta, np.asarray(cosines), alpha, PATHS, facets.straight(True))

    alike = replace(facets, alpha_u=mean, alpha_v=mean, rotation=0.0)
    found = KEPT.once((shares_of_films, alike.key()), walked)
    cosine = np.sqrt(np.maximum(1 - (p / ops.mean(facets.above)) ** 2, 0))
    at = coordinates.from_cosine(cosine) if critical is None else coordinates.from_angle(cosine, critical)
    reflected, passed = (np.array([np.interp(at, places, each) for each in share]) for share in found)
    return reflected, passed
