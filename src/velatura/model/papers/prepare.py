"""A stack prepared for a model: all values that do not depend on the direction of light.

Values arrive as a `Material`, in any dialect; a renderer hands in constants once and textured values at every point.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from math import pi

from velatura import ops, tables
from velatura.model.context import Context
from velatura.model.film_average import film_average
from velatura.model.models import Model
from velatura.model.roughness_maps import MAPS, RoughnessMap
from velatura.model.variance import Covariance, Isotropic, PerAxis, Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.sampling import coated
from velatura.sampling.coated import Coated, Either, Films, absorbs
from velatura.stack import DiffuseValues, InterfaceValues, Material, MediumValues
from velatura.tables import Average, Row, Tables

COS_MIN = 1e-4  # keeps ways through media, and Snell's factors, finite at grazing


@dataclass(frozen=True)
class PreparedInterface(ops.Named):
    """An interface between media of indices eta_1 above and eta_2 below (colours; kappa None for a dielectric).

    `eta` = eta_2/eta_1 and `kappa` = k_2/eta_1 are None for a mirror, which reflects all light. `n12` is that of means
    over the channels: one refracted direction for all colours. `reflectance` is its directional albedo, None where
    the model takes Fresnel at the mean direction; `leaving` the share of light going up from it that total internal
    reflection lets out, None where that is all; `absorbed` what films of a dielectric absorb, None for nothing.
    """

    eta: Value | None
    kappa: Value | None
    n12: Value
    roughness: Roughness
    s_r: Variance
    reflectance: Average | None
    leaving: Average | None
    films: Films = None
    absorbed: Average | None = None

    @property
    def opaque(self) -> bool:
        return self.eta is None or self.kappa is not None

    def reflect(self, cos_theta: Value) -> Value:
        """Fresnel reflectance of its facets."""
        if self.eta is None:
            return 1.0
        if self.films:
            if self.opaque and not isinstance(self.films, Either):
                return self.films.at(cos_theta, self.eta)
            return self.films.between(cos_theta, fresnel.cos_transmitted(cos_theta, self.n12), self.eta)
        if self.kappa is None:
            return fresnel.dielectric(cos_theta, self.eta)
        return fresnel.conductor(cos_theta, self.eta, self.kappa)

    def reflect_together(self, cos2: Value) -> Value:
        """As `reflect`, by the square of the cosine, with the one refracted direction: all colours are totally
        reflected from the same angle on."""
        if self.eta is None or self.kappa is not None or self.films:
            return self.reflect(ops.sqrt(cos2))
        return fresnel.dielectric_together(cos2, self.n12, self.eta)

    def pass_together(self, cos2: Value) -> Value:
        """What facets of a dielectric let pass, likewise."""
        if self.films:
            cos_theta = ops.sqrt(cos2)
            return self.films.passing(cos_theta, fresnel.cos_transmitted(cos_theta, self.n12), self.eta)
        return 1 - self.reflect_together(cos2)

    def absorb(self, cos_theta: Value) -> Value:
        """What films on the facets of a dielectric absorb."""
        return 1 - self.reflect(cos_theta) - self.pass_together(cos_theta * cos_theta)

    def reflect_back(self, cos_theta: Value, cos_t: Value) -> Value:
        """Fresnel reflectance of the facets of a dielectric with films from below, for cosines on both sides."""
        assert self.films
        return self.films.reversed().between(cos_t, cos_theta, self.eta)


@dataclass(frozen=True)
class PreparedMedium(ops.Named):
    """A medium by its optical depths along the normal (colours) and its asymmetry g."""

    tau: Value
    tau_s: Value
    g: Value

    def along(self, depth: Value, cosine: Value) -> Value:
        """A depth along the normal, as a depth along light at this cosine."""
        return depth / ops.maximum(cosine, COS_MIN)


@dataclass(frozen=True)
class PreparedBase:
    """A diffuse base: albedo (a colour), relative index n of the medium above it, and means of the stack for its light.

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
        """All means of the stack for the light of the base."""
        return self.mean_reflectance, self.mean_transmittance, *self.worth


@dataclass(frozen=True)
class Prepared:
    """The layers from the top, with a diffuse base apart, and the parts of the model for which they are prepared."""

    model: Model
    layers: tuple[PreparedInterface | PreparedMedium, ...]
    variance: type[Variance]
    f: RoughnessMap
    tables: Tables
    base: PreparedBase | None = None


def variance_kind(material: Material) -> type[Variance]:
    """The cheapest kind of variance that holds all interfaces; values are only compared, never computed."""
    same = [is_same(layer.alpha_u, layer.alpha_v) for layer in material.interfaces]
    straight = [is_same(layer.rotation, 0.0) for layer in material.interfaces]
    if all(same):
        return Isotropic
    return PerAxis if all(s or t for s, t in zip(same, straight)) else Covariance


def is_same(a: object, b: object) -> bool:
    """Whether two values are known to be the same."""
    return a is b or (isinstance(a, float) and isinstance(b, float) and a == b)


