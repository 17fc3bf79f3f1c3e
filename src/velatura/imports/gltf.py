"""glTF 2.0 and its extensions for materials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.imports.given import Given
from velatura.imports.metals import of_f82_tint
from velatura.imports.parts import (
    COVERS,
    FIBRES,
    FLAT,
    LIGHT,
    OPAQUE,
    UNDISPERSED,
    absorbed,
    alike,
    alphas,
    coated,
    index,
    inside,
    tinted,
)
from velatura.imports.result import Imported, Notes
from velatura.imports.surface import WHITE, Coat, Metal, Surface, imported
from velatura.imports.values import Value
from velatura.targets import gltf
from velatura.targets.parameters import GREATEST, Parameter

PARAMETERS = (
    *gltf.PARAMETERS,
    Parameter("emissiveFactor", (0.0, 0.0, 0.0), high=GREATEST),
    Parameter("sheenColorFactor", (0.0, 0.0, 0.0)),
    Parameter("alpha", 1.0),
    Parameter("dispersion", 0.0, high=GREATEST),
    Parameter("diffuseTransmissionFactor", 0.0),
)
IGNORED = {"normalTexture": FLAT, "clearcoatNormalTexture": FLAT, "occlusionTexture": "no number of the material"}
COAT = 1.5  # index of a clearcoat (KHR_materials_clearcoat)


def read(values: Mapping[str, Any], name: str = "", notes: Notes | None = None) -> Imported:
    """The stack nearest to a material of glTF, by the names of its factors; images in place of their products.

    Raises:
        InvalidInput: an unknown parameter, or a value of another kind.
    """
    notes = Notes() if notes is None else notes
    given = Given(values, PARAMETERS, IGNORED, notes)
    metal, albedo, pane, specular = None, None, False, WHITE
    tint: Value = WHITE
    if given.whole("metallicFactor"):
        metal = Metal(given["baseColorFactor"], WHITE, of_f82_tint)
    else:
        specular = tinted(
            given, "specularColorFactor", given.number("specularFactor"), given.colour("specularColorFactor")
        )
        if given.whole("transmissionFactor"):
            tint, pane = given["baseColorFactor"], given.number("thicknessFactor") == 0
            _inside(given, pane)
        else:
            albedo = given["baseColorFactor"]
    thickness_nm = given["iridescenceThicknessMaximum"]  # without an image, which is between both
    strength, weight = given.number("anisotropyStrength"), given.number("clearcoatFactor")
    coat = Coat(COAT, alike(given["clearcoatRoughnessFactor"]) if weight else (0.0, 0.0))
    surface = Surface(
        alpha=alphas(given["roughnessFactor"], lambda r: gltf.alphas(r, strength)),
        rotation=float(np.degrees(given.number("anisotropyRotation"))) if strength else 0.0,
        metal=metal,
        eta=index(given, "ior"),
        specular=specular,
        albedo=albedo,
        tint=tint,
        pane=pane,
        film=(index(given, "iridescenceIor"), thickness_nm) if given.whole("iridescenceFactor") else None,
        by_sight=True,
        coat=coated(notes, "clearcoatFactor", weight, coat),
    )
    given.leave("sheenColorFactor", FIBRES)
    given.leave("emissiveFactor", LIGHT)
    given.leave("alpha", COVERS)
    given.leave("diffuseTransmissionFactor", OPAQUE)
    return imported(surface, notes, name, "imported from glTF")


def _inside(given: Given, pane: bool) -> None:
    given.leave("dispersion", UNDISPERSED)
    distance = given.number("attenuationDistance")
    if not pane and 0 < distance < GREATEST:
        inside(given, "attenuationColor", absorbed(given.colour("attenuationColor"), distance))
