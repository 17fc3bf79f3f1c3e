"""The atomic operators: what one layer does to energy and variance (Belcour 2018, section 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from velatura import ops
from velatura.model.papers.guards import COS_MIN, G_MIN
from velatura.model.papers.prepare import Prepared, PreparedInterface, PreparedMedium
from velatura.model.variance import Isotropic, Roughness, Variance
from velatura.ops import Value
from velatura.optics.ggx import Direction, masking, rotate

PreparedLayer: TypeAlias = PreparedInterface | PreparedMedium


@dataclass(frozen=True)
class LayerStatistics(ops.NamedFields):
    """One layer: energies reflected, transmitted and absorbed of light that goes down (12) and up (21), variances,
    Snell's factors.

    `cos_theta` is the cosine below the layer, `leaving` the share of the light coming up from it that total internal
    reflection lets out (None: all of it).
    """

    r_12: Value
    t_12: Value
    r_21: Value
    t_21: Value
    a_12: Value
    a_21: Value
    s_r: Variance
    s_t12: Variance
    s_t21: Variance
    j_12: Value
    j_21: Value
    cos_theta: Value
    leaving: Value | None


def interface(
    prepared: Prepared, layer: PreparedInterface, cos_theta: Value, s_t0i: Variance, wi: Direction
) -> LayerStatistics:
    """Reflection and refraction by a rough interface lit with variance s_t0i at cos_theta (Belcour 2018, Eqs. 7-13)."""
    model, none = prepared.model, prepared.variance.uniform(0.0)
    lit = (s_t0i + layer.s_r).roughness(prepared.f)  # as rough as interface and light together

    with ops.block("Reflect, within the bounds that fits and rounding leave by their errors"):
        r = ops.clip(reflectance(prepared, layer, cos_theta, lit, wi), 0.0, 1.0)
        leaving = None
        if layer.leaving is not None:
            leaving = ops.clip(layer.leaving(*fetched(prepared, lit, cos_theta, wi)), 0.0, 1.0)
    if layer.opaque:
        return LayerStatistics(r, 0.0, 0.0, 0.0, 1 - r, 1.0, layer.s_r, none, none, 1.0, 1.0, 1.0, leaving)

    with ops.block("Refract, unless Snell's law has no solution"):
        sin2_t = (1 - cos_theta * cos_theta) / (layer.n12 * layer.n12)
        passes = sin2_t < 1
        cos_t = ops.select(passes, ops.sqrt(1 - sin2_t), 1.0)
        ratio = ops.select(passes, layer.n12 * cos_t / ops.maximum(cos_theta, COS_MIN), 1.0)
        lost: Value = 0.0
        if layer.absorbed is not None:
            lost = ops.clip(layer.absorbed(*fetched(prepared, lit, cos_theta, wi)), 0.0, 1 - r)
        t = ops.select(passes, 1 - r - lost, 0.0)
        n = ratio if model.scale == "angles" else layer.n12
        s_t12 = _transmitted(prepared, layer.roughness, 1 / n, passes)
        s_t21 = _transmitted(prepared, layer.roughness, n, passes)
        ops.names(sin2_t=sin2_t, passes=passes, cos_t=cos_t, ratio=ratio, t=t)
    back = r
    if layer.absorbed is not None:
        # Both sides differ as they do for the mean direction
        back = ops.clip(r + layer.reflect_back(cos_theta, cos_t) - layer.reflect(cos_theta), 0.0, 1 - t)
    r_21, a_12 = ops.select(passes, back, 0.0), ops.select(passes, lost, 1 - r)
    a_21 = ops.select(passes, 1 - t - back, 1.0) if layer.absorbed is not None else ops.select(passes, 0.0, 1.0)
    return LayerStatistics(r, t, r_21, t, a_12, a_21, layer.s_r, s_t12, s_t21, ratio, 1 / ratio, cos_t, leaving)


def reflectance(prepared: Prepared, layer: PreparedInterface, cos_theta: Value, lit: Roughness, wi: Direction) -> Value:
    """Reflectance of an interface for light at cos_theta; `lit` is its roughness combined with that of the light."""
    if layer.reflectance is not None:
        # The split sum looks at the interface alone (Weier & Belcour 2020, Listing 3)
        roughness = layer.roughness if prepared.model.reflectance == "split-sum" else lit
        return layer.reflectance(*fetched(prepared, roughness, cos_theta, wi, layer.opaque))
    r = layer.reflect(cos_theta)
    if prepared.model.reflectance == "fg":
        # Masking is the same for a direction and its mirror image
        g = masking(_with_azimuth(wi, cos_theta, lit.rotation), lit.alpha_u, lit.alpha_v)
        r = r * g * g
    return r


def _transmitted(prepared: Prepared, roughness: Roughness, ratio: Value, passes: Value) -> Variance:
    """Variance of a refraction: that of a reflection by a rescaled roughness (Belcour 2018, Eq. 10 in magnitudes).

    At normal incidence Bati et al. 2021, Eq. 6.
    """
    scale = ops.select(passes, 0.5 * ops.absolute(1 - ratio), 0.0)
    return prepared.variance.of(roughness.scaled(scale), prepared.f)


def transmission(prepared: Prepared, layer: PreparedMedium, cos_theta: Value) -> LayerStatistics:
    """Absorption and forward scattering by a medium (Belcour 2018, Eqs. 15-17, 21-24)."""
    path = layer.along(1, cos_theta)
    g = ops.clip(layer.g, G_MIN, 1.0)
    scattered = ops.select(layer.g > 0, layer.tau_s * path, 0.0)
    t = (1 + scattered) * ops.exp(-layer.tau * path)
    s_g = ops.power((1 - g) / g, 0.8) / (1 + g)
    ops.names(path=path, g=g, scattered=scattered, t=t, s_g=s_g)
    mean = ops.mean(scattered)
    if prepared.model.medium == "weighted":
        # The variance of a mixture is the weighted mean (5.2)
        s_g = s_g * mean / (1 + mean)
    elif prepared.model.medium == "doubled":
        # The limit of many such layers, each of them thin
        t, s_g = ops.exp(scattered - layer.tau * path), s_g * mean
    s_t = prepared.variance.uniform(ops.select(layer.g > 0, s_g, 0.0))
    none = prepared.variance.uniform(0.0)
    a = ops.maximum(1 - t, 0.0)
    return LayerStatistics(0.0, t, 0.0, t, a, a, none, s_t, s_t, 1.0, 1.0, cos_theta, None)


def fetched(
    prepared: Prepared, roughness: Roughness, cos_theta: Value, wi: Direction, opaque: bool = False
) -> tuple[Value, Value]:
    """Cosine and isotropic roughness for the look-up of an average over an anisotropic interface."""
    if prepared.variance is Isotropic:
        return cos_theta, roughness.alpha_u
    u, v, rotation = roughness
    x, y, z = _with_azimuth(wi, cos_theta, rotation)
    if prepared.model.fetch == "stretched":
        alpha = ops.minimum(u, v)
        x, y = x / (1 + (u - alpha) * (u - alpha)), y / (1 + (v - alpha) * (v - alpha))
        return ops.sqrt(1 - x * x - y * y), alpha
    with ops.block("What passes depends on the normals' slopes along the azimuth; what is lost hardly does"):
        mean2 = 0.5 * (u * u + v * v)
        along2 = mean2 if opaque else z * z * mean2 + u * u * x * x + v * v * y * y
    return cos_theta, ops.sqrt(along2)


def _with_azimuth(wi: Direction, cos_theta: Value, rotation: Value) -> Direction:
    """The direction at cos_theta with the azimuth of wi, in a frame turned by `rotation`."""
    scale = ops.sqrt(1 - cos_theta * cos_theta) / ops.maximum(ops.sqrt(wi[0] * wi[0] + wi[1] * wi[1]), ops.TINY)
    return rotate((wi[0] * scale, wi[1] * scale, cos_theta), rotation)
