"""Stacks of UsdPreviewSurface."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from velatura.programs import parts
from velatura.programs.given import Given
from velatura.programs.imported import Imported, Notes
from velatura.programs.parameters import GREATEST, Input
from velatura.programs.surface import NO_COAT, Coat, Shares, Surface
from velatura.programs.to_stack import imported
from velatura.programs.usd import parameters
from velatura.programs.values import changed

PARAMETERS = (
    *parameters.PARAMETERS,
    Input("emissiveColor", (0.0, 0.0, 0.0), high=GREATEST),
    Input("useSpecularWorkflow", 0.0),
    Input("specularColor", (0.0, 0.0, 0.0)),
    Input("opacityThreshold", 0.0),
    Input("displacement", 0.0, low=-GREATEST, high=GREATEST),
)
IGNORED = {"normal": parts.FLAT, "occlusion": "no number of the material"}
SOURCE = "imported from UsdPreviewSurface"
PRESENCE = ("presence", "1")  # modes of opacity in USD and in MaterialX, by which it is coverage
SPECULAR, SPECULAR_F_0 = 1.5, 0.04  # an index, and its reflectance at the normal, which the colour is a factor on


def read(values: Mapping[str, Any], name: str = "", notes: Notes | None = None) -> Imported:
    """The stack nearest to a UsdPreviewSurface, which lets light pass by its opacity, or is there by it: where that is
    cut at a threshold, or in the mode `presence`.

    Raises:
        InvalidInput: an unknown parameter, or a value of another kind.
    """
    notes = Notes() if notes is None else notes
    present = values.get("opacityMode", "transparent") in PRESENCE
    given = Given({key: each for key, each in values.items() if key != "opacityMode"}, PARAMETERS, IGNORED, notes)
    specular, least = given.number("useSpecularWorkflow") > 0, given.number("opacityThreshold")
    if least > 0:
        cut = changed(given["opacity"], lambda a: (a >= least).astype(float))
        given.replace("opacity", cut)
    covers = present or least > 0
    opaque = given.share("opacity")
    clear = changed(opaque, lambda a: 1 - a)
    shares = Shares(
        cover=opaque if covers else 1.0,
        coat=given.share("clearcoat"),
        metal=0.0 if specular else given.share("metallic"),
        clear=0.0 if covers else clear,  # type: ignore[arg-type]
    )
    given.leave("emissiveColor", parts.LIGHT)
    given.leave("displacement", "a stack has no height")
    if not specular:
        given.leave("specularColor", "of the specular workflow alone")
    return imported(lambda part: _surface(given, part, specular), shares, notes, name, SOURCE)


def _surface(given: Given, part: Shares, specular: bool) -> Surface:
    """A part of the surface; of the specular workflow, a dielectric that reflects this colour at the normal."""
    base: dict[str, Any] = {"colour": given["diffuseColor"], "eta": given.index("ior")}
    if part.metal:
        base["metalness"] = 1.0
    elif part.clear:  # which has no colour
        base |= {"clear": 1.0, "pane": True}
    elif specular:
        base |= {"eta": SPECULAR, "specular": tuple(each / SPECULAR_F_0 for each in given.colour("specularColor"))}
    return Surface(
        alpha=parts.alike(given["roughness"]),
        coat=Coat(given.index("ior"), parts.alike(given["clearcoatRoughness"]), darkening=0.0)
        if part.coat
        else NO_COAT,
        by_sight=True,
        **base,
    )
