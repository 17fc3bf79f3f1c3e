"""Descent: the values of a stack whose reflectance over angles comes closest to a table.

All that is free changes at once, by least squares with the model's own derivatives: differences, of all values in one
call of the model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from velatura.inverse import angles
from velatura.inverse.angles import ReflectanceTable, radiance
from velatura.inverse.partial_stack import CLEAR, Array
from velatura.model import Model, bsdf, named, variance_kind
from velatura.model.mixture import ALPHA_MIN
from velatura.ops import Value
from velatura.stack import (
    RGB,
    DiffuseValues,
    InterfaceValues,
    LayerValues,
    Material,
    MaterialLike,
    MediumValues,
    Stack,
    as_described,
    load,
)

STEP = 1e-5  # of a value, to see how the model changes
ROUNDS, TOLERANCE = 100, 1e-9  # of a descent, and where it ends: the relative change in a round
CONDUCTOR, RATIO = (0.02, 30.0), (1e-3, 30.0)  # bounds of a metal's eta, and of its k over that
DEPTH_MAX = 10.0  # of a medium


@dataclass(frozen=True)
class Fit:
    """A stack that approximates a table, and its error.

    error: root mean square of the difference of log(1 + f cos theta_o). by_angle: as `angles.report` has it. errors:
    the results of the descents from all starts, the best first.
    """

    stack: Stack
    model: Model
    error: float
    by_angle: list[dict[str, float]]
    errors: list[float]


@dataclass(frozen=True)
class Free:
    """A value that may change: its layer, the keys that share it, its channel (None for all alike), its bounds."""

    layer: int
    keys: tuple[str, ...]
    channel: int | None
    low: float
    high: float
    logarithmic: bool

    def shown(self, x: Value) -> Value:
        """The value of a coordinate."""
        return np.exp(x) if self.logarithmic else x

    def written(self, x: float) -> float:
        """As `shown`; a roughness at its lower bound is written as smooth."""
        value = float(self.shown(x))
        return 0.0 if self.low == ALPHA_MIN and value < 1.001 * ALPHA_MIN else value

    def coordinate(self, value: float) -> float:
        kept = min(max(value, self.low), self.high)
        return float(np.log(kept)) if self.logarithmic else kept


def fit(table: ReflectanceTable, starts: Sequence[MaterialLike], model: str | Model, eta_max: float = 4.0) -> Fit:
    """The closest of the stacks found by descents from all starts (stacks, files, or presets' names).

    Raises:
        InvalidInput: not a valid material, an unknown model, or a texture in a start, which has no one value.
    """
    model = named(model)
    ends = sorted((Descent(table, load(start), model, eta_max).run() for start in starts), key=lambda end: end[0])
    stack = ends[0][1]
    by_angle = angles.report(table, angles.table_of(stack, table.directions, model))
    return Fit(stack, model, ends[0][0], by_angle, [error for error, _ in ends])


@dataclass(frozen=True)
class Descent:
    """A descent from one stack: its indices, roughnesses, absorption and albedo change; all else stays."""

    table: ReflectanceTable
    start: Stack
    model: Model
    eta_max: float

    @cached_property
    def material(self) -> Material:
        """Of the start: a colour (3, 1, 1), for channels, points and directions, or a float; k over eta for k."""
        material = Material.of(self.start).each(lambda address, value: value[..., None] if address.colour else value)
        return _metals(material, lambda layer: layer.k / layer.eta)

    @cached_property
    def free(self) -> list[Free]:
        found: list[Free] = []
        for n, layer in enumerate(self.material.layers):
            if type(layer) in FREE:
                found += FREE[type(layer)](n, layer, self.eta_max)
        return found

    @cached_property
    def wanted(self) -> Array:
        return np.log1p(self.table.value * self.table.directions.wo[2])

    def run(self) -> tuple[float, Stack]:
        """The final error, and the stack."""
        from scipy.optimize import least_squares

        bounds = np.array([[free.coordinate(free.low), free.coordinate(free.high)] for free in self.free]).T
        x = np.array([free.coordinate(self._first(free)) for free in self.free])
        inset = 1e-9 * (bounds[1] - bounds[0])
        found = least_squares(
            lambda x: self.residuals(x[None])[0],
            np.clip(x, bounds[0] + inset, bounds[1] - inset),
            jac=self.jacobian,
            bounds=bounds,
            x_scale=np.maximum(0.1 * (bounds[1] - bounds[0]), 1e-3),
            xtol=TOLERANCE,
            ftol=TOLERANCE,
            gtol=None,
            max_nfev=ROUNDS,
        )
        # Keep the start where the descent has gained nothing
        first = self.residuals(x[None])[0]
        best, residuals = (x, first) if np.sum(first**2) <= 2 * found.cost else (found.x, found.fun)
        return float(np.sqrt(np.mean(residuals**2))), self.stack(best)

    def residuals(self, x: Array) -> Array:
        """Errors of log(1 + f cos), (P, 3 N), at P points x (P, free) (Low et al. 2012)."""
        material = self.material
        for n, free in enumerate(self.free):
            layer, shown = material.layers[free.layer], free.shown(x[:, n, None])
            changed = {key: _changed(getattr(layer, key), free, shown) for key in free.keys}
            material = material.with_layer(free.layer, **changed)
        variance = variance_kind(Material.of(self.start, as_described))
        seen = bsdf.body(_metals(material, lambda layer: layer.k * layer.eta), self.model, variance)
        value = radiance(seen, self.table.directions)
        shape = (3, len(x), len(self.table.directions.theta_i))
        missed = np.log1p(np.broadcast_to(value, shape)) - self.wanted[:, None]
        return np.moveaxis(missed, 0, 1).reshape(len(x), -1)

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residuals, (3 N, free)."""
        steps = STEP * np.eye(len(x))
        ahead, behind = np.split(self.residuals(np.concatenate([x + steps, x - steps])), 2)
        return ((ahead - behind) / (2 * STEP)).T

    def stack(self, x: Array) -> Stack:
        """The material at a point, without clear media."""
        material = self.material.each(lambda address, value: np.ravel(value))
        for free, coordinate in zip(self.free, x):
            for key in free.keys:
                own = np.array(getattr(material.layers[free.layer], key))
                own[slice(None) if free.channel is None else free.channel] = free.written(coordinate)
                material = material.with_layer(free.layer, **{key: own})
        changed = {(free.layer, key) for free in self.free for key in free.keys}
        values = _metals(material, lambda layer: layer.k * layer.eta).values()
        found = self.start.replace(**{at.name: written(x) for at, x in values if (at.layer, at.key) in changed})
        pairs = zip(found.layers, Material.of(found).layers)
        return found.with_layers(layer for layer, values in pairs if not _clear(values))

    def _first(self, free: Free) -> float:
        value = np.ravel(getattr(self.material.layers[free.layer], free.keys[0]))
        return float(np.mean(value) if free.channel is None else value[free.channel])


def _of_base(n: int, layer: DiffuseValues, eta_max: float) -> list[Free]:
    return [Free(n, ("albedo",), c, 0.0, 1.0, False) for c in range(3)]


def _of_medium(n: int, layer: MediumValues, eta_max: float) -> list[Free]:
    if layer.depth <= 0:
        return []
    return [Free(n, ("sigma_a",), c, 0.0, DEPTH_MAX / layer.depth, False) for c in range(3)]


def _of_interface(n: int, layer: InterfaceValues, eta_max: float) -> list[Free]:
    axes = [("alpha_u", "alpha_v")] if layer.alpha_u == layer.alpha_v else [("alpha_u",), ("alpha_v",)]
    found = [Free(n, keys, None, ALPHA_MIN, 1.0, True) for keys in axes]
    if layer.kind == "dielectric":
        eta = layer.eta
        channels = range(3) if np.ptp(eta) > 0 else (None,)
        found += [Free(n, ("eta",), c, min(1.0, eta.min()), max(eta_max, eta.max()), True) for c in channels]
    if layer.kind == "conductor":
        # A conductor has k >= eta, unless it begins with less
        ratio = np.ravel(layer.k)
        found += [Free(n, ("eta",), c, *CONDUCTOR, True) for c in range(3)]
        found += [Free(n, ("k",), c, float(np.clip(ratio[c], RATIO[0], 1)), RATIO[1], True) for c in range(3)]
    return found


#: The values that may change, by layer; all others stay.
FREE: dict[type, Callable[..., list[Free]]] = {
    DiffuseValues: _of_base,
    MediumValues: _of_medium,
    InterfaceValues: _of_interface,
}


def _metals(material: Material, k: Callable[[InterfaceValues], Value]) -> Material:
    """The material with another `k` of its conductors."""
    for n, layer in enumerate(material.layers):
        if isinstance(layer, InterfaceValues) and layer.kind == "conductor":
            material = material.with_layer(n, k=k(layer))
    return material


def _changed(value: Value, free: Free, x: Array) -> Value:
    """A value at several points, (P, 1) of a number, in all or one of the channels of a colour."""
    if np.ndim(value) == 0:
        return x
    if free.channel is None:
        return x[None]
    own = np.broadcast_to(value, (3, *x.shape)).copy()
    own[free.channel] = x
    return own


def written(value: Array) -> float | RGB:
    """A colour as in a material: one number if its channels are equal."""
    if np.ptp(value) == 0:
        return float(value[0])
    r, g, b = (float(x) for x in value)
    return r, g, b


def _clear(layer: LayerValues) -> bool:
    """Whether a layer is a medium without effect."""
    if not isinstance(layer, MediumValues):
        return False
    return bool(np.maximum(layer.sigma_a, layer.sigma_s).max() * layer.depth < CLEAR)
