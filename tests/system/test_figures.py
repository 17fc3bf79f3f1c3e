"""The papers' figures: their numbers against what the papers say of them, and the verb that makes them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from velatura.figures import (
    FIGURES,
    belcour2018_11,
    belcour2018_12,
    belcour2018_13,
    belcour2018_19,
    belcour2018_21,
    belcour2018_22,
    belcour2018_table2,
    figure,
    linear_space,
)
from velatura.optics import fresnel
from velatura.stack import Interface, Stack, rgb

Run = Callable[..., tuple[int, str, str]]

SMALL: dict[str, dict[str, Any]] = {
    "bati2021-07": {"count": 20},
    "bati2021-17": {"size": 16, "spp": 2},
    "bati2021-25": {"targets": ("15 c", "16"), "paths": 20_000},
    "belcour2018-11": {"alpha": 0.01, "size": 32, "spp": 32, "paths": 100_000},
    "belcour2018-12": {"angles": (0, 60), "size": 32, "spp": 8, "paths": 60_000},
    "belcour2018-13": {"size": 96, "spp": 32, "paths": 60_000},
    "belcour2018-19": {"alphas": (0.1, 1.0), "size": 32, "spp": 8, "paths": 100_000},
    "belcour2018-21": {"alphas": (0, 0.5, 0.9), "angles": (0, 70), "paths": 60_000},
    "belcour2018-22": {"coats": (0.1,), "metals": ("gold",), "size": 48, "spp": 64, "paths": 60_000},
    "belcour2018-table2": {"size": 32, "spp": 16, "repeats": 1},
    "linear-space": {"count": 2**14},
}


def drawn(module: Any, numbers: dict[str, Any], folder: Path) -> None:
    """The numbers are plain, and there is a picture of them and nothing else."""
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    module.draw(numbers, folder / "figure.png")
    (found,) = folder.iterdir()
    assert found.name == "figure.png" and found.read_bytes().startswith(b"\x89PNG")


def test_colour_saturates_as_light_bounces(tmp_path: Path) -> None:
    """Rationale: the claim of Belcour 2018, figure 11. Expected: the model is nearer to all bounces than to one."""
    found = belcour2018_11.compute(**SMALL["belcour2018-11"])
    saturation = {column: np.array(values) for column, values in found["saturation"].items()}
    assert np.all(abs(saturation["model"] - saturation["all"]) < 0.75 * (saturation["all"] - saturation["single"]))
    assert found["rmse"]["model"] < found["rmse"]["single"]
    # What is known: two smooth interfaces, along the normal
    flat = Stack([Interface(conductor=belcour2018_11.METAL)]).flat()
    eta, k = (np.array(rgb(flat[f"layer0_{name}"])) / belcour2018_11.ETA for name in ("eta", "k"))
    r, base = ((belcour2018_11.ETA - 1) / (belcour2018_11.ETA + 1)) ** 2, fresnel.conductor(1.0, eta, k)
    np.testing.assert_allclose(found["albedo"]["single"][0], r + (1 - r) ** 2 * base, rtol=0.01)
    np.testing.assert_allclose(found["albedo"]["all"][0], r + (1 - r) ** 2 * base / (1 - r * base), rtol=0.01)
    drawn(belcour2018_11, found, tmp_path)


def test_the_furnace_keeps_all_energy_and_the_baseline_does_not(tmp_path: Path) -> None:
    """Rationale: the claim of Belcour 2018, figure 12. Expected: 1 for the model and the walk; the baseline loses."""
    found = belcour2018_12.compute(**SMALL["belcour2018-12"])
    for model in ("belcour2018", "reference"):
        np.testing.assert_allclose(found["smooth"][model], 1, atol=1e-5)
        # In the picture it vanishes, but for a little of its silhouette
        missing = np.abs(1 - np.array(found["pictures"]["smooth"][model]))
        assert missing.mean() < 2e-3 and np.median(missing) < 1e-5
    assert found["smooth"]["weidlich_wilkie"][0] < 0.95
    assert found["smooth"]["weidlich_wilkie"][1] < 0.5
    # With rough interfaces the model keeps what the walk does, near the normal
    assert found["rough"]["belcour2018"][0] == pytest.approx(found["rough"]["reference"][0], abs=0.01)
    drawn(belcour2018_12, found, tmp_path)


def test_frosted_metal_is_blurred_as_in_the_truth_and_not_by_the_baseline(tmp_path: Path) -> None:
    """Rationale: the claim of Belcour 2018, figure 13. Expected: the baseline's base stays a mirror."""
    found = belcour2018_13.compute(**SMALL["belcour2018-13"])
    blur = found["blur"]
    assert blur["belcour2018"][0] == pytest.approx(blur["reference"][0], rel=0.15)
    assert blur["weidlich_wilkie"][0] < 0.1 * blur["reference"][0]
    assert found["rmse"]["belcour2018"] < 0.6 * found["rmse"]["weidlich_wilkie"]
    np.testing.assert_allclose(found["albedo"]["belcour2018"][0], found["albedo"]["reference"][0], rtol=0.03)
    drawn(belcour2018_13, found, tmp_path)


