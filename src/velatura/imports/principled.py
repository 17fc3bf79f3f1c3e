"""Disney's principled BSDF as Mitsuba has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.imports.given import Given
from velatura.imports.metals import of_f82_tint
from velatura.imports.parts import FIBRES, LAMBERTIAN, alphas, coated, index, tinted
from velatura.imports.result import Imported, Notes
from velatura.imports.surface import WHITE, Coat, Metal, Surface, imported
from velatura.imports.values import Value, changed
from velatura.stack import RGB
from velatura.stack.spectra import LUMINANCE
from velatura.targets import principled
from velatura.targets.closures import burley
from velatura.targets.parameters import Parameter

PARAMETERS = (*principled.PARAMETERS, Parameter("specular", 0.5))
RATES = ("diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate")
COAT = 1.5  # index of a clearcoat, whose reflectance at the normal the plugin has


def read(values: Mapping[str, Any], name: str = "", notes: Notes | None = None) -> Imported:
    """The stack nearest to a `principled`, whose coat neither darkens nor absorbs.

    Raises:
        InvalidInput: an unknown parameter, both of `eta` and `specular`, or a value of another kind.
    """
    notes = Notes() if notes is None else notes
    if "eta" in values and "specular" in values:
        raise InvalidInput("eta: not together with specular; write one of them")
    given = Given({key: value for key, value in values.items() if key not in RATES}, PARAMETERS, {}, notes)
    eta = index(given, "eta") if "eta" in values else 2 / (1 - np.sqrt(0.08 * given.number("specular"))) - 1
    metal, albedo, specular = None, None, WHITE
    tint: Value = WHITE
    if given.whole("metallic"):
        metal = Metal(given["base_color"], WHITE, of_f82_tint)
    else:
        share = given.number("spec_tint")
        if share:
            red, green, blue = (1 - share + share * each for each in _hue(given))
            specular = tinted(given, "spec_tint", 1.0, (red, green, blue))
        if given.whole("spec_trans"):
            tint = changed(given["base_color"], np.sqrt)  # of each crossing
        else:
            albedo = given["base_color"]
    anisotropic = given.number("anisotropic")
    weight = given.number("clearcoat")
    gloss = given.number("clearcoat_gloss") if weight else 0.0
    rough, smooth = principled.COAT_ALPHA
    blur = rough + gloss * (smooth - rough)
    surface = Surface(
        alpha=alphas(given["roughness"], lambda r: burley(r, anisotropic)),
        metal=metal,
        eta=float(eta),
        specular=specular,
        albedo=albedo,
        tint=tint,
        by_sight=True,
        coat=coated(notes, "clearcoat", weight, Coat(COAT, (blur, blur))),
    )
    given.leave("sheen", FIBRES)
    given.leave("flatness", LAMBERTIAN)
    return imported(surface, notes, name, "imported from Mitsuba's principled")


def _hue(given: Given) -> RGB:
    """The colour of the base at luminance 1."""
    base = np.array(given.colour("base_color"))
    red, green, blue = (base / max(float(base @ LUMINANCE), 1e-6)).tolist()
    return red, green, blue
