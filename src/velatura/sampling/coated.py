"""Fresnel's reflectance of an interface with thin films, sampled once over the cosine, so that it is one fetch."""

from __future__ import annotations

import functools
import sys
from dataclasses import dataclass
from threading import Lock
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.coatings import Coating, ColouredFilm, Sensitivity
from velatura.sampling.packets import Packets, packets

Array = NDArray[np.floating]

NODES = 257  # even over the cosine; between them no reflectance bends by more than 3e-4


class Sampled:
    """Colours at the nodes of a grid, which a look-up interpolates; `data` has the channels on its last axis."""

    def __init__(self, data: Array) -> None:
        self.data, self.shape = data, data.shape[:-1]
        self._packets: dict[Any, Packets] = {}

    def packets(self, dialect: Any) -> Packets:
        """The values for a Dr.Jit module, made at first use."""
        with _uploading:
            if dialect not in self._packets:
                self._packets[dialect] = packets(self.data.ravel(), self.data.shape[-1], dialect)
            return self._packets[dialect]

    def fetched(self, like: Value, *coordinates: Value) -> Value:
        """A colour of the kind of `like`."""
        (colour,) = self.colours(like, *coordinates)
        return colour

    def colours(self, like: Value, *coordinates: Value) -> list[Value]:
        """Colours of the kind of `like`, of three channels each."""
        channels = ops.interpolate(self, *coordinates)
        each = [channels[k : k + 3] for k in range(0, len(channels), 3)]
        if not isinstance(like, float | np.ndarray):
            of: Any = type(like)
            kind = _colour(of)
            return [kind(colour) for colour in each]
        return [colour if colour.ndim > 1 else colour[:, None] for colour in map(np.stack, each)]


class Coated(Sampled):
    """Reflectance of an interface by colour, for light from either side.

    Where it transmits it absorbs nothing, so that light of one tangential momentum is reflected alike from both sides:
    it is sampled over the cosine on the `rarer` side, beyond which light is totally reflected. That is 1 above the
    interface, and 2 below it; above, where it is opaque. `data` are the values at the nodes, (NODES, 3), and `n12` the
    relative index for all colours, None where it is opaque. `coating` is what they are the reflectance of, from the
    rarer side.
    """

    known = True  # whether the data may be looked at now

    def __init__(self, data: Array, rarer: int, n12: float | None = None, coating: Coating | None = None) -> None:
        super().__init__(data)
        self.rarer, self.n12, self.coating = rarer, n12, coating

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """For cosines above and below, 0 where light cannot be; a colour of the kind of `like`."""
        return self.at(cos_1 if self.rarer == 1 else cos_2, like)

    def at(self, cosine: Value, like: Value) -> Value:
        """For the cosine on the rarer side."""
        return self.fetched(like, cosine)


@dataclass(frozen=True)
class Either:
    """Films `a` where a condition holds, else `b`; None without any."""

    where: Value
    a: Films
    b: Films


Films: TypeAlias = Coated | Either | None


def either(where: Value, a: Films, b: Films) -> Films:
    """Films that differ from place to place."""
    return a if a is b else Either(where, a, b)


def dielectric_between(films: Films, cos_1: Value, cos_2: Value, eta: Value) -> Value:
    """Reflectance of a dielectric with films, for cosines above and below: as `fresnel.dielectric_between`."""
    if films is None:
        return fresnel.dielectric_between(cos_1, cos_2, eta)
    if isinstance(films, Either):
        return ops.select(films.where, *(dielectric_between(x, cos_1, cos_2, eta) for x in (films.a, films.b)))
    return films.between(cos_1, cos_2, eta)


@functools.cache
def _colour(kind: Any) -> Any:
    """A renderer's type of colours, for one of colours, or of numbers."""
    import drjit as dr

    is_number = dr.depth_v(kind) == (1 if dr.is_jit_v(kind) else 0)
    return sys.modules[kind.__module__].Array3f if is_number else kind


_uploading = Lock()


def coated(described: Any, sensitivity: Sensitivity) -> Coated:
    """The interface described by `velatura.stack.CoatingValues`, as `sensitivity` sees it; made once. What is read
    elsewhere stays."""
    if isinstance(described, Coated):
        return described
    with _making:
        return _coated(described, sensitivity)


_making = Lock()


@functools.lru_cache(64)
def _coated(described: Any, sensitivity: Sensitivity) -> Coated:
    films = tuple(ColouredFilm(film.eta, film.k, film.thickness_nm) for film in described.films)
    coating = Coating(films, described.eta_1, described.eta_2, described.k_2)
    rarer = 1 if described.opaque or sum(described.eta_1) < sum(described.eta_2) else 2
    if rarer == 2:
        coating = Coating(films[::-1], described.eta_2, described.eta_1)
    n12 = None if described.opaque else sum(described.eta_2) / sum(described.eta_1)
    return Coated(coating.reflectance(np.linspace(0, 1, NODES), sensitivity).T.copy(), rarer, n12, coating)
