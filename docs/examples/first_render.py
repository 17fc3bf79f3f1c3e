"""
A first picture
===============

Gold under varnish that absorbs blue light, and the same stack with a rough varnish.
"""

import matplotlib.pyplot as plt

import velatura as vt
from velatura.scenes import tone_map


def varnished_gold(alpha: float) -> vt.Stack:
    """Gold below a millimetre of varnish whose surface has the roughness alpha."""
    return vt.Stack(
        [
            vt.Interface(eta=1.5, alpha=alpha),
            vt.Medium(depth=1.0, sigma_a=[0.05, 0.2, 0.6]),
            vt.Interface(conductor="Au", alpha=0.1),
        ]
    )


# %%
# A picture is an array of linear RGB; `tone_map` turns it into display values.

figure, axes = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
for ax, alpha in zip(axes, (0.02, 0.3)):
    image = vt.render(varnished_gold(alpha), scene="ball", env="studio", spp=64, size=256)
    ax.imshow(tone_map(image))
    ax.set(title=f"varnish of alpha {alpha}", xticks=[], yticks=[])
