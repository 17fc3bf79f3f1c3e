"""Substances and lacquers that a workshop has, and stacks of these."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import prod
from typing import Annotated, Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.stack import RGB, Interface, InterfaceValues, Material, Medium, MediumValues, Stack
from velatura.stack.schema import Parameter, Record, Taken, show
from velatura.stack.spectra import names
from velatura.stack.values import INDEX_HIGH, INDEX_LOW, Colour, NumberLike, NumbersLike, Scalar, Substance

MOST = 24  # substances
ENUMERATED = 64  # choices that are all tried; of more, those that are nearest to stacks with the lobes


class Lacquer(Record):
    """A coat of given absorption, which is laid as thick as it takes."""

    eta: Annotated[float, Scalar("index of refraction", low=INDEX_LOW, high=INDEX_HIGH, texturable=False)]
    sigma_a: Annotated[
        Taken[NumberLike | NumbersLike, float | RGB],
        Colour("absorption per unit of depth", low=0.0, high=1e6, texturable=False),
    ]

    @property
    def colour(self) -> tuple[float, ...]:
        """The absorption of the three channels."""
        return self.sigma_a if isinstance(self.sigma_a, tuple) else (self.sigma_a,) * 3

    def depth_of(self, tau: Any) -> float:
        """The depth of a coat of about that optical depth, by least squares."""
        own = np.array(self.colour)
        return float(own @ np.broadcast_to(np.ravel(tau), 3) / max(own @ own, 1e-12))


@dataclass(frozen=True)
class Available(Parameter):
    """A list of substances: numbers, names, pages of refractiveindex.info, lacquers."""

    @property
    def values(self) -> str:
        return f"a list of {MOST} indices, names of substances, or lacquers of eta and sigma_a at most"

    def check(self, value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple) or not 0 < len(value) <= MOST:
            raise self.refuse(value)
        for each in value:
            if isinstance(each, bool) or not isinstance(each, int | float | str | Mapping | Substance | Lacquer):
                raise ValueError(f"must hold indices, names of substances, or lacquers, got {show(each)}")
        entries = tuple(_read(each) if isinstance(each, Mapping) else each for each in value)
        for each in entries:
            of_substance(each)
        return entries


def _read(entry: Mapping[str, Any]) -> Substance | Lacquer:
    return Substance.from_dict(entry) if "refractiveindex" in entry else Lacquer.from_dict(entry)


def of_substance(entry: Any) -> Interface:
    """A smooth interface above a substance. Raises InvalidInput where it is none."""
    if isinstance(entry, Lacquer):
        return Interface(eta=entry.eta)
    return Interface(conductor=entry) if isinstance(entry, str) and entry in names()[0] else Interface(eta=entry)


def made_of(starts: Sequence[Stack], available: Iterable[Any], kept: Iterable[int], thinnest: float) -> Iterator[Stack]:
    """Stacks like some others, each interface above a substance that is available.

    Metals replace metals, and dielectrics dielectrics, where there are any; layers that are `kept`, and mirrors, stay.
    A lacquer is also the medium below its interface, at least `thinnest`. Each choice is made of the stack that is
    nearest to it.
    """
    substances = [(each, of_substance(each)) for each in available]
    stay = set(kept)
    options: dict[int, list[tuple[Any, Interface]]] = {}
    for n, layer in enumerate(starts[0].layers):
        if isinstance(layer, Interface) and layer.kind != "mirror" and n not in stay:
            alike = [each for each in substances if each[1].opaque == layer.opaque]
            if alike:
                options[n] = alike
    if not options:
        raise InvalidInput("available: holds no substance for any interface; name dielectrics, or metals for a metal")
    far = {
        n: np.array([[_apart(stack.layers[n], each) for _, each in alike] for stack in starts])
        for n, alike in options.items()
    }
    every: Iterable[tuple[int, ...]] = product(*(range(len(alike)) for alike in options.values()))
    if prod(map(len, options.values())) > ENUMERATED:
        nearest = np.transpose([each.argmin(axis=1) for each in far.values()])
        every = list(dict.fromkeys(map(tuple, nearest.tolist())))[:ENUMERATED]
    for choice in every:
        chosen = dict(zip(options, choice))
        stack = starts[int(np.argmin(sum(far[n][:, k] for n, k in chosen.items())))]
        layers, values = list(stack.layers), Material.of(stack).layers
        for n, k in chosen.items():
            entry, surface = options[n][k]
            index = {key: getattr(surface, key) for key in ("eta", "k", "conductor")}
            layers[n] = layers[n].model_copy(update=index)
            below, coat = (each[n + 1] if n + 1 < len(layers) else None for each in (layers, values))
            if (
                isinstance(entry, Lacquer)
                and isinstance(below, Medium)
                and isinstance(coat, MediumValues)
                and not (n + 1 in stay or coat.spreads)
            ):
                depth = max(entry.depth_of(coat.tau_a), thinnest)
                layers[n + 1] = below.model_copy(update={"sigma_a": entry.sigma_a, "depth": depth})
        yield stack.with_layers(layers)


def laid(stack: Stack, available: Iterable[Any]) -> list[int]:
    """Layers of a stack that are coats of lacquers."""
    lacquers = [each for each in available if isinstance(each, Lacquer)]
    layers = list(enumerate(stack.layers))
    return [
        n
        for (_, above), (n, layer) in pairwise(layers)
        if isinstance(above, Interface)
        and isinstance(layer, Medium)
        and any((above.eta, layer.sigma_a) == (each.eta, each.sigma_a) for each in lacquers)
    ]


def filled(stack: Stack) -> Stack:
    """The stack with a clear medium below every interface that has none, but the last one."""
    layers = list(stack.layers[:1])
    for above, below in pairwise(stack.layers):
        layers += [Medium(), below] if isinstance(above, Interface) and below.surface else [below]
    return stack.with_layers(layers)


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
