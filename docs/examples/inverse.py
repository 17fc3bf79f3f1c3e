"""
All stacks of one appearance
============================

The inverse asks for lobes, and gives stacks that have them. What the lobes leave open is a class; its members look
the same along the normal, and differ at grazing angles.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt

TARGET = [
    {"energy": 0.09, "alpha": 0, "interfaces": 2},
    {"energy": [0.45, 0.3, 0.2], "alpha": 0.15, "base": "conductor"},
]
members = vt.inverse.alternatives(TARGET, 6)

# %%
# The energy of all lobes together, by the angle of incidence.

angles = np.linspace(0, 85, 40)
figure, ax = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
for member in members:
    energy = np.sum(vt.lobes(member.stack, np.cos(np.radians(angles)), model=member.model).energy, axis=0)
    index = member.stack.layers[0].eta
    ax.plot(angles, energy[1], label=f"upper index {np.mean(index):.2f}")
ax.set(xlabel="angle of incidence, degrees", ylabel="energy of green light")
ax.legend()
