"""Reasons why a target has no stack: their texts, and the error that gives them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from velatura.errors import NoSolution
from velatura.inverse.lobes.interface import CONDUCTOR_MIN
from velatura.inverse.lobes.target import Target

TOO_MUCH = "energies sum to {total:.4g}, above 1"
REASONS = {
    "energy": "no index up to {eta_max:g} reflects as much",
    "bright": "not even the brightest metal reflects as much, of what its facets lose and what lies above lets through",
    "upper": "its upper interface alone reflects more",
    "absorption": "the fixed index reflects too little",
    "excess": "the fixed index reflects more, and what lies above it absorbs nothing, or what is fixed",
    "colour": "no index, and nothing that may absorb above it, gives that colour",
    "grey": "nothing above it absorbs, so that it must be grey",
    "mirror": "nothing above this mirror absorbs, so that it reflects all light",
    "metal": f"a conductor (k >= eta) reflects more, {CONDUCTOR_MIN:.3f} at least, and what lies above absorbs nothing",
    "blur": "what lies above it blurs light more than that, or bounces it too often",
    "index": "a fixed index is outside its bounds, 1 to {eta_max:g} or k >= eta",
    "fixed": "a fixed roughness is not the one that gives that blur",
    "unmet energy": "no stack is found with that energy and all else as asked",
    "unmet blur": "no stack is found with that blur and all else as asked",
}
#: What reflects too little: of a dielectric, of a conductor, of either where its index is fixed.
TOO_LITTLE = ("energy", "bright", "absorption")
#: What the nearest stack that is found misses most, where no bound is in the way.
UNMET = ("unmet energy", "unmet blur")


@dataclass(frozen=True)
class Direction:
    """One way to change a target: the quantity, its description, and the nearest target that has a stack.

    why, lobe, constraint: of the refusal, as `Infeasible` has them, where the way itself knows them.
    """

    what: str
    words: str
    change: float
    target: Target
    why: str | None = None
    lobe: int = 0
    constraint: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """The way as JSON has it."""
        return {"what": self.what, "words": self.words, "change": self.change, "target": self.target.to_dict()}


class Infeasible(NoSolution):
    """No stack gives the target.

    lobe: the first one from the top, counted from 1, that cannot be given; 0 where it is all of them. constraint: what
    forbids it, a key of `REASONS`, or "sum". directions: the targets that can be reached, the nearest first, of each
    description one.
    """

    def __init__(self, why: str, lobe: int, constraint: str, directions: list[Direction]) -> None:
        self.why, self.lobe, self.constraint = why, lobe, constraint
        first: dict[str, Direction] = {}
        for direction in directions:
            first.setdefault(direction.words, direction)
        self.directions = list(first.values())
        hints = "; ".join(first)
        super().__init__(f"no stack: {why}" + (f" (possible: {hints})" if hints else ""))

    def nearer(self, way: Direction) -> Infeasible:
        """The refusal with a way out that comes first, and its reason."""
        why, constraint = way.why or self.why, way.constraint or self.constraint
        return Infeasible(why, way.lobe or self.lobe, constraint, [way, *self.directions])

    @property
    def nearest(self) -> Target | None:
        """The target with the smallest change, of all directions."""
        return self.directions[0].target if self.directions else None


def because(lobe: int, constraint: str, target: Target) -> str:
    """The reason in words; that for a colour depends on whether a medium can give it."""
    own = target.lobes[lobe]
    on_top = lobe == 0 and own.interfaces == 1 and own.base == "dielectric"
    if constraint == "colour" and on_top and own.fixed.of("tau", 0) is None:
        constraint = "grey"
    return f"lobe {lobe + 1}: {REASONS[constraint].format(eta_max=target.eta_max)}"
