"""Materials of other programs in the editor, in headless Chromium: dropped, opened, and written for others.

Rationale: an artist comes with files of another program and leaves with such files, by drops, dialogs and downloads
that only a browser has.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import chromium
import numpy as np
import pytest
from editor import Server, Tabs, Visit, unexpected
from matplotlib.image import imsave

import velatura as vt
from velatura.editor import library

pytestmark = pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing())

Open = Callable[..., Visit]
REFUSED = "the server responded with a status of 4"

SURFACE = """<open_pbr_surface name="{0}S" type="surfaceshader">
    <input name="base_color" type="color3" {1}/>
    <input name="coat_weight" type="float" value="1"/>
    <input name="fuzz_weight" type="float" value="0.2"/>
  </open_pbr_surface>
  <surfacematerial name="{0}" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="{0}S"/>
  </surfacematerial>"""
BLUE = 'value="0.1, 0.3, 0.6"'
SCENE = """<scene version="3.0.0"><bsdf type="principled" id="Gilt"><rgb name="base_color" value="0.9, 0.6, 0.2"/>
<float name="metallic" value="1"/><float name="roughness" value="0.3"/></bsdf></scene>"""
TRIANGLE = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [
        {
            "byteLength": 36,
            "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA",
        }
    ],
    "materials": [{"name": "Steel", "pbrMetallicRoughness": {"roughnessFactor": 0.4}}],
}


def mtlx(*materials: str) -> str:
    body = "\n".join(materials)
    return f'<?xml version="1.0"?>\n<materialx version="1.39" colorspace="lin_rec709">\n{body}\n</materialx>'


@pytest.fixture
def visit(tabs: Tabs, served: Server) -> Iterator[Open]:
    """Opens the page in a browser without a past; no console may complain of more than what is expected."""
    expected: list[str] = []

    def begin(*expecting: str) -> Visit:
        expected.extend(expecting)
        return tabs.visit(served.entrance)

    yield begin
    complaints = unexpected(tabs.forget(), expected)
    served.clear()
    assert complaints == []


def said(page: Visit, text: str) -> None:
    page.page.locator(".messages").get_by_text(text).wait_for()


def button(page: Visit, name: str) -> Any:
    return page.page.get_by_role("button", name=name, exact=True)


# In ------------------------------------------------------------------------------------------------------------------


def test_materials_of_other_programs_are_dropped_and_what_is_left_is_listed(visit: Open) -> None:
    page = visit(REFUSED)
    page.drop(("painted.mtlx", mtlx(SURFACE.format("Painted", BLUE))))
    said(page, "Opened Painted. Not carried from painted.mtlx, or not as it was: fuzz_weight.")
    remarks = page.page.locator(".left")
    remarks.locator("summary").click()
    assert "fuzz_weight 0.2: a stack has no fibres above it" in remarks.inner_text()
    assert [layer["kind"] for layer in page.state("layers")] == ["interface", "interface", "diffuse"]

    page.drop(("gilt.xml", SCENE))
    said(page, "Opened Gilt")
    page.drop(("steel.gltf", json.dumps({"asset": {"version": "2.0"}, "materials": TRIANGLE["materials"]})))
    said(page, "Opened Steel")
    page.drop(text="coated-gold")
    page.page.wait_for_function("() => velatura.store.get().layers[2]?.keys.conductor === 'Au'")
    assert remarks.count() == 0

    page.drop(text="no-such-thing")
    said(page, "no-such-thing: is not the name of a preset")
    page.drop(("broken.mtlx", "<materialx"))
    said(page, "broken.mtlx: ")
    page.drop(("empty.gltf", json.dumps({"asset": {"version": "2.0"}})))
    said(page, "empty.gltf: holds neither an object nor a material")


def test_one_of_several_materials_and_an_object_or_its_material_are_asked_for(visit: Open) -> None:
    page = visit()
    ask = page.page.locator("dialog.choice")
    page.drop(("two.mtlx", mtlx(SURFACE.format("Blue", BLUE), SURFACE.format("Red", 'value="0.6, 0.1, 0.1"'))))
    ask.get_by_text("two.mtlx holds 2 materials").wait_for()
    ask.get_by_role("button", name="Red").click()
    said(page, "Opened Red")

    page.drop(("part.gltf", json.dumps(TRIANGLE)))
    ask.get_by_text("part.gltf holds an object and materials").wait_for()
    page.page.keyboard.press("Escape")
    assert page.state("name") == "Red"
    page.drop(("part.gltf", json.dumps(TRIANGLE)))
    ask.get_by_role("button", name="The object", exact=True).click()
    page.page.wait_for_function("() => velatura.store.get().view.object === 'file:part.gltf'")
    page.drop(("part.gltf", json.dumps(TRIANGLE)))
    ask.get_by_role("button", name="A material").click()
    said(page, "Opened Steel")
    assert page.state("view.object") == "file:part.gltf"


def test_a_file_of_the_folder_is_opened_with_its_image_and_one_is_mixed_in(visit: Open, served: Server) -> None:
    image = io.BytesIO()
    imsave(image, np.full((4, 4, 3), 0.5), format="png")
    (served.folder / "gilt.xml").write_text(SCENE)
    page = visit()
    texture = '<image name="i" type="color3"><input name="file" type="filename" value="wood.png"/></image>'
    page.drop(("wood.mtlx", mtlx(texture, SURFACE.format("Wood", 'nodename="i"'))), ("wood.png", image.getvalue()))
    said(page, "Opened Wood")
    assert (served.folder / "wood.png").read_bytes() == image.getvalue()
    assert page.state("layers.2.keys.albedo.texture") == "wood.png"
    page.settled()

    page.page.get_by_role("button", name="Mix with", exact=False).click()
    page.page.get_by_role("button", name="gilt.xml", exact=True).click()
    said(page, "Mixed with Gilt")

    page.page.get_by_role("button", name="Open", exact=True).click()
    page.page.get_by_role("searchbox", name="Search").fill("coated-lens")
    page.page.keyboard.press("Enter")
    page.page.wait_for_function("(name) => velatura.store.get().name === name", arg=vt.preset("coated-lens").name)
    assert sorted(file.name for file in served.folder.iterdir()) == ["gilt.xml", "wood.png"]


def test_images_of_subfolders_are_put_into_the_folder(visit: Open, served: Server) -> None:
    """Expected: the image by the name that is free there, though the glTF has it in a folder."""
    page = visit()
    (served.folder / "wood.png").write_bytes(b"another")
    image = io.BytesIO()
    imsave(image, np.full((4, 4, 3), 0.5), format="png")
    core = {"baseColorTexture": {"index": 0}, "metallicFactor": 0}
    scene = {
        "asset": {"version": "2.0"},
        "images": [{"uri": "textures/wood.png"}],
        "textures": [{"source": 0}],
        "materials": [{"name": "Oak", "pbrMetallicRoughness": core}],
    }
    page.drop(("oak.gltf", json.dumps(scene)), ("wood.png", image.getvalue()))
    said(page, "Opened Oak")
    assert (served.folder / "wood-2.png").read_bytes() == image.getvalue()
    assert '"texture":"wood-2.png"' in page.page.evaluate("JSON.stringify(velatura.store.get().layers)")
    page.settled()


# Out -----------------------------------------------------------------------------------------------------------------


def test_an_export_shows_its_loss_and_what_the_program_has_of_the_material(visit: Open) -> None:
    """Expected: the loss of the facts; B is not the material itself, though the file holds that, too."""
    page = visit()
    button(page, "Export").click()
    dialog, format = page.page.locator("dialog.export"), page.page.get_by_label("Format", exact=True)
    format.select_option("gltf")
    dialog.locator(".loss").wait_for()
    made = vt.export("coated-gold", "gltf")
    variations = [each["variation"] for each in made.facts["loss"]]
    assert f"{100 * np.mean(variations):.1f} % of the light goes elsewhere" in dialog.locator(".loss").inner_text()
    assert dialog.locator(".lost li").all_inner_texts() == list(made.facts["left_out"])
    with page.page.expect_download() as download:
        dialog.get_by_role("button", name="Download the facts").click()
    assert download.value.suggested_filename == "coated-brushed-gold.gltf.json"
    facts = json.loads(Path(download.value.path()).read_text())
    assert (facts["format"], facts["file"]) == ("gltf", "coated-brushed-gold.gltf")

    button(page, "Compare").click()
    said(page, "B is what glTF 2.0 has of the material")
    assert page.state("view.mode") == "split"
    back = page.state("view.other.material")
    assert back["layers"][-1]["interface"].get("conductor") is None
    page.settled()


def test_a_material_is_taken_on_one_page(visit: Open) -> None:
    """Expected: what `velatura show` draws, seen before it is taken."""
    page = visit()
    button(page, "Export").click()
    dialog = page.page.locator("dialog.export")
    page.page.get_by_label("Format", exact=True).select_option("page-svg")
    dialog.locator("figure img").wait_for(timeout=90_000)
    page.page.wait_for_function("() => document.querySelector('dialog.export img').naturalWidth > 600")
    with page.page.expect_download() as download:
        dialog.get_by_role("button", name="Download .svg").click()
    assert download.value.suggested_filename == "coated-brushed-gold.svg"
    assert ElementTree.parse(download.value.path()).getroot().tag.endswith("svg")


def test_options_of_the_command_line_are_controls_of_the_formats_that_take_them(visit: Open) -> None:
    page = visit(REFUSED)
    page.page.get_by_label("Model", exact=True).select_option("belcour2018")
    button(page, "Export").click()
    dialog, format = page.page.locator("dialog.export"), page.page.get_by_label("Format", exact=True)
    text = dialog.locator("textarea")
    format.select_option("openpbr")
    text.wait_for()
    assert dialog.locator(".options").count() == 0
    format.select_option("hlsl")
    text.wait_for()
    dialog.get_by_label("Prefix").fill("gold")
    dialog.get_by_label("Prefix").press("Enter")
    dialog.get_by_label("Fixed values").check()
    dialog.get_by_label("Half floats").check()
    dialog.get_by_label("First binding").fill("3")
    dialog.get_by_label("First binding").press("Enter")
    page.page.wait_for_function("() => document.querySelector('dialog.export textarea')?.value.includes('t3')")
    options = {"prefix": "gold", "constant": ["all"], "half": True, "binding": 3}
    assert text.input_value() == vt.export("coated-gold", "hlsl", "belcour2018", **options).text
    dialog.get_by_label("Shared tables").check()
    with page.page.expect_download() as download:
        dialog.get_by_role("button", name="Download velatura.tables.bin").click()
    shared = vt.export("coated-gold", "hlsl", "belcour2018", tables="velatura.tables.bin", **options).apart
    assert [Path(download.value.path()).read_bytes()] == list(shared.values())
    dialog.get_by_label("Prefix").fill("no name")
    dialog.get_by_label("Prefix").press("Enter")
    dialog.locator(".problem").get_by_text("prefix").wait_for()


# The folder ----------------------------------------------------------------------------------------------------------


def test_files_of_the_folder_are_renamed_removed_and_put_back(visit: Open, served: Server) -> None:
    """Expected: the open material is saved to its file's new name; what is deleted is back as it was."""
    page = visit(REFUSED)
    for name in ("gold", "copper"):
        (served.folder / f"{name}.yaml").write_text("layers: [{interface: {conductor: Au}}]\n")
    button(page, "Open").click()
    button(page, "gold.yaml").click()
    said(page, "Opened")
    button(page, "Open").click()
    button(page, "Rename gold.yaml").click()
    field = page.page.get_by_label("Name of gold.yaml")
    field.fill("leaf")
    field.press("Enter")
    button(page, "leaf.yaml").wait_for()
    assert page.page.locator(".document").inner_text() == "leaf.yaml"
    button(page, "Rename leaf.yaml").click()
    field = page.page.get_by_label("Name of leaf.yaml")
    field.fill("copper")
    field.press("Enter")
    page.page.locator("dialog.open .problem").get_by_text("copper.yaml: exists already").wait_for()
    button(page, "Rename leaf.yaml").click()
    page.page.get_by_label("Name of leaf.yaml").press("Escape")

    button(page, "Delete copper.yaml").click()
    page.page.get_by_text("copper.yaml is deleted.").wait_for()
    button(page, "copper.yaml").wait_for(state="detached")
    assert not (served.folder / "copper.yaml").exists()
    button(page, "Undo the deletion").click()
    button(page, "copper.yaml").wait_for()
    assert (served.folder / "copper.yaml").read_text() == "layers: [{interface: {conductor: Au}}]\n"
    (served.folder / ".velatura-removed").rmdir()


