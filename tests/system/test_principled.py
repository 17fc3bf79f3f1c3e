"""The formulas of Disney's principled BSDF, against Mitsuba's plugin."""

from __future__ import annotations

import numpy as np
import pytest

from velatura import kernel
from velatura.programs.closures import ViewAndLight
from velatura.programs.principled import formulas as principled

pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.mark.parametrize("seed", range(4))
def test_the_formulas_are_those_of_the_plugin(seed) -> None:
    mi = kernel.mitsuba()
    import drjit as dr

    rng, count = np.random.default_rng(seed), 3000
    values = {
        each.name: tuple(rng.random(3)) if each.is_colour else float(rng.random()) for each in principled.PARAMETERS
    }
    values["eta"] = 1.05 + rng.random()
    values["clearcoat_gloss"] *= 0.7  # above, single precision, which the plugin has, rounds the coat's peak
    values["roughness"] = 0.2 + 0.8 * values["roughness"]
    if seed == 0:  # as most materials are
        values |= {"spec_trans": 0.0, "sheen": 0.0}
    wi, wo = rng.normal(size=(2, 3, count))
    wi[2] = np.abs(wi[2]) + 0.05
    wi, wo = wi / np.linalg.norm(wi, axis=0), wo / np.linalg.norm(wo, axis=0)
    # Half of the pairs near the mirror direction, where clearcoats are
    wo[:, ::2] = wi[:, ::2] * [[-1], [-1], [1]] + 0.1 * wo[:, ::2]
    wo /= np.linalg.norm(wo, axis=0)

    given = {name: {"type": "rgb", "value": list(x)} if isinstance(x, tuple) else x for name, x in values.items()}
    bsdf, surface = kernel.load_dict({"type": "principled", **given}), dr.zeros(mi.SurfaceInteraction3f, count)
    surface.wi = mi.Vector3f(wi)
    plugin = np.array(bsdf.eval(mi.BSDFContext(mi.TransportMode.Importance), surface, mi.Vector3f(wo)))
    assert principled.value(values, ViewAndLight(wi, wo)) == pytest.approx(plugin, rel=3e-4, abs=1e-4)
