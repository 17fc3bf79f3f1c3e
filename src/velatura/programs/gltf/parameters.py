"""Parameters of materials of glTF 2.0 and its extensions (https://registry.khronos.org/glTF)."""

from math import pi

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Parameter

CORE = "pbrMetallicRoughness"
CLEARCOAT = "KHR_materials_clearcoat"
ANISOTROPY = "KHR_materials_anisotropy"
IOR = "KHR_materials_ior"
SPECULAR = "KHR_materials_specular"
TRANSMISSION = "KHR_materials_transmission"
VOLUME = "KHR_materials_volume"
IRIDESCENCE = "KHR_materials_iridescence"

#: Angles are in radians, thicknesses in nanometres; `baseColorFactor` is without its fourth component, the coverage.
PARAMETERS = (
    Parameter("baseColorFactor", (1.0, 1.0, 1.0), within=CORE, fit=("colour", *UNIT)),
    Parameter("metallicFactor", 1.0, within=CORE, fit=("metal", *UNIT)),
    Parameter("roughnessFactor", 1.0, within=CORE, fit=("rough", *ROUGH)),
    Parameter("clearcoatFactor", 0.0, within=CLEARCOAT),
    Parameter("clearcoatRoughnessFactor", 0.0, within=CLEARCOAT),
    Parameter("anisotropyStrength", 0.0, within=ANISOTROPY, fit=("brushed", *UNIT)),
    Parameter("anisotropyRotation", 0.0, -GREATEST, GREATEST, ANISOTROPY, ("brushed", -pi, pi)),  # anticlockwise
    Parameter("ior", 1.5, low=1.0, high=GREATEST, within=IOR, fit=("index", 1.001, 4.0)),  # 0 for an infinite one
    Parameter("specularFactor", 1.0, within=SPECULAR),
    Parameter("specularColorFactor", (1.0, 1.0, 1.0), high=GREATEST, within=SPECULAR, fit=("tint", *UNIT)),
    Parameter("transmissionFactor", 0.0, within=TRANSMISSION, fit=("clear", *UNIT)),
    Parameter("thicknessFactor", 0.0, high=GREATEST, within=VOLUME),
    Parameter("attenuationDistance", GREATEST, high=GREATEST, within=VOLUME),
    Parameter("attenuationColor", (1.0, 1.0, 1.0), within=VOLUME),
    Parameter("iridescenceFactor", 0.0, within=IRIDESCENCE),
    Parameter("iridescenceIor", 1.3, low=1.0, high=GREATEST, within=IRIDESCENCE, fit=("film", 1.001, 3.0)),
    Parameter("iridescenceThicknessMinimum", 100.0, high=GREATEST, within=IRIDESCENCE),
    Parameter("iridescenceThicknessMaximum", 400.0, high=GREATEST, within=IRIDESCENCE, fit=("thickness", 10.0, 2000.0)),
)

#: Channels of images that stand in place of factors.
CHANNELS = {
    "baseColorFactor": "rgb",
    "metallicFactor": "b",
    "roughnessFactor": "g",
    "clearcoatFactor": "r",
    "clearcoatRoughnessFactor": "g",
    "specularFactor": "a",
    "specularColorFactor": "rgb",
    "transmissionFactor": "r",
    "thicknessFactor": "g",
    "iridescenceFactor": "r",
    "iridescenceThicknessMaximum": "g",
}
