"""Parameters of Autodesk Standard Surface 1.0, as MaterialX has it."""

from __future__ import annotations

from velatura.programs.parameters import GREATEST, Parameter

PARAMETERS = (
    Parameter("base", 1.0),
    Parameter("base_color", (0.8, 0.8, 0.8)),
    Parameter("diffuse_roughness", 0.0),
    Parameter("metalness", 0.0),
    Parameter("specular", 1.0),
    Parameter("specular_color", (1.0, 1.0, 1.0)),
    Parameter("specular_roughness", 0.2),
    Parameter("specular_IOR", 1.5, high=GREATEST),
    Parameter("specular_anisotropy", 0.0),
    Parameter("specular_rotation", 0.0),
    Parameter("transmission", 0.0),
    Parameter("transmission_color", (1.0, 1.0, 1.0)),
    Parameter("transmission_depth", 0.0, high=GREATEST),
    Parameter("transmission_scatter", (0.0, 0.0, 0.0)),
    Parameter("transmission_scatter_anisotropy", 0.0, low=-1.0),
    Parameter("transmission_dispersion", 0.0, high=GREATEST),
    Parameter("transmission_extra_roughness", 0.0, low=-1.0),
    Parameter("subsurface", 0.0),
    Parameter("subsurface_color", (1.0, 1.0, 1.0)),
    Parameter("subsurface_radius", (1.0, 1.0, 1.0), high=GREATEST),
    Parameter("subsurface_scale", 1.0, high=GREATEST),
    Parameter("subsurface_anisotropy", 0.0, low=-1.0),
    Parameter("sheen", 0.0),
    Parameter("sheen_color", (1.0, 1.0, 1.0)),
    Parameter("sheen_roughness", 0.3),
    Parameter("coat", 0.0),
    Parameter("coat_color", (1.0, 1.0, 1.0)),
    Parameter("coat_roughness", 0.1),
    Parameter("coat_anisotropy", 0.0),
    Parameter("coat_rotation", 0.0),
    Parameter("coat_IOR", 1.5, high=GREATEST),
    Parameter("coat_affect_color", 0.0),
    Parameter("coat_affect_roughness", 0.0),
    Parameter("thin_film_thickness", 0.0, high=GREATEST),  # nanometres
    Parameter("thin_film_IOR", 1.5, high=GREATEST),
    Parameter("emission", 0.0, high=GREATEST),
    Parameter("emission_color", (1.0, 1.0, 1.0)),
    Parameter("opacity", (1.0, 1.0, 1.0)),
    Parameter("thin_walled", False),
)
