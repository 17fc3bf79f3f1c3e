"""Results of imports: a stack or a mixture, and a list of what stacks cannot carry."""

from __future__ import annotations

from dataclasses import dataclass

from velatura.errors import one_line, short
from velatura.results import Result, Table
from velatura.stack import Texture, cross_section
from velatura.stack.io import Loaded

MOST = 100  # characters of a name, and of a value


@dataclass(frozen=True)
class Left:
    """A parameter that a stack cannot carry, or not as it is: its value as text, and what was done."""

    parameter: str
    value: str
    why: str

    def __str__(self) -> str:
        return f"{self.parameter} {self.value}: {self.why}"


@dataclass(frozen=True, repr=False)
class Imported(Result):
    """The stack or mixture nearest to a material of another program, and what is left of that."""

    stack: Loaded
    left: tuple[Left, ...] = ()

    def as_tables(self) -> list[Table]:
        """The layers, then a row for each parameter that is left."""
        rows = [(each.parameter, each.value, each.why) for each in self.left]
        return [
            *cross_section.tables(self.stack),
            *([Table("Left", ("parameter", "value", "why"), rows)] if rows else []),
        ]


class Notes:
    """A list of what is left, while a material is being read."""

    def __init__(self) -> None:
        self._left: dict[str, Left] = {}

    @property
    def left(self) -> tuple[Left, ...]:
        """All notes, in their order."""
        return tuple(self._left.values())

    def add(self, parameter: str, value: object, why: str) -> None:
        """Note one parameter; a second note of the same one is dropped."""
        name, text = (short(one_line(each), MOST) for each in (parameter, shown(value)))
        self._left.setdefault(name, Left(name, text, one_line(why)))


def shown(value: object) -> str:
    """A value in a list: numbers with four digits, and images by the name of their file."""
    if isinstance(value, Texture):
        return value.texture.name
    if isinstance(value, bool) or not isinstance(value, int | float | tuple | list):
        return str(value)
    numbers = [value] if isinstance(value, int | float) else value
    texts = [f"{number:.4g}" if isinstance(number, int | float) else str(number) for number in numbers]
    return texts[0] if isinstance(value, int | float) else f"[{', '.join(texts)}]"
