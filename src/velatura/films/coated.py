"""Fresnel's reflectance of interfaces with thin films: sampled over the cosine, so that it is one fetch, for colours;
worked out where it is needed at the wavelengths of a ray, and of indices from textures."""

from __future__ import annotations

import copy
import functools
import sys
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, pi
from threading import Lock
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.coatings import Coating, ColouredFilm, quadrature
from velatura.optics.films import COHERENT_NM, Film, Response, coherent
from velatura.renderer.differentiated import Variables, plain
from velatura.renderer.finite_differences import differentiable
from velatura.renderer.packets import Packets, aligned, packets
from velatura.stack import Address, FilmValues, InterfaceValues, Material, luminance_sensitivity, srgb_sensitivity

Array = NDArray[np.floating]

#: A look-up over the cosine and the roughness.
Average: TypeAlias = Callable[[Value, Value], Value]

#: Properties of `optics.films.Response` of a coating, by their names, at cosines.
Shares: TypeAlias = Callable[[Coating, Sequence[str], Array], Array]

NODES = 257  # even over the cosine; between them no reflectance bends by more than 3e-4
STEP_NM = 15.0  # optical, between thicknesses that are worked out, or by a step of an index
MOST = ceil(COHERENT_NM / STEP_NM)  # steps between the ends of a texture: beyond, colours wave no more
THIN_NM = 150.0  # of which steps of an index are .1: the least thickness that they are chosen for

#: What textures of films and of indices span that cannot be looked at, by role.
UNKNOWN = {
    **{"film_thickness_nm": (0.0, 1000.0), "film_eta": (1.0, 2.5), "film_k": (0.0, 6.25)},
    **{"eta": (1.0, 2.5), "k": (0.0, 6.25)},
}

MATCHED = 1e-6  # least square of the cosine at the critical angle
FINE = 4  # and how many are interpolated, by splines, from one to the next


class Sampled:
    """Colours at the nodes of a grid, which a look-up interpolates; `data` has the channels on its last axis."""

    def __init__(self, data: Array) -> None:
        self.data, self.shape = data, data.shape[:-1]
        self._packets: dict[Any, Packets] = {}
        self._number: Any = None

    def packets(self, dialect: Any) -> Packets:
        """The values for a Dr.Jit module, made at first use."""
        with _uploading:
            if dialect not in self._packets:
                self._packets[dialect] = packets(self.data.ravel(), self.data.shape[-1], dialect)
            return self._packets[dialect]

    def fetched(self, like: Value, *coordinates: Value) -> Value:
        """A colour of the kind of `like`."""
        return _joined(like, self._read(*coordinates))

    def colours(self, like: Value, *coordinates: Value, count: int = 3) -> list[Value]:
        """Colours of the kind of `like`, of as many channels each."""
        channels = self._read(*coordinates)
        return [_joined(like, channels[k : k + count]) for k in range(0, len(channels), count)]

    def _read(self, *coordinates: Value) -> list[Value]:
        if self._number:
            coordinates = tuple(self._number(x) if isinstance(x, float) else x for x in coordinates)
        return ops.interpolate(self, *coordinates)


