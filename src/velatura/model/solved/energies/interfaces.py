"""Rough interfaces as operators on light.

Light meets visible normals on a lattice. Where it may meet several facets, what first events do is exact, with masking
correlated to the height; what they block leaves in a way that is reciprocal and loses nothing, in the share that the
tables of multiple scattering say.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops, tables
from velatura.model import fitted
from velatura.model.guards import ALPHA_MIN, COS_AT_FACETS_MIN
from velatura.model.rough_interface import DIGITS, KEPT, Facets, FirstEvents, FirstShares, mean_alpha, shares_of_films
from velatura.model.solved.energies.modes import Basis
from velatura.model.solved.energies.operators import Layer, Operator
from velatura.model.solved.guards import TINY, TRACE
from velatura.renderer.low_discrepancy import fibonacci
from velatura.tables import Tables

Array = NDArray[np.floating]
T = TypeVar("T")

RESOLVED = 50.0  # ratio of two roughnesses beyond which modes do not keep light that glass traps from growing


@dataclass(frozen=True)
class Setting:
    """How light is described: its basis, beams of momenta of length p at azimuths phi (M,), and how finely facets are
    sampled. With the tables of multiple scattering facets are met often, else once. `events` says that the shape of
    light in media counts, not its energies alone.
    """

    basis: Basis
    p: Array
    phi: Array
    samples: int
    often: Tables | None = None
    events: bool = False

    @property
    def ways(self) -> list[bool]:
        """How light is masked, as of `_events`."""
        return [False] if self.often is None else [False, True]

    @property
    def key(self) -> Hashable:
        """All that it is."""
        return self.basis, self.samples, self.often, self.events, self.p.tobytes(), self.phi.tobytes()

    def kept(self, key: Hashable, make: Callable[[], T]) -> T:
        """A result for light in this basis, regardless of the ends of its nodes, made once for all of one key."""
        return KEPT.once((key, type(self.basis), self.basis.deposits, self.samples, self.often), make)

    @property
    def symmetric(self) -> Setting:
        """The setting for layers that look alike all around."""
        return replace(self, basis=self.basis.symmetric, phi=0 * self.phi)

    @property
    def dark(self) -> Setting:
        """The setting without beams."""
        return replace(self, p=self.p[:0], phi=self.phi[:0])


def interface(facets: Facets, setting: Setting) -> tuple[Layer, Layer]:
    """An interface as a layer, with facets met once, and as the setting says; what is opaque or final lets nothing
    through, and has no other side."""
    if not facets.smooth:
        return _rough(facets, setting)
    smooth = _smooth(facets, setting)
    if facets.smooth == 1:
        return smooth, smooth
    once, often = (each.mixed(smooth, facets.smooth) for each in _rough(facets, setting))
    return once, often


def _smooth(facets: Facets, setting: Setting) -> Layer:
    r, t = (scaled(partial(facets.share, transmitted=side), setting) for side in (False, True))
    if facets.opaque or facets.final:
        nothing = Operator.nothing(setting.basis.size, len(setting.p))
        return Layer(r, nothing, nothing, nothing)
    back = facets.reversed()
    return Layer(r, t, *(scaled(partial(back.share, transmitted=side), setting) for side in (False, True)))


def _rough(facets: Facets, setting: Setting) -> tuple[Layer, Layer]:
    # Light is not in beams any more below what is rough as a whole
    behind = setting if facets.smooth else setting.dark
    least = max(ALPHA_MIN, max(facets.alpha_u, facets.alpha_v) / RESOLVED)
    facets = replace(facets, alpha_u=max(facets.alpha_u, least), alpha_v=max(facets.alpha_v, least))
    nothing = Operator.nothing(setting.basis.size, len(setting.p))
    above = _Side.of(facets, setting)
    if facets.opaque or facets.final:
        once, first = (Layer(r, nothing, nothing, nothing) for r in above.r)
        if not above.blocked:
            return once, once
        to_r = above.blocked[0]
        return once, replace(first, r=first.r + _again(to_r, to_r, above.second[:1], facets, setting))
    below = _Side.of(facets.reversed(), behind)
    once, first = (Layer(*each) for each in zip(above.r, above.t, below.r, below.t))
    if not (above.blocked and below.blocked):
        return once, once
    (to_r, to_t), (back_to_r, back_to_t) = above.blocked, below.blocked
    return once, Layer(
        first.r + _again(to_r, to_r, above.second[:1], facets, setting),
        first.t + _again(to_t, back_to_t, above.second[1:], facets, setting),
        first.r_below + _again(back_to_r, back_to_r, below.second[:1], facets, setting),
        first.t_below + _again(back_to_t, to_t, below.second[1:], facets, setting),
    )


def scaled(share: Callable[[Array], Array], setting: Setting) -> Operator:
    """An operator that changes no direction, but scales light by shares (C, ...) for lengths of momentum."""
    nodes = setting.basis.diagonal(share(setting.basis.nodes.p))
    return Operator(nodes, np.zeros((1, 1, nodes.rows, len(setting.p))), share(setting.p)[:, None, None])


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
    light, and their shares; and of brushed interfaces what second events reflect, and let pass."""

    reflected: Array
    refracted: Array | None
    shares: FirstShares
    second: tuple[Array, ...] = ()

    @classmethod
    def of(cls, facets: Facets, p: Array, psi: Array, setting: Setting) -> _Met:
        """Once for interfaces that are alike but for their rotation and the unit of momentum."""
        nodes = setting.basis.nodes
        if facets.alpha_u == facets.alpha_v and (lengths := np.unique(p)).shape < p.shape:
            return cls.of(facets, lengths, 0 * lengths, setting)._of_some(np.searchsorted(lengths, p))
        unit = nodes.ends[-1]
        momenta = (np.round(np.asarray(x) / unit, DIGITS).tobytes() for x in (p, nodes.ends))
        key = facets.key(unit), *momenta, psi.tobytes()
        return setting.kept(key, lambda: cls._of(facets, p, psi, setting))

    @classmethod
    def of_each(cls, facets: Facets, sources: Sequence[tuple[Array, Array]], setting: Setting) -> list[_Met]:
        """First events of groups of sources (p, psi), at once where none depends on the axes of the facets."""
        if facets.alpha_u != facets.alpha_v:
            return [cls.of(facets, *each, setting) for each in sources]
        p, psi = map(np.concatenate, zip(*sources))
        met, ends = cls.of(facets, p, psi, setting), np.cumsum([len(each) for each, _ in sources])
        return [met._of_some(slice(end - len(each), end)) for end, (each, _) in zip(ends, sources)]

    @classmethod
    def _of(cls, facets: Facets, p: Array, psi: Array, setting: Setting) -> _Met:
        again = max(facets.across, facets.onward) > 0 and setting.often is not None
        events = FirstEvents(facets, tuple(setting.ways), again)
        lights, others = setting.basis.deposited(
            events, p, psi, fibonacci(setting.samples), events.numbers(setting.samples), events.kind
        )
        # Stencils keep the energy
        totals = [light[-events.colours :, 0].sum(axis=1) for light in lights]
        shares = FirstShares.beside(facets, totals, others)
        lights, second = lights[: facets.outcomes], lights[facets.outcomes :]
        if len(second) > 1:
            # Light that is reflected inside passes
            second = [second[0] + second[3], second[1] + second[2]]
        return cls(lights[0], None if facets.opaque or facets.final else lights[1], shares, tuple(second))

    def _of_some(self, sources: slice | NDArray[np.integer]) -> _Met:
        """Some of the sources of isotropic facets."""
        refracted = None if self.refracted is None else self.refracted[..., sources]
        shares = FirstShares(*(x[:, sources] for x in vars(self.shares).values()))
        return _Met(self.reflected[..., sources], refracted, shares, tuple(x[..., sources] for x in self.second))


