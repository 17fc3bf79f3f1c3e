"""Stacks of materials of glTF 2.0 and its extensions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    *parameters.COATING,
    Input("emissiveFactor", (0.0, 0.0, 0.0), high=GREATEST),
    Input("sheenColorFactor", (0.0, 0.0, 0.0), within="KHR_materials_sheen"),
    Input("alpha", 1.0),
    Input("dispersion", 0.0, high=GREATEST, within="KHR_materials_dispersion"),
    Input("diffuseTransmissionFactor", 0.0, within="KHR_materials_diffuse_transmission"),
)
IGNORED = {
    "normalTexture": parts.FLAT,
    "clearcoatNormalTexture": parts.FLAT,
    "coatNormalTexture": parts.FLAT,
    "occlusionTexture": "no number of the material",
}
CLEARCOAT_ETA = 1.5  # (KHR_materials_clearcoat)


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
        coat=given.share("coatFactor" if has_coat(values) else "clearcoatFactor"),
        film=given.share("iridescenceFactor"),
        metal=metal,
        clear=given.share("transmissionFactor") if metal != 1 else 0.0,
    )
    given.leave("sheenColorFactor", parts.FIBRES)
    given.leave("emissiveFactor", parts.LIGHT)
    given.leave("diffuseTransmissionFactor", parts.OPAQUE)
    coat = _coat if has_coat(values) else _clearcoat
    return imported(lambda part: _surface(given, part, coat), shares, notes, name, "imported from glTF")


def has_coat(values: Mapping[str, Any]) -> bool:
    """Whether a material has the coat that takes the place of a clearcoat."""
    return any(name.startswith("coat") for name in values)


def covered(mode: str, alpha: Value, cutoff: float) -> Value:
    """The share of a surface that is there, by a mode of alpha."""
    if mode == "MASK":
        return changed(alpha, lambda a: (a >= cutoff).astype(float))
    return alpha if mode == "BLEND" else 1.0


def _surface(given: Given, part: Shares, coat: Callable[[Given], Coat]) -> Surface:
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
        coat=coat(given) if part.coat else NO_COAT,
        by_sight=True,
        **base,
    )


def _clearcoat(given: Given) -> Coat:
    return Coat(CLEARCOAT_ETA, parts.alike(given["clearcoatRoughnessFactor"]), darkening=0.0)


def _coat(given: Given) -> Coat:
    strength = given.number("coatAnisotropyStrength")
    return Coat(
        given.index("coatIor"),
        parts.alphas(given["coatRoughnessFactor"], lambda r: formulas.alphas(r, strength)),
        float(np.degrees(given.number("coatAnisotropyRotation"))) if strength else 0.0,
        given["coatColorFactor"],
        given.number("coatDarkeningFactor"),
    )


def _inside(given: Given, pane: bool) -> None:
    given.leave("dispersion", parts.UNDISPERSED)
    distance = given.number("attenuationDistance")
    if not pane and 0 < distance < GREATEST:
        given.inside("attenuationColor", parts.absorbed(given.colour("attenuationColor"), distance))
