"""Many paths from one direction into a uniform stack, computed by Dr.Jit without a renderer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.errors import whole_number
from velatura.optics.polarisation import Polarisation, horizontal, unpolarised
from velatura.reference.layers import WalkedLayers, from_material, zeros
from velatura.reference.walk import walk
from velatura.stack import RGB, Address, Material, Stack

Array = NDArray[np.floating]

MAX_DEPTH = 4096
_AT_ONCE = 2**21


@dataclass(frozen=True)
class Ends:
    """How n paths ended.

    w (3, n): the direction in which they left, below the surface where light was transmitted; weight (3, n) by colour,
    0 where they died; deepest (n,): the number of surfaces above the deepest slab that they were in;
    truncated: the mean weight of those that were cut off; stokes (3, 3, n): Q, U and V by colour, as the weight is the
    intensity, in the frame of `velatura.reference.stokes`, or None where polarisation was left out.
    """

    w: Array
    weight: Array
    deepest: NDArray[np.unsignedinteger]
    truncated: float
    stokes: Array | None = None


def ends(stack: Stack, wi: Array, paths: int, seed: int, microsurface: bool, polarised: bool = False) -> Ends:
    """All paths at once; see `trace`."""
    parts = list(trace(stack, wi, paths, seed, microsurface, polarised))
    if len(parts) == 1:
        return parts[0]
    names = ("w", "weight", "deepest", *(["stokes"] if polarised else []))
    joined = {name: np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names}
    return Ends(**joined, truncated=sum(part.truncated * len(part.deepest) for part in parts) / paths)


def trace(
    stack: Stack, wi: Array, paths: int, seed: int, microsurface: bool, polarised: bool = False
) -> Iterator[Ends]:
    """Walk paths that come from the direction wi (3,), some millions at a time.

    Raises:
        InvalidInput: the stack holds a texture, or there are no paths.
        MissingTool: LLVM is missing or too old.
    """
    paths = whole_number("paths", paths, 1)
    kernel.require_llvm()
    layers = _layers(stack, microsurface)
    for start in range(0, paths, _AT_ONCE):
        yield _part(layers, wi, min(_AT_ONCE, paths - start), _mixed(seed), start, polarised)


@kernel.exclusive
def _part(layers: WalkedLayers, wi: Array, count: int, seed: int, start: int, polarised: bool) -> Ends:
    import drjit as dr
    import drjit.llvm as types

    # Walk
    rng = types.PCG32(count, types.UInt64(seed), types.UInt64(start))
    x, y, z = (dr.opaque(types.Float, float(component)) for component in wi)
    one = layers.start(types.Array3f(1))
    light = unpolarised((-x, -y, -z), one) if polarised else None
    path = walk(types, layers, (x, y, z), rng, one, max_depth=MAX_DEPTH, light=light)
    # Look at the ends
    carried = dr.select(path.alive, 0, path.weight)
    weight = layers.seen(carried, types.Array3f)
    cut_off = dr.mean(layers.seen(path.weight, types.Array3f) - weight)
    parts = []
    if isinstance(path.light, Polarisation):
        light = path.light.along(path.w, horizontal(path.w))
        parts = [layers.seen(carried * part, types.Array3f) for part in (light.q, light.u, light.v)]
    dr.eval(path.w, weight, path.deepest, cut_off, parts)
    w = np.stack([component.numpy() for component in path.w])
    stokes = np.stack([part.numpy() for part in parts]) if parts else None
    deepest = np.array(layers.above, np.uint32)[path.deepest.numpy()]
    return Ends(w, np.array(weight.numpy()), deepest, float(cut_off.numpy().mean()), stokes)


@kernel.exclusive
def _layers(stack: Stack, microsurface: bool) -> WalkedLayers:
    """The stack in Dr.Jit numbers, opaque to its compiler, so that stacks of one make share a kernel."""
    import drjit as dr
    import drjit.llvm as types

    plain = Material.of(stack, _plain)
    spared = zeros(plain)

    def opaque(address: Address, value: Any) -> Any:
        if address in spared:
            return 0.0
        value = types.Array3f(*value) if isinstance(value, tuple) else types.Float(value)
        dr.make_opaque(value)
        return value

    return from_material(types, plain.each(opaque), microsurface)


def _plain(address: Address, value: Any) -> float | RGB:
    return address.plain(value, "statistics are those of one point; replace it by a number")


def mean_and_error(carried: Array, paths: int) -> tuple[Array, Array]:
    """Mean over all `paths` of what n of them carry, (..., n), and its standard error."""
    mean = carried.sum(axis=-1, dtype=float) / paths
    second = np.sum(carried**2, axis=-1, dtype=float) / paths
    return mean, np.sqrt(np.maximum(second - mean**2, 0) / paths)


def relative_index(stack: Stack) -> float:
    """Index below a stack that transmits over the index above, one for all colours."""
    plain = Material.of(stack, _plain)
    return float(np.mean(plain.below) / np.mean(plain.exterior))


def _mixed(seed: int) -> int:
    """A seed of which neighbours are far apart (the finaliser of splitmix64)."""
    x = (seed + 0x9E3779B97F4A7C15) % 2**64
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) % 2**64
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) % 2**64
    return x ^ (x >> 31)
