"""The validations of the editor: each answers its sliders, and meets a limit that is known."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from velatura.editor.validations import BINS, VALIDATIONS, listed, validation
from velatura.errors import InvalidInput
from velatura.optics import fresnel


def answer(name: str, **parameters: float) -> dict[str, dict[str, Any]]:
    """The curves by label."""
    return {curve["label"]: curve for curve in validation({"name": name, "parameters": parameters})["curves"]}


def area(curve: dict[str, Any]) -> float:
    return float(np.sum(curve["y"]) * 2 / BINS)


@pytest.mark.parametrize("name", [name for name in VALIDATIONS if name not in ("aligned", "pairs")])
def test_every_validation_of_curves_answers_with_truth_and_models(name: str) -> None:
    for end in ("low", "default", "high"):
        given = {key: getattr(slider, end) for key, slider in VALIDATIONS[name].sliders.items()}
        found = json.loads(json.dumps(validation({"name": name, "parameters": given}), allow_nan=False))
        assert [curve["kind"] for curve in found["curves"]][:2] == ["truth", "model"]
        for curve in found["curves"]:
            assert len(curve["x"]) == len(curve["y"]) == len(curve.get("error", curve["x"]))
        assert found["says"].endswith(".") and set(found["axes"]) == {"x", "y"}


def test_the_list_tells_the_sliders() -> None:
    found = {page["name"]: page for page in listed({})["validations"]}
    assert list(found) == list(VALIDATIONS)
    assert found["tir"]["sliders"]["eta"]["default"] == 1.5


def test_one_of_two_mirrors_being_smooth_the_other_is_all_there_is() -> None:
    """The density across the disc is then that of one GGX lobe (samples differ: within 4 standard errors a bin)."""
    curves = answer("reflection", alpha_1=0, alpha_2=0.3, angle=0)
    truth, model = curves["two bounces"], curves["one of belcour's map"]
    assert area(truth) == pytest.approx(1)
    assert np.all(np.abs(np.subtract(truth["y"], model["y"])) < 4 * np.array(truth["error"]) + 0.01)


def test_slightly_rough_refraction_is_as_wide_as_the_scale_says() -> None:
    """At normal incidence the equivalent roughness tends to (1 - 1/n)/2 of the interface's (Belcour 2018, Eq. 10)."""
    told = validation({"name": "transmission", "parameters": {"eta": 1.5, "alpha": 0.05, "angle": 0}})["says"]
    walked = float(told.split("random walk ")[1].split(",")[0])
    assert walked == pytest.approx(0.05 * 0.5 * (1 - 1 / 1.5), rel=0.06)


def test_smooth_lobes_are_absorbed_by_the_law_of_beer_and_lambert() -> None:
    """Down and up along 60 degrees through a depth of .25: exp(-1) is left, and walks do not scatter."""
    curves = answer("absorption", depth=0.25, alpha=0, angle=60)
    assert area(curves["random walk"]) == pytest.approx(np.exp(-1), rel=1e-3)
    assert area(curves["belcour2018"]) == pytest.approx(np.exp(-1), rel=2e-3)


def test_a_thin_slab_scatters_once() -> None:
    """Unscattered light, and the phase function's distribution of angles; the depth's square is left out.

    Each of 45 points lies beyond 4 standard errors by chance in 6e-5 of seeds, all of them in 3e-3 at most.
    """
    depth, g = 0.05, 0.9
    curve = answer("scattering", depth=depth, g=g, angle=0)["random walk"]
    cosine = np.cos(np.radians(curve["x"]))
    once = (1 - g * g) / (2 * g) * (1 / (1 - g) - 1 / np.sqrt(1 + g * g - 2 * g * cosine))
    forwards = (1 - g * g) / (2 * g) * (1 / (1 - g) - 1 / np.sqrt(1 + g * g))
    through = np.exp(-depth) + (1 - np.exp(-depth)) * forwards
    expected = (np.exp(-depth) + (1 - np.exp(-depth)) * once) / through
    assert np.all(np.abs(curve["y"] - expected) < 4 * np.array(curve["error"]) + depth**2)
    assert np.ptp(expected) > 0.03


def test_a_smooth_mirror_sends_nothing_beyond_the_critical_angle() -> None:
    """All leaves that Fresnel lets through, and the clean table takes nothing away.

    Up to 75 degrees: a mirror is sampled as one of alpha .001, and beyond that Fresnel is too steep for it.
    """
    curves = answer("tir", eta=1.5, alpha=0)
    expected = 1 - fresnel.dielectric(np.cos(np.radians(curves["integral"]["x"])), 1.5)
    assert curves["integral"]["y"][:26] == pytest.approx(expected[:26].tolist(), abs=3e-3)
    assert curves["tir=clean"]["y"] == pytest.approx(expected.tolist(), abs=3e-3)
    assert curves["tir=published"]["y"][0] == pytest.approx(expected[0] ** 2, abs=1e-3)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"name": "reflexion"}, "did you mean reflection"),
        ({}, "unknown validation nothing"),
        ({"name": "tir", "parameters": {"alfa": 1}}, "tir: unknown parameter 'alfa'"),
        ({"name": "tir", "parameters": {"eta": 9}}, "tir: eta: must be a number in 1.05 to 3, got 9"),
        ({"name": "tir", "parameters": {"eta": "1.5"}}, "must be a number"),
    ],
)
def test_what_does_not_exist_is_refused_in_one_line(body: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInput, match=words) as error:
        validation(body)
    assert "\n" not in str(error.value)


