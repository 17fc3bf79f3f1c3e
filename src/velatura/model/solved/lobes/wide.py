"""Light that panes with a rough interface make too wide for lobes, as waves of the azimuth over momentum.

No facet alone sends light where two facets send it in turn: those of two interfaces, or of one that a polished back
throws light to again. So lobes, which are of one facet each, have the right energy there, and another shape. The nodes
have that shape. With z_o the cosine of the light that leaves,
s = -(x_i x_o + y_i y_o), positive on the side of the mirror direction, and P^2 = |p_i|^2 |p_o|^2,

    pi f(wi, wo) = E max(sum_mk c_mk W_m(s, P) L_k(2 z_o - 1), 0),   W_0 = 1, W_1 = s, W_(m+1) = 2 s W_m - P^2 W_(m-1),

where W_m varies as cos(m phi), and L_k are Legendre's polynomials. The numbers c_mk are fitted, by direction, to what
leaves a stack at the nodes of the length of momentum. What their errors there are says how much of the light has this
shape; the rest keeps its lobes.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model import fitted
from velatura.model.guards import ALPHA_MIN
from velatura.model.solved.energies.matrices import applied
from velatura.model.solved.energies.nodes import QUADRATURE, Nodes
from velatura.model.solved.guards import ALBEDO_MIN
from velatura.model.solved.lobes.remainder import EXACT, KEPT
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import low_discrepancy
from velatura.stack import InterfaceValues, Material

Array = NDArray[np.floating]

TERMS = (6, 6, 5, 5, 4, 4, 3)  # polynomials of each wave
COUNT = sum(TERMS)
STEEP = 0.2  # sine of light from which waves are extended to the normal, where they vanish
EVENLY = 1597  # directions over which energies are integrated
NEAR = 1e-9  # of momenta that leave along the horizon
STEADY = 0.97  # ratio of a wave to the one before it, at most


def share(material: Material) -> float:
    """Share of the light of a material of NumPy's values that may have this shape: the more, the more its roughest
    interface turns it, and another one reflects it; none of opaque stacks, and of solids, inside which much light is
    trapped."""
    if not material.transmits:
        return 0.0
    (rough, _), (_, step), round_, pane = _faces(material)
    return float(pane * _smooth(rough, fitted.WIDE_ROUGHEST) * _smooth(step, fitted.WIDE_SECOND) * round_)


def straight_share(material: Material) -> float:
    """Share of light that goes straight through, of what may have this shape: the more, the more the second roughest
    interface turns it; with one alone the lobe of that is exact."""
    return float(_smooth(_faces(material)[1][0], fitted.WIDE_STRAIGHT))


def _faces(material: Material) -> tuple[tuple[float, float], tuple[float, float], float, float]:
    """How much the roughest interface, and at most another one, turn light, and the steps of the logarithm of their
    indices; from 0 to 1, how alike all are along both axes, and whether the index below is that above."""
    outside = float(ops.mean(np.ravel(material.exterior)))
    n, found, round_ = outside, [(0.0, 0.0)] * 2, 1.0
    for layer in material.solid().layers:
        if not isinstance(layer, InterfaceValues):
            continue
        above, n = n, float(ops.mean(np.ravel(layer.eta)))
        low, high = sorted((max(float(layer.alpha_u), ALPHA_MIN), max(float(layer.alpha_v), ALPHA_MIN)))
        step = abs(np.log(n / above))
        found.append((low * min(step / fitted.WIDE_STEP, 1.0), step))
        round_ = min(round_, 1 - _smooth(high / low, fitted.WIDE_STRETCH))
    roughest, *others = sorted(found, reverse=True)
    second = others[0][0], max(step for _, step in others)
    return roughest, second, round_, 1 - _smooth(abs(np.log(n / outside)), fitted.WIDE_SOLID)


def _smooth(x: Any, ends: tuple[float, float]) -> Any:
    """0 up to the lower end, 1 from the upper one on, and smooth between."""
    t = np.clip((x - ends[0]) / (ends[1] - ends[0]), 0, 1)
    return t * t * (3 - 2 * t)


def density(numbers: Sequence[Value], i: Direction, o: Direction) -> Value:
    """pi f(wi, wo) over its mean, of directions above."""
    return ops.maximum(_unclipped(numbers, i, o), 0.0)


def _unclipped(numbers: Sequence[Value], i: Direction, o: Direction) -> Value:
    """The same where it is more than 0: linear in the numbers, those of a wave m times |p_i|^m."""
    s = -1 * (i[0] * o[0] + i[1] * o[1])
    squares = (i[0] * i[0] + i[1] * i[1]) * (o[0] * o[0] + o[1] * o[1])
    found: Value = 0.0
    wave: Value = 1.0
    before: Value = 0.0
    each, polynomials = iter(numbers), _legendre(o[2])
    for m, terms in enumerate(TERMS):
        term = sum(next(each) * polynomial for polynomial in polynomials[:terms])
        found = found + wave * term if m else term
        wave, before = (s, 1.0) if m == 0 else (2 * s * wave - squares * before, wave)
    return found


def _legendre(z: Value) -> list[Value]:
    """Legendre's polynomials on cosines from 0 to 1, of the orders that waves have."""
    x = 2 * z - 1
    found: list[Value] = [1.0, x]
    for k in range(1, max(TERMS) - 1):
        found.append(((2 * k + 1) * x * found[k] - k * found[k - 1]) * (1 / (k + 1)))
    return found


