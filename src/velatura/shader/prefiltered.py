"""The light of a material by prefiltered environments: for light from each direction, every part's energy, and the
blurs of the environment that stand for the part.

A part is the light of one interface or of more that leave alike, the remainder, or what passes. Its blurs are those of
`velatura.shader.blurs`, each about a direction of its own, which is bent from the mirror's. Parts share as many of them
as a frame can afford; they go where they bring most. Numbers of all parts are sums of a few over direction, so that a
frame reads few texels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod, radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.model import Model, variance_kind
from velatura.model.base import Body, Query
from velatura.model.context import Context
from velatura.model.guards import ALPHA_MIN
from velatura.model.variance import Isotropic
from velatura.optics.ggx import Direction
from velatura.optics.phase import tangents
from velatura.renderer import directional_grid
from velatura.renderer.low_discrepancy import at_nodes, repeated
from velatura.shader import blurs
from velatura.stack import Material

Array = NDArray[np.floating]

LINE, PLANE = (64,), (32, 17)  # nodes over the cosine, and the azimuth where an interface is brushed
COS_MIN, COS_MAX = 0.02, 1 - 1e-6  # of directions at nodes, which all have an azimuth
SAMPLES = 1024  # of a part at a node, and a quarter where there is a plane of them
FAINT = 1e-4  # energy, below which a part is left out
MOST = 3  # blurs, but one at least for each part
NEAR = 0.005  # distance times energy and alpha, from which a part gets no further blur
CLOSE = 0.003  # the same, by which one blur for two parts may be farther off than one for each
LOSS = 0.015  # of light, the most that a number of a part may misplace where it is a sum of few


@dataclass(frozen=True)
class Prefiltered:
    """Parts over direction, from above and, where the material transmits, from below: their energies
    (sides, nodes, parts, 3), and of each part its blurs (sides, nodes, K, 4), as `blurs.fitted` returns them. `passes`
    says which parts leave on the other side, and `turn` from where azimuths count, in radians.
    """

    energy: Array
    blurs: Sequence[Array]
    shape: tuple[int, ...]
    passes: Sequence[bool]
    turn: float


def prefiltered(material: Material, model: Model) -> Prefiltered:
    """The parts of a material with values in NumPy: every interface's light, the remainder, and what passes."""
    isotropic = variance_kind(material) is Isotropic
    shape = LINE if isotropic else PLANE
    turn = 0.0 if isotropic else _across(material)
    x, y, z = directional_grid.directions(shape, None)
    twice = np.arctan2(2 * x * y, x * x - y * y).reshape(shape[0], -1)
    phi = np.ravel(0.5 * np.unwrap(twice))  # up to half a turn, and that itself
    z = np.clip(z, COS_MIN, COS_MAX)
    sine = np.sqrt(1 - z * z)
    x, y = sine * np.cos(turn + phi), sine * np.sin(turn + phi)
    body = model.body(material, variance_kind(material), Context())
    count = len(model.statistics(material, (x[:1], y[:1], z[:1])).energy)
    sides = [(x, y, side * z) for side in ([1.0, -1.0] if material.transmits else [1.0])]
    samples = SAMPLES if isotropic else SAMPLES // 4
    seen = [(body.at_direction(_repeated(wi, samples)), wi) for wi in sides]

    def of(lobes: frozenset[int]) -> _Light:
        reflected = Query([k in lobes for k in range(count + 1)], False)
        asked = reflected if lobes else Query(False, True, radiance=False)
        return _Light(lobes, [_Part.of(body, wi, phi, samples, asked) for body, wi in seen])

    reflected = [of(frozenset([k])) for k in range(count + 1)]
    passed = [of(frozenset())] if material.transmits else []
    kept = [*_joined([each for each in reflected if each.energy > FAINT], of)]
    kept = [*kept, *(each for each in passed if each.energy > FAINT)] or reflected[:1]
    energy = np.stack([np.stack([side.energy for side in each.sides]) for each in kept], axis=2)
    return Prefiltered(energy, _shared(kept), shape, [not each.lobes for each in kept], turn)


def _repeated(wi: Direction, samples: int) -> Direction:
    """Directions at nodes, each as often as there are samples."""
    x, y, z = (repeated(each, samples) for each in wi)
    return x, y, z


def _across(material: Material) -> float:
    """The azimuth across the grooves that are longest for their width, where lobes are shortest, in radians."""

    def ratio(interface: Any) -> float:
        narrow, wide = sorted([float(interface.alpha_u), float(interface.alpha_v)])
        return (wide + ALPHA_MIN) / (narrow + ALPHA_MIN)

    interface = max(material.interfaces, key=ratio)
    return radians(float(interface.rotation) + (90 if interface.alpha_u > interface.alpha_v else 0))


