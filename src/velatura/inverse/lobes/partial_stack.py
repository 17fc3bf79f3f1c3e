"""Partial stacks above an unknown interface: N of them, at normal incidence, added up by the model itself.

Colours are arrays of shape (C, N) or (1, N), other quantities (N,); a number is the same for all stacks.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.inverse.lobes import coatings
from velatura.inverse.lobes.target import ROUND
from velatura.model import Model
from velatura.model.lobe_statistics import StackLobes, with_axes_named
from velatura.model.papers import adding, operators
from velatura.model.papers.diffuse_base import Base
from velatura.model.papers.prepare import Prepared, PreparedInterface, prepare
from velatura.model.roughness_maps import MAPS, RoughnessMap
from velatura.model.variance import Covariance, Isotropic, PerAxis, Roughness, Variance
from velatura.ops import Value
from velatura.stack import (
    RGB,
    DiffuseValues,
    Film,
    Interface,
    InterfaceValues,
    Kind,
    Layer,
    LayerValues,
    Material,
    Medium,
    MediumValues,
)
from velatura.tables import load

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

NORMAL = (0.0, 0.0, 1.0)
MANY = 256  # interfaces that are worth sorting
CLEAR = 1e-9  # an optical depth below this is written as no medium at all
SAME = 1e-9  # share of a colour by which channels of a grey differ


class Batch:
    """A record of N stacks, or of a part of each: its arrays have a last axis of N, or of 1 if all are equal."""


@dataclass(frozen=True)
class Layers(Batch):
    """N interfaces of one kind ("dielectric", "conductor" or "mirror"), each with the medium above it.

    eta, kappa: absolute indices below, (1, N) or (C, N), kappa None for a dielectric. roughness: GGX, each (N,).
    tau: optical depths at normal incidence of the media above, (C, N) or a number. margins: by name of a constraint,
    (N,), negative where it is broken. scatters: the medium above, if that scatters; it then absorbs as tau says.
    films: on all of them, from the top.
    """

    kind: Kind
    eta: Value
    kappa: Value  # or None
    roughness: Roughness
    tau: Value
    margins: dict[str, Array] = dataclasses.field(default_factory=dict)
    scatters: MediumValues | None = None
    films: tuple[Film, ...] = ()

    @property
    def medium(self) -> MediumValues:
        """The medium above."""
        if self.scatters is None:
            return MediumValues(depth=1.0, sigma_a=self.tau, sigma_s=0.0, g=0.0)
        return dataclasses.replace(self.scatters, sigma_a=self.tau / self.scatters.depth)

    @property
    def alpha(self) -> Value:
        """Roughness along the first axis."""
        return self.roughness.alpha_u

    @property
    def feasible(self) -> Mask:
        """Whether all constraints hold, (N,) of bool."""
        return reduce(np.logical_and, (margin >= 0 for margin in self.margins.values()))

    def with_margins(self, **margins: Array) -> Layers:
        """The interfaces with further constraints."""
        return dataclasses.replace(self, margins={**self.margins, **margins})

    def written(self, n: int, axis: float = 0.0) -> list[Layer]:
        """The n-th as layers of a material: the medium above unless it is clear, and the interface.

        axis: radians; the axis of its roughness that is nearer to it comes first.
        """
        absorbs = np.where(np.asarray(self.tau) < CLEAR, 0.0, self.tau)
        tau, eta, kappa = (_plain(value, n) for value in (absorbs, self.eta, self.kappa))
        u, v, rotation = (_plain(value, n) for value in named_as(self.roughness, axis))
        media: list[Layer] = [] if np.max(tau) == 0 else [Medium(sigma_a=tau)]
        if self.scatters is not None:
            own = dataclasses.replace(self, tau=absorbs).medium
            left_out = "phase" if own.phase is None else "g"
            keys = {key: value for key, value in vars(own).items() if key != left_out}
            media = [Medium(**{key: value if key == "phase" else _plain(value, n) for key, value in keys.items()})]
        brushed = abs(u - v) > ROUND
        alpha = (u, v) if brushed else u if u == v else (u + v) / 2
        index = {"conductor": "mirror"} if self.kind == "mirror" else {"eta": eta, "k": kappa}
        turned = float(np.degrees(rotation)) if brushed else 0.0
        return [*media, Interface(**index, alpha=alpha, rotation=turned, films=self.films)]


@dataclass(frozen=True)
class Above(Batch):
    """N stacks that end in a medium of absolute index eta, (1, N) or a number.

    `over` is the index above their last interface, which total internal reflection depends on; None where there is no
    interface yet. `model` is one in closed form: that asked for, or the nearest to it.
    """

    model: Model
    state: adding.State
    eta: Value
    over: Value | None = None
    variance: type[Variance] = Isotropic

    @classmethod
    def nothing(cls, model: Model, exterior: Value = 1.0, variance: type[Variance] = Isotropic) -> Above:
        """Only the exterior medium."""
        prepared = Prepared(model.surrogate, (), variance, MAPS[model.map], load())
        return cls(model.surrogate, adding.top(prepared, 1.0), exterior, None, variance)

    @property
    def f(self) -> RoughnessMap:
        """The model's roughness map."""
        return MAPS[self.model.map]

    def prepared(self, layers: Layers, reflectance: Value | None = None) -> Prepared:
        """The interfaces as the next layer of each stack; `reflectance` if it is known already."""
        model = self.model if reflectance is None else self.model.with_switches(reflectance="fresnel")
        material = Material((_interface(layers, self.eta),), self.eta)
        if self.over is not None and self.model.tir != "off":
            # The interface above is there for its indices alone, which total reflection depends on
            smooth = InterfaceValues("dielectric", 0.0, 0.0, 0.0, self.eta)
            material = Material((smooth, *material.layers), self.over)
        prepared = prepare(material, model, self.variance)
        if reflectance is None:
            return prepared
        last = prepared.layers[-1]
        assert isinstance(last, PreparedInterface)
        last = dataclasses.replace(last, reflectance=lambda cos_theta, alpha: reflectance)
        return dataclasses.replace(prepared, layers=(*prepared.layers[:-1], last))

    def reflectance(self, layers: Layers) -> Value:
        """Reflectance of the interfaces for light from the stack, of the shape of eta or (C, N)."""
        # Denser and rarer dielectrics need different tables; many are looked up apart
        if np.size(layers.eta) > MANY and np.shape(layers.eta) == (1, *np.shape(layers.alpha)):
            rarer = np.broadcast_to(layers.eta < self.eta, layers.eta.shape)[0]
            if rarer.any() and not rarer.all():
                sides = ((side, take((self, layers), side, rarer.size)) for side in (rarer, ~rarer))
                parts = [(side, above._reflectance(part)) for side, (above, part) in sides]
                found = np.empty((max(part.shape[0] for _, part in parts), len(rarer)))
                for side, part in parts:
                    found[:, side] = part
                return found
        return self._reflectance(layers)

    def _reflectance(self, layers: Layers) -> Value:
        prepared = self.prepared(layers)
        last = prepared.layers[-1]
        assert isinstance(last, PreparedInterface)
        return operators.interface(prepared, last, 1.0, self.state.s_t0i, NORMAL).r_12

    def through(self, tau: Value) -> Above:
        """The stacks with an absorbing medium below them, which does not blur."""
        if np.ndim(tau) == 0 and tau == 0:
            return self
        t, state = np.exp(-np.asarray(tau)), self.state
        a_i0 = 1 - t + t * (state.a_i0 + state.r_i0 * (1 - t))
        passed = {"r_i0": state.r_i0 * t * t, "t_0i": state.t_0i * t, "t_i0": state.t_i0 * t, "a_i0": a_i0}
        return dataclasses.replace(self, state=dataclasses.replace(state, **passed))

    def scattered(self, layers: Layers) -> Above:
        """The stacks with the medium above some interfaces, as far as that scatters."""
        if layers.scatters is None:
            return self
        medium = dataclasses.replace(layers.scatters, sigma_a=0.0)
        prepared = prepare(Material((medium,), self.eta), self.model, self.variance)
        state, _ = adding.add(prepared, self.state, prepared.layers[0], NORMAL)
        return dataclasses.replace(self, state=state)

    def below(self, layers: Layers, reflectance: Value | None = None) -> tuple[Above, adding.Lobe]:
        """The stacks with media and interfaces added below, and the lobes of these interfaces.

        `reflectance` is what `reflectance` has found of the interfaces, where that was asked.
        """
        above = self.through(layers.tau).scattered(layers)
        prepared = above.prepared(layers, reflectance)
        state, lobe = adding.add(prepared, above.state, prepared.layers[-1], NORMAL)
        assert lobe is not None
        return dataclasses.replace(above, state=state, eta=layers.eta, over=self.eta), lobe

    def variance_of(self, roughness: Roughness) -> Variance:
        """The variance of a GGX lobe, along the axes of the frame where there are two."""
        return variance_of(roughness, self.f, self.variance)


