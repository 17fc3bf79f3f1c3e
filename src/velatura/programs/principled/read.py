"""Stacks of Disney's principled BSDF as Mitsuba has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.programs import parts
from velatura.programs.closures import burley
from velatura.programs.given import Given
from velatura.programs.imported import Imported, Notes
from velatura.programs.parameters import Input
from velatura.programs.principled import formulas, parameters
from velatura.programs.surface import NO_COAT, Coat, Shares, Surface
from velatura.programs.to_stack import imported
from velatura.programs.values import changed
from velatura.stack import RGB, Texture
from velatura.stack.spectra import LUMINANCE

PARAMETERS = (*parameters.PARAMETERS, Input("specular", 0.5))
RATES = ("diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate")
COAT = 1.5  # index of a clearcoat, whose reflectance at the normal the plugin has


def read(
    values: Mapping[str, Any], name: str = "", notes: Notes | None = None, cover: float | Texture = 1.0
) -> Imported:
    """The stack nearest to a `principled`, whose coat neither darkens nor absorbs, on a share of a surface.

    Raises:
        InvalidInput: an unknown parameter, both of `eta` and `specular`, or a value of another kind.
    """
    notes = Notes() if notes is None else notes
    if "eta" in values and "specular" in values:
        raise InvalidInput("eta: not together with specular; write one of them")
    given = Given({key: value for key, value in values.items() if key not in RATES}, PARAMETERS, {}, notes)
    eta = given.index("eta") if "eta" in values else 2 / (1 - np.sqrt(0.08 * given.number("specular"))) - 1
    metal = given.share("metallic")
    shares = Shares(
        cover, coat=given.share("clearcoat"), metal=metal, clear=given.share("spec_trans") if metal != 1 else 0.0
    )
    given.leave("sheen", parts.FIBRES)
    given.leave("flatness", parts.LAMBERTIAN)
    return imported(
        lambda part: _surface(given, part, float(eta)), shares, notes, name, "imported from Mitsuba's principled"
    )


def _surface(given: Given, part: Shares, eta: float) -> Surface:
    """A part of the surface."""
    base: dict[str, Any] = {"colour": given["base_color"]}
    if part.metal:
        base["metalness"] = 1.0
    else:
        share = given.number("spec_tint")
        if share:
            red, green, blue = (1 - share + share * each for each in _hue(given))
            base["specular"] = given.tinted("spec_tint", 1.0, (red, green, blue))
        if part.clear:
            base |= {"clear": 1.0, "tint": changed(given["base_color"], np.sqrt)}  # of each crossing
    anisotropic = given.number("anisotropic")
    return Surface(
        alpha=parts.alphas(given["roughness"], lambda r: burley(r, anisotropic)),
        eta=eta,
        coat=_coat(given) if part.coat else NO_COAT,
        by_sight=True,
        **base,
    )


def _coat(given: Given) -> Coat:
    rough, smooth = formulas.COAT_ALPHA
    blur = rough + given.number("clearcoat_gloss") * (smooth - rough)
    return Coat(COAT, (blur, blur), darkening=0.0)


def _hue(given: Given) -> RGB:
    """The colour of the base at luminance 1."""
    base = np.array(given.colour("base_color"))
    red, green, blue = (base / max(float(base @ LUMINANCE), 1e-6)).tolist()
    return red, green, blue
