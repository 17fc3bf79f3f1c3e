"""Reflectance of interfaces with thin films, tabulated over the cosine: one fetch gives its colours."""

from __future__ import annotations

import copy
import functools
import sys
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, pi
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films.reflectance import Films, InterfaceFilms
from velatura.ops import Value
from velatura.optics.coatings import Coating
from velatura.optics.films import COHERENT_NM
from velatura.renderer.packets import SampledGrid, packets
from velatura.stack import InterfaceValues

Array = NDArray[np.floating]

#: A look-up over the cosine and the roughness.
Average: TypeAlias = Callable[[Value, Value], Value]

#: Properties of `optics.films.Response` of a coating, by their names, at cosines.
Shares: TypeAlias = Callable[[Coating, Sequence[str], Array], Array]

NODES = 257  # even over the cosine; between them no reflectance bends by more than 3e-4
STEP_NM = 15.0  # optical, between thicknesses that are worked out, or by a step of an index
MOST = ceil(COHERENT_NM / STEP_NM)  # steps between the ends of a texture: beyond, colours wave no more
FINE = 4  # thicknesses, by splines, from one that is worked out to the next
MATCHED = 1e-6  # least square of the cosine at the critical angle


class ColourTable(SampledGrid):
    """Colours at the nodes of a grid, which a look-up interpolates."""

    def __init__(self, data: Array) -> None:
        self.data, self._packets = data, {}
        self._number: Any = None

    def fetched(self, like: Value, *coordinates: Value) -> Value:
        """Colour of the kind of `like`."""
        (colour,) = self.colours(like, *coordinates, count=self.data.shape[-1])
        return colour

    def colours(self, like: Value, *coordinates: Value, count: int = 3) -> list[Value]:
        """Colours of the kind of `like`, of as many channels each."""
        if self._number:
            coordinates = tuple(self._number(x) if isinstance(x, float) else x for x in coordinates)
        channels = ops.interpolate(self, *coordinates)
        return [_joined(like, channels[k : k + count]) for k in range(0, len(channels), count)]


class Coated(ColourTable, InterfaceFilms):
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
        axis: ThicknessAxis | None = None,
    ) -> None:
        super().__init__(self.bounded(found))
        self.found, self.rarer, self.n12, self.coating, self.axis = found, rarer, n12, coating, axis
        self.place: tuple[Value, ...] = ()
        self._reversed: Coated | None = None
        if axis:
            self.known = False

    @staticmethod
    def bounded(found: Array) -> Array:
        """Colours bounded to those that light may have."""
        return np.clip(found, 0, 1)

    @property
    def absorbs(self) -> bool:
        return False

    @property
    def key(self) -> Hashable:
        """Equal for films that reflect alike, and are not of a texture."""
        return type(self), self.rarer, self.n12, self.data.tobytes()

    def reading(self, flat: Any) -> Coated:
        """The same films with values of Dr.Jit, flat; differentiable."""
        found = copy.copy(self)
        found._number, found._reversed, found.known = type(flat), None, False
        dialect = sys.modules[type(flat).__module__]
        found._packets = {dialect: packets(flat, self.data.shape[-1], dialect)}
        return found

    def of(self, layer: InterfaceValues, above: Value) -> Coated:
        """The films at the thickness that a layer has."""
        return self._at(self.axis.place(layer.films[self.axis.film].thickness_nm)) if self.axis else self

    def reversed(self) -> Coated:
        if self._reversed is None:
            found = copy.copy(self)
            found.rarer, found.n12 = 3 - self.rarer, 1 / self.n12 if self.n12 else None
            found.axis = self.axis and self.axis.reversed()
            self._reversed = found
        return self._reversed._at(*self.place)

    def averaged(self, often: bool) -> tuple[Average, Average] | None:
        """Look-ups of albedo and absorptance over the cosine and the roughness; None where there are none yet."""
        return None

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        return self.at(self.cosine(cos_1, cos_2), like)

    def between_either(self, where: Value, other: Films, cos_1: Value, cos_2: Value, like: Value) -> Value:
        if isinstance(other, Coated) and not self.absorbs:
            cosine = ops.select(where, self.cosine(cos_1, cos_2), other.cosine(cos_1, cos_2))
            if self.data is other.data and self.known == other.known and not self.place:
                return self.at(cosine, like)
            if self.known and other.known and self.data.shape == other.data.shape:
                place = ops.minimum(cosine, 1.0) * (NODES - 1) + ops.select(where, 0.0, float(NODES))
                return _both(self, other).fetched(like, place / (2 * NODES - 1))
        return super().between_either(where, other, cos_1, cos_2, like)

    def shares(self, above: Value, cosine: Value, cos_t: Value, like: Value) -> tuple[Value, Value]:
        reflected = self.at(ops.select(self.from_rarer(above), cosine, cos_t), like)
        return reflected, 1 - reflected

    def from_rarer(self, above: Value) -> Value:
        """Whether light comes from the rarer side."""
        return above if self.rarer == 1 else above ^ True

    def cosine(self, cos_1: Value, cos_2: Value) -> Value:
        """The cosine on the rarer side."""
        return cos_1 if self.rarer == 1 else cos_2

    def at(self, cosine: Value, like: Value) -> Value:
        return self.fetched(like, *self.place, cosine)

    def _at(self, *place: Value) -> Coated:
        if not place:
            return self
        found = copy.copy(self)
        found.place = place
        return found


class Absorbing(Coated):
    """Reflectance and transmittance of a dielectric whose films absorb.

    `data` have three colours at a node: what is reflected on the rarer side, on the denser side, and what passes. The
    nodes of the cosine on the rarer side follow those of total reflection, over the angle whose cosine is that on the
    denser side over the one at the critical angle: (2 NODES - 1, 3 C).
    """

    @classmethod
    def of_coating(cls, coating: Coating, rarer: int, n12: float, shares: Shares) -> Absorbing:
        """The table of a coating seen from the rarer side, by a function of its properties."""
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
        """Coordinate of a pair of cosines among the nodes."""
        ratio = ops.minimum(n12, 1 / n12)
        share = ops.minimum(denser / ops.sqrt(ops.maximum(1 - ratio * ratio, MATCHED)), 1.0)
        angle = ops.arctan2(ops.sqrt(1 - share * share), share)
        return 0.5 + 0.5 * rarer - angle * (1 / pi)


@functools.lru_cache(64)
def _both(a: Coated, b: Coated) -> ColourTable:
    """Table with the nodes of one after those of the other."""
    return ColourTable(np.concatenate([a.data, b.data]))


@dataclass(frozen=True)
class ThicknessAxis:
    """Thicknesses of a film, by its number, on a fixed lattice; a negative number counts from the last film."""

    film: int
    low_nm: float
    high_nm: float
    count: int

    @classmethod
    def around(cls, film: int, low_nm: float, high_nm: float, step_nm: float) -> ThicknessAxis:
        step_nm = max(step_nm, (high_nm - low_nm) / MOST)
        # One node more at either end, so that slopes are those of splines
        begin, end = max(floor(low_nm / step_nm) - 1, 0), ceil(high_nm / step_nm) + 1
        return cls(film, begin * step_nm, end * step_nm, end - begin + 1)

    def reversed(self) -> ThicknessAxis:
        """The axis of the films seen from below."""
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
