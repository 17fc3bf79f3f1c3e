"""Our formulas of OpenPBR and glTF, against the code that MaterialX generates of both."""

from __future__ import annotations

import chromium
import numpy as np
import pytest
from generated_surfaces import GLTF, OPENPBR, Surface, values

from velatura.optics.directions import directions
from velatura.programs.closures import ViewAndLight

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

#: MaterialX fits the albedos that weigh the layers of OpenPBR, those of dielectrics by Schlick's formula. It differs
#: most where facets hardly reflect: below a coat of nearly the same index, and without an interface.
FITTED = ("no interface", "coat on paint", "film on paint")


@pytest.mark.parametrize("surface", [OPENPBR, GLTF], ids=lambda each: each.node)
def test_formulas_are_those_of_generated_code_without_its_departures(surface: Surface) -> None:
    rng = np.random.default_rng(5)
    wi, wo = (directions(rng.uniform(0.2, 1, 100), rng.uniform(0, 2 * np.pi, 100)).T for _ in range(2))
    with chromium.browser() as browser:
        found = values(browser, surface, wi, wo, surface.choices)
    for (name, given), generated in zip(surface.materials.items(), found):
        expected = surface.target.value(given, ViewAndLight(wi, wo))
        if surface is OPENPBR:
            np.testing.assert_allclose(
                generated, expected, rtol=0.1 if name in FITTED else 0.02, atol=1e-4, err_msg=name
            )
        elif "film" not in name:  # KHR_materials_iridescence has another formula, without polarisation
            np.testing.assert_allclose(generated, expected, rtol=1e-3, atol=1e-6, err_msg=name)
