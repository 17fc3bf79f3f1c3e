"""Stacks of Autodesk Standard Surface 1.0, as MaterialX has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.programs import parts
from velatura.programs.given import Given
from velatura.programs.imported import Imported, Notes
from velatura.programs.metals import of_edge_tint
from velatura.programs.standard_surface.parameters import PARAMETERS as PARAMETERS
from velatura.programs.surface import NO_COAT, WHITE, Alpha, Coat, Shares, Surface
from velatura.programs.to_stack import imported
from velatura.programs.values import Value, changed

IGNORED = {"normal": parts.FLAT, "coat_normal": parts.FLAT, "tangent": parts.TANGENT}
LEAST_ASPECT = 0.02


def read(values: Mapping[str, Any], name: str = "", notes: Notes | None = None) -> Imported:
    """The stack nearest to a standard_surface, whose coats do not darken.

    Raises:
        InvalidInput: an unknown parameter, or a value of another kind.
    """
    notes = Notes() if notes is None else notes
    given = Given(values, PARAMETERS, IGNORED, notes)
    metal = given.share("metalness")
    shares = Shares(
        cover=given.share("opacity"),
        coat=given.share("coat"),
        metal=metal,
        clear=given.share("transmission") if metal != 1 else 0.0,
    )
    given.leave("sheen", parts.FIBRES)
    given.leave("emission", parts.LIGHT)
    return imported(lambda part: _surface(given, part), shares, notes, name, "imported from Standard Surface")


def _surface(given: Given, part: Shares) -> Surface:
    """A part of the surface. What a coat does to the base, it does where it is."""
    base: dict[str, Any]
    if part.metal:
        share, (red, green, blue), edge = given.number("base"), given.colour("specular_color"), given.number("specular")
        base = {
            "metalness": 1.0,
            "colour": changed(given["base_color"], lambda c: share * c),
            "edge": (edge * red, edge * green, edge * blue),
            "index": of_edge_tint,
        }
    else:
        share, colour = given.number("specular"), given.colour("specular_color")
        base = {"specular": given.tinted("specular_color", share, colour)}
        thin = given.number("thin_walled") > 0
        if part.clear:
            base |= {"clear": 1.0, "tint": _tint(given, thin), "pane": thin}
        else:
            base["colour"] = _albedo(given, 1 + (given.number("coat_affect_color") if part.coat else 0.0))
            given.leave("thin_walled", parts.OPAQUE)
    thickness_nm = given["thin_film_thickness"]
    affected = given.number("coat_affect_roughness") if part.coat else 0.0
    affected = affected * given.number("coat_roughness") if affected else 0.0
    roughness = changed(given["specular_roughness"], lambda r: r + affected * (1 - r))
    return Surface(
        alpha=_alpha(roughness, given.number("specular_anisotropy")),
        rotation=360 * given.number("specular_rotation"),
        eta=given.index("specular_IOR"),
        film=(given.index("thin_film_IOR"), thickness_nm) if thickness_nm != 0 else None,
        coat=_coat(given) if part.coat else NO_COAT,
        by_sight=True,
        **base,
    )


def _coat(given: Given) -> Coat:
    return Coat(
        given.index("coat_IOR"),
        _alpha(given["coat_roughness"], given.number("coat_anisotropy")),
        360 * given.number("coat_rotation"),
        given["coat_color"],
        darkening=0.0,
    )


def _alpha(roughness: Value, anisotropy: float) -> Alpha:
    """GGX alpha along the axes (`roughness_anisotropy` of MaterialX)."""
    aspect = float(np.sqrt(1 - min(anisotropy, 1 - LEAST_ASPECT)))
    return parts.alphas(roughness, lambda r: (r * r / aspect, r * r * aspect))


def _tint(given: Given, pane: bool) -> Value:
    given.leave("transmission_extra_roughness", "one roughness for what is reflected and what passes")
    given.leave("transmission_dispersion", parts.UNDISPERSED)
    length = given.number("transmission_depth")
    if pane or not length:
        return given["transmission_color"]
    extinction = parts.absorbed(given.colour("transmission_color"), length)
    scattered, g = given.colour("transmission_scatter"), given.number("transmission_scatter_anisotropy")
    given.inside("transmission_color", extinction, scattered, g)
    return WHITE


def _albedo(given: Given, power: float) -> Value:
    """The colour of a diffuse base, raised to a power."""
    given.leave("diffuse_roughness", parts.LAMBERTIAN)
    given.leave("subsurface", parts.BELOW)
    seen = given.blended("base_color", given.number("base"), "subsurface_color", given.number("subsurface"))
    return changed(seen, lambda c: c**power) if power != 1 else seen
