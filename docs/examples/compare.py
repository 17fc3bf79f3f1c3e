"""
A model against random walks
============================

The reference is an unbiased random walk through the layers. `vt.compare` holds models against it: where they send
light, and how much of it.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt

found = vt.compare("coated-gold", ["velatura", "belcour2018"], cos_theta=[1.0, 0.7, 0.35], paths=300_000)

# %%
# Total variation is the share of the reflected light that is in the wrong place. With few walks their own noise is a
# large part of it: that is what an exact model would show.

print("noise of the walks:", np.round(found.noise, 3))
for name, distance in found.total_variation.items():
    print(f"{name:12} total variation {np.round(distance, 3)}")

# %%
# The distribution in the plane of incidence, at the most slanted direction: bins of the projected disc.

figure, ax = plt.subplots(figsize=(6.5, 3.4), layout="constrained")
accounts = {"random walks": found.truth, **found.models}
for (name, account), colour in zip(accounts.items(), ("black", "teal", "darkorange")):
    plane = account.distribution[:, -1].mean(axis=0)
    bins = plane.shape[0]
    middle = plane[:, bins // 2 - 1 : bins // 2 + 1].sum(axis=1)
    ax.step(np.linspace(-1, 1, bins), middle, where="mid", color=colour, label=name)
ax.set(xlabel="x of the direction of reflection", ylabel="energy by bin", yscale="log", ylim=(1e-5, None))
ax.legend()
