"""
Parameters for other programs, with their loss
==============================================

Programs that take no code take parameters. A bake fits those of OpenPBR, glTF, Blender or Mitsuba's `principled` to the
light of a stack, and states what is lost.
"""

import matplotlib.pyplot as plt
import numpy as np

from velatura.bakes import TARGETS, bake

MATERIALS = ("coated-gold", "varnished-paint", "wet-asphalt")
loss = {target: [100 * np.mean(bake(name, target).total_variation) for name in MATERIALS] for target in TARGETS}

# %%
# The share of the reflected light in the wrong place, in the mean over angles.

figure, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
width = 0.8 / len(loss)
for k, (target, percent) in enumerate(loss.items()):
    ax.bar(np.arange(len(MATERIALS)) + k * width, percent, width, label=target)
ax.set(xticks=np.arange(len(MATERIALS)) + 0.4 - width / 2, xticklabels=MATERIALS, ylabel="total variation, %")
ax.legend()
