"""The walk down the layers, of a stack or of its material: each layer with the media above and below it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from velatura.stack.layers import KINDS, Interface, InterfaceValues, Layer, LayerValues

L = TypeVar("L", Layer, LayerValues, covariant=True)


class Layered(Protocol[L]):
    """Layers from the top below the index `exterior`, which lies below them too where they are `thin`."""

    @property
    def layers(self) -> tuple[L, ...]: ...

    @property
    def exterior(self) -> Any: ...

    @property
    def thin(self) -> bool: ...


@dataclass(frozen=True)
class Meeting(Generic[L]):
    """A layer as light from above meets it: between media of indices `above` and `below`, and with `films` on it.

    Indices are as they are described; that `below` is None for a mirror and a diffuse base, and `films` where none are.
    """

    layer: L
    above: Any
    below: Any
    films: Any = None


def chain(layered: Layered[L], films: Sequence[Any] = ()) -> Iterator[Meeting[L]]:
    """The layers from the top; `films` are those on each, as `velatura.films` has them."""
    above = layered.exterior
    for place, layer in enumerate(layered.layers):
        if layered.thin and place == len(layered.layers) - 1:
            below = layered.exterior
        elif isinstance(layer, Interface | InterfaceValues):
            below = layer.eta
        else:
            below = None if KINDS[layer.kind].surface else above
        yield Meeting(layer, above, below, films[place] if films else None)
        above = below
