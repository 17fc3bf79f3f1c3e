"""Parameters of OpenPBR Surface 1.1, as its node in MaterialX has them."""

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Parameter

#: Inputs of the node `open_pbr_surface`; emission, opacity, normals and thin walls are no numbers of the interface.
PARAMETERS = (
    Parameter("base_weight", 1.0),
    Parameter("base_color", (0.8, 0.8, 0.8), fit=("colour", *UNIT)),
    Parameter("base_diffuse_roughness", 0.0, fit=("diffuse", *UNIT)),
    Parameter("base_metalness", 0.0, fit=("metal", *UNIT)),
    Parameter("specular_weight", 1.0, high=GREATEST),
    Parameter("specular_color", (1.0, 1.0, 1.0), fit=("tint", *UNIT)),
    Parameter("specular_roughness", 0.3, fit=("rough", *ROUGH)),
    Parameter("specular_ior", 1.5, high=GREATEST, fit=("index", 1.001, 4.0)),
    Parameter("specular_roughness_anisotropy", 0.0, fit=("brushed", *UNIT)),
    Parameter("transmission_weight", 0.0, fit=("clear", *UNIT)),
    Parameter("transmission_color", (1.0, 1.0, 1.0), fit=("colour", *UNIT)),
    Parameter("transmission_depth", 0.0, high=GREATEST),
    Parameter("transmission_scatter", (0.0, 0.0, 0.0)),
    Parameter("transmission_scatter_anisotropy", 0.0, low=-1.0),
    Parameter("transmission_dispersion_scale", 0.0),
    Parameter("transmission_dispersion_abbe_number", 20.0, high=GREATEST),
    Parameter("subsurface_weight", 0.0),
    Parameter("subsurface_color", (0.8, 0.8, 0.8)),
    Parameter("subsurface_radius", 1.0, high=GREATEST),
    Parameter("subsurface_radius_scale", (1.0, 0.5, 0.25)),
    Parameter("subsurface_scatter_anisotropy", 0.0, low=-1.0),
    Parameter("fuzz_weight", 0.0),
    Parameter("fuzz_color", (1.0, 1.0, 1.0)),
    Parameter("fuzz_roughness", 0.5),
    Parameter("coat_weight", 0.0),
    Parameter("coat_color", (1.0, 1.0, 1.0), fit=("coat", *UNIT)),
    Parameter("coat_roughness", 0.0),
    Parameter("coat_roughness_anisotropy", 0.0, fit=("brushed", *UNIT)),
    Parameter("coat_ior", 1.6, high=GREATEST, fit=("coat", 1.001, 3.0)),
    Parameter("coat_darkening", 1.0, fit=("coat", *UNIT)),
    Parameter("thin_film_weight", 0.0),
    Parameter("thin_film_thickness", 0.5, high=GREATEST, fit=("thickness", 0.01, 2.0)),  # micrometres
    Parameter("thin_film_ior", 1.4, high=GREATEST, fit=("film", 1.001, 3.0)),
)

#: Inputs that are vectors, by the angle in degrees by which they are turned from the tangent of the surface.
TURNS = (
    Parameter("geometry_tangent", 0.0, low=-180.0, high=180.0, fit=("brushed", -180.0, 180.0)),
    Parameter("geometry_coat_tangent", 0.0, low=-180.0, high=180.0),
)
