"""The plugin `openpbr`, against `layered` of the stack that an import makes of the same parameters."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.errors import Incomplete
from velatura.stack import dumps

pytestmark = pytest.mark.usefixtures("one_thread")

mi: Any = kernel.mitsuba("scalar_rgb")
vt.register()

RED = [0.6, 0.2, 0.1]
SURFACES: dict[str, dict[str, Any]] = {
    "paint": {"base_color": RED, "specular_roughness": 0.4},
    "coated": {"base_color": RED, "coat_weight": 1.0, "coat_color": [0.9, 0.7, 0.5], "coat_roughness": 0.2},
    "half metal": {"base_color": RED, "base_metalness": 0.5, "specular_roughness_anisotropy": 0.5},
    "pane": {"transmission_weight": 1.0, "geometry_thin_walled": True, "specular_ior": 1.4},
}


@pytest.fixture(autouse=True)
def scalar() -> Any:
    before = mi.variant()
    mi.set_variant("scalar_rgb")
    yield
    mi.set_variant(before)


def in_mitsuba(values: dict[str, Any]) -> dict[str, Any]:
    """Colours as Mitsuba has them."""
    return {name: {"type": "rgb", "value": x} if isinstance(x, list) else x for name, x in values.items()}


def xml(values: dict[str, Any]) -> str:
    """The BSDF in a scene file."""
    kinds = {list: "rgb", bool: "boolean", float: "float"}
    texts = {name: str(x).strip("[]").lower() for name, x in values.items()}
    inside = "".join(f'<{kinds[type(x)]} name="{name}" value="{texts[name]}"/>' for name, x in values.items())
    return f'<bsdf version="3.0.0" type="openpbr">{inside}</bsdf>'


@pytest.mark.parametrize("name", SURFACES)
def test_it_is_layered_of_the_imported_stack(name: str) -> None:
    """Expected: the same values and components, from a dictionary and from a file, and the same light."""
    values = SURFACES[name]
    stack = vt.from_openpbr(**values).stack
    layered = mi.load_dict({"type": "layered", "material": dumps(stack, "json"), "model": "belcour2018"})
    loaded = mi.load_dict({"type": "openpbr", "model": "belcour2018", **in_mitsuba(values)})
    written = mi.load_string(xml({**values}).replace("</bsdf>", '<string name="model" value="belcour2018"/></bsdf>'))
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0.6, 0.0, 0.8)
    si.sh_frame = mi.Frame3f(mi.Vector3f(0, 0, 1))
    wo = mi.Vector3f(-0.5, 0.1, np.sqrt(0.74))
    for bsdf in (loaded, written):
        assert str(bsdf).splitlines()[1:] == str(layered).splitlines()[1:]
        assert bsdf.flags() == layered.flags() and bsdf.component_count() == layered.component_count()
        ctx = mi.BSDFContext()
        assert np.array_equal(bsdf.eval(ctx, si, wo), layered.eval(ctx, si, wo))


def test_what_is_left_is_said_and_options_are_those_of_layered() -> None:
    with pytest.warns(Incomplete, match=r"openpbr: fuzz_weight 0\.3: a stack has no fibres above it: left out"):
        mi.load_dict({"type": "openpbr", "fuzz_weight": 0.3})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = mi.load_dict({"type": "openpbr", "model": "belcour2018", "tir": "off"})
    assert "model = belcour2018" in str(made) and "tir = off" in str(made)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"base_colour": 0.3}, r"openpbr: unknown parameter 'base_colour' \(did you mean base_color\?\)"),
        ({"base_color": "red"}, r"openpbr: base_color: must be a number or \[r, g, b\], got 'red'"),
        (
            {"base_color": {"type": "checkerboard"}},
            "openpbr: base_color: must be a number, or a colour in a variant of RGB",
        ),
        ({"model": "x"}, "unknown model 'x'"),
        ({"material": "bare-gold"}, "openpbr: unknown parameter 'material'"),
    ],
)
def test_other_parameters_are_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(vt.InvalidInput, match=message):
        kernel.load_dict({"type": "openpbr", **values})
