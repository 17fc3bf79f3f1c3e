"""Two materials side by side on shares of a surface, within the limits of mixtures."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TypeAlias

import numpy as np

from velatura.programs.imported import Notes
from velatura.programs.values import texels
from velatura.stack import Described, Mix, Stack, Texture
from velatura.stack.mix import DEEPEST, MOST, WEIGHT

Share: TypeAlias = float | Texture
Place: TypeAlias = tuple[int, ...]  # the numbers of the parts that a stack of a mixture is in


def beside(share: Share, first: Described, second: Described, notes: Notes) -> Described:
    """The first material on a share of the surface, and the second on the rest; one alone where it covers all.

    Of more than `MOST` stacks those on the greatest shares of the surface are kept. In what would be too deep, the
    innermost mixtures become one, in which images of weights stand as their means. The notes list both.
    """
    if share in (0, 1):
        return first if share == 1 else second
    if first.model_copy(update={"name": second.name}) == second:
        return first
    parts: list[Described | None] = [first, second]
    if sum(len(list(each.leaves())) for each in (first, second)) > MOST:
        parts = _greatest(share, first, second, notes)
    left = [each for each in parts if each is not None]
    if len(left) == 1:
        return left[0]
    first, second = (_within(each, DEEPEST - 1, notes) for each in left)
    return Mix([(share, first), (None, second)])


def _greatest(share: Share, first: Described, second: Described, notes: Notes) -> list[Described | None]:
    """Both materials with the stacks alone that are on the greatest shares; None for one of which none is."""
    whole = _number(share)
    sides = ((whole, first), (1 - whole, second))
    found = [(part * own, side, place) for side, (part, each) in enumerate(sides) for place, own in _shares(each)]
    found.sort(reverse=True)
    for own, side, place in found[MOST:]:
        why = f"more than {MOST} stacks: those on the smallest shares of the surface are left out"
        notes.add(f"part {_called(sides[side][1], place)}", own, why)
    kept = [[place for _, side, place in found[:MOST] if side == number] for number in range(2)]
    return [_only(each, places) for (_, each), places in zip(sides, kept)]


def _shares(material: Described) -> list[tuple[Place, float]]:
    """Every stack by its place, with the share that it has in the mean over the surface."""
    weights = {at.name: _number(value) for at, value in material.values() if at.declared is WEIGHT}  # type: ignore[arg-type]
    return [(place, float(own)) for (place, _), own in zip(material.leaves(), material.shares(weights))]


def _number(share: Share) -> float:
    """A share in the mean over the surface."""
    return float(np.mean(np.clip(texels(share), 0, 1))) if isinstance(share, Texture) else share


def _called(material: Described, place: Place) -> str:
    """The names of a stack, and of the mixtures that it is in."""
    names = [material.name]
    for index in place:
        material = material.mix[index].material  # type: ignore[union-attr]
        names.append(material.name)
    return ", ".join(filter(None, names)) or ".".join(map(str, place))


def _only(material: Described, kept: Collection[Place], place: Place = ()) -> Described | None:
    """A material with the stacks of some places alone; the last part of a mixture takes the shares of others."""
    if isinstance(material, Stack):
        return material if place in kept else None
    found = [(part.weight, _only(part.material, kept, (*place, index))) for index, part in enumerate(material.mix)]
    left = [(weight, each) for weight, each in found if each is not None]
    return _mix(left, material.name) if len(left) > 1 else left[0][1] if left else None


def _mix(parts: Sequence[tuple[Share | None, Described]], name: str) -> Mix:
    """A mixture whose last part has what the others leave."""
    *others, (_, last) = parts
    return Mix([*others, (None, last)], name=name)


def _within(material: Described, room: int, notes: Notes) -> Described:
    """A material with mixtures at most `room` deep."""
    depth = max(len(place) for place, _ in material.leaves())
    if isinstance(material, Stack) or depth <= room:
        return material
    if room > 1:
        parts = [(part.weight, _within(part.material, room - 1, notes)) for part in material.mix]
        return _mix(parts, material.name)
    for at, value in material.values():
        if at.declared is WEIGHT and isinstance(value, Texture):
            why = f"mixtures more than {DEEPEST} deep: the mean of the image stands for it"
            notes.add(f"weight {value.texture.name}", value, why)
    shares = [own for _, own in _shares(material)]
    return _mix([(own, stack) for own, (_, stack) in zip(shares, material.leaves())], material.name)