class Coated(Sampled):
    """Reflectance of an interface by colour, for light from either side.

    Where it absorbs nothing, light of one tangential momentum is reflected alike from both sides: it is sampled over
    the cosine on the `rarer` side, beyond which light is totally reflected. That is 1 above the interface, and 2 below
    it; above, where it is opaque. `data` are the values at the nodes, (NODES, C), of what was `found` those in 0 to 1,
    and `n12` the relative index for all colours, None where it is opaque. `coating` is what they are the reflectance
    of, from the rarer side.

    Of a film whose thickness varies, `axis` are some thicknesses: data are (places, NODES, C), and `place` is that of
    the thickness.
    """

    known = True  # whether the data may be looked at now

    def __init__(
        self,
        found: Array,
        rarer: int,
        n12: float | None = None,
        coating: Coating | None = None,
        axis: Axis | None = None,
    ) -> None:
        super().__init__(self.bounded(found))
        self.found, self.rarer, self.n12, self.coating, self.axis = found, rarer, n12, coating, axis
        self.place: tuple[Value, ...] = ()
        self._reversed: Coated | None = None
        if axis:
            self.known = False

    @staticmethod
    def bounded(found: Array) -> Array:
        """Colours as those that light may have."""
        return np.clip(found, 0, 1)

    @property
    def absorbs(self) -> bool:
        """Whether less passes than is not reflected."""
        return False

    def reading(self, flat: Any) -> Coated:
        """With values of Dr.Jit, flat; differentiable."""
        found = copy.copy(self)
        found._number, found._reversed, found.known = type(flat), None, False
        dialect = sys.modules[type(flat).__module__]
        found._packets = {dialect: packets(flat, self.data.shape[-1], dialect)}
        return found

    def of(self, layer: InterfaceValues, above: Value) -> Coated:
        """For the thickness that a layer has."""
        return self._at(self.axis.place(layer.films[self.axis.film].thickness_nm)) if self.axis else self

    def reversed(self) -> Coated:
        """As seen from below."""
        if self._reversed is None:
            found = copy.copy(self)
            found.rarer, found.n12 = 3 - self.rarer, 1 / self.n12 if self.n12 else None
            found.axis = self.axis and self.axis.reversed()
            self._reversed = found
        return self._reversed._at(*self.place)

    def averaged(self, often: bool) -> tuple[Average, Average] | None:
        """Look-ups of its albedo and of what it absorbs over the cosine and the roughness, where it brings them
        along."""
        return None

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """For cosines above and below, 0 where light cannot be; a colour of the kind of `like`."""
        return self.at(self.cosine(cos_1, cos_2), like)

    def passing(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """Transmittance, likewise."""
        return 1 - self.between(cos_1, cos_2, like)

    def shares(self, above: Value, cosine: Value, cos_t: Value, like: Value) -> tuple[Value, Value]:
        """Reflectance and transmittance of light from above where the condition holds, else from below; for cosines on
        its own side and beyond."""
        reflected = self.at(ops.select(self.from_rarer(above), cosine, cos_t), like)
        return reflected, 1 - reflected

    def from_rarer(self, above: Value) -> Value:
        """Whether light comes from the rarer side."""
        return above if self.rarer == 1 else above ^ True

    def cosine(self, cos_1: Value, cos_2: Value) -> Value:
        """Of the cosines above and below, that on the rarer side."""
        return cos_1 if self.rarer == 1 else cos_2

    def at(self, cosine: Value, like: Value) -> Value:
        """For the cosine on the rarer side."""
        return self.fetched(like, *self.place, cosine)

    def _at(self, *place: Value) -> Coated:
        if not place:
            return self
        found = copy.copy(self)
        found.place = place
        return found


class Absorbing(Coated):
    """As `Coated`, of a dielectric whose films absorb.

    `data` have three colours at a node: what is reflected on the rarer side, on the denser side, and what passes. The
    nodes of the cosine on the rarer side follow those of total reflection, over the angle whose cosine is that on the
    denser side over the one at the critical angle: (2 NODES - 1, 3 C).
    """

    @classmethod
    def of_coating(cls, coating: Coating, rarer: int, n12: float, shares: Shares) -> Absorbing:
        """Of a coating from the rarer side, by a function of its properties."""
        cosines, back = np.linspace(0, 1, NODES), coating.reversed()
        beyond = np.sin(np.linspace(0, 0.5 * pi, NODES))[:-1]
        above, passing = shares(coating, ["reflected", "transmitted"], cosines)
        within = coating.totally_reflected(beyond), coating.below(cosines)
        (denser,) = shares(back, ["reflected"], np.concatenate(within, axis=1))
        nowhere = np.repeat(above[:, :1], NODES - 1, axis=1)
        each = np.concatenate([nowhere, above], axis=1), denser, np.concatenate([0 * nowhere, passing], axis=1)
        found = np.concatenate(each)
        return cls(found.T.copy(), rarer, n12, coating)

    @staticmethod
    def bounded(found: Array) -> Array:
        above, below, passing = np.split(np.clip(found, 0, 1), 3, axis=-1)
        passing = np.minimum(passing, 1 - np.maximum(above, below))
        return np.concatenate([above, below, passing], axis=-1)

    @property
    def absorbs(self) -> bool:
        return True

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        return self._colours(*self._by_side(cos_1, cos_2), like)[self.rarer - 1]

    def passing(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        return self._colours(*self._by_side(cos_1, cos_2), like)[2]

    def shares(self, above: Value, cosine: Value, cos_t: Value, like: Value) -> tuple[Value, Value]:
        from_rarer = self.from_rarer(above)
        rarer, denser = (ops.select(from_rarer, *pair) for pair in ((cosine, cos_t), (cos_t, cosine)))
        of_rarer, of_denser, passing = self._colours(rarer, denser, like)
        return ops.select(from_rarer, of_rarer, of_denser), passing

    def _by_side(self, cos_1: Value, cos_2: Value) -> tuple[Value, Value]:
        """Cosines on the rarer side and on the denser one."""
        return (cos_1, cos_2) if self.rarer == 1 else (cos_2, cos_1)

    def _colours(self, rarer: Value, denser: Value, like: Value) -> list[Value]:
        assert self.n12
        at = *self.place, self.coordinate(rarer, denser, self.n12)
        return self.colours(like, *at, count=self.data.shape[-1] // 3)

    @staticmethod
    def coordinate(rarer: Value, denser: Value, n12: Value) -> Value:
        """Of cosines on both sides, among the nodes."""
        ratio = ops.minimum(n12, 1 / n12)
        share = ops.minimum(denser / ops.sqrt(ops.maximum(1 - ratio * ratio, MATCHED)), 1.0)
        angle = ops.arctan2(ops.sqrt(1 - share * share), share)
        return 0.5 + 0.5 * rarer - angle * (1 / pi)


@dataclass(frozen=True)
class Axis:
    """Thicknesses of a film, by its number, on a fixed lattice; a negative number counts from the last film."""

    film: int
    low_nm: float
    high_nm: float
    count: int

    @classmethod
    def around(cls, film: int, low_nm: float, high_nm: float, step_nm: float) -> Axis:
        step_nm = max(step_nm, (high_nm - low_nm) / MOST)
        # One node more at either end, so that slopes are those of splines
        begin, end = max(floor(low_nm / step_nm) - 1, 0), ceil(high_nm / step_nm) + 1
        return cls(film, begin * step_nm, end * step_nm, end - begin + 1)

    def reversed(self) -> Axis:
        """As seen from below."""
        return replace(self, film=-1 - self.film)

    @property
    def nodes(self) -> Array:
        return np.linspace(self.low_nm, self.high_nm, self.count)

    def place(self, thickness_nm: Value) -> Value:
        return (thickness_nm - self.low_nm) / (self.high_nm - self.low_nm)

    def refined(self, values: Array) -> Array:
        """Values at the nodes, (nodes, ...), and at others between."""
        from scipy.interpolate import CubicSpline  # slow to import

        fine = np.linspace(self.low_nm, self.high_nm, FINE * (len(values) - 1) + 1)
        return np.asarray(CubicSpline(self.nodes, values)(fine))


@dataclass(frozen=True)
class Span:
    """The least and the greatest value that a texture gives."""

    address: Address
    low: float
    high: float

    def axis(self, layer: InterfaceValues) -> Axis:
        """That of a thickness."""
        assert self.address.film is not None
        return Axis.around(self.address.film, self.low, self.high, step(self.address, layer))


@dataclass(frozen=True)
class AtWavelengths:
    """As `Coated`, at the wavelengths of a ray; k_2 is None where the interface transmits."""

    wavelengths_nm: Value
    eta_1: Value
    films: tuple[FilmValues, ...]
    eta_2: Value
    k_2: Value | None

    known = False

    @property
    def absorbs(self) -> bool:
        """Whether less may pass than is not reflected."""
        return True

    def reversed(self: At) -> At:
        """As seen from below."""
        return replace(self, eta_1=self.eta_2, films=self.films[::-1], eta_2=self.eta_1)

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """For cosines above and below, 0 where light cannot be."""
        return self._shares(cos_1, cos_2)[0]

    def passing(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """Transmittance, likewise."""
        return self._shares(cos_1, cos_2)[1]

    def shares(self, above: Value, cosine: Value, cos_t: Value, like: Value) -> tuple[Value, Value]:
        """As of `Coated`."""
        back = self.reversed()
        turned = [
            FilmValues(*(ops.select(above, a, b) for a, b in zip(vars(x).values(), vars(y).values())))
            for x, y in zip(self.films, back.films)
        ]
        eta_1, eta_2 = (ops.select(above, *pair) for pair in ((self.eta_1, self.eta_2), (self.eta_2, self.eta_1)))
        return replace(self, eta_1=eta_1, films=tuple(turned), eta_2=eta_2)._shares(cosine, cos_t)

    def _shares(self, cos_1: Value, cos_2: Value) -> tuple[Value, Value]:
        found = self._response(self._cosine(cos_1, cos_2))
        passes = (cos_1 > 0) & (cos_2 > 0)
        return self._colour(found.reflected), self._colour(ops.select(passes, found.transmitted, 0.0))

    def at(self, cosine: Value, like: Value) -> Value:
        """For the cosine above, of an opaque interface."""
        return self._colour(self._response(cosine).reflected)

    def _response(self, cosine: Value) -> Response:
        films = list(map(self._film, self.films))
        k_2 = 0.0 if self.k_2 is None else self.k_2
        return coherent(cosine, self.wavelengths_nm, self.eta_1, films, self.eta_2, k_2)

    @staticmethod
    def _film(values: FilmValues) -> Film:
        return Film(values.eta, values.k, values.thickness_nm)

    def _cosine(self, cos_1: Value, cos_2: Value) -> Value:
        """That above, by colour: all are totally reflected from the same angle on."""
        ratio, whole = self.eta_2 / self.eta_1, ops.mean(self.eta_2) / ops.mean(self.eta_1)
        critical2 = ops.maximum(1 - whole * whole, MATCHED)
        share2 = ops.minimum(cos_1 * cos_1 / critical2, 1.0)
        denser = ops.sqrt((1 - ratio * ratio * (1 - cos_2 * cos_2)) * share2)
        return ops.select(whole > 1, cos_1, denser)

    def _colour(self, found: Value) -> Value:
        # Functions of Dr.Jit may have taken a colour of Mitsuba's for an array
        kind: Any = type(self.wavelengths_nm)
        return kind(found)


At = TypeVar("At", bound=AtWavelengths)


@dataclass(frozen=True)
class InColours(AtWavelengths):
    """As `AtWavelengths`, for sums over the wavelengths of colours."""

    @staticmethod
    def _film(values: FilmValues) -> Film:
        return AtWavelengths._film(values).in_colours()


@dataclass(frozen=True)
class AtAPoint(AtWavelengths):
    """As `Coated`, of values that differ from point to point: summed over the wavelengths of a `spectrum` each time."""

    spectrum: Spectrum

    @property
    def absorbs(self) -> bool:
        return self.spectrum.absorb

    def _shares(self, cos_1: Value, cos_2: Value) -> tuple[Value, Value]:
        if not self.absorbs:
            (reflected,) = self._summed(lambda seen: seen._shares(cos_1, cos_2)[:1], 1)
            return reflected, 1 - reflected

        def both(seen: AtWavelengths) -> tuple[Value, ...]:
            return *seen._shares(cos_1, cos_2), seen.reversed()._shares(cos_2, cos_1)[0]

        reflected, passing, back = self._summed(both, 3)
        return reflected, ops.minimum(passing, 1 - ops.maximum(reflected, back))

    def at(self, cosine: Value, like: Value) -> Value:
        return self._summed(lambda seen: [seen.at(cosine, like)], 1)[0]

    def _summed(self, shares: Callable[[AtWavelengths], Sequence[Value]], count: int) -> list[Value]:
        """Colours that light may have, of shares at one wavelength."""
        found = self.spectrum.summed(lambda nm: shares(self._at(nm)), count)
        return [ops.clip(x, 0.0, 1.0) for x in found]

    def _at(self, nm: Value) -> AtWavelengths:
        """At a wavelength, a colour of it."""
        return InColours(nm, self.eta_1, self.films, self.eta_2, self.k_2)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Wavelengths (N,), and their weights (C, N) in a renderer's colours, flat: numbers of a variant.

    It stands for films of a layer whose values differ from point to point, which may `absorb`; `colour` is the type of
    colours.
    """

    wavelengths_nm: Any
    weights: Any
    colour: Any
    absorb: bool

    @classmethod
    def over(cls, thickness_nm: float, light: str, colour: Any, absorb: bool, number: Any) -> Spectrum:
        """For films of an optical thickness at most; `number` is Dr.Jit's type, None in scalar variants."""
        wavelengths_nm, weights = quadrature(thickness_nm, _SENSITIVITIES[light])
        if number is None:
            return cls(wavelengths_nm, weights.ravel(), colour, absorb)
        return cls(number(aligned(wavelengths_nm)), number(aligned(weights.ravel())), colour, absorb)

    def of(self, layer: InterfaceValues, above: Value) -> AtAPoint:
        """For the values that a layer has."""
        return AtAPoint(None, above, layer.films, layer.eta, layer.k if layer.kind == "conductor" else None, self)

    def reversed(self) -> Spectrum:
        """As seen from below."""
        return self

    def summed(self, shares: Callable[[Value], Sequence[Value]], count: int) -> list[Value]:
        """As many shares of light as colours, by a function of the wavelength, a colour."""
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


@dataclass(frozen=True)
class Either:
    """Films `a` where a condition holds, else `b`; None without any."""

    where: Value
    a: Films
    b: Films

    def between(self, cos_1: Value, cos_2: Value, eta: Value) -> Value:
        """As `dielectric_between`: by one fetch where it can be."""
        a, b = self.a, self.b
        if isinstance(a, Coated) and isinstance(b, Coated):
            cosine = ops.select(self.where, a.cosine(cos_1, cos_2), b.cosine(cos_1, cos_2))
            if a.data is b.data and a.known == b.known and not a.place and not a.absorbs:
                return a.at(cosine, eta)
            if a.known and b.known and a.data.shape == b.data.shape and not a.absorbs:
                place = ops.minimum(cosine, 1.0) * (NODES - 1) + ops.select(self.where, 0.0, float(NODES))
                return _both(a, b).fetched(eta, place / (2 * NODES - 1))
        return ops.select(self.where, *(dielectric_between(x, cos_1, cos_2, eta) for x in (a, b)))

    def reversed(self) -> Either:
        """As seen from below."""
        return Either(self.where, *(x and x.reversed() for x in (self.a, self.b)))

    def passing(self, cos_1: Value, cos_2: Value, eta: Value) -> Value:
        """As `dielectric_passing`."""
        if any(absorbs(x) for x in (self.a, self.b)):
            return ops.select(self.where, *(dielectric_passing(x, cos_1, cos_2, eta) for x in (self.a, self.b)))
        return 1 - self.between(cos_1, cos_2, eta)


OfInterface: TypeAlias = Coated | AtWavelengths
Films: TypeAlias = OfInterface | Either | None


def either(where: Value, a: Films, b: Films) -> Films:
    """Films that differ from place to place."""
    return a if a is b else Either(where, a, b)


@functools.lru_cache(64)
def _both(a: Coated, b: Coated) -> Sampled:
    """The nodes of one after those of the other."""
    return Sampled(np.concatenate([a.data, b.data]))


def dielectric_between(films: Films, cos_1: Value, cos_2: Value, eta: Value) -> Value:
    """Reflectance of a dielectric with films, for cosines above and below: as `fresnel.dielectric_between`."""
    if films is None:
        return fresnel.dielectric_between(cos_1, cos_2, eta)
    return films.between(cos_1, cos_2, eta)


def dielectric_passing(films: Films, cos_1: Value, cos_2: Value, eta: Value) -> Value:
    """What a dielectric with films transmits, likewise."""
    if films is None:
        return 1 - fresnel.dielectric_between(cos_1, cos_2, eta)
    return films.passing(cos_1, cos_2, eta)


def absorbs(films: Films) -> bool:
    """Whether films may absorb, by what is known of them."""
    return isinstance(films, Either) or (films is not None and films.absorbs)


def _joined(like: Value, channels: list[Value]) -> Value:
    """A colour of the kind of `like`, or a number of one channel."""
    if not isinstance(like, float | np.ndarray):
        kind: Any = type(like)
        return channels[0] if len(channels) == 1 else _colour(kind)(channels)
    colour = np.stack(channels)
    if colour.ndim > np.ndim(like) > 1:  # of coordinates by colour, each channel has its own
        colour = np.stack([np.broadcast_to(x, (len(colour), *x.shape[1:]))[c] for c, x in enumerate(channels)])
    return colour if colour.ndim > 1 else colour[:, None]


@functools.cache
def _colour(kind: Any) -> Any:
    """A renderer's type of colours, for one of colours, or of numbers."""
    import drjit as dr

    is_number = dr.depth_v(kind) == (1 if dr.is_jit_v(kind) else 0)
    return sys.modules[kind.__module__].Array3f if is_number else kind


def of(material: Material) -> list[Any]:
    """The films on each layer, None on those without: in a renderer's numbers as it has them or, at the wavelengths of
    a ray, `AtWavelengths`; in those of NumPy `Coated`, where a thickness of 0 is no film."""
    if not any(material.films):
        return [None] * len(material.layers)
    if isinstance(material.light, str | np.ndarray):
        layers = [
            replace(layer, films=tuple(x for x in layer.films if x.thickness_nm > 0))
            if isinstance(layer, InterfaceValues) and layer.films and not layer.coating
            else layer
            for layer in material.layers
        ]
        return _of(replace(material, layers=tuple(layers)))
    return _of(material)


def _of(material: Material, may_absorb: Collection[int] = ()) -> list[Any]:
    """Films that may absorb are taken for such, on layers of these numbers."""
    found: list[OfInterface | None] = []
    above = material.exterior
    for k, layer in enumerate(material.solid().layers):
        films: OfInterface | None = None
        if isinstance(layer, InterfaceValues):
            if layer.films and layer.coating:
                films = layer.coating.of(layer, above)
            elif layer.films:
                films = _worked_out(layer, above, material.light, k in may_absorb)
            above = layer.eta
        found.append(films)
    return found


def constant(material: Material, spans: Sequence[Span], number: Any) -> list[Coated | Spectrum | None]:
    """The films on each layer of a renderer's constants; differentiable.

    Args:
        spans: values from textures, of films and of indices, which then have any value in `material`.
        number: Dr.Jit's type of numbers, None in scalar variants.
    """
    given, start = Variables.of(material), plain(material)
    # Where an extinction varies it may be 0
    varying = [given.addresses[place] for variable in given.given for place, _ in variable.places]
    varying += [span.address for span in spans]
    may_absorb = {address.layer for address in varying if address.role == "film_k" and address.layer is not None}
    axes, points = dict[int, Axis](), dict[int, Spectrum]()
    most, above = highest(start, spans), None
    for k, layer in enumerate(most.layers):
        if not isinstance(layer, InterfaceValues):
            continue
        own = [x for x in spans if x.address.layer == k or (x.address.layer == above and x.address.key == "eta")]
        if layer.films and [x.address.role for x in own] == ["film_thickness_nm"]:
            axes[k] = own[0].axis(layer)
        elif layer.films and own:
            absorbs = k in may_absorb or any(np.any(film.k > 0) for film in layer.films)
            points[k] = Spectrum.over(_thick_nm(layer), material.light, type(material.exterior), absorbs, number)
            start = start.with_layer(k, films=())
        above = k

    def made(numbers: list[float]) -> list[Coated | None]:
        changed = given.replaced(start, numbers)
        found = _of(changed, may_absorb)
        for k, axis in axes.items():
            found[k] = over_thickness(changed, k, axis, may_absorb)
        return found

    def arrays(numbers: list[float]) -> list[Array]:
        return [films.data.ravel() for films in made(numbers) if films]

    found = made([])
    if given.given and any(found):
        flat = iter(differentiable(arrays, given.given, given.around, number))
        found = [films and films.reading(next(flat)) for films in found]
    return [points.get(k, films) for k, films in enumerate(found)]


def over_thickness(material: Material, k: int, axis: Axis, may_absorb: Collection[int]) -> Coated:
    """The films on the k-th layer, over thicknesses of one of them."""
    name = f"layer{k}_film{axis.film}_thickness_nm"

    def at(x: float) -> Coated:
        found = _of(material.each(lambda address, old: x if address.name == name else old), may_absorb)[k]
        assert found
        return found

    each = [at(x) for x in axis.nodes.tolist()]
    found = axis.refined(np.array([films.found for films in each]))
    return type(each[0])(found, each[0].rarer, each[0].n12, None, axis)


def highest(material: Material, spans: Sequence[Span]) -> Material:
    """A material with the greatest values of textures."""
    most = {span.address.name: span.high for span in spans}
    return material.each(lambda address, x: most.get(address.name, x))


def step(address: Address, layer: InterfaceValues) -> float:
    """Between thicknesses of a film, or between its indices, at which what it reflects is worked out: by the greatest
    values of the layer."""
    assert address.film is not None
    film = layer.films[address.film]
    if address.role == "film_thickness_nm":
        return STEP_NM / float(np.max(film.eta))
    return STEP_NM / max(film.thickness_nm, THIN_NM)


def optical_nm(material: Material) -> float:
    """The greatest optical thickness of the films on an interface, of values of NumPy."""
    return max(map(_thick_nm, material.interfaces), default=0.0)


def _thick_nm(layer: InterfaceValues) -> float:
    return sum(Film(float(np.max(x.eta)), 0.0, x.thickness_nm).in_colours().optical_nm for x in layer.films)


def _worked_out(layer: InterfaceValues, above: Value, light: Any, may_absorb: bool) -> OfInterface:
    """The films on a layer; from values of NumPy made once."""
    if not isinstance(light, str | np.ndarray):
        return AtWavelengths(light, above, layer.films, layer.eta, layer.k if layer.kind == "conductor" else None)
    count = {"srgb": 3, "luminance": 1}[light] if isinstance(light, str) else len(light)

    def channels(value: Value) -> tuple[float, ...]:
        # In single precision, so that values that were rounded are others no more
        each = np.asarray(value, np.float32).ravel()
        return tuple(np.broadcast_to(each[:1] if (each == each[0]).all() else each, count).tolist())

    films = tuple(ColouredFilm(channels(x.eta), channels(x.k), channels(x.thickness_nm)[0]) for x in layer.films)
    opaque = layer.kind == "conductor"
    k_2 = channels(layer.k) if opaque else channels(0.0)
    coating = Coating(films, channels(above), channels(layer.eta), k_2)
    with _making:
        absorbs = not opaque and (may_absorb or coating.absorbs)
        return _coated(coating, opaque, absorbs, light if isinstance(light, str) else tuple(light.tolist()))


_uploading, _making = Lock(), Lock()
_SENSITIVITIES = {"srgb": srgb_sensitivity, "luminance": luminance_sensitivity}


@functools.lru_cache(512)
def _coated(coating: Coating, opaque: bool, absorbs: bool, light: str | tuple[float, ...]) -> Coated:
    n12 = None if opaque else sum(coating.eta_2) / sum(coating.eta_1)
    rarer = 1 if n12 is None or n12 > 1 else 2
    if rarer == 2:
        coating = coating.reversed()

    def shares(of: Coating, names: Sequence[str], cosines: Array) -> Array:
        if isinstance(light, str):
            return of.shares(names, cosines, _SENSITIVITIES[light])
        return of.at(names, cosines, np.array(light))

    if n12 and absorbs:
        return Absorbing.of_coating(coating, rarer, n12, shares)
    (reflected,) = shares(coating, ["reflected"], np.linspace(0, 1, NODES))
    return Coated(reflected.T.copy(), rarer, n12, coating)
