"""Substances that a workshop has, and stacks of these."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.stack import Interface, InterfaceValues, Material, Stack
from velatura.stack.schema import Parameter, show
from velatura.stack.spectra import names
from velatura.stack.values import Substance

MOST = 24  # substances
ENUMERATED = 64  # choices that are all tried; of more, those that are nearest to stacks with the lobes


@dataclass(frozen=True)
class Available(Parameter):
    """A list of substances: numbers, names, pages of refractiveindex.info."""

    @property
    def values(self) -> str:
        return f"a list of {MOST} indices or names of substances at most"

    def check(self, value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple) or not 0 < len(value) <= MOST:
            raise self.refuse(value)
        for each in value:
            if isinstance(each, bool) or not isinstance(each, int | float | str | Mapping | Substance):
                raise ValueError(f"must hold indices or names of substances, got {show(each)}")
            of_substance(each)
        return tuple(Substance.from_dict(each) if isinstance(each, Mapping) else each for each in value)


def of_substance(entry: Any) -> Interface:
    """A smooth interface above a substance. Raises InvalidInput where it is none."""
    return Interface(conductor=entry) if isinstance(entry, str) and entry in names()[0] else Interface(eta=entry)


def made_of(starts: Sequence[Stack], available: Iterable[Any], kept: Iterable[int]) -> Iterator[Stack]:
    """Stacks like some others, each interface above a substance that is available.

    Metals replace metals, and dielectrics dielectrics, where there are any; layers that are `kept`, and mirrors, stay.
    Each choice is made of the stack that is nearest to it.
    """
    substances = [of_substance(each) for each in available]
    stay = set(kept)
    options: dict[int, list[Interface]] = {}
    for n, layer in enumerate(starts[0].layers):
        if isinstance(layer, Interface) and layer.kind != "mirror" and n not in stay:
            alike = [each for each in substances if each.opaque == layer.opaque]
            if alike:
                options[n] = alike
    if not options:
        raise InvalidInput("available: holds no substance for any interface; name dielectrics, or metals for a metal")
    far = {
        n: np.array([[_apart(stack.layers[n], each) for each in alike] for stack in starts])
        for n, alike in options.items()
    }
    every: Iterable[tuple[int, ...]] = product(*(range(len(alike)) for alike in options.values()))
    if prod(map(len, options.values())) > ENUMERATED:
        nearest = np.transpose([each.argmin(axis=1) for each in far.values()])
        every = list(dict.fromkeys(map(tuple, nearest.tolist())))[:ENUMERATED]
    for choice in every:
        chosen = dict(zip(options, choice))
        stack = starts[int(np.argmin(sum(far[n][:, k] for n, k in chosen.items())))]
        layers = list(stack.layers)
        for n, k in chosen.items():
            index = {key: getattr(options[n][k], key) for key in ("eta", "k", "conductor")}
            layers[n] = layers[n].model_copy(update=index)
        yield stack.with_layers(layers)


def _apart(layer: Any, substance: Interface) -> float:
    """Difference of two indices, of logarithms, and of metals also of the extinctions."""
    pairs = zip(_index(layer), _index(substance))
    return float(sum(np.abs(np.log(a / b)).mean() for a, b in pairs))


def _index(layer: Interface) -> list[Any]:
    """The index of what lies below an interface, and of a metal also the extinction."""
    (values,) = Material.of(Stack([layer])).layers
    assert isinstance(values, InterfaceValues)
    found = [values.eta, values.k] if layer.opaque else [values.eta]
    return [np.maximum(np.broadcast_to(np.ravel(each), 3), 1e-3) for each in found]