# Of Weier & Belcour 2020 ---------------------------------------------------------------------------------------------

GOLD = {
    "layers": [
        {"interface": {"eta": 1.5, "alpha": 0.05}},
        {"medium": {"sigma_a": 0.1}},
        {"interface": {"conductor": "Au", "alpha": [0.1, 0.3], "rotation": 30}},
    ]
}


def asked(name: str, **parameters: float) -> dict[str, Any]:
    return validation({"name": name, "parameters": parameters})


def test_a_round_interface_is_fetched_as_it_is_and_a_brushed_one_by_its_average() -> None:
    """Of figure 5: the lower roughness alone is far off across it, and the average of several is the integral."""
    for alpha, shares in ((0.2, (0.002, 0.002, 0.002)), (0.5, (1.0, 1.0, 0.012))):
        curves = answer("fetch", reflectance=0.04, alpha_u=alpha if alpha < 0.5 else 0, alpha_v=alpha, azimuth=90)
        truth = np.array(curves["integral"]["y"])
        for form, share in zip(("isotropic", "stretched", "averaged"), shares):
            assert np.abs(np.array(curves[form]["y"]) - truth).max() < share
    assert np.abs(np.array(curves["isotropic"]["y"]) - truth).max() > 0.1
    smooth = answer("fetch", reflectance=0.3, alpha_u=0, alpha_v=0, azimuth=0)
    assert smooth["integral"]["y"][0] == pytest.approx(0.3, abs=1e-4)


@pytest.mark.parametrize(
    ("alpha", "angle", "azimuth", "aspect", "turn"),
    [
        ((0.02, 0.08), 0, 0, 4.0, 0.0),  # slopes are as far spread as the roughness, along each axis
        ((0.1, 0.4), 70, 0, None, 0.0),  # by symmetry
        ((0.1, 0.4), 70, 45, None, 6.8),  # figure 4
    ],
)
def test_a_brushed_lobe_lies_along_its_axes_but_at_grazing_angles(
    alpha: tuple[float, float], angle: float, azimuth: float, aspect: float | None, turn: float
) -> None:
    found = asked("aligned", alpha_u=alpha[0], alpha_v=alpha[1], angle=angle, azimuth=azimuth)
    said = found["says"]
    assert float(said.split("turned by ")[1].split("\N{DEGREE SIGN}")[0]) == pytest.approx(turn, abs=0.5)
    if aspect:
        assert float(said.split("lobe is ")[1].split(" times")[0]) == pytest.approx(aspect, rel=0.05)
    assert tuple(found["disc"]["picture"]["shape"]) == (192, 192)
    own, along = (np.array(outline["points"]) for outline in found["disc"]["outlines"])
    assert np.abs(own.mean(axis=0) - along.mean(axis=0)).max() < 1e-9
    assert np.ptp(own, axis=0) == pytest.approx(np.ptp(along, axis=0), rel=0.02)  # ellipses of the same variances


def test_numbers_are_those_of_an_interface_of_the_material_unless_given() -> None:
    body = {"name": "fetch", "material": GOLD, "layer": 2}
    found = validation(body)["parameters"]
    assert (found["alpha_u"], found["alpha_v"]) == (0.1, 0.3) and 0.6 < found["reflectance"] < 0.7
    assert validation({**body, "layer": 0})["parameters"]["reflectance"] == pytest.approx(0.04)
    assert validation({**body, "parameters": {"alpha_u": 0.2}})["parameters"]["alpha_u"] == 0.2
    for layer in (1, 3):
        with pytest.raises(
            InvalidInput, match=f"layer: must be the number of an interface of the material, got {layer}"
        ):
            validation({**body, "layer": layer})


def test_pairs_of_roughnesses_are_rendered_by_model_and_walk() -> None:
    """Of one interface, that both treat alike, the difference is noise (3 standard errors: 1 in 400); that of figure 10
    is beyond it."""
    bare = {"layers": [{"interface": {"conductor": "Au", "alpha": 0.1}}]}
    body = {"name": "pairs", "material": bare, "layer": 0, "model": "velatura"}
    found = validation({**body, "parameters": {"alpha_u": 0.1, "alpha_v": 0.3}})
    assert found["rmse"] < max(3 * found["error"], 0.012)
    shapes = {name: tuple(picture["shape"]) for name, picture in found["pictures"].items()}
    assert shapes == dict.fromkeys(("model", "truth"), (64, 64, 3))
    metal = {"interface": {"eta": 0.001, "k": 1.0, "alpha": 0.1}}
    coated = {"layers": [{"interface": {"eta": 1.5, "alpha": 0.05}}, metal]}
    other = {**body, "material": coated, "layer": 1, "model": "weier2020", "switches": {"reflectance": "fresnel"}}
    assert validation({**other, "parameters": {"alpha_u": 0.05, "alpha_v": 0.5}})["rmse"] > 0.02
    with pytest.raises(InvalidInput, match="layer: must be the number"):
        validation({**body, "layer": None})
