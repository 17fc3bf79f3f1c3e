"""A material: a stack of layers, from the top."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any

from pydantic import model_validator

from velatura.errors import InvalidInput, within
from velatura.stack import coatings, cross_section, flat_names
from velatura.stack.flat_names import Address
from velatura.stack.layers import (
    EXTERIOR,
    LAYERS,
    Diffuse,
    Interface,
    Kind,
    Layer,
    LayerRecord,
    Medium,
    Value,
    entry_name,
    transmits,
)
from velatura.stack.phases import WrittenPhase
from velatura.stack.schema import Record, show, unknown
from velatura.stack.spectra import MeasuredIndex
from velatura.stack.values import Flag, Text, Written


class Stack(Record):
    """Layers from the top down, frozen and validated.

    Args:
        layers: `Interface`, `Medium` and `Diffuse` models, or mappings as a file holds them.
        name, source, exterior, thin: the keys of a file.

    Raises:
        InvalidInput: in one line that names layer, key and allowed range.
    """

    holds = "the keys of a material, layers above all"

    name: Annotated[str, Text("name of the material")] = ""
    source: Annotated[str, Text("where the numbers come from", lines=True)] = ""
    exterior: Annotated[float, EXTERIOR] = 1.0
    thin: Annotated[bool, Flag("a thin pane: light leaves it into the exterior index")] = False
    layers: tuple[Layer, ...]

    def __init__(self, /, layers: Iterable[LayerRecord | Written] = (), **options: Any) -> None:
        super().__init__(layers=_layers(layers), **options)

    @model_validator(mode="after")
    def _layers_fit_together(self) -> Stack:
        if not self.layers:
            raise ValueError("layers: must hold at least one layer")
        for index, (above, below) in enumerate(zip(self.layers, self.layers[1:]), start=1):
            where = f"layer {index} ({entry_name(below)})"
            if above.opaque:
                raise ValueError(f"{where}: nothing may lie below layer {index - 1} ({above.kind}), which is opaque")
        if not self.layers[-1].surface:
            last = f"layer {len(self.layers) - 1} ({self.kinds[-1]})"
            raise ValueError(f"{last}: an interface or a diffuse base must lie below a {self.kinds[-1]}")
        coatings.check(self)
        if self.thin and not self.transmits:
            raise ValueError("thin: only for a stack that ends in a dielectric interface")
        return self

    # Contents -----------------------------------------------------------------------------------------------------

    def leaves(self) -> Iterator[tuple[tuple[int, ...], Stack]]:
        """The stack alone, which is in no part of a mixture."""
        yield (), self

    def each(self, change: Callable[[tuple[int, ...], Stack], Stack]) -> Stack:
        """The stack changed, as `Mix.each` changes all stacks."""
        return change((), self)

    def covering(self, name: str) -> Stack:
        """The stack, which covers all parts of an object, as `Mix.covering`."""
        return self

    def shares(self, weights: Mapping[str, Any]) -> list[Any]:
        """The share of the stack in itself, as `Mix.shares`."""
        return [1.0]

    def weighted(self, refusal: str) -> list[tuple[float, Stack]]:
        """The stack with its share in itself, as `Mix.weighted`."""
        return [(1.0, self)]

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """dielectric, conductor, mirror, medium or diffuse, for every layer."""
        return tuple(layer.kind for layer in self.layers)

    @property
    def films(self) -> tuple[int, ...]:
        """The number of thin films on every layer."""
        return tuple(len(layer.films) if isinstance(layer, Interface) else 0 for layer in self.layers)

    @property
    def phases(self) -> tuple[WrittenPhase | None, ...]:
        """The phase function of every layer, where it is not written by its asymmetry."""
        return tuple(layer.phase if isinstance(layer, Medium) else None for layer in self.layers)

    @property
    def measured(self) -> tuple[MeasuredIndex | None, ...]:
        """The index of the metal of every layer, where it was measured."""
        return tuple(layer.measured if isinstance(layer, Interface) else None for layer in self.layers)

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """The interfaces alone, from the top."""
        return tuple(layer for layer in self.layers if isinstance(layer, Interface))

    @property
    def surfaces(self) -> tuple[int, ...]:
        """Places of the interfaces, and of a diffuse base, among the layers."""
        return tuple(index for index, layer in enumerate(self.layers) if layer.surface)

    @property
    def base(self) -> Diffuse | None:
        """The diffuse base; None without one."""
        last = self.layers[-1]
        return last if isinstance(last, Diffuse) else None

    @property
    def transmits(self) -> bool:
        """Whether light passes: no layer is opaque."""
        return transmits(self.kinds)

    def with_layers(self, layers: Iterable[LayerRecord], name: str | None = None) -> Stack:
        """Other layers under the same index, by the same name unless given."""
        return Stack(layers, name=self.name if name is None else name, exterior=self.exterior, thin=self.thin)

    def turned(self, degrees: float) -> Stack | None:
        """All layers turned, anticlockwise, where they have axes; None if one is turned by a texture."""
        layers: list[Layer] = []
        for each in self.layers:
            if isinstance(each, Interface) and isinstance(each.alpha, tuple) and each.alpha[0] != each.alpha[1]:
                if not isinstance(each.rotation, int | float):
                    return None
                each = each.model_copy(update={"rotation": each.rotation + degrees})
            layers.append(each)
        return self.with_layers(layers)

    # As it is shown --------------------------------------------------------------------------------------------------

    def __str__(self) -> str:
        return cross_section.text(self)

    def _repr_html_(self) -> str:
        return cross_section.svg(self)

    # As a file holds it ----------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """The mapping that `from_dict` reads back: plain values, defaults left out."""
        return {**super().to_dict(), "layers": [{entry_name(layer): layer.to_dict()} for layer in self.layers]}

    def values(self) -> Iterator[tuple[Address, Value]]:
        """The exterior index, and every value of every layer."""
        described = [self.exterior, *(value for layer in self.layers for value in layer.flat().values())]
        return zip(flat_names.addresses(self.kinds, self.films), described)

    # As flat names ---------------------------------------------------------------------------------------------------

    def flat(self) -> dict[str, Value]:
        """`exterior` and every value of every layer under its flat name, `layer0_eta`, `layer0_alpha_u`, ...

        The number counts all layers from the top. `name`, `source` and `thin` are not among them: they are no numbers.
        """
        return {address.name: value for address, value in self.values()}

    @classmethod
    def from_flat(cls, kinds: Sequence[Kind] | None, values: Mapping[str, Any]) -> Stack:
        """The stack with the given flat values; other values take their defaults.

        Args:
            kinds: of every layer, as in `kinds`; None: read off the names (a mirror then has `layer0_conductor`).
            values: by flat name; also `layer0_alpha` for both axes, `layer0_conductor` for eta and k, and the
                keys `name`, `source`, `thin`.

        Raises:
            InvalidInput: an unknown name, or a value that a file might not hold either.
        """
        stack = cls.from_dict(flat_names.document(kinds, values))
        for index, (wanted, got) in enumerate(zip(kinds or stack.kinds, stack.kinds)):
            if wanted != got:
                raise InvalidInput(f"layer {index}: the values are those of a {got}, not of a {wanted}")
        return stack

    def replace(self, /, **values: Any) -> Stack:
        """This stack with some flat values changed: `stack.replace(layer0_alpha=0.2, layer1_sigma_a=(0.1, 0.2, 0.3))`.

        Takes the names of `flat`, `layer0_alpha` for both axes, `layer2_conductor` for another metal, and `name`,
        `source`, `thin`.

        Raises:
            InvalidInput: a name that this stack does not have, or a value outside its range.
        """
        return type(self).from_dict(flat_names.changed(self.to_dict(), self.kinds, values))


def _layers(entries: Any) -> tuple[Layer, ...]:
    if isinstance(entries, str | Mapping) or not isinstance(entries, Iterable):
        raise InvalidInput(f"layers: must be a list of layers, got {show(entries)}")
    return tuple(_layer(index, entry) for index, entry in enumerate(entries))


def _layer(index: int, entry: Any) -> Layer:
    """A layer, unchanged or from an entry of a file, `{interface: {eta: 1.5}}`."""
    if isinstance(entry, Layer):
        return entry
    if not isinstance(entry, Mapping) or not entry:
        raise InvalidInput(f"layer {index}: must be one of {', '.join(LAYERS)} with its keys, got {show(entry)}")
    if len(entry) > 1:
        keys = ", ".join(map(str, entry))
        raise InvalidInput(f"layer {index}: must hold one of {', '.join(LAYERS)} alone, got {keys}; check the indent")
    ((kind, fields),) = entry.items()
    if kind not in LAYERS:
        raise InvalidInput(f"layer {index}: {unknown('layer', kind, LAYERS)}")
    with within(f"layer {index} ({kind})"):
        return LAYERS[kind].from_dict({} if fields is None else fields)
