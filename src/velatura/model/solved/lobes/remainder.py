"""Light that a stack reflects outside its lobes (media, repeated facets, a diffuse base), as a reciprocal polynomial.

For z the cosines outside and s = -(x_i x_o + y_i y_o), positive on the side of the mirror direction,

    pi f(wi, wo) = sum_ab C_ab u_a(z_i) u_b(z_o) + B s + A (2 s^2 - |p_i|^2 |p_o|^2),    C_ab = C_ba,

where u = (1, z, (1 - z)^4), whose last falls off as what an interface lets out does, and |p|^2 = 1 - z^2. The first
term is its mean over azimuths, clipped at 0; the others vary as cos(phi) and cos(2 phi), and are clipped at the mean.
It is fitted to what leaves a stack at nodes of the length of momentum.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import pi

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.solved.energies.nodes import QUADRATURE, Nodes
from velatura.model.solved.guards import ALBEDO_MIN
from velatura.ops import Value
from velatura.optics.ggx import Direction

Array = NDArray[np.floating]

MOMENTS = (1.0, 2 / 3, 1 / 15)  # means of u over the projected disc
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # a and b, of C_ab
EVEN = (1.0, 0.0, 0.0, 0.0, 0.0)  # numbers of light that passes evenly
EXACT = 3.0  # weight of the energy of a direction beside that of nodes
ALIKE = 3e-4  # error of pi f
LATTICE = 12  # directions along each axis that errors are of
KEPT = 16  # sets of nodes whose deposits are kept
BRIGHT = 0.5  # share of samples by the root of the cosine, for a horizon that is twice as bright as all
TILT = 0.3  # by how much more light is sampled on one side than on the opposite one, over both, at most


@dataclass(frozen=True)
class Remainder(ops.NamedFields):
    """The polynomial by its numbers, colours: C_ab, then B and A."""

    c_00: Value
    c_01: Value
    c_02: Value
    c_11: Value
    c_12: Value
    c_22: Value
    b: Value
    a: Value

    def value(self, wi: Direction, wo: Direction) -> Value:
        """f(wi, wo) |cos theta_o|, a colour; 0 unless both are above the surface."""
        z = ops.select(wi[2] > 0, ops.maximum(wo[2], 0.0), 0.0)
        mean, unclipped = self.unclipped(wi, wo)
        ops.names(mean=mean)
        return ops.maximum(ops.minimum(unclipped, mean + mean), 0.0) * (z * (1 / pi))

    def unclipped(self, wi: Direction, wo: Direction) -> tuple[Value, Value]:
        """The mean of pi f(wi, wo) over azimuths, and pi f(wi, wo), colours, of directions above."""
        z_i, z_o = wi[2], wo[2]
        w_i, w_o = grazing(z_i), grazing(z_o)
        s = -1 * (wi[0] * wo[0] + wi[1] * wo[1])
        twice = 2 * s * s - (1 - z_i * z_i) * (1 - z_o * z_o)
        once = self.c_01 * (z_i + z_o) + self.c_02 * (w_i + w_o)
        both = self.c_11 * (z_i * z_o) + self.c_12 * (z_i * w_o + w_i * z_o) + self.c_22 * (w_i * w_o)
        mean = self.c_00 + once + both
        ops.names(s=s, twice=twice, once=once, both=both)
        return mean, mean + self.b * s + self.a * twice  # model.md, Eq. 8

    def albedo(self, cos_theta: Value) -> Value:
        """Energy for light from a cosine, a colour, without clipping."""
        return sum(k * moment for k, moment in zip(self._at(cos_theta), MOMENTS))

    @property
    def samples(self) -> RemainderSamples:
        """How it is sampled, which all colours share."""
        c_00, c_01, c_02, c_11, c_12, c_22, b, a = map(ops.mean, vars(self).values())
        rows = (c_00, c_01, c_02), (c_01, c_11, c_12), (c_02, c_12, c_22)
        even = [sum(c * moment for c, moment in zip(row, MOMENTS)) for row in rows]
        return RemainderSamples((c_00 + c_02, c_01 + c_12, c_02 + c_22), (even[0], even[1], even[2]), b, a)

    def density(self, wi: Direction, wo: Direction) -> Value:
        """Density of `sample`, of directions above."""
        return self.samples.density(wi, wo)

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value) -> Direction:
        """A direction wo from uniform numbers."""
        return self.samples.sample(wi, u, u1, u2)

    def _at(self, z: Value) -> tuple[Value, Value, Value]:
        """Coefficients of u at the other cosine."""
        w = grazing(z)
        return (
            self.c_00 + z * self.c_01 + w * self.c_02,
            self.c_01 + z * self.c_11 + w * self.c_12,
            self.c_02 + z * self.c_12 + w * self.c_22,
        )


@dataclass(frozen=True)
class RemainderSamples:
    """Samples of a remainder, by means over its colours: coefficients of u at the cosine of the light, of what leaves
    along the horizon in the mean over azimuths, and of all that leaves; B and A."""

    horizon: tuple[Value, Value, Value]
    everywhere: tuple[Value, Value, Value]
    b: Value
    a: Value

    def density(self, wi: Direction, wo: Direction) -> Value:
        """Density of `sample`, of directions above."""
        z, (low, tilt) = ops.maximum(wo[2], 0.0), self._bright(wi)
        even = ((1 - low) * z + 0.75 * low * ops.sqrt(z)) * (1 / pi)
        return even * (1 + _tilted(tilt, wi, wo))

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value) -> Direction:
        """A direction wo from uniform numbers, with a density proportional to the cosine or, where most light leaves at
        grazing directions, to its root; more of them on the side to which light tilts."""
        low, tilt = self._bright(wi)
        grazing = u1 < low
        u1 = ops.clip(ops.divide(ops.select(grazing, u1, u1 - low), ops.select(grazing, low, 1 - low)), 0.0, 1.0)
        u1 = ops.maximum(u1, ops.TINY)
        z = ops.select(grazing, ops.power(u1, 2 / 3), ops.sqrt(u1))
        radius, phi = ops.sqrt(1 - z * z), 2 * pi * u2
        x, y = radius * ops.cos(phi), radius * ops.sin(phi)
        side = ops.select(2 * u < 1 + _tilted(tilt, wi, (x, y, z)), 1.0, -1.0)
        return side * x, side * y, z

    def _bright(self, wi: Direction) -> tuple[Value, Value]:
        """Share of samples by the root of the cosine: by how bright the horizon is, on the side of the mirror
        direction, beside the mean of all directions; and B over that mean."""
        z, p2 = wi[2], 1 - wi[2] * wi[2]
        w = grazing(z)
        horizon, everywhere = (c[0] + z * c[1] + w * c[2] for c in (self.horizon, self.everywhere))
        horizon = horizon + self.b * ops.sqrt(p2) + self.a * p2
        inverse = ops.divide(1.0, everywhere)
        return ops.clip(BRIGHT * (horizon * inverse - 1), 0.0, 1.0), self.b * inverse


def _tilted(tilt: Value, wi: Direction, wo: Direction) -> Value:
    """Light sampled beyond that on the opposite side, over both."""
    return ops.clip(-1 * tilt * (wi[0] * wo[0] + wi[1] * wo[1]), -TILT, TILT)


def fit(
    nodes: Nodes, measures: Array, cosines: Array, albedos: Array, others: Sequence[Array] = ()
) -> tuple[Remainder, Array]:
    """The polynomial closest to the light that leaves a stack, by colour (C,), and the shares of other functions beside
    it, (others, C), which are not negative.

    Args:
        measures: (C, modes, N, M) of light from M directions: its energy at the nodes, and its means of cos(phi) and
            cos(2 phi), as far as it has any; phi is 0 on the side of the mirror direction.
        cosines: of the directions, (M,).
        albedos: of the stack for these, (C, M); errors count relative to them.
        others: likewise measures of these functions, (C, modes, N, M).
    """
    outside, even, deposits, once, twice = _of_nodes(nodes, 1.0)
    sine = np.sqrt(1 - cosines * cosines)[:, None]
    u = _basis(cosines)[..., None]
    # Columns (M, N) of each mode, and what their energies are (M,)
    mean = [(u[a] * deposits[b] + u[b] * deposits[a]) / (1 + (a == b)) for a, b in PAIRS]
    energy = [(u[a, :, 0] * MOMENTS[b] + u[b, :, 0] * MOMENTS[a]) / (1 + (a == b)) for a, b in PAIRS]
    of_once, of_twice = [0.5 * sine * once], [0.5 * sine * sine * twice]

    numbers = []
    for c, (light, albedo) in enumerate(zip(measures, albedos)):
        weight = even / np.maximum(albedo, ALBEDO_MIN)[:, None]
        exact = EXACT / np.maximum(albedo, ALBEDO_MIN)
        seen = light[:, outside].swapaxes(-1, -2)
        rows = np.concatenate([_rows(mean, weight), _rows(energy, exact)])
        target = np.concatenate([(weight * seen[0]).ravel(), exact * light[0].sum(axis=0)])
        parts = [(rows, target)]
        parts += [(_rows(each, weight), (weight * mode).ravel()) for each, mode in zip((of_once, of_twice), seen[1:])]
        parts += [(np.eye(1), np.zeros(1))] * (3 - len(parts))
        columns = []
        for each in others:
            at_nodes = each[c][:, outside].swapaxes(-1, -2)
            mean_of, *waves = ((weight * mode).ravel() for mode in at_nodes)
            columns.append([np.concatenate([mean_of, exact * each[c][0].sum(axis=0)]), *waves])
        numbers.append(_solved(parts, columns))
    found = np.stack(numbers, axis=-1)
    count = len(fields(Remainder))
    return Remainder(*found[:count]), found[count:]


def _solved(parts: Sequence[tuple[Array, Array]], columns: Sequence[Sequence[Array]]) -> Array:
    """Least squares of parts, each of numbers of its own, and of columns that all parts share, whose numbers are not
    negative: those that would be are left out."""
    from scipy.linalg import block_diag  # slow to load

    kept = list(range(len(columns)))
    while kept:
        rows = block_diag(*(rows for rows, _ in parts))
        shared = np.stack([np.concatenate(columns[k]) for k in kept], axis=-1)
        target = np.concatenate([target for _, target in parts])
        found = np.linalg.lstsq(np.concatenate([rows, shared], axis=-1), target, rcond=None)[0]
        shares = found[-len(kept) :]
        if shares.min() >= 0:
            others = np.zeros(len(columns))
            others[kept] = shares
            return np.concatenate([found[: -len(kept)], others])
        kept.pop(int(np.argmin(shares)))
    alone = [np.linalg.lstsq(*part, rcond=None)[0] for part in parts]
    return np.concatenate([*alone, np.zeros(len(columns))])


def passing(nodes: Nodes, measures: Array, n: float, sines: Array) -> Array:
    """Numbers (5, M) of the light that passes, by direction: of its mean by u, and the tilts B and A, over its energy.

    Args:
        measures: (modes, N, M) as of `fit`; it leaves with momenta up to n.
        sines: of the directions below, (M,).
    """
    leaves, even, deposits, once, twice = _of_nodes(nodes, n)
    energy = measures[0].sum(axis=0)
    mean, *others = measures[:, leaves] / np.maximum(energy, ALBEDO_MIN)
    rows = np.concatenate([even * np.array(deposits), EXACT * np.reshape(MOMENTS, (-1, 1))], axis=1).T
    target = np.concatenate([even[:, None] * mean, np.full((1, len(sines)), EXACT)])
    numbers = [*np.linalg.lstsq(rows, target, rcond=None)[0]]
    for mode, deposit, sine in zip(others, (once, twice), (sines, sines * sines)):
        numbers.append(2 / sine * ((even * even * deposit) @ mode) / np.sum((even * deposit) ** 2))
    numbers += [0 * sines] * (5 - len(numbers))
    return np.where(energy > ALBEDO_MIN, numbers, np.reshape(EVEN, (-1, 1)))


def of_few(numbers: Array, most: int) -> tuple[Array, Array] | None:
    """Shares (M, K) and numbers (K, 8 C) of few polynomials, whose sums are those of `numbers` (M, 8 C), but for an
    error of `ALIKE` in pi f, root mean square over directions; None where that takes more than `most`."""
    lengths = _lengths()
    functions = np.einsum("fk,mkc->mfc", lengths, numbers.reshape(len(numbers), len(lengths), -1))
    sides, sizes, rows = np.linalg.svd(functions.reshape(numbers.shape), full_matrices=False)
    errors = np.sqrt(np.cumsum(sizes[::-1] ** 2)[::-1] / (len(numbers) * functions.shape[-1]))
    count = max(int(np.sum(errors > ALIKE)), 1)
    if count > most:
        return None
    few = np.linalg.solve(lengths, rows[:count].reshape(count, len(lengths), -1))
    return sides[:, :count] * sizes[:count], few.reshape(count, -1)


@functools.cache
def _lengths() -> Array:
    """A matrix (8, 8) by which the length of the numbers of a polynomial is the root mean square of pi f."""
    each = (np.arange(LATTICE) + 0.5) / LATTICE
    p2_i, p2_o, turn = (x.ravel() for x in np.meshgrid(each, each, each))
    wi = np.sqrt(p2_i), 0 * p2_i, np.sqrt(1 - p2_i)
    wo = np.sqrt(p2_o) * np.cos(np.pi * turn), np.sqrt(p2_o) * np.sin(np.pi * turn), np.sqrt(1 - p2_o)
    functions = [Remainder(*row).unclipped(wi, wo)[1] + 0 * turn for row in np.eye(len(fields(Remainder))).tolist()]
    return np.asarray(np.linalg.qr(np.transpose(functions) / np.sqrt(len(turn)), mode="r"))


@functools.lru_cache(KEPT)
def _of_nodes(nodes: Nodes, n: float) -> tuple[NDArray[np.integer], Array, list[Array], Array, Array]:
    """Numbers of the nodes of light that leaves into an index n, weights of their errors, and there, by function of u,
    deposits of all modes."""
    leaves = np.flatnonzero(nodes.p <= n * (1 + 1e-9))
    even = 1 / np.sqrt(np.maximum(nodes.weights(n)[leaves] / (n * n), 1 / QUADRATURE))
    mean, once, twice = ([_deposited(nodes, m, a, n)[leaves] for a in range(3 if m == 0 else 1)] for m in range(3))
    return leaves, even, mean, once[0], twice[0]


def _rows(columns: Sequence[Array], weight: Array) -> Array:
    return np.stack([(weight * column).ravel() for column in columns], axis=-1)


def _deposited(nodes: Nodes, mode: int, a: int, n: float) -> Array:
    """Integral over p^2 in [0, 1] of p^mode u_a, of momenta n p, shared among the nodes, (N,)."""
    p = np.sqrt((np.arange(QUADRATURE) + 0.5) / QUADRATURE)
    index, shares, beyond = nodes.shares(n * p)
    if mode % 2:
        shares = np.where(beyond, -shares, shares)
    function = p**mode * _basis(np.sqrt(1 - p * p))[a] / QUADRATURE
    return np.asarray(np.bincount(index.ravel(), (shares * function).ravel(), nodes.count))


def _basis(z: Array) -> Array:
    return np.stack([np.ones_like(z), z, grazing(z)])


def grazing(z: Value) -> Value:
    squared = (1 - z) * (1 - z)
    return squared * squared
