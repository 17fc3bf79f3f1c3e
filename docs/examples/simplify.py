"""
Fewer layers for the same appearance
====================================

Three dielectrics over a metal are four interfaces. A stack of two reflects nearly the same at all angles.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt
from velatura.scenes import tone_map

MODEL = "belcour2018"
full = vt.preset("three-dielectrics-over-metal")
found = vt.inverse.simplify(full, 2, model=MODEL)
print("kept:", ", ".join(found.stack.kinds), f"error {found.error:.3f}")

figure, axes = plt.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
angles = np.linspace(0, 85, 40)
for ax, (name, stack) in zip(axes[1:], {"four interfaces": full, "two": found.stack}.items()):
    energy = np.sum(vt.lobes(stack, np.cos(np.radians(angles)), model=MODEL).energy, axis=0)
    axes[0].plot(angles, energy.mean(axis=0), label=name)
    ax.imshow(tone_map(vt.render(stack, scene="sphere", spp=64, size=192, model=MODEL)))
    ax.set(title=name, xticks=[], yticks=[])
axes[0].set(xlabel="angle of incidence, degrees", ylabel="energy of all lobes")
axes[0].legend()
