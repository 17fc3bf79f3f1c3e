"""The lobes of a uniform material, computed once over direction for a texture, and read back from it.

A tape computes them, so that another stack of layers needs no compilation. The values, and the lobes made of them, are
those of `velatura.model.papers.precomputed_lobes`: energies, and roughness as a matrix, over the
cosine, and over the azimuth where an interface is anisotropic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Any

import numpy as np

from velatura import ops
from velatura.model.context import at_a_point
from velatura.model.papers import bsdf, precomputed_lobes
from velatura.model.papers.diffuse_base import Base
from velatura.model.papers.prepare import Prepared
from velatura.model.variance import Isotropic
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid
from velatura.shader.lookups.lookup import Group, LookUp, Texels, sides_read, texture, together
from velatura.shader.recorder.seen import Seen, of_lobes
from velatura.shader.recorder.symbol import Operand, component, number, operand
from velatura.shader.recorder.tape import Tape, tape
from velatura.stack import Material

Apart = Callable[[Value], Iterable[Value]]  # the channels of a colour

_OF_BASE = 6  # columns: its scale and its energy
PLANE = (95, 49)  # nodes over the cosine, twice as dense as those of most tables, and the azimuth
PLACE = "place"  # an input: coordinates of cosine and azimuth, from 0 to 1, and the side, 0 above and 1 below


@dataclass(frozen=True, kw_only=True)
class LobeLookUp(LookUp):
    """The values for one direction, as columns of numbers, four to a texel: first what the layers above a diffuse
    base transmit, if there is one, then the lobes.

    `body` reads its lobes from the texture. Of known values the texture is known, and there are no columns.
    """

    columns: Sequence[Operand]
    body: bsdf.Lobed

    @cached_property
    def tape(self) -> Tape:
        """The columns from the values of the material, `m.layer0.eta` and so on, and from a `place`."""
        return tape(self.columns)

    def seen(self, wi: Direction, weighed: bool) -> Seen:
        return of_lobes(self.body, wi, weighed, added=False)

    def to_dict(self) -> dict[str, Any]:
        """Input of the interpreter, in JSON's types: the tape, its tables, and the nodes and sides."""
        return {**vars(self.tape), "tables": self.tape.tables, "nodes": self.nodes, "sides": self.sides}


def bake(material: Material, body: bsdf.Lobed) -> LobeLookUp:
    """The lobes of a body, recorded from the values of a material, over direction."""
    nodes = directional_grid.LINE if body.above.variance is Isotropic else PLANE
    w = directional_grid.direction(number(f"{PLACE}.x"), number(f"{PLACE}.y") if len(nodes) > 1 else 0.0)

    # Compute the lobes seen in a direction
    columns, lobes = _seen(material, body, w)
    base = body.base(w)
    columns = _with_base(base, w, columns, _apart) if base else columns
    groups = _groups(base is not None, len(columns))
    columns += [0.0] * (4 * sum(group.texels for group in groups) - len(columns))

    # And read it
    read, sides = _read(body, nodes, groups, lobes), 1 if body.below is None else 2
    return LobeLookUp(columns=[operand(x) for x in columns], body=read, nodes=nodes, groups=groups, sides=sides)


def bake_known(body: bsdf.Lobed, known: bsdf.Lobed) -> LobeLookUp:
    """The lobes of a body, which are `known` in NumPy, over direction."""
    nodes = directional_grid.LINE if body.above.variance is Isotropic else PLANE
    w = directional_grid.directions(nodes, None)

    def apart(colour: Value) -> Iterable[Value]:
        return np.broadcast_to(colour, (3, prod(nodes)))

    def on(lobes: precomputed_lobes.Lobes) -> list[Value]:
        columns, _ = _columns(lobes, known, w, apart)
        base = known.base(w)
        return _with_base(base, w, columns, apart) if base else columns

    # Compute the lobes at the nodes
    sides = [on(known.lobes_above), *([] if known.below is None else [on(known.lobes_below)])]
    groups = _groups(known.above.base is not None, len(sides[0]))
    columns = ((k, np.stack([np.broadcast_to(x, prod(nodes)) for x in each])) for k, each in enumerate(zip(*sides)))
    texels = texture(columns, groups, len(sides), nodes)
    _, lobes = _columns(known.lobes_above, known, w, apart)
    read = _read(body, nodes, groups, lobes)
    return LobeLookUp(columns=[], body=read, nodes=nodes, groups=groups, sides=len(sides), known=texels)


