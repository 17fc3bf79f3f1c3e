"""Texture maps made by formulas, which meet themselves across u = 0: (side, side) arrays, rows along v."""

from __future__ import annotations

import numpy as np

from velatura.figures.canvas import Array

SIDE = 512


def scratches(count: int = 160, seed: int = 0) -> Array:
    """Straight scratches in all directions, 1 in their middle and 0 between them."""
    random, (u, v) = np.random.default_rng(seed), _coordinates()
    found = np.zeros_like(u)
    for x, y, turn, half in zip(*random.random((2, count)), np.pi * random.random(count), random.gamma(2, 0.03, count)):
        near = np.abs(v[:, 0] - y) < half + 3 / SIDE  # rows that it crosses
        across, along = _turned(_wrapped(u[near] - x), v[near] - y, turn)
        beside = np.hypot(across, np.maximum(np.abs(along) - half, 0))
        found[near] = np.maximum(found[near], np.clip(1.5 - SIDE * beside / 1.5, 0, 1))
    return found


def fingerprints(count: int = 14, seed: int = 1) -> Array:
    """Fingerprints, 1 on their ridges and 0 around them."""
    random, (u, v) = np.random.default_rng(seed), _coordinates()
    found = np.zeros_like(u)
    for x, y, turn in zip(*random.random((2, count)), 2 * np.pi * random.random(count)):
        across, along = _turned(_wrapped(u - x), v - y, turn)
        print_ = np.exp(-(((across / 0.04) ** 2 + (along / 0.055) ** 2) ** 2))
        ridges = np.sin(700 * np.hypot(across, 0.7 * (along + 0.02)) + 3 * np.sin(30 * across + 40 * along))
        found = np.maximum(found, print_ * np.clip(0.5 + ridges, 0, 1))
    return found


def wear(seed: int = 2, waves: int = 40) -> Array:
    """Smooth blotches of all values from 0 to 1."""
    random, (u, v) = np.random.default_rng(seed), _coordinates()
    across, along = random.integers(-9, 10, waves), random.normal(0, 5, waves)
    phase = 2 * np.pi * random.random(waves)
    total = sum(np.cos(2 * np.pi * (m * u + n * v) + p) for m, n, p in zip(across, along, phase))
    return np.asarray(0.5 + 0.5 * np.tanh(total / np.sqrt(waves)))


def strokes() -> Array:
    """Angles in degrees of brush strokes that wave around a surface, by up to 40 about the tangent."""
    u, v = _coordinates()
    return 40 * np.sin(2 * np.pi * (6 * u + np.sin(2 * np.pi * 3 * v) / 4))


def _coordinates() -> tuple[Array, Array]:
    """u and v of the texels."""
    ticks = (np.arange(SIDE) + 0.5) / SIDE
    u, v = np.meshgrid(ticks, ticks)
    return u, v


def _wrapped(u: Array) -> Array:
    """A difference of u, the shorter way around."""
    return (u + 0.5) % 1 - 0.5


def _turned(x: Array, y: Array, angle: float) -> tuple[Array, Array]:
    return np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
