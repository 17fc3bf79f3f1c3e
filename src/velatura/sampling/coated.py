"""Fresnel's reflectance of interfaces with thin films: sampled over the cosine, so that it is one fetch, for colours;
at the wavelengths of a ray, worked out."""

from __future__ import annotations

import copy
import functools
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor
from threading import Lock
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.coatings import Coating, ColouredFilm
from velatura.optics.films import Film, Response, coherent
from velatura.sampling.differences import differentiable
from velatura.sampling.packets import Packets, packets
from velatura.sampling.variables import Variables, plain
from velatura.stack import FilmValues, InterfaceValues, Material, luminance_sensitivity, srgb_sensitivity

Array = NDArray[np.floating]

NODES = 257  # even over the cosine; between them no reflectance bends by more than 3e-4
STEP_NM = 15.0  # optical, between thicknesses that are worked out,
UNKNOWN_NM = (0.0, 1000.0)  # spanned by thicknesses that cannot be looked at
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

    def colours(self, like: Value, *coordinates: Value) -> list[Value]:
        """Colours of the kind of `like`, of three channels each."""
        channels = self._read(*coordinates)
        return [_joined(like, channels[k : k + 3]) for k in range(0, len(channels), 3)]

    def _read(self, *coordinates: Value) -> list[Value]:
        if self._number:
            coordinates = tuple(self._number(x) if isinstance(x, float) else x for x in coordinates)
        return ops.interpolate(self, *coordinates)


