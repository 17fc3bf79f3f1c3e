"""Light that a medium scatters where nothing about it refracts much: fog, dust, matt paint.

Of a homogeneous medium of optical depth tau and albedo a, with cosines z_i and z_o and the angle Theta between the
directions of travel, light that is scattered once is reflected as (Chandrasekhar 1960)

    f = a p(cos Theta) (1 - exp(-tau (1 / z_i + 1 / z_o))) / (z_i + z_o).

Light that is scattered a few times keeps much of that form, by phase functions that are wider: the n-th of Henyey and
Greenstein's with itself has the asymmetry g^n. So there are two more terms, of g^2 and g^4, whose shares are fitted to
the nodes, and the remainder is what is left of that. All of it is reciprocal.

A medium alone passes light, too. Small deflections hardly change slants, so that light which is scattered n times on
its way passes as

    f = C_n p_n(cos Theta) (P_n(tau / z_o) - P_n(tau / z_i)) / (n (z_i - z_o)),
    P_n(x) = 1 - exp(-x) (1 + x + ... + x^(n-1) / (n-1)!),

with C_1 = a exactly, and p_n of the asymmetry g^n; C_n is fitted likewise, beside a polynomial of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.solved.energies.media import ORDERS, escaping, passing, power
from velatura.model.solved.guards import G_MAX
from velatura.model.solved.lobes.remainder import Remainder, RemainderSamples, grazing
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction, deflect
from velatura.stack import SlabValues

Array = NDArray[np.floating]
Medium = TypeVar("Medium", bound="TopMedium")

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
    def of(cls: type[Medium], layer: SlabValues | None, phase: PhaseFunction, shares: Sequence[Value]) -> Medium:
        """A medium in any dialect; without one, one that scatters nothing. No lobe is narrower than single precision
        and nodes resolve."""
        g = ops.clip(layer.g, -G_MAX, G_MAX) if layer else 0.0
        wider = tuple(HenyeyGreenstein(power(g, n)) for n in ORDERS)
        phase, _ = phase.widened(G_MAX)
        if layer is None:
            return cls(0.0, 1.0, phase, wider, tuple(shares))
        depth = layer.tau_a + layer.tau_s
        return cls(ops.divide(layer.tau_s, depth), depth, phase, wider, tuple(shares))

    @property
    def drawn(self) -> tuple[PhaseFunction, ...]:
        """Phase functions that samples are drawn by, in equal shares."""
        return self.phase, self.wider[0]

    def lattice(self, wi: Direction, even: Direction, u1: Array, u2: Array) -> tuple[Direction, Array]:
        """Directions wo above in NumPy, (M, K), `even` ones (N,) and as many by each phase function, and the density of
        them all; those change smoothly with wi, (M, 1) each."""
        folded = [even]
        for phase in self.drawn:
            x, y, z = deflect((-1 * wi[0], -1 * wi[1], -1 * wi[2]), phase.sample(u1), 2 * pi * u2)
            folded.append((x, y, np.abs(z)))
        shape = len(wi[2]), len(u1)
        x, y, z = (np.concatenate([np.broadcast_to(each, shape) for each in w], axis=1) for w in zip(*folded))
        return (x, y, z), np.sum([*self.densities(wi, (x, y, z)), 0 * z + 1 / (2 * pi)], axis=0) / len(folded)

    def densities(self, wi: Direction, wo: Direction) -> list[Value]:
        """Densities of light that phase functions draw, folded up, in directions wo above."""
        x, y, z = wo
        cosines = [-1 * ggx.dot(wi, w) for w in ((x, y, z), (x, y, -1 * z))]
        return [phase.density(cosine) for phase in self.drawn for cosine in cosines]

    def value(self, wi: Direction, wo: Direction) -> Value:
        """f(wi, wo), a colour, of directions above."""
        cosine = -1 * ggx.dot(wi, wo)
        scattered = self.albedo * self.phase.density(cosine)
        for share, phase in zip(self.shares, self.wider):
            scattered = scattered + share * phase.density(cosine)
        return scattered * escaping(self.depth, wi[2], wo[2])  # model.md, Eq. 11


class PassedMedium(TopMedium):
    """A medium alone, by what it passes: directions below are turned up."""

    @property
    def drawn(self) -> tuple[PhaseFunction, ...]:
        return self.phase, *self.wider

    def value(self, wi: Direction, wo: Direction) -> Value:
        cosine = wi[2] * wo[2] - wi[0] * wo[0] - wi[1] * wo[1]
        terms = zip((self.albedo, *self.shares), (self.phase, *self.wider), passing(self.depth, wi[2], wo[2]))
        first, *others = (share * phase.density(cosine) * light for share, phase, light in terms)
        return sum(others, first)  # model.md, Eq. 12


@dataclass(frozen=True)
class TopSamples(ops.NamedFields):
    """Samples of a remainder and of what a medium scatters, by its own phase function and by wider ones, `chance` being
    the share of all these; what goes down is thrown back up."""

    rest: RemainderSamples
    top: TopMedium
    chance: Value

    def density(self, wi: Direction, wo: Direction) -> Value:
        """Density of `sample`, of directions above."""
        first, *others = self.top.densities(wi, wo)
        scattered = ops.select(wo[2] > 0, self.chance * (1 / len(self.top.drawn)) * sum(others, first), 0.0)
        return (1 - self.chance) * self.rest.density(wi, wo) + scattered

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value) -> Direction:
        """A direction wo from uniform numbers."""
        chance = self.chance
        by_phase = u < chance
        x, y, z = self.rest.sample(wi, ops.clip(ops.divide(u - chance, 1 - chance), 0.0, 1.0), u1, u2)
        *drawn, cosine = (phase.sample(u1) for phase in self.top.drawn)
        count = len(drawn) + 1
        for k in reversed(range(len(drawn))):
            cosine = ops.select(u < chance * ((k + 1) / count), drawn[k], cosine)
        w = deflect((-1 * wi[0], -1 * wi[1], -1 * wi[2]), cosine, 2 * pi * u2)
        either = zip((w[0], w[1], ops.absolute(w[2])), (x, y, z))
        x, y, z = (ops.select(by_phase, a, b) for a, b in either)
        return x, y, z


@dataclass(frozen=True)
class ScatteredThrough(ops.NamedFields):
    """Light that a medium alone passes with events: a polynomial, and what is apart from it; where code is for others,
    too, `is_alone` is 1 or 0."""

    polynomial: Remainder
    medium: PassedMedium
    is_alone: Value = 1.0


@dataclass(frozen=True)
class PassedSamples:
    """Light from one direction that a medium alone passes with events, and its samples; those below are turned up."""

    light: ScatteredThrough
    samples: TopSamples

    diffuse = 1.0

    @classmethod
    def of(cls, light: ScatteredThrough, chance: Value) -> PassedSamples:
        chance = ops.clip(chance, 0.0, MOST)
        return cls(light, TopSamples(light.polynomial.samples, light.medium, chance))

    def eval_pdf(self, i: Direction, o: Direction) -> tuple[Value, Value]:
        """f |cos theta_o|, a colour, and the density of `sample`."""
        return value(self.light.polynomial, self.light.medium, i, o), self.samples.density(i, o)

    def sample(self, i: Direction, u: Value, u1: Value, u2: Value) -> Direction:
        return self.samples.sample(i, u, u1, u2)


def value(rest: Remainder, top: TopMedium, wi: Direction, wo: Direction) -> Value:
    """f(wi, wo) |cos theta_o| of a remainder and of what a medium scatters, a colour; 0 unless both are above the
    surface."""
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
