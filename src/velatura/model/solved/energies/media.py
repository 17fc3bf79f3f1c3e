"""Media as operators on light, by doubling thin layers with events drawn from their phase functions."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import factorial, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.media.of_material import phase_of
from velatura.model.rough_interface import Light, colours, in_units
from velatura.model.solved.energies.interfaces import Setting, scaled
from velatura.model.solved.energies.modes import Basis
from velatura.model.solved.energies.operators import Layer, Operator
from velatura.model.solved.guards import (
    BELOW_ONE,
    COS_IN_MEDIA_MIN,
    COS_OF_DIRECTIONS_MIN,
    G_MAX,
    SIN_IN_MEDIA_MAX,
    TINY,
)
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction, deflect
from velatura.renderer.compiled import Number
from velatura.renderer.low_discrepancy import fibonacci
from velatura.stack import SlabValues

Array = NDArray[np.floating]

Straight = Callable[[PhaseFunction], float]  # share of scattered light that counts as going straight on

THIN = 1e-4  # depth of the first layer, which scatters once at most: errors go as this depth
EVENTS = 600
FINE_EVENTS = 1597  # where the shape of light counts, and of these
EVEN = 0.4  # in all directions alike, where few are drawn by a phase function with a peak
HORIZON = 0.005  # cosine of directions that lie on both sides in part
ORDERS = 2, 4  # numbers of events that are known in closed form, beside one
NEAR = 1.0  # difference of two depths, within which a mean over it is by quadrature
GAUSS = (0.5 - sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + sqrt(0.15), 5 / 18)  # nodes and weights


@dataclass(frozen=True)
class Slab:
    """A medium of index n, by optical depths of absorption and scattering along the normal (C,), and phase function.

    `straight` is the share of scattered light that counts as going straight on, where no other scattered light is
    followed; None to follow it all.
    """

    n: float
    tau_a: Array
    tau_s: Array
    phase: PhaseFunction
    straight: float | None = None

    @classmethod
    def of(cls, layer: SlabValues, n: float, straight: Straight | None) -> Slab:
        """A medium of NumPy's values; `straight` gives the share that goes straight on by the phase function."""
        tau_a, tau_s = colours(layer.tau_a), colours(layer.tau_s)
        phase = phase_of(layer)
        if isinstance(phase, HenyeyGreenstein):
            phase = HenyeyGreenstein(float(np.mean(phase.g)))
        return cls(n, tau_a, tau_s, phase, None if straight is None else straight(phase))

    def key(self, unit: float) -> Hashable:
        """All values, with the index as a multiple of a unit."""
        return in_units(self.n, unit), self.tau_a.tobytes(), self.tau_s.tobytes(), self.phase.key, self.straight


def medium(slab: Slab, setting: Setting) -> Layer:
    """A medium as a layer; it looks alike from both sides."""
    slab = _resolved(slab)
    lost = slab.tau_a + (1 - (slab.straight or 0.0)) * slab.tau_s
    if slab.straight is not None or not slab.tau_s.any():
        t = scaled(partial(_kept, slab, lost), setting)
        nothing = Operator.nothing(setting.basis.size, len(setting.p))
        return Layer(nothing, t, nothing, t)
    doublings = max(int(np.ceil(np.log2(lost.max() / THIN))), 0)
    r, t = _thin(slab, lost / 2**doublings, setting)
    for _ in range(doublings):
        between = (r @ r).repeated(trapped=0.0)
        r, t = r + t @ r @ between @ t, t @ between @ t
    return Layer(r, t, r, t)


def _resolved(slab: Slab) -> Slab:
    """The slab whose light goes straight on where it turns by less than nodes resolve."""
    phase, share = slab.phase.widened(G_MAX)
    return replace(slab, tau_s=slab.tau_s * share, phase=phase)


def _thin(slab: Slab, depth: Array, setting: Setting) -> tuple[Operator, Operator]:
    """A layer so thin that light scatters there once at most."""
    kept = partial(_kept, slab, depth)
    albedo = (slab.tau_s / np.maximum(slab.tau_a + slab.tau_s, TINY))[:, None]
    basis = setting.basis
    p, psi = np.tile(basis.nodes.p, len(basis.azimuths)), np.repeat(basis.azimuths, basis.nodes.count)
    sources = ((p, psi), (setting.p, basis.relative(setting.phi, 0.0)))
    shares = [(albedo * (1 - kept(q)))[:, None, None] for q, _ in sources]
    nodes, beams = (_scattered(slab, *source, setting) for source in sources)
    up, down = (
        Operator.of(basis.operators(a * shares[0], 0.0), basis.columns(b * shares[1], 0.0))
        for a, b in zip(nodes, beams)
    )
    return up, scaled(kept, setting) + down


def _kept(slab: Slab, depth: Array, p: Array) -> Array:
    """Share (C, ...) of light of momenta p that passes a depth (C,); none has more than the medium's index."""
    cosine = np.sqrt(np.maximum(1 - (p / slab.n) ** 2, COS_IN_MEDIA_MIN**2))
    return np.asarray(np.exp(-depth[:, None] / cosine))


def _scattered(slab: Slab, p: Array, psi: Array, setting: Setting) -> tuple[Array, ...]:
    """Light that is scattered up, and down, of light of one unit that travels down, (1, modes, N, S); kept for other
    media."""
    momenta = (in_units(each, setting.unit) for each in (slab.n, p, setting.basis.nodes.ends))
    key = _scattered, slab.phase.key, setting.events, *momenta, psi.tobytes()
    lattice = _lattice(slab.phase, setting.events)
    return tuple(
        setting.kept(key, lambda: setting.basis.deposited(_events, p, psi, lattice, [Number(slab.n)], _events)[0])
    )