class Coated(Sampled):
    """Reflectance of an interface by colour, for light from either side.

    Where it transmits it absorbs nothing, so that light of one tangential momentum is reflected alike from both sides:
    it is sampled over the cosine on the `rarer` side, beyond which light is totally reflected. That is 1 above the
    interface, and 2 below it; above, where it is opaque. `data` are the values at the nodes, (NODES, C), of what was
    `found` those in 0 to 1, and `n12` the relative index for all colours, None where it is opaque. `coating` is what
    they are the reflectance of, from the rarer side.

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
        super().__init__(np.clip(found, 0, 1))
        self.found, self.rarer, self.n12, self.coating, self.axis = found, rarer, n12, coating, axis
        self.place: tuple[Value, ...] = ()
        self._reversed: Coated | None = None
        if axis:
            self.known = False

    def reading(self, flat: Any) -> Coated:
        """With values of Dr.Jit, flat; differentiable."""
        found = copy.copy(self)
        found._number, found._reversed, found.known = type(flat), None, False
        dialect = sys.modules[type(flat).__module__]
        found._packets = {dialect: packets(flat, self.data.shape[-1], dialect)}
        return found

    def of(self, layer: InterfaceValues) -> Coated:
        """For the thickness that a layer has."""
        return self._at(self.axis.place(layer.films[self.axis.film].thickness_nm)) if self.axis else self

    def reversed(self) -> Coated:
        """As seen from below."""
        if self._reversed is None:
            found = copy.copy(self)
            found.rarer, found.n12 = 3 - self.rarer, 1 / self.n12 if self.n12 else None
            self._reversed = found
        return self._reversed._at(*self.place)

    def averaged(self, often: bool) -> Callable[[Value, Value], Value] | None:
        """A look-up of its albedo over the cosine and the roughness, where it brings one along."""
        return None

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """For cosines above and below, 0 where light cannot be; a colour of the kind of `like`."""
        return self.at(self.cosine(cos_1, cos_2), like)

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


@dataclass(frozen=True)
class Axis:
    """Thicknesses of a film, by its number, on a fixed lattice."""

    film: int
    low_nm: float
    high_nm: float
    count: int

    @classmethod
    def around(cls, film: int, low_nm: float, high_nm: float, step_nm: float) -> Axis:
        # One node more at either end, so that slopes are those of splines
        begin, end = max(floor(low_nm / step_nm) - 1, 0), ceil(high_nm / step_nm) + 1
        return cls(film, begin * step_nm, end * step_nm, end - begin + 1)

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
class AtWavelengths:
    """As `Coated`, at the wavelengths of a ray; k_2 is None where the interface transmits."""

    wavelengths_nm: Value
    eta_1: Value
    films: tuple[FilmValues, ...]
    eta_2: Value
    k_2: Value | None

    known = False

    def reversed(self) -> AtWavelengths:
        """As seen from below."""
        return replace(self, eta_1=self.eta_2, films=self.films[::-1], eta_2=self.eta_1)

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """For cosines above and below, 0 where light cannot be."""
        return self.at(ops.select(self._rarer_above, cos_1, cos_2), like)

    def at(self, cosine: Value, like: Value) -> Value:
        """For the cosine on the rarer side."""
        films = [Film(x.eta, x.k, x.thickness_nm) for x in self.films]
        if self.k_2 is not None:
            return self._colour(coherent(cosine, self.wavelengths_nm, self.eta_1, films, self.eta_2, self.k_2))
        where = self._rarer_above
        above, below = (ops.select(where, *pair) for pair in ((self.eta_1, self.eta_2), (self.eta_2, self.eta_1)))
        turned = [
            Film(*(ops.select(where, a, b) for a, b in zip(vars(x).values(), vars(y).values())))
            for x, y in zip(films, films[::-1])
        ]
        return self._colour(coherent(cosine, self.wavelengths_nm, above, turned, below))

    def _colour(self, found: Response) -> Value:
        # Functions of Dr.Jit may have taken a colour of Mitsuba's for an array
        kind: Any = type(self.wavelengths_nm)
        return kind(found.reflected)

    @property
    def _rarer_above(self) -> Value:
        return ops.mean(self.eta_1) < ops.mean(self.eta_2)


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
            if a.data is b.data and a.known == b.known and not a.place:
                return a.at(cosine, eta)
            if a.known and b.known and a.data.shape == b.data.shape:
                place = ops.minimum(cosine, 1.0) * (NODES - 1) + ops.select(self.where, 0.0, float(NODES))
                return _both(a, b).fetched(eta, place / (2 * NODES - 1))
        return ops.select(self.where, *(dielectric_between(x, cos_1, cos_2, eta) for x in (a, b)))


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


def _joined(like: Value, channels: list[Value]) -> Value:
    """A colour of the kind of `like`, or a number of one channel."""
    if not isinstance(like, float | np.ndarray):
        kind: Any = type(like)
        return channels[0] if len(channels) == 1 else _colour(kind)(channels)
    colour = np.stack(channels)
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


def _of(material: Material) -> list[Any]:
    found: list[OfInterface | None] = []
    above = material.exterior
    for layer in material.solid().layers:
        films: OfInterface | None = None
        if isinstance(layer, InterfaceValues):
            if layer.films:
                films = layer.coating.of(layer) if layer.coating else _worked_out(layer, above, material.light)
            above = layer.eta
        found.append(films)
    return found


def constant(material: Material, spans: Sequence[tuple[int, int, float, float]], number: Any) -> list[Coated | None]:
    """The films on each layer of a renderer's constants; differentiable.

    Args:
        spans: layers and films with thicknesses from textures, and the least and the greatest of these.
        number: Dr.Jit's type of numbers, None in scalar variants.
    """
    given, start = Variables.of(material), plain(material)
    axes: dict[int, Axis] = {}
    for k, film, low, high in spans:
        layer = start.layers[k]
        assert isinstance(layer, InterfaceValues)
        axes[k] = Axis.around(film, low, high, step_nm(layer.films[film]))

    def made(numbers: list[float]) -> list[Coated | None]:
        changed = given.replaced(start, numbers)
        found = _of(changed)
        for k, axis in axes.items():
            found[k] = _over_thickness(changed, k, axis)
        return found

    found = made([])
    if not given.given or not any(found):
        return found

    def arrays(numbers: list[float]) -> list[Array]:
        return [films.data.ravel() for films in made(numbers) if films]

    flat = iter(differentiable(arrays, given.given, given.around, number))
    return [films and films.reading(next(flat)) for films in found]


def _over_thickness(material: Material, k: int, axis: Axis) -> Coated:
    """The films on the k-th layer, over thicknesses of one of them."""
    name = f"layer{k}_film{axis.film}_thickness_nm"

    def at(x: float) -> Coated:
        found = _of(material.each(lambda address, old: x if address.name == name else old))[k]
        assert found
        return found

    each = [at(x) for x in axis.nodes.tolist()]
    found = axis.refined(np.array([films.found for films in each]))
    return Coated(found, each[0].rarer, each[0].n12, None, axis)


def step_nm(film: FilmValues) -> float:
    """Between thicknesses of a film, of values of NumPy, at which what it reflects is worked out."""
    return STEP_NM / float(np.max(film.eta))


def optical_nm(material: Material) -> float:
    """The greatest optical thickness of the films on an interface, of values of NumPy."""
    each = (sum(float(np.max(x.eta)) * x.thickness_nm for x in layer.films) for layer in material.interfaces)
    return max(each, default=0.0)


def _worked_out(layer: InterfaceValues, above: Value, light: Any) -> OfInterface:
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
        return _coated(coating, opaque, light if isinstance(light, str) else tuple(light.tolist()))


_uploading, _making = Lock(), Lock()
_SENSITIVITIES = {"srgb": srgb_sensitivity, "luminance": luminance_sensitivity}


@functools.lru_cache(512)
def _coated(coating: Coating, opaque: bool, light: str | tuple[float, ...]) -> Coated:
    n12 = None if opaque else sum(coating.eta_2) / sum(coating.eta_1)
    rarer = 1 if n12 is None or n12 > 1 else 2
    if rarer == 2:
        coating = coating.reversed()
    cosines = np.linspace(0, 1, NODES)
    if isinstance(light, str):
        found = coating.share("reflected", cosines, _SENSITIVITIES[light])
    else:
        found = coating.at(np.array(light), cosines)
    return Coated(found.T.copy(), rarer, n12, coating)
