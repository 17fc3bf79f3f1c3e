"""Parameters of Mitsuba's `principled`."""

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Parameter

#: Parameters of the plugin; its index is `eta` here, for which `specular` is another name.
PARAMETERS = (
    Parameter("base_color", (0.5, 0.5, 0.5), fit=("colour", *UNIT)),
    Parameter("roughness", 0.5, fit=("rough", *ROUGH)),
    Parameter("anisotropic", 0.0, fit=("brushed", *UNIT)),
    Parameter("metallic", 0.0, fit=("metal", *UNIT)),
    Parameter("spec_trans", 0.0, fit=("clear", *UNIT)),
    Parameter("eta", 1.5, low=1.0, high=GREATEST, fit=("index", 1.001, 4.0)),
    Parameter("spec_tint", 0.0, fit=("tint", *UNIT)),
    Parameter("sheen", 0.0),
    Parameter("sheen_tint", 0.0),
    Parameter("flatness", 0.0, fit=("diffuse", *UNIT)),
    Parameter("clearcoat", 0.0, fit=("coat", *UNIT)),
    Parameter("clearcoat_gloss", 0.0, fit=("coat", *UNIT)),
)
