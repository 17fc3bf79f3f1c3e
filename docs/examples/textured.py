"""
A texture of roughness
======================

Any value of a layer can be read from an image. Here a coat has rough and smooth stripes, over paint that is the same
everywhere.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt
from velatura.scenes import tone_map

# %%
# The image: grey values from 0 to 1, which `scale` and `offset` map to a roughness of .02 to .42.

u = np.linspace(0, 1, 256, endpoint=False)
grey = np.tile(0.5 + 0.5 * np.tanh(6 * np.sin(16 * np.pi * u)), (64, 1))
image = Path(tempfile.mkdtemp(), "stripes.png")
plt.imsave(image, grey, cmap="gray", vmin=0, vmax=1)

alpha = vt.Texture(texture=image, scale=0.4, offset=0.02)
stack = vt.Stack([vt.Interface(eta=1.5, alpha=alpha), vt.Diffuse(albedo=[0.08, 0.2, 0.45])])

# %%
# Energies and roughness follow the texel at every point of the surface.

figure, axes = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained", width_ratios=[2, 1.5])
axes[0].imshow(grey, cmap="gray")
axes[1].imshow(tone_map(vt.render(stack, scene="ball", spp=64, size=256)))
for ax in axes:
    ax.set(xticks=[], yticks=[])
