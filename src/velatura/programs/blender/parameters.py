"""Inputs of Blender's Principled BSDF."""

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Input

#: Inputs of the node by their names; colours have a fourth component there, which is 1.
PARAMETERS = (
    Input("Base Color", (0.8, 0.8, 0.8), fit=("colour", *UNIT)),
    Input("Metallic", 0.0, fit=("metal", *UNIT)),
    Input("Roughness", 0.5, fit=("rough", *ROUGH)),
    Input("IOR", 1.5, low=1.0, high=1000.0, fit=("index", 1.001, 4.0)),
    Input("Diffuse Roughness", 0.0, fit=("diffuse", *UNIT)),
    Input("Specular IOR Level", 0.5),
    Input("Specular Tint", (1.0, 1.0, 1.0), high=GREATEST, fit=("tint", *UNIT)),
    Input("Anisotropic", 0.0, fit=("brushed", *UNIT)),
    Input("Anisotropic Rotation", 0.0, fit=("brushed", -1.0, 2.0)),  # of a whole turn
    Input("Transmission Weight", 0.0, fit=("clear", *UNIT)),
    Input("Coat Weight", 0.0),
    Input("Coat Roughness", 0.03),
    Input("Coat IOR", 1.5, low=1.0, high=4.0, fit=("coat", 1.001, 4.0)),
    Input("Coat Tint", (1.0, 1.0, 1.0), fit=("coat", *UNIT)),
    Input("Thin Film Thickness", 0.0, high=100000.0, fit=("thickness", 10.0, 2000.0)),  # nanometres
    Input("Thin Film IOR", 1.33, low=1.0, high=1000.0, fit=("film", 1.001, 3.0)),
)
