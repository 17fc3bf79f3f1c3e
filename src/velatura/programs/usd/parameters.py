"""Parameters of UsdPreviewSurface (https://openusd.org/release/spec_usdpreviewsurface.html, version 2.6)."""

from velatura.programs.parameters import GREATEST, ROUGH, UNIT, Input

#: In the metallic workflow. `opacity` is, of the light that the interface passes, the share that goes no further.
PARAMETERS = (
    Input("diffuseColor", (0.18, 0.18, 0.18), fit=("colour", *UNIT)),
    Input("metallic", 0.0, fit=("metal", *UNIT)),
    Input("roughness", 0.5, fit=("rough", *ROUGH)),
    Input("ior", 1.5, high=GREATEST, fit=("index", 1.001, 4.0)),
    Input("clearcoat", 0.0),
    Input("clearcoatRoughness", 0.01),
    Input("opacity", 1.0, fit=("clear", *UNIT)),
)
