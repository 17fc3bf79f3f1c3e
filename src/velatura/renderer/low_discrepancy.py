"""Numbers that are spread evenly: for means over a unit square, alone or at each node of a grid (Roberts 2018)."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from velatura.ops import Value

STEPS = (0.7548776662466927, 0.5698402909980532)  # 1/p and 1/p^2 of the plastic number p
_OF_32_BITS = (3242174889, 2447445414)  # the same as shares of 2^32


@functools.cache
def square(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of numbers in [0, 1), (count,) each; not to be written to."""
    u, v = _fixed(*((0.5 + np.arange(count) * step) % 1 for step in STEPS))
    return u, v


@functools.cache
def cube(count: int, dimensions: int) -> np.ndarray:
    """Numbers in [0, 1), (dimensions, count), for a cube of any number of dimensions; not to be written to."""
    # The root of x^(d+1) = x + 1, whose powers are the steps
    root = 2.0
    for _ in range(64):
        root = (1 + root) ** (1 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    return _fixed((0.5 + np.arange(1, count + 1) * steps[:, None]) % 1)[0]


@functools.cache
def fibonacci(count: int) -> tuple[np.ndarray, np.ndarray]:
    """A Fibonacci lattice of at least `count` points in the unit square; not to be written to."""
    a, b = 1, 1
    while b < count:
        a, b = b, a + b
    i = np.arange(b)
    u, v = _fixed((i * a / b + 0.5 / b) % 1, (i + 0.5) / b)
    return u, v


@functools.cache
def even_in_projection(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions above, at least `count`, over which what leaves a surface is a mean; not to be written to."""
    radius2, turn = fibonacci(count)
    radius, phi = np.sqrt(radius2), 2 * np.pi * turn
    x, y, z = _fixed(radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - radius2))
    return x, y, z


@functools.cache
def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes in [0, 1] and weights of the quadrature of Gauss and Legendre, (count,) each; not to be written to."""
    x, weight = np.polynomial.legendre.leggauss(count)
    x, weight = _fixed(0.5 * x + 0.5, 0.5 * weight)
    return x, weight


def _fixed(*arrays: np.ndarray) -> list[np.ndarray]:
    """Arrays that are not to be written to."""
    for array in arrays:
        array.flags.writeable = False
    return list(arrays)


def at_nodes(nodes: int, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three uniform numbers for every sample, the same at all nodes, that fill the cube evenly, the last two the
    square."""
    i = np.arange(nodes * samples, dtype=np.uint32) % samples
    # Products of integers that overflow are fractions
    u_1, u_2 = ((i * step + 2**31) / 2**32 for step in _OF_32_BITS)
    return (i + 0.5) / samples, u_1, u_2


def repeated(values: Value, samples: int) -> Value:
    """Numbers or colours at the nodes, each as often as there are samples."""
    if isinstance(values, (float, int, np.ndarray)):
        return np.repeat(values, samples, axis=-1) if np.ndim(values) else values
    import drjit as dr

    return dr.repeat(values, samples)


def integers(count: int, number: type | None) -> tuple[Value, Callable[[Value], Value]]:
    """Integers from 0, and what makes real numbers of them; for Dr.Jit's type of numbers, or None for NumPy."""
    if number is None:
        return np.arange(count, dtype=np.uint32), lambda x: x.astype(float)
    import drjit as dr

    dialect: Any = sys.modules[number.__module__]
    return dr.arange(dialect.UInt32, count), number
