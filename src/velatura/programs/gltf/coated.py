"""glTF with the coat that Khronos proposes, beside a clearcoat for programs that do not know it."""

from __future__ import annotations

from dataclasses import replace

from velatura.programs.gltf import write
from velatura.programs.gltf.parameters import CLEARCOAT, COATING, PARAMETERS
from velatura.programs.program import Fitted, rgb
from velatura.programs.surface import Surface

FACETS = ("coatRoughnessFactor", "coatAnisotropyStrength", "coatAnisotropyRotation")


def start(surface: Surface) -> Fitted:
    """Parameters of a surface."""
    coat, values = surface.coat, write.uncoated(surface)
    if surface.coated:
        values |= {"coatFactor": coat.share, "coatIor": coat.eta, "coatColorFactor": rgb(coat.colour)}
        values |= zip(FACETS, write.facets(coat.alpha, coat.rotation))
    return values


PROGRAM = replace(
    write.PROGRAM,
    title="glTF with KHR_materials_coat",
    parameters=(*(each for each in PARAMETERS if each.within != CLEARCOAT), *COATING),
    start=start,
    coat_eta=True,
    coat_brushed=True,
    coat_colour=True,
)
