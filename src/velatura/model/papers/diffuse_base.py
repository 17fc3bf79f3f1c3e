"""A diffuse base under a stack: light that enters, scatters there, and leaves, between bounces below the interfaces.

Light in the stack is followed by its parts in a few directions (`tables.diffuse_nodes`). The importance of a node, that
is the share of its light that reaches the base, follows from what the interfaces make of it, by sweeps up and down the
stack. That is done once for a material; the importance of a direction is then the sum of its parts.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from velatura import ops, tables
from velatura.films.reflectance import Films
from velatura.model.context import as_it_is
from velatura.model.papers import operators
from velatura.model.papers.guards import TRANSMITTANCE_MIN
from velatura.model.papers.prepare import Prepared, PreparedInterface, PreparedMedium
from velatura.ops import Value
from velatura.optics import fresnel, phase
from velatura.optics.ggx import Direction
from velatura.tables import Tables, diffuse_nodes

Settle = Callable[[Value], Value]
Row = Sequence[Value]  # of values at the nodes of a medium
Media = Sequence[tuple[PreparedMedium, Value]]  # with their optical depths along the normal

SWEEPS = 6  # down the stack and up; what is missing then follows from how fast they converge
SLOWEST = 0.95  # ratio of the last two sweeps
# Bounds of the importance of a node, and of what leaves of it: more, of cones that nodes do not resolve, grows
MOST_IMPORTANT, LEAVING = 10.0, 3.0

# Cosines and weights of the mean over directions above; what the stack does is smooth in the cosine
_NODES = [(0.5 + 0.5 * float(x), 0.5 * float(w)) for x, w in zip(*np.polynomial.legendre.leggauss(6))]


@dataclass(frozen=True)
class Base:
    """The diffuse part of a BSDF for one direction wi: f = scale T(wo), T being the share of light that gets through.

    `energy` is its albedo, a colour.
    """

    prepared: Prepared
    scale: Value
    energy: Value

    def value(self, wo: Direction) -> Value:
        """f(wi, wo), a colour, without the cosine."""
        return self.scale * self.through(wo)

    def through(self, w: Direction) -> Value:
        """T, a colour: what gets through to the base of light from w."""
        return _through(self.prepared, w)


def under(prepared: Prepared, wi: Direction) -> Base | None:
    """The diffuse part for a direction; None without a diffuse base."""
    base = prepared.base
    if base is None:
        return None
    through = _through(prepared, wi)
    reflected = through * base.albedo / ops.maximum(1 - base.albedo * base.mean_reflectance, ops.TINY)
    scale = reflected / (base.n * base.n * pi)
    return Base(prepared, scale, reflected * base.mean_transmittance)


def with_means(prepared: Prepared, settle: Settle = as_it_is) -> Prepared:
    """`prepared` with what the stack does to diffuse light from the base, and the importance of its nodes.

    `settle` is applied to every cosine, row and energy: a renderer evaluates them, so that one kernel serves all nodes.
    """
    if prepared.base is None:
        return prepared
    inside, nodes = _Inside.of(prepared), [node for node, _ in _NODES]
    measures = [2 * weight * node for node, weight in _NODES]

    def lit(node: Value, n: Value) -> Direction:
        return _halfway(settle(node + 0 * n), inside.interfaces)

    importance: Row = ()
    reflected: Value = 0.0
    if inside.interfaces:
        with ops.block("By reciprocity, light leaves as it enters"):
            entered = ops.each(lambda node, n: settle(_entered(prepared, lit(node, n))), nodes, prepared.base.n)
            nodes_below = range(diffuse_nodes.COUNT)
            leaves = [_sum(measure * row[k] for measure, row in zip(measures, entered)) for k in nodes_below]
            even = diffuse_nodes.even(inside.indices[0])
            squared = inside.indices[0] * inside.indices[0]
            leaves = [ops.minimum(ops.divide(x, squared * w), LEAVING) for x, w in zip(leaves, even)]
        importance, reflected = inside.solved(leaves, settle)
    base = dataclasses.replace(prepared.base, importance=tuple(importance), mean_reflectance=reflected)
    known = dataclasses.replace(prepared, base=base)
    through = ops.each(lambda node, n: settle(_through(known, lit(node, n))), nodes, base.n)
    transmitted = _sum(measure * t for measure, t in zip(measures, through)) / (base.n * base.n)
    return dataclasses.replace(known, base=dataclasses.replace(base, mean_transmittance=transmitted))


def _through(prepared: Prepared, wi: Direction) -> Value:
    """Share of light from wi that reaches the base, before it scatters there."""
    assert prepared.base is not None
    inside = _Inside.of(prepared)
    kept = _passed(inside.media_above, wi[2])
    if not inside.interfaces:
        return kept
    # Parts may be negative, and so may their sum be by a little where next to nothing enters
    return kept * ops.clip(_sum(a * b for a, b in zip(_entered(prepared, wi), prepared.base.importance)), 0.0, 1.0)


def _entered(prepared: Prepared, wi: Direction) -> Row:
    """Parts of light from wi that pass the first interface."""
    layer = next(layer for layer in prepared.layers if isinstance(layer, PreparedInterface))
    cosine, alpha = operators.fetched(prepared, layer.roughness, wi[2], wi)
    r = ops.clip(operators.reflectance(prepared, layer, wi[2], layer.roughness, wi), 0.0, 1.0)
    if layer.absorbed is not None:
        r = r + ops.clip(layer.absorbed(cosine, alpha), 0.0, 1 - r)
    return [(1 - r) * x for x in diffuse_nodes.entering(prepared.tables, cosine, alpha, layer.n12)]


@dataclass(frozen=True)
class _Inside:
    """A stack as diffuse light sees it: its interfaces, and what is below each, by index and media with their optical
    depths."""

    tables: Tables
    media_above: Media
    interfaces: Sequence[PreparedInterface]
    indices: Sequence[Value]
    media: Sequence[Media]

    @classmethod
    def of(cls, prepared: Prepared) -> _Inside:
        interfaces: list[PreparedInterface] = []
        indices: list[Value] = [1.0]
        media: list[list[tuple[PreparedMedium, Value]]] = [[]]
        for layer in prepared.layers:
            if isinstance(layer, PreparedMedium):
                media[-1].append((layer, layer.tau - layer.tau_s * phase.forwards(layer.g)))
            else:
                interfaces.append(layer)
                indices.append(indices[-1] * layer.n12)
                media.append([])
        return cls(prepared.tables, media[0], interfaces, indices[1:], media[1:])

    def solved(self, leaves: Row, settle: Settle) -> tuple[Row, Value]:
        """Importance of the nodes below the first interface, and the share of diffuse light that returns to the base.

        `leaves` is what leaves the stack of the light at each of these nodes.
        """
        below = zip(self.indices, self.media)
        kept = [[_passed(media, c) for c in diffuse_nodes.node_cosines(n)] for n, media in below]
        exchanges = [self._exchange(k, settle) for k in range(1, len(self.interfaces))]
        back = diffuse_nodes.returning(self.tables, _roughness(self.interfaces[0]), self.indices[0])
        first = self.interfaces[0]
        films = _Films.on(first, self.tables, above=False)
        back = settle(_balanced(back, _gone(leaves, films, self.indices[0], first.absorbed is not None)))

        def up(going_down: Sequence[Row]) -> list[Row]:
            """Worth of light that comes to each interface from below; `going_down` that of light from above."""
            rows = [_seen(back, kept[0], going_down[0])]
            for k, exchange in enumerate(exchanges, 1):
                returned = _seen(exchange.staying_below, kept[k], going_down[k])
                rows.append(settle(_added(returned, _seen(exchange.up, kept[k - 1], rows[-1]))))
            return rows

        def down(going_up: Sequence[Row]) -> list[Row]:
            """Worth of light that comes to what is below each medium."""
            rows: list[Row] = [[1.0] * diffuse_nodes.COUNT]
            for k, exchange in reversed(list(enumerate(exchanges, 1))):
                returned = _seen(exchange.staying_above, kept[k - 1], going_up[k - 1])
                rows.insert(0, settle(_added(returned, _seen(exchange.down, kept[k], rows[0]))))
            return rows

        none: Row = [0.0] * diffuse_nodes.COUNT
        going_down = down([none] * len(self.interfaces))
        if exchanges:
            # Sweep up and down, and go on as the last two sweeps did
            *others, last = going_down
            begin = [x for row in others for x in row]

            def sweep(_: Value, gain: Value, *rows: Value) -> list[Value]:
                """The gains of the last two sweeps, and the rows before the last one and after it."""
                now = rows[len(begin) :]
                *swept, _ = down(up([*_split(now), last]))
                after = [ops.clip(x, -MOST_IMPORTANT, MOST_IMPORTANT) for row in swept for x in row]
                return [gain, _sum(b - a for a, b in zip(now, after)), *now, *after]

            gain_before, gain, *rows = ops.repeat(sweep, SWEEPS, 0.0, 0.0, *begin, *begin)
            ratio = ops.clip(ops.divide(gain, gain_before), 0.0, SLOWEST)
            rest = ratio / (1 - ratio)
            before, after = rows[: len(begin)], rows[len(begin) :]
            going_down = [*_split([b + (b - a) * rest for a, b in zip(before, after)]), last]
        importance = [a * b for a, b in zip(kept[0], going_down[0])]
        even = diffuse_nodes.even(self.indices[-1])
        return settle(importance), settle(_sum(w * a * b for w, a, b in zip(even, kept[-1], up(going_down)[-1])))

    def _exchange(self, k: int, settle: Settle) -> _Exchange:
        """Scattering matrices of the interface between two media."""
        layer, above, below = self.interfaces[k], self.indices[k - 1], self.indices[k]
        alpha, found, ratio = _roughness(layer), self.tables, layer.n12
        absorbs, (upper, lower) = layer.absorbed is not None, (_Films.on(layer, found, side) for side in (True, False))
        down = settle(_by_films(diffuse_nodes.between(found.passing, alpha, above, ratio), upper, above))
        up = settle(_by_films(diffuse_nodes.between(found.passing, alpha, below, 1 / ratio), lower, below))
        staying_above = diffuse_nodes.between(found.staying, alpha, above, ratio)
        staying_below = diffuse_nodes.between(found.staying, alpha, below, 1 / ratio)
        gone_above, gone_below = ([_sum(row) for row in rows] for rows in (down, up))
        staying_above = settle(_balanced(staying_above, _gone(gone_above, upper, above, absorbs)))
        staying_below = settle(_balanced(staying_below, _gone(gone_below, lower, below, absorbs)))
        return _Exchange(down, up, staying_above, staying_below)


@dataclass(frozen=True)
class _Exchange:
    """Parts of the light from each node that pass an interface, and that stay on the side where they come from."""

    down: Sequence[Row]
    up: Sequence[Row]
    staying_above: Sequence[Row]
    staying_below: Sequence[Row]


@dataclass(frozen=True)
class _Films:
    """Films on an interface of a relative index, by colour and for all, as diffuse light from one side meets them."""

    tables: Tables
    films: Films
    eta: Value
    n12: Value
    alpha: Value

    @classmethod
    def on(cls, layer: PreparedInterface, found: Tables, above: bool) -> _Films | None:
        """Those on an interface, None without any, for light from above, or below."""
        films, eta, n12, alpha = layer.films, layer.eta, layer.n12, _roughness(layer)
        if films is None or eta is None:
            return None
        return cls(found, films, eta, n12, alpha) if above else cls(found, films.reversed(), 1 / eta, 1 / n12, alpha)

    def more(self, n: Value) -> Row:
        """Share that passes of the light of each node of a medium of index n, over that without films."""
        with_films = self._means(n, self._passing)
        without = self._means(n, lambda c: 1 - fresnel.dielectric_between(c, self._beyond(c), self.eta))
        return [
            ops.select(bare > TRANSMITTANCE_MIN, x / ops.maximum(bare, TRANSMITTANCE_MIN), 1.0)
            for x, bare in zip(with_films, without)
        ]

    def lost(self, n: Value) -> Row:
        """Share that films absorb of the light of each node of a medium of index n."""
        absorbed = self._means(n, lambda c: 1 - self.films.between(c, self._beyond(c), self.eta) - self._passing(c))
        return [ops.clip(x, 0.0, 1.0) for x in absorbed]

    def _passing(self, cosine: Value) -> Value:
        return self.films.passing(cosine, self._beyond(cosine), self.eta)

    def _beyond(self, cosine: Value) -> Value:
        return fresnel.cos_transmitted(cosine, self.n12)

    def _means(self, n: Value, share: Callable[[float], Value]) -> Row:
        """Means over facets, at the nodes of a medium of index n."""
        average = tables.over_facets(self.tables, share)
        return [average(cosine, self.alpha) for cosine in diffuse_nodes.node_cosines(n)]


def _by_films(passing: Sequence[Row], films: _Films | None, n: Value) -> Sequence[Row]:
    """Rows of what passes an interface from a medium of index n, by what films on it let pass."""
    if films is None:
        return passing
    return [[x * more for x in row] for row, more in zip(passing, films.more(n))]


def _gone(leaving: Row, films: _Films | None, n: Value, absorbs: bool) -> Row:
    """Light that leaves a medium of index n through an interface, and that is absorbed there."""
    return _added(leaving, films.lost(n)) if films and absorbs else leaving


def _balanced(staying: Sequence[Row], leaving: Row) -> Sequence[Row]:
    """Rows that hold all that does not leave; what errors of interpolation miss goes back where it came from."""
    missing = [1 - gone - _sum(row) for row, gone in zip(staying, leaving)]
    return [[x + missing[k] if k == i else x for i, x in enumerate(row)] for k, row in enumerate(staying)]


def _seen(rows: Sequence[Row], kept: Row, importance: Row) -> Row:
    """Importance of the nodes above an interface and a medium that transmits `kept`, from that below."""
    after = [a * b for a, b in zip(kept, importance)]
    return [_sum(part * x for part, x in zip(row, after)) for row in rows]


def _split(values: Row) -> list[Row]:
    """The rows of several media, which follow one another."""
    return [values[k : k + diffuse_nodes.COUNT] for k in range(0, len(values), diffuse_nodes.COUNT)]


def _added(a: Row, b: Row) -> Row:
    return [x + y for x, y in zip(a, b)]


def _sum(values: Iterable[Value]) -> Value:
    first, *others = values
    return sum(others, first)


def _passed(media: Media, cosine: Value) -> Value:
    return ops.exp(sum((layer.along(-1 * depth, cosine) for layer, depth in media), 0 * cosine))


def _roughness(layer: PreparedInterface) -> Value:
    """Isotropic roughness, the mean over azimuths."""
    u, v, _ = layer.roughness
    return ops.minimum(ops.sqrt(0.5 * (u * u + v * v)), 1.0)


def _halfway(cosine: Value, interfaces: Sequence[PreparedInterface]) -> Direction:
    """A direction halfway between the axes of the first interface, where it has the mean of its roughnesses."""
    rotation = interfaces[0].roughness.rotation if interfaces else 0.0
    sine, azimuth = ops.sqrt(1 - cosine * cosine), rotation + pi / 4
    return sine * ops.cos(azimuth), sine * ops.sin(azimuth), cosine
