"""A stack's light over directions, at nodes that resolve lobes of any width, and how far other light is from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura.light.square_bins import grids
from velatura.model import Model
from velatura.model.base import Query
from velatura.optics import fresnel, ggx, refraction
from velatura.programs.closures import ALPHA_MIN, ViewAndLight
from velatura.programs.from_stack import Described, Facets
from velatura.renderer.low_discrepancy import square

Array: TypeAlias = NDArray[np.floating]

#: Lobes that nodes are drawn from, beside the cosine and those of the stack.
WIDTHS: tuple[Facets, ...] = tuple((alpha, alpha, 0.0) for alpha in (0.0015, 0.006, 0.02, 0.07, 0.25, 0.7))


@dataclass(frozen=True)
class Sampled:
    """Values f |cos theta_o| (3, N) of a stack at pairs of directions, of weights (N,) that integrate them.

    `which` (N,) is the number of each pair's direction of incidence, of `count`; `share` (M,) are the weights of those,
    which add up to 1: the areas of a sphere that are seen so.
    """

    pair: ViewAndLight
    weight: Array
    which: NDArray[np.intp]
    count: int
    share: Array
    value: Array

    @classmethod
    def of(cls, stack: Described, model: Model, wi: Array, nodes: int) -> Sampled:
        """The light of a material for wi (M, 3), at about so many nodes for each."""
        body = stack.body(model)
        drawn = (*WIDTHS, *((max(u, ALPHA_MIN), max(v, ALPHA_MIN), turn) for u, v, turn in stack.brushed))
        each = [_nodes(w, stack.below or 0.0, nodes, drawn) for w in wi]
        which = np.repeat(np.arange(len(wi)), [wo.shape[1] for wo, _ in each])
        pair = ViewAndLight(wi[which].T, np.concatenate([wo for wo, _ in each], axis=1))
        value, _ = body.eval_pdf(tuple(pair.wi), tuple(pair.wo), Query(radiance=False))
        value = np.maximum(np.broadcast_to(value, pair.wi.shape), 0.0)
        weight = np.concatenate([weight for _, weight in each])
        return cls(pair, weight, which, len(wi), wi[:, 2] / wi[:, 2].sum(), value)

    def energy(self, value: Array, up: bool = True) -> Array:
        """The energy that is reflected, or transmitted, (3, M)."""
        light = value * self.weight * ((self.pair.wo[2] > 0) == up)
        return np.array([np.bincount(self.which, channel, self.count) for channel in light])

    def distribution(self, value: Array) -> Array:
        """Energies of reflected light (3, M, bins, bins), over the projected disc."""
        up = self.pair.wo[2] > 0
        light = (value * self.weight)[:, up]
        return grids(self.pair.wo[:2, up], light, self.which[up], self.count)

    @cached_property
    def _scale(self) -> Array:
        """Square roots of weights over the light of each direction of incidence, reflected or transmitted, (N,)."""
        sides = [each.mean(axis=0) for each in self._energies]
        count = max(sum(side.max() > 0 for side in sides), 1)  # of black materials, too
        share = [self.share / (count * np.maximum(side, FAINT)) for side in sides]
        return np.asarray(np.sqrt(self.weight * np.where(self.pair.wo[2] > 0, *(side[self.which] for side in share))))

    @cached_property
    def _root(self) -> Array:
        return self._scale * np.sqrt(self.value + 1e-9)

    @cached_property
    def _energies(self) -> tuple[Array, Array]:
        return self.energy(self.value), self.energy(self.value, up=False)

    def residuals(self, value: Array) -> Array:
        """Differences whose squares add up to the squared Hellinger distance of both lights, and those of energies."""
        apart = self._scale * np.sqrt(np.maximum(value, 0) + 1e-9) - self._root
        energies = [self.energy(value, up) - own for up, own in zip((True, False), self._energies)]
        return np.concatenate([apart.ravel(), *((ENERGY * np.sqrt(self.share) * x).ravel() for x in energies)])


ENERGY = 5.0  # weight of an error of energy beside that of its place
FAINT = 0.01  # energy below which light counts less


def _nodes(wi: Array, eta: float, count: int, lobes: Sequence[Facets]) -> tuple[Array, Array]:
    """Directions wo (3, N) and their weights, above the surface and, for eta > 0, below, where it is the index there.

    Each is drawn from one of several lobes; its weight is the inverse of the mean density of all (the balance
    heuristic).
    """
    share = count // (len(lobes) + 1)
    u1, u2 = square(share)
    x, y, z = wi[:, None] * np.ones(share)
    halves = [ggx.rotate(ggx.sample_visible(ggx.rotate((x, y, z), turn), u, v, u1, u2), -turn) for u, v, turn in lobes]
    radius, phi = np.sqrt(u1), 2 * pi * u2
    cosine = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - u1)])

    def weighed(drawn: list[Array], side: float, facets: Callable[[Array], list[Array]]) -> tuple[Array, Array]:
        wo = np.concatenate([*drawn, cosine * np.array([[1], [1], [side]])], axis=1)
        wo = wo[:, wo[2] * side > 1e-4]
        return wo, 1 / (share * (np.sum(facets(wo), axis=0) + np.abs(wo[2]) / pi))

    above = weighed([np.stack(ggx.reflect((x, y, z), h)) for h in halves], 1.0, lambda wo: _densities(wi, wo, 1, lobes))
    if not eta:
        return above
    if abs(eta - 1) < 1e-3:
        mirror = np.array([[1], [1], [-1]])
        return np.concatenate([above[0], above[0] * mirror], axis=1), np.tile(above[1], 2)
    below = weighed([_refract(wi, np.stack(h), eta) for h in halves], -1.0, lambda wo: _densities(wi, wo, eta, lobes))
    return np.concatenate([above[0], below[0]], axis=1), np.concatenate([above[1], below[1]])


def _refract(wi: Array, h: Array, eta: float) -> Array:
    """Refracted directions; a cosine of 0, which is left out, under total reflection."""
    cosine = wi @ h
    passes = (cosine > 0) & (fresnel.cos_transmitted(cosine, eta) > 0)
    return np.where(passes, np.stack(refraction.refract(tuple(wi), tuple(h), eta)), 0.0)


def _densities(wi: Array, wo: Array, eta: float, lobes: Sequence[Facets]) -> list[Array]:
    """Densities of wo sent there by the visible facets of each lobe: by refraction, or by reflection where eta = 1."""
    i, o = tuple(wi[:, None]), tuple(wo)
    h = refraction.half_vector(i, o, eta)
    cos_i, cos_o = ggx.dot(i, h), ggx.dot(o, h)
    kept = (cos_i > 0) & ((cos_o > 0) == (eta == 1))
    scale = kept * cos_i * refraction.jacobian(cos_i, cos_o, eta) / wi[2]

    def visible(u: float, v: float, turn: float) -> Array:
        return np.asarray(ggx.ndf(ggx.rotate(h, turn), u, v) * ggx.masking(ggx.rotate(i, turn), u, v))

    return [scale * visible(*lobe) for lobe in lobes]
