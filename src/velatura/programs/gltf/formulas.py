"""Materials of glTF 2.0 and their extensions (https://registry.khronos.org/glTF, appendix B and KHR_materials_*)."""

from __future__ import annotations

import numpy as np

from velatura.optics import fresnel
from velatura.programs import closures
from velatura.programs.closures import Array, Number, ViewAndLight
from velatura.programs.gltf.parameters import COATING, PARAMETERS
from velatura.programs.parameters import Values, complete

COAT_F_0 = 0.04  # of an index of 1.5


def alphas(roughness: Number, strength: float) -> tuple[Number, Number]:
    """GGX roughness along the direction of anisotropy and across it (KHR_materials_anisotropy)."""
    return roughness**2 * (1 - strength**2) + strength**2, roughness**2


def value(given: Values, pair: ViewAndLight, thin: bool = True) -> Array:
    """f |cos theta_o| (3, N) of appendix B and the extensions; `thin`: no refraction, as without a volume."""
    v = complete((*PARAMETERS, *COATING), given)
    base, tint = (np.reshape(v[name], (3, 1)) for name in ("baseColorFactor", "specularColorFactor"))
    au, av = closures.anisotropic(*alphas(v["roughnessFactor"], v["anisotropyStrength"]))
    turn = v["anisotropyRotation"]
    lobe = pair.reflected * closures.microfacets(pair, au, av, turn)

    def fresnel_of(f_0: Array, f_90: Number = 1.0) -> Array:
        """Reflectance of facets of a base, with the film's."""
        f, share = closures.schlick(pair.cos_d, f_0, f_90), v["iridescenceFactor"]
        if share > 0 and v["iridescenceThicknessMaximum"] > 0:
            n, nm = v["iridescenceIor"], v["iridescenceThicknessMaximum"]
            f = (1 - share) * f + share * closures.film_by_schlick(pair.cos_d, n, nm, f_0)
        return f

    # Diffuse or transmitting base below the dielectric, mixed with metal; what has no share is not worked out
    metal, material = v["metallicFactor"], np.zeros_like(pair.wi)
    if metal < 1:
        f_0 = np.minimum(fresnel.normal_incidence(v["ior"]) * tint, 1.0) * v["specularFactor"]
        f, clear = fresnel_of(f_0, v["specularFactor"]), v["transmissionFactor"]
        through = base * closures.refracted(pair, 1.0 if thin else v["ior"], au, av, turn)
        below = (1 - clear) * base * closures.lambert(pair) + clear * through
        material += (1 - metal) * (f * lobe + (1 - np.clip(f.max(axis=0), 0, 1)) * below)
    if metal > 0:
        material += metal * fresnel_of(base) * lobe

    # Clearcoat, by the Fresnel reflectance of the normal
    if v["clearcoatFactor"] > 0:
        share = v["clearcoatFactor"] * closures.schlick(pair.cos_i, COAT_F_0)
        alpha = max(v["clearcoatRoughnessFactor"] ** 2, closures.ALPHA_MIN)
        material = (1 - share) * material + share * pair.reflected * closures.microfacets(pair, alpha, alpha)

    # Coat, likewise, which tints and darkens by its weight (KHR_materials_coat; darkening of OpenPBR 1.1)
    weight, eta, tint = v["coatFactor"], v["coatIor"], np.reshape(v["coatColorFactor"], (3, 1))
    if weight > 0:
        f_0 = fresnel.normal_incidence(eta)
        inside = 1 - (1 - f_0) / eta**2
        darkening = 1 + v["coatDarkeningFactor"] * ((1 - inside) / (1 - base * inside) - 1)
        share = weight * closures.schlick(pair.cos_i, f_0)
        au, av = closures.anisotropic(*alphas(v["coatRoughnessFactor"], v["coatAnisotropyStrength"]))
        facets = pair.reflected * closures.microfacets(pair, au, av, v["coatAnisotropyRotation"])
        material = (1 - share) * (1 - weight + weight * tint * darkening) * material + share * facets
    return np.asarray(material)
