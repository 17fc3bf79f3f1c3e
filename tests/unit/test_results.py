"""Results as they show themselves: printed in a few lines, in notebooks, as labelled arrays, and drawn."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura.results import LINES, Table, printed

HOSTILE = '<script>alert(1)</script> & "quoted" [red]'
COSINES = [1.0, 0.5]
LOBES = [{"energy": 0.04}, {"energy": 0.5, "alpha": 0.2, "base": "conductor"}]


def mixture() -> vt.Mix:
    return vt.Mix([(0.25, "frosted-glass"), (None, vt.preset("coated-gold"))])


def table_of(count: int) -> vt.inverse.ReflectanceTable:
    angles = np.linspace(0.0, 60.0, count)
    directions = vt.inverse.Directions.of(angles, angles, np.full(count, 180.0))
    return vt.inverse.table_of("coated-gold", directions, "bati2021")


RESULTS: dict[str, Callable[[], Any]] = {
    "stack": lambda: vt.preset("coated-gold"),
    "many layers": lambda: vt.Stack([{"interface": {"eta": 1.3 + 0.01 * n}} for n in range(40)]),
    "mixture": mixture,
    "lobes": lambda: vt.lobes("coated-gold", np.linspace(0.1, 1.0, 50)),
    "lobes of a mixture": lambda: vt.lobes(mixture(), COSINES),
    "statistics": lambda: vt.reference.statistics("coated-gold", COSINES, paths=100),
    "distribution": lambda: vt.reference.distribution("coated-gold", 0.7, paths=100),
    "stokes": lambda: vt.reference.stokes("coated-gold", 0.7, paths=100),
    "comparison": lambda: vt.compare("coated-gold", ["belcour2018"], [0.7], paths=100),
    "report": lambda: vt.check("coated-gold", "belcour2018"),
    "coat": lambda: vt.inverse.coat("coated-gold", 1.3),
    "table": lambda: table_of(40),
    "fit": lambda: vt.inverse.fit(table_of(12), ["coated-gold"], "bati2021"),
    "solution": lambda: vt.inverse.invert_stack(LOBES, "bati2021"),
    "model": lambda: vt.MODELS[-1],
    "bsdf": lambda: vt.bsdf("coated-gold"),
    "shader": lambda: vt.shader.shader("coated-gold"),
    "export": lambda: vt.export("coated-gold", "glsl"),
    "imported": lambda: vt.from_openpbr(base_metalness=0.5, specular_roughness=0.2, subsurface_weight=0.3),
    "bake": lambda: vt.bakes.bake("coated-gold", "gltf"),
    "directions": lambda: table_of(3).directions,
    "interface": lambda: vt.Interface(eta=1.5, films=(vt.Film(eta=1.46, thickness_nm=320),)),
    "film": lambda: vt.Film(eta=1.46, thickness_nm=320),
    "medium": lambda: vt.Medium(sigma_s=1.0),
    "diffuse base": lambda: vt.Diffuse(albedo=0.5),
    "texture": lambda: vt.Texture(texture=Path(vt.__file__).parent / "stack" / "presets" / "wear.png"),
    "spectrum": lambda: vt.Spectrum(spectrum=[[nm, 0.5] for nm in np.linspace(400, 700, 1000)]),
    "substance": lambda: vt.Substance(refractiveindex="main/Au/Johnson"),
    "pigment": lambda: vt.Pigment(K=[0.1, 0.2, 2.0], S=1.0),
    "axis": lambda: vt.Axis(values=list(np.linspace(0.1, 0.9, 1000))),
    "space": lambda: vt.Space(material=mixture(), vary={"part0_layer0_alpha": {"range": [0.1, 0.5], "steps": 3}}),
}
#: Of `RESULTS`, by the class that it is of: those that a star import gives.
PUBLIC: dict[type, str] = {vt.Interface: "interface", vt.Film: "film", vt.Medium: "medium", vt.Diffuse: "diffuse base"}
PUBLIC |= {vt.Texture: "texture", vt.Spectrum: "spectrum", vt.Substance: "substance", vt.Pigment: "pigment"}
PUBLIC |= {vt.Stack: "stack", vt.Mix: "mixture", vt.Model: "model", vt.Axis: "axis", vt.Space: "space"}


@pytest.mark.parametrize("name", RESULTS)
def test_every_result_is_printed_in_a_few_lines(name: str) -> None:
    text = repr(RESULTS[name]())
    assert 0 < len(text.splitlines()) <= LINES
    assert len(text) < 5000


def test_every_public_class_is_printed_here() -> None:
    public = {getattr(vt, name) for name in vt.__all__}
    classes = {each for each in public if isinstance(each, type) and not issubclass(each, Exception)}
    assert set(PUBLIC) == classes
    assert all(isinstance(RESULTS[name](), each) for each, name in PUBLIC.items())


@pytest.mark.parametrize("name", ["coat", "imported", "bake", "lobes", "fit"])
def test_a_result_fits_into_a_terminal(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: no line is wider than the terminal, which would break it, and no more lines than elsewhere."""
    found = RESULTS[name]()
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    lines = repr(found).splitlines()
    assert max(map(len, lines)) <= 80 and len(lines) <= LINES


def test_a_repr_shows_nothing_in_a_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rationale: Rich sends what it prints to a notebook, which then has an empty output beside the result's own."""
    sent: list[Any] = []
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    monkeypatch.setattr("rich.jupyter.display", lambda *given: sent.append(given))
    assert "R2" in repr(RESULTS["lobes of a mixture"]()) and sent == []


