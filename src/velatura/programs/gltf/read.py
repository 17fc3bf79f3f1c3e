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
from velatura.programs.surface import NO_COAT, Coat, Shares, Surface
from velatura.programs.to_stack import imported
from velatura.programs.values import Value, changed

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
    metal = given.share("metallicFactor")
    shares = Shares(
        cover=given.share("alpha"),
        coat=given.share("clearcoatFactor"),
        film=given.share("iridescenceFactor"),
        metal=metal,
        clear=given.share("transmissionFactor") if metal != 1 else 0.0,
    )
    given.leave("sheenColorFactor", parts.FIBRES)
    given.leave("emissiveFactor", parts.LIGHT)
    given.leave("diffuseTransmissionFactor", parts.OPAQUE)
    return imported(lambda part: _surface(given, part), shares, notes, name, "imported from glTF")


def covered(mode: str, alpha: Value, cutoff: float) -> Value:
    """The share of a surface that is there, by a mode of alpha."""
    if mode == "MASK":
        return changed(alpha, lambda a: (a >= cutoff).astype(float))
    return alpha if mode == "BLEND" else 1.0


def _surface(given: Given, part: Shares) -> Surface:
    """A part of the surface."""
    base: dict[str, Any] = {"colour": given["baseColorFactor"]}
    if part.metal:
        base["metalness"] = 1.0
    else:
        share, tint = given.number("specularFactor"), given.colour("specularColorFactor")
        base["specular"] = given.tinted("specularColorFactor", share, tint)
        if part.clear:
            pane = given.number("thicknessFactor") == 0
            base |= {"clear": 1.0, "tint": given["baseColorFactor"], "pane": pane}
            _inside(given, pane)
    thickness_nm = given["iridescenceThicknessMaximum"]  # without an image, which is between both
    strength = given.number("anisotropyStrength")
    return Surface(
        alpha=parts.alphas(given["roughnessFactor"], lambda r: formulas.alphas(r, strength)),
        rotation=float(np.degrees(given.number("anisotropyRotation"))) if strength else 0.0,
        eta=given.index("ior"),
        film=(given.index("iridescenceIor"), thickness_nm) if part.film else None,
        coat=Coat(COAT, parts.alike(given["clearcoatRoughnessFactor"])) if part.coat else NO_COAT,
        by_sight=True,
        **base,
    )


def _inside(given: Given, pane: bool) -> None:
    given.leave("dispersion", parts.UNDISPERSED)
    distance = given.number("attenuationDistance")
    if not pane and 0 < distance < GREATEST:
        given.inside("attenuationColor", parts.absorbed(given.colour("attenuationColor"), distance))
