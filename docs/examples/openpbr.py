"""
A material of OpenPBR as a stack
================================

Parameters of OpenPBR become the nearest stack, and what a stack cannot carry is listed.
"""

import warnings

import matplotlib.pyplot as plt

import velatura as vt
from velatura.scenes import tone_map

PAINT = {"base_color": (0.5, 0.06, 0.04), "specular_roughness": 0.4, "coat_weight": 1.0, "fuzz_weight": 0.3}

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # what is left is printed below
    found = vt.from_openpbr(**PAINT)
for layer in found.stack.layers:
    print(layer)
for left in found.left:
    print("left:", left)

# %%
# The same stack with its coat, and without it.

bare = vt.Stack(found.stack.layers[-2:])
figure, axes = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
for ax, (name, stack) in zip(axes, {"coated": found.stack, "without its coat": bare}.items()):
    ax.imshow(tone_map(vt.render(stack, scene="ball", spp=64, size=224)))
    ax.set(title=name, xticks=[], yticks=[])
