"""The values of a stack that may change, as coordinates within bounds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from velatura.inverse.lobes.interface import conductor_extinction
from velatura.inverse.lobes.partial_stack import CLEAR, Array, written
from velatura.model.guards import ALPHA_MIN
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.stack import DiffuseValues, InterfaceValues, LayerValues, Material, MediumValues, Stack
from velatura.stack.layers import film_key
from velatura.stack.values import THICKEST_NM

CONDUCTOR, BRIGHTEST = (0.02, 30.0), 0.999  # bounds of a metal's eta, and of its reflectance in air
DEPTH_MIN, DEPTH_MAX = 1e-3, 10.0  # of a medium, that of a coat at least
THINNEST_NM = 1.0  # of a film


@dataclass(frozen=True)
class Free:
    """A value that may change: its layer, the keys that share it, its channel (None for all alike), its bounds."""

    layer: int
    keys: tuple[str, ...]
    channel: int | None
    low: float
    high: float
    logarithmic: bool

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of its coordinate."""
        return self.coordinate(self.low), self.coordinate(self.high)

    def name(self, layer: int) -> str:
        """The flat name in a stack where it belongs to that layer, and the channel."""
        key = "alpha" if len(self.keys) > 1 else self.keys[0]
        return f"layer{layer}_{key}" + ("" if self.channel is None else f" {'rgb'[self.channel]}")

    def shown(self, x: Value) -> Value:
        """The value of a coordinate."""
        return np.exp(x) if self.logarithmic else x

    def rounded(self, value: float) -> float:
        """The value as it is written: a roughness at its lower bound is smooth."""
        return 0.0 if self.low == ALPHA_MIN and value < 1.001 * ALPHA_MIN else float(value)

    def coordinate(self, value: float) -> float:
        kept = min(max(value, self.low), self.high)
        return float(np.log(kept)) if self.logarithmic else kept


@dataclass(frozen=True, kw_only=True)
class FreeValues:
    """Indices, roughnesses, absorption and albedo of a stack; all else stays.

    darkest: the least `share` of conductors; 0 for metals, k >= eta. films: whether indices and thicknesses of films
    change. allowed: a value with the bounds that it may change within, None where it stays. laid: media of which the
    depth changes, from the `thinnest`, in the place of what they absorb per unit of it.
    """

    start: Stack
    eta_max: float = 4.0
    darkest: float = 0.0
    films: bool = True
    allowed: Callable[[Free], Free | None] = lambda free: free
    laid: frozenset[int] = frozenset()
    thinnest: float = 0.0

    @cached_property
    def material(self) -> Material:
        """Values of the start: a colour (3, 1, 1), for channels, points and directions, or a float.

        For k of a metal it has its reflectance, as a share of what eta allows: that is what absorption trades with.
        """
        material = Material.of(self.start).each(lambda address, value: value[..., None] if address.colour else value)
        return metals(material, lambda layer: share(layer.eta, layer.k))

    @cached_property
    def free(self) -> list[Free]:
        found: list[Free] = []
        for n, layer in enumerate(self.material.layers):
            if n in self.laid and isinstance(layer, MediumValues):
                found += _of_coat(n, layer, self.thinnest)
            elif type(layer) in FREE:
                found += FREE[type(layer)](n, layer, self.eta_max, self.darkest)
            if isinstance(layer, InterfaceValues) and self.films:
                found += _of_films(n, layer, self.eta_max)
        return [free for each in found if (free := self.allowed(each))]

    @property
    def scale(self) -> Array:
        """Units of coordinates."""
        return np.maximum(0.1 * np.ptp([free.bounds for free in self.free], axis=1), 1e-3)

    def values(self, x: Array) -> Array:
        """The values of points (P, free), a metal's k among them."""
        value = np.transpose([free.shown(own) for free, own in zip(self.free, x.T)])
        of = {(free.layer, free.channel): n for n, free in enumerate(self.free) if free.keys == ("eta",)}
        for n, free in enumerate(self.free):
            if free.keys == ("k",):
                value[:, n] = extinction(value[:, of[free.layer, free.channel]], value[:, n])
        return np.asarray(value)

    def placed(self, x: Array) -> tuple[Stack, list[int]]:
        """The material at a point, and its layers that are no clear media."""
        material = self.material.each(lambda address, value: np.ravel(value))
        for free, coordinate in zip(self.free, x):
            for key in free.keys:
                own = np.array(_of_key(material, free.layer, key))
                own[slice(None) if free.channel is None else free.channel] = free.rounded(free.shown(coordinate))
                material = _with_key(material, free.layer, key, own)
        changed = {(free.layer, key) for free in self.free for key in free.keys}
        values = metals(material, lambda layer: extinction(layer.eta, layer.k)).values()
        found = self.start.replace(**{at.name: written(x) for at, x in values if (at.layer, at.key) in changed})
        return found, [n for n, layer in enumerate(Material.of(found).layers) if not _clear(layer)]

    @property
    def first(self) -> Array:
        """The coordinates of the start, as far as it lies within the bounds, (free,)."""
        return np.array([free.coordinate(self._first(free)) for free in self.free])

    def _first(self, free: Free) -> float:
        value = np.ravel(_of_key(self.material, free.layer, free.keys[0]))
        return float(np.mean(value) if free.channel is None else value[free.channel])


