"""
A coat and its base from a picture
==================================

The depth of a coat and the roughness of the gold below it, recovered from one picture by gradients through Mitsuba.
The pictures are the target, the start and the answer.
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

TRUE = {"depth": 1.0, "alpha": 0.25}
START = {"depth": 0.3, "alpha": 0.08}
RATES = {"depth": 0.06, "alpha": 0.015}  # of Adam at the first step
PARAMETERS = {"depth": ["layer1_depth"], "alpha": ["layer2_alpha_u", "layer2_alpha_v"]}


def scene_of(depth: float, alpha: float, size: int) -> Any:
    """A coated sphere under a grey sky and one lamp."""
    coated = {
        "type": "layered",
        "layer0_eta": 1.5,
        "layer0_alpha": 0.02,
        "layer1_depth": depth,
        "layer1_sigma_a": {"type": "rgb", "value": [0.1, 0.4, 0.9]},
        "layer2_conductor": "Au",
        "layer2_alpha": alpha,
    }
    lamp = mi.ScalarTransform4f().look_at([-3, -3, 4], [0, 0, 0], [0, 0, 1]).scale(0.7)
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    view = mi.ScalarTransform4f().look_at([0, -4, 1], [0, 0, 0], [0, 0, 1])
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 2},
            "sensor": {"type": "perspective", "fov": 32, "to_world": view, "film": film},
            "sky": {"type": "constant", "radiance": 0.4},
            "lamp": {"type": "rectangle", "to_world": lamp, "emitter": {"type": "area", "radiance": 20.0}},
            "sphere": {"type": "sphere", "bsdf": coated},
        }
    )


def recover(size: int = 64, spp: int = 16, steps: int = 60) -> dict[str, float]:
    """The parameters that are found."""
    target = mi.render(scene_of(**TRUE, size=size), spp=32 * spp)
    scene = scene_of(**START, size=size)
    parameters = mi.traverse(scene)
    optimiser = mi.ad.Adam(lr=0.01, beta_1=0.85, params={name: mi.Float(value) for name, value in START.items()})
    for step in range(steps + 1):
        for name, keys in PARAMETERS.items():
            for key in keys:
                parameters[f"sphere.bsdf.{key}"] = optimiser[name]
        parameters.update()
        image = mi.render(scene, parameters, spp=spp, seed=step)
        loss = dr.mean(dr.square((image - target) / (target + 0.1)), axis=None)
        if step % 10 == 0:
            values = ", ".join(f"{name} {optimiser[name][0]:.3f}" for name in TRUE)
            print(f"step {step:3}: {values}, loss {loss.array[0]:.4f}")
        dr.backward(loss)
        optimiser.set_learning_rate({name: rate * 0.98**step for name, rate in RATES.items()})
        optimiser.step()
    return {name: float(optimiser[name][0]) for name in TRUE}


if __name__ == "__main__":
    found = recover()
    print("true:    ", ", ".join(f"{name} {value}" for name, value in TRUE.items()))
    pictures = [np.array(mi.render(scene_of(**values, size=192), spp=256)) for values in (TRUE, START, found)]
    plt.figure(figsize=(9, 3), layout="constrained")
    plt.imshow(np.clip(np.concatenate(pictures, axis=1), 0, 1) ** (1 / 2.2))
    plt.axis("off")
