"""The values of a material as typed records, in any dialect: floats, arrays, a renderer's numbers, recorded symbols.

Files, command lines, renderers and shaders address single values by flat names (`layer0_eta`); nothing else does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import islice
from typing import Any, TypeAlias

from velatura.stack.flat_names import Address, addresses
from velatura.stack.layers import KINDS, FilmValues, InterfaceValues, Kind, LayerValues, SlabValues, transmits
from velatura.stack.phases import WrittenPhase
from velatura.stack.spectra import MeasuredIndex
from velatura.stack.stack import Stack

Value: TypeAlias = Any


def number(address: Address, value: Any) -> Value:
    """A value of a stack in NumPy: a float, or a colour of shape (3, 1).

    Raises:
        InvalidInput: a texture, which has no one value.
    """
    import numpy as np

    both = address.name.removesuffix("_u").removesuffix("_v")  # axes, as one texture mostly gives them
    plain = address.plain(value, f"lobes are those of one point; replace it, as in --set {both}=0.1")
    return np.broadcast_to(np.asarray(plain, float), (3,))[:, None] if address.colour else float(plain)  # type: ignore[arg-type]


def as_described(address: Address, value: Any) -> Value:
    """A value as the stack has it."""
    return value


@dataclass(frozen=True)
class Material:
    """Layers from the top, and the index of the medium above them; `thin` for a pane with that medium below it, too.

    `light` is what channels of colours are of: those of "srgb", "luminance" alone, or wavelengths in nm.
    """

    layers: tuple[LayerValues, ...]
    exterior: Value
    thin: bool = False
    light: Value = "srgb"

    @classmethod
    def of(cls, stack: Stack, value: Callable[[Address, Any], Value] = number) -> Material:
        """The values of a stack, each as `value` converts it: in NumPy unless given."""
        flat = {address.name: value(address, described) for address, described in stack.values()}
        return cls.from_flat(stack, flat).of_metals(stack.measured)

    @classmethod
    def from_flat(cls, like: Stack | Material, values: Mapping[str, Value], light: Value = "srgb") -> Material:
        """Values by flat name, as `Stack.flat` has them, of layers of the same kinds as others."""
        return cls._like(like, [values[address.name] for address in addresses(like.kinds, like.films)], light)

    @classmethod
    def _like(cls, like: Stack | Material, values: Sequence[Value], light: Value) -> Material:
        exterior, *others = values
        each, layers = iter(others), []
        for kind, films, phase in zip(like.kinds, like.films, like.phases):
            own: dict[str, Any] = {address.key: next(each) for address in addresses((kind,))[1:]}
            if phase is not None:
                own["phase"] = phase
            several: dict[str, Any] = {"kind": kind} if len(KINDS[kind].lacks) > 1 else {}
            if films:
                own["films"] = tuple(FilmValues(*islice(each, len(fields(FilmValues)))) for _ in range(films))
            layers.append(KINDS[kind].record(**several, **own))
        return cls(tuple(layers), exterior, like.thin, light)

    def values(self) -> Iterator[tuple[Address, Value]]:
        """The exterior index, and every value of every layer."""
        described: list[Value] = [self.exterior]
        for layer, kind in zip(self.layers, self.kinds):
            described += [getattr(layer, address.key) for address in addresses((kind,))[1:]]
            if isinstance(layer, InterfaceValues):
                described += [value for film in layer.films for value in vars(film).values()]
        return zip(addresses(self.kinds, self.films), described)

    def each(self, change: Callable[[Address, Value], Value]) -> Material:
        """The material with every value changed."""
        changed = [change(address, value) for address, value in self.values()]
        return self._like(self, changed, self.light).coated(self.coatings).of_metals(self.measured)

    def coated(self, coatings: Sequence[Any]) -> Material:
        """The material with films on its layers as a renderer has them, None for those without."""
        return self._with("coating", coatings)

    def of_metals(self, measured: Sequence[MeasuredIndex | None]) -> Material:
        """The material with layers whose indices are colours of what was measured, None for those of no such one."""
        return self._with("measured", measured)

    @property
    def coatings(self) -> tuple[Any, ...]:
        """The films on each layer as a renderer has them."""
        return self._each("coating")

    @property
    def measured(self) -> tuple[MeasuredIndex | None, ...]:
        """The measured index that those of each layer are colours of."""
        return self._each("measured")

    def _each(self, key: str) -> tuple[Any, ...]:
        """An attribute of each layer beside its values, None for those that are no interfaces."""
        return tuple(getattr(layer, key) if isinstance(layer, InterfaceValues) else None for layer in self.layers)

    def _with(self, key: str, each: Sequence[Any]) -> Material:
        if not any(each) and not any(self._each(key)):
            return self
        pairs = zip(self.layers, each)
        layers = [replace(layer, **{key: x}) if isinstance(layer, InterfaceValues) else layer for layer, x in pairs]
        return replace(self, layers=tuple(layers))

    @property
    def films(self) -> tuple[int, ...]:
        """The number of films on each layer."""
        return tuple(len(layer.films) if isinstance(layer, InterfaceValues) else 0 for layer in self.layers)

    @property
    def phases(self) -> tuple[WrittenPhase | None, ...]:
        """The phase function of each layer, where it is not Henyey and Greenstein's."""
        return tuple(layer.phase if isinstance(layer, SlabValues) else None for layer in self.layers)

    def flat(self) -> dict[str, Value]:
        """All values by flat name."""
        return {address.name: value for address, value in self.values()}

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """The kinds of the layers from the top."""
        return tuple(layer.kind for layer in self.layers)

    @property
    def interfaces(self) -> tuple[InterfaceValues, ...]:
        """The interfaces from the top."""
        return tuple(layer for layer in self.layers if isinstance(layer, InterfaceValues))

    @property
    def surfaces(self) -> tuple[int, ...]:
        """Places of the interfaces, and of a diffuse base, among the layers."""
        return tuple(index for index, kind in enumerate(self.kinds) if KINDS[kind].surface)

    @property
    def transmits(self) -> bool:
        """Whether light passes, as seen from either side."""
        return transmits(self.kinds)

    @property
    def below(self) -> Value:
        """Index of the medium below a material that transmits."""
        return self.exterior if self.thin else self.interfaces[-1].eta

    def with_layer(self, n: int, **values: Value) -> Material:
        """The material with values of its n-th layer changed; an index that is, was not measured."""
        layers = list(self.layers)
        if self.measured[n] and not values.keys().isdisjoint(("eta", "k")):
            values = {"measured": None, **values}
        layers[n] = replace(layers[n], **values)  # type: ignore[type-var]  # all kinds of values are dataclasses
        return replace(self, layers=tuple(layers))

    def solid(self) -> Material:
        """The same layers with the index below written into the last one, where the material is a thin pane."""
        return replace(self.with_layer(-1, eta=self.exterior), thin=False) if self.thin else self

    def reversed(self) -> Material:
        """Dielectrics and media as seen from below.

        Directions are mirrored with them, so that tangents and rotations stay as they are.
        """
        solid, layers = self.solid(), []
        above = solid.exterior
        for layer in solid.layers:
            if isinstance(layer, InterfaceValues):
                coating = layer.coating and layer.coating.reversed()
                layer, above = replace(layer, eta=above, films=layer.films[::-1], coating=coating), layer.eta
            layers.append(layer)
        return Material(tuple(reversed(layers)), above, light=solid.light)
