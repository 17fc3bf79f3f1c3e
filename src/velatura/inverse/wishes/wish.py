"""A wish beyond lobes at normal incidence: an energy, and for some kinds a blur, at an angle of incidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar

import numpy as np
from pydantic import model_validator

from velatura.model.lobe_statistics import MixtureLobes, StackLobes
from velatura.results import digits
from velatura.stack import RGB, Stack
from velatura.stack.schema import Parameter, Record, Taken, by_default
from velatura.stack.spectra import lab
from velatura.stack.values import Colour, NumberLike, NumbersLike, Scalar

if TYPE_CHECKING:
    from velatura.inverse.fitting.free_values import Free
    from velatura.inverse.lobes.partial_stack import Array

BLURS = 5.0  # weight of a roughness beside colours in units of 100 of CIE 1976: .002 weighs as much as a unit
STEEPEST = 89.0  # degrees
MOST = 4  # wishes of one kind

WishType = TypeVar("WishType", bound="Wish")


@dataclass(frozen=True)
class Lacking:
    """Why a material cannot have what is wished for, and the material that could, in words and as a stack, if there
    is one."""

    why: str
    words: str = ""
    stack: Stack | None = None


class Wish(Record):
    """A share of the light that a stack is to show, under its key in a target."""

    key: ClassVar[str]
    #: Whether lobes at normal incidence that nothing is asked of stay.
    keeps_lobes: ClassVar[bool] = False

    angle: Annotated[float, Scalar("of incidence", low=0.0, high=STEEPEST, unit="degrees", texturable=False)] = 0.0
    energy: Annotated[
        Taken[NumberLike | NumbersLike | None, float | RGB | None],
        Colour("share of the light", low=0.0, high=1.0, texturable=False),
    ] = by_default(None)

    @model_validator(mode="after")
    def _asks_for_something(self) -> Wish:
        if not len(self.goal):
            raise ValueError(f"must ask for {' or '.join(self.asked_for)}")
        return self

    @property
    def asked_for(self) -> Sequence[str]:
        """Keys of which one at least is given."""
        return ("energy",)

    @property
    def goal(self) -> Array:
        """The values that are asked for, as they are compared."""
        return compared(self.energy, None)

    def shown(self, seen: StackLobes, n: int, groups: Sequence[Sequence[int]]) -> dict[str, Any]:
        """Values of its keys that a stack has, from its lobes, at the n-th of their directions; groups: the interfaces
        of each lobe of the target."""
        raise NotImplementedError

    def reached(self: WishType, seen: StackLobes, n: int, groups: Sequence[Sequence[int]]) -> WishType:
        """This wish with what a stack has of the keys that are asked for."""
        has = {key: value for key, value in self.shown(seen, n, groups).items() if getattr(self, key) is not None}
        return self.model_copy(update=has)

    def moved(self, free: Free, stack: Stack) -> Free | None:
        """A value of the stack with the bounds within which it may change for this wish, None where it stays."""
        raise NotImplementedError

    def lacking(self, stack: Stack) -> Lacking | None:
        """The reason why layers of this kind cannot have what is wished for, None if they can."""
        return None

    def starts(self, stack: Stack) -> list[Stack]:
        """Stacks to begin the search with."""
        return [stack]

    def words(self) -> str:
        """The wish in a message."""
        values = (f"{key} {digits(value)}" for key, value in self if value is not None and key in self.asked_for)
        return f"{self.key} {', '.join(values)}" + (f" at {self.angle:g} degrees" if self.angle else "")


@dataclass(frozen=True)
class Wished(Parameter):
    """Wishes of one kind: one, or a list."""

    record: type[Wish] = Wish
    most: int = field(default=MOST)

    @property
    def values(self) -> str:
        several = f", or a list of {self.most} at most" if self.most > 1 else ""
        return f"a mapping of {', '.join(self.record.model_fields)}{several}"

    def check(self, value: Any) -> tuple[Wish, ...]:
        entries = value if isinstance(value, list | tuple) else [value]
        if not 0 < len(entries) <= self.most or not all(isinstance(each, self.record | Mapping) for each in entries):
            raise self.refuse(value)
        try:
            return tuple(each if isinstance(each, self.record) else self.record.from_dict(each) for each in entries)
        except ValueError as error:
            raise ValueError(str(error)) from None


def compared(energy: Any, alpha: float | None) -> Array:
    """An energy, in CIE 1976 L*a*b* over 100, and a roughness, as a search compares them; None where not asked for."""
    parts = [] if energy is None else [lab(np.broadcast_to(np.array(energy, float), 3)) / 100]
    return np.concatenate([*parts, [] if alpha is None else [BLURS * alpha]])


def reflected(seen: StackLobes | MixtureLobes) -> Array:
    """All that is reflected, (C, N)."""
    return np.asarray(sum(seen.energy, seen.remainder))


def colour(energy: Array) -> Any:
    """An energy (3,) as a key has it."""
    r, g, b = map(float, np.clip(energy, 0.0, 1.0))
    return r if r == g == b else (r, g, b)
