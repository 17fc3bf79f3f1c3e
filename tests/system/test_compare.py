"""Comparisons with the truth: cases whose answer is known, the forms that results take, and bad input."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tmm

import velatura as vt
from velatura.comparison import Comparison, Pictures, save_figure
from velatura.errors import InvalidInput
from velatura.stack import Diffuse, Interface, Medium, Stack

pytestmark = pytest.mark.usefixtures("one_thread")

Run = Callable[..., tuple[int, str, str]]

PLAIN = {"reflectance": "fresnel", "tir": "off"}
METAL = Interface(eta=0.2, k=3.9, alpha=0.2)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few samples of lobes, and few pixels, of which only the form is looked at."""
    for name in ("SAMPLES", "LIT_SAMPLES", "BASE_SAMPLES"):
        monkeypatch.setattr(f"velatura.comparison.evaluated_lobes.{name}", 2**12)
    monkeypatch.setattr("velatura.comparison.pictures.SIZE", (24, 16))
    monkeypatch.setattr("velatura.comparison.pictures.SAMPLES", 8)


def one_model(found: Comparison) -> str:
    (name,) = found.models
    return name


# Numbers that are known


def test_roughness_of_a_mirror_under_a_smooth_coat() -> None:
    """A known defect: the model's map gives alpha .144 at normal incidence, and the walk .155."""
    stack = Stack([Interface(eta=1.5), Interface(conductor="mirror", alpha=0.1)])
    found = vt.compare(stack, ["belcour2018"], [1.0], paths=200_000, microsurface=False, **PLAIN)
    truth, model = found.truth.reflected[1], found.models["belcour2018"].reflected[1]
    np.testing.assert_allclose(truth.alpha, 0.155, atol=1e-3)
    np.testing.assert_allclose(model.alpha, 0.144, atol=5e-4)
    assert found.standard_error[1].alpha.max() < 1e-3
    # The first lobe is smooth and right, so the mean over both is half of the second one's error
    assert found.roughness_error["belcour2018"] == pytest.approx(np.log(0.155 / 0.144) / 2, abs=4e-3)
    assert found.truth.reflected[0].energy[0, 0] == pytest.approx(0.04, abs=5 * found.standard_error[0].energy[0, 0])


def test_a_single_interface_is_near_the_truth() -> None:
    """One GGX lobe of the interface's own roughness is exact but for Fresnel at the mean direction."""
    found = vt.compare(Stack([METAL]), ["belcour2018"], [1.0, 0.6], paths=200_000, microsurface=False, **PLAIN)
    name = one_model(found)
    truth, model = found.truth.reflected[0], found.models[name].reflected[0]
    assert np.all(np.abs(truth.alpha - 0.2) < 5 * found.standard_error[0].alpha)
    np.testing.assert_allclose(model.alpha, 0.2, atol=1e-9)
    # What is evaluated is what single scattering leaves, in its energy, its moments and its distribution
    np.testing.assert_allclose(found.models[name].evaluated, found.truth.albedo, atol=5e-3)
    np.testing.assert_allclose(model.mean, truth.mean, atol=6e-3)
    np.testing.assert_allclose(model.covariance, truth.covariance, atol=6e-3)
    assert np.all(found.total_variation[name] < found.noise + 5e-3)


def test_an_account_compared_with_itself_differs_by_nothing() -> None:
    found = vt.compare(Stack([METAL]), ["belcour2018"], [0.5], paths=20_000)
    name = one_model(found)
    same = dataclasses.replace(found, models={name: found.truth})
    assert same.total_variation[name] == [0] and same.roughness_error[name] == 0
    # A model that reflects nothing has misplaced half, as energies count
    dark = dataclasses.replace(found.truth, distribution=np.zeros_like(found.truth.distribution))
    assert dataclasses.replace(found, models={name: dark}).total_variation[name] == [0.5]


def test_noise_tells_how_two_truths_differ() -> None:
    """The model's distribution is exact to much less than the noise; that of the same truth by other random numbers is
    off by the noise times the square root of two."""
    stack = Stack([Interface(eta=1.5, alpha=0.3), METAL])
    one, other = (vt.compare(stack, ["belcour2018"], [0.7], paths=50_000, seed=seed) for seed in (1, 5))
    apart = dataclasses.replace(one, models={"other": other.truth}).total_variation["other"]
    np.testing.assert_allclose(apart, np.sqrt(2) * one.noise, rtol=0.1)


def test_roughness_is_told_along_the_true_axes() -> None:
    """Brushed along the tangent or across it is the same roughness with its axes exchanged, and no error."""
    turned = Interface(eta=0.2, k=3.9, alpha=(0.1, 0.3), rotation=90)
    found = vt.compare(Stack([turned]), ["belcour2018"], [1.0], paths=100_000, **PLAIN)
    assert found.roughness_error["belcour2018"] < 0.02
    np.testing.assert_allclose(sorted(found.models["belcour2018"].reflected[0].alpha[:, 0]), [0.1, 0.3], atol=0.01)


