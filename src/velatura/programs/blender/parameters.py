"""Inputs of Blender's Principled BSDF."""

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Parameter

#: Inputs of the node by their names; colours have a fourth component there, which is 1.
PARAMETERS = (
    Parameter("Base Color", (0.8, 0.8, 0.8), fit=("colour", *UNIT)),
    Parameter("Metallic", 0.0, fit=("metal", *UNIT)),
    Parameter("Roughness", 0.5, fit=("rough", *ROUGH)),
    Parameter("IOR", 1.5, low=1.0, high=1000.0, fit=("index", 1.001, 4.0)),
    Parameter("Diffuse Roughness", 0.0, fit=("diffuse", *UNIT)),
    Parameter("Specular IOR Level", 0.5),
    Parameter("Specular Tint", (1.0, 1.0, 1.0), high=GREATEST, fit=("tint", *UNIT)),
    Parameter("Anisotropic", 0.0, fit=("brushed", *UNIT)),
    Parameter("Anisotropic Rotation", 0.0, fit=("brushed", -1.0, 2.0)),  # of a whole turn
    Parameter("Transmission Weight", 0.0, fit=("clear", *UNIT)),
    Parameter("Coat Weight", 0.0),
    Parameter("Coat Roughness", 0.03),
    Parameter("Coat IOR", 1.5, low=1.0, high=4.0, fit=("coat", 1.001, 4.0)),
    Parameter("Coat Tint", (1.0, 1.0, 1.0), fit=("coat", *UNIT)),
    Parameter("Thin Film Thickness", 0.0, high=100000.0, fit=("thickness", 10.0, 2000.0)),  # nanometres
    Parameter("Thin Film IOR", 1.33, low=1.0, high=1000.0, fit=("film", 1.001, 3.0)),
)
