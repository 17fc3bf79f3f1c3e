"""The atomic operators: what one layer does to energy and variance (Belcour 2018, section 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from velatura import ops
from velatura.model.prepare import Prepared, PreparedInterface, PreparedMedium
from velatura.model.variance import Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.ggx import Direction, normalize, rotate

PreparedLayer: TypeAlias = PreparedInterface | PreparedMedium

COS_MIN = 1e-4  # keeps Snell's factors finite at grazing
G_MIN = 1e-3  # keeps the variance of a phase function finite where it scatters evenly


@dataclass(frozen=True)
class Operator:
    """One layer: energies reflected and transmitted downwards (12) and upwards (21), variances, Snell's factors.

    `cos_theta` is the cosine below the layer, `leaving` the share of the light coming up from it that total internal
    reflection lets out (None: all of it).
    """

    r_12: Value
    t_12: Value
    r_21: Value
    t_21: Value
    s_r: Variance
    s_t12: Variance
    s_t21: Variance
    j_12: Value
    j_21: Value
    cos_theta: Value
    leaving: Value | None


def interface(
    prepared: Prepared, layer: PreparedInterface, cos_theta: Value, s_t0i: Variance, wi: Direction
) -> Operator:
    """Reflection and refraction by a rough interface (Eqs. 7-13), lit with variance s_t0i at cos_theta."""
    model, none = prepared.model, prepared.variance.uniform(0.0)
    cos_fetch, alpha = _table_point((s_t0i + layer.s_r).roughness(prepared.f), cos_theta, wi)

    # Reflect
    if layer.reflectance is not None:
        r = layer.reflectance(cos_fetch, alpha)
    elif layer.eta is None:
        r = 1.0
    elif layer.kappa is None:
        r = fresnel.dielectric(cos_theta, layer.eta)
    else:
        r = fresnel.conductor(cos_theta, layer.eta, layer.kappa)
    r = ops.clip(r, 0.0, 1.0)  # which fits and rounding leave by their errors
    leaving = ops.clip(layer.leaving(cos_fetch, alpha), 0.0, 1.0) if layer.leaving is not None else None
    if layer.opaque:
        return Operator(r, 0.0, 0.0, 0.0, layer.s_r, none, none, 1.0, 1.0, 1.0, leaving)

    # Refract, unless Snell's law has no solution
    sin2_t = (1 - cos_theta * cos_theta) / (layer.n12 * layer.n12)
    passes = sin2_t < 1
    cos_t = ops.select(passes, ops.sqrt(1 - sin2_t), 1.0)
    ratio = ops.select(passes, layer.n12 * cos_t / ops.maximum(cos_theta, COS_MIN), 1.0)
    t = ops.select(passes, 1 - r, 0.0)
    n = ratio if model.scale == "angles" else layer.n12
    s_t12 = _transmitted(prepared, layer.roughness, 1 / n, passes)
    s_t21 = _transmitted(prepared, layer.roughness, n, passes)
    return Operator(r, t, ops.select(passes, r, 0.0), t, layer.s_r, s_t12, s_t21, ratio, 1 / ratio, cos_t, leaving)


def _transmitted(prepared: Prepared, roughness: Roughness, ratio: Value, passes: Value) -> Variance:
    """Variance of a refraction: that of a reflection by a rescaled roughness (Eq. 10 in magnitudes)."""
    scale = ops.select(passes, 0.5 * ops.absolute(1 - ratio), 0.0)
    return prepared.variance.of(roughness.scaled(scale), prepared.f)


def transmission(prepared: Prepared, layer: PreparedMedium, cos_theta: Value) -> Operator:
    """Absorption and forward scattering by a medium (Eqs. 15-17, 22-24)."""
    path = 1 / ops.maximum(cos_theta, COS_MIN)
    g = ops.clip(layer.g, G_MIN, 1.0)
    scattered = ops.select(layer.g > 0, layer.tau_s * path, 0.0)
    t = (1 + scattered) * ops.exp(-layer.tau * path)
    s_g = ops.power((1 - g) / g, 0.8) / (1 + g)
    if prepared.model.medium == "weighted":
        # The variance of a mixture is the weighted mean (5.2)
        mean = ops.mean(scattered)
        s_g = s_g * mean / (1 + mean)
    s_t = prepared.variance.uniform(ops.select(layer.g > 0, s_g, 0.0))
    none = prepared.variance.uniform(0.0)
    return Operator(0.0, t, 0.0, t, none, s_t, s_t, 1.0, 1.0, cos_theta, None)


def _table_point(roughness: Roughness, cos_theta: Value, wi: Direction) -> tuple[Value, Value]:
    """Cosine and isotropic roughness at which to look up the average over an anisotropic interface.

    The direction is stretched along the smoother axis and the table read there (Weier & Belcour 2020, Listing 1).
    """
    if roughness.alpha_u is roughness.alpha_v:
        return cos_theta, roughness.alpha_u
    # Give the azimuth of wi to the direction at cos_theta
    sin_theta = ops.sqrt(1 - cos_theta * cos_theta)
    sin_i = ops.maximum(ops.sqrt(wi[0] * wi[0] + wi[1] * wi[1]), ops.TINY)
    x, y, _ = rotate((wi[0] / sin_i, wi[1] / sin_i, wi[2]), roughness.rotation)
    # Stretch it
    alpha = ops.minimum(roughness.alpha_u, roughness.alpha_v)
    excess_u, excess_v = roughness.alpha_u - alpha, roughness.alpha_v - alpha
    stretched = x * sin_theta / (1 + excess_u * excess_u), y * sin_theta / (1 + excess_v * excess_v), cos_theta
    return normalize(stretched)[2], alpha
