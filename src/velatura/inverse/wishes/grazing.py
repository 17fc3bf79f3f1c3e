"""A wish for the appearance at a second angle: what is reflected there, or the energy and blur of one lobe."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import model_validator

from velatura.inverse.wishes.wish import STEEPEST, Lacking, Wish, colour, compared, reflected
from velatura.model.lobe_statistics import StackLobes
from velatura.stack import Stack
from velatura.stack.values import Scalar, Whole

if TYPE_CHECKING:
    from velatura.inverse.fitting.free_values import Free
    from velatura.inverse.lobes.partial_stack import Array

MOST_LOBES = 48


class Grazing(Wish):
    """All that is reflected at an angle, or the lobe of a number, from the top, counted from 1."""

    key: ClassVar[str] = "grazing"
    keeps_lobes: ClassVar[bool] = True

    angle: Annotated[float, Scalar("of incidence", low=0.0, high=STEEPEST, unit="degrees", texturable=False)] = 75.0
    lobe: Annotated[int | None, Whole("number of a lobe", low=1, high=MOST_LOBES)] = None
    alpha: Annotated[float | None, Scalar("GGX roughness of the lobe", low=0.0, high=1.0, texturable=False)] = None

    @model_validator(mode="after")
    def _blur_is_of_a_lobe(self) -> Grazing:
        if self.alpha is not None and self.lobe is None:
            raise ValueError("alpha: is of one lobe; write lobe")
        return self

    @property
    def asked_for(self) -> Sequence[str]:
        return ("energy", "alpha")

    @property
    def goal(self) -> Array:
        return compared(self.energy, self.alpha)

    def shown(self, seen: StackLobes, n: int, groups: Sequence[Sequence[int]]) -> dict[str, Any]:
        if self.lobe is None:
            return {"energy": colour(reflected(seen)[:, n])}
        own = groups[self.lobe - 1]
        energy = np.sum([seen.energy[k][:, n] for k in own], axis=0)
        return {"energy": colour(energy), "alpha": float(np.mean([seen.alpha[k][:, n] for k in own]))}

    def moved(self, free: Free, stack: Stack) -> Free | None:
        return None if free.keys == ("albedo",) or free.keys[0].startswith("film") else free

    def lacking(self, stack: Stack) -> Lacking | None:
        count = len(stack.interfaces)
        if self.lobe is not None and self.lobe > count:
            return Lacking(f"grazing: lobe: the material has {count}, got {self.lobe}")
        return None