def test_a_diffuse_base_and_what_is_transmitted_have_their_lobes() -> None:
    painted = vt.compare(Stack([Interface(eta=1.5), Diffuse(albedo=0.5)]), None, [0.8], paths=50_000)
    assert painted.lobe_names == ("R1", "D")
    account = painted.models["belcour2018"]
    np.testing.assert_allclose(account.reflected[1].energy, painted.truth.reflected[1].energy, atol=0.02)
    np.testing.assert_allclose(account.evaluated, account.albedo, atol=2e-3)
    np.testing.assert_allclose(account.reflected[1].covariance, painted.truth.reflected[1].covariance, atol=0.01)

    slab = [Interface(eta=1.5), Medium(sigma_a=(0.1, 0.2, 0.3)), Interface(eta=1.0, alpha=0.03)]
    pane = vt.compare(Stack(slab), ["belcour2018"], [0.8], paths=50_000, **PLAIN)
    assert pane.lobe_names == ("R1", "R2", "T")
    below = [account.transmitted[0] for account in (pane.truth, pane.models["belcour2018"])]
    np.testing.assert_allclose(below[0].energy, below[1].energy, atol=0.02)
    np.testing.assert_allclose(below[0].mean, [[-0.6], [0]], atol=0.02)
    np.testing.assert_allclose(below[1].mean, [[-0.6], [0]], atol=0.02)


# Plugins beside the models


def test_a_plugin_of_the_same_metal_is_the_truth(tmp_path: Path) -> None:
    """Mitsuba's rough conductor and the walk are that metal, by name, dict and file; of lobes they say nothing."""
    path = tmp_path / "mine.xml"
    values = "".join(f'<float name="{k}" value="{v}"/>' for k, v in {"eta": 0.2, "k": 3.9, "alpha": 0.2}.items())
    path.write_text(
        f'<bsdf version="3.0.0" type="roughconductor"><string name="distribution" value="ggx"/>{values}</bsdf>'
    )
    plain = {"type": "roughconductor", "distribution": "ggx", "eta": 0.2, "k": 3.9, "alpha": 0.2, "id": "as a dict"}
    found = vt.compare(Stack([METAL]), ["reference", plain, path], [0.8], paths=100_000, microsurface=False)
    assert list(found.models) == ["reference", "as a dict", "mine"]
    for name, account in found.models.items():
        np.testing.assert_allclose(account.evaluated, found.truth.albedo, atol=5e-3)
        assert found.total_variation[name] < found.noise + 0.015
        assert np.isnan(found.roughness_error[name]) and np.isnan(account.albedo).all()
        assert found.to_dict()["models"][name]["lobes"]["R1"]["energy"] == [[None] * 3]


def test_the_baseline_is_further_from_the_truth_than_the_model(run: Run, tmp_path: Path) -> None:
    """As Belcour 2018 compares them, on frosted metal; what the baseline has no value for is a dash."""
    plot = str(tmp_path / "both.png")
    arguments = ("compare", "frosted-metal", "--models", "velatura,weidlich_wilkie", "--paths", "50000", "--cos", "1")
    status, out, err = run(*arguments, "--plot", plot)
    assert (status, err) == (0, "")
    *_, model, baseline, _ = (line.replace("│", " ").split() for line in out.splitlines())
    assert (model[0], baseline[:2]) == ("velatura", ["weidlich_wilkie", "-"])
    assert float(baseline[2]) > 3 * float(model[2])


def test_what_leaving_out_polarisation_costs() -> None:
    """Both truths against the exact sums for a smooth stack, 2 over 1 + 1i: with polarisation that of `tmm`, and
    without it 3.5 % more at 60 degrees."""
    stack = Stack([Interface(eta=2.0), Interface(eta=1.0, k=1.0)])
    reports: list[tuple[int, int]] = []
    found = vt.compare(
        stack, ["velatura"], [1.0, 0.5], 100_000, polarised=True, progress=lambda *at: reports.append(at)
    )
    assert reports[-1] == (12, 12) and found.polarised and list(found.models) == ["velatura", "unpolarised"]
    exact = [
        np.mean(
            [
                tmm.inc_tmm(kind, [1, 2, 1 + 1j], [np.inf, 1e6, np.inf], ["i"] * 3, np.arccos(c), 500)["R"]
                for kind in "sp"
            ]
        )
        for c in found.cos_theta
    ]
    np.testing.assert_allclose(found.truth.albedo[0], exact, atol=4.5 * found.albedo_error.max())
    ratio = found.models["unpolarised"].albedo[0] / found.truth.albedo[0]
    np.testing.assert_allclose(ratio, [1, 1.035], atol=0.006)
    assert found.total_variation["unpolarised"][0] < 1e-3 < 0.01 < found.total_variation["unpolarised"][1]
    assert found.to_dict()["polarised"] and "unpolarised" in found.to_dict()["models"]


# Forms of the result


