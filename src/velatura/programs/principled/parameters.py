"""Parameters of Mitsuba's `principled`."""

from __future__ import annotations

from velatura.programs.parameters import GREATEST, Parameter

#: Of the plugin; its index is `eta` here, for which `specular` is another name.
PARAMETERS = (
    Parameter("base_color", (0.5, 0.5, 0.5)),
    Parameter("roughness", 0.5),
    Parameter("anisotropic", 0.0),
    Parameter("metallic", 0.0),
    Parameter("spec_trans", 0.0),
    Parameter("eta", 1.5, low=1.0, high=GREATEST),
    Parameter("spec_tint", 0.0),
    Parameter("sheen", 0.0),
    Parameter("sheen_tint", 0.0),
    Parameter("flatness", 0.0),
    Parameter("clearcoat", 0.0),
    Parameter("clearcoat_gloss", 0.0),
)
