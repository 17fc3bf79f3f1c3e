"""The values of a material inside a Mitsuba plugin: constants, spectra, textures, and their names in `traverse`.

All layered plugins take the same properties: `material` (a file, the name of a preset, or JSON text), or flat names of
its values (`layer0_eta`, `layer0_alpha_u`, ...), each a number, a colour or spectrum, or a texture; flat names change a
material's own values.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.stack import (
    Brushing,
    Diffuse,
    Interface,
    Medium,
    Named,
    Stack,
    Texture,
    is_colour,
    load,
    loads,
    spectrum,
)
from velatura.stack import rgb as rgb_of
from velatura.stack.schema import parameters

#: What stands in the stack for a value that a plugin got as a texture object.
_STAND_IN = {"alpha_u": 0.1, "alpha_v": 0.1, "eta": 1.5, "k": 1.0}


@dataclass(frozen=True)
class Image:
    """A Mitsuba texture that stands for a value: scale * texture + offset, kept within the value's range."""

    texture: Any
    colour: bool
    channel: int | None = None
    scale: float = 1.0
    offset: float = 0.0
    low: float = -np.inf
    high: float = np.inf

    def at(self, mi: Any, si: Any, active: Any) -> Any:
        """The value at a surface point: a colour or spectrum, or a number."""
        import drjit as dr

        if self.colour:
            value = self.texture.eval(si, active)
        elif self.channel is None:
            value = self.texture.eval_1(si, active)
        else:
            value = self.texture.eval_3(si, active)[self.channel]
        return dr.clip(value * self.scale + self.offset, self.low, self.high)


@dataclass(frozen=True)
class Field:
    """Directions away from a centre of the texture coordinates, or around it, as degrees from dp/du."""

    brushing: Brushing

    def at(self, mi: Any, si: Any, active: Any) -> Any:
        """The angle at a surface point; 0 more than the offset where the surface has no texture coordinates."""
        import drjit as dr

        field = self.brushing
        away = si.to_local(si.dp_du * (si.uv.x - field.u) + si.dp_dv * (si.uv.y - field.v))
        across = 90.0 if field.brushing == "concentric" else 0.0
        return dr.rad2deg(dr.atan2(away.y, away.x)) + (across + field.offset)


class Binding:
    """The values of one plugin.

    Args:
        mi: Mitsuba, with a variant set.
        properties: of the plugin; all names are read but those in `options`.

    Attributes:
        stack: the material as described; textures given as objects have a number standing in.
        constants: Dr.Jit values by flat name.
        images: textures, spectra and fields by flat name.

    Raises:
        InvalidInput: in one line, whatever a material file would be refused for, and unknown names.
    """

    def __init__(self, mi: Any, properties: Any, options: Collection[str] = ()) -> None:
        self.mi = mi
        given = {name: properties[name] for name in list(properties.keys()) if name not in options}
        objects: dict[str, Any] = {}
        for name, value in given.items():
            if isinstance(value, mi.Object):
                axes = ("_u", "_v") if name.endswith("_alpha") else ("",)
                objects.update({name + axis: value for axis in axes})
        numbers = {k: _plain(v) for k, v in given.items() if not isinstance(v, mi.Object) and k != "material"}
        stand_ins = {name: _STAND_IN.get(name.partition("_")[2], 0.5) for name in objects}
        if "material" in given:
            self.stack = _described(str(given["material"])).replace(**numbers, **stand_ins)
        else:
            self.stack = Stack.from_flat(None, {**numbers, **stand_ins})
        self.constants: dict[str, Any] = {}
        self.images: dict[str, Image | Field] = {}
        for name, value in self.stack.flat().items():
            self._bind(name, objects.get(name, value))

    @property
    def uniform(self) -> bool:
        """Whether no value changes from point to point, or with the wavelengths of a ray."""
        return not self.images

    def at(self, si: Any, active: Any) -> dict[str, Any]:
        """All values at a surface point by flat name."""
        found = {name: image.at(self.mi, si, active) for name, image in self.images.items()}
        return {**self.values(), **found}

    def values(self) -> dict[str, Any]:
        """The constants by flat name, colours as colours."""
        spectrum_type = self.mi.UnpolarizedSpectrum
        return {
            name: spectrum_type(value) if is_colour(name) or name == "exterior" else value
            for name, value in self.constants.items()
        }

    def traverse(self, callback: Any) -> None:
        """Offer every value under its flat name."""
        for name, value in self.constants.items():
            callback.put(name, value, self._flags(name))
        for name, image in self.images.items():
            if isinstance(image, Image):
                callback.put(name, image.texture, self._flags(name))

    def _flags(self, name: str) -> Any:
        flags = self.mi.ParamFlags
        return flags.NonDifferentiable if name == "exterior" else flags.Differentiable

    # How a value of the stack becomes one of Mitsuba's

    def _bind(self, name: str, value: Any) -> None:
        key, mi = _key(name), self.mi
        colour = is_colour(name)
        if isinstance(value, mi.Object):
            self.images[name] = Image(value, colour, None, **_range(key))
        elif isinstance(value, Texture):
            self.images[name] = self._image(name, value)
        elif isinstance(value, Brushing):
            self.images[name] = Field(value)
        elif colour and mi.is_spectral and not isinstance(value, float):
            self.images[name] = self._spectrum(value)
        else:
            value = rgb_of(value) if isinstance(value, Named) else value
            self.constants[name] = mi.Color3f(*value) if isinstance(value, tuple) else mi.Float(value)

    def _image(self, name: str, image: Texture) -> Image:
        key = _key(name)
        raw = image.encoding == "linear"
        try:
            texture = self.mi.load_dict({"type": "bitmap", "filename": str(image.texture), "raw": raw})
        except RuntimeError:
            raise InvalidInput(f"{name}: the texture {image.texture} is no image that Mitsuba can read") from None
        colour = is_colour(name) and image.channel in (None, "rgb")
        channels = self.mi.traverse(texture)["data"].shape[-1]
        channel = None if colour or channels == 1 else "rgba".index(image.channel or "r")
        return Image(texture, colour, channel, image.scale, image.offset, **_range(key))

    def _spectrum(self, value: Any) -> Image:
        if isinstance(value, Named):
            nm, values = spectrum(value)
            pairs = list(zip(nm.tolist(), values.tolist()))
            return Image(self.mi.load_dict({"type": "spectrum", "value": pairs}), True)
        peak = 2 * max(*value, 1e-6)  # Mitsuba finds smooth spectra for colours up to 1
        scaled = [channel / peak for channel in value]
        return Image(self.mi.load_dict({"type": "rgb", "value": scaled}), True, scale=peak)


def _described(material: str) -> Stack:
    return loads(material, "material.json") if material.lstrip().startswith("{") else load(material)


def _key(name: str) -> str:
    return name.partition("_")[2] if name.startswith("layer") else name


def _plain(value: Any) -> Any:
    """A property as a material file would hold it."""
    if isinstance(value, bool | int | float | str):
        return value
    try:
        return tuple(float(x) for x in value)
    except TypeError:
        raise InvalidInput(f"expected a number, a colour or a texture, got {type(value).__name__}") from None


def _range(key: str) -> dict[str, float]:
    """Range of a value, a little inside where its ends are excluded."""
    declared = {k: p for model in (Interface, Medium, Diffuse) for k, p in parameters(model).items()}
    parameter: Any = declared["alpha" if key.startswith("alpha") else key]
    margin = 1e-3 if parameter.strict else 0.0
    return {"low": parameter.low + margin, "high": parameter.high - margin}
