"""
Fog, dust and phase functions
=============================

Media scatter by their phase function. Where nothing above them refracts, as of dust on a table, its shape is what one
sees: here of light that comes from the left at 60 degrees, over the angle of view in its plane.
"""

import drjit as dr
import matplotlib.pyplot as plt
import numpy as np

import velatura as vt
from velatura import kernel

PHASES = {
    "g 0.7, forwards": {"g": 0.7},
    "Rayleigh": {"phase": "rayleigh"},
    "two lobes": {"phase": {"forward": 0.7, "backward": -0.6, "share": 0.6}},
}
angles = np.linspace(-80, 80, 81)

# %%
# The plugins of the model and of the random walk take many directions at once. The walk is an estimate for each of its
# samples, which are averaged.

mi = kernel.mitsuba()
PATHS = 4000  # for each angle


def values(bsdf, count):
    """f |cos| in the plane of incidence, at all angles."""
    n = len(angles) * count
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = mi.Vector3f(-(0.75**0.5), 0, 0.5)
    si.p = mi.Point3f(np.arange(n) * 1e-3, 0, 0)  # the walk's random numbers depend on the place
    wo = np.repeat(np.radians(angles), count)
    light = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(np.sin(wo), 0 * wo, np.cos(wo)))
    return np.array(light)[0].reshape(len(angles), count).mean(axis=1)


figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
for name, keys in PHASES.items():
    dust = vt.Stack([vt.Medium(depth=0.5, sigma_s=0.9, sigma_a=0.1, **keys), vt.Diffuse(albedo=0.05)])
    (line,) = ax.plot(angles, values(vt.bsdf(dust), 1), label=name)
    ax.plot(angles, values(vt.bsdf(dust, "reference"), PATHS), ".", color=line.get_color(), markersize=4)
ax.set(xlabel="angle of view, degrees; the mirror direction is 60", ylabel="f |cos|")
ax.legend(title="dust; dots: random walks")
