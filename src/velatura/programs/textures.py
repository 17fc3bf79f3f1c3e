"""Materials with textures: the means, which are fitted, and the images that a program takes in place of a number."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from velatura.programs.parameters import RGB, Values
from velatura.programs.program import Carried, Program
from velatura.programs.values import Array, texels
from velatura.stack import Address, Brushing, Described, Stack, Texture, Varying

Means: TypeAlias = dict[str, "float | RGB"]


def means(material: Described) -> Means:
    """Means of all textures by flat name, and the offset of fields of directions; none of a material without.

    Raises:
        InvalidInput: an image that cannot be read. MissingTool: LLVM is missing or too old.
    """
    varying = [(address, value) for address, value in material.values() if isinstance(value, Varying)]
    return {address.name: _mean(address, value) for address, value in varying}


def _mean(address: Address, value: Varying) -> float | RGB:
    if isinstance(value, Brushing):
        return value.offset
    assert isinstance(value, Texture)
    mean = within(address, value).mean(axis=(0, 1))
    if len(mean) == 1:
        return float(mean[0])
    r, g, b = (float(x) for x in mean)
    return r, g, b


def within(address: Address, image: Texture) -> Array:
    """Texels (height, width, 1 or 3) of an image, within the range of the value that it stands for.

    Raises:
        InvalidInput: it cannot be read. MissingTool: LLVM is missing or too old.
    """
    colour = address.colour and image.channel in (None, "rgb")
    return np.clip(texels(image, colour, address.name), *address.declared.within)


def carried(stack: Described, found: Means, program: Program, values: Values) -> Iterator[tuple[str, Carried | str]]:
    """Each varying value: its parameter and the image, or its flat name and what stands for it."""
    flat = stack.flat()
    for address, value in stack.values():
        again = address.key == "alpha_v" and flat[address.name[:-1] + "u"] == value
        if not isinstance(value, Varying) or again:
            continue
        taken = None
        if isinstance(stack, Stack) and isinstance(value, Texture):
            taken = _taken(stack, address, value, found, program, values)
        stands = (
            "the field is replaced by its offset"
            if isinstance(value, Brushing)
            else "the image is replaced by its mean"
        )
        yield taken or (address.name.removesuffix("_u") if address.key == "alpha_u" else address.name, stands)


def _taken(
    stack: Stack, address: Address, image: Texture, found: Means, program: Program, values: Values
) -> tuple[str, Carried] | None:
    """The parameter of the program that is one to one with a value, and the image for it."""
    if image.offset or image.curve or image.scale <= 0:
        return None
    mean = np.maximum(found[address.name], 1e-6)
    if stack.base and address.key == "albedo" and program.colour and values[program.metal] < 0.5:  # type: ignore[operator]
        factor = np.broadcast_to(image.scale * np.asarray(values[program.colour]) / mean, 3)
        plain = image.encoding == "srgb" and image.texture.suffix.lower() in program.images and factor.max() <= 1.001
        if program.images and not plain:
            return None
        r, g, b = (float(f"{x:.6g}") for x in factor)
        return program.colour, Carried(image, (r, g, b))
    flat = stack.flat()
    isotropic = address.key == "alpha_u" and flat[address.name[:-1] + "v"] == image
    if program.roughness and len(stack.interfaces) == 1 and isotropic:
        root = float(np.sqrt(image.scale / mean) * values[program.roughness])
        return program.roughness, Carried(image, float(f"{root:.6g}"), root=True)
    return None
