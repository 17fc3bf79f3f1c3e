"""
A rough coat blurs and darkens its base
=======================================

Gold below coats of growing roughness: its lobe becomes wider, and carries less light, of a redder colour.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt
from velatura.scenes import tone_map

GOLD = vt.Interface(conductor="Au", alpha=0.05)


def coated(alpha: float) -> vt.Stack:
    """Gold under a clear coat."""
    return vt.Stack([vt.Interface(eta=1.5, alpha=alpha), GOLD])


# %%
# The second lobe is that of the gold, seen through the coat.

coats = np.linspace(0.0, 0.5, 11)
base = [vt.lobes(coated(alpha), 1.0) for alpha in coats]
blur = [lobes.alpha[1][0, 0] for lobes in base]
energy = np.array([lobes.energy[1][:, 0] for lobes in base])

figure, axes = plt.subplots(1, 4, figsize=(11, 2.9), layout="constrained")
axes[0].plot(coats, blur, color="black")
axes[0].set(xlabel="alpha of the coat", ylabel="alpha of the gold's lobe")
for channel, colour in enumerate(("firebrick", "forestgreen", "royalblue")):
    axes[1].plot(coats, energy[:, channel], color=colour)
axes[1].set(xlabel="alpha of the coat", ylabel="energy of the gold's lobe")
for ax, alpha in zip(axes[2:], (0.0, 0.4)):
    ax.imshow(tone_map(vt.render(coated(alpha), scene="sphere", spp=48, size=160)))
    ax.set(title=f"coat of alpha {alpha}", xticks=[], yticks=[])
