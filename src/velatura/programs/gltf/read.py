"""Stacks of materials of glTF 2.0 and its extensions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.programs import parts
from velatura.programs.given import Given
from velatura.programs.gltf import formulas, parameters
from velatura.programs.imported import Imported, Notes
from velatura.programs.parameters import GREATEST, Input
from velatura.programs.surface import Coat, Surface
from velatura.programs.to_stack import imported

PARAMETERS = (
    *parameters.PARAMETERS,
    Input("emissiveFactor", (0.0, 0.0, 0.0), high=GREATEST),
    Input("sheenColorFactor", (0.0, 0.0, 0.0), within="KHR_materials_sheen"),
    Input("alpha", 1.0),
    Input("dispersion", 0.0, high=GREATEST, within="KHR_materials_dispersion"),
    Input("diffuseTransmissionFactor", 0.0, within="KHR_materials_diffuse_transmission"),
)
IGNORED = {
    "normalTexture": parts.FLAT,
    "clearcoatNormalTexture": parts.FLAT,
    "occlusionTexture": "no number of the material",
}
COAT = 1.5  # index of a clearcoat (KHR_materials_clearcoat)


def read(values: Mapping[str, Any], name: str = "", notes: Notes | None = None) -> Imported:
    """The stack nearest to a material of glTF, by the names of its factors; images in place of their products.

    Raises:
        InvalidInput: an unknown parameter, or a value of another kind.
    """
    notes = Notes() if notes is None else notes
    given = Given(values, PARAMETERS, IGNORED, notes)
    base: dict[str, Any] = {"colour": given["baseColorFactor"]}
    if given.whole("metallicFactor"):
        base["metalness"] = 1.0
    else:
        share, tint = given.number("specularFactor"), given.colour("specularColorFactor")
        base["specular"] = given.tinted("specularColorFactor", share, tint)
        if given.whole("transmissionFactor"):
            pane = given.number("thicknessFactor") == 0
            base |= {"clear": 1.0, "tint": given["baseColorFactor"], "pane": pane}
            _inside(given, pane)
    thickness_nm = given["iridescenceThicknessMaximum"]  # without an image, which is between both
    strength, weight = given.number("anisotropyStrength"), given.number("clearcoatFactor")
    coat = Coat(COAT, parts.alike(given["clearcoatRoughnessFactor"]) if weight else (0.0, 0.0))
    surface = Surface(
        alpha=parts.alphas(given["roughnessFactor"], lambda r: formulas.alphas(r, strength)),
        rotation=float(np.degrees(given.number("anisotropyRotation"))) if strength else 0.0,
        eta=given.index("ior"),
        film=(given.index("iridescenceIor"), thickness_nm) if given.whole("iridescenceFactor") else None,
        coat=parts.coated(notes, "clearcoatFactor", weight, coat),
        by_sight=True,
        **base,
    )
    given.leave("sheenColorFactor", parts.FIBRES)
    given.leave("emissiveFactor", parts.LIGHT)
    given.leave("alpha", parts.COVERS)
    given.leave("diffuseTransmissionFactor", parts.OPAQUE)
    return imported(surface, notes, name, "imported from glTF")


def _inside(given: Given, pane: bool) -> None:
    given.leave("dispersion", parts.UNDISPERSED)
    distance = given.number("attenuationDistance")
    if not pane and 0 < distance < GREATEST:
        given.inside("attenuationColor", parts.absorbed(given.colour("attenuationColor"), distance))