def test_high_roughness_is_where_the_model_fails(tmp_path: Path) -> None:
    """Rationale: the claim of Belcour 2018, figure 19. Expected: the error grows far beyond the noise of the walk."""
    found = belcour2018_19.compute(**SMALL["belcour2018-19"])
    smooth, rough = found["total_variation"]
    assert rough > 2 * smooth and rough - found["noise"][1] > smooth
    # What is known: a surface of index 2 reflects ((2 - 1) / (2 + 1))^2 along the normal, a little rough or not
    assert found["walk"]["albedo"][0] == pytest.approx(1 / 9 + found["walk"]["base_energy"][0], abs=3e-3)
    assert found["model"]["albedo"][1] < 0.5 * found["walk"]["albedo"][1]
    drawn(belcour2018_19, found, tmp_path)


def test_variances_of_two_interfaces_are_close_up_to_moderate_roughness(tmp_path: Path) -> None:
    """Rationale: the claim of Belcour 2018, figure 21 and appendix C. Expected: close to .5, too much above."""
    found = belcour2018_21.compute(**SMALL["belcour2018-21"])
    walk, model = (np.array(found["two"][side]["variance"]) for side in ("walk", "model"))
    excess = model / walk - 1
    assert 0 < excess[0] < 0.07 < excess[1] < 0.17 < excess[2]
    # Not borne out: with four interfaces the variance is far too large from the start
    walk, model = (np.array(found["four"][side]["variance"]) for side in ("walk", "model"))
    assert np.all(model > 1.5 * walk)
    # What is known: a smooth coat reflects ((1.4 - 1) / (1.4 + 1))^2; the mean is 0 along the normal
    base, variance = found["two"]["walk"]["base_energy"][0], found["two"]["walk"]["base_variance"][0]
    assert found["two"]["walk"]["variance"][0] == pytest.approx(base * variance / (base + (0.4 / 2.4) ** 2), rel=0.01)
    assert found["angle"]["model"]["mean_x"][0] == pytest.approx(0, abs=1e-3)
    assert abs(found["angle"]["walk"]["mean_x"][0]) < 5 * np.sqrt(walk[2] / (0.1 * found["paths"]))
    drawn(belcour2018_21, found, tmp_path)


def test_two_layers_look_alike_in_roughness_and_colour(tmp_path: Path) -> None:
    """Rationale: the claims of Belcour 2018, appendix D and figure 22, of roughness and, less so, of colour."""
    found = belcour2018_22.compute(**SMALL["belcour2018-22"])
    for cell in found["cells"]:
        alpha, energy = cell["base_alpha"], cell["base_energy"]
        assert 1 < alpha["model"] / alpha["walk"] < 1.25
        np.testing.assert_allclose(energy["model"], energy["walk"], rtol=0.06)
        assert cell["rmse"]["symmetric"] < 0.25 * cell["mean"]["reference"]
    drawn(belcour2018_22, found, tmp_path)