def _joined(lights: Sequence[_Light], of: Callable[[frozenset[int]], _Light]) -> Sequence[_Light]:
    """Light of lobes, of which the faintest joins others as long as one blur is nearly as good for both."""

    def farther(one: _Light, other: _Light, both: _Light) -> float:
        found = [each.blur for each in (both, one, other)]
        widths = np.maximum(_alphas(found[1]), _alphas(found[2]))
        missed = [each.missed(blurs, widths) for each, blurs in zip((both, one, other), found)]
        return missed[0] - missed[1] - missed[2]

    while len(lights) > 1:
        faint, *others = sorted(lights, key=lambda light: light.energy)
        tried = [of(each.lobes | faint.lobes) for each in others]
        found = [farther(each, faint, both) for each, both in zip(others, tried)]
        best = int(np.argmin(found))
        if found[best] > CLOSE:
            break
        lights = [*others[:best], tried[best], *others[best + 1 :]]
    return sorted(lights, key=lambda light: min(light.lobes))


def _shared(lights: Sequence[_Light]) -> list[Array]:
    """The blurs of each: one, and further ones where most is missed."""
    found = [light.blur for light in lights]
    for _ in range(MOST - len(lights)):
        missed = [light.missed(blurs, _alphas(blurs)) for light, blurs in zip(lights, found)]
        worst = int(np.argmax(missed))
        if missed[worst] < NEAR:
            break
        found[worst] = lights[worst].blurs(found[worst].shape[2] + 1)
    return found


def _alphas(found: Array) -> Array:
    """Mean alphas of blurs (..., K, 4)."""
    return np.asarray((found[..., 2] ** 2 * found[..., 3]).sum(axis=-1))


@dataclass(frozen=True)
class _Light:
    """A part: the lobes that it is of, or none where it passes; seen from above and, where the material transmits, from
    below."""

    lobes: frozenset[int]
    sides: Sequence[_Part]

    @property
    def energy(self) -> float:
        """The most of its energy."""
        return max(float(np.max(side.energy)) for side in self.sides)

    @cached_property
    def blur(self) -> Array:
        """One blur (sides, nodes, 1, 4)."""
        return self.blurs(1)

    def blurs(self, count: int) -> Array:
        """So many blurs (sides, nodes, count, 4)."""
        return np.stack([side.blurs(count) for side in self.sides])

    def missed(self, found: Array, widths: Array) -> float:
        """The mean over nodes of the distance of blurs times energy and alphas (sides, nodes), since environments
        differ less over small angles; the most of both sides."""
        return max(
            float(np.mean(side.distances(blurs) * width)) for side, blurs, width in zip(self.sides, found, widths)
        )


@dataclass(frozen=True)
class _Part:
    """Samples of a part on one side of the surface, for light from nodes: energies (nodes, 3); the sine of their
    direction; azimuths, from where lobes are shortest; directions (3, nodes, samples), in the plane of incidence,
    upwards; densities over those of samples, which are last, 0 on the other side."""

    energy: Array
    sine: Array
    phi: Array
    w: Array
    ratio: Array
    density: Array

    @classmethod
    def of(cls, body: Body, wi: Direction, phi: Array, samples: int, asked: Query) -> _Part:
        nodes = len(wi[0])
        repeat = _repeated(wi, samples)
        wo, _ = body.sample(repeat, *at_nodes(nodes, samples), asked)
        value, density = body.eval_pdf(repeat, wo, asked)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0)
        weight = np.broadcast_to(weight, (3, nodes * samples)).reshape(3, nodes, samples)
        w = np.array(np.broadcast_arrays(*wo)).reshape(3, nodes, samples)
        ratio = weight.mean(axis=0)
        ratio = ratio / np.maximum(ratio.mean(axis=-1, keepdims=True), 1e-12)
        sine = np.hypot(wi[0], wi[1])
        c, s = (wi[0] / sine)[:, None], (wi[1] / sine)[:, None]
        up = np.sign(wi[2])[:, None] * (-1 if asked.transmission else 1) * w[2]
        w = np.stack([c * w[0] + s * w[1], c * w[1] - s * w[0], np.abs(up)])
        density = np.where(up > 0, np.broadcast_to(density, nodes * samples).reshape(nodes, samples), 0)
        return cls(weight.mean(axis=-1).T, sine, phi, w, ratio, density)

    def blurs(self, count: int) -> Array:
        """So many blurs (nodes, count, 4)."""
        start, kept = self._start(count), set[int]()
        if self._isotropic:
            start[..., 1], kept = 0, {1}  # in the plane of incidence
        found = blurs.fitted(start, self.sine, self.w, self.ratio, self.density, kept)
        if count > 1:
            # Each of one alpha from all directions, so that neighbours read the same level of a texture
            weight = self.energy.max(axis=-1)[:, None] * found[..., 3]
            found[..., 2] = (weight * found[..., 2]).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-12)
            found = blurs.fitted(found, self.sine, self.w, self.ratio, self.density, kept | {2})
        return found

    def distances(self, found: Array) -> Array:
        """Distances of blurs (nodes, K, 4) times energies, at nodes."""
        return blurs.distance(found, self.sine, self.w, self.ratio, self.density) * self.energy.max(axis=-1)

    @property
    def _isotropic(self) -> bool:
        return len(self.sine) == LINE[0]

    def _start(self, count: int) -> Array:
        """Blurs side by side along the longer axis, the narrower ones first."""
        share = self.ratio / self.ratio.shape[1]
        mean = (self.w * share).sum(axis=-1)
        length = np.linalg.norm(mean, axis=0)
        upwards = np.array([0.0, 0.0, 1.0])[:, None]
        mean = np.where(length > 1e-6, mean / np.maximum(length, 1e-6), upwards)
        across = np.stack(tangents((mean[0], mean[1], mean[2])))
        along = [np.einsum("an,ans->ns", t, self.w) for t in across]
        xx, xy, yy = ((along[a] * along[b] * share).sum(axis=-1) for a, b in ((0, 0), (0, 1), (1, 1)))
        more = np.hypot(0.5 * (xx - yy), xy)
        angle = 0.5 * np.arctan2(xy, 0.5 * (xx - yy))
        # An axis has two; this one varies smoothly over half a turn, where those that lobes are longest along do
        near = 0.5 * (0.5 * np.pi - self.phi)
        angle += np.pi * np.round((near - angle) / np.pi)
        axis = np.cos(angle) * across[0] + np.sin(angle) * across[1]
        root = np.sqrt(blurs.alpha_of(np.maximum(0.5 * (xx + yy) - more, 0)))
        found = []
        for place in np.arange(count) - 0.5 * (count - 1):
            p = np.clip(1.5 * place * np.sqrt(more), -0.95, 0.95)
            w = np.sqrt(1 - p * p) * mean + p * axis
            width = np.clip(root * 1.25**place, blurs.LEAST, 1)
            found.append(np.stack([w[0] + self.sine, w[1], width, np.full_like(root, 1 / count)], axis=-1))
        return np.stack(found, axis=1)


