"""Blender's Principled BSDF (https://docs.blender.org/manual, Shader Nodes, Principled BSDF), as Cycles 5.0 has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.optics import fresnel
from velatura.programs import closures
from velatura.programs.blender.parameters import PARAMETERS
from velatura.programs.closures import Array, ViewAndLight
from velatura.programs.parameters import Values, complete

ORDERS = 3  # of interference
THINNEST_NM = 0.1  # a thinner film is none


def value(given: Values, pair: ViewAndLight, thin: bool = False) -> Array:
    """f |cos theta_o| (3, N) of the node with multiple scattering: no subsurface, sheen or emission.

    `thin` changes nothing, since the node always refracts.
    """
    v = complete(PARAMETERS, given)
    base, tint, coat_tint = (np.reshape(v[name], (3, 1)) for name in ("Base Color", "Specular Tint", "Coat Tint"))
    cos_i = pair.cos_i
    au, av = closures.anisotropic(*closures.burley(v["Roughness"], v["Anisotropic"]))
    mean, turn = float(np.sqrt(au * av)), 2 * np.pi * v["Anisotropic Rotation"]
    lobe = pair.reflected * closures.microfacets(pair, au, av, turn)

    # Index scaled by its level, where .5 leaves it as it is
    f_0 = float(np.clip(2 * v["Specular IOR Level"] * fresnel.normal_incidence(v["IOR"]), 0, 0.99))
    eta = (1 + np.sqrt(f_0)) / (1 - np.sqrt(f_0))
    share = (fresnel.dielectric(pair.cos_d, eta) - f_0) / (1 - f_0)
    f_dielectric: Array = np.clip(f_0 * tint + (1 - f_0 * tint) * share, 0, 1)
    f_82 = np.minimum(tint, 1)
    f_metal = closures.tinted(pair.cos_d, base, f_82)
    filmed = v["Thin Film Thickness"] > THINNEST_NM
    n, nm = v["Thin Film IOR"], v["Thin Film Thickness"]
    if filmed:
        f_dielectric = _coated(pair.cos_d, n, nm, eta, f_0, tint)
        f_metal = closures.film(pair.cos_d, n, nm, _metal_below(base, f_82, n), ORDERS, closures.by_observer)

    # Dielectric over a diffuse base, glass, metal
    over = f_dielectric * closures.compensation(cos_i, mean, f_dielectric) * lobe
    once = closures.albedo(cos_i, mean, 1.0)
    share = (closures.dielectric_albedo(cos_i, mean, eta) - f_0 * once) / (1 - f_0)
    whole: Array = f_0 * tint * once + (1 - f_0 * tint) * share
    whole = _coated(cos_i, n, nm, eta, f_0, tint) if filmed else whole * closures.compensation(cos_i, mean, f_0 * tint)
    kept = np.clip(1 - whole.max(axis=0), 0, 1)
    clear = v["Transmission Weight"]
    diffuse = closures.oren_nayar(pair, base, v["Diffuse Roughness"], again=base)
    dielectric = (1 - clear) * (over + kept * diffuse) + (clear * _glass(pair, v, f_dielectric) if clear else 0)
    metal_part = f_metal * closures.compensation(cos_i, mean, _often(base, f_82, mean)) * lobe
    substrate = (1 - v["Metallic"]) * dielectric + v["Metallic"] * metal_part

    # Coat: absorption along the view inside it, and its own reflection on top
    coat, eta_c = v["Coat Weight"], v["Coat IOR"]
    tinted = coat_tint ** (1 / np.maximum(fresnel.cos_transmitted(cos_i, eta_c), 1e-3))
    alpha = max(v["Coat Roughness"] ** 2, closures.ALPHA_MIN)
    top, passed = closures.coat(pair, coat, eta_c, alpha, alpha)
    return np.asarray(top + passed * ((1 - coat) + coat * tinted) * substrate)


def _coated(cosine: Array, film: float, thickness_nm: float, eta: float, f_0: float, tint: Array) -> Array:
    """Reflectance (3, N) of a film over a dielectric, whose tint fades where more is reflected than at its normal."""

    def below(inside: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        ratio = eta / film
        (s, _), (p, _) = fresnel.dielectric_amplitudes(inside, fresnel.cos_transmitted(inside, ratio), ratio)
        s, p = (np.broadcast_to(each, (3, len(inside))) for each in (s, p))
        return (s**2, np.where(s < 0, np.pi, 0.0)), (p**2, np.where(p < 0, np.pi, 0.0))

    found = closures.film(cosine, film, thickness_nm, below, ORDERS, closures.by_observer)
    return found * (1 + (tint - 1) * np.clip((1 - found) / (1 - f_0), 0, 1))


def _metal_below(f_0: Array, f_82: Array, film: float) -> closures.Below:
    """A metal under a film: the index that has its colours in air (Gulbrandsen 2014), and its colours there."""
    r = np.minimum(f_0, 0.999)
    edge = closures.tinted(fresnel.EDGE, f_0, f_82)
    root = np.sqrt(r)
    eta = (1 - edge) * (1 + root) / (1 - root) + edge * (1 - r) / (1 + r)
    kappa = np.sqrt(np.maximum((r * (eta + 1) ** 2 - (eta - 1) ** 2) / (1 - r), 0))
    inside = fresnel.normal_incidence(eta / film, kappa / film)
    tint = edge / closures.schlick(fresnel.EDGE, inside)

    def below(cosine: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        reflected = closures.tinted(cosine, inside, tint)
        s, p = (np.arctan2(im, re) for re, im in fresnel.conductor_amplitudes(cosine, eta / film, kappa / film))
        return (reflected, s), (reflected, p)

    return below


def _often(f_0: Array, f_82: Array, alpha: float) -> Array:
    """Reflectance of a metal for light that facets scatter many times."""
    edge = fresnel.EDGE
    lowered = closures.schlick(edge, f_0) * (1 - f_82) / (edge * (1 - edge) ** 6)
    # The mean of Schlick's reflectance with its tint
    return closures.often(f_0 + (1 - f_0) / 21 - lowered / 126, lambda cosine: closures.albedo(cosine, alpha, 1.0))


def _glass(pair: ViewAndLight, v: Mapping[str, Any], f: Array) -> Array:
    """Facets that reflect and refract, which are never brushed."""
    eta, colour = v["IOR"], np.sqrt(np.reshape(v["Base Color"], (3, 1)))
    # An index of 1 is no surface, regardless of its roughness
    alpha = max(v["Roughness"] ** 2, closures.ALPHA_MIN) if eta > 1 else closures.ALPHA_MIN

    def albedo(cosine: Array) -> Array:
        return closures.dielectric_albedo(cosine, alpha, eta) + closures.dielectric_albedo(cosine, alpha, eta, True)

    def passing(cosine: Array) -> Array:
        return np.asarray(1 - fresnel.dielectric(cosine, eta)) if eta > 1 else np.ones_like(cosine)

    once = albedo(pair.cos_i)
    scale = 1 + closures.often(colour, albedo) * (1 - once) / once
    reflected = f * pair.reflected * closures.microfacets(pair, alpha, alpha)
    return np.asarray(scale * (reflected + colour * closures.refracted(pair, eta, alpha, alpha, passing=passing)))
