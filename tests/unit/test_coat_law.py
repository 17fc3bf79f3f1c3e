"""The coat law: its walks, its formula, and its graph of MaterialX."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks import benchmark
from materialx import GENERATORS, document, evaluated, generated

from velatura.optics import fresnel

PAGE = Path(__file__).parents[2] / "docs" / "explanation" / "coat.md"
coat = benchmark("coat")


@pytest.fixture(scope="module")
def walks() -> Any:
    return coat.read(coat.CSV)


@pytest.fixture(scope="module")
def graph() -> Any:
    return document(PAGE.with_name("coat-law.mtlx").read_text())


def test_every_column_is_described_and_filled(walks: Any) -> None:
    head = [line for line in coat.CSV.read_text().splitlines() if line.startswith("# ")]
    described = " ".join(head)
    for name in coat.COLUMNS:
        assert re.search(rf"\b{name.removesuffix('_se')}\b", described), name
    assert walks.sets == list(coat.SETS)
    for kind in coat.SETS:
        materials, directions = coat.drawn(kind)
        assert walks.columns["set"].count(kind) == len(materials) * len(directions)
    for name in (*coat.FOUND, *(f"{name}_se" for name in coat.FOUND)):
        assert np.all(walks.of(name) > 0)
    assert coat.CSV.stat().st_size < 700e3


def test_walks_are_repeated(walks: Any, tmp_path: Path) -> None:
    """Of a brushed material by fewer paths. Each of 40 numbers is within 4.5 standard errors: 1 in 3000 runs fails."""
    (values, *_), directions = coat.drawn("brushed")
    cosines, azimuths = zip(*directions)
    found = coat.walked(coat.stack(values).replace(name="7"), 0, 20_000, cosines, azimuths)
    first = walks.where([s == "brushed" and m == "0" for s, m in zip(walks.columns["set"], walks.columns["material"])])
    for name, parts in coat.MEASURED.items():
        theirs = np.array([first.of(f"{name}_{x}_se") for x in parts])
        assert np.all(abs(found[name] - first.of(name, parts)) < 4.5 * np.hypot(found[f"{name}_se"], theirs))


def test_the_page_prints_the_errors_on_the_walks(walks: Any) -> None:
    """Its table of the roughness and that of the energy have the mean and the 90th percentile by cosine."""
    text = PAGE.read_text()
    chosen = walks.where([name == "random" for name in walks.columns["set"]])
    rules = {"roughness": coat.BLURS, "energy": coat.ENERGIES}
    true = {"roughness": lambda found: np.log(found / chosen.alpha), "energy": lambda found: found / chosen.energy - 1}
    for quantity, named in rules.items():
        for name in set(named) - {"model velatura (fgd)", "model velatura"}:
            size = abs(true[quantity](named[name](chosen)))
            cells = []
            for cosine in coat.COSINES:
                here = size[:, chosen.cosine == cosine]
                cells.append(f"{here.mean():.3f} ({np.quantile(here, 0.9):.3f})".replace("0.", "."))
            assert f"| {' | '.join(cells)} |" in text, (quantity, name, cells)


def test_limits_of_the_law() -> None:
    """A coat of index 1 changes nothing; a smooth one widens a sharp lobe n times at normal incidence, and keeps F."""
    values = dict.fromkeys(coat.MATERIAL, 0.3) | {"coat_ior": 1.0}
    row = {**values, "cos_theta": 0.4, "phi_deg": 20.0}
    nothing = coat.Walks({name: [str(value)] for name, value in row.items()})
    np.testing.assert_allclose(coat.roughness(nothing), 0.3, rtol=1e-12)
    assert coat.kept(nothing) == 0
    sharp = {**row, "coat_ior": 1.6, "cos_theta": 1.0, "coat_alpha_u": 0.0, "coat_alpha_v": 0.0}
    sharp |= {"base_alpha_u": 0.001, "base_alpha_v": 0.001}
    smooth = coat.Walks({name: [str(value)] for name, value in sharp.items()})
    np.testing.assert_allclose(coat.roughness(smooth), 0.0016, rtol=1e-4)
    np.testing.assert_allclose(coat.kept(smooth), fresnel.dielectric(1.0, 1.6), rtol=1e-3)


def test_the_graph_has_the_values_of_the_law(walks: Any, graph: Any) -> None:
    sine = np.sqrt(1 - walks.cosine**2)
    view = np.array([sine * np.cos(walks.phi), sine * np.sin(walks.phi), walks.cosine])
    base, ones = coat.below_coat(walks), np.ones((1, len(walks.n)))
    given = {
        "viewdirection": -view,
        "normal": np.array([[0.0], [0.0], [1.0]]) * ones,
        "base_roughness": walks.base,
        "base_color": base,
        "coat_roughness": walks.coat,
        "coat_ior": walks.n,
        "coat_color": np.exp(-2 * walks.of("tau", "rgb")),
    }
    found = evaluated(graph.getNodeGraph("NG_coated_base"), given)
    np.testing.assert_allclose(found["roughness"], np.minimum(coat.roughness(walks), 1), rtol=1e-6)
    entered = 1 - fresnel.dielectric(walks.cosine, walks.n)
    expected = coat.darkened(walks, coat.kept(walks)) / (entered * base)
    np.testing.assert_allclose(found["attenuation"], expected, rtol=1e-6)


@pytest.mark.parametrize("target", GENERATORS)
def test_every_generator_makes_code_of_the_graph(graph: Any, target: str) -> None:
    assert "NG_coated_base" in generated(graph, target)
