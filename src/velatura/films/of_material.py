"""The films on each layer of a material; tables are made once."""

from __future__ import annotations

import functools
from collections.abc import Collection, Sequence
from dataclasses import replace
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.films.reflectance import InterfaceFilms
from velatura.films.spectral import AtWavelengths
from velatura.films.tables import NODES, Absorbing, Coated
from velatura.ops import Value
from velatura.optics.coatings import Coating, ColouredFilm
from velatura.optics.films import OpticalFilm
from velatura.stack import InterfaceValues, Material, luminance_sensitivity, srgb_sensitivity
from velatura.stack.chain import Meeting, chain

Array = NDArray[np.floating]

SENSITIVITIES = {"srgb": srgb_sensitivity, "luminance": luminance_sensitivity}

_making = Lock()


def films_of(material: Material) -> list[Any]:
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
        return tabulated_films(replace(material, layers=tuple(layers)))
    return tabulated_films(material)


def tabulated_films(material: Material, may_absorb: Collection[int] = ()) -> list[Any]:
    """The films on each layer, taken to absorb on layers of these numbers."""
    found: list[InterfaceFilms | None] = []
    for k, meeting in enumerate(chain(material.solid())):
        layer, films = meeting.layer, None
        if isinstance(layer, InterfaceValues) and layer.films:
            own = layer.coating
            films = own.of(layer, meeting.above) if own else _worked_out(meeting, material.light, k in may_absorb)
        found.append(films)
    return found


def greatest_optical_thickness_nm(material: Material) -> float:
    """Greatest optical thickness of the films on any interface, of values of NumPy."""
    return max(map(optical_thickness_nm, material.interfaces), default=0.0)


def optical_thickness_nm(layer: InterfaceValues) -> float:
    """Optical thickness of all films on an interface."""
    return sum(OpticalFilm(float(np.max(x.eta)), 0.0, x.thickness_nm).in_colours().optical_nm for x in layer.films)


def _worked_out(meeting: Meeting, light: Any, may_absorb: bool) -> InterfaceFilms:
    """The films on a layer; tables of the same NumPy values are made once."""
    layer, above = meeting.layer, meeting.above
    assert isinstance(layer, InterfaceValues)
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


@functools.lru_cache(512)
def _coated(coating: Coating, opaque: bool, absorbs: bool, light: str | tuple[float, ...]) -> Coated:
    n12 = None if opaque else sum(coating.eta_2) / sum(coating.eta_1)
    rarer = 1 if n12 is None or n12 > 1 else 2
    if rarer == 2:
        coating = coating.reversed()

    def shares(of: Coating, names: Sequence[str], cosines: Array) -> Array:
        if isinstance(light, str):
            return of.shares(names, cosines, SENSITIVITIES[light])
        return of.at(names, cosines, np.array(light))

    if n12 and absorbs:
        return Absorbing.of_coating(coating, rarer, n12, shares)
    (reflected,) = shares(coating, ["reflected"], np.linspace(0, 1, NODES))
    return Coated(reflected.T.copy(), rarer, n12, coating)
