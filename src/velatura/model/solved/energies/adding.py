"""Layers of a stack, summed up from the top.

With d the light that first arrives in a slab, `below` what the stack above throws back down, and `out` what it lets
out, a layer that reflects R and transmits T adds

    E = out R (1 - below R)^-1 d,        d' = T (1 - below R)^-1 d,
    out' = out (1 - R below)^-1 T',      below' = R' + T (1 - below R)^-1 below T'.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films.of_material import films_of
from velatura.model.rough_interface import KEPT, Facets, colours, in_units
from velatura.model.solved.energies.interfaces import Setting, interface, lit
from velatura.model.solved.energies.media import Slab, Straight, medium
from velatura.model.solved.energies.operators import Functional, Layer, Operator
from velatura.stack import InterfaceValues, Material, SlabValues
from velatura.stack.chain import chain

Array = NDArray[np.floating]
Leaver = TypeVar("Leaver", Operator, Functional)


@dataclass(frozen=True)
class Lambert:
    """A diffuse base of an albedo (C,) under a medium of index n."""

    n: float
    albedo: Array

    def key(self, unit: float) -> Hashable:
        """All values, with the index as a multiple of a unit."""
        return in_units(self.n, unit), self.albedo.tobytes()


Part = Facets | Slab | Lambert


class Sorted(NamedTuple):
    """Light that leaves a stack: for each layer what it is the deepest one to reflect; what passes all of them, and of
    that what no layer has reflected.
    """

    reflected: Sequence[Array]
    passed: Array
    straight: Array


@dataclass(frozen=True)
class Leaving:
    """Light that leaves a stack lit from above, by its energy or at the nodes.

    Attributes:
        stack: the layers from the top.
        below: what all above a layer throws back down, of each but the first.
        bounces: the sum of all reflections between both.
    """

    stack: Sequence[Layer]
    below: Sequence[Operator]
    bounces: Sequence[Operator]
    setting: Setting

    @classmethod
    def of(cls, stack: Sequence[Layer], setting: Setting) -> Leaving:
        """Sum up layers from the top."""
        first, *others = stack
        below, bounces = [first.r_below], list[Operator]()
        for each in others:
            bounces.append((below[-1] @ each.r).repeated())
            if each is not stack[-1]:
                # model.md, Eq. 3
                below.append(each.r_below + each.t @ bounces[-1] @ (below[-1] @ each.t_below))
        return cls(stack, below, bounces, setting)

    @cached_property
    def energies(self) -> Sorted:
        """Energies (C, M) of beams."""
        energy = Functional.energy(self.setting.basis.counted, len(self.setting.p))
        first, *others = self.stack
        # model.md, Eq. 2
        reflected = [
            out @ each.r @ met for out, each, met in zip(self._outward(energy @ first.t_below), others, self.bounces)
        ]
        deeper = energy
        for shallower, each, met in reversed([*zip(reflected, others, self.bounces)]):
            deeper = Functional.together([shallower, deeper @ each.t @ met])
        straight = functools.reduce(operator.matmul, [each.t for each in reversed(self.stack)], energy)
        *found, passed, straightly = Functional.together([energy @ first.r, deeper @ first.t, straight]).outcomes
        return Sorted(found, passed, straightly)

    @cached_property
    def lights(self) -> Sorted:
        """Light (C, F, n, M) at the nodes that was in beams."""
        first, *others = self.stack
        reflected, light, straight = [first.r.columns], first.t.light, first.t.light
        for out, each, bounces in zip(self._outward(first.t_below), others, self.bounces):
            met = bounces @ light
            reflected.append((out @ (each.r @ met)).columns)
            light, straight = each.t @ met, each.t @ straight
        return Sorted(reflected, light.columns, straight.columns)

    def _outward(self, out: Leaver) -> Iterator[Leaver]:
        """Light that each layer but the first reflects, as it leaves, given that of light from below the first."""
        for each, below, bounces in zip(self.stack[1:], self.below, self.bounces):
            yield out
            # model.md, Eq. 3: (1 - R below)^-1 is 1 + R (1 - below R)^-1 below
            out = (out + out @ each.r @ bounces @ below) @ each.t_below


def layers(found: Sequence[Part], setting: Setting) -> list[tuple[Layer, Layer]]:
    """Operators of each layer, where facets are met once, and as the setting says."""
    return [layer(part, of) for part, of in zip(found, settings(found, setting))]


def settings(found: Sequence[Part], setting: Setting) -> list[Setting]:
    """That of each layer: beams end at the first rough interface."""
    ends = [isinstance(part, Lambert) or (isinstance(part, Facets) and not part.smooth) for part in found]
    return [setting.dark if any(ends[:i]) else setting for i in range(len(found))]


def layer(part: Part, setting: Setting) -> tuple[Layer, Layer]:
    """A layer where facets are met once, and as the setting says, kept for other materials that have one like it."""

    if isinstance(part, Facets) and part.is_exit and not part.final and not len(setting.p):
        # Stacks that are seen from both sides share what interfaces do
        once, often = layer(part.reversed(), setting)
        back = once.reversed()
        return back, back if often is once else often.reversed()

    def made() -> tuple[Layer, Layer]:
        basis = setting.basis
        if basis.symmetric is basis or (isinstance(part, Facets) and part.ratio != 1):
            return _made(part, setting)
        once, often = layer(part, setting.symmetric)
        spread = once.map(lambda x: basis.of_symmetric(x, setting.phi))
        return spread, spread if often is once else often.map(lambda x: basis.of_symmetric(x, setting.phi))

    return KEPT.once((type(part), part.key(setting.unit), setting.key), made)


def _made(part: Part, setting: Setting) -> tuple[Layer, Layer]:
    if isinstance(part, Facets):
        return lit(part, setting, lambda: layer(part, setting.dark)) if len(setting.p) else interface(part, setting)
    alike = medium(part, setting) if isinstance(part, Slab) else _lambert(part, setting)
    return alike, alike


def _lambert(part: Lambert, setting: Setting) -> Layer:
    basis = setting.basis
    nothing = Operator.nothing(basis.size, len(setting.p))
    even = basis.rows(basis.nodes.weights(part.n)[None].repeat(len(basis.azimuths), 0).reshape(1, -1), 0.0)
    even = even / even[:, :1].sum(axis=-1, keepdims=True) * part.albedo[:, None, None]
    taken = basis.rows(np.ones((1, len(basis.azimuths) * basis.nodes.count)), 0.0)
    r = Operator.of(basis.outer(even, taken), basis.outer(even, np.ones((1, len(setting.p)))))
    return Layer(r, nothing, nothing, nothing)


def parts(material: Material, straight: Straight | None = None) -> list[Part]:
    """The layers of a material with values in NumPy, indices relative to the outside above.

    `straight` gives the share of scattered light that goes straight on by the phase function, for light that is in a
    lobe; None follows all light.
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