def _of_base(n: int, layer: DiffuseValues, eta_max: float, darkest: float) -> list[Free]:
    return [Free(n, ("albedo",), c, 0.0, 1.0, False) for c in range(3)]


def _of_medium(n: int, layer: MediumValues, eta_max: float, darkest: float) -> list[Free]:
    if layer.depth <= 0:
        return []
    return [Free(n, ("sigma_a",), c, 0.0, DEPTH_MAX / layer.depth, False) for c in range(3)]


def _of_coat(n: int, layer: MediumValues, thinnest: float) -> list[Free]:
    most = float(np.max(layer.sigma_a))
    if most == 0:
        return []
    low, high = max(thinnest, DEPTH_MIN / most), max(2 * thinnest, DEPTH_MAX / most)
    return [Free(n, ("depth",), None, low, high, True)]


def _of_interface(n: int, layer: InterfaceValues, eta_max: float, darkest: float) -> list[Free]:
    axes = [("alpha_u", "alpha_v")] if layer.alpha_u == layer.alpha_v else [("alpha_u",), ("alpha_v",)]
    found = [Free(n, keys, None, ALPHA_MIN, 1.0, True) for keys in axes]
    if layer.alpha_u != layer.alpha_v and layer.rotation != 0:
        found.append(Free(n, ("rotation",), None, layer.rotation - 180, layer.rotation + 180, False))
    if layer.kind == "dielectric":
        eta = layer.eta
        channels = range(3) if np.ptp(eta) > 0 else (None,)
        found += [Free(n, ("eta",), c, min(1.0, eta.min()), max(eta_max, eta.max()), True) for c in channels]
    if layer.kind == "conductor":
        # A conductor has k >= eta, unless it begins with less, or may be as dark as any absorbing base
        found += [Free(n, ("eta",), c, *CONDUCTOR, True) for c in range(3)]
        found += [Free(n, ("k",), c, min(float(np.ravel(layer.k)[c]), darkest), 1.0, False) for c in range(3)]
    return found


def _of_films(n: int, layer: InterfaceValues, eta_max: float) -> list[Free]:
    found: list[Free] = []
    for k, film in enumerate(layer.films):
        channels = range(3) if np.ptp(film.eta) > 0 else (None,)
        high = max(eta_max, np.max(film.eta))
        found += [Free(n, (film_key(k, "eta"),), c, min(1.0, np.min(film.eta)), high, True) for c in channels]
        found.append(Free(n, (film_key(k, "thickness_nm"),), None, THINNEST_NM, THICKEST_NM, True))
    return found


def _of_key(material: Material, n: int, key: str) -> Value:
    """A value of a layer, or of one of its films."""
    return next(value for address, value in material.values() if (address.layer, address.key) == (n, key))


def _with_key(material: Material, n: int, key: str, new: Value) -> Material:
    """The material with such a value changed."""
    return material.each(lambda address, value: new if (address.layer, address.key) == (n, key) else value)


#: The values that may change, by layer; all others stay.
FREE: dict[type, Callable[..., list[Free]]] = {
    DiffuseValues: _of_base,
    MediumValues: _of_medium,
    InterfaceValues: _of_interface,
}


def share(eta: Value, k: Value) -> Value:
    """The reflectance of a metal in air, from that of k = eta (0) to `BRIGHTEST` (1)."""
    least = fresnel.normal_incidence(eta, eta)
    return (fresnel.normal_incidence(eta, k) - least) / (BRIGHTEST - least)


def extinction(eta: Value, share: Value) -> Value:
    """The k that reflects this share."""
    least = fresnel.normal_incidence(eta, eta)
    return conductor_extinction(least + share * (BRIGHTEST - least), eta)


def metals(material: Material, k: Callable[[InterfaceValues], Value]) -> Material:
    """The material with another `k` of its conductors."""
    for n, layer in enumerate(material.layers):
        if isinstance(layer, InterfaceValues) and layer.kind == "conductor":
            material = material.with_layer(n, k=k(layer))
    return material


def _clear(layer: LayerValues) -> bool:
    """Whether a layer is a medium without effect."""
    if not isinstance(layer, MediumValues):
        return False
    return bool(np.maximum(layer.sigma_a, layer.sigma_s).max() * layer.depth < CLEAR)
