"""
Model, exact form and walks at equal time
=========================================

A metal below a milky coat, rendered three times for as long: by the model, by its exact form, and by plain random
walks. The model has the least noise, and an error of its own, which stays; the errors of the other two are noise, which
falls with time.
"""

from time import process_time

import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np

import velatura as vt
from velatura.scenes import scene_dict, tone_map

mi.set_variant("llvm_ad_rgb")
vt.register()
SIZE, SPP = 96, 8
milky = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=0.1),
        vt.Medium(sigma_s=(1.5, 1.0, 0.5), sigma_a=0.05, g=0.6),
        vt.Interface(eta=0.2, k=3.9, alpha=0.2),
    ]
)
bsdfs = {
    "model": vt.bsdf(milky, reflectance="fgd"),
    "exact form": vt.bsdf(milky, form="exact", reflectance="fgd"),
    "plain walks": vt.bsdf(milky, "reference"),
}


def rendered(bsdf, spp, seed):
    scene = mi.load_dict(scene_dict("sphere", "studio", bsdf, (SIZE, SIZE), 1.25))
    return np.array(mi.render(scene, spp=spp, seed=seed))


def seconds(bsdf):
    rendered(bsdf, SPP, 0)  # compiles
    start = process_time()
    rendered(bsdf, SPP, 1)
    return process_time() - start


# %%
# The time of the exact form at 8 samples decides how many samples the others have. The truth is the exact form by
# another seed and 32 times the samples.

cost = {name: seconds(bsdf) for name, bsdf in bsdfs.items()}
spp = {name: max(round(SPP * cost["exact form"] / each), 1) for name, each in cost.items()}
truth = rendered(bsdfs["exact form"], 32 * SPP, 2)
figure, axes = plt.subplots(2, 3, figsize=(9, 6), layout="constrained")
for (above, below), (name, bsdf) in zip(axes.T, bsdfs.items()):
    picture = rendered(bsdf, spp[name], 3)
    error = picture - truth
    print(f"{name}: {spp[name]} samples, error {np.sqrt(np.mean(error**2)):.4f}, mean {error.mean():+.4f}")
    above.imshow(tone_map(picture))
    above.set(title=f"{name}, {spp[name]} samples", xticks=[], yticks=[])
    shown = below.imshow(error.mean(-1), cmap="RdBu", vmin=-0.1, vmax=0.1)
    below.set(title=f"error {np.sqrt(np.mean(error**2)):.3f}, mean {error.mean():+.4f}", xticks=[], yticks=[])
figure.colorbar(shown, ax=axes[1])
