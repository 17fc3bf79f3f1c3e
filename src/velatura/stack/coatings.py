"""Interfaces with thin films: what they need of their neighbours, and the numbers that they are worked out from."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

from velatura.errors import InvalidInput
from velatura.stack.layers import EXTERIOR, CoatingValues, FilmValues, Interface
from velatura.stack.schema import parameters
from velatura.stack.spectra import Measured, Named
from velatura.stack.values import RGB, Colour, Scalar, Varying

if TYPE_CHECKING:
    from velatura.stack.stack import Stack

#: The colour of a value, by its flat name and as it is described.
Reader: TypeAlias = Callable[[str, Any], RGB]

STEP_MIN = 1e-3  # least step of the logarithm of the index across an interface with films


def as_written(name: str, value: Any) -> RGB:
    """The colour of an index of a stack."""
    key = name.rsplit("_", 1)[-1]
    declared = EXTERIOR if name == "exterior" else parameters(Interface)[key]
    assert isinstance(declared, Scalar)
    if isinstance(value, str):
        value = Named(value, "k" if key == "k" else "eta")
    if isinstance(value, Measured):
        return declared.reduced(value) if isinstance(declared, Colour) else (1.0, 1.0, 1.0)
    return value if isinstance(value, tuple) else (value, value, value)


def check(stack: Stack) -> None:
    """ValueError, in one line, where an interface with films does not fit its neighbours."""
    above: Any = stack.exterior
    for index, layer in enumerate(stack.layers):
        if not isinstance(layer, Interface):
            continue
        if layer.films:
            where = f"layer {index} (interface): films"
            if isinstance(above, Varying):
                raise ValueError(f"{where}: not below an index from a texture")
            if not layer.opaque:
                below = stack.exterior if stack.thin and layer is stack.layers[-1] else layer.eta
                n_1, n_2 = sum(as_written("layer_eta", above)), sum(as_written("layer_eta", below))
                if abs(n_2 / n_1 - 1) < STEP_MIN:
                    raise ValueError(f"{where}: only between media whose indices differ by more than {STEP_MIN:g}")
        above = layer.eta


def of(stack: Stack, read: Reader = as_written) -> tuple[CoatingValues | None, ...]:
    """Of each layer, None without films; a thickness of 0 is no film."""
    outside: tuple[str, Any] = ("exterior", stack.exterior)
    above, found = outside, []
    for index, layer in enumerate(stack.layers):
        coating = None
        if isinstance(layer, Interface):
            below = f"layer{index}_eta", layer.written("eta")
            thick = [film for film in layer.films if film.thickness_nm > 0]
            if thick:
                films = tuple(FilmValues(x.colour("eta"), x.colour("k"), x.thickness_nm) for x in thick)
                k = read(f"layer{index}_k", layer.written("k")) if layer.opaque else (0.0, 0.0, 0.0)
                leaves = stack.thin and layer is stack.layers[-1]
                coating = CoatingValues(films, read(*above), read(*(outside if leaves else below)), k, layer.opaque)
            above = below
        found.append(coating)
    return tuple(found)


def refuse(stack: Stack, what: str) -> None:
    """Refuse a stack with films, for what knows none yet.

    Raises:
        InvalidInput: it has one; `what` begins the reason.
    """
    for index, layer in enumerate(stack.layers):
        if isinstance(layer, Interface) and layer.films:
            raise InvalidInput(f"layer {index} (interface): films: {what} no thin films yet")
