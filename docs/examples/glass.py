"""
Frosted glass and opal glass
============================

Panes transmit. Etched glass blurs at its surface, opal glass by a medium inside. `transmitted` has the light that
leaves below, as one lobe.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt
from velatura.scenes import tone_map

PANES = ("frosted-glass", "opal-glass")
for name in PANES:
    through = vt.lobes(name, [1.0, 0.5]).transmitted
    print(f"{name}: transmits {np.round(through.energy[1], 3)}, alpha {np.round(through.alpha[0], 3)}")

# %%
# The printed energies are those of green light along the normal and at 60 degrees. The object is hollow, so that light
# passes two panes.

figure, axes = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
for ax, name in zip(axes, PANES):
    ax.imshow(tone_map(vt.render(name, scene="ball", spp=128, size=160)))
    ax.set(title=name, xticks=[], yticks=[])
