"""Parameters of materials of glTF 2.0 and its extensions (https://registry.khronos.org/glTF)."""

import re
from math import pi

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Input

CORE = "pbrMetallicRoughness"
CLEARCOAT = "KHR_materials_clearcoat"
COAT = "KHR_materials_coat"
ANISOTROPY = "KHR_materials_anisotropy"
IOR = "KHR_materials_ior"
SPECULAR = "KHR_materials_specular"
TRANSMISSION = "KHR_materials_transmission"
VOLUME = "KHR_materials_volume"
IRIDESCENCE = "KHR_materials_iridescence"

#: Angles are in radians, thicknesses in nanometres; `baseColorFactor` is without its fourth component, the coverage.
PARAMETERS = (
    Input("baseColorFactor", (1.0, 1.0, 1.0), within=CORE, fit=("colour", *UNIT)),
    Input("metallicFactor", 1.0, within=CORE, fit=("metal", *UNIT)),
    Input("roughnessFactor", 1.0, within=CORE, fit=("rough", *ROUGH)),
    Input("clearcoatFactor", 0.0, within=CLEARCOAT),
    Input("clearcoatRoughnessFactor", 0.0, within=CLEARCOAT),
    Input("anisotropyStrength", 0.0, within=ANISOTROPY, fit=("brushed", *UNIT)),
    Input("anisotropyRotation", 0.0, -GREATEST, GREATEST, ANISOTROPY, ("brushed", -pi, pi)),  # anticlockwise
    Input("ior", 1.5, low=1.0, high=GREATEST, within=IOR, fit=("index", 1.001, 4.0)),  # 0 for an infinite one
    Input("specularFactor", 1.0, within=SPECULAR),
    Input("specularColorFactor", (1.0, 1.0, 1.0), high=GREATEST, within=SPECULAR, fit=("tint", *UNIT)),
    Input("transmissionFactor", 0.0, within=TRANSMISSION, fit=("clear", *UNIT)),
    Input("thicknessFactor", 0.0, high=GREATEST, within=VOLUME),
    Input("attenuationDistance", GREATEST, high=GREATEST, within=VOLUME),
    Input("attenuationColor", (1.0, 1.0, 1.0), within=VOLUME),
    Input("iridescenceFactor", 0.0, within=IRIDESCENCE),
    Input("iridescenceIor", 1.3, low=1.0, high=GREATEST, within=IRIDESCENCE, fit=("film", 1.001, 3.0)),
    Input("iridescenceThicknessMinimum", 100.0, high=GREATEST, within=IRIDESCENCE),
    Input("iridescenceThicknessMaximum", 400.0, high=GREATEST, within=IRIDESCENCE, fit=("thickness", 10.0, 2000.0)),
)

#: The coat, as proposed (https://github.com/KhronosGroup/glTF/pull/2534). It stands in place of a clearcoat.
COATING = (
    Input("coatFactor", 0.0, within=COAT),
    Input("coatRoughnessFactor", 0.0, within=COAT),
    Input("coatIor", 1.5, low=1.0, high=GREATEST, within=COAT, fit=("coat", 1.001, 3.0)),
    Input("coatColorFactor", (1.0, 1.0, 1.0), within=COAT, fit=("coat", *UNIT)),
    Input("coatDarkeningFactor", 1.0, within=COAT, fit=("coat", *UNIT)),
    Input("coatAnisotropyStrength", 0.0, within=COAT, fit=("brushed", *UNIT)),
    Input("coatAnisotropyRotation", 0.0, -GREATEST, GREATEST, COAT),  # anticlockwise
)


def image_of(factor: str) -> str:
    """The name of the image that stands in place of a factor."""
    key = re.sub("(metallic|roughness)Factor", "metallicRoughnessTexture", factor)
    return re.sub("Factor|Maximum", "Texture", key)


#: Channels of images that stand in place of factors.
CHANNELS = {
    "baseColorFactor": "rgb",
    "metallicFactor": "b",
    "roughnessFactor": "g",
    "clearcoatFactor": "r",
    "clearcoatRoughnessFactor": "g",
    "coatFactor": "r",
    "coatRoughnessFactor": "g",
    "coatColorFactor": "rgb",
    "specularFactor": "a",
    "specularColorFactor": "rgb",
    "transmissionFactor": "r",
    "thicknessFactor": "g",
    "iridescenceFactor": "r",
    "iridescenceThicknessMaximum": "g",
}
