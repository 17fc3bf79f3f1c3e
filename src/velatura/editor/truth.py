"""The reference beside a model: the same view by the random walk through the layers, a few samples at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.editor.messages import Answer, Body, Verb, array, material_of, model_of
from velatura.editor.shot import Shot, sides
from velatura.errors import InvalidInput
from velatura.stack import Described

LARGEST = 512  # pixels along a side
MOST = 2**21  # samples of one call


def truth(body: Body) -> Answer:
    """The view by random walks: `picture` (h, w, 3), linear RGB, from the upper left.

    Light bounces between the facets of an interface where it does in the model. Of the body: `material`, `model`,
    `switches`, `object` or `mesh`, `environment`, the `light` of a picture in the place of its own, `rotation` (degrees
    about y), `camera` {origin, target, fov in degrees over the shorter side}, `size` [w, h], `spp`, `seed`.
    """
    material, shot, size = material_of(body), Shot.of(body), sides(body, LARGEST)
    spp, seed = body.get("spp", 4), body.get("seed", 1)
    if size[0] * size[1] * spp > MOST:
        raise InvalidInput(f"spp: may be {MOST // (size[0] * size[1])} at most for this size, got {spp}")
    return {"picture": array(_rendered(material, model_of(body).microsurface, shot, size, spp, seed))}


@kernel.exclusive
def _rendered(
    material: Described, microsurface: bool, shot: Shot, size: tuple[int, int], spp: int, seed: int
) -> NDArray[np.float32]:
    from velatura.api import bsdf

    mi = kernel.mitsuba()
    scene = shot.scene(material, lambda part: bsdf(part, "reference", microsurface=microsurface), size)
    return np.array(mi.render(mi.load_dict(scene), spp=spp, seed=seed))[..., :3]


#: What `service.VERBS` takes over.
VERBS: dict[str, Verb] = {"truth": truth}