@dataclass(frozen=True)
class _Side:
    """Light from one side of an interface after first events, with facets met once, and as the setting says; what the
    latter block, that in the end is reflected, and that passes; and of brushed interfaces both with the directions of
    `second` events.
    """

    r: tuple[Operator, Operator]
    t: tuple[Operator, Operator]
    blocked: tuple[_Blocked, _Blocked] | None
    second: tuple[Operator, ...] = ()

    @classmethod
    def of(cls, facets: Facets, setting: Setting) -> _Side:
        basis = setting.basis
        turn = 0.0 if facets.alpha_u == facets.alpha_v else facets.rotation
        along_axes = replace(facets, rotation=0.0)
        p, psi = np.tile(basis.nodes.p, len(basis.azimuths)), np.repeat(basis.azimuths, basis.nodes.count)
        sources = (p, psi), (setting.p, basis.relative(setting.phi, turn))
        at_nodes, of_beams = _Met.of_each(along_axes, sources, setting)

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
        second = []
        for lights, of in zip(zip(at_nodes.second, of_beams.second), zip(*shares)):
            # A trace leaves evenly, for sources of which second events reflect, or let pass, nothing
            even = TRACE * basis.rows(np.ones_like(of[0]), 0.0)[..., None] * weights[:, None] / weights.sum()
            nodes, beams = (
                (light + even) * (share / (light + even)[:, 0].sum(axis=1))[:, None, None]
                for light, share in zip(lights, of)
            )
            second.append(Operator.of(basis.operators(nodes, turn), basis.columns(beams, turn)))
        return cls(r, t, (blocked[0], blocked[1]), tuple(second))


