"""Pictures that the editor's page has Mitsuba render, in headless Chromium.

Rationale: a dialog, the server's steps and the folder work together, and the page must stay alive meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import chromium
import numpy as np
import pytest
from editor import Server, Visit
from matplotlib.path import Path as Polygon
from scipy.ndimage import binary_dilation, binary_erosion, zoom
from scipy.spatial import ConvexHull

from velatura import kernel, scenes

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]

EYE = (0, 2.6, 7.2)  # from which the page looks at (0, 1, 0)


def typed(page: Visit, label: str, value: int) -> None:
    field = page.page.locator("dialog.render").get_by_label(label, exact=True)
    field.fill(str(value))
    field.press("Enter")


def test_a_picture_is_rendered_into_the_folder_and_one_is_stopped(visit: Open, served: Server) -> None:
    page = visit()
    button = lambda name: page.page.get_by_role("button", name=name, exact=True)  # noqa: E731
    dialog = page.page.locator("dialog.render")
    button("Render").click()
    for label, value in (("Width", 96), ("Height", 54), ("Samples", 16)):
        typed(page, label, value)
    dialog.get_by_label("Transparent ground").check()
    dialog.get_by_role("button", name="Render").click()
    dialog.locator("figure img").wait_for()
    page.page.wait_for_function("() => document.querySelector('dialog.render img').naturalWidth === 96")
    picture = np.array(kernel.bitmap(Path(served.folder / "coated-brushed-gold.png")))
    assert picture.shape == (54, 96, 4)
    assert picture[0, 0, 3] == 0
    assert picture[..., 3].max() == 255

    # Another one goes on while the page does, and is stopped
    dialog.get_by_label("Format of the picture").select_option("exr")
    typed(page, "Samples", 65536)
    dialog.get_by_role("button", name="Render").click()
    dialog.get_by_role("progressbar").wait_for()
    dialog.get_by_role("button", name="Close, and go on").click()
    rough = page.page.locator(".layer").nth(0).get_by_label("Roughness", exact=True)
    rough.fill("0.2")
    rough.press("Enter")
    page.settled()
    page.page.get_by_role("button", name="Rendering").click()
    dialog.get_by_role("button", name="Stop").click()
    dialog.get_by_role("button", name="Render").wait_for()
    assert [file.name for file in served.folder.iterdir()] == ["coated-brushed-gold.png"]


def test_a_view_transform_is_seen_on_the_page_and_written_by_render(visit: Open, served: Server) -> None:
    """Expected: the light of a furnace behind the object, half a stop above 1, has the same bytes in both."""
    page = visit()
    page.page.get_by_label("Light", exact=True).select_option("furnace")
    exposure = page.page.get_by_label("Exposure, in stops", exact=True)
    exposure.fill("0.5")
    exposure.press("Enter")
    dialog = page.page.locator("dialog.render")
    page.page.get_by_role("button", name="Render", exact=True).click()
    for label, value in (("Width", 64), ("Height", 48), ("Samples", 1)):
        typed(page, label, value)
    dialog.get_by_role("button", name="Close").click()
    for name in ("soft", "aces", "agx"):
        page.page.get_by_label("View transform").select_option(name)
        expected = np.round(255 * scenes.tone_map([2**0.5] * 3, name))
        page.settled()
        page.page.evaluate("() => velatura.viewport.ready")
        assert page.picture()[0, 0] == pytest.approx(expected, abs=1)
    page.page.get_by_role("button", name="Render", exact=True).click()
    dialog.get_by_role("button", name="Render").click()
    dialog.locator("figure img").wait_for()
    (written,) = served.folder.glob("*.png")
    assert np.array(kernel.bitmap(written))[0, 0] == pytest.approx(expected, abs=1)


PYRAMID = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)])


def outline(corners: np.ndarray, width: int, height: int) -> np.ndarray:
    """The pixels whose middle a convex body covers, seen by the camera of dropped objects."""
    ahead = np.array([0, 1, 0]) - np.array(EYE)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, (0, 1, 0)) / np.linalg.norm(np.cross(ahead, (0, 1, 0)))
    away = corners - EYE
    places = away @ np.transpose([right, np.cross(ahead, right)]) / (away @ ahead)[:, None]
    pixels = np.array([width, height]) / 2 + places * min(width, height) / 2 / np.tan(np.radians(19.5 / 2))
    hull = pixels[ConvexHull(pixels).vertices]
    middles = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1)
    return Polygon(hull).contains_points(middles.reshape(-1, 2)).reshape(height, width)


def test_a_dropped_object_is_rendered(visit: Open, served: Server) -> None:
    """Expected: the outline of a pyramid of the size that the page gives it, but for pixels of its edges."""
    page = visit()
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in PYRAMID) + "f 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"
    page.drop(("pyramid.obj", text))
    page.page.wait_for_function("() => velatura.store.get().view.object === 'file:pyramid.obj'")
    page.settled()
    page.page.get_by_role("button", name="Render", exact=True).click()
    dialog = page.page.locator("dialog.render")
    for label, value in (("Width", 64), ("Height", 48), ("Samples", 4)):
        typed(page, label, value)
    dialog.get_by_label("Transparent ground").check()
    dialog.get_by_role("button", name="Render").click()
    dialog.locator("figure img").wait_for()
    (written,) = served.folder.glob("*.png")
    alpha = np.array(kernel.bitmap(written))[..., 3]
    scale = 2.7 / np.sqrt(3)
    covered = outline(scale * (PYRAMID - (0.5, 0, 0.5)), 64, 48)
    assert 300 < covered.sum() < np.count_nonzero(alpha)
    assert np.all(alpha[binary_erosion(covered)] == 255)
    assert np.all(alpha[~binary_dilation(covered, iterations=2)] == 0)


def test_a_turntable_is_rendered_into_frames_and_stopped(visit: Open, served: Server) -> None:
    """Expected: an object of rotation looks the same in all frames while it turns, not where the light does."""
    page = visit()
    page.page.get_by_label("Object", exact=True).select_option("sphere")
    page.settled()
    page.page.get_by_role("button", name="Render", exact=True).click()
    dialog = page.page.locator("dialog.render")
    for label, value in (("Width", 32), ("Height", 24), ("Samples", 64), ("Frames", 3)):
        typed(page, label, value)
    dialog.get_by_role("button", name="Render").click()
    dialog.get_by_text(
        "3 frames, coated-brushed-gold-01.png to coated-brushed-gold-03.png, are in the folder"
    ).wait_for()
    dialog.get_by_label("What turns").select_option("light")
    dialog.get_by_role("button", name="Render").click()
    dialog.get_by_text("3 frames, coated-brushed-gold-2-01.png").wait_for()
    frames = [np.array(kernel.bitmap(file)).astype(float) for file in sorted(served.folder.glob("*.png"))]
    lit, turned = frames[:3], frames[3:]
    assert max(np.mean(np.abs(frame - lit[0])) for frame in lit[1:]) < 6
    assert min(np.mean(np.abs(frame - turned[0])) for frame in turned[1:]) > 12

    # A stop leaves the frames that are finished
    typed(page, "Frames", 999)
    dialog.get_by_role("button", name="Render").click()
    dialog.get_by_text("gold-3-0001.png").wait_for()
    dialog.get_by_role("button", name="Stop").click()
    dialog.get_by_role("button", name="Render").wait_for()
    count = len(list(served.folder.glob("*-3-*.png")))
    assert 0 < count < 999
    page.page.wait_for_timeout(500)
    assert len(list(served.folder.glob("*-3-*.png"))) == count


def test_lights_are_added_placed_and_removed_and_rendered_where_the_page_has_them(visit: Open, served: Server) -> None:
    """Expected: a light in the background covers the same pixels in both, and undo takes its values back."""
    page = visit()
    before = page.picture()
    page.page.get_by_role("button", name="Add a light").click()
    for label, value in (("azimuth", 168), ("elevation", -14), ("size", 7), ("strength", 50)):
        field = page.page.get_by_label(f"Light 1, {label}", exact=True)
        field.fill(str(value))
        field.press("Enter")
    page.page.get_by_label("Light 1, hexadecimal").fill("#ff0000")
    page.page.get_by_label("Light 1, hexadecimal").press("Enter")
    assert page.state("view.lights.0") == {
        **{"azimuth": 168, "elevation": -14, "size": 7, "strength": 50},
        "colour": [1, 0, 0],
    }
    red = page.picture() @ (1, -1, 0) > 150
    assert 20 < red.sum() < 300

    width, height = page.page.evaluate("[velatura.canvas.width, velatura.canvas.height]")
    page.page.get_by_role("button", name="Render", exact=True).click()
    dialog = page.page.locator("dialog.render")
    for label, number in (("Width", width), ("Height", height), ("Samples", 4)):
        typed(page, label, number)
    dialog.get_by_role("button", name="Render").click()
    dialog.locator("figure img").wait_for()
    dialog.get_by_role("button", name="Close").click()
    (written,) = served.folder.glob("*.png")
    picture = zoom(np.array(kernel.bitmap(written)).astype(float), (48 / height, 64 / width, 1), order=1)
    covered = picture @ (1, -1, 0) > 150
    assert (red & covered).sum() > 0.85 * (red | covered).sum()

    # Not drawn without it
    page.page.keyboard.press("Control+z")
    assert page.state("view.lights.0.colour") == [1, 1, 1]
    page.page.get_by_role("button", name="Remove Light 1").click()
    assert page.state("view.lights") == []
    assert page.picture() == pytest.approx(before, abs=2)
