"""Values of a material that are textures or spectra of Mitsuba, and the range of what these give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from velatura import kernel
from velatura.errors import InvalidInput
from velatura.stack import Address, Brushing, Measured, Texture, spectrum
from velatura.stack.spectra import VISIBLE_NM

#: Textures of Mitsuba that are the same everywhere, and those of them that are numbers in spectral variants, too. All
#: others are taken to vary, even if they report otherwise (as `mesh_attribute` does), and may query a shape, which is
#: not known while a plugin is made.
NUMBERS = ("UniformSpectrum", "RawConstantTexture")
SPECTRA = (
    *NUMBERS,
    "SRGBReflectanceSpectrum",
    "RegularSpectrum",
    "IrregularSpectrum",
    "D65Spectrum",
    "BlackBodySpectrum",
)

_TEXELS = ("data", "value")  # of textures, in `traverse`
MOVED = 1e-3  # by which texels that are being differentiated may move, at least


@dataclass(frozen=True)
class Range:
    """The first, the least and the greatest value that a texture gives, the first by channel; whether any differ."""

    first: list[float]
    low: float
    high: float
    differs: bool

    @classmethod
    def between(cls, low: float, high: float, channels: int) -> Range:
        """Any values between two, of which the first is the least."""
        return cls([low] * channels, low, high, low != high)


@dataclass(frozen=True)
class Image:
    """A Mitsuba texture in place of a value: scale * texture + offset, kept within the range of the value."""

    texture: Any
    colour: bool
    scale: float = 1.0
    offset: float = 0.0
    low: float = -np.inf
    high: float = np.inf

    @classmethod
    def of(cls, address: Address, texture: Any, colour: bool, scale: float = 1.0, offset: float = 0.0) -> Image:
        """A texture in place of the value at an address."""
        return cls(texture, colour, scale, offset, *address.declared.within)

    @property
    def varies(self) -> bool:
        """Whether the value may change from point to point."""
        return self.texture.class_name() not in SPECTRA

    def at(self, si: Any, active: Any) -> Any:
        """The value at a surface point: a colour or spectrum, or a number.

        Gradients pass at the ends of the range and beyond, as those of constants.
        """
        import drjit as dr

        value = self.texture.eval(si, active) if self.colour else self.texture.eval_1(si, active)
        value = value * self.scale + self.offset
        within = dr.clip(value, self.low, self.high)
        return dr.replace_grad(within, value) if dr.grad_enabled(value) else within

    def range(self, mi: Any, name: str) -> Range | None:
        """The range of its texels; None where it has none, or they stand for spectra.

        Raises:
            InvalidInput: texels of the value of that name are not finite.
        """
        import drjit as dr

        channels, found = len(mi.UnpolarizedSpectrum()) if self.colour else 1, []
        for key, value in mi.traverse(self.texture):
            if key.split(".")[-1] not in _TEXELS:
                continue
            texels = np.atleast_2d(np.array(dr.detach(value), float))
            if not np.isfinite(texels).all():
                raise InvalidInput(f"{name}: has texels that are not finite")
            if mi.is_spectral and self.colour:
                continue
            if isinstance(value, mi.TensorXf):
                texels = texels.reshape(-1, texels.shape[-1]).T
            # One number for all colours lies between them
            texels = texels[:channels] if 1 < channels <= len(texels) else texels.reshape(1, -1)
            moved = [texels * (1 + MOVED) + MOVED] if dr.grad_enabled(value) else []
            found += [np.broadcast_to(each, (channels, each.shape[-1])) for each in (texels, *moved)]
        if not found:
            return None
        values = np.clip(np.concatenate(found, axis=1) * self.scale + self.offset, self.low, self.high)
        differs = bool((values != values[:, :1]).any())
        return Range(values[:, 0].tolist(), float(values.min()), float(values.max()), differs)

    def __str__(self) -> str:
        scaled = f"{self.scale:g} * {self.texture}" if self.scale != 1 else str(self.texture)
        return f"{scaled} + {self.offset:g}" if self.offset else scaled


@dataclass(frozen=True)
class BrushedField:
    """Directions away from a centre of the texture coordinates, or around it, as degrees from dp/du."""

    brushing: Brushing
    colour: bool = False
    varies: bool = True

    def at(self, si: Any, active: Any) -> Any:
        """The angle at a surface point; 0 more than the offset where the surface has no texture coordinates."""
        import drjit as dr

        field = self.brushing
        away = si.to_local(si.dp_du * (si.uv.x - field.u) + si.dp_dv * (si.uv.y - field.v))
        across = 90.0 if field.brushing == "concentric" else 0.0
        return dr.rad2deg(dr.atan2(away.y, away.x)) + (across + field.offset)

    def range(self, mi: Any, name: str) -> Range:
        """All angles."""
        return Range.between(-180.0, 180.0, 1)

    def __str__(self) -> str:
        turned = f", turned by {self.brushing.offset:g}" if self.brushing.offset else ""
        return f"{self.brushing.brushing} about ({self.brushing.u:g}, {self.brushing.v:g}){turned}"


def of_object(mi: Any, address: Address, texture: Any, name: str) -> Image:
    """A texture that a scene gives to a plugin in place of a value, of that flat name."""
    kind = texture.class_name()
    if kind in SPECTRA or kind.startswith("BitmapTexture") or not isinstance(texture, mi.Texture):
        evaluated(mi, name, texture, address.colour)
    return Image.of(address, texture, address.colour)


def of_file(mi: Any, address: Address, image: Texture, name: str) -> Image:
    """A texture of a material file, in place of the value of that flat name."""
    colour = address.colour and image.channel in (None, "rgb")
    decoded, scale = texels(mi, name, image, colour), image.scale
    upsampled = mi.is_spectral and decoded.shape[-1] == 3
    if upsampled:
        peak = max(float(decoded.max()), 1.0)
        decoded, scale = np.clip(decoded / peak, 0, 1), scale * peak
    texture = mi.load_dict({"type": "bitmap", "bitmap": mi.Bitmap(decoded), "raw": not upsampled})
    return Image.of(address, texture, colour, scale, image.offset)


def of_spectrum(mi: Any, address: Address, value: Any) -> Image:
    """A measured spectrum, or one that has a colour."""
    if isinstance(value, Measured):
        measured_nm, values = spectrum(value)
        begin, end = VISIBLE_NM
        inside = measured_nm[(measured_nm > begin) & (measured_nm < end)]
        nm = np.array([begin, *inside, end])  # beyond a table Mitsuba takes it to be 0
        pairs = list(zip(nm.tolist(), np.interp(nm, measured_nm, values).tolist()))
        return Image.of(address, mi.load_dict({"type": "spectrum", "value": pairs}), True)
    # Mitsuba finds spectra for colours up to 1, and smooth ones for those well below
    peak = 1.0 if address.declared.within[1] <= 1 else 2 * max(*value, 1e-6)
    scaled = [channel / peak for channel in value]
    return Image.of(address, mi.load_dict({"type": "rgb", "value": scaled}), True, peak)


def evaluated(mi: Any, name: str, texture: Any, colour: bool) -> Any:
    """The value of a texture that does not query a shape.

    Raises:
        InvalidInput: it has none in this variant.
    """
    import drjit as dr

    try:
        return (texture.eval if colour else texture.eval_1)(dr.zeros(mi.SurfaceInteraction3f))
    except (AttributeError, RuntimeError, TypeError):
        needs = f"needs a texture of {'colours' if colour else 'numbers'} in the variant {mi.variant()}"
        mend = "; write it as a spectrum" if colour and texture.class_name() in SPECTRA else ""
        raise InvalidInput(f"{name}: {needs}{mend}") from None


def texels(mi: Any, name: str, image: Texture, colour: bool) -> Any:
    """Linear texels of an image, shape (height, width, 3), or 1 for numbers and grey."""
    read = kernel.bitmap(image.texture, f"{name}: the texture {image.texture}")
    try:
        read.set_srgb_gamma(image.encoding == "srgb")
        texels = np.array(read.convert(component_format=mi.Struct.Type.Float32, srgb_gamma=False))
    except (RuntimeError, MemoryError):
        raise InvalidInput(f"{name}: the texture {image.texture} is no image that Mitsuba can read") from None
    if not np.isfinite(texels).all():
        raise InvalidInput(f"{name}: the texture {image.texture} has texels that are not finite")
    # Separate colours from opacity, which comes last
    texels = texels.reshape(*texels.shape[:2], -1)
    channels = {1: "r", 2: "ra", 3: "rgb", 4: "rgba"}.get(texels.shape[-1], "")
    grey = "g" not in channels
    wanted = ("r" if grey else "rgb") if colour else (image.channel or "r")
    wanted = "r" if grey and wanted in "rgb" else wanted
    if not channels or not set(wanted) <= set(channels):
        raise InvalidInput(f"{name}: the texture {image.texture} has no channel {wanted}, only {channels or 'others'}")
    texels = texels[..., [channels.index(c) for c in wanted]]
    if image.curve:
        texels = np.interp(texels, np.linspace(0, 1, len(image.curve)), image.curve).astype(texels.dtype)
    return np.ascontiguousarray(texels)
