"""Pictures of materials by Cycles: a plane, a camera, and one light at a time. Run by the Python of Blender's wheel."""

from __future__ import annotations

import json
import math
import runpy
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

# Where the wheel keeps `oslquery`, which Blender reads the inputs of a shader with
sys.path.append(bpy.utils.resource_path("LOCAL") + f"/python/lib/python3.{sys.version_info[1]}/site-packages")


def main(job: dict[str, Any]) -> None:
    """Pictures (lights, seeds, height, width, 3) of each material, to the file named.

    Of a job with `cosines`, pictures (cosines, height, width, 3) along one direction each, under a white world, of the
    middle of the plane, or of its point `at`.
    """
    for script, output in job["materials"]:
        scene = _scene(job)
        _material(script)
        if "cosines" in job:
            pictures: Any = [_along(scene, job, cosine) for cosine in job["cosines"]]
        else:
            pictures = [[_picture(scene, job, light, seed) for seed in job["seeds"]] for light in job["lights"]]
        np.save(output, np.array(pictures, np.float32))


def _scene(job: dict[str, Any]) -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    bpy.ops.mesh.primitive_plane_add(size=2 * job["half"])
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    camera = bpy.data.cameras.new("camera")
    camera.angle = math.radians(job["fov"])
    seen = bpy.data.objects.new("camera", camera)
    seen.location = job["camera"]
    seen.rotation_euler = (-Vector(job["camera"])).to_track_quat("-Z", "Y").to_euler()
    sun = bpy.data.lights.new("sun", "SUN")
    sun.angle = 0
    scene.collection.objects.link(seen)
    scene.collection.objects.link(bpy.data.objects.new("sun", sun))
    scene.camera = seen

    scene.render.resolution_x = scene.render.resolution_y = job["size"]
    if job["threads"]:
        scene.render.threads_mode, scene.render.threads = "FIXED", job["threads"]
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.view_settings.view_transform = "Raw"
    return scene


def _material(script: str) -> None:
    """Put the material that an exported script makes onto the plane."""
    made = runpy.run_path(script)
    material = made["make"]() if "make" in made else made["material"]
    bpy.data.objects["Plane"].data.materials.append(material)
    scene = bpy.context.scene
    scene.cycles.device, scene.cycles.pixel_filter_type = "CPU", "BOX"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.max_bounces = scene.cycles.transmission_bounces = 2
    for node in material.node_tree.nodes:
        if node.type == "SCRIPT":
            assert bpy.app.build_options.cycles_osl and scene.cycles.shading_system and node.bytecode_hash


def _along(scene: Any, job: dict[str, Any], cosine: float) -> np.ndarray:
    """Light from one direction, in the plane of the tangent."""
    away = Vector((math.sqrt(1 - cosine * cosine), 0, cosine))
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 0.1
    at = Vector((*job.get("at", (0, 0)), 0))
    scene.camera.location, scene.camera.rotation_euler = at + 3 * away, (-away).to_track_quat("-Z", "Y").to_euler()
    return _picture(scene, job, None, job["seeds"][0])


def _picture(scene: Any, job: dict[str, Any], light: list[float] | None, seed: int) -> np.ndarray:
    """The picture under a white world, or a sun in a direction."""
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = [light is None] * 3 + [1]
    sun = bpy.data.objects["sun"]
    sun.data.energy = 0.0 if light is None else 1.0
    sun.rotation_euler = (-Vector(light or (0, 0, 1))).to_track_quat("-Z", "Y").to_euler()
    scene.cycles.samples, scene.cycles.seed = job["spp"], seed
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(image.pixels[:]).reshape(job["size"], job["size"], 4)
        bpy.data.images.remove(image)
    return pixels[::-1, :, :3]


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text()))
