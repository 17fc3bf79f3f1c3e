"""A stack prepared for a model: all values that do not depend on the direction of light.

Values arrive as a `Material`, in any dialect; a renderer hands in constants once and textured values at every point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import pi

from velatura import ops, tables
from velatura.films.of_material import films_of
from velatura.films.reflectance import Either, absorbs
from velatura.films.tables import Coated
from velatura.model.base import Model
from velatura.model.context import Context
from velatura.model.film_average import film_average
from velatura.model.papers.guards import COS_MIN
from velatura.model.roughness_maps import MAPS, RoughnessMap
from velatura.model.smooth_interface import SmoothInterface
from velatura.model.variance import Roughness, Variance, variance_kind
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.stack import BaseValues, InterfaceValues, Material, SlabValues
from velatura.stack.chain import Meeting, chain
from velatura.tables import Average, Row, Tables


@dataclass(frozen=True)
class PreparedInterface(SmoothInterface):
    """An interface with its roughness, and what a model says of it.

    `reflectance` is its directional albedo, None where the model takes Fresnel at the mean direction; `leaving` the
    share of light going up from it that total internal reflection lets out, None where that is all; `absorbed` what
    films of a dielectric absorb, None for nothing.
    """

    roughness: Roughness
    s_r: Variance
    reflectance: Average | None
    leaving: Average | None
    absorbed: Average | None = None


@dataclass(frozen=True)
class PreparedMedium(ops.NamedFields):
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

    The means (colours) are those for diffuse light from below. `importance` is the share of light below the first
    interface that reaches the base, at each node of `tables.diffuse_nodes`. All are known once the layers are.
    """

    albedo: Value
    n: Value
    mean_reflectance: Value = 0.0
    mean_transmittance: Value = 1.0
    importance: tuple[Value, ...] = ()

    @property
    def means(self) -> tuple[Value, ...]:
        """All means of the stack for the light of the base."""
        return self.mean_reflectance, self.mean_transmittance, *self.importance


@dataclass(frozen=True)
class Prepared:
    """The layers from the top, with a diffuse base apart, and the parts of the model for which they are prepared."""

    model: Model
    layers: tuple[PreparedInterface | PreparedMedium, ...]
    variance: type[Variance]
    f: RoughnessMap
    tables: Tables
    base: PreparedBase | None = None


def prepare(
    material: Material, model: Model, variance: type[Variance] | None = None, context: Context | None = None
) -> Prepared:
    """Constants of the whole stack; `variance` is that of `variance_kind` unless given."""
    context = context or Context()
    variance = variance or variance_kind(material)
    averages = _Averages(model, context)
    layers: list[PreparedInterface | PreparedMedium] = []
    n_leaving, base = None, None
    n: Value = 1.0  # index so far, over that outside
    for meeting in chain(material, films_of(material)):
        layer, above = meeting.layer, meeting.above
        if isinstance(layer, InterfaceValues):
            layers.append(_interface(layer, meeting, n_leaving, averages, variance))
            if layer.kind == "dielectric":
                n = n * ops.mean(layer.eta / above)
                n_leaving = ops.mean(above / layer.eta)
                ops.names(n_leaving=n_leaving)
        elif isinstance(layer, BaseValues):
            base = PreparedBase(layer.albedo, n)
        else:
            layers.append(_medium(layer))
    return Prepared(model, tuple(layers), variance, MAPS[model.map], context.tables, base)


def _medium(layer: SlabValues) -> PreparedMedium:
    with ops.block("Scattered light stays in the lobe only where it goes forwards (model of Belcour 2018, 4.4)"):
        tau_s = layer.tau_s
    return PreparedMedium(layer.tau_a + tau_s, tau_s, layer.g)


def _interface(
    layer: InterfaceValues, meeting: Meeting, n_leaving: Value | None, averages: _Averages, variance: type[Variance]
) -> PreparedInterface:
    roughness = Roughness(layer.alpha_u, layer.alpha_v, layer.rotation * (pi / 180))
    s_r = variance.of(roughness, MAPS[averages.model.map])
    facets = SmoothInterface.of(meeting)
    return PreparedInterface(
        **vars(facets),
        roughness=roughness,
        s_r=s_r,
        reflectance=averages.reflectance(facets),
        leaving=averages.leaving(n_leaving),
        absorbed=averages.absorbed(facets),
    )


@dataclass(frozen=True)
class _Averages:
    """Look-ups of averages over rough interfaces, as a model chooses them."""

    model: Model
    context: Context

    def reflectance(self, facets: SmoothInterface) -> Average | None:
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

    def absorbed(self, facets: SmoothInterface) -> Average | None:
        """Absorption by films of a dielectric, by the cosine and the roughness."""
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
