"""
Brushed metal
=============

Aluminium that is brushed straight, in rays, and in rings, under a clear coat. A field of directions takes the place
of the angle of `rotation`.
"""

import matplotlib.pyplot as plt

import velatura as vt
from velatura.scenes import tone_map
from velatura.stack import Brushing

BRUSHINGS = {"straight": 0.0, "radial": Brushing(brushing="radial"), "concentric": Brushing(brushing="concentric")}

figure, axes = plt.subplots(1, 3, figsize=(9, 3.2), layout="constrained")
for ax, (name, rotation) in zip(axes, BRUSHINGS.items()):
    brushed = vt.Interface(conductor="Al", alpha=[0.04, 0.3], rotation=rotation)
    image = vt.render(vt.Stack([vt.Interface(eta=1.5, alpha=0.02), brushed]), scene="lid", spp=48, size=224)
    ax.imshow(tone_map(image))
    ax.set(title=name, xticks=[], yticks=[])
