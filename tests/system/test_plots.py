"""Labels of pictures: the material, and the axes.

Rationale: a plot is looked at away from the command that made it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

import velatura as vt
from velatura.comparison import plugins

Run = Callable[..., tuple[int, str, str]]

TARGET = """name: Hazy metal
lobes:
  - {energy: [0.09, 0.09, 0.15], variance: 0.03, interfaces: 2}
  - {energy: [0.05, 0.02, 0.03], variance: 0.06}
  - {energy: 0.1, variance: 0.12, base: conductor}
"""


@pytest.fixture
def drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that are saved, in a working folder with a target."""
    monkeypatch.chdir(tmp_path)
    Path("target.yaml").write_text(TARGET)
    figures: list[Figure] = []
    save = Figure.savefig

    def saved(figure: Figure, *arguments: Any, **options: Any) -> None:
        figures.append(figure)
        save(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", saved)
    return figures


def title(figure: Figure) -> str:
    return " ".join(figure.get_suptitle().split())


def test_classes_have_axes_and_a_legend(run: Run, drawn: list[Figure]) -> None:
    """Expected: a panel for each lobe, with its interfaces, what is on the axes, which member was chosen, and what else
    is free, with its range."""
    status, _, err = run("invert", "target.yaml", "--plot")
    assert (status, err) == (0, "")
    (figure,) = drawn
    assert title(figure) == "Hazy metal: what gives each lobe, by velatura"
    titles = ["a pair that ends in a dielectric", "one dielectric", "one conductor"]
    assert [axes.get_title() for axes in figure.axes] == [f"lobe {n}: {text}" for n, text in enumerate(titles, 1)]
    labels, others = zip(*(axes.get_xlabel().partition("\n")[::2] for axes in figure.axes))
    assert labels == ("eta of the upper interface", "eta", "eta")
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "eta of the lower one",
        "optical depth of the medium above",
        "k",
    ]
    assert (
        others[0].startswith("also free: tau_0 0 to [") and others[1] == "" and others[2].startswith("also free: tau_0")
    )
    for axes in figure.axes:
        legend = axes.get_legend()
        assert legend and any(text.get_text().startswith("chosen") for text in legend.get_texts())


def test_a_fit_is_drawn_beside_its_table(run: Run, drawn: list[Figure]) -> None:
    """Expected: a panel for each angle of incidence, then the parameters by name, and those that trade places."""
    rows = [f"{i},{o},180,{r},{r},{r}" for i in (0, 40) for o, r in ((0, 0.2), (30, 0.1), (40, 0.3), (60, 0.05))]
    Path("table.csv").write_text("\n".join(["theta_i,theta_o,phi,r,g,b", *rows]))
    Path("one.yaml").write_text("name: Satin\nlobes:\n  - {energy: 0.1, alpha: 0.2}\n")
    status, out, err = run("fit", "table.csv", "one.yaml", "--plot", "--starts", "1", "--model", "bati2021")
    assert (status, err, out.splitlines()[-1]) == (0, "", "table.png")
    (figure,) = drawn
    assert title(figure).startswith("Satin: the closest stack, by bati2021, error 0.0")
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[:3] == ["incidence at 0°", "incidence at 40°", "parameters"] and "trade places" in titles[3]
    assert figure.axes[0].get_xlabel() == "tilt of the half-vector (degrees)"
    assert figure.axes[0].get_legend() is not None
    names = [tick.get_text().split(" = ")[0] for tick in figure.axes[2].get_yticklabels()]
    assert names == ["layer0_alpha", "layer0_eta"]


def test_a_sheet_names_its_stacks(run: Run, drawn: list[Figure]) -> None:
    """Expected: the target, the model, what the differences are; under each sphere its indices and difference."""
    status, _, err = run("explore", "target.yaml", "--count", "2", "--sheet", "--size", "16", "--spp", "1")
    assert (status, err) == (0, "")
    (figure,) = drawn
    assert title(figure).startswith(
        "Hazy metal: stacks with the same lobes head-on, by velatura. Difference from the first"
    )
    assert "difference 0.000" in figure.axes[0].get_title()
    assert all(axes.get_title().startswith("eta ") for axes in figure.axes)


def test_a_comparison_has_one_legend_beside_the_plots(
    run: Run, drawn: list[Figure], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: every plot says its axes; bars stay below their legend; a plugin has its colour too."""
    monkeypatch.setattr(plugins, "SAMPLES", 2**12)
    arguments = ("--models", "belcour2018,diffuse", "--cos", "1,0.5", "--paths", "1000", "--plot", "both.png")
    assert run("compare", "bare-gold", *arguments)[0] == 0
    (figure,) = drawn
    assert title(figure).startswith("Gold: models against the truth")
    above, below = figure.subfigs
    (legend,) = above.legends
    assert [text.get_text() for text in legend.get_texts()] == ["belcour2018", "diffuse", "truth"]
    for axes in (above.axes[0], above.axes[1], below.axes[0], below.axes[1]):
        assert axes.get_ylabel()
    bars = below.axes[0]
    assert bars.get_ylim()[1] > 1.2 * bars.dataLim.y1


def test_a_broken_law_says_whose_it_is(drawn: list[Figure]) -> None:
    """Expected: the material and the model above, and axes that say what they are."""
    report = vt.check("bare-gold", model="weidlich_wilkie", expected="coated-gold", plots=".")
    assert report.broken == ("limit",)
    (figure,) = drawn
    assert title(figure).startswith("Gold (weidlich_wilkie) limit: ")
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("f expected", "f times solid angle")
