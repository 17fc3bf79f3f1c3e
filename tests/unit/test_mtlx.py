"""Lobes as a graph of MaterialX: it is valid, and every generator makes code of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from materialx import GENERATORS, document, generated

import velatura as vt
from velatura.model import named
from velatura.shader.closures import tabulated
from velatura.shader.polynomials import Fit
from velatura.stack import Material


@pytest.mark.parametrize(("preset", "model"), [("frosted-metal", "weier2020"), ("coated-gold", "weier2020")])
def test_all_generators_make_code_of_the_graph(preset: str, model: str) -> None:
    """A reflection for each lobe that has light; only the reflections of genosl have other weights."""
    text = vt.export(preset, "mtlx", model).text
    made = document(text)
    assert len(made.getMaterialNodes()) == 1
    for target in GENERATORS:
        assert "velatura_lobes" in generated(made, target), target
    osl = generated(made, "osl")
    lobes = tabulated(Material.of(vt.preset(preset)), named(model)).kinds.count("reflection")
    body = osl.split("NG_velatura_lobes", 1)[1].split("\n}\n")[0]
    assert body.count("mx_generalized_schlick_bsdf(") == lobes


@pytest.mark.parametrize(("preset", "off"), [("frosted-metal", 0.01), ("turned-brushing", 0.1)])
def test_polynomials_are_the_columns_that_they_stand_for(preset: str, off: float) -> None:
    """Weights within .01; roughness too, but of brushed lobes, which changes fast at some azimuths."""
    baked = tabulated(Material.of(vt.preset(preset)), named("velatura"))
    cosine, phi = np.meshgrid(np.linspace(0.2, 0.98, 9), np.linspace(0, 3, 7), indexing="ij")
    sine = np.sqrt(1 - cosine**2)
    wi = tuple(x.ravel() for x in (sine * np.cos(phi), sine * np.sin(phi), cosine))
    for a, b in zip(Fit(baked).above(wi), baked.above(wi)):
        np.testing.assert_allclose(a.weight, b.weight, atol=0.01)
        np.testing.assert_allclose(np.sort(a.roughness[:2], 0), np.sort(b.roughness[:2], 0), atol=off)


def test_what_a_graph_cannot_hold_is_refused_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "rough.png").touch()
    textured = vt.Stack([vt.Interface(conductor="Au", alpha={"texture": str(tmp_path / "rough.png")})])
    with pytest.raises(vt.InvalidInput, match="mtlx: only for uniform materials"):
        vt.export(textured, "mtlx")
    with pytest.raises(vt.InvalidInput, match="mtlx: only for materials that no light passes"):
        vt.export("frosted-glass", "mtlx")