def _lattice(phase: PhaseFunction, finely: bool) -> tuple[Array, Array, Array]:
    """Cosines and azimuths, in turns, of events of a phase function, and the share of light of each."""
    u_1, u_2 = fibonacci(FINE_EVENTS if finely else EVENTS)
    if not finely:
        return phase.sample(u_1), u_2, np.full(len(u_1), 1 / len(u_1))
    drawn = u_1 < 1 - EVEN
    cosine = np.where(drawn, phase.sample(np.minimum(u_1 / (1 - EVEN), BELOW_ONE)), 2 * (u_1 - 1 + EVEN) / EVEN - 1)
    density = phase.density(cosine)
    share = density / ((1 - EVEN) * density + EVEN / (4 * pi))
    return cosine, u_2, share / share.sum()


def _events(
    sources: Sequence[Value], samples: Sequence[Value], numbers: Sequence[Value]
) -> tuple[list[Light], list[Value]]:
    (p, psi), (cosine, u_2, share), (n,) = sources, samples, numbers
    x, y, z = _deflected(p, psi, cosine, u_2, n)
    # A direction that crosses the horizon goes over from one side to the other, so that light does not jump
    down = ops.clip(0.5 * (1 + z / HORIZON), 0.0, 1.0)
    return [Light(n * x, n * y, [side * share]) for side in (1 - down, down)], []


def _deflected(p: Value, psi: Value, cosine: Value, u_2: Value, n: Value) -> Direction:
    """Direction of travel, downwards, of light of momentum p at an azimuth, after an event in a medium of index n."""
    sin = ops.minimum(p / n, SIN_IN_MEDIA_MAX)
    w = sin * ops.cos(psi), sin * ops.sin(psi), ops.sqrt(1 - sin * sin)
    return deflect(w, cosine, 2 * pi * u_2)


def escaped(phase: PhaseFunction, depth: Array, basis: Basis, p: Array, through: int | None = None) -> list[Array]:
    """Light (C, modes, N, S) that a medium of an optical depth (C,) scatters back once by a phase function, without
    loss in an event, of one unit from outside of momenta p (S,); and what it passes so, of the number of events that
    `passing` has in the place `through`, None for nothing."""

    def escapes(
        sources: Sequence[Value], samples: Sequence[Value], depths: Sequence[Value]
    ) -> tuple[list[Light], list[Value]]:
        (p, psi), (cosine, u_2, share) = sources, samples
        x, y, z = _deflected(p, psi, cosine, u_2, 1.0)
        up, down, z_i = ops.maximum(-1 * z, 0.0), ops.maximum(z, 0.0), ops.sqrt(1 - p * p)
        lights = [Light(x, y, [share * up * escaping(depth, z_i, up) for depth in depths])]
        if through is not None:
            lights.append(Light(x, y, [share * down * passing(depth, z_i, down)[through] for depth in depths]))
        return lights, []

    lattice, numbers = _lattice(phase, True), [*map(Number, depth)]
    return basis.deposited(escapes, p, np.zeros_like(p), lattice, numbers, (escaped, through))[0]


# Few events, in closed form


def power(x: Value, n: int) -> Value:
    """A whole power of a number of any sign."""
    found: Value = 1.0
    for k in range(n):
        found = found * x if k else x
    return found


def escaping(depth: Value, z_i: Value, z_o: Value) -> Value:
    """Light that passes a medium to a place and back, (1 - exp(-tau (1 / z_i + 1 / z_o))) / (z_i + z_o)."""
    z_i, z_o = (ops.maximum(z, COS_OF_DIRECTIONS_MIN) for z in (z_i, z_o))
    return (1 - ops.exp(-depth * (1 / z_i + 1 / z_o))) / (z_i + z_o)


def passing(depth: Value, z_i: Value, z_o: Value) -> list[Value]:
    """Light that passes a medium with one event, and with each number of `ORDERS`,
    (P_n(tau / z_o) - P_n(tau / z_i)) / (n (z_i - z_o))."""
    z_i, z_o = (ops.maximum(z, COS_OF_DIRECTIONS_MIN) for z in (z_i, z_o))
    counts, x_i, x_o = (1, *ORDERS), depth / z_i, depth / z_o
    # Where both are alike, by the mean over the depths between, of exp(-x) x^(n-1) / (n-1)!
    near = ops.absolute(ops.mean(depth) * (z_i - z_o)) < NEAR * z_i * z_o
    between = [(weight, x_o + u * (x_i - x_o)) for u, weight in GAUSS]
    kept = [(weight * ops.exp(-x), x) for weight, x in between]
    alike = depth / (z_i * z_o)
    apart = 1 / ops.select(near, 1.0, z_i - z_o)
    lost_i, lost_o = (ops.exp(-x) for x in (x_i, x_o))
    found = []
    for n in counts:
        first, *others = (light * power(x, n - 1) for light, x in kept)
        mean = sum(others, first) * (1 / factorial(n - 1))
        difference = lost_i * _exponential(x_i, n) - lost_o * _exponential(x_o, n)
        found.append(ops.select(near, alike * mean, apart * difference) * (1 / n))
    return found


def _exponential(x: Value, terms: int) -> Value:
    """The first terms of the series of exp(x)."""
    total: Value = 1.0
    for k in range(terms - 1, 0, -1):
        total = 1 + total * x * (1 / k)
    return total
