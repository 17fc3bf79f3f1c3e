"""
A roughness below a coat, texel by texel
========================================

A texture of the roughness of gold below a coat, recovered from a picture of a coated square under three lamps. The
pictures are the target, the start and the answer.
"""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

import drjit as dr  # noqa: E402

import velatura as vt  # noqa: E402

vt.register()

TRUE = np.random.default_rng(1).uniform(0.1, 0.45, (4, 4, 1)).astype(np.float32)
START = np.full((4, 4, 1), 0.25, np.float32)
LAMPS = ((2.0, 0.9), (-1.8, 1.3), (-0.2, -2.2))
RATE = 0.02  # of Adam at the first step


def scene_of(roughness: Any, size: int) -> Any:
    """The square from above, and the lamps."""
    coated = {
        "type": "layered",
        "layer0_eta": 1.5,
        "layer0_alpha": 0.1,
        "layer1_depth": 0.3,
        "layer1_sigma_a": 0.3,
        "layer2_conductor": "Au",
        "layer2_alpha": {"type": "bitmap", "bitmap": mi.Bitmap(roughness), "raw": True},
    }
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    view = mi.ScalarTransform4f().look_at([0, -1.5, 4], [0, 0, 0], [0, 1, 0])
    lamp = {"type": "area", "radiance": 8.0}
    lamps = {
        f"lamp{k}": {"type": "sphere", "center": [x, y, 2.6], "radius": 0.5, "emitter": lamp}
        for k, (x, y) in enumerate(LAMPS)
    }
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 2},
            "sensor": {"type": "perspective", "fov": 30, "to_world": view, "film": film},
            "sky": {"type": "constant", "radiance": 0.2},
            **lamps,
            "square": {"type": "rectangle", "bsdf": coated},
        }
    )


def difference(roughness: Any) -> float:
    """Root mean square by which texels are off."""
    return float(np.sqrt(np.mean((roughness - TRUE) ** 2)))


def recover(size: int = 48, spp: int = 16, steps: int = 60) -> Any:
    """The texels that are found."""
    target = mi.render(scene_of(TRUE, size), spp=32 * spp)
    scene = scene_of(START, size)
    parameters, key = mi.traverse(scene), "square.bsdf.layer2_alpha_u.data"  # one texture for both axes
    optimiser = mi.ad.Adam(lr=RATE, params={"roughness": mi.TensorXf(parameters[key])})

    def off() -> float:
        return difference(np.array(optimiser["roughness"]))

    for step in range(steps + 1):
        optimiser["roughness"] = dr.clip(optimiser["roughness"], 0.02, 0.9)
        parameters[key] = optimiser["roughness"]
        parameters.update()
        image = mi.render(scene, parameters, spp=spp, seed=step)
        loss = dr.mean(dr.square((image - target) / (target + 0.1)), axis=None)
        if step % 15 == 0:
            print(f"step {step:3}: texels off by {off():.4f}, loss {loss.array[0]:.4f}")
        dr.backward(loss)
        optimiser.set_learning_rate(RATE * 0.97**step)
        optimiser.step()
    return np.array(optimiser["roughness"])


if __name__ == "__main__":
    found = recover()
    pictures = [np.array(mi.render(scene_of(texels, 192), spp=256)) for texels in (TRUE, START, found)]
    plt.figure(figsize=(9, 3), layout="constrained")
    plt.imshow(np.clip(np.concatenate(pictures, axis=1), 0, 1) ** (1 / 2.2))
    plt.axis("off")
