"""The struct of a material in a shader, and its contents: numbers and textures."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from velatura.shader.printers.printer import Field, Struct
from velatura.shader.recorder.symbol import Operand, operand
from velatura.stack import Address, Brushing, Described, Stack, Texture, Varying
from velatura.stack import number as plain
from velatura.stack.flat_names import prefix
from velatura.stack.mix import WEIGHT

PARAMETERS = "vt_parameters"  # in the code: the values that change


class Mapped(NamedTuple):
    """A texel times a scale plus an offset, kept within bounds: its channel r, g, b or a, or the colour rgb."""

    sampler: str
    channel: str
    scale: float
    offset: float
    low: float
    high: float


class Brushed(NamedTuple):
    """Degrees of the direction away from a centre, plus an offset."""

    u: float
    v: float
    offset: float


class Entry(NamedTuple):
    """A value of a material, by its place in the struct: a constant, or a value at texture coordinates."""

    place: str
    value: Operand | Mapped | Brushed
    wide: bool  # a colour


class Filled(NamedTuple):
    """The contents of a material: entries, over the uniform where it has `parameters`; and textures by sampler."""

    entries: Sequence[Entry]
    samplers: Mapping[str, Texture]
    parameters: bool


def title(stack: Described) -> str:
    """The name of a material; that it is one, without a name."""
    return stack.name.strip() or "A material"


def identifier(stack: Described) -> str:
    """The name of a material in lower-case letters, digits and underscores."""
    return re.sub(r"\W+", "_", stack.name.lower(), flags=re.ASCII).strip("_") or "material"


def place(address: Address) -> str:
    """Where a value lies in the struct: `layer0.eta` for `layer0_eta`, `part0_part1.layer0.eta` of a mixture, whose
    weights lie in the struct itself."""
    if address.declared is WEIGHT:
        return address.name
    own = address.key if address.layer is None else f"layer{address.layer}.{address.key}"
    return f"{member(address.parts)}.{own}" if address.parts else own


def member(parts: Sequence[int]) -> str:
    """The member of the structs that holds what belongs to a stack of a mixture."""
    return prefix(parts).rstrip("_")


def constant(address: Address, value: Any) -> Any:
    """A value of a material as a float, or as an array of three channels where they differ."""
    channels = np.ravel(plain(address, value))
    return float(channels[0]) if np.all(channels == channels[0]) else channels


def structs(stack: Stack, read: Sequence[str]) -> list[Struct]:
    """`VtMaterial`, which holds the values that are read, by flat name, and a struct for each layer that has any.

    Colours come first, so that a block of these structs has the same layout by the rules of HLSL as by std140.
    """
    layers, members = [], [Field("exterior", "number")]
    for i, kind in enumerate(stack.kinds):
        own = [address for address, _ in stack.values() if address.layer == i and address.name in read]
        if own:
            in_order = sorted(own, key=lambda address: not address.colour)
            fields = [Field(address.key, "colour" if address.colour else "number") for address in in_order]
            layers.append(Struct(f"VtLayer{i}", fields, kind))
            members.append(Field(f"layer{i}", f"VtLayer{i}"))
    return [*layers, Struct("VtMaterial", members, "indices are absolute, rotations in degrees")]


def filled(stack: Described, read: Collection[str], parameters: bool) -> Filled:
    """The contents of the struct: values that are read; with `parameters`, plain ones are those of a uniform."""
    images = _images(stack, read)
    entries = [
        Entry(place(address), _value(address, value, images), address.colour)
        for address, value in stack.values()
        if (address.key == "exterior" or address.name in read) and (isinstance(value, Varying) or not parameters)
    ]
    return Filled(entries, {sampler: image for image, sampler in images.items()}, parameters)


def _images(stack: Described, read: Collection[str]) -> dict[Texture, str]:
    """The samplers of the textures, named after the first value that reads each."""
    images: dict[Texture, str] = {}
    for name, value in stack.flat().items():
        if name in read and isinstance(value, Texture):
            images.setdefault(value, f"vt_map_{name}")
    return images


def brushed(value: Brushing) -> Brushed:
    """The angle of a way of brushing; concentric lines lie across the direction away from the centre."""
    return Brushed(value.u, value.v, (90.0 if value.brushing == "concentric" else 0.0) + value.offset)


def _value(address: Address, value: Any, images: Mapping[Texture, str]) -> Operand | Mapped | Brushed:
    if isinstance(value, Brushing):
        return brushed(value)
    if not isinstance(value, Varying):
        return operand(constant(address, value))
    assert isinstance(value, Texture)
    colour = address.colour and value.channel in (None, "rgb")
    channel = "rgb" if colour else (value.channel or "r")
    return Mapped(images[value], channel, value.scale, value.offset, *address.declared.within)