def variance_of(roughness: Roughness, f: RoughnessMap, kind: type[Variance]) -> Variance:
    """The variance of a GGX lobe, along the axes of the frame where there are two."""
    if kind is PerAxis:
        xx, _, yy = Covariance.of(roughness, f).matrix()
        return PerAxis(xx, yy)
    return kind.of(roughness, f)


def named_as(roughness: Roughness, axis: float) -> Roughness:
    """The same roughness with the axis first, of both and their directions, that is nearest to a given one."""
    u, v, rotation = with_axes_named(roughness, axis)
    return Roughness(u, v, rotation + np.pi * np.round((axis - rotation) / np.pi))


#: Records in which `take` and `join` look for arrays.
RECORDS: tuple[Any, ...] = (Batch, Base, ops.NamedFields)


def whole(path: Sequence[Layers], exterior: Value, closely: bool = False) -> Material:
    """Whole stacks of interfaces and the media above them; one stack `closely`: films are left to its model."""
    layers: list[LayerValues] = []
    above = exterior
    for part in path:
        if np.any(part.tau) or part.scatters is not None:
            layers.append(part.medium)
        layers.append(_interface(part, None if closely else above))
        above = part.eta
    return Material(tuple(layers), exterior)


def read_whole(path: Sequence[Layers], exterior: float, model: Model) -> StackLobes:
    """The reflected lobes of one stack of interfaces and the media above them, as the model itself has them."""
    material, normal = whole(path, exterior, closely=True), (np.zeros(1), np.zeros(1), np.ones(1))
    if model.closed_form:
        return model.statistics(material, normal)
    from velatura.model.solved.solve import plain  # loads SciPy

    # Nothing passes that would be summed up
    layers = (*(_unbrushed(layer) for layer in material.layers), DiffuseValues(0.0))
    material = dataclasses.replace(material, layers=layers)
    return model.statistics(plain(material), normal)


