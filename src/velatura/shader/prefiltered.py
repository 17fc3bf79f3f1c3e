"""The light of a material by prefiltered environments: for light from each direction, every part's energy, and the
blurs of the environment that stand for the part.

A part is the light of one interface, the remainder, or what passes. Its blurs are those of `velatura.shader.blurs`,
each about a direction of its own, which is bent from the mirror's. Parts share as many of them as a frame can afford;
they go where they bring most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from velatura.model import Model, variance_kind
from velatura.model.base import Body, Query
from velatura.model.context import Context
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
SAMPLES = 1024  # of a part at a node, of which a plane's blurs are fitted to a quarter
FAINT = 1e-4  # energy, below which a part is left out
MOST = {LINE: 4, PLANE: 6}  # blurs, but one at least for each part
NEAR = 0.005  # distance times energy and alpha, from which a part gets no further blur
LOSS = 0.015  # of light, the most that a number of a part may misplace where it is a sum of few


@dataclass(frozen=True)
class Prefiltered:
    """Parts over direction, from above and, where the material transmits, from below: their energies
    (sides, nodes, parts, 3), and of each part its blurs (sides, nodes, K, 4), as `blurs.fitted` returns them. `passes`
    says which parts leave on the other side.
    """

    energy: Array
    blurs: Sequence[Array]
    shape: tuple[int, ...]
    passes: Sequence[bool]


def prefiltered(material: Material, model: Model) -> Prefiltered:
    """The parts of a material with values in NumPy: every interface's light, the remainder, and what passes."""
    isotropic = variance_kind(material) is Isotropic
    shape = LINE if isotropic else PLANE
    x, y, z = (np.ravel(w) for w in directional_grid.directions(shape, None))
    z = np.clip(z, COS_MIN, COS_MAX)
    scale = np.sqrt((1 - z * z) / (x * x + y * y))
    body = model.body(material, variance_kind(material), Context())
    count = len(model.statistics(material, (x[:1] * scale[:1], y[:1] * scale[:1], z[:1])).energy)
    reflected = [Query([k == j for j in range(count + 1)], False) for k in range(count + 1)]
    asked = [*reflected, *([Query(False, True, radiance=False)] if material.transmits else [])]
    sides = [1.0, -1.0] if material.transmits else [1.0]
    parts = [[_Part.of(body, (x * scale, y * scale, side * z), each) for side in sides] for each in asked]
    kept = [k for k, part in enumerate(parts) if max(np.max(side.energy) for side in part) > FAINT] or [0]
    found = _shared([parts[k] for k in kept], MOST[shape])
    energy = np.stack([np.stack([side.energy for side in parts[k]]) for k in kept], axis=2)
    return Prefiltered(energy, found, shape, [bool(asked[k].transmission) for k in kept])


def _shared(parts: Sequence[Sequence[_Part]], most: int) -> list[Array]:
    """The blurs of parts from each side: one each, and further ones where the distance is largest."""

    def of(part: Sequence[_Part], count: int) -> tuple[Array, float]:
        found = [side.blurs(count) for side in part]
        return np.stack([x for x, _ in found]), max(distance for _, distance in found)

    found = [of(part, 1) for part in parts]
    for _ in range(most - len(parts)):
        worst = int(np.argmax([distance for _, distance in found]))
        if found[worst][1] < NEAR:
            break
        found[worst] = of(parts[worst], found[worst][0].shape[2] + 1)
    return [x for x, _ in found]


@dataclass(frozen=True)
class _Part:
    """Samples of a part on one side of the surface, for light from nodes: energies (nodes, 3); the sine of their
    direction; directions (3, nodes, samples), in the plane of incidence, upwards; densities over those of samples,
    which are last, 0 on the other side."""

    energy: Array
    sine: Array
    w: Array
    ratio: Array
    density: Array

    @classmethod
    def of(cls, body: Body, wi: Direction, asked: Query) -> _Part:
        nodes = len(wi[0])
        u = at_nodes(nodes, SAMPLES)
        repeat = tuple(repeated(x, SAMPLES) for x in wi)
        wo, _ = body.sample(repeat, *u, asked)
        value, density = body.eval_pdf(repeat, wo, asked)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0)
        weight = np.broadcast_to(weight, (3, nodes * SAMPLES)).reshape(3, nodes, SAMPLES)
        w = np.array(np.broadcast_arrays(*wo)).reshape(3, nodes, SAMPLES)
        ratio = weight.mean(axis=0)
        ratio = ratio / np.maximum(ratio.mean(axis=-1, keepdims=True), 1e-12)
        sine = np.hypot(wi[0], wi[1])
        c, s = (wi[0] / sine)[:, None], (wi[1] / sine)[:, None]
        up = np.sign(wi[2])[:, None] * (-1 if asked.transmission else 1) * w[2]
        w = np.stack([c * w[0] + s * w[1], c * w[1] - s * w[0], np.abs(up)])
        density = np.where(up > 0, np.broadcast_to(density, nodes * SAMPLES).reshape(nodes, SAMPLES), 0)
        return cls(weight.mean(axis=-1).T, sine, w, ratio, density)

    def blurs(self, count: int) -> tuple[Array, float]:
        """So many blurs (nodes, count, 4), and the mean over nodes of their distance times energy and alpha, since
        environments differ less over small angles."""
        isotropic = len(self.sine) == LINE[0]
        few = slice(None, None, 1 if isotropic else 4)
        w, ratio, density = self.w[..., few], self.ratio[:, few], self.density[:, few]
        start, kept = self._start(count), set[int]()
        if isotropic:
            start[..., 1], kept = 0, {1}  # in the plane of incidence
        found = blurs.fitted(start, self.sine, w, ratio, density, kept)
        if count > 1:
            # Each of one alpha from all directions, so that neighbours read the same level of a texture
            weight = self.energy.max(axis=-1)[:, None] * found[..., 3]
            found[..., 2] = (weight * found[..., 2]).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-12)
            found = blurs.fitted(found, self.sine, w, ratio, density, kept | {2})
        distance = blurs.distance(found, self.sine, w, ratio, density)
        alpha = (found[..., 2] ** 2 * found[..., 3]).sum(axis=-1)
        return found, float(np.mean(distance * self.energy.max(axis=-1) * alpha))

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
    x, y, root, share = np.moveaxis(part, -1, 0)
    light = energy.max(axis=-1)[..., None]
    # Half the integral of the difference of densities of narrow blurs
    place, width = light * share / (4 * root**2), light * share / root
    moved = np.stack([place, place, width, light + 0 * share], axis=-1).max(axis=(0, 1))
    return np.concatenate([np.ones((1, 4)), np.maximum(moved, 1e-6)])