def test_files_of_the_folder_have_pictures_and_are_found_by_tags(visit: Open, served: Server) -> None:
    """Expected: a file that was saved has a picture of what was seen, and tags by keys alone, by which it is found."""
    page = visit()
    (served.folder / "copper.yaml").write_text("layers: [{interface: {conductor: Cu}}]\n")
    button(page, "Save as").click()
    page.page.get_by_label("File name").fill("gold.yaml")
    page.page.locator("dialog.save").get_by_role("button", name="Save").click()
    kept = served.folder / library.FOLDER / "gold.yaml.json"
    while not kept.is_file():
        page.page.wait_for_timeout(100)
    button(page, "Open").click()
    button(page, "Tags of gold.yaml").press("Enter")
    page.page.keyboard.type("Warm, brushed ")
    page.page.keyboard.press("Enter")
    button(page, "Warm").press("Enter")
    button(page, "copper.yaml").wait_for(state="detached")
    picture = button(page, "gold.yaml").locator("img")
    assert picture.evaluate("image => image.decode().then(() => image.naturalWidth)") == 144
    assert json.loads(kept.read_text())["tags"] == ["Warm", "brushed"]
    button(page, "Warm").press("Enter")
    button(page, "copper.yaml").wait_for()
    button(page, "Tags of gold.yaml").click()
    page.page.keyboard.press("Control+a")
    page.page.keyboard.press("Delete")
    page.page.keyboard.press("Enter")
    button(page, "Warm").wait_for(state="detached")


