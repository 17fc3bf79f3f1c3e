"""The reference beside a model: the same view by the random walk through the layers, a few samples at a time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.editor.messages import Answer, Body, Verb, array, material_of, model_of
from velatura.errors import InvalidInput
from velatura.stack import Described

LARGEST = 512  # pixels along a side
MOST = 2**21  # samples of one call


def truth(body: Body) -> Answer:
    """The view by random walks: `picture` (h, w, 3), linear RGB, from the upper left.

    Light bounces between the facets of an interface where it does in the model. Of the body: `material`, `model`,
    `switches`, `object`, `environment`, `rotation` (degrees about y), `camera` {origin, target, fov in degrees over the
    shorter side}, `size` [w, h], `spp`, `seed`.
    """
    from velatura import scenes

    material = material_of(body)
    name, environment = body.get("object"), body.get("environment", "studio")
    if name not in scenes.OBJECTS:
        raise InvalidInput(f"object: must be one of {', '.join(scenes.OBJECTS)}, got {name!r}")
    if environment not in scenes.ENVIRONMENTS:
        raise InvalidInput(f"environment: must be one of {', '.join(scenes.ENVIRONMENTS)}, got {environment!r}")
    size = body.get("size")
    if not isinstance(size, list) or len(size) != 2:
        raise InvalidInput("size: must be a width and a height")
    for side, length in zip(("width", "height"), size):
        if length > LARGEST:
            raise InvalidInput(f"{side}: must be a whole number from 1 to {LARGEST}, got {length}")
    spp, seed, camera = body.get("spp", 4), body.get("seed", 1), body.get("camera")
    if camera is None:
        raise InvalidInput("camera: must be an object of fov, origin and target, got nothing")
    if size[0] * size[1] * spp > MOST:
        raise InvalidInput(f"spp: may be {MOST // (size[0] * size[1])} at most for this size, got {spp}")
    rotation = math.fmod(body.get("rotation", 0), 360)
    many = model_of(body).microsurface
    return {
        "picture": array(_rendered(material, many, name, environment, (size[0], size[1]), camera, rotation, spp, seed))
    }


@kernel.exclusive
def _rendered(
    material: Described,
    microsurface: bool,
    name: str,
    environment: str,
    size: tuple[int, int],
    camera: Mapping[str, Any],
    rotation: float,
    spp: int,
    seed: int,
) -> NDArray[np.float32]:
    from velatura import scenes
    from velatura.api import bsdf

    mi = kernel.mitsuba()
    scene = scenes.scene_dict(name, environment, bsdf(material, "reference", microsurface=microsurface), size)
    scene["light"] = scenes.emitter(mi, environment, rotation)
    scene["sensor"] |= {
        "to_world": mi.ScalarTransform4f().look_at(camera["origin"], camera["target"], [0, 1, 0]),
        "fov": camera["fov"],
    }
    return np.array(mi.render(mi.load_dict(scene), spp=spp, seed=seed))[..., :3]


#: What `service.VERBS` takes over.
VERBS: dict[str, Verb] = {"truth": truth}
