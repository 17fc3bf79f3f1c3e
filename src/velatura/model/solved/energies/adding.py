"""Layers of a stack, summed up from the top.

With d the light that first arrives in a slab, `below` what the stack above throws back down, and `out` what it lets
out, a layer that reflects R and transmits T adds

    E = out R (1 - below R)^-1 d,        d' = T (1 - below R)^-1 d,
    out' = out (1 - R below)^-1 T',      below' = R' + T (1 - below R)^-1 below T'.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films.of_material import films_of
from velatura.films.tables import Coated
from velatura.model.rough_interface import KEPT, Facets, colours
from velatura.model.solved.energies.interfaces import Setting, interface
from velatura.model.solved.energies.media import Slab, medium
from velatura.model.solved.energies.operators import Layer, Operator
from velatura.stack import InterfaceValues, Material, SlabValues
from velatura.stack.chain import chain

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Lambert:
    """A diffuse base of an albedo (C,) under a medium of index n."""

    n: float
    albedo: Array


Part = Facets | Slab | Lambert


@dataclass(frozen=True)
class Leaving:
    """Light that leaves a stack lit from above: for each layer from the top what it is the deepest one to reflect; what
    passes all of them, and of that what no layer has reflected.
    """

    reflected: tuple[Operator, ...]
    passed: Operator
    straight: Operator
    setting: Setting

    def energy(self, light: Operator) -> Array:
        """Energies (C, M) of beams."""
        basis = self.setting.basis
        return np.asarray(basis.energy(light.columns) + light.beams[..., 0, 0, :])


def leaving(stack: Sequence[Layer], setting: Setting) -> Leaving:
    """Sum up layers from the top."""
    first, *others = stack
    reflected, d, straight, out, below = [first.r], first.t, first.t, first.t_below, first.r_below
    for each in others:
        bounces = (below @ each.r).repeated()
        # model.md, Eq. 2
        reflected.append(out @ each.r @ bounces @ d)
        d, straight = each.t @ bounces @ d, each.t @ straight
        # model.md, Eq. 3
        out = out @ (each.r @ below).repeated() @ each.t_below
        below = each.r_below + each.t @ bounces @ below @ each.t_below
    return Leaving(tuple(reflected), d, straight, setting)


def layers(found: Sequence[Part], setting: Setting) -> list[tuple[Layer, Layer]]:
    """What each layer does to light, where facets are met once, and as the setting says."""
    return [_layer(part, of) for part, of in zip(found, settings(found, setting))]


def settings(found: Sequence[Part], setting: Setting) -> list[Setting]:
    """That of each layer: beams end at the first rough interface."""
    ends = [isinstance(part, Lambert) or (isinstance(part, Facets) and not part.is_smooth) for part in found]
    return [setting.dark if any(ends[:i]) else setting for i in range(len(found))]


def _layer(part: Part, setting: Setting) -> tuple[Layer, Layer]:
    """A layer, kept for other materials that have one like it."""

    def make() -> tuple[Layer, Layer]:
        if isinstance(part, Facets):
            return interface(part, setting)
        alike = medium(part, setting) if isinstance(part, Slab) else _lambert(part, setting)
        return alike, alike

    def key(value: Any) -> Hashable:
        return value.key if isinstance(value, Coated) else None if value is None else np.asarray(value).tobytes()

    return KEPT.once((type(part), *map(key, vars(part).values()), setting.key), make)


def _lambert(part: Lambert, setting: Setting) -> Layer:
    basis = setting.basis
    nothing = Operator.nothing(basis.size, len(setting.p))
    even = basis.rows(basis.nodes.weights(part.n)[None].repeat(len(basis.azimuths), 0).reshape(1, -1), 0.0)
    even = even / even[:, :1].sum(axis=-1, keepdims=True) * part.albedo[:, None, None]
    taken = basis.rows(np.ones((1, len(basis.azimuths) * basis.nodes.count)), 0.0)
    r = Operator.of(basis.outer(even, taken), basis.outer(even, np.ones((1, len(setting.p)))))
    return Layer(r, nothing, nothing, nothing)


def parts(material: Material, straight: Callable[[float], float] | None = None) -> list[Part]:
    """The layers of a material with values in NumPy, indices relative to the outside above.

    `straight` gives the share of scattered light that goes straight on by the asymmetry g, for light that is in a lobe;
    None follows all light.
    """
    outside = float(ops.mean(colours(material.exterior)))
    found: list[Part] = []
    for meeting in chain(material.solid(), films_of(material)):
        if isinstance(meeting.layer, InterfaceValues):
            found.append(Facets.of(meeting.layer, meeting.above, outside, meeting.films))
            continue
        n = float(ops.mean(colours(meeting.above) / outside))
        if isinstance(meeting.layer, SlabValues):
            found.append(Slab.of(meeting.layer, n, straight))
        else:
            found.append(Lambert(n, colours(meeting.layer.albedo)))
    return found


def interfaces(found: Sequence[Part]) -> list[Facets]:
    return [part for part in found if isinstance(part, Facets)]


def indices(found: Sequence[Part]) -> list[float]:
    """Indices of all media that light may be in."""
    values = [1.0]
    for part in found:
        if isinstance(part, Facets):
            values.append(float(ops.mean(part.above)))
            if part.below is not None and part.k is None:
                values.append(float(ops.mean(part.below)))
    return values