# Light ---------------------------------------------------------------------------------------------------------------


def test_light_of_ones_own_is_dropped_and_turned_on_the_picture(visit: Open, tmp_path: Path) -> None:
    """Expected: a drag with Shift turns the light and not the camera, in one step; .005 rad a pixel."""
    page = visit()
    light = np.full((8, 16, 3), 0.2, np.float32)
    light[2:4, 3:5] = 20
    vt.scenes.write_image(light, tmp_path / "lamp.exr")
    page.drop(("lamp.exr", (tmp_path / "lamp.exr").read_bytes()))
    page.page.wait_for_function("() => velatura.store.get().view.environment === 'file:lamp.exr'")
    before = page.picture()
    picture = page.page.locator("canvas").first.bounding_box()
    x, y = picture["x"] + picture["width"] / 2, picture["y"] + picture["height"] / 2
    page.page.keyboard.down("Shift")
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x + 100, y, steps=5)
    page.page.mouse.up()
    page.page.keyboard.up("Shift")
    assert page.state("view.rotation") == pytest.approx(np.degrees(0.5), abs=0.5)
    assert page.state("camera") is None
    assert np.abs(page.picture() - before).mean() > 0.5
    page.page.keyboard.press("Control+z")
    assert page.state("view.rotation") == 0
    page.page.locator("canvas").first.press("Shift+ArrowRight")
    assert page.state("view.rotation") == pytest.approx(np.degrees(0.1), abs=0.1)
    page.settled()


