"""
Through a polariser that is turned
==================================

A dark, lacquered sphere through a linear polariser: the angle of the polariser decides whether glare at the rim is
bright or nearly gone, while light that the medium has scattered stays. The exact form returns Mueller matrices in
Mitsuba's polarised variants, and the integrator `stokes` has what reaches the camera.
"""

import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np

import velatura as vt
from velatura.scenes import scene_dict, tone_map

mi.set_variant("llvm_ad_mono_polarized")
vt.register()
lacquer = vt.Stack([vt.Interface(eta=1.5, alpha=0.05), vt.Medium(sigma_s=0.5, sigma_a=0.5), vt.Diffuse(albedo=0.03)])
bsdf = vt.bsdf(lacquer, form="exact", reflectance="fgd")
scene = mi.load_dict(
    {
        **scene_dict("sphere", "studio", bsdf, (160, 160), 1.25),
        "integrator": {"type": "stokes", "nested": {"type": "path", "max_depth": 3}},
    }
)
image = np.array(mi.render(scene, spp=64))
i, q, u, v = np.split(image[..., 1::3], 4, axis=-1)  # each is there for three colours, after the picture
mi.set_variant("llvm_ad_rgb")

# %%
# A polariser at an angle passes (I + Q cos 2a + U sin 2a) / 2. On the right is the degree of polarisation.

angles = (0, 45, 90, 135)
figure, axes = plt.subplots(1, 5, figsize=(11, 2.6), layout="constrained")
for ax, angle in zip(axes, np.radians(angles)):
    ax.imshow(tone_map(np.repeat(i + q * np.cos(2 * angle) + u * np.sin(2 * angle), 3, axis=-1)))
degree = np.sqrt(q**2 + u**2 + v**2) / np.maximum(i, 1e-6)
shown = axes[-1].imshow(degree, vmin=0, vmax=1)
figure.colorbar(shown, ax=axes[-1])
for ax, title in zip(axes, [*(f"polariser at {angle}°" for angle in angles), "degree of polarisation"]):
    ax.set(title=title, xticks=[], yticks=[])