def _again(taken: _Blocked, there: _Blocked, second: Sequence[Operator], facets: Facets, setting: Setting) -> Operator:
    """Light that is blocked at first, and leaves in the directions in which light is blocked `there`: the less facets
    turn it, the more of it goes on as it came. Brushed ones, which keep its momentum along them, send what they reflect
    where their `second` events do, and a share of what passes; rough ones a share of what passes."""
    exact = facets.across if there is taken else max(fitted.PASSED_ON * facets.across, facets.onward)
    if exact == 1:
        return second[0]
    turn = 0.5 * (facets.alpha_u + facets.alpha_v) * (fitted.OPAQUE_STEP if facets.opaque else facets.step)
    swing = fitted.SWING * float(np.exp(-fitted.SWING * turn))  # model.md, Eq. 4
    nodes, beams = (
        setting.basis.swung(setting.basis.outer(there.emitted, light), swing, there.sines[0], sines, phi)
        for light, sines, phi in zip(
            (taken.nodes, taken.beams), taken.sines, (None, setting.phi[: len(taken.sines[1])])
        )
    )
    even = Operator.of(nodes, beams)
    return exact * second[0] + (1 - exact) * even if exact else even


def _again_shares(facets: Facets, setting: Setting, p: Array, events: FirstShares) -> tuple[Array, Array]:
    """Shares (C, sources) of light of lengths p that first events block and that in the end is reflected, or passes.

    Of blocked light, isotropic interfaces reflect what the tables have over any number of events, less what first
    events reflect. Brushed ones stand beside isotropic ones of their mean roughness, and the more they are brushed, of
    their greater one, since they block light across it.
    """
    known = setting.often
    assert known is not None
    if facets.below is None:
        return events.whole, np.zeros_like(events.whole)
    blocked: Array = events.whole if facets.opaque else events.blocked_reflected + events.blocked_refracted
    if facets.films is not None:
        reflected, passed = shares_of_films(facets, p)
        return blocked * reflected, blocked * passed
    across = facets.across
    alpha = (1 - across) * mean_alpha(facets) + across * max(facets.alpha_u, facets.alpha_v, ALPHA_MIN)
    cosine = np.sqrt(np.maximum(1 - (p / ops.mean(facets.above)) ** 2, COS_AT_FACETS_MIN**2))
    ratio = (facets.below / facets.above)[:, None]
    if facets.k is None:
        row = tables.dielectric_row(known, ratio, True, True)
    else:
        row = tables.conductor_row(known, ratio, (facets.k / facets.above)[:, None], True, True)
    found = np.asarray(tables.fgd(known, row, cosine, np.full(p.shape, alpha)))
    stand_in = events
    if across:
        isotropic = replace(facets, alpha_u=alpha, alpha_v=alpha)
        stand_in = FirstShares.of(isotropic, p, setting.samples, True, again=True)
    often, once = found.reshape(len(stand_in.blocked_reflected), -1), stand_in.kept
    met: Array
    little: Array
    if facets.k is None:
        met = stand_in.blocked_reflected + stand_in.blocked_refracted
        little = np.where(ratio < 1, *fitted.BLOCKED_IN_THE_END)
    else:
        met, little = stand_in.whole, often * often
    # Little that is blocked has a share that the tables do not resolve
    seen = np.clip((met - fitted.BLOCKED[0]) / (fitted.BLOCKED[1] - fitted.BLOCKED[0]), 0, 1)
    share = seen * np.clip((often - once) / np.maximum(met, fitted.BLOCKED[0]), 0, 1) + (1 - seen) * little
    reflected = blocked * share
    if across:
        twice = np.clip(_reflected_again(events, stand_in, met * share), 0, blocked)
        reflected = (1 - across) * reflected + across * twice
    return reflected, np.zeros_like(once) if facets.k is not None else blocked - reflected


def _reflected_again(brushed: FirstShares, isotropic: FirstShares, known: Array) -> Array:
    """Share of light that brushed facets block at first and reflect in the end: what second events reflect, and of what
    goes on from there as much as isotropic facets reflect, of which it is `known`."""

    def on(events: FirstShares) -> Array:
        return np.asarray(events.third + events.blocked_refracted)

    more = (known - isotropic.second) / np.maximum(on(isotropic), fitted.BLOCKED[0])
    return np.asarray(brushed.second + more * on(brushed))
