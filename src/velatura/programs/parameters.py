"""Parameters of other programs' materials: names, defaults and ranges, for what writes them and for what reads them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

RGB: TypeAlias = tuple[float, float, float]
Values: TypeAlias = Mapping[str, "float | RGB"]

GREATEST = float("inf")
ALPHA_MIN = 1e-3  # of lobes that are evaluated: smoother ones as this

#: Ranges of fits.
UNIT, ROUGH = (0.0, 1.0), (ALPHA_MIN**0.5, 1.0)


@dataclass(frozen=True)
class Input:
    """A number or a colour (linear RGB) with its default and its range, each colour's components in the same.

    within: the part of the file that it stands in, where that has several: an extension's name.
    fit: what a fitted parameter is of a surface, and its range. "colour", "index" and "diffuse" are fitted to
        every stack; "metal" and "clear", shares of the base, where media scatter light; "rough" and "brushed" where the
        base is seen through others, or passes light; "tint" where reflectances at the normal are not those of one
        index; "coat", "film" and "thickness", of the film, where there is one.
    """

    name: str
    default: float | RGB
    low: float = 0.0
    high: float = 1.0
    within: str = ""
    fit: tuple[str, float, float] | None = None

    @property
    def is_colour(self) -> bool:
        return isinstance(self.default, tuple)

    @property
    def is_flag(self) -> bool:
        return self.default is False


def complete(parameters: tuple[Input, ...], given: Values) -> dict[str, Any]:
    """All values, the defaults where none is given."""
    return {each.name: given.get(each.name, each.default) for each in parameters}