def prepare(
    material: Material, model: Model, variance: type[Variance] | None = None, context: Context | None = None
) -> Prepared:
    """Constants of the whole stack; `variance` is that of `variance_kind` unless given."""
    context = context or Context()
    variance = variance or variance_kind(material)
    averages = _Averages(model, context)
    layers: list[PreparedInterface | PreparedMedium] = []
    eta_1, n_leaving, base = material.exterior, None, None
    n: Value = 1.0  # index so far, over that outside
    for layer, films in zip(material.layers, coated.of(material)):
        if isinstance(layer, InterfaceValues):
            layers.append(_interface(layer, eta_1, n_leaving, averages, variance, films))
            if layer.kind == "dielectric":
                n = n * ops.mean(layer.eta / eta_1)
                n_leaving = ops.mean(eta_1 / layer.eta)
                ops.names(n_leaving=n_leaving)
                eta_1 = layer.eta
        elif isinstance(layer, DiffuseValues):
            base = PreparedBase(layer.albedo, n)
        else:
            layers.append(_medium(layer))
    return Prepared(model, tuple(layers), variance, MAPS[model.map], context.tables, base)


def _medium(layer: MediumValues) -> PreparedMedium:
    with ops.block("Scattered light stays in the lobe only where it goes forwards (model of Belcour 2018, 4.4)"):
        tau_s = layer.sigma_s * layer.depth
    return PreparedMedium(layer.sigma_a * layer.depth + tau_s, tau_s, layer.g)


def _interface(
    layer: InterfaceValues,
    eta_1: Value,
    n_leaving: Value | None,
    averages: _Averages,
    variance: type[Variance],
    films: Films,
) -> PreparedInterface:
    roughness = Roughness(layer.alpha_u, layer.alpha_v, layer.rotation * (pi / 180))
    s_r = variance.of(roughness, MAPS[averages.model.map])
    eta = layer.eta / eta_1 if layer.kind != "mirror" else None
    kappa = layer.k / eta_1 if layer.kind == "conductor" else None
    n12 = ops.mean(layer.eta) / ops.mean(eta_1) if layer.kind == "dielectric" else 1.0
    facets = PreparedInterface(eta, kappa, n12, roughness, s_r, None, averages.leaving(n_leaving), films)
    return replace(facets, reflectance=averages.reflectance(facets), absorbed=averages.absorbed(facets))


@dataclass(frozen=True)
class _Averages:
    """Look-ups of averages over rough interfaces, as a model chooses them."""

    model: Model
    context: Context

    def reflectance(self, facets: PreparedInterface) -> Average | None:
        eta, kappa = facets.eta, facets.kappa
        if self.model.reflectance in ("fresnel", "fg"):
            return None
        multiple = self.model.microsurface
        films = facets.films if self.model.reflectance != "split-sum" else None
        if isinstance(films, Coated) and (own := films.averaged(multiple)):
            return own[0]
        if isinstance(films, Coated) and films.known:
            return lambda cos_theta, alpha: film_average(films, multiple)(cos_theta, alpha, eta)[0]
        if self.model.reflectance == "split-sum":
            r_0 = 1.0 if eta is None else fresnel.normal_incidence(eta, 0.0 if kappa is None else kappa)
            if facets.films and not isinstance(facets.films, Either):
                r_0 = facets.reflect(1.0)
            row = tables.schlick_row(self.context.tables, r_0)
        elif eta is None:
            if multiple:
                return None  # light that bounces between the facets of a mirror is not lost
            row = tables.mirror_row(self.context.tables)
        elif kappa is None:
            row = tables.dielectric_row(self.context.tables, eta, self.context.constant, multiple)
        else:
            row = tables.conductor_row(self.context.tables, eta, kappa, self.context.constant, multiple)
        if films:
            row = tables.with_films(self.context.tables, row, facets.reflect, absorbs(films))
        return self._of(row)

    def absorbed(self, facets: PreparedInterface) -> Average | None:
        """What films of a dielectric absorb, by the cosine and the roughness."""
        films, multiple = facets.films, self.model.microsurface
        if facets.opaque or films is None or not absorbs(films):
            return None
        if self.model.reflectance not in ("fgd", "fgd-multi"):
            return lambda cos_theta, alpha: facets.absorb(cos_theta)
        if isinstance(films, Coated) and (own := films.averaged(multiple)):
            return own[1]
        if isinstance(films, Coated) and films.known:
            return lambda cos_theta, alpha: film_average(films, multiple)(cos_theta, alpha, facets.eta)[1]
        return tables.over_facets(self.context.tables, facets.absorb)

    def _of(self, row: Row) -> Average:
        if self.context.number:
            return tables.fgd_sheet(self.context.tables, row, self.context.number)
        return partial(tables.fgd, self.context.tables, row)

    def leaving(self, n: Value | None) -> Average | None:
        if n is None or self.model.tir == "off":
            return None
        if self.context.number:
            return tables.tir_sheet(self.context.tables, self.model.tir, n, self.context.number)
        return partial(tables.tir, self.context.tables, self.model.tir, n)
