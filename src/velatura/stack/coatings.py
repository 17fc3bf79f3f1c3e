"""Interfaces with thin films: what they need of their neighbours, and what has none yet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from velatura.errors import InvalidInput
from velatura.stack.chain import chain
from velatura.stack.layers import Interface
from velatura.stack.spectra import Measured, Named, rgb
from velatura.stack.values import Varying

if TYPE_CHECKING:
    from velatura.stack.stack import Stack

STEP_MIN = 1e-3  # least step of the logarithm of the index across a rough interface: below, all take it for smooth


def check(stack: Stack) -> None:
    """ValueError, in one line, where an interface with films does not fit its neighbours."""
    for index, meeting in enumerate(chain(stack)):
        layer = meeting.layer
        if not isinstance(layer, Interface) or not layer.films or layer.opaque or layer.alpha == 0:
            continue
        indices = meeting.above, meeting.below
        if any(isinstance(eta, Varying) for eta in indices):
            continue
        above, below = map(_mean, indices)
        if abs(below / above - 1) < STEP_MIN:
            raise ValueError(
                f"layer {index} (interface): films: between media whose indices differ by less than {STEP_MIN:g} "
                "only where alpha is 0"
            )


def _mean(index: Any) -> float:
    """An index, as the mean over channels."""
    if isinstance(index, str):
        index = Named(index, "eta")
    if isinstance(index, Measured):
        index = rgb(index)
    return sum(index) / len(index) if isinstance(index, tuple) else float(index)


def refuse(stack: Stack, what: str) -> None:
    """Refuse a stack with films, for what knows none yet.

    Raises:
        InvalidInput: it has one; `what` begins the reason.
    """
    for index, layer in enumerate(stack.layers):
        if isinstance(layer, Interface) and layer.films:
            raise InvalidInput(f"layer {index} (interface): films: {what} no thin films yet")
