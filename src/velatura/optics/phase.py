"""Phase functions of media.

`cos_theta` is the cosine between the directions of travel before and after scattering: 1 goes straight on.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass
from math import cos, pi, sqrt
from typing import Any

from velatura import ops
from velatura.ops import Value
from velatura.optics.ggx import Direction

G_MIN = 1e-3  # where it scatters evenly, and a division by g would be one by 0


class PhaseFunction(ABC):
    """A distribution over the sphere of the directions that light is scattered into, by their angle to its own."""

    @abstractmethod
    def density(self, cos_theta: Value) -> Value:
        """Density per solid angle, in 1/sr."""

    @abstractmethod
    def sample(self, u: Value) -> Value:
        """Cosine drawn by a uniform u in [0, 1)."""

    @abstractmethod
    def within(self, angle: float) -> float:
        """Share of scattered light that is deflected by less than an angle (radians)."""

    @property
    @abstractmethod
    def key(self) -> Hashable:
        """Equal for phase functions of numbers that are the same."""

    def widened(self, g: float) -> tuple[PhaseFunction, Value]:
        """The phase function with no lobe narrower than of asymmetry g; and the share of scattered light that it is
        for, all other light going straight on (van de Hulst's similarity relation)."""
        return self, 1.0

    @staticmethod
    def selected(where: Value, yes: PhaseFunction | None, no: PhaseFunction | None) -> PhaseFunction | None:
        """`yes` where a condition holds, else `no`; the other one of None, which is that of a medium that scatters
        nothing. It is what `ops.select_record` calls."""
        if yes is None or no is None:
            return yes or no
        if isinstance(yes, HenyeyGreenstein) and isinstance(no, HenyeyGreenstein):
            return HenyeyGreenstein(ops.select_record(where, yes.g, no.g))
        return _Either(where, yes, no)


@dataclass(frozen=True)
class HenyeyGreenstein(PhaseFunction):
    """That of Henyey and Greenstein, by its asymmetry g in (-1, 1)."""

    g: Value

    def density(self, cos_theta: Value) -> Value:
        return henyey_greenstein(cos_theta, self.g)

    def sample(self, u: Value) -> Value:
        return sample_henyey_greenstein(self.g, u)

    def within(self, angle: float) -> float:
        g = float(self.g)
        if abs(g) < G_MIN:
            return (1 - cos(angle)) / 2
        chord = sqrt(1 + g * g - 2 * g * cos(angle))
        return (1 - g * g) / (2 * g) * (1 / (1 - g) - 1 / chord)

    @property
    def key(self) -> Hashable:
        return type(self), float(self.g)

    def widened(self, g: float) -> tuple[PhaseFunction, Value]:
        bounded = ops.clip(self.g, -g, g)
        return HenyeyGreenstein(bounded), ops.minimum((1 - self.g) / (1 - bounded), 1.0)


@dataclass(frozen=True)
class TwoLobes(PhaseFunction):
    """A share of one phase function of Henyey and Greenstein's, and the rest of another."""

    first: HenyeyGreenstein
    second: HenyeyGreenstein
    share: float

    def density(self, cos_theta: Value) -> Value:
        return self.share * self.first.density(cos_theta) + (1 - self.share) * self.second.density(cos_theta)

    def sample(self, u: Value) -> Value:
        of_first = u < self.share
        rest = ops.divide(ops.select(of_first, u, u - self.share), ops.select(of_first, self.share, 1 - self.share))
        return sample_henyey_greenstein(ops.select(of_first, self.first.g, self.second.g), rest)

    def within(self, angle: float) -> float:
        return self.share * self.first.within(angle) + (1 - self.share) * self.second.within(angle)

    @property
    def key(self) -> Hashable:
        return type(self), self.first.key, self.second.key, self.share

    def widened(self, g: float) -> tuple[PhaseFunction, Value]:
        (first, of_first), (second, of_second) = self.first.widened(g), self.second.widened(g)
        assert isinstance(first, HenyeyGreenstein) and isinstance(second, HenyeyGreenstein)
        left = self.share * of_first + (1 - self.share) * of_second
        return TwoLobes(first, second, self.share * of_first / left), left


@dataclass(frozen=True)
class Rayleigh(PhaseFunction):
    """That of particles far smaller than the wavelength, for unpolarised light: 3 / (16 pi) (1 + cos^2)."""

    def density(self, cos_theta: Value) -> Value:
        return 3 / (16 * pi) * (1 + cos_theta * cos_theta)

    def sample(self, u: Value) -> Value:
        # The root of c^3 + 3 c = 2 q, by Cardano, for q on the positive side, since for -q it is -c
        q = 4 * u - 2
        size = ops.absolute(q)
        root = ops.power(size + ops.sqrt(size * size + 1), 1 / 3)
        cosine = root - 1 / root
        return ops.clip(ops.select(q < 0, -1 * cosine, cosine), -1.0, 1.0)

    def within(self, angle: float) -> float:
        c = cos(angle)
        return (4 - 3 * c - c * c * c) / 8

    @property
    def key(self) -> Hashable:
        return type(self)


@dataclass(frozen=True)
class _Either(PhaseFunction):
    """One phase function where a condition holds, and elsewhere another."""

    where: Value
    yes: PhaseFunction
    no: PhaseFunction

    def density(self, cos_theta: Value) -> Value:
        return self._chosen(self.yes.density(cos_theta), self.no.density(cos_theta))

    def sample(self, u: Value) -> Value:
        return self._chosen(self.yes.sample(u), self.no.sample(u))

    def within(self, angle: float) -> float:
        return float(self._chosen(self.yes.within(angle), self.no.within(angle)))

    @property
    def key(self) -> Hashable:
        return type(self), bool(self.where), self.yes.key, self.no.key

    def _chosen(self, yes: Value, no: Value) -> Any:
        return ops.select(self.where, yes, no)


def henyey_greenstein(cos_theta: Value, g: Value) -> Value:
    """Density per solid angle, in 1/sr, for asymmetry g in (-1, 1)."""
    side = ops.select(g < 0, -1.0, 1.0)  # of the peak, about which rounding may have cosines beyond 1
    size = side * g
    d = (1 - size) * (1 - size) + 2 * size * ops.maximum(1 - side * cos_theta, 0.0)
    return (1 - g * g) / (4 * pi * d * ops.sqrt(d))


def forwards(g: Value) -> Value:
    """Share that is scattered into the half in front."""
    g = ops.select(ops.absolute(g) < G_MIN, G_MIN, g)
    return (1 + g) / (2 * g) * (1 - (1 - g) / ops.sqrt(1 + g * g))


def sample_henyey_greenstein(g: Value, u: Value) -> Value:
    """Cosine drawn from the phase function by a uniform u in [0, 1).

    The distribution function's inverse, (1 + g^2 - ((1-g^2)/(1+g s))^2) / (2g) with s = 2u-1, multiplied out: the
    division by g cancels, and all that is subtracted from the cosine of the peak is positive.
    """
    side, v = ops.select(g < 0, -1.0, 1.0), ops.select(g < 0, 1 - u, u)
    size = side * g
    d = 1 - size + 2 * size * v  # 1 + g s
    return side * (1 - (1 - size) * (1 - size) * (1 - v) * (1 + size + d) / (d * d))


def tangents(w: Direction) -> tuple[Direction, Direction]:
    """Two directions across `w`, which vary smoothly on either side of the surface (Duff et al. 2017)."""
    sign = ops.select(w[2] < 0, -1.0, 1.0)
    a = -1 / (sign + w[2])
    b = w[0] * w[1] * a
    return (1 + sign * w[0] * w[0] * a, sign * b, -sign * w[0]), (b, sign + w[1] * w[1] * a, -w[1])


def deflect(w: Direction, cos_theta: Value, phi: Value) -> Direction:
    """The direction of travel `w` turned by the angle of cosine `cos_theta`, at azimuth `phi` about it."""
    s, t = tangents(w)
    sin_theta = ops.sqrt(1 - cos_theta * cos_theta)
    x, y = sin_theta * ops.cos(phi), sin_theta * ops.sin(phi)
    return (
        x * s[0] + y * t[0] + cos_theta * w[0],
        x * s[1] + y * t[1] + cos_theta * w[1],
        x * s[2] + y * t[2] + cos_theta * w[2],
    )
