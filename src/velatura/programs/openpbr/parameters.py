"""Parameters of OpenPBR Surface 1.1, as its node in MaterialX has them."""

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Input

#: Inputs of the node `open_pbr_surface`; emission, opacity, normals and thin walls are no numbers of the interface.
PARAMETERS = (
    Input("base_weight", 1.0),
    Input("base_color", (0.8, 0.8, 0.8), fit=("colour", *UNIT)),
    Input("base_diffuse_roughness", 0.0, fit=("diffuse", *UNIT)),
    Input("base_metalness", 0.0, fit=("metal", *UNIT)),
    Input("specular_weight", 1.0, high=GREATEST),
    Input("specular_color", (1.0, 1.0, 1.0), fit=("tint", *UNIT)),
    Input("specular_roughness", 0.3, fit=("rough", *ROUGH)),
    Input("specular_ior", 1.5, high=GREATEST, fit=("index", 1.001, 4.0)),
    Input("specular_roughness_anisotropy", 0.0, fit=("brushed", *UNIT)),
    Input("transmission_weight", 0.0, fit=("clear", *UNIT)),
    Input("transmission_color", (1.0, 1.0, 1.0), fit=("colour", *UNIT)),
    Input("transmission_depth", 0.0, high=GREATEST),
    Input("transmission_scatter", (0.0, 0.0, 0.0)),
    Input("transmission_scatter_anisotropy", 0.0, low=-1.0),
    Input("transmission_dispersion_scale", 0.0),
    Input("transmission_dispersion_abbe_number", 20.0, high=GREATEST),
    Input("subsurface_weight", 0.0),
    Input("subsurface_color", (0.8, 0.8, 0.8)),
    Input("subsurface_radius", 1.0, high=GREATEST),
    Input("subsurface_radius_scale", (1.0, 0.5, 0.25)),
    Input("subsurface_scatter_anisotropy", 0.0, low=-1.0),
    Input("fuzz_weight", 0.0),
    Input("fuzz_color", (1.0, 1.0, 1.0)),
    Input("fuzz_roughness", 0.5),
    Input("coat_weight", 0.0),
    Input("coat_color", (1.0, 1.0, 1.0), fit=("coat", *UNIT)),
    Input("coat_roughness", 0.0),
    Input("coat_roughness_anisotropy", 0.0, fit=("brushed", *UNIT)),
    Input("coat_ior", 1.6, high=GREATEST, fit=("coat", 1.001, 3.0)),
    Input("coat_darkening", 1.0, fit=("coat", *UNIT)),
    Input("thin_film_weight", 0.0),
    Input("thin_film_thickness", 0.5, high=GREATEST, fit=("thickness", 0.01, 2.0)),  # micrometres
    Input("thin_film_ior", 1.4, high=GREATEST, fit=("film", 1.001, 3.0)),
)

#: Inputs that are vectors, by the angle in degrees by which they are turned from the tangent of the surface.
TURNS = (
    Input("geometry_tangent", 0.0, low=-180.0, high=180.0, fit=("brushed", -180.0, 180.0)),
    Input("geometry_coat_tangent", 0.0, low=-180.0, high=180.0),
)
