"""The walk down the layers of a material: each layer with the medium above it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from velatura.stack.layers import InterfaceValues, LayerValues
from velatura.stack.material import Material, Value


@dataclass(frozen=True)
class Meeting:
    """A layer as light from above meets it: in a medium of index `above` (a colour), with `films` on it, or None."""

    layer: LayerValues
    above: Value
    films: Any = None


def chain(material: Material, films: Sequence[Any] = ()) -> Iterator[Meeting]:
    """The layers from the top; `films` are those on each, as `velatura.films` has them."""
    above = material.exterior
    for place, layer in enumerate(material.layers):
        yield Meeting(layer, above, films[place] if films else None)
        if isinstance(layer, InterfaceValues) and layer.kind == "dielectric":
            above = layer.eta
