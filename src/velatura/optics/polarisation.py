"""Polarised light: its Stokes parameters, and what facets make of them, as of all light that may come in.

Light that travels along `w` is described in a frame of two directions across it, x and y = w times x: x, y and w are
right-handed. Its parameters are q, the intensity along x less that along y, u, the same in a frame turned by 45
degrees from x to y, and v = 2 Im(E_x conj(E_y)), all over the intensity: unpolarised light has q = u = v = 0, and
q^2 + u^2 + v^2 is at most 1 (Born and Wolf 1999, section 1.4.2). Depolarisation by media and diffuse bases is complete.

A facet's own frame has x along the normal of the plane of incidence, before and after, so that x is s and y is p.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.fresnel import Complex
from velatura.optics.ggx import Direction

if TYPE_CHECKING:
    from typing_extensions import Self

_STRAIGHT = 1e-8  # square of the sine up to which incidence is normal, where any plane is one of incidence


class Light(ABC):
    """Parameters in the frame whose first direction is `x`; see above."""

    x: Direction

    @abstractmethod
    def _turned(self, x: Direction, turn: Callable[[Value, Value, Value], tuple[Value, Value, Value]]) -> Self:
        """The light in another frame, where `turn` gives q, u and v."""

    @abstractmethod
    def depolarised(self, w: Direction) -> Self:
        """The light once something has scattered it along w, and depolarised it."""

    @abstractmethod
    def share(self, facet: Mueller) -> Value:
        """Share of the light that a facet sends on."""

    @abstractmethod
    def sent(self, facet: Mueller) -> Self:
        """The light that a facet has sent on."""

    def mirrored(self, where: Value) -> Self:
        """The parameters in a mirror in the plane of z where the condition holds: x is turned, and right is left."""
        x = self.x[0], self.x[1], ops.select(where, -self.x[2], self.x[2])
        return self._turned(x, lambda q, u, v: (q, ops.select(where, -u, u), ops.select(where, -v, v)))

    @property
    def inverted(self) -> Self:
        """The parameters with all directions turned around, of travel too: x and y keep axes, right is left."""
        return self._turned(self.x, lambda q, u, v: (q, -u, -v))

    def seen_by(self, into: Callable[[Direction], Direction]) -> Self:
        """The parameters in the coordinates that a rotation leads to."""
        return self._turned(into(self.x), lambda q, u, v: (q, u, v))

    def along(self, w: Direction, x: Direction) -> Self:
        """The parameters in the frame of another first direction x across the direction of travel w."""
        cosine, sine = ggx.dot(self.x, x), ggx.dot(ggx.cross(w, self.x), x)
        square = ops.maximum(cosine * cosine + sine * sine, ops.TINY)
        cos_2, sin_2 = (cosine * cosine - sine * sine) / square, 2 * cosine * sine / square
        return self._turned(x, lambda q, u, v: (cos_2 * q + sin_2 * u, cos_2 * u - sin_2 * q, v))

    def at(self, w: Direction, h: Direction) -> Self:
        """The parameters in the frame of a facet of normal h."""
        s = ggx.cross(w, h)
        square = ggx.dot(s, s)
        tilted = square > _STRAIGHT
        scale = 1 / ops.sqrt(ops.maximum(square, _STRAIGHT))
        x, y, z = (ops.select(tilted, scale * new, old) for new, old in zip(s, self.x))
        return self.along(w, (x, y, z))


@dataclass
class Polarisation(Light):
    """Stokes parameters of light over its intensity, colours."""

    x: Direction
    q: Value
    u: Value
    v: Value

    def _turned(self, x: Direction, turn: Callable[[Value, Value, Value], tuple[Value, Value, Value]]) -> Polarisation:
        return Polarisation(x, *turn(self.q, self.u, self.v))

    def depolarised(self, w: Direction) -> Polarisation:
        return unpolarised(w, self.q)

    def share(self, facet: Mueller) -> Value:
        return 0.5 * ((1 + self.q) * facet.s + (1 - self.q) * facet.p)

    def sent(self, facet: Mueller) -> Polarisation:
        share = self.share(facet)
        return Polarisation(
            self.x, *(ops.divide(part, share) for part in facet.times((1.0, self.q, self.u, self.v))[1:])
        )


Column = Sequence[Value]  # I, Q, U and V


@dataclass
class Transport(Light):
    """The Mueller matrix of all events on a way, over the product of the shares of unpolarised light that they send on.

    `columns` are what becomes of I, of Q, of U and of V, colours.
    """

    x: Direction
    columns: tuple[Column, ...]

    def _turned(self, x: Direction, turn: Callable[[Value, Value, Value], tuple[Value, Value, Value]]) -> Transport:
        return Transport(x, tuple((i, *turn(q, u, v)) for i, q, u, v in self.columns))

    def depolarised(self, w: Direction) -> Transport:
        return Transport(horizontal(w), tuple((i, 0.0 * i, 0.0 * i, 0.0 * i) for i, *_ in self.columns))

    def share(self, facet: Mueller) -> Value:
        return 0.5 * (facet.s + facet.p)

    def sent(self, facet: Mueller) -> Transport:
        sent = Transport(self.x, tuple(facet.times(column) for column in self.columns))
        return sent.times(ops.divide(1.0, self.share(facet)))

    def times(self, colour: Value) -> Transport:
        """The matrix times a colour."""
        return Transport(self.x, tuple(tuple(colour * part for part in column) for column in self.columns))

    def plus(self, other: Transport) -> Transport:
        """The sum with a matrix in the same frame."""
        pairs = zip(self.columns, other.columns)
        return Transport(self.x, tuple(tuple(map(sum, zip(*columns))) for columns in pairs))

    def after(self, first: Mueller) -> Transport:
        """The matrix of a way that begins with another event, whose matrix is in the frame that this one began in."""
        rows = [first.transposed.times(row) for row in zip(*self.columns)]
        return Transport(self.x, tuple(zip(*rows)))

    def joined(self, w: Direction, other: Transport) -> list[Value]:
        """The matrix, row by row, of this way along w and on by the `other` one, which was followed from its far end
        and arrives along -w: for light that goes it the other way, the matrix is transposed, and signs of U change."""
        met = self.along(w, other.x).columns
        signs = 1.0, 1.0, -1.0, 1.0
        return [
            sum(signs[row] * signs[k] * other.columns[row][k] * column[k] for k in range(4))
            for row in range(4)
            for column in met
        ]

    def rows(self, w: Direction) -> list[Value]:
        """The matrix, row by row, for frames whose x is `horizontal` at both ends, of light that travels along w."""
        columns = self.along(w, horizontal(w)).columns
        return [column[row] for row in range(4) for column in columns]


def all_light(w: Direction, colour: Value) -> Transport:
    """The matrix of a way along w without events, with channels as those of a colour."""
    none = 0.0 * colour
    columns = (tuple(none + (row == column) for row in range(4)) for column in range(4))
    return Transport(horizontal(w), tuple(columns))


def unpolarised(w: Direction, colour: Value) -> Polarisation:
    """Unpolarised light along w, with channels as those of a colour."""
    none = 0.0 * colour
    return Polarisation(horizontal(w), none, none, none)


def horizontal(w: Direction) -> Direction:
    """The direction across w and across z: s for a horizontal surface. That of y for a w along z."""
    cosine, sine = ggx.plane(w)
    return -sine, cosine, 0.0 * w[2]


@dataclass(frozen=True)
class Mueller:
    """The Mueller matrix of a facet, in its own frame.

    s, p: shares of the light of either polarisation; real, imaginary: of r_s conj(r_p), by which u + iv is multiplied.
    """

    s: Value
    p: Value
    real: Value
    imaginary: Value

    def times(self, stokes: Sequence[Value]) -> tuple[Value, Value, Value, Value]:
        """I, Q, U and V of the light that has gone this way."""
        i, q, u, v = stokes
        s, p = (i + q) * self.s, (i - q) * self.p
        return (
            0.5 * (s + p),
            0.5 * (s - p),
            u * self.real - v * self.imaginary,
            u * self.imaginary + v * self.real,
        )

    def __mul__(self, other: Mueller | Value) -> Mueller:
        """Matrix of this event and another in the same frame, as of parallel surfaces, in any order; or of a share of
        the light."""
        if not isinstance(other, Mueller):
            return Mueller(*(other * part for part in vars(self).values()))
        real = self.real * other.real - self.imaginary * other.imaginary
        imaginary = self.real * other.imaginary + self.imaginary * other.real
        return Mueller(self.s * other.s, self.p * other.p, real, imaginary)

    def __add__(self, other: Mueller) -> Mueller:
        """Matrix of both together."""
        return Mueller(*map(sum, zip(vars(self).values(), vars(other).values())))

    @property
    def transposed(self) -> Mueller:
        return Mueller(self.s, self.p, self.real, -self.imaginary)

    def repeated(self) -> Mueller:
        """Sum of all powers of the matrix, from 0 on: of light that goes round any number of times."""
        real = 1 - self.real
        square = real * real + self.imaginary * self.imaginary
        return Mueller(
            *(ops.divide(1.0, 1 - part) for part in (self.s, self.p)),
            *(ops.divide(part, square) for part in (real, self.imaginary)),
        )

    def bounded(self, most: Value = 1.0) -> Mueller:
        """The nearest matrix that light can have, with up to `most` in the mean of s and p.

        Colours outside sRGB are clipped as those of unpolarised light are.
        """
        both = 2 * ops.clip(0.5 * (self.s + self.p), 0.0, most)
        s = ops.maximum(ops.minimum(self.s, ops.minimum(both, 1.0)), ops.maximum(both - 1, 0.0))
        p = both - s
        modulus = ops.sqrt(self.real * self.real + self.imaginary * self.imaginary)
        bound = ops.minimum(ops.sqrt(s * p) / ops.maximum(modulus, 1e-9), 1.0)
        return Mueller(s, p, bound * self.real, bound * self.imaginary)


def mueller(amplitude_s: Complex, amplitude_p: Complex) -> Mueller:
    """Matrix of the amplitudes that a facet reflects; transmitted ones, if their squares are shares of the energy."""
    (a, b), (c, d) = amplitude_s, amplitude_p
    return Mueller(a * a + b * b, c * c + d * d, a * c + b * d, b * c - a * d)


def complement(reflection: Mueller) -> Mueller:
    """Matrix of refraction by an interface that reflects thus and absorbs nothing: s and p are transmitted in phase."""
    s, p = (ops.maximum(1 - part, 0.0) for part in (reflection.s, reflection.p))
    return Mueller(s, p, ops.sqrt(s * p), 0.0)
