"""
A stack from a measured table
=============================

A table of reflectances, here with noise as of a measurement, and the stack that comes closest to it, by descent from a
stack of the same form with other values.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt
from velatura.inverse import Directions, ReflectanceTable, table_of

MODEL = "belcour2018"
true = vt.Stack([vt.Interface(eta=1.5, alpha=0.08), vt.Interface(eta=[0.3, 0.9, 1.2], k=[3.2, 2.5, 2.4], alpha=0.25)])
start = vt.Stack([vt.Interface(eta=1.3, alpha=0.2), vt.Interface(eta=1.0, k=3.0, alpha=0.1)])

# %%
# The table: light from five angles of incidence, seen from angles in the plane of incidence and 20 degrees beside it.

theta_i, theta_o, beside = (
    x.ravel() for x in np.meshgrid([5.0, 20.0, 35.0, 50.0, 65.0], np.linspace(0, 80, 41), [160.0, 180.0])
)
directions = Directions.of(theta_i, theta_o, beside)
exact = table_of(true, directions, MODEL).value
noise = 1 + 0.05 * np.random.default_rng(0).standard_normal(exact.shape)
table = ReflectanceTable(directions, exact * noise)

found = vt.inverse.fit(table, [start], MODEL)
for estimate in found.estimates:
    print(estimate)

# %%
# Green reflectance in the plane of incidence: the table as points, the fit as lines.

fitted = table_of(found.stack, directions, MODEL).value
figure, ax = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
for angle, colour in zip((5.0, 35.0, 65.0), ("black", "teal", "darkorange")):
    here = (theta_i == angle) & (beside == 180)
    ax.plot(theta_o[here], table.value[1, here], ".", color=colour)
    ax.plot(theta_o[here], fitted[1, here], color=colour, label=f"light from {angle:.0f}°")
ax.set(xlabel="angle of reflection, degrees", ylabel="reflectance, 1/sr", yscale="log")
ax.legend()