def test_the_model_costs_more_than_the_baseline_and_tells_more(tmp_path: Path) -> None:
    """Rationale: Belcour 2018, table 2. Seconds are the machine's. Expected: what they buy is nearer to the walk."""
    numbers = belcour2018_table2.compute(**SMALL["belcour2018-table2"])
    found = numbers["scenes"]
    assert {name: list(scene["ratio"]) for name, scene in found.items()} == {
        name: list(belcour2018_table2.COLUMNS) for name in belcour2018_table2.SCENES
    }
    assert all(seconds > 0 for scene in found.values() for seconds in scene["seconds"].values())
    # The model is nearer to the walk than the baseline is, in all that is seen
    for scene in found.values():
        mean = scene["mean"]
        assert abs(mean["belcour2018"] - mean["reference"]) < abs(mean["weidlich_wilkie"] - mean["reference"])
    drawn(belcour2018_table2, numbers, tmp_path)


def test_the_roughness_maps_come_out_of_two_bounces(tmp_path: Path) -> None:
    """Rationale: Belcour 2018, appendix A, and Weier & Belcour 2020, 3.3. Expected: p, a and b of both, if not always.

    They come out where roughnesses up to .33 are fitted, p by variances and a and b by medians. Small equal roughnesses
    add as the sums of GGX slopes do, whose median is 1.671 times theirs.
    """
    found = linear_space.compute(**SMALL["linear-space"])
    by_top = {name: {fit["top"]: fit for fit in found[name]["fits"]} for name in found}
    assert by_top["variance"][0.33]["p"] == pytest.approx(1.1, abs=0.02)
    fit = by_top["median"][0.33]
    assert abs(fit["a"] - 1.28809776) < 3 * fit["a_error"] and abs(fit["b"] - 1.31699416) < 3 * fit["b_error"]
    assert fit["a_error"] < 0.02 and fit["rms_weier"] < 1.1 * fit["rms"] < 0.3 * fit["rms_belcour"]
    assert by_top["median"][0.51]["b"] < 0.3
    median = dict(zip(found["median"]["alpha"], found["median"]["equivalent"]))
    assert median[0.001] / 0.001 == pytest.approx(1.671, rel=0.01)
    drawn(linear_space, found, tmp_path)


# The verb


def test_every_figure_is_tried_here_and_is_found_by_its_name() -> None:
    assert set(SMALL) == set(FIGURES)
    assert all(callable(figure(name).compute) and callable(figure(name).draw) for name in FIGURES)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """A figure that takes no time; returns its numbers."""
    numbers = {"x": [1.0], "pictures": {"a": [[[0.5, 0.5, 0.5]]]}}

    def compute(progress: Callable[[int, int], None]) -> dict[str, Any]:
        progress(1, 1)
        return numbers

    monkeypatch.setattr(belcour2018_12, "compute", compute)
    monkeypatch.setattr(belcour2018_12, "draw", lambda numbers, path: Path(path).write_text("drawn"))
    return numbers


def test_the_verb_draws_a_picture(
    run: Run, quick: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = run("figure", "belcour2018-12")
    assert (status, err) == (0, "") and out.startswith("belcour2018-12.png: ")
    assert [path.name for path in tmp_path.iterdir()] == ["belcour2018-12.png"]


def test_the_verb_prints_numbers_and_draws_if_told_where(
    run: Run, quick: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = run("figure", "belcour2018-12", "--json")
    assert (status, json.loads(out), err) == (0, {"x": [1.0]}, "")
    assert not list(tmp_path.iterdir())
    run("figure", "belcour2018-12", "--json", "-o", "numbers.svg")
    assert [path.name for path in tmp_path.iterdir()] == ["numbers.svg"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["zzz"], ("'zzz'", *FIGURES)),
        (["belcour2018-1"], ("belcour2018-1", *FIGURES)),
        (["belcour2018-12", "-o", "picture.exr"], ("picture.exr", ".png")),
        (["belcour2018-12", "-o", "nowhere/picture.png"], ("nowhere/picture.png", "no folder")),
    ],
)
def test_bad_input_is_told_in_one_line(run: Run, arguments: list[str], words: tuple[str, ...]) -> None:
    status, out, err = run("figure", *arguments)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert all(word in err for word in words)
