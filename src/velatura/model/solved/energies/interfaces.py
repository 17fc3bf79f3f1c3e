"""Rough interfaces as operators on light.

Light meets visible normals on a lattice. Where it may meet several facets, what first events do is exact, with masking
correlated to the height; what they block leaves in a way that is reciprocal and loses nothing, in the share that the
tables of multiple scattering say.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops, tables
from velatura.model import fitted
from velatura.model.guards import ALPHA_MIN, COS_AT_FACETS_MIN
from velatura.model.rough_interface import (
    KEPT,
    Facets,
    FirstEvents,
    FirstShares,
    in_units,
    mean_alpha,
    shares_of_films,
)
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
    def unit(self) -> float:
        """The greatest momentum of light: what layers do depends on multiples of it alone."""
        return self.basis.nodes.ends[-1]

    @property
    def key(self) -> Hashable:
        """All that it is, but for the unit."""
        basis, ends, p = self.basis, in_units(self.basis.nodes.ends, self.unit), in_units(self.p, self.unit)
        light = type(basis), basis.deposits, basis.azimuths.tobytes(), ends, p, self.phi.tobytes()
        return *light, self.samples, self.often, self.events

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
    """An interface as a layer without beams, with facets met once, and as the setting says; what is opaque or final
    lets nothing through, and has no other side."""
    if facets.smooth == 1:
        smooth = _smooth(facets, setting)
        return smooth, smooth
    nothing, both = Operator.nothing(setting.basis.size, 0), _sides(facets)
    met = [_Met.of_each(side, _sources(side, setting), setting)[0] for side in both]
    blocked = _blocked(both, setting)
    sides = [_outcomes(side, at, blocked[::turned], setting) for side, at, turned in zip(both, met, (1, -1))]

    def layer(way: int) -> Layer:
        made = [Operator.of(matrix, nothing.columns) for side in sides for matrix in side[way]]
        found = Layer(*made, *[nothing] * (4 - len(made)))
        return found.mixed(_smooth(facets, setting), facets.smooth) if facets.smooth else found

    once = layer(0)
    return once, layer(1) if setting.often else once


def lit(facets: Facets, setting: Setting, dark: Callable[[], tuple[Layer, Layer]]) -> tuple[Layer, Layer]:
    """The same with the beams of the setting, given what it is without."""
    smooth = _smooth(facets, setting) if facets.smooth else None
    if smooth and facets.smooth == 1:
        return smooth, smooth
    # Light is not in beams any more below what is rough as a whole
    both = _sides(facets)
    reached = both[: 2 if smooth else 1]
    met = [_Met.of_each(side, _sources(side, setting), setting)[1] for side in reached]
    blocked = _blocked(both, setting)
    sides = [_outcomes(side, at, blocked[::turned], setting, True) for side, at, turned in zip(reached, met, (1, -1))]

    def layer(way: int, made: Layer) -> Layer:
        found = [*vars(made).values()]
        if len(both) == 1:
            found[1:] = [Operator.nothing(setting.basis.size, len(setting.p))] * 3
        for k, columns in enumerate(columns for side in sides for columns in side[way]):
            found[k] = Operator.of(found[k].nodes, columns)
            if smooth:
                straight = [*vars(smooth).values()][k].beams
                found[k] = replace(found[k], columns=(1 - facets.smooth) * columns, beams=facets.smooth * straight)
        return Layer(*found)

    once, often = dark()
    first = layer(0, once)
    return first, first if often is once else layer(1, often)


def _sides(facets: Facets) -> list[Facets]:
    """Facets as light from above meets them, and unless nothing passes, from below, no longer than modes resolve."""
    least = max(ALPHA_MIN, max(facets.alpha_u, facets.alpha_v) / RESOLVED)
    resolved = replace(facets, alpha_u=max(facets.alpha_u, least), alpha_v=max(facets.alpha_v, least))
    return [resolved] if facets.opaque or facets.final else [resolved, resolved.reversed()]


def _smooth(facets: Facets, setting: Setting) -> Layer:
    r, t = (scaled(partial(facets.share, transmitted=side), setting) for side in (False, True))
    if facets.opaque or facets.final:
        nothing = Operator.nothing(setting.basis.size, len(setting.p))
        return Layer(r, nothing, nothing, nothing)
    back = facets.reversed()
    return Layer(r, t, *(scaled(partial(back.share, transmitted=side), setting) for side in (False, True)))


def scaled(share: Callable[[Array], Array], setting: Setting) -> Operator:
    """An operator that changes no direction, but scales light by shares (C, ...) for lengths of momentum."""
    nodes = setting.basis.diagonal(share(setting.basis.nodes.p))
    return Operator(nodes, np.zeros((1, 1, nodes.rows, len(setting.p))), share(setting.p)[:, None, None])


@dataclass(frozen=True)
class _Met:
    """First events of all sources: what they reflect and refract, deposited (C, modes, N, sources) for all ways to mask
    light, and their shares; and of interfaces whose later events are looked at what these reflect, and let pass."""

    reflected: Array
    refracted: Array | None
    shares: FirstShares
    later: tuple[Array, ...] = ()

    @classmethod
    def of_each(cls, facets: Facets, sources: Sequence[tuple[Array, Array]], setting: Setting) -> list[_Met]:
        """First events of groups of sources (p, psi), once for interfaces that are alike but for their rotation and the
        unit of momentum; all that are not known at once where none depends on the axes of the facets."""
        facets, unit = replace(facets, rotation=0.0), setting.unit
        own = facets.key(unit), in_units(setting.basis.nodes.ends, unit)

        def kept(p: Array, psi: Array, make: Callable[[], _Met]) -> _Met:
            return setting.kept((*own, in_units(p, unit), psi.tobytes()), make)

        if facets.alpha_u != facets.alpha_v:
            return [kept(p, psi, partial(cls._of, facets, p, psi, setting)) for p, psi in sources]
        each = [np.unique(p, return_inverse=True) for p, _ in sources]
        every = np.concatenate([lengths for lengths, _ in each])
        together = functools.cache(lambda: cls._of(facets, every, 0 * every, setting))
        found, end = [], 0
        for (p, _), (lengths, places) in zip(sources, each):
            these, end = slice(end, end + len(lengths)), end + len(lengths)
            some = kept(lengths, 0 * lengths, partial(lambda these: together()._of_some(these), these))
            found.append(some if np.array_equal(lengths, p) else some._of_some(places))
        return found

    @classmethod
    def _of(cls, facets: Facets, p: Array, psi: Array, setting: Setting) -> _Met:
        again = max(facets.across, facets.onward) > 0 and setting.often is not None
        events, samples = FirstEvents(facets, tuple(setting.ways), again), setting.samples
        lights, others = setting.basis.deposited(
            events, p, psi, fibonacci(samples), events.numbers(samples), events.kind
        )
        # Stencils keep the energy
        totals = [light[-events.colours :, 0].sum(axis=1) for light in lights]
        shares = FirstShares.beside(facets, totals, others)
        lights, later = lights[: facets.outcomes], lights[facets.outcomes :]
        sides: list[Any] = [0.0] * (facets.outcomes if again else 0)
        for number, light in enumerate(later):
            # What an even number of facets refracts leaves above
            path = number if number < facets.outcomes**2 else number - facets.outcomes**2
            sides[path.bit_count() % 2 if facets.outcomes > 1 else 0] += light
        return cls(lights[0], None if facets.opaque or facets.final else lights[1], shares, tuple(sides))

    def _of_some(self, sources: slice | NDArray[np.integer]) -> _Met:
        """Some of the sources of isotropic facets."""
        refracted = None if self.refracted is None else self.refracted[..., sources]
        shares = FirstShares(*(x[:, sources] for x in vars(self.shares).values()))
        return _Met(self.reflected[..., sources], refracted, shares, tuple(x[..., sources] for x in self.later))


class _Blocked(NamedTuple):
    """Shares (C, sources) of light from the nodes that first events block and that in the end is reflected, or passes;
    light (C, modes, N) of one unit that leaves in such directions, by reciprocity those in which light is blocked; and
    sines of the nodes."""

    shares: tuple[Array, Array]
    emitted: Sequence[Array]
    sines: Array

    @classmethod
    def of(cls, facets: Facets, setting: Setting) -> _Blocked:
        basis, (source, *_) = setting.basis, _sources(facets, setting)
        met = _Met.of_each(facets, [source], setting)[0]
        shares = _again_shares(facets, setting, source[0], met.shares)
        # Of nodes about the index of a medium some may have less than none
        weights = np.maximum(basis.nodes.weights(float(ops.mean(facets.above))), 0)
        emitted = [basis.rows(share, _turn(facets)) * weights for share in shares]
        emitted = [each / np.maximum(each[:, :1].sum(-1, keepdims=True), TINY) for each in emitted]
        return cls(shares, emitted, _sines(facets, basis.nodes.p))


def _blocked(sides: Sequence[Facets], setting: Setting) -> list[_Blocked]:
    """Light that each side blocks, where facets are met often; kept for the same facets with other beams."""
    if setting.often is None:
        return []
    key = setting.dark.key
    return [KEPT.once((_Blocked, side.key(setting.unit), key), partial(_Blocked.of, side, setting)) for side in sides]


def _sources(facets: Facets, setting: Setting) -> list[tuple[Array, Array]]:
    """Lengths of momentum and azimuths from the axes of facets: of light from the nodes, and of beams if there are
    any."""
    basis = setting.basis
    at_nodes = np.tile(basis.nodes.p, len(basis.azimuths)), np.repeat(basis.azimuths, basis.nodes.count)
    return [at_nodes, (setting.p, basis.relative(setting.phi, _turn(facets)))][: 2 if len(setting.p) else 1]


def _turn(facets: Facets) -> float:
    return 0.0 if facets.alpha_u == facets.alpha_v else facets.rotation


def _outcomes(
    facets: Facets, met: _Met, blocked: Sequence[_Blocked], setting: Setting, beams: bool = False
) -> tuple[list[Array], list[Array]]:
    """Light that facets reflect and, unless nothing passes, let pass, with facets met once, and as the setting says:
    matrices of light from the nodes, or columns of beams; `blocked` is that of both sides."""
    basis, turn = setting.basis, _turn(facets)
    project = partial(basis.columns if beams else basis.operators, rotation=turn)
    lights = [light for light in (met.reflected, met.refracted) if light is not None]
    ways = [np.split(project(light), len(setting.ways)) for light in lights]
    once, first = [each[0] for each in ways], [each[-1] for each in ways]
    if not blocked:
        return once, once
    own, phi = blocked[0], setting.phi if beams else None
    shares = _again_shares(facets, setting, setting.p, met.shares) if beams else own.shares
    sines = _sines(facets, setting.p) if beams else own.sines
    often = []
    for k, (light, share) in enumerate(zip(first, shares)):
        # Rough dielectrics, and brushed interfaces, which keep the momentum of light along them, send it where second
        # and third events do. The less others turn light that is blocked, the more of it goes on as it came
        exact = max(facets.across, facets.onward)
        if exact:
            light = light + exact * project(_later(facets, setting, met.later[k], share))
        if exact < 1:
            # It leaves in the directions in which light is blocked there
            there = blocked[1] if k else own
            even = basis.outer(there.emitted[k], share if beams else basis.rows(share, turn))
            even = basis.swung(even, _swing(facets), there.sines, sines, phi)
            light = light + (1 - exact) * even
        often.append(light)
    return once, often


def _sines(facets: Facets, p: Array) -> Array:
    return np.asarray(np.minimum(p / float(ops.mean(facets.above)), 1))


def _swing(facets: Facets) -> float:
    """How much of the light that is blocked at first goes on as it came."""
    turn = 0.5 * (facets.alpha_u + facets.alpha_v) * (fitted.OPAQUE_STEP if facets.opaque else facets.step)
    return fitted.SWING * float(np.exp(-fitted.SWING * turn))  # model.md, Eq. 4


def _later(facets: Facets, setting: Setting, light: Array, share: Array) -> Array:
    """Light of later events, of which sources have a share (C, sources)."""
    basis = setting.basis
    weights = np.maximum(basis.nodes.weights(float(ops.mean(facets.above))), 0)
    # A trace leaves evenly, for sources of which later events reflect, or let pass, nothing
    sources = np.ones((len(share), len(basis.azimuths) * basis.nodes.count))
    light = light + TRACE * basis.rows(sources, 0.0)[..., None] * weights[:, None] / weights.sum()
    return np.asarray(light * (share / light[:, 0].sum(axis=1))[:, None, None])


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
