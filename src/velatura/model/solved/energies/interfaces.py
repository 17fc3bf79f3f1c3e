"""Rough interfaces as operators on light.

Light meets visible normals on a lattice. Where it may meet several facets, what first events do is exact, with masking
correlated to the height; what they block leaves in a way that is reciprocal and loses nothing, in the share that the
tables of multiple scattering say.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops, tables
from velatura.films.reflectance import dielectric_between, dielectric_passing
from velatura.films.tables import Coated
from velatura.model.solved.energies.modes import TINY, Basis, Light
from velatura.model.solved.energies.operators import Layer, Operator
from velatura.ops import Value
from velatura.optics import fresnel, ggx
from velatura.optics.ggx import Direction
from velatura.renderer import compiled
from velatura.renderer.kept import Kept
from velatura.renderer.low_discrepancy import fibonacci
from velatura.stack import InterfaceValues
from velatura.tables import Tables, coordinates
from velatura.tables.microsurface_walks import shares_in_the_end

Array = NDArray[np.floating]
T = TypeVar("T")

# Step of the logarithm of the index that refracted light which meets further facets still passes, where these are met
# often, and where such light is lost
STRAIGHT = {True: 0.09, False: 0.01}
GRAZING = 1e-4  # least cosine of light that meets an interface
LEVEL = float(np.sqrt(1 - GRAZING**2))  # its sine
ALPHA_MIN = 1e-3
KEPT = Kept(64 << 20)  # layers, and what they are made of
BRUSHED = 0.05  # difference of two roughnesses, as share of the larger, from which normals do not turn with the light
DIGITS = 9  # of lengths of momentum that are alike
SWING = 2.6  # how much light of repeated facets goes on in its direction, and how fast that falls as they turn it
OPAQUE = 1.4  # step of the logarithm of the index that turns as much as a reflection
WALKED = 16  # directions of walks between facets with films
PATHS = 2048  # from each
BLOCKED = (0.004, 0.014)  # shares of blocked light below which, and above which, its share comes from the tables


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

    @property
    def opaque(self) -> bool:
        return self.below is None or self.k is not None

    @property
    def is_exit(self) -> bool:
        """Whether it may reflect all light, of a denser medium above."""
        return not self.opaque and self.below is not None and bool(ops.mean(self.below) < ops.mean(self.above))

    @property
    def brushed(self) -> float:
        """0 for isotropic facets, towards 1 for those that are long along an axis."""
        return 1 - min(self.alpha_u, self.alpha_v) / max(self.alpha_u, self.alpha_v, ALPHA_MIN)

    @property
    def is_smooth(self) -> bool:
        """Whether it changes no direction."""
        stepless = not self.opaque and bool((self.above == self.below).all())
        return max(self.alpha_u, self.alpha_v) < ALPHA_MIN or stepless

    @property
    def step(self) -> float:
        """Step of the logarithm of the index, for light that it lets through."""
        if self.below is None or self.opaque:
            return 0.0
        return float(abs(np.log(ops.mean(self.below) / ops.mean(self.above))))

    def straight(self, often: bool) -> float:
        """Share of refracted light that meets further facets and still passes: a small step hardly turns it."""
        return float(np.exp(-self.step / STRAIGHT[often]))

    def smooth(self, p: Array, transmitted: bool) -> Array:
        """Share (C, ...) of light of momenta p that a smooth interface reflects or transmits."""
        n = float(ops.mean(self.above))
        cosine = np.sqrt(np.maximum(1 - (p / n) ** 2, GRAZING**2))
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


@dataclass(frozen=True)
class _Shares:
    """Shares (C, sources) of light at first events: reflected (`kept`), refracted (`passed`), what masking blocks of
    either, and what it would block (1, sources) if all were reflected."""

    kept: Array
    passed: Array
    blocked_reflected: Array
    blocked_refracted: Array
    whole: Array

    @classmethod
    def of(cls, facets: Facets, p: Array, samples: int, often: bool) -> _Shares:
        """Shares of light of lengths p that meets facets without axes, once or often, by samples."""
        lengths, places = np.unique(p, return_inverse=True)
        events = _Events(facets, (often,))

        def totals(*values: Any) -> tuple[list[list[Value]], list[Value]]:
            lights, others = events(*values)
            return [], [*(weight for light in lights for weight in light.weights), *others]

        of_lengths = lengths, 0 * lengths
        _, found = compiled.over(totals, of_lengths, fibonacci(samples), events.numbers(samples))
        kept, others = np.split(found[:, places], [events.colours])
        passed, others = np.split(others, [0 if facets.opaque else events.colours])
        return cls.beside(facets, kept, passed if len(passed) else 0 * kept, others)

    @classmethod
    def beside(cls, facets: Facets, kept: Array, passed: Array, others: Array) -> _Shares:
        """Shares that `_Events` has besides its light: (L, sources)."""
        *blocked, whole = np.split(others, [len(kept), len(others) - 1][: 1 if facets.opaque else 2])
        return cls(kept, passed, blocked[0], 0 * kept if facets.opaque else blocked[1], whole)


@dataclass(frozen=True)
class _Events:
    """First events: light that facets reflect, and refract, weighted for each of the ways to mask it, by colour; and
    the shares of `_Shares` that the last way blocks.

    `ways` says whether masking is correlated with the height of facets, as what follows needs (Heitz et al. 2016);
    otherwise it is separable.
    """

    facets: Facets
    ways: tuple[bool, ...]

    @cached_property
    def colours(self) -> int:
        """Channels of reflectances, 1 where all are alike."""
        return len(self.facets.reflectance(np.ones(1)))

    def numbers(self, samples: int) -> list[Any]:
        """All numbers, and films, as `__call__` reads them."""
        facets, n = self.facets, float(ops.mean(self.facets.above))
        alpha = max(facets.alpha_u, ALPHA_MIN), max(facets.alpha_v, ALPHA_MIN)
        # The same normals from all sides where facets have no axes, with azimuths from the plane of incidence; else
        # about the normal, where light has no side; and with a steady change between
        turns = max(1 - facets.brushed / BRUSHED, 0) / (2 * np.pi)
        eta = 1.0 if facets.opaque or facets.below is None else float(ops.mean(facets.below)) / n
        indices = (np.broadcast_to(x / facets.above, self.colours) for x in (facets.below, facets.k) if x is not None)
        straight = facets.straight(self.ways[-1])
        return [
            n,
            *alpha,
            turns,
            eta,
            straight,
            1 / len(fibonacci(samples)[0]),
            *np.concatenate([*indices, []]),
            facets.films,
        ]

    def __call__(
        self, sources: Sequence[Value], samples: Sequence[Value], numbers: Sequence[Value]
    ) -> tuple[list[Light], list[Value]]:
        """Events of light of momenta of length p at azimuths psi, in the frame of the interface's axes.

        Momenta are of the direction of travel, which a mirror leaves alone.
        """
        (p, psi), (u_1, u_2) = sources, samples
        n, alpha_u, alpha_v, turns, eta, straight, share, *colours, _ = numbers
        alpha = alpha_u, alpha_v
        sin = ops.minimum(p / n, LEVEL)
        # Light comes from wi, and travels to -wi
        wi = -sin * ops.cos(psi), -sin * ops.sin(psi), ops.sqrt(1 - sin * sin)
        h = ggx.sample_visible(wi, *alpha, u_2 + turns * psi, u_1)
        cosine = ops.minimum(ggx.dot(wi, h), 1.0)
        o, here = ggx.reflect(wi, h), _smith(wi, alpha)
        reflectance, passing = self._divided(cosine, eta, colours)
        kept = [ops.select(o[2] > 0, self._escape(o, here, alpha, often), 0.0) for often in self.ways]
        lights = [Light(n * o[0], n * o[1], [r * share * each for each in kept for r in reflectance])]
        blocked = 1 - kept[-1]
        others = [r * share * blocked for r in reflectance]
        if not self.facets.opaque:
            along = cosine / eta - fresnel.cos_transmitted(cosine, eta)
            x, y, z = (along * facing - towards / eta for facing, towards in zip(h, wi))
            through = []
            for often in self.ways:
                both = self._escape((x, y, z), here, alpha, often, through=True)
                through.append(ops.select(z < 0, both + straight * (1 - both), 0.0))
            below = n * eta
            lights.append(Light(below * x, below * y, [t * share * each for each in through for t in passing]))
            others += [t * share * (1 - through[-1]) for t in passing]
        return lights, [*others, blocked * share]

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
    z = ops.maximum(w[2], GRAZING * 0.1)
    return 0.5 * (ops.sqrt(1 + (x * x + y * y) / (z * z)) - 1)


@dataclass(frozen=True)
class Setting:
    """How light is described: its basis, beams of momenta of length p at azimuths phi (M,), and how finely facets are
    sampled. With the tables of multiple scattering facets are met often, else once.
    """

    basis: Basis
    p: Array
    phi: Array
    samples: int
    often: Tables | None = None

    @property
    def ways(self) -> list[bool]:
        """How light is masked, as of `_events`."""
        return [False] if self.often is None else [False, True]

    @property
    def key(self) -> Hashable:
        """All that it is."""
        return self.basis, self.samples, self.often, self.p.tobytes(), self.phi.tobytes()

    def kept(self, key: Hashable, make: Callable[[], T]) -> T:
        """What is made of light in this basis, but for the ends of its nodes, once for all of one key."""
        basis = self.basis
        described = type(basis), *(value for name, value in vars(basis).items() if name != "nodes"), basis.nodes.cells
        return KEPT.once((key, described, self.samples, self.often), make)

    @property
    def dark(self) -> Setting:
        """The setting without beams."""
        return replace(self, p=self.p[:0], phi=self.phi[:0])


def interface(facets: Facets, setting: Setting) -> tuple[Layer, Layer]:
    """An interface as a layer, with facets met once, and as the setting says; what is opaque or final lets nothing
    through, and has no other side."""
    nothing = Operator.nothing(setting.basis.size, len(setting.p))
    if facets.is_smooth:
        r, t = (scaled(partial(facets.smooth, transmitted=side), setting) for side in (False, True))
        if facets.opaque or facets.final:
            t = r_below = t_below = nothing
        else:
            back = facets.reversed()
            r_below, t_below = (scaled(partial(back.smooth, transmitted=side), setting) for side in (False, True))
        smooth = Layer(r, t, r_below, t_below)
        return smooth, smooth
    above = _Side.of(facets, setting)
    if facets.opaque or facets.final:
        once, first = (Layer(r, nothing, nothing, nothing) for r in above.r)
        if not above.blocked:
            return once, once
        return once, replace(first, r=first.r + _again(above.blocked[0], above.blocked[0], facets, setting))
    below = _Side.of(facets.reversed(), setting.dark)
    once, first = (Layer(*each) for each in zip(above.r, above.t, below.r, below.t))
    if not (above.blocked and below.blocked):
        return once, once
    (to_r, to_t), (back_to_r, back_to_t) = above.blocked, below.blocked
    return once, Layer(
        first.r + _again(to_r, to_r, facets, setting),
        first.t + _again(to_t, back_to_t, facets, setting),
        first.r_below + _again(back_to_r, back_to_r, facets, setting),
        first.t_below + _again(back_to_t, to_t, facets, setting),
    )


def scaled(share: Callable[[Array], Array], setting: Setting) -> Operator:
    """An operator that changes no direction, but scales light by shares (C, ...) for lengths of momentum."""
    nodes = setting.basis.diagonal(share(setting.basis.nodes.p))
    return Operator(nodes, np.zeros((1, 1, nodes.shape[-1], len(setting.p))), share(setting.p)[:, None, None])


@dataclass(frozen=True)
class _Blocked:
    """Shares of light that meets further facets, and in the end is reflected, or passes.

    Those of light from the nodes as functionals (C, modes, N), those of beams (C, M); `emitted` is light of one unit
    that leaves in such directions, by reciprocity those in which light is blocked. `sines` are those of the nodes, and
    of beams.
    """

    nodes: Array
    beams: Array
    emitted: Array
    sines: tuple[Array, Array]


@dataclass(frozen=True)
class _Met:
    """First events of all sources: what they reflect and refract, deposited (C, modes, N, sources) for all ways to mask
    light, and their shares."""

    reflected: Array
    refracted: Array | None
    shares: _Shares

    @classmethod
    def of(cls, facets: Facets, p: Array, psi: Array, setting: Setting) -> _Met:
        """Once for interfaces that are alike but for their rotation and the unit of momentum."""
        basis, nodes = setting.basis, setting.basis.nodes
        if facets.alpha_u == facets.alpha_v and (lengths := np.unique(p)).shape < p.shape:
            return cls.of(facets, lengths, 0 * lengths, setting)._around(np.searchsorted(lengths, p), psi, basis)
        momenta = facets.above, facets.below, facets.k, p, nodes.ends
        key = (
            *(None if x is None else np.round(np.asarray(x) / nodes.ends[-1], DIGITS).tobytes() for x in momenta),
            *(facets.alpha_u, facets.alpha_v, facets.final, psi.tobytes()),
            facets.films and facets.films.key,
        )
        return setting.kept(key, lambda: cls._of(facets, p, psi, setting))

    @classmethod
    def _of(cls, facets: Facets, p: Array, psi: Array, setting: Setting) -> _Met:
        events = _Events(facets, tuple(setting.ways))
        lights, others = setting.basis.deposited(events, p, psi, setting.samples, events.numbers(setting.samples))
        # Stencils keep the energy
        totals = [light[-events.colours :, 0].sum(axis=1) for light in lights]
        shares = _Shares.beside(facets, totals[0], 0 * totals[0] if facets.opaque else totals[1], others)
        return cls(lights[0], None if facets.opaque or facets.final else lights[1], shares)

    def _around(self, places: NDArray[np.integer], psi: Array, basis: Basis) -> _Met:
        """The sources of numbers `places`, which isotropic facets met at the azimuth 0, at others."""
        reflected, refracted = (
            None if x is None else basis.around(x[..., places], psi) for x in (self.reflected, self.refracted)
        )
        assert reflected is not None
        return _Met(reflected, refracted, _Shares(*(x[:, places] for x in vars(self.shares).values())))


@dataclass(frozen=True)
class _Side:
    """What becomes of light from one side of an interface at first events, with facets met once, and as the setting
    says; and what the latter block, that in the end is reflected, and that passes.
    """

    r: tuple[Operator, Operator]
    t: tuple[Operator, Operator]
    blocked: tuple[_Blocked, _Blocked] | None

    @classmethod
    def of(cls, facets: Facets, setting: Setting) -> _Side:
        basis, turn = setting.basis, facets.rotation
        along_axes = replace(facets, rotation=0.0)
        p, psi = np.tile(basis.nodes.p, len(basis.azimuths)), np.repeat(basis.azimuths, basis.nodes.count)
        at_nodes = _Met.of(along_axes, p, psi, setting)
        of_beams = _Met.of(along_axes, setting.p, basis.relative(setting.phi, turn), setting)

        def operators(nodes: Array | None, beams: Array | None) -> tuple[Operator, Operator]:
            if nodes is None or beams is None:
                nothing = Operator.nothing(basis.size, len(setting.p))
                return nothing, nothing
            both = basis.operators(nodes, turn), basis.columns(beams, turn)
            found = [Operator.of(*each) for each in zip(*(np.split(x, len(setting.ways)) for x in both))]
            return found[0], found[-1]

        r, t = operators(at_nodes.reflected, of_beams.reflected), operators(at_nodes.refracted, of_beams.refracted)
        if setting.often is None:
            return cls(r, t, None)
        # Of nodes about the index of a medium some may have less than none
        n = float(ops.mean(facets.above))
        weights = np.maximum(basis.nodes.weights(n), 0)
        blocked = []
        sines = np.minimum(basis.nodes.p / n, 1), np.minimum(setting.p / n, 1)
        shares = [_again_shares(facets, setting, q, met.shares) for q, met in ((p, at_nodes), (setting.p, of_beams))]
        for nodes, beams in zip(*shares):
            rows = basis.rows(nodes, turn)
            emitted = rows * weights
            emitted = emitted / np.maximum(emitted[:, :1].sum(-1, keepdims=True), TINY)
            blocked.append(_Blocked(rows, beams, emitted, sines))
        return cls(r, t, (blocked[0], blocked[1]))


def _again(taken: _Blocked, there: _Blocked, facets: Facets, setting: Setting) -> Operator:
    """Light that is blocked at first, and leaves in the directions in which light is blocked `there`: the less facets
    turn it, the more of it goes on as it came."""
    turn = 0.5 * (facets.alpha_u + facets.alpha_v) * (OPAQUE if facets.opaque else facets.step)
    swing = SWING * float(np.exp(-SWING * turn))  # model.md, Eq. 4
    nodes, beams = (
        setting.basis.swung(setting.basis.outer(there.emitted, light), swing, there.sines[0], sines)
        for light, sines in zip((taken.nodes, taken.beams), taken.sines)
    )
    return Operator.of(nodes, beams)


def _again_shares(facets: Facets, setting: Setting, p: Array, events: _Shares) -> tuple[Array, Array]:
    """Shares (C, sources) of light of lengths p that first events block and that in the end is reflected, or passes.

    Of blocked light, it is reflected in the share that an isotropic interface of the mean roughness reflects: by the
    tables over any number of events, less what first events reflect.
    """
    known = setting.often
    assert known is not None
    if facets.below is None:
        return events.whole, np.zeros_like(events.whole)
    blocked: Array = events.whole if facets.opaque else events.blocked_reflected + events.blocked_refracted
    if facets.films is not None:
        reflected, passed = shares_of_films(facets, p)
        return blocked * reflected, blocked * passed
    mean = _mean_alpha(facets)
    cosine = np.sqrt(np.maximum(1 - (p / ops.mean(facets.above)) ** 2, GRAZING**2))
    ratio = (facets.below / facets.above)[:, None]
    if facets.k is None:
        row = tables.dielectric_row(known, ratio, True, True)
    else:
        row = tables.conductor_row(known, ratio, (facets.k / facets.above)[:, None], True, True)
    found = np.asarray(tables.fgd(known, row, cosine, np.full(p.shape, mean)))
    stand_in = events
    if facets.alpha_u != facets.alpha_v:
        stand_in = _Shares.of(replace(facets, alpha_u=mean, alpha_v=mean), p, setting.samples, True)
    often, once = found.reshape(len(stand_in.blocked_reflected), -1), stand_in.kept
    met: Array
    little: Array
    if facets.k is None:
        met = stand_in.blocked_reflected + stand_in.blocked_refracted
        little = np.where(ratio < 1, 0.9, 0.15)
    else:
        met, little = stand_in.whole, often * often
    # Little that is blocked has a share that the tables do not resolve
    seen = np.clip((met - BLOCKED[0]) / (BLOCKED[1] - BLOCKED[0]), 0, 1)
    share = seen * np.clip((often - once) / np.maximum(met, BLOCKED[0]), 0, 1) + (1 - seen) * little
    return blocked * share, np.zeros_like(once) if facets.k is not None else blocked * (1 - share)


def _mean_alpha(facets: Facets) -> float:
    return float(np.clip(0.5 * (facets.alpha_u + facets.alpha_v), ALPHA_MIN, 1))


def shares_of_films(facets: Facets, p: Array) -> tuple[Array, Array]:
    """Shares (C, sources) of blocked light of lengths p that films reflect, and let pass, in the end, by walks, since
    no table has them."""
    mean = _mean_alpha(facets)
    assert facets.below is not None and facets.films
    # Walk in directions that crowd where shares bend
    places = (np.arange(WALKED) + 0.5) / WALKED
    critical = np.arcsin(float(ops.mean(facets.below) / ops.mean(facets.above))) if facets.is_exit else None

    def walked() -> tuple[Array, Array]:
        eta = None if facets.opaque else float(ops.mean(facets.below) / ops.mean(facets.above))
        cosines = coordinates.to_cosine(places) if critical is None else coordinates.to_angle(places, critical)
        alpha = np.full(WALKED, mean)
        return shares_in_the_end(facets.shares, eta, np.asarray(cosines), alpha, PATHS, facets.straight(True))

    numbers = (None if x is None else x.tobytes() for x in (facets.above, facets.below, facets.k))
    found = KEPT.once((shares_of_films, mean, facets.films.key, *numbers), walked)
    cosine = np.sqrt(np.maximum(1 - (p / ops.mean(facets.above)) ** 2, 0))
    at = coordinates.from_cosine(cosine) if critical is None else coordinates.from_angle(cosine, critical)
    reflected, passed = (np.array([np.interp(at, places, each) for each in share]) for share in found)
    return reflected, passed


def of_first_events(facets: Facets, p: Array, samples: int, often: bool) -> tuple[Array, Array, Array]:
    """Shares (C, N) of light of lengths p that facets with films reflect when they are first met, that films of a
    dielectric absorb, and that meets others then."""
    shares = _Shares.of(facets, p, samples, often)
    if facets.opaque:
        return shares.kept, 0 * shares.kept, shares.whole
    blocked = shares.blocked_reflected + shares.blocked_refracted
    return shares.kept, 1 - shares.kept - shares.passed - blocked, blocked
