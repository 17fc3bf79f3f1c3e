"""
Thin films under a coat
=======================

The oxide on titanium colours it by interference. Under varnish it reflects less at its upper face, and the same film
shows another colour: so it cannot be evaluated as if it was in air.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt

TITANIUM = {"eta": [2.74, 2.54, 2.27], "k": [3.81, 3.43, 3.04], "alpha": 0.1}


def oxidised(thickness: float, coated: bool) -> vt.Stack:
    """Titanium with an oxide of some nanometres, bare or varnished."""
    metal = vt.Interface(**TITANIUM, films=[vt.Film(eta=2.4, thickness_nm=thickness)])
    return vt.Stack([vt.Interface(eta=1.5), metal] if coated else [metal])


def colours(coated: bool) -> np.ndarray:
    """Energy of the metal's lobe along the normal, by thickness."""
    return np.array([vt.lobes(oxidised(nm, coated), 1.0).energy[-1][:, 0] for nm in THICKNESS])


# %%
# The sRGB colours of the light that the metal's lobe carries, made equally bright.

THICKNESS = np.arange(0, 201, 5)
figure, axes = plt.subplots(2, 1, figsize=(7, 2.6), sharex=True, layout="constrained")
for ax, coated in zip(axes, (False, True)):
    linear = colours(coated)
    shown = np.clip(linear / linear.max(axis=1, keepdims=True), 0, 1) ** (1 / 2.2)
    ax.imshow(shown[None], extent=(THICKNESS[0], THICKNESS[-1], 0, 1), aspect="auto")
    ax.set(yticks=[], ylabel="varnished" if coated else "bare")
axes[1].set(xlabel="thickness of the oxide, nm")
