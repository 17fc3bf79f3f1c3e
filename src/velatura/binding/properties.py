"""The properties of a plugin: the material that they describe, and its values as Mitsuba has them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from velatura.binding import textures
from velatura.binding.textures import BrushedField, Image
from velatura.errors import InvalidInput
from velatura.stack import Address, Brushing, Described, Measured, Texture, addressed, load, loads
from velatura.stack.io import Loaded, foreign
from velatura.stack.mix import from_flat

#: The value in the material in place of a texture object of a plugin, if its parameter declares no typical one.
_STAND_IN = 0.5


def described(mi: Any, properties: Any, options: Collection[str]) -> tuple[Described, dict[Address, Any]]:
    """The material that properties describe, all but `options`; and its values, with objects of Mitsuba among them, for
    which numbers stand in the material.

    Raises:
        InvalidInput: anything that a material file would be refused for, and unknown names.
    """
    given = {name: value_of(mi, properties, name) for name in list(properties.keys()) if name not in options}
    objects: dict[str, Any] = {}
    stand_ins: dict[str, float] = {}
    for name, value in given.items():
        if isinstance(value, mi.Object):
            found = addressed(name)
            if not all(address.declared.texturable for address in found):
                raise InvalidInput(f"{name}: must be a number, which is the same everywhere and for all wavelengths")
            objects.update({address.name: value for address in found})
            stand_ins.update({address.name: _stand_in(address) for address in found})
            if not found:
                stand_ins[name] = _STAND_IN  # to be refused as any unknown name
    numbers = {k: v for k, v in given.items() if not isinstance(v, mi.Object) and k != "material"} | stand_ins
    named = "material" in given
    material = _named(mi, str(given["material"])).replace(**numbers) if named else from_flat(numbers)
    return material, {address: objects.get(address.name, value) for address, value in material.values()}


def _stand_in(address: Address) -> float:
    typical = address.declared.typical
    return _STAND_IN if typical is None else typical


def bound(
    mi: Any, values: Mapping[Address, Any], prefix: str = ""
) -> tuple[dict[str, Any], dict[str, Image | BrushedField]]:
    """Values as those of Mitsuba, by flat name: numbers and colours; textures, spectra and fields.

    In messages names begin with the prefix.
    """
    numbers: dict[str, Any] = {}
    images: dict[str, Image | BrushedField] = {}
    for address, value in values.items():
        name = address.name
        first = next(at for at in values if at.layer == address.layer and at.declared is address.declared)
        if first != address and first.name in images and value == values[first]:
            images[name] = images[first.name]  # so that the interface stays isotropic
        elif isinstance(value, mi.Object):
            images[name] = textures.of_object(mi, address, value, prefix + name)
        elif isinstance(value, Texture):
            images[name] = textures.of_file(mi, address, value, prefix + name)
        elif isinstance(value, Brushing):
            images[name] = BrushedField(value)
        elif address.colour and mi.is_spectral and not isinstance(value, float):
            images[name] = textures.of_spectrum(mi, address, value)
        else:
            value = address.declared.reduced(value) if isinstance(value, Measured) else value
            if isinstance(value, tuple) and mi.is_monochromatic:
                numbers[name] = mi.luminance(mi.Color3f(value))
            else:
                # Three channels even if grey, so that a colour can be optimised from there
                numbers[name] = mi.Color3f(value) if address.colour and mi.is_rgb else mi.Float(value)
    return numbers, images


def value_of(mi: Any, properties: Any, name: str) -> Any:
    """A property as in a material file; textures, and spectra in spectral variants, unchanged."""
    value = properties[name]
    if isinstance(value, bool | int | float | str):
        return value
    if properties.type(name).name == "Spectrum":
        # As Mitsuba's own plugins read a reflectance
        bounded = any(address.colour and address.declared.high <= 1 for address in addressed(name))
        value = properties.get_texture(name) if bounded else properties.get_unbounded_texture(name)
    if isinstance(value, mi.Object):
        if value.class_name() not in (textures.NUMBERS if mi.is_spectral else textures.SPECTRA):
            return value
        value = textures.evaluated(mi, name, value, colour=True)
    try:
        channels = np.ravel(np.array(value, float)).tolist()
    except (RuntimeError, TypeError, ValueError):
        allowed = "a number, a colour, a spectrum or a texture"
        raise InvalidInput(f"{name}: must be {allowed}, got {type(value).__name__}") from None
    return channels[0] if len(set(channels)) == 1 else tuple(channels)


def _named(mi: Any, material: str) -> Loaded:
    """The material named in a scene; files are resolved like those of Mitsuba's own plugins, beside the scene."""

    def find(path: str) -> str:
        return str(mi.file_resolver().resolve(path))

    if material.lstrip().startswith("{"):
        return loads(material, "material.json", find=find)
    file = foreign(material)
    if file:
        return load(find(file) + material[len(file) :])
    return load(find(material) if Path(material).suffix else material)
