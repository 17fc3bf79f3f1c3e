"""The verb behind the truth beside a model: the page's view, as the path tracer of Mitsuba sees the random walk."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from shots import MIRROR

from velatura.editor.service import VERBS
from velatura.errors import InvalidInput

BODY = {**MIRROR, "spp": 16}


def picture(**changes: Any) -> np.ndarray:
    answer = VERBS["truth"]({**BODY, **changes})["picture"]
    return np.frombuffer(base64.b64decode(answer["data"]), answer["dtype"]).reshape(answer["shape"])


def test_the_view_is_that_of_the_body() -> None:
    first = picture()
    assert first.shape == (16, 24, 3)
    np.testing.assert_allclose(picture(), first, rtol=1e-5)  # samples are added up in any order
    for changes in ({"rotation": 90}, {"camera": {**BODY["camera"], "fov": 10.0}}, {"object": "plane"}):
        assert float(np.mean(np.abs(picture(**changes) - first))) > 0.05, changes


def test_light_bounces_between_facets_where_it_does_in_the_model() -> None:
    """Expected: rough gold is brighter by 3 to 15 % in a model that has bounces; their switch counts."""
    gold = {"layers": [{"interface": {"conductor": "Au", "alpha": 0.5}}]}
    once, often, switched = (
        float(np.mean(picture(material=gold, environment="furnace", **model)))
        for model in (
            {"model": "weier2020"},
            {"model": "velatura"},
            {"model": "belcour2018", "switches": {"reflectance": "fgd"}},
        )
    )
    assert 1.03 < often / once < 1.15
    assert switched == pytest.approx(once, rel=1e-3)


def test_a_white_furnace_stays_white() -> None:
    seen = picture(environment="furnace")
    assert np.median(seen) == pytest.approx(1, abs=1e-4)
    assert np.mean(seen) == pytest.approx(1, abs=2e-3)  # at the rim facets and normals disagree, which loses a sample


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"object": "file:mine.obj"}, "object: must be one of ball"),
        ({"environment": "../x.exr"}, "environment: must be one of"),
        ({"size": [24]}, "size: must be a width and a height"),
        ({"size": [24, 4096]}, "height: must be a whole number from 1 to 512, got 4096"),
        ({"spp": 0}, "spp: must be a whole number"),
        ({"camera": {"fov": 20, "origin": [0, 1], "target": [0, 0, 0]}}, "camera.origin: must be three numbers"),
    ],
)
def test_a_wrong_body_is_one_line(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidInput, match=says):
        VERBS["truth"]({**BODY, **changes})