def assert_schema(report: dict, names: list[str], directions: int) -> None:
    parts = {"energy": 3, "alpha": 2, "mean": 2, "covariance": 3}

    def lobe(entry: dict) -> None:
        assert set(entry) == {*parts, "rotation"} and len(entry["rotation"]) == directions
        assert all(np.shape(entry[key]) == (directions, size) for key, size in parts.items())

    assert set(report) == {"material", "cos", "paths", "microsurface", "polarised", "truth", "models"}
    errors = report["truth"]["standard_error"]
    for account in (report["truth"], *report["models"].values(), errors):
        assert list(account["lobes"]) == names
        for entry in account["lobes"].values():
            lobe(entry)
        assert np.shape(account["albedo"]) == (directions, 3)
    assert len(report["truth"]["noise"]) == directions
    for model in report["models"].values():
        assert set(model) == {"lobes", "albedo", "evaluated", "roughness_error", "total_variation", "rmse"}
        assert len(model["total_variation"]) == directions and model["roughness_error"] >= 0


@pytest.mark.usefixtures("few")
def test_command_line(run: Run, tmp_path: Path) -> None:
    figure = tmp_path / "figure.png"
    arguments = ["compare", "hazy-metal-sphere", "--paths", "20000", "--models", "belcour2018", "--cos", "1,0.5"]
    status, out, err = run(*arguments, "--set", "tir=off", "--json", "--plot", str(figure))
    assert status == 0, err
    report = json.loads(out)
    assert_schema(report, ["R1", "R2"], 2)
    assert report["paths"] == 20000 and report["models"]["belcour2018"]["rmse"] is None
    assert figure.read_bytes().startswith(b"\x89PNG") and list(tmp_path.iterdir()) == [figure]

    status, out, err = run("compare", "frosted-glass", "--paths", "2000", "--cos", "0.7", "--polarised")
    assert status == 0, err
    assert all(word in out for word in ("truth", "unpolarised", "belcour2018", "R1", "T", "total variation"))


@pytest.mark.usefixtures("few")
def test_pictures_have_an_error_and_a_place_in_the_figure(tmp_path: Path) -> None:
    reported: list[tuple[int, int]] = []
    models = ["velatura", "belcour2018"]

    def report(done: int, total: int) -> None:
        reported.append((done, total))

    found = vt.compare(Stack([METAL]), models, [1.0, 0.5], 1000, pictures=True, progress=report)
    assert reported == [(done, 6 + 2 + len(models)) for done in range(1, reported[0][1] + 1)]
    assert found.pictures and found.pictures.truth.shape == (16, 24, 3)
    assert found.to_dict()["models"]["belcour2018"]["rmse"] == pytest.approx(found.pictures.noise, rel=2)
    save_figure(found, tmp_path / "figure.svg")
    assert "RMSE" in (tmp_path / "figure.svg").read_text(encoding="utf-8")


def test_the_error_of_a_picture_is_a_root_mean_square() -> None:
    image = np.random.default_rng(0).uniform(0, 1, (8, 8, 3))
    assert Pictures(image, 0.01, {"brighter": image + 0.1}).rmse("brighter") == pytest.approx(0.1)


# Bad input


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--models", "belcour2018,nobody"], "nobody"),
        (["--models", ""], "model"),
        (["--models", "velatur"], "did you mean velatura?"),
        (["--models", "velatura,velatura"], "velatura is given twice"),
        (["--models", "blendbsdf"], "blendbsdf holds other BSDFs"),
        (["--models", "measured"], 'models: measured: Property "filename" cannot be found!'),
        (["--models", "sphere"], "sphere is no BSDF"),
        (["--models", "none.xml"], "none.xml: file not found"),
        (["--models", "principled", "--set", "tir=off"], "tir: for named models only"),
        (["--cos", "0"], "cos"),
        (["--cos", "1,x"], "--cos"),
        (["--paths", "1"], "--paths"),
        (["--polarised", "--pictures"], "pictures: not with polarised"),
        (["--polarised", "--models", "unpolarised"], "unpolarised is the name of the truth"),
        (["--set", "channels=separate"], "channels=separate"),
        (["--set", "tir=maybe"], "tir"),
        (["--plot", "figure.jpeg2"], "figure.jpeg2"),
        (["--plot", "/no/such/folder/figure.png"], "/no/such/folder"),
    ],
)
def test_bad_input_is_one_line(run: Run, arguments: list[str], words: str) -> None:
    status, out, err = run("compare", "bare-gold", *arguments)
    assert status == 2 and not out
    assert words in err and err.startswith("velatura: ") and err.count("\n") == 1


def test_a_texture_has_no_statistics(tmp_path: Path) -> None:
    path = tmp_path / "wood.png"
    path.write_bytes(b"")
    stack = Stack([Interface(eta=1.5, alpha={"texture": str(path)}), METAL])
    with pytest.raises(InvalidInput, match="texture"):
        vt.compare(stack, paths=100)


@pytest.mark.usefixtures("few")
def test_an_interrupted_figure_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from matplotlib.figure import Figure

    def interrupted(figure: Figure, path: Path, **_: object) -> None:
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    found = vt.compare(Stack([METAL]), ["belcour2018"], [1.0], paths=1000)
    monkeypatch.setattr(Figure, "savefig", interrupted)
    with pytest.raises(KeyboardInterrupt):
        save_figure(found, tmp_path / "figure.png")
    assert not list(tmp_path.iterdir())
