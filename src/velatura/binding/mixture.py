"""The material of a plugin as stacks side by side, each with its share of a point; a single stack is the only one."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import Any

from velatura.binding import properties as properties_of
from velatura.binding.materials import Binding
from velatura.binding.values import Values
from velatura.stack.mix import WEIGHT


class Mixture:
    """The stacks of a plugin's material, and their weights.

    Args:
        mi: Mitsuba, with a variant set.
        properties: of the plugin; all names are read but those in `options`.

    Attributes:
        material: as described; textures given as objects have a number standing in.
        weights: the values of all weights, by flat name.
        bindings: the values of every stack, each with the part that it is in as its prefix.

    Raises:
        InvalidInput: in one line, for anything that a material file would be refused for, and for unknown names.
    """

    def __init__(self, mi: Any, properties: Any, options: Collection[str] = ()) -> None:
        self.material, values = properties_of.described(mi, properties, options)
        self.weights = Values(mi, {at: value for at, value in values.items() if at.declared is WEIGHT})
        self.bindings: list[Binding] = []
        for parts, stack in self.material.leaves():
            inside = {at: value for at, value in values.items() if at.parts == parts and at.declared is not WEIGHT}
            own = {replace(at, parts=()): value for at, value in inside.items()}
            self.bindings.append(Binding(mi, stack, own, "".join(f"part{number}_" for number in parts)))
        self.weights.update()

    def shares(self, si: Any, active: Any) -> list[Any]:
        """The share of every stack at a surface point."""
        weights = {name: self.weights.value(name, si, active) for name in self.weights.addresses}
        return self.material.shares(weights)

    def __iter__(self) -> Iterator[tuple[Values, str]]:
        """Every value by the values that hold it, and its name among these."""
        for values in (self.weights, *self.bindings):
            for name in values.addresses:
                yield values, name

    def named(self, name: str) -> tuple[Values, str] | None:
        """The values that hold one of that flat name, and its name among them; None where there is none."""
        return next((found for found in self if found[0].prefix + found[1] == name), None)

    def update(self, keys: Collection[str]) -> list[bool]:
        """Update what changed under the names of `keys`, of everything where there are none.

        Returns:
            For every stack, whether any of its values did.
        """
        self.weights.update()
        inside = [key for key in keys if key not in self.weights.addresses]
        changed = [not keys or any(key.startswith(own.prefix) for key in inside) for own in self.bindings]
        for own, stale in zip(self.bindings, changed):
            if stale:
                own.update()
        return changed
