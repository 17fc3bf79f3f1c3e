"""Formulas of other programs' materials, against limits that their specifications state."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

from velatura.optics.coatings import Coating, ColouredFilm
from velatura.optics.fresnel import normal_incidence
from velatura.programs import closures
from velatura.programs.blender import formulas as blender
from velatura.programs.closures import ViewAndLight
from velatura.programs.gltf import formulas as gltf
from velatura.programs.openpbr import formulas as openpbr
from velatura.programs.principled import formulas as principled
from velatura.programs.usd import formulas as usd
from velatura.renderer.low_discrepancy import square
from velatura.stack import srgb_sensitivity

U1, U2 = square(10_000)
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


def albedo(target, values, cosine, alpha=0.3, up=True, **options) -> np.ndarray:
    """Energy (3,) that is reflected or passed straight, from directions by facets of `alpha` and by the cosine."""
    from velatura.optics import ggx

    wi = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])[:, None] * np.ones(len(U1))
    facets = np.stack(ggx.reflect(tuple(wi), ggx.sample_visible(tuple(wi), alpha, alpha, U1, U2)))
    flat = np.stack([np.sqrt(U1) * np.cos(2 * pi * U2), np.sqrt(U1) * np.sin(2 * pi * U2), np.sqrt(1 - U1)])
    wi, wo = np.concatenate([wi, wi], axis=1), np.concatenate([facets, flat], axis=1)
    kept = wo[2] > 1e-4
    wi, wo = wi[:, kept], wo[:, kept]
    h = (wi + wo) / np.linalg.norm(wi + wo, axis=0)
    visible = ggx.ndf(tuple(h), alpha, alpha) * ggx.masking(tuple(wi), alpha, alpha) / (4 * cosine)
    weight = 1 / (len(U1) * (visible + wo[2] / pi))
    value = target.value(values, ViewAndLight(wi, wo if up else wo * [[1], [1], [-1]]), **options)
    return np.sum(value * weight, axis=1)


# White furnaces -------------------------------------------------------------------------------------------------------

METALS = {
    openpbr: {"base_color": WHITE, "base_metalness": 1.0},
    blender: {"Base Color": WHITE, "Metallic": 1.0},
}
PLASTICS = {
    openpbr: {"base_color": WHITE, "base_diffuse_roughness": 0.6},
    blender: {"Base Color": WHITE, "Diffuse Roughness": 0.6},
}
COATS = {
    openpbr: {"coat_weight": 1.0, "coat_roughness": 0.3**0.5, "coat_darkening": 0.0},
    blender: {"Coat Weight": 1.0, "Coat Roughness": 0.3**0.5},
}
ROUGHNESS = {openpbr: "specular_roughness", blender: "Roughness"}


@pytest.mark.parametrize("target", [openpbr, blender])
@pytest.mark.parametrize("kind", [METALS, PLASTICS])
@pytest.mark.parametrize("coat", [{openpbr: {}, blender: {}}, COATS])
def test_white_materials_that_compensate_reflect_all_light(target, kind, coat) -> None:
    values = {**kind[target], **coat[target], ROUGHNESS[target]: 0.3**0.5}
    for cosine in (1.0, 0.6, 0.3):
        assert albedo(target, values, cosine) == pytest.approx(np.ones(3), abs=0.01)


def test_a_white_coated_material_stays_white_when_the_coat_darkens() -> None:
    values = {"base_color": WHITE, "base_metalness": 1.0, "specular_roughness": 0.5, **COATS[openpbr]}
    assert albedo(openpbr, {**values, "coat_darkening": 1.0}, 0.7) == pytest.approx(np.ones(3), abs=0.02)
    grey = {**values, "base_color": (0.3, 0.3, 0.3)}
    assert np.all(albedo(openpbr, {**grey, "coat_darkening": 1.0}, 0.7) < 0.8 * albedo(openpbr, grey, 0.7))


@pytest.mark.parametrize("roughness", [0.3, 1.0])
def test_white_energy_preserving_oren_nayar_reflects_all_light(roughness) -> None:
    values = {"base_color": WHITE, "specular_weight": 0.0, "base_diffuse_roughness": roughness}
    for cosine in (1.0, 0.5, 0.1):
        assert albedo(openpbr, values, cosine) == pytest.approx(np.ones(3), abs=0.003)


# Reflectance at normal incidence --------------------------------------------------------------------------------------

SMOOTH = 0.03  # alpha
GLASS = normal_incidence(1.7)


@pytest.mark.parametrize(
    "target, values, expected",
    [
        (openpbr, {"base_color": BLACK, "specular_ior": 1.7, "specular_roughness": SMOOTH**0.5}, GLASS),
        (openpbr, {"base_weight": 0.0, "specular_weight": 0.0, "coat_weight": 1.0, "coat_ior": 1.7,
                   "coat_roughness": SMOOTH**0.5}, GLASS),
        (openpbr, {"base_color": BLACK, "specular_ior": 1.7, "specular_weight": 0.5,
                   "specular_roughness": SMOOTH**0.5}, 0.5 * GLASS),
        # Under a coat of the same index nothing is reflected
        (openpbr, {"base_color": BLACK, "specular_ior": 1.5, "coat_weight": 1.0, "coat_ior": 1.5,
                   "coat_roughness": SMOOTH**0.5}, normal_incidence(1.5)),
        (gltf, {"baseColorFactor": BLACK, "metallicFactor": 0.0, "roughnessFactor": SMOOTH**0.5, "ior": 1.7}, GLASS),
        (gltf, {"baseColorFactor": BLACK, "roughnessFactor": 1.0, "clearcoatFactor": 0.5, "metallicFactor": 0.0,
                "clearcoatRoughnessFactor": SMOOTH**0.5, "specularFactor": 0.0}, 0.02),
        (gltf, {"baseColorFactor": (0.8, 0.8, 0.8), "roughnessFactor": SMOOTH**0.5}, 0.8),
        (blender, {"Base Color": BLACK, "IOR": 1.7, "Roughness": SMOOTH**0.5}, GLASS),
        (blender, {"Base Color": BLACK, "IOR": 1.5, "Specular IOR Level": 1.0, "Roughness": SMOOTH**0.5}, 0.08),
        (blender, {"Base Color": BLACK, "Specular IOR Level": 0.0, "Coat Weight": 1.0, "Coat IOR": 1.7,
                   "Coat Roughness": SMOOTH**0.5}, GLASS),
        (usd, {"diffuseColor": BLACK, "ior": 1.7, "roughness": SMOOTH**0.5}, GLASS),
        (usd, {"diffuseColor": (0.8, 0.8, 0.8), "metallic": 1.0, "roughness": SMOOTH**0.5}, 0.8),
        # The clearcoat is added, with the index of the base
        (usd, {"diffuseColor": BLACK, "ior": 1.7, "roughness": SMOOTH**0.5, "clearcoat": 0.5,
               "clearcoatRoughness": SMOOTH**0.5}, 1.5 * GLASS),
        (principled, {"base_color": BLACK, "eta": 1.7, "roughness": SMOOTH**0.5}, GLASS),
    ],
)  # fmt: skip
def test_smooth_materials_reflect_by_fresnel_at_normal_incidence(target, values, expected) -> None:
    assert albedo(target, values, 1.0, SMOOTH) == pytest.approx(np.full(3, expected), rel=0.01)


def test_coats_are_tinted_as_their_manuals_say() -> None:
    tint = (0.9, 0.5, 0.2)
    coat = {"Coat Weight": 1.0, "Coat IOR": 1.5, "Coat Roughness": 0.1, "Coat Tint": tint}
    blend = {"Base Color": WHITE, "Specular IOR Level": 0.0, **coat}
    for cosine in (1.0, 0.3):
        inside = np.sqrt(1 - (1 - cosine**2) / 1.5**2)
        whole, clear = (
            albedo(blender, blend, cosine, 0.02),
            albedo(blender, {**blend, "Coat Tint": WHITE}, cosine, 0.02),
        )
        over = albedo(blender, {**blend, "Coat Tint": BLACK}, cosine, 0.02)
        # Coat Tint is light that crosses the coat: along the view, at the depth that Snell's law gives
        assert (whole - over) / (clear - over) == pytest.approx(np.array(tint) ** (1 / inside), rel=1e-3)


#: Albedos that Cycles (Blender 5.0.1) renders under a white sky, of 512 paths in 64 pixels, at cosines 1, .7 and .35;
#: of glass with what passes, to a sky below.
CYCLES: list[tuple[dict[str, Any], list[list[float]]]] = [
    ({"Base Color": (0.8, 0.3, 0.1), "Metallic": 1.0, "Roughness": 0.4},
     [[0.794, 0.293, 0.097], [0.792, 0.293, 0.100], [0.799, 0.334, 0.160]]),
    ({"Base Color": (0.6, 0.3, 0.1), "Roughness": 0.4, "IOR": 1.6},
     [[0.621, 0.336, 0.146], [0.626, 0.344, 0.157], [0.655, 0.395, 0.221]]),
    ({"Base Color": (0.6, 0.3, 0.1), "Roughness": 0.4, "Specular IOR Level": 0.9, "Specular Tint": (1, 0.5, 0.2)},
     [[0.628, 0.314, 0.107], [0.632, 0.324, 0.120], [0.661, 0.378, 0.191]]),
    ({"Base Color": (0.6, 0.3, 0.1), "Roughness": 0.5, "Diffuse Roughness": 0.8, "Specular IOR Level": 0.0},
     [[0.526, 0.248, 0.081], [0.540, 0.258, 0.085], [0.569, 0.278, 0.092]]),
    ({"Base Color": (0.6, 0.5, 0.4), "Metallic": 1.0, "Roughness": 0.3, "Coat Weight": 1.0, "Coat Roughness": 0.2,
      "Coat IOR": 1.5, "Coat Tint": (0.9, 0.5, 0.2)},
     [[0.556, 0.279, 0.116], [0.555, 0.266, 0.111], [0.623, 0.348, 0.209]]),
    ({"Base Color": (0.6, 0.5, 0.4), "Metallic": 0.5, "Roughness": 0.3, "Coat Weight": 0.5, "Coat Roughness": 0.5,
      "Coat IOR": 1.8},
     [[0.621, 0.527, 0.433], [0.625, 0.532, 0.440], [0.668, 0.586, 0.505]]),
    ({"Base Color": BLACK, "Roughness": 0.3, "Thin Film Thickness": 300.0, "Thin Film IOR": 1.4},
     [[0.023, 0.018, 0.036], [0.048, 0.033, 0.030], [0.149, 0.139, 0.113]]),
    ({"Base Color": BLACK, "Roughness": 0.3, "IOR": 1.8, "Specular Tint": (0.3, 0.6, 1), "Thin Film Thickness": 400.0,
      "Thin Film IOR": 1.38},
     [[0.014, 0.048, 0.007], [0.001, 0.032, 0.083], [0.044, 0.048, 0.168]]),
    ({"Base Color": (0.54, 0.5, 0.45), "Metallic": 1.0, "Roughness": 0.3, "Thin Film Thickness": 60.0,
      "Thin Film IOR": 2.4},
     [[0.248, 0.400, 0.525], [0.217, 0.369, 0.501], [0.301, 0.418, 0.482]]),
    ({"Base Color": (0.54, 0.5, 0.45), "Metallic": 1.0, "Roughness": 0.3, "Specular Tint": (0.7, 0.8, 0.9),
      "Thin Film Thickness": 150.0, "Thin Film IOR": 2.4},
     [[0.407, 0.016, 0.449], [0.511, 0.087, 0.347], [0.542, 0.296, 0.342]]),
    ({"Base Color": (0.2, 0.1, 0.03), "Metallic": 1.0, "Roughness": 0.3, "Specular Tint": (0.9, 0.6, 0.3),
      "Thin Film Thickness": 450.0, "Thin Film IOR": 1.8},
     [[0.303, 0.099, 0.153], [0.083, 0.188, 0.101], [0.151, 0.233, 0.177]]),
    ({"Base Color": (0.95, 0.6, 0.2), "Metallic": 1.0, "Roughness": 0.7, "Thin Film Thickness": 250.0,
      "Thin Film IOR": 1.33},
     [[0.933, 0.445, 0.059], [0.930, 0.482, 0.065], [0.931, 0.505, 0.117]]),
    ({"Base Color": (0.9, 0.6, 0.3), "Metallic": 1.0, "Roughness": 1.0, "Specular Tint": (0.2, 0.2, 0.2)},
     [[0.662, 0.316, 0.119], [0.681, 0.342, 0.136], [0.708, 0.388, 0.167]]),
    ({"Base Color": (0.9, 0.8, 0.5), "Roughness": 0.7, "IOR": 1.6, "Transmission Weight": 1.0},
     [[0.949, 0.895, 0.711], [0.949, 0.893, 0.706], [0.946, 0.890, 0.701]]),
]  # fmt: skip


@pytest.mark.parametrize("values, rendered", CYCLES)
def test_albedos_of_blender_are_those_that_cycles_renders(values, rendered) -> None:
    for cosine, expected in zip((1.0, 0.7, 0.35), rendered):
        found = albedo(blender, values, cosine, 0.1) + albedo(blender, values, cosine, 0.1, up=False)
        assert found == pytest.approx(np.array(expected), abs=0.005)


@pytest.mark.parametrize(
    "target, values, alpha",
    [
        (openpbr, {"base_color": WHITE, "transmission_weight": 1.0, "specular_ior": 1.0, "specular_roughness": 0.3},
         0.09),
        (gltf, {"transmissionFactor": 1.0, "metallicFactor": 0.0, "roughnessFactor": 0.3, "ior": 1.0,
                "specularFactor": 0.0}, 0.09),
        # Without a lobe in Cycles, regardless of the roughness
        (blender, {"Base Color": WHITE, "Transmission Weight": 1.0, "IOR": 1.0, "Roughness": 0.3}, closures.ALPHA_MIN),
    ],
)  # fmt: skip
def test_clear_walls_without_an_index_pass_all_light(target, values, alpha) -> None:
    # Facets hide .015 of the light from each other, which only OpenPBR and Blender compensate, and only when reflected
    assert albedo(target, values, 0.8, alpha, up=False) == pytest.approx(np.ones(3), abs=0.02)
    assert albedo(target, values, 0.8, alpha) == pytest.approx(np.zeros(3), abs=1e-6)


def test_refraction_by_rough_facets_conserves_energy() -> None:
    eta, alpha = 1.5, 0.1
    # Directions below, uniformly; the transmitted light at normal incidence is a narrow lobe, of transmittance 1
    edges = 1 - np.linspace(1, 0, 4001) ** 4
    cosine = 0.5 * (edges[1:] + edges[:-1])
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, -cosine])
    wi = np.array([[0.0], [0.0], [1.0]]) * np.ones(len(cosine))
    value = closures.refracted(ViewAndLight(wi, wo), eta, alpha, alpha)
    assert 2 * pi * (value * np.diff(edges)).sum() == pytest.approx(1.0, abs=0.01)


# Thin films -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("thickness_nm", [80.0, 250.0, 400.0])
def test_films_over_dielectrics_are_near_the_exact_sum(thickness_nm) -> None:
    """Two orders and Gaussian sensitivities: what Belcour & Barla 2017 leave out is below .02."""
    eta, base = 1.38, 1.8
    cosine = np.array([1.0, 0.7, 0.4])
    exact = Coating((ColouredFilm((eta,) * 3, (0.0,) * 3, thickness_nm),), (1.0,) * 3, (base,) * 3)
    true = exact.reflectance(cosine, srgb_sensitivity)
    below = closures.below_film(closures.dielectric_below(base / eta), np.full((3, 1), base), eta)
    found = closures.film(cosine, eta, thickness_nm, below)
    assert found == pytest.approx(true, abs=0.02)


def test_a_film_of_the_index_of_its_base_changes_nothing() -> None:
    values = {"base_color": BLACK, "specular_ior": 1.6, "specular_roughness": 0.3}
    film = {"thin_film_weight": 1.0, "thin_film_ior": 1.6, "thin_film_thickness": 0.3}
    assert albedo(openpbr, {**values, **film}, 0.6) == pytest.approx(albedo(openpbr, values, 0.6), abs=1e-3)
