"""The whole scene as a Mitsuba dictionary: an object of a material, on a neutral plinth, in an environment, seen."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel
from velatura.errors import InvalidInput
from velatura.renderer.packets import aligned
from velatura.scenes.environments import emitter
from velatura.scenes.objects import OBJECTS, View, ground, plinth
from velatura.scenes.surfaces import Mesh

Name = str | os.PathLike[str]
Size = int | str | Sequence[int]

#: The id of the bsdf, in a scene file, whose place the material takes.
MATERIAL_ID = "material"

#: Longest path in surfaces met; enough for light to leave the ball's cavity.
MAX_DEPTH = 6
LARGEST = 16384  # pixels of a side

#: A photographer's grey card.
_GREY = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.18}}


@kernel.exclusive
def scene_dict(
    scene: Name = "ball",
    env: Name | None = None,
    bsdf: Any = None,
    size: Size | None = None,
    zoom: float = 1.0,
) -> dict[str, Any]:
    """A scene for `mi.load_dict`, to be rendered unchanged or after changes.

    Args:
        scene: a name of `OBJECTS` ("ball", "sphere", ...), or a Mitsuba scene file (.xml), in which every shape whose
            bsdf has the id "material" gets the material, and which keeps its own cameras, integrator and lights.
        env: one of `ENVIRONMENTS`, or an .exr or .hdr file; None means a scene file's own lights, or else the
            studio. In the furnace the object floats alone, so that a material that loses no light vanishes.
        bsdf: a `mi.BSDF`, or the dictionary of one.
        size: width and height in pixels, one number for both, or text such as "640x360"; None means a scene file's own,
            or else 512 x 512.
        zoom: how much larger the object appears; at 1 the ball covers half of the picture, at 1.2 three quarters.

    Raises:
        InvalidInput: an unknown scene or environment, an impossible size, a file that cannot be read, a scene file
            without a "material", without integrator, sensor or pixels, or that Mitsuba refuses.
        MissingTool: as `kernel.mitsuba`.
    """
    pixels = None if size is None else width_and_height(size)
    mi = kernel.mitsuba()
    material = kernel.load_dict(bsdf) if isinstance(bsdf, dict) else bsdf
    if is_file(scene):
        return _from_file(mi, os.fspath(scene), env, material, pixels)
    if scene not in OBJECTS:
        raise InvalidInput(f"unknown scene {scene!r}: give {', '.join(OBJECTS)}, or a Mitsuba scene file (.xml)")

    chosen, chosen_env = OBJECTS[str(scene)], "studio" if env is None else env
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": MAX_DEPTH},
        "sensor": _camera(mi, chosen.view, pixels or (512, 512), zoom),
        "light": emitter(mi, chosen_env),
        "object": mesh(mi, chosen.surface(), material),
        **_surroundings(mi, chosen_env),
    }


def width_and_height(size: Any, name: str = "size") -> tuple[int, int]:
    """The pixels of a picture along both sides, given as a pair, as one number, or as text. Raises InvalidInput."""
    sides = size if isinstance(size, (tuple, list)) else (size, size)
    if isinstance(size, str) and (text := re.fullmatch(r"([0-9]{1,5})(?:x([0-9]{1,5}))?", size)):
        sides = int(text[1]), int(text[2] or text[1])
    if len(sides) != 2 or not all(isinstance(side, (int, np.integer)) and 1 <= side <= LARGEST for side in sides):
        raise InvalidInput(f"{name} is {size!r}, and must be pixels, (width, height) or 'WxH', from 1 to {LARGEST}")
    return int(sides[0]), int(sides[1])


def is_file(scene: Name) -> bool:
    """Whether a scene is a Mitsuba scene file."""
    return isinstance(scene, str | os.PathLike) and Path(scene).suffix.lower() == ".xml"


@contextlib.contextmanager
def blamed(scene: Name) -> Iterator[None]:
    """Raises InvalidInput about a scene file for what Mitsuba refuses in the block; other scenes are our own."""
    try:
        yield
    except RuntimeError as error:
        if not is_file(scene):
            raise
        raise InvalidInput(f"{scene}: {kernel.reason(error)}") from error


def mesh(mi: Any, surface: Mesh, bsdf: Any) -> Any:
    """A surface of a material, as a `mi.Mesh` of the current variant."""
    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    shape = mi.Mesh("", len(surface.positions), len(surface.triangles), properties, True, True)
    buffers = mi.traverse(shape)
    buffers["vertex_positions"] = aligned(surface.positions.ravel())
    buffers["vertex_normals"] = aligned(surface.normals.ravel())
    buffers["vertex_texcoords"] = aligned(surface.uv.ravel())
    buffers["faces"] = aligned(surface.triangles.ravel(), np.uint32)
    buffers.update()
    return shape


def _surroundings(mi: Any, env: Name) -> dict[str, Any]:
    if env == "furnace":
        return {}
    bodies = {"plinth": plinth()}
    if env == "sky":
        bodies["ground"] = ground()  # the sky ends at the horizon
    return {name: mesh(mi, surface, mi.load_dict(_GREY)) for name, surface in bodies.items()}


def _camera(mi: Any, view: View, size: tuple[int, int], zoom: float) -> dict[str, Any]:
    return {
        "type": "perspective",
        "fov": float(2.0 * np.degrees(np.arctan(np.tan(np.radians(view.fov / 2.0)) / zoom))),
        "fov_axis": "smaller",
        "to_world": mi.ScalarTransform4f().look_at(list(view.origin), list(view.target), [0, 1, 0]),
        "sampler": {"type": "independent"},
        "film": {
            "type": "hdrfilm",
            "width": size[0],
            "height": size[1],
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "gaussian"},
        },
    }


def _from_file(mi: Any, path: str, env: Name | None, material: Any, size: tuple[int, int] | None) -> dict[str, Any]:
    # Read the scene
    if not os.path.isfile(path):
        raise InvalidInput(f"{path}: no such scene file")
    kernel.allow_pictures()
    with blamed(path):
        read = mi.load_file(path, optimize=False)
    if not isinstance(read, mi.Scene):
        raise InvalidInput(f"{path}: holds no <scene>")
    if read.integrator() is None:
        raise InvalidInput(f'{path}: has no integrator, such as <integrator type="path"/>')
    if not read.sensors():
        raise InvalidInput(f'{path}: has no sensor, such as <sensor type="perspective"/>')
    free = [sensor for sensor in read.sensors() if sensor.get_shape() is None]
    if any(sensor.class_name() == "IrradianceMeter" for sensor in free):
        raise InvalidInput(f"{path}: an irradiancemeter must stand within the shape that it measures")

    # Give the material to its shapes
    chosen = [shape for shape in read.shapes() if shape.bsdf() is not None and shape.bsdf().id() == MATERIAL_ID]
    if not chosen:
        raise InvalidInput(f'{path}: no shape has a bsdf with id="{MATERIAL_ID}", whose place the material would take')
    for shape in chosen:
        shape.set_bsdf(material)

    # Keep its lights, those of its shapes aside, unless others are asked for
    lights = [light for light in read.emitters() if not mi.has_flag(light.flags(), mi.EmitterFlags.Surface)]
    if env is not None or not read.emitters():
        wanted = emitter(mi, "studio" if env is None else env)
        lights = [*(light for light in lights if not light.is_environment()), wanted]

    # Resize its pictures
    for sensor in read.sensors():
        if size:
            with blamed(path):
                parameters = mi.traverse(sensor)
                parameters["film.size"] = list(size)
                parameters.update()
        if not all(sensor.film().size()):
            raise InvalidInput(f"{path}: the film of a sensor has no pixels")

    # Keep the scene that was read, in which Mitsuba sees nothing to render, as long as its parts are used
    parts = {"sensor": free, "light": lights, "shape": read.shapes()}
    numbered = {f"{kind}_{i}": part for kind, several in parts.items() for i, part in enumerate(several)}
    return {"type": "scene", "integrator": read.integrator(), "read": read, **numbered}
