"""Interfaces with thin films: what they need of their neighbours, and what has none yet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from velatura.errors import InvalidInput
from velatura.stack.layers import Interface
from velatura.stack.spectra import Measured, Named, rgb
from velatura.stack.values import Varying

if TYPE_CHECKING:
    from velatura.stack.stack import Stack

STEP_MIN = 1e-3  # least step of the logarithm of the index across a rough interface: below, all take it for smooth


def check(stack: Stack) -> None:
    """ValueError, in one line, where an interface with films does not fit its neighbours."""
    above: Any = stack.exterior
    for index, layer in enumerate(stack.layers):
        if not isinstance(layer, Interface):
            continue
        if layer.films:
            below = stack.exterior if stack.thin and layer is stack.layers[-1] else layer.eta
            rough = not layer.opaque and layer.alpha != 0
            known = not isinstance(above, Varying) and not isinstance(below, Varying)
            if rough and known and abs(_mean(below) / _mean(above) - 1) < STEP_MIN:
                raise ValueError(
                    f"layer {index} (interface): films: between media whose indices differ by less than {STEP_MIN:g} "
                    "only where alpha is 0"
                )
        above = layer.eta


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
