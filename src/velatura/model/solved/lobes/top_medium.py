"""Light that a medium scatters back where nothing above it refracts much: fog, dust, matt paint.

Of a homogeneous medium of optical depth tau and albedo a, with cosines z_i and z_o and the angle Theta between the
directions of travel, light that is scattered once is reflected as (Chandrasekhar 1960)

    f = a p(cos Theta) (1 - exp(-tau (1 / z_i + 1 / z_o))) / (z_i + z_o).

Light that is scattered a few times keeps much of that form, by phase functions that are wider: the n-th of Henyey and
Greenstein's with itself has the asymmetry g^n. So there are two more terms, of g^2 and g^4, whose shares are fitted to
the nodes, and the remainder is what is left of that. All of it is reciprocal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.solved.guards import COS_OF_DIRECTIONS_MIN
from velatura.model.solved.lobes.remainder import Remainder, RemainderSamples, grazing
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction, deflect
from velatura.stack import SlabValues

Array = NDArray[np.floating]

ORDERS = 2, 4  # powers of the asymmetry
MOST = 0.8  # of the samples of the remainder that are drawn by phase functions


@dataclass(frozen=True)
class TopMedium(ops.NamedFields):
    """A medium by its albedo and optical depth, its phase function and wider ones, and their shares; all but phase
    functions are colours."""

    albedo: Value
    depth: Value
    phase: PhaseFunction
    wider: tuple[PhaseFunction, ...]
    shares: tuple[Value, ...]

    @classmethod
    def of(cls, layer: SlabValues | None, phase: PhaseFunction, shares: Sequence[Value]) -> TopMedium:
        """A medium in any dialect; without one, one that scatters nothing."""
        wider = tuple(HenyeyGreenstein(power(layer.g, n) if layer else 0.0) for n in ORDERS)
        if layer is None:
            return cls(0.0, 1.0, phase, wider, tuple(shares))
        depth = layer.tau_a + layer.tau_s
        return cls(ops.divide(layer.tau_s, depth), depth, phase, wider, tuple(shares))

    def value(self, wi: Direction, wo: Direction) -> Value:
        """f(wi, wo), a colour, of directions above."""
        cosine = -1 * ggx.dot(wi, wo)
        scattered = self.albedo * self.phase.density(cosine)
        for share, phase in zip(self.shares, self.wider):
            scattered = scattered + share * phase.density(cosine)
        return scattered * escaping(self.depth, wi[2], wo[2])  # model.md, Eq. 11


@dataclass(frozen=True)
class TopSamples(ops.NamedFields):
    """Samples of a remainder and of what the medium on top scatters back, half of these by its own phase function and
    half by a wider one, `chance` being the share of both; what goes down is thrown back up."""

    rest: RemainderSamples
    top: TopMedium
    chance: Value

    @property
    def drawn(self) -> tuple[PhaseFunction, PhaseFunction]:
        return self.top.phase, self.top.wider[0]

    def density(self, wi: Direction, wo: Direction) -> Value:
        """Density of `sample`, of directions above."""
        x, y, z = wo
        cosines = [-1 * ggx.dot(wi, w) for w in ((x, y, z), (x, y, -1 * z))]
        own, wider = (sum(map(phase.density, cosines)) for phase in self.drawn)
        scattered = ops.select(z > 0, 0.5 * self.chance * (own + wider), 0.0)
        return (1 - self.chance) * self.rest.density(wi, wo) + scattered

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value) -> Direction:
        """A direction wo from uniform numbers."""
        chance = self.chance
        by_phase = u < chance
        x, y, z = self.rest.sample(wi, ops.clip(ops.divide(u - chance, 1 - chance), 0.0, 1.0), u1, u2)
        own, wider = (phase.sample(u1) for phase in self.drawn)
        cosine = ops.select(u < 0.5 * chance, own, wider)
        w = deflect((-1 * wi[0], -1 * wi[1], -1 * wi[2]), cosine, 2 * pi * u2)
        drawn = zip((w[0], w[1], ops.absolute(w[2])), (x, y, z))
        x, y, z = (ops.select(by_phase, a, b) for a, b in drawn)
        return x, y, z


def power(g: Value, n: int) -> Value:
    """A whole power of a number of any sign."""
    found = g
    for _ in range(n - 1):
        found = found * g
    return found


def escaping(depth: Value, z_i: Value, z_o: Value) -> Value:
    """Light that passes a medium to a place and back, (1 - exp(-tau (1 / z_i + 1 / z_o))) / (z_i + z_o)."""
    z_i, z_o = (ops.maximum(z, COS_OF_DIRECTIONS_MIN) for z in (z_i, z_o))
    return (1 - ops.exp(-depth * (1 / z_i + 1 / z_o))) / (z_i + z_o)


def value(rest: Remainder, top: TopMedium, wi: Direction, wo: Direction) -> Value:
    """f(wi, wo) |cos theta_o| of a remainder and of what the medium on top scatters back, a colour; 0 unless both are
    above the surface."""
    z = ops.select(wi[2] > 0, ops.maximum(wo[2], 0.0), 0.0)
    return ops.maximum(top.value(wi, wo) + rest.unclipped(wi, wo)[1] * (1 / pi), 0.0) * z


def chances(cosines: Array, energy: Array, whole: Array, wanted: Array) -> Array:
    """Share of samples (M,) that phase functions draw at the cosines `wanted` (M,), by energies (C, N) at some cosines:
    that of the medium on top, and that of all of the remainder. It is smooth over the cosine."""
    share = np.clip(np.mean(energy, axis=0) / np.maximum(np.mean(whole, axis=0), ops.TINY), 0, MOST)
    numbers = np.linalg.lstsq(_basis(cosines), share, rcond=None)[0]
    return np.asarray(np.clip(_basis(wanted) @ numbers, 0, MOST))


def _basis(cosines: Array) -> Array:
    return np.stack([np.ones_like(cosines), cosines, grazing(cosines)], axis=-1)