def value(weight: Value, numbers: Sequence[Value], i: Direction, o: Direction) -> Value:
    """f(wi, wo) |cos theta_o|, a colour, of an energy; 0 unless both are above the surface."""
    z = ops.select(i[2] > 0, ops.maximum(o[2], 0.0), 0.0)
    return weight * (density(numbers, i, o) * (z * (1 / pi)))  # model.md, Eq. 13


def fit(nodes: Nodes, measures: Array, n: float, sines: Array) -> tuple[Array, Array]:
    """Numbers (COUNT, M) of the light that leaves into an index n, and the share (M,) of it that lobes should leave to
    them: all where waves have its shape, and none where it is too narrow for them.

    Args:
        measures: (waves, N, 1 + M) as of `remainder.fit`, of light whose sine is `STEEP`, and of all other.
        sines: of both on the side to which light leaves, (1 + M,).
    """
    energy = np.maximum(measures[0].sum(axis=0), ALBEDO_MIN)
    leaves = nodes.p <= n * (1 + NEAR)
    found, errors, lengths = [], [], []
    for m, ((rows, solve), light) in enumerate(zip(_solvers(nodes, n), measures)):
        whole = [EXACT * light.sum(axis=0, keepdims=True)] if m == 0 else []
        numbers = solve @ np.concatenate([light, *whole]) / energy
        light = light[leaves] / energy
        errors.append(np.abs(rows[leaves] @ numbers - light).sum(axis=0))
        lengths.append(np.abs(light).sum(axis=0))
        if m:
            numbers = numbers * (2 / np.maximum(sines, sines[0]) ** m)
            numbers = np.where(sines < sines[0], numbers[:, :1], numbers)
        found.append(numbers[:, 1:])
    numbers, sines = np.concatenate(found), sines[1:]
    orders = np.repeat(np.arange(len(TERMS)), TERMS)[:, None]
    light = applied(_evenly()[None, None], (numbers * sines**orders)[None, None])[0, 0]
    mean = np.maximum(light, 0).mean(axis=0)
    return np.asarray(numbers / np.maximum(mean, ALBEDO_MIN)), _resolved(np.array(errors), *lengths[-2:])[1:]


@functools.cache
def _evenly() -> Array:
    """Light of each number at the length 1 of momentum, in directions that are even in projection: (EVENLY, COUNT)."""
    cosine, turn = low_discrepancy.fibonacci(EVENLY)
    radius, phi = np.sqrt(1 - cosine), 2 * pi * turn
    o = radius * np.cos(phi), radius * np.sin(phi), np.sqrt(cosine)
    return np.asarray(_unclipped([*np.eye(COUNT)[..., None]], (1.0, 0.0, 0.0), o)).T


def _resolved(errors: Array, before: Array, last: Array) -> Array:
    """Share (M,) of light that waves have, by errors (waves, M) at the nodes, and the lengths of the last two waves."""
    weights = np.array([0.5] + [2 / pi] * (len(errors) - 1))  # in total variation
    # Waves that are left out fall off as the last ones do
    ratio = np.minimum(last / np.maximum(before, ALBEDO_MIN), STEADY)
    left_out = last * ratio / np.sqrt(1 - ratio * ratio) / pi
    error = np.sqrt(((weights[:, None] * errors) ** 2).sum(axis=0)) + left_out
    least, most = np.log(fitted.WIDE_ERROR)
    return np.asarray(1 - _smooth(np.log(np.maximum(error, ALBEDO_MIN)), (least, most)))


@functools.lru_cache(KEPT)
def _solvers(nodes: Nodes, n: float) -> list[tuple[Array, Array]]:
    """Matrices (N, terms) and (terms, N) of each wave: light at the nodes that its numbers are, and numbers that light
    there is; light of the first has its energy after it, with its weight."""
    leaves = nodes.p <= n * (1 + NEAR)
    p = np.sqrt((np.arange(QUADRATURE) + 0.5) / QUADRATURE)
    index, shares, beyond = nodes.shares(n * p)
    weight = np.where(leaves, 1 / np.sqrt(np.maximum(nodes.weights(n) / (n * n), 1 / QUADRATURE)), 0.0)
    found = []
    for m, terms in enumerate(TERMS):
        function = [p**m * polynomial / QUADRATURE for polynomial in _legendre(np.sqrt(1 - p * p))[:terms]]
        signed = np.where(beyond, -shares, shares) if m % 2 else shares
        each = [np.bincount(index.ravel(), (signed * x).ravel(), nodes.count) for x in function]
        rows: Array = np.stack(each, axis=-1).astype(float)
        whole = [EXACT * rows.sum(axis=0, keepdims=True)] if m == 0 else []
        inverse = np.linalg.pinv(np.concatenate([weight[:, None] * rows, *whole]))
        inverse[:, : nodes.count] *= weight
        found.append((rows, inverse))
    return found