def _unbrushed(layer: LayerValues) -> LayerValues:
    """The layer, with one roughness where two differ by rounding: stacks are solved in the axes of the others."""
    if isinstance(layer, InterfaceValues) and np.allclose(layer.alpha_u, layer.alpha_v, rtol=0, atol=ROUND):
        return dataclasses.replace(layer, alpha_v=layer.alpha_u)
    return layer


def _interface(layers: Layers, above: Value | None) -> InterfaceValues:
    """The interfaces, with what films below an index `above` reflect unless that is None."""
    u, v, rotation = layers.roughness
    eta = None if layers.kind == "mirror" else layers.eta
    own = coatings.values(layers.films) if layers.films else ()
    coating = coatings.AtNormal(own, above, eta, layers.kappa) if own and above is not None else None
    return InterfaceValues(layers.kind, u, v, rotation * (180 / np.pi), eta, layers.kappa, own, coating)


def take(value: Any, index: Any, count: int) -> Any:
    """Some of the `count` stacks of a record; arrays shared by all stay.

    Raises:
        ValueError: an array that is neither for all stacks nor the same for all.
    """

    def some(x: np.ndarray) -> np.ndarray:
        if x.ndim and x.shape[-1] == count:
            return x[..., index]
        if x.ndim and x.shape[-1] != 1:
            raise ValueError(f"an array of shape {x.shape} in a record of {count} stacks")
        return x

    return mapped(value, some)


def mapped(value: Any, change: Callable[[np.ndarray], np.ndarray]) -> Any:
    """A record with all arrays in it changed, also in tuples, dictionaries and records; other values stay."""
    if isinstance(value, np.ndarray):
        return change(value)
    if isinstance(value, Roughness):
        return Roughness(*(mapped(x, change) for x in value))
    if isinstance(value, tuple):
        return tuple(mapped(entry, change) for entry in value)
    if isinstance(value, dict):
        return {key: mapped(entry, change) for key, entry in value.items()}
    if isinstance(value, RECORDS):
        return dataclasses.replace(value, **{key: mapped(entry, change) for key, entry in vars(value).items()})
    return value


def join(parts: Sequence[Any], counts: Sequence[int]) -> Any:
    """One record of the N1, N2, ... stacks of records of the same kind."""
    first = parts[0]
    if isinstance(first, int | float | np.ndarray):
        if all(not isinstance(part, np.ndarray) and part == first for part in parts):
            return first
        parts = [np.atleast_1d(part) for part in parts]
        lead = np.broadcast_shapes(*(np.shape(x)[:-1] for x in parts))
        return np.concatenate([np.broadcast_to(x, (*lead, count)) for x, count in zip(parts, counts)], axis=-1)
    if isinstance(first, Roughness):
        return Roughness(*(join(entries, counts) for entries in zip(*parts)))
    if isinstance(first, tuple):
        return tuple(join(entries, counts) for entries in zip(*parts))
    if isinstance(first, dict):
        unbounded = np.full(1, np.inf)  # a constraint that only some parts have
        return {key: join([part.get(key, unbounded) for part in parts], counts) for key in set().union(*parts)}
    if isinstance(first, RECORDS):
        fields = {key: join([getattr(part, key) for part in parts], counts) for key in vars(first)}
        return dataclasses.replace(first, **fields)
    return first


def _plain(value: Value | None, n: int) -> Any:
    """The n-th colour as a number, or as three where they differ by more than rounding."""
    if value is None:
        return None
    colour = np.atleast_2d(value)
    numbers = tuple(float(x) for x in colour[:, n if colour.shape[-1] > 1 else 0])
    return numbers[0] if max(numbers) - min(numbers) <= SAME * max(map(abs, numbers)) else numbers


def written(value: Array) -> float | RGB:
    """A colour as in a material: one number if its channels are equal."""
    if np.ptp(value) == 0:
        return float(value[0])
    r, g, b = (float(x) for x in value)
    return r, g, b
