"""
Lobes over the angle
====================

Each interface of a stack has a lobe, with an energy and a roughness that change with the angle of incidence. No light
is simulated: `vt.lobes` returns them at once, for any number of directions.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt

angles = np.linspace(0, 85, 60)
lobes = vt.lobes("coated-gold", np.cos(np.radians(angles)))

# %%
# Energies have three colours, roughness has two axes. The coat's lobe is colourless, so that its lines coincide.

figure, (energy, alpha) = plt.subplots(1, 2, figsize=(8, 3.4), layout="constrained")
for k, (name, style) in enumerate([("coat", "--"), ("gold", "-")]):
    for channel, colour in enumerate(("firebrick", "forestgreen", "royalblue")):
        energy.plot(angles, lobes.energy[k][channel], style, color=colour, label=name if channel == 0 else None)
    for axis, colour in enumerate(("black", "gray")):
        alpha.plot(angles, lobes.alpha[k][axis], style, color=colour, label=f"{name}, axis {axis + 1}")
energy.set(xlabel="angle of incidence, degrees", ylabel="energy")
alpha.set(xlabel="angle of incidence, degrees", ylabel="alpha")
energy.legend()
alpha.legend()
