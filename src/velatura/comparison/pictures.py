"""Spheres of the truth and of every model, in the same light."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from velatura import api, scenes
from velatura.comparison.result import Pictures
from velatura.model import Model
from velatura.stack import Described, dumps

SIZE = (192, 192)
SAMPLES = 256


def pictures(
    material: Described, models: Mapping[str, Any], seed: int, microsurface: bool, advance: Callable[[], None]
) -> Pictures:
    """Render spheres in the studio, by models and BSDFs; the reference twice, to estimate its noise.

    Raises:
        InvalidInput, MissingTool: as `scenes.render`.
    """
    api.register()
    walk = {"type": "layered_reference", "material": dumps(material, "json"), "microsurface": microsurface}

    def sphere(bsdf: object, spp: int, number: int) -> np.ndarray:
        image = scenes.render(bsdf, scene="sphere", env="studio", spp=spp, size=SIZE, seed=seed + number)
        advance()
        return image

    halves = [sphere({**walk, "seed": number}, SAMPLES // 2, number) for number in range(2)]
    noise = float(np.sqrt(np.mean((halves[0] - halves[1]) ** 2))) / 2
    bsdfs = {name: api.bsdf(material, m) if isinstance(m, Model) else m for name, m in models.items()}
    images = {name: sphere(bsdf, SAMPLES, 2) for name, bsdf in bsdfs.items()}
    return Pictures((halves[0] + halves[1]) / 2, noise, images)
