"""
One look, four materials
========================

A warm metal under a clear coat, asked for by its look alone: the energies and the roughnesses of two lobes. Many stacks
have this look. Four are drawn here from the top down, each medium in the colour that it lets pass. The left half of
each ball is rendered by the model, the right half by the reference, a random walk through the layers.
"""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt

SIZE, SAMPLES = 256, 48

LOOK = [
    {"energy": 0.06, "alpha": 0.02},
    {"energy": [0.55, 0.33, 0.12], "alpha": 0.28, "interfaces": 2, "base": "conductor"},
]


def ball(stack: vt.Stack) -> Any:
    """The model's picture on the left, that of the walk on the right, ready for display."""
    model = vt.render(stack, size=SIZE, spp=SAMPLES)
    walk = vt.render(stack, model="reference", microsurface=True, size=SIZE, spp=SAMPLES)
    return vt.scenes.tone_map(np.where(np.arange(SIZE)[:, None] < SIZE // 2, model, walk))


def layers(axes: plt.Axes, stack: vt.Stack) -> None:
    """Interfaces as rough as they are, media in the colour that light has after passing them twice, and the metal."""
    x = np.linspace(0, 1, 200)
    bumps = np.convolve(np.random.default_rng(0).standard_normal(len(x) + 8), np.ones(9) / 6, "valid")
    surface, depth = np.full_like(x, 0.6), 0
    for layer in stack.layers:
        if isinstance(layer, vt.Medium):
            colour = np.broadcast_to(np.exp(-2 * np.multiply(layer.depth, layer.sigma_a)), 3)
        else:
            surface = layer.alpha * bumps - depth
            depth += 1
            colour, name = np.ones(3), f"index {layer.eta:.2f}" if layer.k is None else "metal"
            if layer.k is not None:
                n = np.asarray(layer.eta) + 1j * np.asarray(layer.k)
                colour = np.abs((n - 1) / (n + 1)) ** 2
            axes.plot(x, surface, color="black", linewidth=0.8, zorder=depth + 0.5)
            axes.text(0.5, 0.45 - depth, f"{name}   α {layer.alpha:.2f}", ha="center", va="center", zorder=9)
        axes.fill_between(x, surface, -3, color=0.35 + 0.65 * vt.scenes.tone_map(colour), zorder=depth)
    axes.set(xlim=(0, 1), ylim=(-3, 0.6))
    axes.axis("off")


stacks = [found.stack for found in vt.inverse.alternatives(LOOK, 4, seed=3)]
figure, axes = plt.subplots(2, len(stacks), figsize=(12, 4.9), height_ratios=[0.55, 1], layout="constrained")
for (above, below), stack in zip(axes.T, stacks, strict=True):
    layers(above, stack)
    below.imshow(ball(stack))
    below.axvline(SIZE / 2 - 0.5, color="white", linewidth=0.5)
    below.axis("off")
