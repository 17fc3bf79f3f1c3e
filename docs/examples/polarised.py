"""
Polarisation by a coat
======================

Light that comes in unpolarised leaves polarised. Walks that carry Stokes vectors give the degree of polarisation of
each lobe: at Brewster's angle the reflection of the coat is all of one polarisation.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt

stack = vt.Stack([vt.Interface(eta=1.5), vt.Interface(eta=2.0, k=1.0, alpha=0.1)])
angles = np.arange(5.0, 86.0, 8.0)
found = vt.reference.stokes(stack, np.cos(np.radians(angles)), paths=40_000)

# %%
# Rows are I, Q, U and V; here of green light, by lobe. Points are walks, the line is Fresnel's formula for the coat.

fine = np.radians(np.linspace(1, 89, 200))
inside = np.arcsin(np.sin(fine) / 1.5)
s, p = (np.sin(fine - inside) / np.sin(fine + inside)) ** 2, (np.tan(fine - inside) / np.tan(fine + inside)) ** 2

figure, ax = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
ax.plot(np.degrees(fine), (s - p) / (s + p), color="black", label="coat, Fresnel")
for name, lobe, colour in zip(("coat", "metal"), found.reflected, ("black", "darkorange")):
    ax.plot(angles, lobe[1, 1] / lobe[0, 1], "o", color=colour, label=f"{name}, walks")
ax.axvline(np.degrees(np.arctan(1.5)), color="gray", linestyle=":", label="Brewster's angle")
ax.set(xlabel="angle of incidence, degrees", ylabel="Q / I")
ax.legend()
