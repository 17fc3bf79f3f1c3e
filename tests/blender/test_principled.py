"""Bakes into Blender's Principled BSDF, as Cycles renders them, against the energies that their files state.

Rationale: a loss is worth something only if it is that of the target. Files state the difference of the stack's albedo
and the bake's, by formulas that are written anew here; Cycles has its own.
"""

from __future__ import annotations

import numpy as np
import pytest
from with_cycles import NEEDED, pictures

import velatura as vt
from velatura.bakes import Bake, bake
from velatura.exports import baked

pytestmark = NEEDED

# Films on metal, bare and under a coat; a film on a dielectric; a pane; a coat over paint; a brushed metal under one
PRESETS = (
    "anodised-titanium",
    "pearlescent-paint",
    "soap-on-varnish",
    "frosted-glass",
    "varnished-paint",
    "coated-gold",
)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Bake, np.ndarray]]:
    """Bakes, and the light (3, N) that Cycles gives back of a white world."""
    folder = tmp_path_factory.mktemp("principled")
    made: dict[str, Bake] = {}
    with pytest.MonkeyPatch.context() as patch:
        for name in PRESETS:
            patch.setattr(baked, "bake", lambda *given, name=name: made.setdefault(name, bake(*given)))
            vt.export(name, "blender-principled").save(folder / f"{name}.py")
    job = {"size": 8, "spp": 1024, "seeds": [1], "cosines": made[PRESETS[0]].cos_theta}
    rendered = pictures(folder, {name: folder / f"{name}.py" for name in PRESETS}, job)
    return {name: (made[name], rendered[name].mean(axis=(1, 2)).T) for name in PRESETS}


@pytest.mark.parametrize("name", PRESETS)
def test_cycles_has_the_albedo_that_the_bake_states(name: str, found: dict[str, tuple[Bake, np.ndarray]]) -> None:
    """Expected: within .01, of light that is reflected and, in a pane's white world, that passes.

    What passes is within .025: it is summed over directions that resolve the light of the pane, not of the solid.
    """
    made, rendered = found[name]
    stated = made.baked_albedo + made.baked_passed
    print(f"{name}: {(rendered - stated).round(4).tolist()}")
    assert rendered == pytest.approx(stated, abs=0.025 if made.passed.any() else 0.01)


def test_a_pane_is_said_to_become_a_solid(found: dict[str, tuple[Bake, np.ndarray]]) -> None:
    assert any("as into a solid" in line for line in found["frosted-glass"][0].summary)