def test_a_photograph_is_dropped_beside_the_picture_and_wiped(visit: Open) -> None:
    """Expected: its colours as they are, right of the line, in the middle of black where it is narrower, upright."""
    page = visit()
    page.page.get_by_label("Exposure, in stops", exact=True).fill("1")
    page.page.get_by_label("Exposure, in stops", exact=True).press("Enter")
    buffer = io.BytesIO()
    halves = np.concatenate(
        [np.full((20, 40, 3), (200, 30, 90), np.uint8), np.full((20, 40, 3), (10, 160, 60), np.uint8)]
    )
    imsave(buffer, halves)
    before = page.picture()
    page.drop(("photo.png", buffer.getvalue()))
    said(page, "photo.png is beside the picture")
    page.page.get_by_text("photo.png", exact=True).first.wait_for()
    shown = page.picture()
    assert shown[:, :28] == pytest.approx(before[:, :28], abs=2)
    assert shown[10, 36] == pytest.approx((200, 30, 90), abs=1)
    assert shown[38, 36] == pytest.approx((10, 160, 60), abs=1)
    assert shown[10, 62] == pytest.approx((0, 0, 0), abs=1)

    # The line is moved by keys, and by hand
    line = page.page.get_by_role("slider", name="Where the picture is split")
    line.press("ArrowRight")
    box = page.page.locator("canvas").first.bounding_box()
    at = line.bounding_box()
    page.page.mouse.move(at["x"] + at["width"] / 2, at["y"] + at["height"] / 2)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 0.9 * box["width"], at["y"] + at["height"] / 2, steps=4)
    page.page.mouse.up()
    assert page.picture()[10, 36] == pytest.approx(before[10, 36], abs=2)

    # It outlives the page, and a difference is one of materials
    page.page.reload()
    page.ready()
    assert page.state("view.other.title") == "photo.png"
    page.page.get_by_label("Compare", exact=True).select_option("difference")
    assert page.state("view.other.model")
    page.page.get_by_label("Compare", exact=True).select_option("single")
    assert page.picture() == pytest.approx(before, abs=2)

    page.drop(("broken.png", b"no image"))
    said(page, "broken.png: is no image that this browser reads")
