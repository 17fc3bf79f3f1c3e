"""The view of the page as Mitsuba's scene: an object of a material in an environment, from the page's camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.editor.messages import Body
from velatura.errors import InvalidInput
from velatura.scenes.surfaces import Mesh
from velatura.stack import Described

LIGHT = (".exr", ".hdr")  # files that light an object
STAND_IN = "ball"  # whose surroundings a mesh has


@dataclass(frozen=True)
class Shot:
    """The object, by name or as surfaces by the names of its parts, the environment, maybe with the light of a picture
    in the place of its own, its rotation in degrees about y, and the camera."""

    name: str
    surfaces: Mapping[str, Mesh] | None
    environment: str
    light: NDArray[np.float32] | None
    rotation: float
    camera: Mapping[str, Any]

    @classmethod
    def of(cls, body: Body, file: Path | None = None) -> Shot:
        """That of a body: `object` or `mesh`, `environment`, `light`, `rotation`, `camera`; `file` is an environment's.

        Raises:
            InvalidInput: an unknown object or environment, or no camera.
        """
        from velatura import scenes

        surfaces, environment, camera = body.get("mesh"), body.get("environment", "studio"), body.get("camera")
        name = body.get("object") if surfaces is None else STAND_IN
        if name not in scenes.OBJECTS:
            raise InvalidInput(f"object: must be one of {', '.join(scenes.OBJECTS)}, got {name!r}")
        if file is None and environment not in scenes.ENVIRONMENTS:
            raise InvalidInput(f"environment: must be one of {', '.join(scenes.ENVIRONMENTS)}, got {environment!r}")
        if camera is None:
            raise InvalidInput("camera: must be an object of fov, origin and target, got nothing")
        return cls(
            name, surfaces, str(file or environment), body.get("light"), math.fmod(body.get("rotation", 0), 360), camera
        )

    def scene(self, material: Described, bsdf: Callable[[Described], Any], size: tuple[int, int]) -> dict[str, Any]:
        """The scene of a material for `mi.load_dict`, with pixels; each part of the object has the BSDF of what covers
        it."""
        from velatura import scenes

        mi = kernel.mitsuba()
        if self.surfaces is None:
            scene = scenes.scene_dict(self.name, self.environment, bsdf(material), size)
        else:
            covering = [material.covering(name) for name in self.surfaces]
            made = {each: bsdf(each) for each in dict.fromkeys(covering)}
            scene = scenes.scene_dict(self.name, self.environment, made[covering[0]], size)
            del scene["object"]
            for number, (surface, each) in enumerate(zip(self.surfaces.values(), covering)):
                scene[f"object{number}"] = scenes.mesh(mi, surface, made[each])
        scene["light"] = scenes.emitter(mi, self.environment if self.light is None else self.light, self.rotation)
        scene["sensor"] |= {
            "to_world": mi.ScalarTransform4f().look_at(self.camera["origin"], self.camera["target"], [0, 1, 0]),
            "fov": self.camera["fov"],
        }
        return scene


def sides(body: Body, largest: int) -> tuple[int, int]:
    """Width and height in pixels. Raises InvalidInput."""
    size = body.get("size")
    if not isinstance(size, list) or len(size) != 2:
        raise InvalidInput("size: must be a width and a height")
    for side, length in zip(("width", "height"), size):
        if length > largest:
            raise InvalidInput(f"{side}: must be a whole number from 1 to {largest}, got {length}")
    return size[0], size[1]
