"""Reflectance of interfaces with thin films, evaluated: at the wavelengths of a ray, or by quadrature at a point."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from velatura import ops
from velatura.films.reflectance import InterfaceFilms
from velatura.films.tables import MATCHED
from velatura.ops import Value
from velatura.optics.coatings import Sensitivity, quadrature
from velatura.optics.films import OpticalFilm, Response, coherent
from velatura.optics.polarisation import Mueller
from velatura.renderer.packets import aligned
from velatura.stack import FilmValues, InterfaceValues

if TYPE_CHECKING:
    from typing_extensions import Self


@dataclass(frozen=True)
class AtWavelengths(InterfaceFilms):
    """Reflectance of an interface at the wavelengths of a ray; k_2 is None where the interface transmits.

    With `in_colours`, indices are those of colours, for sums over wavelengths.
    """

    wavelengths_nm: Value
    eta_1: Value
    films: tuple[FilmValues, ...]
    eta_2: Value
    k_2: Value | None
    in_colours: bool = field(default=False, kw_only=True)

    @property
    def absorbs(self) -> bool:
        return True

    def reversed(self) -> AtWavelengths:
        return replace(self, eta_1=self.eta_2, films=self.films[::-1], eta_2=self.eta_1)

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        return self._shares(cos_1, cos_2)[0]

    def passing(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        return self._shares(cos_1, cos_2)[1]

    def shares(self, above: Value, cosine: Value, cos_t: Value, like: Value) -> tuple[Value, Value]:
        return self._seen_from(above)._shares(cosine, cos_t)

    def matrices(self, above: Value, cosine: Value, cos_t: Value) -> tuple[Mueller, Mueller]:
        """`shares` of polarised light, as matrices."""
        return self._seen_from(above)._matrices(cosine, cos_t)

    def matrix(self, cosine: Value) -> Mueller:
        """Matrix of light that an opaque interface reflects."""
        return self._matrix("reflected", self._response(cosine))

    def _seen_from(self, above: Value) -> Self:
        seen = self.eta_1, self.films, self.eta_2
        eta_1, films, eta_2 = ops.select_record(above, seen, (self.eta_2, self.films[::-1], self.eta_1))
        return replace(self, eta_1=eta_1, films=films, eta_2=eta_2)

    def _shares(self, cos_1: Value, cos_2: Value) -> tuple[Value, Value]:
        found = self._response(self._cosine(cos_1, cos_2))
        passes = (cos_1 > 0) & (cos_2 > 0)
        return self._colour(found.reflected), self._colour(ops.select(passes, found.transmitted, 0.0))

    def _matrices(self, cos_1: Value, cos_2: Value) -> tuple[Mueller, Mueller]:
        found = self._response(self._cosine(cos_1, cos_2))
        passes = ops.select((cos_1 > 0) & (cos_2 > 0), 1.0, 0.0)
        return self._matrix("reflected", found), self._matrix("transmitted", found) * passes

    def _matrix(self, name: str, found: Response) -> Mueller:
        return Mueller(*(self._colour(getattr(found, f"{name}_{part}")) for part in ("s", "p", "real", "imaginary")))

    def at(self, cosine: Value, like: Value) -> Value:
        return self._colour(self._response(cosine).reflected)

    def _response(self, cosine: Value) -> Response:
        films = [OpticalFilm(x.eta, x.k, x.thickness_nm) for x in self.films]
        films = [film.in_colours() for film in films] if self.in_colours else films
        k_2 = 0.0 if self.k_2 is None else self.k_2
        return coherent(cosine, self.wavelengths_nm, self.eta_1, films, self.eta_2, k_2)

    def _cosine(self, cos_1: Value, cos_2: Value) -> Value:
        """Cosine above, by colour: all colours are totally reflected from the same angle on."""
        ratio, whole = self.eta_2 / self.eta_1, ops.mean(self.eta_2) / ops.mean(self.eta_1)
        critical2 = ops.maximum(1 - whole * whole, MATCHED)
        share2 = ops.minimum(cos_1 * cos_1 / critical2, 1.0)
        denser = ops.sqrt((1 - ratio * ratio * (1 - cos_2 * cos_2)) * share2)
        return ops.select(whole > 1, cos_1, denser)

    def _colour(self, found: Value) -> Value:
        # Functions of Dr.Jit may have taken a colour of Mitsuba's for an array
        kind: Any = type(self.wavelengths_nm)
        return kind(found)


@dataclass(frozen=True)
class AtAPoint(AtWavelengths):
    """Reflectance for values that differ from point to point: a sum over the wavelengths of a `quadrature`."""

    quadrature: SpectralQuadrature

    @property
    def absorbs(self) -> bool:
        return self.quadrature.absorb

    def _shares(self, cos_1: Value, cos_2: Value) -> tuple[Value, Value]:
        if not self.absorbs:
            (reflected,) = self._summed(lambda seen: seen._shares(cos_1, cos_2)[:1], 1)
            return reflected, 1 - reflected

        def both(seen: AtWavelengths) -> tuple[Value, ...]:
            return *seen._shares(cos_1, cos_2), seen.reversed()._shares(cos_2, cos_1)[0]

        reflected, passing, back = self._summed(both, 3)
        return reflected, ops.minimum(passing, 1 - ops.maximum(reflected, back))

    def _matrices(self, cos_1: Value, cos_2: Value) -> tuple[Mueller, Mueller]:
        def each(seen: AtWavelengths) -> Sequence[Value]:
            return [x for matrix in seen._matrices(cos_1, cos_2) for x in vars(matrix).values()]

        found = self._colours(each, 8)
        reflection = Mueller(*found[:4]).bounded()
        return reflection, Mueller(*found[4:]).bounded(1 - 0.5 * (reflection.s + reflection.p))

    def matrix(self, cosine: Value) -> Mueller:
        return Mueller(*self._colours(lambda seen: [*vars(seen.matrix(cosine)).values()], 4)).bounded()

    def at(self, cosine: Value, like: Value) -> Value:
        return self._summed(lambda seen: [seen.at(cosine, like)], 1)[0]

    def _summed(self, shares: Callable[[AtWavelengths], Sequence[Value]], count: int) -> list[Value]:
        """Colours that light may have, from shares at one wavelength."""
        return [ops.clip(x, 0.0, 1.0) for x in self._colours(shares, count)]

    def _colours(self, shares: Callable[[AtWavelengths], Sequence[Value]], count: int) -> list[Value]:
        def at(nm: Value) -> Sequence[Value]:
            return shares(AtWavelengths(nm, self.eta_1, self.films, self.eta_2, self.k_2, in_colours=True))

        return self.quadrature.summed(at, count)


@dataclass(frozen=True, eq=False)
class SpectralQuadrature:
    """Wavelengths (N,), and their weights (C, N) in a renderer's colours, flat: numbers of a variant.

    It stands for films of a layer whose values differ from point to point, and may `absorb`; `colour` is the type of
    colours.
    """

    wavelengths_nm: Any
    weights: Any
    colour: Any
    absorb: bool

    @classmethod
    def over(
        cls, thickness_nm: float, sensitivity: Sensitivity, colour: Any, absorb: bool, number: Any
    ) -> SpectralQuadrature:
        """The rule for optical thicknesses up to that; `number` is Dr.Jit's type, None in scalar variants."""
        wavelengths_nm, weights = quadrature(thickness_nm, sensitivity)
        if number is None:
            return cls(wavelengths_nm, weights.ravel(), colour, absorb)
        return cls(number(aligned(wavelengths_nm)), number(aligned(weights.ravel())), colour, absorb)

    def of(self, layer: InterfaceValues, above: Value) -> AtAPoint:
        """The films with the values that a layer has."""
        k_2 = layer.k if layer.kind == "conductor" else None
        return AtAPoint(None, above, layer.films, layer.eta, k_2, quadrature=self)

    def reversed(self) -> SpectralQuadrature:
        """The same rule: nothing of it depends on the side."""
        return self

    def summed(self, shares: Callable[[Value], Sequence[Value]], count: int) -> list[Value]:
        """Shares of light as colours, `count` of them, by a function of the wavelength, itself a colour."""
        import drjit as dr

        kind, nodes = self.colour, len(self.wavelengths_nm)
        channels = range(len(self.weights) // nodes)

        def read(gather: Callable[[Any, Any], Value], i: Any) -> tuple[Value, Value]:
            return kind(gather(self.wavelengths_nm, i)), kind([gather(self.weights, i + c * nodes) for c in channels])

        if isinstance(self.weights, np.ndarray):
            each = [read(lambda flat, i: float(flat[i]), i) for i in range(nodes)]
            found = [[kind(weight * x) for x in shares(nm)] for nm, weight in each]
            return [sum(x[1:], x[0]) for x in zip(*found)]
        number = type(self.weights)
        integer = sys.modules[number.__module__].UInt32

        def more(i: Any, *sums: Value) -> tuple[Value, ...]:
            nm, weight = read(functools.partial(dr.gather, number), i)
            return i + 1, *(kind(dr.fma(weight, x, total)) for x, total in zip(shares(nm), sums))

        start = integer(0), *(dr.zeros(kind) for _ in range(count))
        # Sums alone pass from one wavelength to the next, so that gradients need none of the steps between
        _, *found = dr.while_loop(start, lambda i, *_: i < nodes, more, max_iterations=-1)
        return found
