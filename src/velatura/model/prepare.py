"""A stack made ready for a model: all that does not depend on the direction of light.

Values arrive under the flat names of a material (`layer0_eta`, ...), in any dialect; a renderer hands in constants once
and textured values at every point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import pi

from velatura import ops, tables
from velatura.model.maps import MAPS, RoughnessMap
from velatura.model.models import Model
from velatura.model.variance import Covariance, Isotropic, PerAxis, Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.tables import Average, Row, Tables


@dataclass(frozen=True)
class PreparedInterface(ops.Named):
    """An interface between media of indices eta_1 above and eta_2 below (colours; kappa None for a dielectric).

    `eta` = eta_2/eta_1 and `kappa` = k_2/eta_1 are None for a mirror, which reflects all light. `n12` is the mean of
    eta over the channels: one refracted direction for all colours. `reflectance` is its directional albedo, None where
    the model takes Fresnel at the mean direction; `leaving` the share of light going up from it that total internal
    reflection lets out, None where that is all.
    """

    eta: Value | None
    kappa: Value | None
    n12: Value
    roughness: Roughness
    s_r: Variance
    reflectance: Average | None
    leaving: Average | None

    @property
    def opaque(self) -> bool:
        return self.eta is None or self.kappa is not None

    def reflect(self, cos_theta: Value) -> Value:
        """Fresnel reflectance of its facets."""
        if self.eta is None:
            return 1.0
        if self.kappa is None:
            return fresnel.dielectric(cos_theta, self.eta)
        return fresnel.conductor(cos_theta, self.eta, self.kappa)


@dataclass(frozen=True)
class PreparedMedium(ops.Named):
    """A medium by its optical depths along the normal (colours) and its asymmetry g."""

    tau: Value
    tau_s: Value
    g: Value


@dataclass(frozen=True)
class PreparedBase:
    """A diffuse base: albedo (a colour), index n of the medium at it over that outside, what the stack does to light.

    The means (colours) are those for diffuse light from below. `worth` is the share of light below the first interface
    that reaches the base, at each node of `tables.diffuse_nodes`. All are known once the layers are.
    """

    albedo: Value
    n: Value
    mean_reflectance: Value = 0.0
    mean_transmittance: Value = 1.0
    worth: tuple[Value, ...] = ()

    @property
    def means(self) -> tuple[Value, ...]:
        """All that the stack does to its light."""
        return self.mean_reflectance, self.mean_transmittance, *self.worth


@dataclass(frozen=True)
class Prepared:
    """The layers from the top, a diffuse base apart; the model's parts that they were prepared for.

    For the recursion in momentum, `once` is the albedo of the first interface where light meets its facets once; None
    where a medium lies above the first interface, or below the last one.
    """

    model: Model
    layers: tuple[PreparedInterface | PreparedMedium, ...]
    variance: type[Variance]
    f: RoughnessMap
    base: PreparedBase | None = None
    once: Average | None = None


def variance_kind(kinds: Sequence[str], values: Mapping[str, object]) -> type[Variance]:
    """The cheapest kind of variance that holds all interfaces; `values` by flat name, only compared, never computed."""
    interfaces = [i for i, kind in enumerate(kinds) if kind not in ("medium", "diffuse")]
    same = [_same(values[f"layer{i}_alpha_u"], values[f"layer{i}_alpha_v"]) for i in interfaces]
    straight = [_same(values[f"layer{i}_rotation"], 0.0) for i in interfaces]
    if all(same):
        return Isotropic
    return PerAxis if all(s or t for s, t in zip(same, straight)) else Covariance


def _same(a: object, b: object) -> bool:
    return a is b or (isinstance(a, float) and isinstance(b, float) and a == b)


def prepare(
    kinds: Sequence[str],
    values: Mapping[str, Value],
    model: Model,
    variance: type[Variance],
    constant: bool = True,
    number: type | None = None,
) -> Prepared:
    """Constants of the whole stack.

    Args:
        kinds: of the layers from the top (`Stack.kinds`).
        values: numbers and colours under flat names (`Stack.flat`), rotations in degrees.
        variance: from `variance_kind`.
        constant: whether the values may be looked at now, to leave out look-ups that they can never need.
        number: Dr.Jit's type of numbers, to have the averages of this material sampled once; None to look them up in
            the shared tables.
    """
    averages = _Averages(model, tables.load(), constant, number)
    layers: list[PreparedInterface | PreparedMedium] = []
    eta_1, n_leaving, base = values["exterior"], None, None
    n: Value = 1.0  # index so far, and the lowest of those above, over that outside
    lowest: Value = 1.0
    for i, kind in enumerate(kinds):
        layer = {key.partition("_")[2]: value for key, value in values.items() if key.startswith(f"layer{i}_")}
        if kind == "medium":
            layers.append(_medium(layer))
        elif kind == "diffuse":
            base = PreparedBase(layer["albedo"], n)
        else:
            layers.append(_interface(kind, layer, eta_1, n_leaving, averages, variance))
            if kind == "dielectric":
                lowest, n = ops.minimum(lowest, n), n * ops.mean(layer["eta"] / eta_1)
                n_leaving = lowest / n if model.calibrations else ops.mean(eta_1 / layer["eta"])
                ops.names(n_leaving=n_leaving)
                eta_1 = layer["eta"]
    prepared = Prepared(model, tuple(layers), variance, MAPS[model.map], base)
    if model.calibrations is None:
        return prepared
    # A pane under a medium is drawn alike from both sides, or a lobe could not be chosen by the side that light is on
    first = layers[0] if layers and kinds[-1] != "medium" else None
    once = averages.once(first.eta, first.kappa) if isinstance(first, PreparedInterface) else None
    return replace(prepared, once=once)


def _medium(layer: Mapping[str, Value]) -> PreparedMedium:
    with ops.block("Scattered light stays in the lobe only where it goes forwards (model of Belcour 2018, 4.4)"):
        tau_s = layer["sigma_s"] * layer["depth"]
    return PreparedMedium(layer["sigma_a"] * layer["depth"] + tau_s, tau_s, layer["g"])


def _interface(
    kind: str,
    layer: Mapping[str, Value],
    eta_1: Value,
    n_leaving: Value | None,
    averages: _Averages,
    variance: type[Variance],
) -> PreparedInterface:
    roughness = Roughness(layer["alpha_u"], layer["alpha_v"], layer["rotation"] * (pi / 180))
    s_r = variance.of(roughness, MAPS[averages.model.map])
    eta = layer["eta"] / eta_1 if kind != "mirror" else None
    kappa = layer["k"] / eta_1 if kind == "conductor" else None
    n12 = ops.mean(eta) if kind == "dielectric" else 1.0
    reflectance, leaving = averages.reflectance(eta, kappa), averages.leaving(n_leaving)
    return PreparedInterface(eta, kappa, n12, roughness, s_r, reflectance, leaving)


@dataclass(frozen=True)
class _Averages:
    """How a model looks up averages over rough interfaces."""

    model: Model
    tables: Tables
    constant: bool
    number: type | None

    def reflectance(self, eta: Value | None, kappa: Value | None) -> Average | None:
        if self.model.reflectance in ("fresnel", "fg"):
            return None
        multiple = self.model.reflectance == "fgd-multi"
        if self.model.reflectance == "split-sum":
            r_0 = 1.0 if eta is None else fresnel.normal_incidence(eta, 0.0 if kappa is None else kappa)
            row = tables.schlick_row(self.tables, r_0)
        elif eta is None:
            if multiple:
                return None  # light that bounces between the facets of a mirror is not lost
            row = tables.mirror_row(self.tables)
        elif kappa is None:
            row = tables.dielectric_row(self.tables, eta, self.constant, multiple)
        else:
            row = tables.conductor_row(self.tables, eta, kappa, self.constant, multiple)
        return self._of(row)

    def once(self, eta: Value | None, kappa: Value | None) -> Average:
        """Albedo of an interface whose facets light meets once."""
        average = replace(self, model=replace(self.model, reflectance="fgd")).reflectance(eta, kappa)
        assert average is not None
        return average

    def _of(self, row: Row) -> Average:
        if self.number:
            return tables.fgd_sheet(self.tables, row, self.number)
        return partial(tables.fgd, self.tables, row)

    def leaving(self, n: Value | None) -> Average | None:
        if n is None or self.model.tir == "off":
            return None
        if self.number:
            return tables.tir_sheet(self.tables, self.model.tir, n, self.number)
        return partial(tables.tir, self.tables, self.model.tir, n)