@dataclass(frozen=True)
class Sums:
    """Numbers of parts over direction as sums of few, which are in a texture.

    `texels` are of shape (T, sides, azimuths, cosines, 4), within -1 and 1. `factors` are of each part (1 + K, 4,
    4 T + 1): of red, green, blue and 0, and of each blur's numbers, their factors of the components of all T texels,
    and what is added.
    """

    texels: Array
    factors: Sequence[Array]


def summed(found: Prefiltered) -> Sums:
    """The numbers of parts by their principal components, as few as leave them right within `LOSS`."""
    groups = []
    for k, part in enumerate(found.blurs):
        energy = found.energy[:, :, k]
        rows = np.concatenate([np.pad(energy, ((0, 0), (0, 0), (0, 1)))[:, :, None], part], axis=2)
        groups.append((rows.reshape(-1, rows.shape[2], 4), _moved(energy, part)))
    values = np.concatenate([rows.reshape(len(rows), -1) for rows, _ in groups], axis=1)
    moved = np.concatenate([np.ravel(light) for _, light in groups])
    mean = values.mean(axis=0)
    left, size, right = np.linalg.svd((values - mean) * moved, full_matrices=False)
    over = np.arange(len(size) + 1)
    loss = [np.max(np.abs((left[:, n:] * size[n:]) @ right[n:]), initial=0) for n in over]
    count = 4 * -(-max(int(np.argmax(np.array(loss) < LOSS)), 1) // 4)
    scores = np.pad(left * size, ((0, 0), (0, count)))[:, :count]
    scale = np.maximum(np.abs(scores).max(axis=0), 1e-12)
    factors = np.pad(right, ((0, count), (0, 0)))[:count] * scale[:, None] / moved
    sides, cosines, turns = len(found.energy), found.shape[0], prod(found.shape[1:])
    texels = (scores / scale).reshape(sides, cosines, turns, -1, 4).transpose(3, 0, 2, 1, 4)
    table = np.concatenate([factors, mean[None]]).T
    ends = np.cumsum([rows.shape[1] for rows, _ in groups])
    return Sums(texels, np.split(table.reshape(-1, 4, count + 1), ends[:-1]))


def _moved(energy: Array, part: Array) -> Array:
    """Light that a change by 1 displaces, at most, of each number of a part (1 + K, 4)."""
    root, share = part[..., 2], part[..., 3]
    light = energy.max(axis=-1)[..., None]
    # Half the integral of the difference of densities of narrow blurs
    place, width = light * share / (4 * root**2), light * share / root
    moved = np.stack([place, place, width, light + 0 * share], axis=-1).max(axis=(0, 1))
    return np.concatenate([np.ones((1, 4)), np.maximum(moved, 1e-6)])
