"""A metal whose index was measured, below other layers: light at a few wavelengths, of which channels are sums.

What lies above the metal has one value a channel, and is solved for every wavelength of the channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from velatura import metals, ops
from velatura.metals import MetalWavelengths
from velatura.model.rough_interface import Facets, colours
from velatura.model.solved.energies.adding import Part
from velatura.model.solved.energies.operators import Layer
from velatura.model.solved.guards import TINY
from velatura.stack import Material

Array = NDArray[np.floating]

WAVELENGTHS = 2  # of a channel


@dataclass(frozen=True)
class Colours:
    """Colours that are solved for: the channels of a material, or the wavelengths of its `metal`, relative to the
    outside above."""

    metal: MetalWavelengths | None = None

    @classmethod
    def of(cls, material: Material) -> Colours:
        """Those of a material of NumPy's values."""
        metal = metals.of(material, WAVELENGTHS)
        outside = float(ops.mean(colours(material.exterior)))
        return cls(metal and replace(metal, eta=metal.eta / outside, k=metal.k / outside))

    def at_wavelengths(self, found: Sequence[Part]) -> list[Part]:
        """The layers, with the metal at all wavelengths."""
        *others, last = found
        if not self.metal or not isinstance(last, Facets):
            return [*found]
        # Only ratios of indices are read, and the mean of those above
        above = np.atleast_1d(ops.mean(last.above))
        unit = above / (last.above[self.metal.channel] if len(last.above) > 1 else last.above)
        return [*others, replace(last, above=above, below=self.metal.eta * unit, k=self.metal.k * unit)]

    def layers(self, found: Sequence[Layer]) -> list[Layer]:
        """Layers of channels above a metal of wavelengths, all in the colours that are solved for."""
        if not self.metal:
            return [*found]
        channel = self.metal.channel
        *others, last = found
        return [*(layer.map(lambda x: x.of_colours(channel)) for layer in others), last]

    def seen(self, values: Array, axis: int = 0) -> Array:
        """Values of the colours that were solved for, along an axis, as channels."""
        return self.metal.seen(values, axis) if self.metal and values.shape[axis] > 1 else values

    def parts_seen(self, lobes: Array, veils: Array, rest: Array) -> tuple[Array, Array, Array]:
        """Energies of lobes and veils (K, C, M), and of the rest (C, M), as channels.

        Single ones may lie outside sRGB, where their sum does not: then they share that, and none is negative. Their
        sum is bounded to what light may have, as gold's red is more.
        """
        if not self.metal:
            return lobes, veils, rest
        lobes, veils, rest = self.seen(lobes, axis=1), self.seen(veils, axis=1), self.seen(rest)
        whole = lobes.sum(axis=0) + veils.sum(axis=0) + rest
        outside = (
            (whole > 1) | (np.minimum(lobes.min(axis=0, initial=0), veils.min(axis=0, initial=0)) < 0) | (rest < 0)
        )
        lobes, veils, rest = (np.maximum(x, 0) for x in (lobes, veils, rest))
        left = np.maximum(lobes.sum(axis=0) + veils.sum(axis=0) + rest, TINY)
        share = np.where(outside, np.clip(whole, 0, 1) / left, 1)
        return share * lobes, share * veils, share * rest
