"""A metal whose index was measured: paths carry light of its wavelengths in place of channels.

A channel is a weighted sum of its own wavelengths, and all that lies above the metal has one value a channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from velatura.metals import MetalWavelengths
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.polarisation import Complex

WAVELENGTHS = 3  # of a channel


@dataclass(frozen=True)
class WalkedMetal:
    """A metal; `types` is the module of a renderer's number types."""

    types: Any
    spectrum: MetalWavelengths

    @property
    def one(self) -> Value:
        """Weight of a path at first."""
        return self._colour([1.0] * len(self.spectrum.nm))

    @cached_property
    def index(self) -> tuple[Value, Value]:
        return self._colour(self.spectrum.eta.tolist()), self._colour(self.spectrum.k.tolist())

    def reflectance(self, cosine: Value, n_in: Value) -> Value:
        """Reflectance of its facets below a medium of that index, at all wavelengths."""
        return fresnel.conductor(cosine, *self._below(n_in))

    def amplitudes(self, cosine: Value, n_in: Value) -> tuple[Complex, Complex]:
        """Amplitudes of light of either polarisation that its facets reflect."""
        return fresnel.conductor_amplitudes(cosine, *self._below(n_in))

    def _below(self, n_in: Value) -> tuple[Value, Value]:
        """Its index, relative to a medium above."""
        above = self.wide(n_in)
        eta, k = self.index
        return eta / above, k / above

    def wide(self, colour: Value) -> Value:
        """A colour of channels for what paths carry; a number stays one."""
        return self._colour([colour[c] for c in self.spectrum.channel.tolist()]) if is_colour(colour) else colour

    def seen(self, carried: Value, kind: Any) -> Value:
        """Weights of paths as a colour of channels, of a renderer's type."""
        found = [0.0] * self.spectrum.channels
        for x, c, weight in zip(carried, self.spectrum.channel.tolist(), self.spectrum.weights.tolist()):
            found[c] = found[c] + weight * x
        return kind(*found)

    def _colour(self, channels: Sequence[Any]) -> Value:
        return self.types.ArrayXf([self.types.Float(x) for x in channels])


def is_colour(x: Value) -> bool:
    """Whether a value has channels."""
    import drjit as dr

    return bool(dr.is_array_v(x)) and dr.depth_v(x) > dr.is_jit_v(x)


def mean(colour: Value) -> Value:
    """Mean over all that a path carries."""
    import drjit as dr

    return dr.mean(colour) if is_colour(colour) else colour