def _with_base(base: Base, w: Direction, columns: list[Value], apart: Apart) -> list[Value]:
    """The columns of lobes after those of a base: what the layers above it transmit, its scale and its energy."""
    return [*apart(base.through(w)), 0.0, *apart(base.scale), *apart(base.energy), *columns]


def _groups(base: bool, columns: int) -> list[Group]:
    """Texels of a base, and of lobes, of so many columns in all."""
    first = [Group("through", 0, 1)] if base else []
    return [*first, Group("lobes", len(first), -(-columns // 4) - len(first))]


def _seen(material: Material, body: bsdf.Lobed, w: Direction) -> tuple[list[Value], int]:
    """The columns of all lobes at an upright direction, and how many lobes there are."""
    above = number(f"{PLACE}.z") < 0.5
    if body.below is not None and material.kinds == material.kinds[::-1] and not any(material.coatings):
        # Layers that are of the same kinds from both sides are added up once, for either
        turned = dict(material.reversed().values())
        chosen = material.solid().each(lambda address, value: ops.select(above, value, turned[address]))
        model, variance = body.above.model, body.above.variance
        body = bsdf.body(chosen, model, variance, at_a_point())
        return _columns(body.lobes_above, body, w)
    columns, count = _columns(body.lobes_above, body, w)
    if body.below is None:
        return columns, count
    return [ops.select(above, a, b) for a, b in zip(columns, _columns(body.lobes_below, body, w)[0])], count


def _columns(
    lobes: precomputed_lobes.Lobes, body: bsdf.Lobed, w: Direction, apart: Apart | None = None
) -> tuple[list[Value], int]:
    reflected, passed = lobes(w)
    seen = [*reflected, *([passed] if body.below is not None and passed is not None else [])]
    columns = [column for lobe in seen for column in precomputed_lobes.columns(lobe, body.above, apart or _apart)]
    return columns, len(seen)


def _apart(colour: Value) -> list[Operand]:
    return [component(operand(colour), channel) for channel in range(3)]


# Lobes that are read


@dataclass(frozen=True)
class _Base(Base):
    """A base whose light is read."""

    texels: Texels

    def through(self, w: Direction) -> Value:
        r, g, b, _ = self.texels(w)
        return together(r, g, b)


def _read(body: bsdf.Lobed, nodes: tuple[int, ...], groups: Sequence[Group], count: int) -> bsdf.Lobed:
    """A body whose lobes are read from the texture."""
    transmits, held = body.below is not None, groups[-1]
    sides = sides_read(1 + transmits, body.above.model)

    def lobes(prepared: Prepared, side: Value) -> precomputed_lobes.Lobes:
        columns = Texels(nodes, held, side, _OF_BASE if prepared.base else 0)
        return precomputed_lobes.PrecomputedLobes(columns, together, 3, prepared, count, transmits)

    if body.below is not None:
        return replace(body, lobes_above=lobes(body.above, sides[0]), lobes_below=lobes(body.below, sides[1]))
    above = lobes(body.above, 0.0)
    read = replace(body, lobes_above=above, lobes_below=above)
    if body.above.base is None:
        return read
    columns, through = Texels(nodes, held, 0.0), Texels(nodes, groups[0], 0.0)

    def base(w: Direction) -> Base:
        channels = list(columns(w))[:_OF_BASE]
        return _Base(body.above, together(*channels[:3]), together(*channels[3:]), through)

    return replace(read, base_above=base)
