"""An object of several parts, each of which has a material of its own, in headless Chromium.

Rationale: a file, the list of its parts, the picture and Mitsuba work together.
"""

from __future__ import annotations

from collections.abc import Callable

import chromium
import numpy as np
import parted
import pytest
import yaml
from editor import Server, Visit, difference

from velatura import kernel

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]

NAMES = ("Shade", "Bulb <b>")
BLACK = {"layers": [{"diffuse": {"albedo": 0.0}}]}
WHITE = {"name": "Chalk", "layers": [{"diffuse": {"albedo": 0.9}}]}


def dropped(page: Visit) -> None:
    """Drop two balls side by side on a page that shows black."""
    page.drop(("black.yaml", yaml.safe_dump(BLACK)))
    page.drop(("lamp.glb", parted.in_a_row(NAMES)))
    page.page.get_by_role("button", name="The object", exact=True).click()
    page.page.get_by_role("region", name="Parts of the object").wait_for()
    page.settled()


def test_a_part_of_an_object_has_a_material_of_its_own(visit: Open, served: Server) -> None:
    """Expected: the ball on the right becomes white, and the other stays black: on the page, saved, and by Mitsuba."""
    (served.folder / "chalk.yaml").write_text(yaml.safe_dump(WHITE))
    page = visit()
    dropped(page)
    before = page.picture()
    page.page.get_by_role("button", name="Material of Bulb <b>").click()
    page.page.get_by_role("button", name="chalk.yaml", exact=True).click()
    page.page.wait_for_function("() => velatura.store.get().parts")  # the file is read
    page.settled()
    assert [part["covers"] for part in page.state("parts")] == ["Bulb <b>", ""]
    after = page.picture()
    changed = np.abs(after - before).mean(axis=2) > 30
    assert changed[:, 34:].sum() > 60
    assert changed[:, :31].sum() < 5

    # A click on a part shows its layers
    box = page.page.locator("canvas").bounding_box()
    assert box
    for share, name, albedo in ((0.42, "Shade", 0.0), (0.58, "Bulb <b>", 0.9)):
        page.page.mouse.click(box["x"] + share * box["width"], box["y"] + 0.68 * box["height"])
        page.page.get_by_role("button", name=name, exact=True, pressed=True).wait_for()
        assert page.state("layers.0.keys.albedo") == albedo

    # The file has it, and Mitsuba draws it
    page.page.get_by_role("button", name="Save as").click()
    page.page.get_by_label("File name").fill("lamp.yaml")
    page.page.locator("dialog.save").get_by_role("button", name="Save").click()
    page.page.get_by_text("Saved lamp.yaml").wait_for()
    assert yaml.safe_load((served.folder / "lamp.yaml").read_text())["mix"][0]["covers"] == "Bulb <b>"
    page.page.get_by_role("button", name="Render", exact=True).click()
    dialog = page.page.locator("dialog.render")
    for label, value in (("Width", 64), ("Height", 48), ("Samples", 16)):
        dialog.get_by_label(label, exact=True).fill(str(value))
        dialog.get_by_label(label, exact=True).press("Enter")
    dialog.get_by_role("button", name="Render").click()
    dialog.locator("figure img").wait_for()
    (written,) = served.folder.glob("*.png")
    rendered = np.array(kernel.bitmap(written)).astype(float)
    assert rendered[31:35, 41:46].mean() > 100
    assert rendered[31:35, 18:23].mean() < 30

    # It is undone like all else
    page.page.locator("dialog.render").get_by_role("button", name="Close").click()
    page.page.keyboard.press("Control+z")
    assert page.state("parts") is None
    assert difference(page.picture(), before) < 2


def test_an_object_brings_its_own_materials(visit: Open) -> None:
    page = visit()
    page.drop(("lamp.glb", parted.in_a_row(NAMES)))
    page.page.get_by_role("button", name="The object with its materials").click()
    page.page.get_by_role("region", name="Parts of the object").wait_for()
    page.settled()
    parts = page.state("parts")
    assert [(part["name"], part["covers"]) for part in parts] == [(name, name) for name in NAMES]
    assert page.state("name") == "lamp"
    assert page.page.evaluate("velatura.problems") == []


def test_the_truth_is_that_of_a_dropped_object(visit: Open) -> None:
    """Expected: walks in gold and in black, where the model has them."""
    page = visit()
    dropped(page)
    page.page.get_by_role("button", name="Material of Bulb <b>").click()
    page.page.get_by_role("button", name="Gold", exact=True).click()
    page.page.wait_for_function("() => velatura.store.get().parts")
    page.settled()
    page.page.get_by_label("Compare", exact=True).select_option("split")
    page.page.get_by_label("With", exact=True).select_option("truth")
    page.page.wait_for_function("() => velatura.viewport.truth?.samples >= 8")
    red, _, blue = page.picture()[29:37, 35:39].mean(axis=(0, 1))
    assert red > blue + 40
    assert page.page.evaluate("velatura.problems") == []
