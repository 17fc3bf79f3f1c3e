"""OpenPBR Surface 1.1 (https://academysoftwarefoundation.github.io/OpenPBR, and its reference graph in MaterialX)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.optics import fresnel
from velatura.programs import closures
from velatura.programs.closures import Array, Number, ViewAndLight
from velatura.programs.openpbr.parameters import PARAMETERS, TURNS
from velatura.programs.parameters import Values, complete


def alphas(roughness: Number, anisotropy: float) -> tuple[Number, Number]:
    """GGX roughness along the tangent and across it (section Microfacet model)."""
    along = roughness**2 * np.sqrt(2 / (1 + (1 - anisotropy) ** 2))
    return along, along * (1 - anisotropy)


def value(given: Values, pair: ViewAndLight, thin: bool = True) -> Array:
    """f |cos theta_o| (3, N) of the reference graph: no fuzz, subsurface, dispersion or emission.

    `thin`: transmission passes a thin wall, without refraction.
    """
    v = complete((*PARAMETERS, *TURNS), given)
    base, specular, transmitted, coat_tint = (
        np.reshape(v[name], (3, 1)) for name in ("base_color", "specular_color", "transmission_color", "coat_color")
    )
    coat, cos_i = v["coat_weight"], pair.cos_i
    turn, coat_turn = np.radians(v["geometry_tangent"]), np.radians(v["geometry_coat_tangent"])

    # Roughen the base below the coat
    rough = min(1.0, v["specular_roughness"] ** 4 + 2 * v["coat_roughness"] ** 4) ** 0.25
    rough = (1 - coat) * v["specular_roughness"] + coat * rough
    au, av = closures.anisotropic(*alphas(rough, v["specular_roughness_anisotropy"]))
    mean = float(np.sqrt(au * av))
    lobe = pair.reflected * closures.microfacets(pair, au, av, turn)

    # Metal, and dielectric over a diffuse or transparent base; what has no share is not worked out
    eta, metal = base_index(v), v["base_metalness"]
    f_metal, f_dielectric = reflectances(v, pair.cos_d, eta)
    substrate = np.zeros_like(pair.wi)
    if metal < 1:
        over = specular * f_dielectric * closures.compensation(cos_i, mean, f_dielectric) * lobe
        f_0 = fresnel.normal_incidence(eta)
        kept = 1 - closures.dielectric_albedo(cos_i, mean, eta) * closures.compensation(cos_i, mean, f_0)
        diffuse = v["base_weight"] * closures.oren_nayar(pair, base, v["base_diffuse_roughness"])
        through = transmitted * closures.refracted(pair, 1.0 if thin else eta, au, av, turn)
        clear = v["transmission_weight"]
        substrate += (1 - metal) * (over + kept * ((1 - clear) * diffuse + clear * through))
    if metal > 0:
        substrate += metal * v["specular_weight"] * f_metal * closures.compensation(cos_i, mean, f_metal) * lobe

    # Coat: darkening, absorption, and its own reflection on top
    eta_c = v["coat_ior"]
    au, av = closures.anisotropic(*alphas(v["coat_roughness"], v["coat_roughness_anisotropy"]))
    top, passed = closures.coat(pair, coat, eta_c, au, av, coat_turn)
    return np.asarray(top + passed * darkening(v) * ((1 - coat) + coat * coat_tint) * substrate)


def base_index(v: Mapping[str, Any]) -> float:
    """The index of the dielectric base over what is on it, a coat in part, scaled by its weight."""
    coat, ratio = v["coat_weight"], v["specular_ior"] / v["coat_ior"]
    eta = (1 - coat) * v["specular_ior"] + coat * max(ratio, 1 / ratio)
    epsilon = np.sign(eta - 1) * np.sqrt(np.clip(v["specular_weight"] * fresnel.normal_incidence(eta), 0, 0.99999))
    return float((1 + epsilon) / (1 - epsilon))


def reflectances(v: Mapping[str, Any], cosine: Array, eta: float) -> tuple[Array, Array]:
    """Reflectances (3, N) of facets of the metal and of the dielectric base, whose index is eta, with their film."""
    base, specular = (np.reshape(v[name], (3, 1)) for name in ("base_color", "specular_color"))
    reflectance = v["base_weight"] * base
    f_metal = closures.tinted(cosine, reflectance, specular)
    f_dielectric = np.broadcast_to(fresnel.dielectric(cosine, eta), (3, len(cosine)))
    if v["thin_film_weight"] > 0 and v["thin_film_thickness"] > 0:
        n, nm, share = v["thin_film_ior"], 1000 * v["thin_film_thickness"], v["thin_film_weight"]
        root = np.sqrt(np.clip(reflectance, 0.01, 0.99))

        def metal(cosine: Array) -> tuple[Array, Array]:
            f = closures.tinted(cosine, reflectance, specular)
            return f, f

        films = [
            closures.film(cosine, n, nm, closures.below_film(below, index, n))
            for below, index in (
                (metal, (1 + root) / (1 - root)),
                (closures.dielectric_below(eta / n), np.full((3, 1), eta)),
            )
        ]
        f_metal, f_dielectric = ((1 - share) * f + share * g for f, g in zip((f_metal, f_dielectric), films))
    return f_metal, f_dielectric


def darkening(v: Mapping[str, Any]) -> Array:
    """The share (3, 1) of its colour that bounces below the coat leave to the base."""
    base, eta = np.reshape(v["base_color"], (3, 1)), v["coat_ior"]
    inside = 1 - (1 - fresnel.normal_incidence(eta)) / eta**2
    metal_albedo = base * v["specular_weight"]
    estimate = (1 - v["base_metalness"]) * base + v["base_metalness"] * metal_albedo
    share = v["coat_weight"] * v["coat_darkening"]
    return np.asarray((1 - share) + share * (1 - inside) / (1 - estimate * inside))
