"""Inputs of Blender's Principled BSDF."""

from __future__ import annotations

from velatura.programs.parameters import GREATEST, Parameter

#: Inputs of the node by their names; colours have a fourth component there, which is 1.
PARAMETERS = (
    Parameter("Base Color", (0.8, 0.8, 0.8)),
    Parameter("Metallic", 0.0),
    Parameter("Roughness", 0.5),
    Parameter("IOR", 1.5, low=1.0, high=1000.0),
    Parameter("Diffuse Roughness", 0.0),
    Parameter("Specular IOR Level", 0.5),
    Parameter("Specular Tint", (1.0, 1.0, 1.0), high=GREATEST),
    Parameter("Anisotropic", 0.0),
    Parameter("Anisotropic Rotation", 0.0),  # of a whole turn
    Parameter("Transmission Weight", 0.0),
    Parameter("Coat Weight", 0.0),
    Parameter("Coat Roughness", 0.03),
    Parameter("Coat IOR", 1.5, low=1.0, high=4.0),
    Parameter("Coat Tint", (1.0, 1.0, 1.0)),
    Parameter("Thin Film Thickness", 0.0, high=100000.0),  # nanometres
    Parameter("Thin Film IOR", 1.33, low=1.0, high=1000.0),
)
