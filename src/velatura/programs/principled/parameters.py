"""Parameters of Mitsuba's `principled`."""

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Input

#: Parameters of the plugin; its index is `eta` here, for which `specular` is another name.
PARAMETERS = (
    Input("base_color", (0.5, 0.5, 0.5), fit=("colour", *UNIT)),
    Input("roughness", 0.5, fit=("rough", *ROUGH)),
    Input("anisotropic", 0.0, fit=("brushed", *UNIT)),
    Input("metallic", 0.0, fit=("metal", *UNIT)),
    Input("spec_trans", 0.0, fit=("clear", *UNIT)),
    Input("eta", 1.5, low=1.0, high=GREATEST, fit=("index", 1.001, 4.0)),
    Input("spec_tint", 0.0, fit=("tint", *UNIT)),
    Input("sheen", 0.0),
    Input("sheen_tint", 0.0),
    Input("flatness", 0.0, fit=("diffuse", *UNIT)),
    Input("clearcoat", 0.0, fit=("coat", *UNIT)),
    Input("clearcoat_gloss", 0.0, fit=("coat", *UNIT)),
)
