"""Parameters of other programs' materials: names, defaults and ranges, for what writes them and for what reads them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

RGB: TypeAlias = tuple[float, float, float]
Values: TypeAlias = Mapping[str, "float | RGB"]

GREATEST = float("inf")


@dataclass(frozen=True)
class Parameter:
    """A number or a colour (linear RGB) with its default and its range, each colour's components in the same.

    within: the part of the file that it stands in, where that has several: an extension's name.
    """

    name: str
    default: float | RGB
    low: float = 0.0
    high: float = 1.0
    within: str = ""

    @property
    def is_colour(self) -> bool:
        return isinstance(self.default, tuple)

    @property
    def is_flag(self) -> bool:
        return self.default is False


def complete(parameters: tuple[Parameter, ...], given: Values) -> dict[str, Any]:
    """All values, the defaults where none is given."""
    return {each.name: given.get(each.name, each.default) for each in parameters}
