"""Autodesk Standard Surface 1.0, as MaterialX has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.imports.given import Given
from velatura.imports.metals import of_edge_tint
from velatura.imports.parts import (
    BELOW,
    COVERS,
    FIBRES,
    FLAT,
    LAMBERTIAN,
    LIGHT,
    OPAQUE,
    TANGENT,
    UNDISPERSED,
    absorbed,
    alphas,
    blended,
    coated,
    index,
    inside,
    tinted,
)
from velatura.imports.result import Imported, Notes
from velatura.imports.surface import WHITE, Coat, Metal, Surface, imported
from velatura.imports.values import Value, changed
from velatura.targets.parameters import GREATEST, Parameter

PARAMETERS = (
    Parameter("base", 1.0),
    Parameter("base_color", (0.8, 0.8, 0.8)),
    Parameter("diffuse_roughness", 0.0),
    Parameter("metalness", 0.0),
    Parameter("specular", 1.0),
    Parameter("specular_color", WHITE),
    Parameter("specular_roughness", 0.2),
    Parameter("specular_IOR", 1.5, high=GREATEST),
    Parameter("specular_anisotropy", 0.0),
    Parameter("specular_rotation", 0.0),
    Parameter("transmission", 0.0),
    Parameter("transmission_color", WHITE),
    Parameter("transmission_depth", 0.0, high=GREATEST),
    Parameter("transmission_scatter", (0.0, 0.0, 0.0)),
    Parameter("transmission_scatter_anisotropy", 0.0, low=-1.0),
    Parameter("transmission_dispersion", 0.0, high=GREATEST),
    Parameter("transmission_extra_roughness", 0.0, low=-1.0),
    Parameter("subsurface", 0.0),
    Parameter("subsurface_color", WHITE),
    Parameter("subsurface_radius", WHITE, high=GREATEST),
    Parameter("subsurface_scale", 1.0, high=GREATEST),
    Parameter("subsurface_anisotropy", 0.0, low=-1.0),
    Parameter("sheen", 0.0),
    Parameter("sheen_color", WHITE),
    Parameter("sheen_roughness", 0.3),
    Parameter("coat", 0.0),
    Parameter("coat_color", WHITE),
    Parameter("coat_roughness", 0.1),
    Parameter("coat_anisotropy", 0.0),
    Parameter("coat_rotation", 0.0),
    Parameter("coat_IOR", 1.5, high=GREATEST),
    Parameter("coat_affect_color", 0.0),
    Parameter("coat_affect_roughness", 0.0),
    Parameter("thin_film_thickness", 0.0, high=GREATEST),  # nanometres
    Parameter("thin_film_IOR", 1.5, high=GREATEST),
    Parameter("emission", 0.0, high=GREATEST),
    Parameter("emission_color", WHITE),
    Parameter("opacity", WHITE),
    Parameter("thin_walled", False),
)
IGNORED = {"normal": FLAT, "coat_normal": FLAT, "tangent": TANGENT}
LEAST_ASPECT = 0.02


def read(values: Mapping[str, Any], name: str = "", notes: Notes | None = None) -> Imported:
    """The stack nearest to a standard_surface, whose coats do not darken.

    Raises:
        InvalidInput: an unknown parameter, or a value of another kind.
    """
    notes = Notes() if notes is None else notes
    given = Given(values, PARAMETERS, IGNORED, notes)
    weight, thin = given.number("coat"), given.number("thin_walled") > 0
    metal, albedo, pane, specular = None, None, False, WHITE
    tint: Value = WHITE
    if given.whole("metalness"):
        base, (red, green, blue) = given.number("base"), given.colour("specular_color")
        edge = given.number("specular")
        reflectance = changed(given["base_color"], lambda c: base * c)
        metal = Metal(reflectance, (edge * red, edge * green, edge * blue), of_edge_tint)
    else:
        specular = tinted(given, "specular_color", given.number("specular"), given.colour("specular_color"))
        if given.whole("transmission"):
            tint, pane = _tint(given, thin), thin
        else:
            albedo = _albedo(given, 1 + weight * given.number("coat_affect_color"))
            given.leave("thin_walled", OPAQUE)
    thickness_nm = given["thin_film_thickness"]
    affected = weight * given.number("coat_affect_roughness")
    affected = affected * given.number("coat_roughness") if affected else 0.0
    roughness = changed(given["specular_roughness"], lambda r: r + affected * (1 - r))
    coat = Coat(
        index(given, "coat_IOR"),
        _alpha(given["coat_roughness"], given.number("coat_anisotropy")) if weight else (0.0, 0.0),
        360 * given.number("coat_rotation"),
        given["coat_color"] if weight else WHITE,
    )
    surface = Surface(
        alpha=_alpha(roughness, given.number("specular_anisotropy")),
        rotation=360 * given.number("specular_rotation"),
        metal=metal,
        eta=index(given, "specular_IOR"),
        specular=specular,
        albedo=albedo,
        tint=tint,
        pane=pane,
        film=(index(given, "thin_film_IOR"), thickness_nm) if thickness_nm != 0 else None,
        by_sight=True,
        coat=coated(notes, "coat", weight, coat),
    )
    given.leave("sheen", FIBRES)
    given.leave("emission", LIGHT)
    given.leave("opacity", COVERS)
    return imported(surface, notes, name, "imported from Standard Surface")


def _alpha(roughness: Value, anisotropy: float) -> tuple[Value, Value]:
    """GGX alpha along the axes (`roughness_anisotropy` of MaterialX)."""
    aspect = float(np.sqrt(1 - min(anisotropy, 1 - LEAST_ASPECT)))
    return alphas(roughness, lambda r: (r * r / aspect, r * r * aspect))


def _tint(given: Given, pane: bool) -> Value:
    given.leave("transmission_extra_roughness", "one roughness for what is reflected and what passes")
    given.leave("transmission_dispersion", UNDISPERSED)
    length = given.number("transmission_depth")
    if pane or not length:
        return given["transmission_color"]
    extinction = absorbed(given.colour("transmission_color"), length)
    scattered, g = given.colour("transmission_scatter"), given.number("transmission_scatter_anisotropy")
    inside(given, "transmission_color", extinction, scattered, g)
    return WHITE


def _albedo(given: Given, power: float) -> Value:
    """The colour of a diffuse base, raised to a power."""
    given.leave("diffuse_roughness", LAMBERTIAN)
    given.leave("subsurface", BELOW)
    seen = blended(given, "base_color", given.number("base"), "subsurface_color", given.number("subsurface"))
    return changed(seen, lambda c: c**power) if power != 1 else seen
