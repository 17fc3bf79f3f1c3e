"""Disney's principled BSDF as Mitsuba 3.9 has it, `principled` (Burley 2012 and 2015)."""

from __future__ import annotations

import numpy as np

from velatura.optics import fresnel
from velatura.programs import closures
from velatura.programs.closures import Array, ViewAndLight
from velatura.programs.parameters import Values, complete
from velatura.programs.principled.parameters import PARAMETERS
from velatura.stack.spectra import LUMINANCE

COAT_ALPHA = (0.1, 0.001)  # of a gloss of 0 and of 1
COAT_F_0, COAT_MASKING = 0.04, 0.25
UNRESOLVED = 0.01  # excess of an index over 1


def value(given: Values, pair: ViewAndLight, thin: bool = False) -> Array:
    """f |cos theta_o| (3, N) for wi above; `thin` changes nothing, since the plugin always refracts."""
    v = complete(PARAMETERS, given)
    base = np.reshape(v["base_color"], (3, 1))
    # The plugin takes an index of 1 for 1.001 where light passes
    eta = 1.001 if v["eta"] == 1 and v["spec_trans"] else v["eta"]
    luminance = float(np.dot(LUMINANCE, v["base_color"]))
    hue = base / luminance if luminance > 0 else np.ones((3, 1))
    metallic = v["metallic"]
    brdf, glass = (1 - metallic) * (1 - v["spec_trans"]), (1 - metallic) * v["spec_trans"]
    au, av = np.maximum(closures.burley(v["roughness"], v["anisotropic"]), closures.ALPHA_MIN)
    cos_i, cos_o, cos_d, up = pair.cos_i, pair.cos_o, pair.cos_d, pair.reflected

    # Reflection of metal, and of a dielectric whose reflectance may be tinted
    f = fresnel.dielectric(cos_d, eta) if eta != 1 else 0 * cos_d
    f_tinted = closures.schlick(cos_d, hue * fresnel.normal_incidence(eta))
    reflectance = (1 - metallic) * ((1 - v["spec_tint"]) * f + v["spec_tint"] * f_tinted)
    reflectance = reflectance + metallic * closures.schlick(cos_d, base)
    found = up * (f > 0) * reflectance * closures.microfacets(pair, au, av, correlated=False)

    # Clearcoat, of the distribution GTR1
    alpha2 = (COAT_ALPHA[0] + (COAT_ALPHA[1] - COAT_ALPHA[0]) * v["clearcoat_gloss"]) ** 2
    ndf = (alpha2 - 1) / (np.pi * np.log(alpha2) * (1 + (alpha2 - 1) * pair.h[2] ** 2))
    masking = 1.0
    for cosine in (cos_i, cos_o):
        tan2 = (1 - cosine**2) / np.maximum(cosine, 1e-6) ** 2
        masking = masking * 2 / (1 + np.sqrt(1 + COAT_MASKING**2 * tan2))
    coat = 0.25 * v["clearcoat"] * closures.schlick(cos_d, COAT_F_0) * ndf * masking * cos_o
    found = found + up * coat

    # Diffuse reflection, that of a flat subsurface, and sheen
    f_i, f_o, f_d = (closures.schlick(cosine, 0.0) for cosine in (cos_i, cos_o, cos_d))
    retro = 2 * v["roughness"] * cos_d**2
    flat_90 = 0.5 * retro
    scattered = (1 + (flat_90 - 1) * f_o) * (1 + (flat_90 - 1) * f_i)
    flat = 1.25 * (scattered * (1 / np.maximum(cos_o + cos_i, 1e-6) - 0.5) + 0.5)
    diffuse = (1 - 0.5 * f_i) * (1 - 0.5 * f_o) + retro * (f_o + f_i + f_o * f_i * (retro - 1))
    diffuse = (1 - v["flatness"]) * diffuse + v["flatness"] * flat
    fuzz = 1 + (hue - 1) * v["sheen_tint"]
    found = found + up * (brdf * base * diffuse * cos_o / np.pi)
    if brdf > 0:
        found = found + up * v["sheen"] * (1 - metallic) * f_d * fuzz * cos_o

    # Transmission
    if glass > 0:
        found = found + glass * np.sqrt(base) * _refracted(pair, eta, au, av)
    return np.asarray(found)


def _refracted(pair: ViewAndLight, eta: float, alpha_u: float, alpha_v: float) -> Array:
    """Facets that hardly deflect light leave a lobe too narrow to be resolved; it then has that of the least
    roughness."""
    if eta - 1 < UNRESOLVED:
        return closures.refracted(pair, 1.0, closures.ALPHA_MIN, closures.ALPHA_MIN)

    def passing(cosine: Array) -> Array:
        return np.asarray(1 - fresnel.dielectric(cosine, eta))

    return closures.refracted(pair, eta, alpha_u, alpha_v, correlated=False, passing=passing)
