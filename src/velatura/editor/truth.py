"""The truth beside a model: the same view by the random walk through the layers, a few samples at a time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.editor import bundle
from velatura.editor.bodies import Answer, Body, Verb, array, material_of
from velatura.errors import InvalidInput
from velatura.stack import Stack

LARGEST = 512  # pixels along a side
MOST = 64  # samples per pixel of one call


def truth(body: Body) -> Answer:
    """The view as paths see it: `picture` (h, w, 3), linear RGB, from the upper left.

    Of the body: `material`, `object`, `environment`, `rotation` (degrees about y), `camera` {origin, target, fov in
    degrees over the shorter side}, `size` [w, h], `spp`, `seed`.
    """
    from velatura import scenes

    stack = material_of(body)
    name, environment = body.get("object"), body.get("environment", "studio")
    if name not in scenes.OBJECTS:
        raise InvalidInput(f"object: the truth knows {', '.join(scenes.OBJECTS)}, got {name!r}")
    known = {*scenes.ENVIRONMENTS, *bundle.environments()}
    if environment not in known:
        raise InvalidInput(f"environment: the truth knows {', '.join(sorted(known))}, got {environment!r}")
    size = [_count(key, value, LARGEST) for key, value in zip(("width", "height"), body.get("size") or ())]
    if len(size) != 2:
        raise InvalidInput("size: must be a width and a height")
    spp, seed = _count("spp", body.get("spp", 4), MOST), _count("seed", body.get("seed", 1), 2**31)
    camera, turn = _camera(body.get("camera")), _number("rotation", body.get("rotation", 0))

    return {"picture": array(_rendered(stack, name, environment, (size[0], size[1]), camera, turn, spp, seed))}


@kernel.exclusive
def _rendered(
    stack: Stack,
    name: str,
    environment: str,
    size: tuple[int, int],
    camera: Mapping[str, Any],
    turn: float,
    spp: int,
    seed: int,
) -> NDArray[np.float32]:
    from velatura import scenes
    from velatura.api import bsdf

    mi = kernel.mitsuba()
    lit = bundle.STATIC / "environments" / f"{environment}.exr"
    light = str(lit) if environment in bundle.environments() else environment
    scene = scenes.scene_dict(name, light, bsdf(stack, "reference"), size)
    transform = mi.ScalarTransform4f()
    scene["sensor"] |= {
        "to_world": transform.look_at(camera["origin"], camera["target"], [0, 1, 0]),
        "fov": camera["fov"],
    }
    if environment not in ("sky", "furnace"):
        scene["light"]["to_world"] = transform.rotate([0, 1, 0], turn)
    return np.array(mi.render(mi.load_dict(scene), spp=spp, seed=seed))[..., :3]


def _count(key: str, value: Any, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise InvalidInput(f"{key}: must be a whole number from 1 to {most}, got {value!r}")
    return value


def _number(key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidInput(f"{key}: must be a number, got {value!r}")
    return float(value)


def _camera(camera: Any) -> dict[str, Any]:
    """Where the camera is, what it looks at, and how wide."""
    camera = camera if isinstance(camera, Mapping) else {}
    found: dict[str, Any] = {"fov": _number("camera.fov", camera.get("fov"))}
    for key in ("origin", "target"):
        point = camera.get(key)
        if not isinstance(point, list) or len(point) != 3:
            raise InvalidInput(f"camera.{key}: must be three numbers, got {point!r}")
        found[key] = [_number(f"camera.{key}", x) for x in point]
    return found


#: What `service.VERBS` takes over.
VERBS: dict[str, Verb] = {"truth": truth}
