"""Parameters of materials of glTF 2.0 and its extensions (https://registry.khronos.org/glTF)."""

from __future__ import annotations

from velatura.programs.parameters import GREATEST, Parameter

CORE = "pbrMetallicRoughness"
CLEARCOAT = "KHR_materials_clearcoat"
ANISOTROPY = "KHR_materials_anisotropy"
IOR = "KHR_materials_ior"
SPECULAR = "KHR_materials_specular"
TRANSMISSION = "KHR_materials_transmission"
VOLUME = "KHR_materials_volume"
IRIDESCENCE = "KHR_materials_iridescence"

#: `baseColorFactor` without its fourth component, the coverage.
PARAMETERS = (
    Parameter("baseColorFactor", (1.0, 1.0, 1.0), within=CORE),
    Parameter("metallicFactor", 1.0, within=CORE),
    Parameter("roughnessFactor", 1.0, within=CORE),
    Parameter("clearcoatFactor", 0.0, within=CLEARCOAT),
    Parameter("clearcoatRoughnessFactor", 0.0, within=CLEARCOAT),
    Parameter("anisotropyStrength", 0.0, within=ANISOTROPY),
    Parameter("anisotropyRotation", 0.0, low=-GREATEST, high=GREATEST, within=ANISOTROPY),  # radians, anticlockwise
    Parameter("ior", 1.5, low=1.0, high=GREATEST, within=IOR),  # also 0, which stands for an infinite one
    Parameter("specularFactor", 1.0, within=SPECULAR),
    Parameter("specularColorFactor", (1.0, 1.0, 1.0), high=GREATEST, within=SPECULAR),
    Parameter("transmissionFactor", 0.0, within=TRANSMISSION),
    Parameter("thicknessFactor", 0.0, high=GREATEST, within=VOLUME),
    Parameter("attenuationDistance", GREATEST, high=GREATEST, within=VOLUME),
    Parameter("attenuationColor", (1.0, 1.0, 1.0), within=VOLUME),
    Parameter("iridescenceFactor", 0.0, within=IRIDESCENCE),
    Parameter("iridescenceIor", 1.3, low=1.0, high=GREATEST, within=IRIDESCENCE),
    Parameter("iridescenceThicknessMinimum", 100.0, high=GREATEST, within=IRIDESCENCE),  # nanometres
    Parameter("iridescenceThicknessMaximum", 400.0, high=GREATEST, within=IRIDESCENCE),
)
