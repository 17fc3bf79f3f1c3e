"""Pictures that the editor's server writes step by step, against those of `velatura.scenes.render`."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shots import MIRROR

from velatura import kernel, scenes
from velatura.editor import rendering
from velatura.editor.folder import Folder
from velatura.errors import InvalidInput
from velatura.scenes.denoise import DENOISER
from velatura.scenes.environments import studio

BODY = {**MIRROR, "samples": 40, "file": "ball.exr"}


def sent(**arrays: Any) -> dict[str, Any]:
    """Arrays of a mesh as the page sends them."""
    return {key: base64.b64encode(bytes(array)).decode() for key, array in arrays.items()}


def triangle(**others: Any) -> dict[str, Any]:
    corners = np.zeros(9, "<f4")
    return sent(
        **{
            "positions": corners,
            "normals": corners,
            "uv": corners[:6],
            "triangles": np.arange(3, dtype="<u4"),
            **others,
        }
    )


def part(name: str, triangles: int = 1) -> dict[str, Any]:
    return {"name": name, "triangles": triangles}


def lit(picture: np.ndarray, **others: int) -> dict[str, Any]:
    """A picture of light as the page sends it."""
    height, width, _ = picture.shape
    return {"width": width, "height": height, **sent(data=picture.astype("<f4")), **others}


@pytest.fixture
def renderings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> rendering.Renderings:
    monkeypatch.chdir(tmp_path)
    return rendering.Renderings(Folder())


def made(renderings: rendering.Renderings, **changes: Any) -> tuple[np.ndarray, int]:
    """The picture in the file that was written, and the number of steps."""
    answer: dict[str, Any] = {"step": 0}
    count = 0
    while "file" not in answer:
        answer = renderings.verbs["render"]({**BODY, "key": "one", **changes, "step": answer["step"]})
        count += 1
    return np.array(kernel.bitmap(Path(answer["file"]))), count


def test_a_picture_in_steps_and_bands_is_that_of_scenes(
    renderings: rendering.Renderings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: within noise, which is that of 40 samples of a mirror in softboxes; also across the edges of bands."""
    mi = kernel.mitsuba()
    mirror = mi.load_dict({"type": "conductor", "material": "none"})
    expected = scenes.render(mirror, "sphere", spp=400, size=(24, 16))
    whole, count = made(renderings)
    assert (whole.shape, count) == ((16, 24, 3), 1)
    monkeypatch.setattr(rendering, "MOST", 24 * 6)  # bands of 6, 6 and 4 rows
    bands, count = made(renderings, samples=20, key="two")
    assert count == 3 * 20
    for picture in (whole, bands):
        assert float(np.sqrt(np.mean((picture - expected) ** 2))) < 0.25
        assert float(np.mean(picture)) == pytest.approx(float(np.mean(expected)), rel=0.05)


def test_a_transparent_ground_has_no_plinth_and_files_are_numbered(renderings: rendering.Renderings) -> None:
    picture, _ = made(renderings, transparent=True, file="ball.png")
    assert picture.shape == (16, 24, 4)
    assert picture[0, 0].tolist() == [0, 0, 0, 0]
    assert picture[8, 12, 3] == 255
    made(renderings, key="two", file="ball.png")
    assert sorted(path.name for path in Path().iterdir()) == ["ball-2.png", "ball.png"]


def test_a_mesh_takes_the_place_of_an_object(renderings: rendering.Renderings) -> None:
    """Expected: that of a named object gives its picture, and normals need not be of unit length."""
    surface = scenes.OBJECTS["sphere"].surface()
    positions, normals, uv = (x.astype("<f4") for x in (surface.positions, 3 * surface.normals, surface.uv))
    mesh = sent(positions=positions, normals=normals, uv=uv, triangles=surface.triangles.astype("<u4"))
    named, _ = made(renderings, samples=4)
    given, _ = made(renderings, samples=4, object="file:mine.obj", mesh=mesh, key="two")
    assert given == pytest.approx(named, abs=1e-3)


