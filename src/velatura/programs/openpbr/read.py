"""Stacks of surfaces of OpenPBR 1.1."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.optics import fresnel
from velatura.programs import parts
from velatura.programs.given import Given
from velatura.programs.imported import Imported, Notes
from velatura.programs.metals import of_f82_tint
from velatura.programs.openpbr import formulas, parameters
from velatura.programs.parameters import GREATEST, Input
from velatura.programs.surface import NO_COAT, WHITE, Alpha, Coat, Shares, Surface
from velatura.programs.to_stack import imported
from velatura.programs.values import Value, changed, colour

PARAMETERS = (
    *parameters.PARAMETERS,
    *parameters.TURNS,
    Input("emission_luminance", 0.0, high=GREATEST),
    Input("emission_color", WHITE),
    Input("geometry_opacity", 1.0),
    Input("geometry_thin_walled", False),
    # Of version 1.2
    Input("specular_haze", 0.0),
    Input("specular_haze_spread", 0.3),
    Input("specular_retroreflectivity", 0.0),
)
IGNORED = {"geometry_normal": parts.FLAT, "geometry_coat_normal": parts.FLAT}
MISSED = 0.02  # of the reflectance towards the edge, that is listed


def read(values: Mapping[str, Any], name: str = "", notes: Notes | None = None) -> Imported:
    """The stack nearest to a surface of OpenPBR.

    Raises:
        InvalidInput: an unknown parameter, or a value of another kind.
    """
    notes = Notes() if notes is None else notes
    given = Given(values, PARAMETERS, IGNORED, notes)
    metal = given.share("base_metalness")
    shares = Shares(
        cover=given.share("geometry_opacity"),
        coat=given.share("coat_weight"),
        film=given.share("thin_film_weight"),
        metal=metal,
        clear=given.share("transmission_weight") if metal != 1 else 0.0,
    )
    given.leave("specular_haze", "an interface has one lobe: left out")
    if given.number("specular_haze"):
        given.leave("specular_haze_spread", "left out with the haze")
    given.leave("specular_retroreflectivity", "facets send no light back: left out")
    given.leave("fuzz_weight", parts.FIBRES)
    given.leave("emission_luminance", parts.LIGHT)
    return imported(lambda part: _surface(given, part), shares, notes, name, "imported from OpenPBR")


def _surface(given: Given, part: Shares) -> Surface:
    """A part of the surface."""
    base: dict[str, Any]
    if part.metal:
        base = {"metalness": 1.0, **_metal(given)}
    else:
        weight, tint = given.number("specular_weight"), given.colour("specular_color")
        thin = given.number("geometry_thin_walled") > 0
        base = {"specular": given.tinted("specular_color", weight, tint)}
        if part.clear:
            base |= {"clear": 1.0, "tint": _tint(given, thin), "pane": thin}
        else:
            base["colour"] = _albedo(given)
            given.leave("geometry_thin_walled", parts.OPAQUE)
    return Surface(
        alpha=_alpha(given, "specular_roughness"),
        rotation=given.number("geometry_tangent"),
        eta=given.index("specular_ior"),
        film=_film(given) if part.film else None,
        coat=_coat(given) if part.coat else NO_COAT,
        **base,
    )


def _coat(given: Given) -> Coat:
    return Coat(
        given.index("coat_ior"),
        _alpha(given, "coat_roughness"),
        given.number("geometry_coat_tangent"),
        colour=given["coat_color"],
        darkening=given.number("coat_darkening"),
    )


def _alpha(given: Given, roughness: str) -> Alpha:
    anisotropy = given.number(f"{roughness}_anisotropy")
    return parts.alphas(given[roughness], lambda r: formulas.alphas(r, anisotropy))


def _metal(given: Given) -> dict[str, Any]:
    weight = given.number("base_weight") * given.number("specular_weight")
    reflectance, tint = changed(given["base_color"], lambda c: weight * c), given.colour("specular_color")
    if isinstance(reflectance, tuple):
        shown = np.array(tint) * fresnel.schlick(fresnel.EDGE, np.array(reflectance))
        nearest = of_f82_tint(np.array(reflectance), np.array(tint))
        missed = np.asarray(fresnel.conductor(fresnel.EDGE, *nearest)) - shown
        if np.max(missed) > MISSED:
            given.notes.add(
                "specular_color", tint, "no metal reflects so little towards the edge: the nearest is taken"
            )
    return {"colour": reflectance, "edge": tint}


def _tint(given: Given, pane: bool) -> Value:
    """The transmittance of each crossing; what is absorbed over a length belongs to the inside of a shape."""
    given.leave("transmission_dispersion_scale", parts.UNDISPERSED)
    length = given.number("transmission_depth")
    if pane or not length:
        given.leave("transmission_scatter", "without a depth it has no effect")
        return given["transmission_color"]
    scattered = np.array(given.colour("transmission_scatter")) / length
    sigma_a = parts.absorbed(given.colour("transmission_color"), length) - scattered
    sigma_a -= min(sigma_a.min(), 0.0)
    g = given.number("transmission_scatter_anisotropy")
    given.inside("transmission_color", sigma_a, colour(scattered), g)  # type: ignore[arg-type]
    return WHITE


def _albedo(given: Given) -> Value:
    given.leave("base_diffuse_roughness", parts.LAMBERTIAN)
    given.leave("subsurface_weight", parts.BELOW)
    share = given.number("subsurface_weight")
    return given.blended("base_color", given.number("base_weight"), "subsurface_color", share)


def _film(given: Given) -> tuple[float, Value]:
    return given.index("thin_film_ior"), changed(given["thin_film_thickness"], lambda um: 1000 * um)