def test_a_stack_reads_as_its_repr() -> None:
    stack = vt.preset("coated-gold")
    assert eval(repr(stack), {**vars(vt), "Stack": vt.Stack, "Interface": vt.Interface, "Medium": vt.Medium}) == stack
    text = str(stack)
    assert "Coated brushed gold" in text
    assert "conductor Au, alpha [0.1, 0.3], rotation 30" in text


def test_lobes_know_their_directions() -> None:
    found = vt.lobes("coated-gold", COSINES, phi=[0.3, 2.0])
    assert np.allclose(found.cos_theta, COSINES, rtol=0, atol=1e-15)
    assert found.phi[1] == pytest.approx(2.0)
    assert list(found.named) == ["R1", "R2"]
    assert list(vt.lobes(mixture(), 1.0).named) == ["part0 R1", "part0 R2", "part0 T", "part1 R1", "part1 R2"]


@pytest.mark.parametrize("material", ["coated-gold", "mixture"])
def test_lobes_as_labelled_arrays_are_the_same_numbers(material: str) -> None:
    found = vt.lobes(mixture() if material == "mixture" else material, COSINES)
    data, frame = found.to_xarray(), found.to_dataframe()
    name = list(found.named)[-1]
    lobe = found.named[name]
    assert np.array_equal(data.energy.sel(lobe=name), lobe.energy)
    assert np.array_equal(data.alpha.sel(lobe=name, axis="v"), lobe.alpha[1])
    assert np.array_equal(data.cos_theta, COSINES)
    total = data.energy.sum("lobe") + data.remainder + data.absorbed
    assert np.allclose(total, 1, rtol=0, atol=1e-9)
    rows = frame[frame.lobe == name]
    assert np.array_equal(rows.energy_g, lobe.energy[1])
    assert np.array_equal(rows.alpha_u, lobe.alpha[0])
    assert len(frame) == len(found.named) * len(COSINES)


def test_lobes_of_separate_channels_are_arrays_but_no_rows() -> None:
    found = vt.lobes("coated-gold", COSINES, model="belcour2018", channels="separate")
    assert found.to_xarray().alpha.dims == ("lobe", "channel", "axis", "direction")
    with pytest.raises(vt.InvalidInput, match=r"to_xarray\(\)"):
        found.to_dataframe()


def test_plots_return_axes_of_matplotlib() -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    lobes, report = vt.lobes("frosted-glass", COSINES), vt.check("coated-gold", "belcour2018")
    energy, alpha = lobes.plot()
    legend = energy.get_legend()
    assert legend is not None and [text.get_text() for text in legend.get_texts()] == ["R1", "R2", "T", "remainder"]
    assert len(alpha.lines) == 2 * 3
    solution, table = vt.inverse.invert_stack(LOBES, "bati2021"), table_of(12)
    assert [axes.get_title() for axes in solution.plot().axes] == ["lobe 1: one dielectric", "lobe 2: one conductor"]
    found = vt.inverse.fit(table, ["coated-gold"], "bati2021").plot(table, "gold")
    assert found.get_suptitle().startswith("gold: the closest stack, by bati2021")
    bars = report.plot()
    assert [label.get_text() for label in bars.get_yticklabels()] == [each.law for each in report.findings]
    own = pyplot.figure().subplots()
    assert report.plot(own) is own
    pyplot.close("all")


def test_names_in_notebooks_are_text() -> None:
    stack = vt.preset("coated-gold").replace(name=HOSTILE)
    for material in (stack, vt.Mix([(0.5, stack), (None, stack)])):
        drawing = ElementTree.fromstring(material._repr_html_())
        texts = [element.text for element in drawing.iter("{http://www.w3.org/2000/svg}text")]
        assert any(HOSTILE in (text or "") for text in texts)
        assert not list(drawing.iter("{http://www.w3.org/2000/svg}script"))
    table = ElementTree.fromstring(Table(HOSTILE, [HOSTILE], [[HOSTILE]]).html())
    assert [element.text for element in table.iter() if element.text] == [HOSTILE] * 3


def test_markup_in_a_name_is_printed_as_it_is() -> None:
    assert "[red]" in str(vt.preset("coated-gold").replace(name=HOSTILE))
    assert "[red]" in printed([Table("[red]", ["a"], [["b"]])])


def test_every_preset_has_a_drawing() -> None:
    for name in vt.presets():
        material = vt.preset(name)
        drawing = ElementTree.fromstring(material._repr_html_())
        bands = list(drawing.iter("{http://www.w3.org/2000/svg}polygon"))
        assert len(bands) >= 2 * len(list(material.leaves()))


def test_a_page_is_drawn_where_mitsuba_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")

    def missing(*_: Any, **__: Any) -> None:
        raise vt.MissingTool("Mitsuba is not installed: run `pip install mitsuba`")

    monkeypatch.setattr("velatura.api.render", missing)
    stack = vt.preset("coated-gold").replace(name="$x_$ [red] </svg>")
    for material in (stack, vt.Mix([(0.3, stack), (None, "frosted-glass")])):
        path = tmp_path / "page.svg"
        figure = vt.show(material, path)
        ElementTree.fromstring(path.read_text())
        ball = next(
            axes
            for part in figure.subfigs
            for axes in part.axes
            if axes.texts and "Mitsuba" in axes.texts[0].get_text()
        )
        assert not ball.images


def test_a_page_that_cannot_be_written_is_refused_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("velatura.api.lobes", lambda *_, **__: pytest.fail("began"))
    for name in ("page.txt", "no/page.png"):
        with pytest.raises(vt.InvalidInput):
            vt.show("coated-gold", tmp_path / name)
