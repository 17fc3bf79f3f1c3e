"""A wholly smooth stack on a metal whose index was measured: what it does in closed form at a few wavelengths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from velatura import ops
from velatura.metals import MetalWavelengths
from velatura.model.base import ALL, Model, Query
from velatura.model.context import Context
from velatura.model.variance import Variance
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.stack import Material


@dataclass(frozen=True)
class SmoothMetal:
    """A smooth body `in_channels`, but with energies that follow from those at `each` wavelength, by weights that are
    colours."""

    in_channels: Any
    each: Sequence[Any]
    weights: Sequence[Value]

    @property
    def diffuse(self) -> bool:
        return False

    @property
    def balanced(self) -> bool:
        return False

    def at_direction(self, wi: Direction) -> SmoothMetal:
        return self

    def albedo(self, wi: Direction, asked: Query = ALL) -> Value:
        return self._seen([body.albedo(wi, asked) for body in self.each])

    def eval_pdf(self, wi: Direction, wo: Direction, asked: Query = ALL) -> tuple[Value, Value]:
        value, density = self.in_channels.eval_pdf(wi, wo, asked)
        return value, density

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value, asked: Query = ALL) -> tuple[Direction, Value]:
        wo, eta = self.in_channels.sample(wi, u, u1, u2, asked)
        return wo, eta

    def sample_smooth(self, wi: Direction, u: Value, asked: Query = ALL) -> tuple[Direction, Value, Value, Value]:
        found = [body.sample_smooth(wi, u, asked) for body in self.each]
        wo, eta, probability, _ = found[0]
        return wo, eta, probability, self._seen([weight for *_, weight in found])

    def component(self, wi: Direction, wo: Direction, u: Value, asked: Query = ALL, smooth: bool = False) -> Value:
        return self.in_channels.component(wi, wo, u, asked, smooth)

    def _seen(self, energies: Sequence[Value]) -> Value:
        """Bounded to what light may have, where a colour lies outside sRGB."""
        return ops.clip(sum(weight * energy for weight, energy in zip(self.weights, energies)), 0.0, 1.0)


def body(
    material: Material, metal: MetalWavelengths, model: Model, variance: type[Variance], context: Context
) -> SmoothMetal:
    """The body of a material with constants of a renderer, by a model in closed form.

    Those wavelengths of all channels that have one number are worked out together; weights of missing ones are 0.
    """
    colour = context.colour
    assert colour is not None
    own = [np.flatnonzero(metal.channel == c) for c in range(metal.channels)]
    each, weights = [], []
    for m in range(max(map(len, own))):
        places = [int(of[min(m, len(of) - 1)]) for of in own]
        eta, k = (colour(*part[places].tolist()) for part in (metal.eta, metal.k))
        each.append(model.body(material.with_layer(-1, eta=eta, k=k), variance, context))
        weights.append(colour(*(float(metal.weights[at]) if m < len(of) else 0.0 for at, of in zip(places, own))))
    return SmoothMetal(model.body(material, variance, context), each, weights)