def test_parts_of_a_mesh_have_what_covers_them(renderings: rendering.Renderings) -> None:
    """Expected: each half of a sphere is as on a sphere of its material alone, but for light from the other half."""
    surface = scenes.OBJECTS["sphere"].surface()
    left = surface.positions[surface.triangles[:, 0], 0] < 0
    triangles = np.concatenate([surface.triangles[left], surface.triangles[~left]])
    arrays = (x.astype("<f4") for x in (surface.positions, surface.normals, surface.uv))
    mesh = sent(**dict(zip(("positions", "normals", "uv"), arrays)), triangles=triangles.astype("<u4"))
    parts = [part("left", int(left.sum())), part("right", int((~left).sum()))]
    smooth, rough = ({"layers": [{"interface": {"conductor": "Au", "alpha": alpha}}]} for alpha in (0.1, 0.5))
    mix = {"mix": [{"weight": 0, "material": smooth, "covers": "left"}, {"material": rough}]}
    both, _ = made(renderings, mesh={**mesh, "parts": parts}, material=mix, samples=64)
    for key, material, half in (("two", smooth, np.s_[5:10, 9:12]), ("three", rough, np.s_[5:10, 13:16])):
        alone, _ = made(renderings, material=material, samples=64, key=key)
        other = both[:, ::-1][half]
        assert both[half].mean(axis=(0, 1)) == pytest.approx(alone[half].mean(axis=(0, 1)), rel=0.1)
        assert np.abs(other - alone[half]).mean() > 2 * np.abs(both[half] - alone[half]).mean()


def test_a_picture_of_light_takes_the_place_of_the_environments(renderings: rendering.Renderings) -> None:
    """Expected: that of the studio gives its picture, turned as it is."""
    named, _ = made(renderings, samples=4, rotation=50)
    given, _ = made(renderings, samples=4, rotation=50, environment="city", light=lit(studio()), key="two")
    assert given == pytest.approx(named, abs=1e-3)


def test_a_step_that_was_made_is_not_made_again_and_another_picture_ends_it(renderings: rendering.Renderings) -> None:
    render = renderings.verbs["render"]
    body = {**BODY, "size": [512, 512], "samples": 9, "environment": "furnace"}  # four samples a step
    assert render({**body, "key": "a"}) == {"step": 1, "steps": 3}
    assert render({**body, "key": "a"}) == {"step": 1, "steps": 3}
    assert "file" in render({**BODY, "key": "b"})
    with pytest.raises(InvalidInput, match="no longer under way"):
        render({**body, "key": "a", "step": 1})


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"file": "../ball.png"}, "must be the plain name of a file"),
        ({"file": "ball.yaml"}, "must end in .png, .exr"),
        ({"environment": "none.exr"}, "none.exr: there is no such file"),
        ({"object": "file:mine.obj"}, "object: must be one of ball"),
        ({"size": [8, 5000]}, "size: .*4096"),
        ({"mesh": {}}, "mesh: must have 1 to 500,000 triangles, got 0"),
        ({"mesh": triangle(positions=b"123")}, "mesh: positions: must have 3 numbers of 4 bytes each, got 3 bytes"),
        ({"mesh": {"uv": "no"}}, "mesh: uv: must be in base64"),
        ({"mesh": triangle(uv=b"")}, "mesh: positions, normals and uv must be of as many vertices"),
        (
            {"mesh": triangle(triangles=np.array([0, 1, 3], "<u4"))},
            "mesh: triangles: must be of vertices below 3, got 3",
        ),
        ({"mesh": {**triangle(), "parts": []}}, "mesh: parts: must be a list of 1 to 32"),
        ({"mesh": {**triangle(), "parts": [{"name": 1}]}}, "mesh: parts: name: must be text of 255 characters at most"),
        (
            {"mesh": {**triangle(), "parts": [part("a", 2)]}},
            "mesh: parts: triangles: must be a whole number from 1 to 1",
        ),
        (
            {"mesh": {**triangle(), "parts": [part("a"), part("b")]}},
            "mesh: parts: must have 1 triangles together, got 2",
        ),
        ({"mesh": {**triangle(), "parts": [part("a"), part("a")]}}, "mesh: parts: name: .* once, got 'a'"),
        ({"light": {"width": 1, "height": 2}}, "light: width and height must be whole numbers from 2 to 2048"),
        ({"light": lit(np.zeros((2, 4, 3)), width=3)}, "light: data: must be of 6 texels, got 8"),
        ({"light": lit(np.full((2, 4, 3), -1.0))}, "light: data: must be from 0 to 1e"),
        ({"mesh": triangle(normals=np.full(9, np.nan, "<f4"))}, "mesh: numbers must be finite and at most 10000"),
    ],
)
def test_a_wrong_body_is_one_line(renderings: rendering.Renderings, changes: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidInput, match=says):
        made(renderings, **changes)


def test_a_picture_is_denoised(renderings: rendering.Renderings) -> None:
    """Expected: nearer to a picture of many samples than what it was made of."""
    pytest.importorskip(DENOISER)
    rough = {"material": {"layers": [{"interface": {"conductor": "Au", "alpha": 0.4}}]}, "size": [64, 64]}
    many, _ = made(renderings, **rough, samples=256)
    few, _ = made(renderings, **rough, samples=4, key="two")
    calm, _ = made(renderings, **rough, samples=4, key="three", denoised=True)
    assert np.sqrt(np.mean((calm - many) ** 2)) < 0.5 * np.sqrt(np.mean((few - many) ** 2))
