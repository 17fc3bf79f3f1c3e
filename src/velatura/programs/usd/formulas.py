"""UsdPreviewSurface, as the shader of OpenUSD has it (previewSurface.glslfx), but for Smith's masking."""

from __future__ import annotations

import numpy as np

from velatura.optics import fresnel
from velatura.programs import closures
from velatura.programs.closures import Array, ViewAndLight
from velatura.programs.parameters import Values, complete
from velatura.programs.usd.parameters import PARAMETERS


def value(given: Values, pair: ViewAndLight, thin: bool = True) -> Array:
    """f |cos theta_o| (3, N) in the metallic workflow.

    Light passes straight if `thin`, or is refracted by smooth facets, as in MaterialX's graph of it."""
    v = complete(PARAMETERS, given)
    base, metal = np.reshape(v["diffuseColor"], (3, 1)), v["metallic"]
    at_normal = fresnel.normal_incidence(v["ior"])

    def lobe(roughness: float) -> Array:
        alpha = max(roughness**2, closures.ALPHA_MIN)
        return pair.reflected * closures.microfacets(pair, alpha, alpha)

    colour = 1 - metal + metal * base
    f = closures.schlick(pair.cos_d, (metal + (1 - metal) * at_normal) * colour, colour)
    diffuse = (1 - f) * (1 - metal) * base * v["opacity"] * closures.lambert(pair)
    coat = v["clearcoat"] * closures.schlick(pair.cos_d, at_normal)
    through = (1 - f) * (1 - metal) * (1 - v["opacity"])
    through = through * closures.refracted(pair, 1.0 if thin else v["ior"], closures.ALPHA_MIN, closures.ALPHA_MIN)
    return np.asarray(f * lobe(v["roughness"]) + coat * lobe(v["clearcoatRoughness"]) + diffuse + through)
