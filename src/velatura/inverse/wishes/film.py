"""A wish for the colour that a thin film gives, with its thickness as the coordinate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import model_validator

from velatura.errors import InvalidInput
from velatura.inverse.wishes.wish import Lacking, Wish, colour, compared, reflected
from velatura.model.lobe_statistics import StackLobes
from velatura.model.registry import stack_lobes
from velatura.stack import Interface, Stack
from velatura.stack.layers import film_key
from velatura.stack.values import THICKEST_NM, Film, Films, Scalar, Whole

if TYPE_CHECKING:
    from velatura.inverse.fitting.free_values import Free

THINNEST_NM = 1.0
QUICK = "weier2020"  # by which thicknesses are looked through: it has no averages over facets
STEPS_NM = 10.0  # of these: a fringe of an index of 4 has 50 nm
TINY = 1e-12  # curvature that is none
ORDERS = 8  # thicknesses that a search begins with
OXIDE = 2.4, 60.0  # index and thickness of a film where there is none


class FilmColour(Wish):
    """The colour of all that is reflected, by the thickness of one film alone; the nearest colour that it has."""

    key: ClassVar[str] = "film"

    layer: Annotated[int | None, Whole("of the interface with the film; the first that has any", high=47)] = None
    film: Annotated[int, Whole("which film of the layer, from the top, counted from 0", high=Films.most - 1)] = 0
    thinnest_nm: Annotated[
        float, Scalar("the smallest thickness", low=THINNEST_NM, high=THICKEST_NM, unit="nm", texturable=False)
    ] = THINNEST_NM
    thickest_nm: Annotated[
        float, Scalar("the largest thickness", low=THINNEST_NM, high=THICKEST_NM, unit="nm", texturable=False)
    ] = 1000.0

    @model_validator(mode="after")
    def _some_thickness(self) -> FilmColour:
        if self.thinnest_nm >= self.thickest_nm:
            raise ValueError(f"thickest_nm: must be above thinnest_nm, {self.thinnest_nm:g}, got {self.thickest_nm:g}")
        return self

    def shown(self, seen: StackLobes, n: int, groups: Sequence[Sequence[int]]) -> dict[str, Any]:
        return {"energy": colour(reflected(seen)[:, n])}

    def place(self, stack: Stack) -> int | None:
        """The layer of the film, None if the stack has no such film."""
        coated = [n for n, count in enumerate(stack.films) if count > self.film]
        return next((n for n in coated if self.layer in (None, n)), None)

    def name(self, stack: Stack) -> str:
        """The flat name of its thickness."""
        return f"layer{self.place(stack)}_{film_key(self.film, 'thickness_nm')}"

    def moved(self, free: Free, stack: Stack) -> Free | None:
        if free.keys != (film_key(self.film, "thickness_nm"),) or free.layer != self.place(stack):
            return None
        return replace(free, low=self.thinnest_nm, high=self.thickest_nm)

    def lacking(self, stack: Stack) -> Lacking | None:
        if self.place(stack) is not None:
            return None
        where = next((n for n in reversed(range(len(stack.layers))) if isinstance(stack.layers[n], Interface)), None)
        if where is None or any(stack.films) or stack.kinds[where] == "mirror":
            return Lacking("film: no interface has such a film")
        eta, thickness = OXIDE
        film = stack.layers[where].model_copy(update={"films": (Film(eta=eta, thickness_nm=thickness),)})
        coated = stack.with_layers([*stack.layers[:where], film, *stack.layers[where + 1 :]])
        return Lacking("film: no interface has films", f"a film of index {eta:g} on layer {where}", coated)

    def starts(self, stack: Stack) -> list[Stack]:
        """The stack with thicknesses whose colours are nearer than those beside them, the nearest first."""
        name = self.name(stack)
        thickness = np.arange(self.thinnest_nm, self.thickest_nm + STEPS_NM, STEPS_NM).clip(max=self.thickest_nm)
        cosine = np.cos(np.radians(self.angle))
        missed = np.empty(len(thickness))
        for k, each in enumerate(thickness):
            try:
                seen = stack_lobes(stack.replace(**{name: float(each)}), cosine, model=QUICK)
                missed[k] = np.linalg.norm(compared(self.shown(seen, 0, ())["energy"], None) - self.goal)
            except InvalidInput:  # a rough interface with films between equal indices
                missed[k] = np.inf
        beside = np.r_[np.inf, missed, np.inf]
        least = np.flatnonzero((missed <= beside[:-2]) & (missed <= beside[2:]) & np.isfinite(missed))
        # The least of the parabola through a thickness and those beside it, of squares
        before, here, after = (beside[least + k] ** 2 for k in range(3))
        inside = np.isfinite(before + after)
        lean, bend = np.where(inside, before - after, 0.0), np.where(inside, before - 2 * here + after, 1.0)
        shift = lean / np.maximum(2 * bend, TINY)  # within half a step, since both neighbours are further off
        lowest = here - lean * shift / 4
        nearest = np.argsort(lowest, kind="stable")[:ORDERS]
        found = np.clip(thickness[least] + STEPS_NM * shift, self.thinnest_nm, self.thickest_nm)
        return [stack.replace(**{name: float(found[k])}) for k in nearest]
