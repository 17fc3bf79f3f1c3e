"""Blender's Principled BSDF (https://docs.blender.org/manual, Shader Nodes, Principled BSDF, since version 4.5)."""

from __future__ import annotations

import numpy as np

from velatura.optics import fresnel
from velatura.targets import closures
from velatura.targets.closures import Array, Pair
from velatura.targets.parameters import GREATEST, Parameter, Values, complete

#: Inputs of the node by their names; colours have a fourth component there, which is 1.
PARAMETERS = (
    Parameter("Base Color", (0.8, 0.8, 0.8)),
    Parameter("Metallic", 0.0),
    Parameter("Roughness", 0.5),
    Parameter("IOR", 1.5, low=1.0, high=1000.0),
    Parameter("Diffuse Roughness", 0.0),
    Parameter("Specular IOR Level", 0.5),
    Parameter("Specular Tint", (1.0, 1.0, 1.0), high=GREATEST),
    Parameter("Anisotropic", 0.0),
    Parameter("Anisotropic Rotation", 0.0),  # of a whole turn
    Parameter("Transmission Weight", 0.0),
    Parameter("Coat Weight", 0.0),
    Parameter("Coat Roughness", 0.03),
    Parameter("Coat IOR", 1.5, low=1.0, high=4.0),
    Parameter("Coat Tint", (1.0, 1.0, 1.0)),
    Parameter("Thin Film Thickness", 0.0, high=100000.0),  # nanometres
    Parameter("Thin Film IOR", 1.33, low=1.0, high=1000.0),
)


def value(given: Values, pair: Pair, thin: bool = True) -> Array:
    """f |cos theta_o| (3, N) of the node with multiple scattering: no subsurface, sheen or emission.

    `thin`: transmission is not refracted.
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
    f_metal = closures.tinted(pair.cos_d, base, np.minimum(tint, 1))
    if v["Thin Film Thickness"] > 0:
        n, nm = v["Thin Film IOR"], v["Thin Film Thickness"]
        root = np.sqrt(np.clip(base, 0.01, 0.99))

        def metal(cosine: Array) -> tuple[Array, Array]:
            f = closures.tinted(cosine, base, np.minimum(tint, 1))
            return f, f

        f_dielectric = closures.film(pair.cos_d, n, nm, closures.dielectric_below(eta / n), np.full((3, 1), eta))
        f_metal = closures.film(pair.cos_d, n, nm, metal, (1 + root) / (1 - root))

    # Dielectric over a diffuse base, glass, metal
    over = f_dielectric * closures.compensation(cos_i, mean, f_dielectric) * lobe
    once = closures.albedo(cos_i, mean, 1.0)
    share = (closures.dielectric_albedo(cos_i, mean, eta) - f_0 * once) / (1 - f_0)
    whole = f_0 * tint * once + (1 - f_0 * tint) * share
    kept = np.clip(1 - (whole * closures.compensation(cos_i, mean, f_0 * tint)).max(axis=0), 0, 1)
    clear = v["Transmission Weight"]
    diffuse = closures.oren_nayar(pair, base, v["Diffuse Roughness"], again=base)
    through = np.sqrt(base) * closures.refracted(pair, 1.0 if thin else eta, au, av, turn)
    dielectric = over + kept * ((1 - clear) * diffuse + clear * through)
    metal_part = f_metal * closures.compensation(cos_i, mean, f_metal) * lobe
    substrate = (1 - v["Metallic"]) * dielectric + v["Metallic"] * metal_part

    # Coat: absorption along the view inside it, and its own reflection on top
    coat, eta_c = v["Coat Weight"], v["Coat IOR"]
    tinted = coat_tint ** (1 / np.maximum(fresnel.cos_transmitted(cos_i, eta_c), 1e-3))
    alpha = max(v["Coat Roughness"] ** 2, closures.ALPHA_MIN)
    f_0 = fresnel.normal_incidence(eta_c)
    f_coat = fresnel.dielectric(pair.cos_d, eta_c) if eta_c != 1 else 0 * pair.cos_d
    top = (
        f_coat * closures.compensation(cos_i, alpha, f_coat) * pair.reflected * closures.microfacets(pair, alpha, alpha)
    )
    kept = 1 - coat * closures.dielectric_albedo(cos_i, alpha, eta_c) * closures.compensation(
        cos_i, alpha, np.full(1, f_0)
    )
    return np.asarray(coat * top + kept * ((1 - coat) + coat * tinted) * substrate)
