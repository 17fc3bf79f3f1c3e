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


@pytest.mark.parametrize("name", VALIDATIONS)
def test_every_validation_answers_with_truth_and_models(name: str) -> None:
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
