"""The values of a material inside a Mitsuba plugin: constants, spectra, textures, and their names in `traverse`.

All layered plugins take the same properties: `material` (a file, the name of a preset, or JSON text), or flat names of
its values (`layer0_eta`, `layer0_alpha_u`, ...), each a number, a colour or spectrum, or a texture; flat names change a
material's own values.
"""

from __future__ import annotations

import functools
import operator
import textwrap
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel
from velatura.errors import InvalidInput
from velatura.films import textured as textured_films
from velatura.stack import (
    Address,
    Brushing,
    Material,
    Measured,
    Stack,
    Texture,
    addressed,
    load,
    loads,
    spectrum,
    srgb_weights,
)
from velatura.stack.io import foreign
from velatura.stack.spectra import VISIBLE_NM

#: Wavelengths (nm) that stand for all light where all colours share one number, as one refracted direction: each for a
#: quarter of the mean of the three curves that make sRGB of a spectrum under D65.
STEERING_NM = (445.0, 525.0, 585.0, 620.0)

#: Textures of Mitsuba that are the same everywhere, and those of them that are numbers in spectral variants, too. All
#: others are taken to vary, even if they report otherwise (as `mesh_attribute` does), and may query a shape, which is
#: not known while a plugin is made.
_NUMBERS = ("UniformSpectrum", "RawConstantTexture")
_SPECTRA = (
    *_NUMBERS,
    "SRGBReflectanceSpectrum",
    "RegularSpectrum",
    "IrregularSpectrum",
    "D65Spectrum",
    "BlackBodySpectrum",
)

_TEXELS = ("data", "value")  # of textures, in `traverse`
MOVED = 1e-3  # by which texels that are being differentiated may move, at least

#: The value in the stack in place of a texture object of a plugin, if its parameter declares no typical one.
_STAND_IN = 0.5


@dataclass(frozen=True)
class Image:
    """A Mitsuba texture in place of a value: scale * texture + offset, kept within the range of the value."""

    texture: Any
    colour: bool
    scale: float = 1.0
    offset: float = 0.0
    low: float = -np.inf
    high: float = np.inf

    @property
    def varies(self) -> bool:
        """Whether the value may change from point to point."""
        return self.texture.class_name() not in _SPECTRA

    def at(self, si: Any, active: Any) -> Any:
        """The value at a surface point: a colour or spectrum, or a number."""
        import drjit as dr

        value = self.texture.eval(si, active) if self.colour else self.texture.eval_1(si, active)
        return dr.clip(value * self.scale + self.offset, self.low, self.high)

    def __str__(self) -> str:
        scaled = f"{self.scale:g} * {self.texture}" if self.scale != 1 else str(self.texture)
        return f"{scaled} + {self.offset:g}" if self.offset else scaled


@dataclass(frozen=True)
class Field:
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

    def __str__(self) -> str:
        turned = f", turned by {self.brushing.offset:g}" if self.brushing.offset else ""
        return f"{self.brushing.brushing} about ({self.brushing.u:g}, {self.brushing.v:g}){turned}"


def plugin_class(mi: Any) -> type:
    """The base class of all layered plugins in the current variant, with the queries of their values.

    Theirs is a `binding`, `facts` by name, which `to_string` begins with, and `eval_pdf`.
    """

    class MaterialBSDF(mi.BSDF):
        binding: Binding
        facts: dict[str, str]

        def has_components(self, components: Sequence[Any]) -> None:
            """Declare the flags of each component."""
            self.m_components = list(components)
            self.m_flags = functools.reduce(operator.or_, self.m_components)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def traverse(self, callback: Any) -> None:
            self.binding.traverse(callback)

        def has_attribute(self, name: str, active: Any = True) -> Any:
            return self.binding.has(name)

        def eval_attribute(self, name: str, si: Any, active: Any = True) -> Any:
            return self.binding.attribute(name, si, active) if self.binding.has(name) else mi.UnpolarizedSpectrum(0)

        def eval_attribute_1(self, name: str, si: Any, active: Any = True) -> Any:
            return self.binding.attribute_1(name, si, active) if self.binding.has(name) else mi.Float(0)

        def eval_attribute_3(self, name: str, si: Any, active: Any = True) -> Any:
            return self.binding.attribute_3(name, si, active) if self.binding.has(name) else mi.Color3f(0)

        def to_string(self) -> str:
            values = {**self.facts, **self.binding.described()}
            listed = ",\n".join(f"{name} = {text}" for name, text in values.items())
            return f"{type(self).__name__}[\n{textwrap.indent(listed, '  ')}\n]"

    return MaterialBSDF


class Binding:
    """The values of one plugin.

    Args:
        mi: Mitsuba, with a variant set.
        properties: of the plugin; all names are read but those in `options`.

    Attributes:
        stack: the material as described; textures given as objects have a number standing in.
        addresses: of all values by flat name.
        parameters: Dr.Jit values by flat name, as they were given or last changed.
        constants: the same, within the ranges of their parameters.
        images: textures, spectra and fields by flat name.
        steering: colours of those that are the same everywhere, at `STEERING_NM`; in spectral variants.

    Raises:
        InvalidInput: in one line, for anything that a material file would be refused for, and for unknown names.
    """

    def __init__(self, mi: Any, properties: Any, options: Collection[str] = ()) -> None:
        self.mi = mi
        given = {name: self._given(properties, name) for name in list(properties.keys()) if name not in options}
        objects: dict[str, Any] = {}
        stand_ins: dict[str, float] = {}
        for name, value in given.items():
            if isinstance(value, mi.Object):
                found = addressed(name)
                if not all(address.declared.texturable for address in found):
                    raise InvalidInput(
                        f"{name}: must be a number, which is the same everywhere and for all wavelengths"
                    )
                objects.update({address.name: value for address in found})
                stand_ins.update({address.name: address.declared.typical or _STAND_IN for address in found})
                if not found:
                    stand_ins[name] = _STAND_IN  # to be refused as any unknown name
        numbers = {k: v for k, v in given.items() if not isinstance(v, mi.Object) and k != "material"}
        if "material" in given:
            self.stack = _described(mi, str(given["material"])).replace(**numbers, **stand_ins)
        else:
            self.stack = Stack.from_flat(None, {**numbers, **stand_ins})
        self.parameters: dict[str, Any] = {}
        self.constants: dict[str, Any] = {}
        self.images: dict[str, Image | Field] = {}
        values = {address: objects.get(address.name, value) for address, value in self.stack.values()}
        self.addresses = {address.name: address for address in values}
        for address, value in values.items():
            first = next(at for at in values if at.layer == address.layer and at.declared is address.declared)
            if first != address and first.name in self.images and value == values[first]:
                self.images[address.name] = self.images[first.name]  # so that the interface stays isotropic
            else:
                self._bind(address, value)
        self.steering: dict[str, Any] = {}
        self.clamped: set[str] = set()
        self.coatings: Sequence[Any] = ()
        self.update()

    @property
    def uniform(self) -> bool:
        """Whether no value changes from point to point, or with the wavelengths of a ray."""
        return not self.images and not self.interferes

    @property
    def varies(self) -> bool:
        """Whether any value changes from point to point."""
        return any(image.varies for image in self.images.values())

    def update(self) -> None:
        """Update constants and steering values, after any value has changed.

        Raises:
            InvalidInput: a number or a texel is not finite.
        """
        import drjit as dr

        for name, image in self.images.items():
            if isinstance(image, Image) and not all(np.isfinite(texels).all() for _, texels in self._read(image)):
                raise InvalidInput(f"{name}: has texels that are not finite")
        within = {name: self._within_range(name, value) for name, value in self.parameters.items()}
        self.constants = {name: self._shared(value) for name, value in within.items()}
        dr.make_opaque(self.constants)  # a changed value needs no new kernel
        self.coatings = self._coatings()
        if self.mi.is_spectral:
            si = self._at_fixed_wavelengths(dr.zeros(self.mi.SurfaceInteraction3f))
            flat = [name for name, image in self.images.items() if image.colour and not image.varies]
            self.steering = {name: self.images[name].at(si, True) for name in flat}
            dr.make_opaque(self.steering)

    def _within_range(self, name: str, value: Any) -> Any:
        """The value itself, or the nearest one that is allowed, with one warning.

        Gradients pass all the same, or an optimiser that has overshot would not come back.

        Raises:
            InvalidInput: it is not finite, so that none is near.
        """
        import drjit as dr

        declared, channels = self.addresses[name].declared, _channels(value)
        try:
            for channel in channels:
                declared.check(channel)
        except ValueError as error:
            if not np.isfinite(channels).all():
                raise InvalidInput(f"{name}: {error}") from None
            if name not in self.clamped:
                self.clamped.add(name)
                warnings.warn(f"{name}: {error}; the nearest value that is allowed stands for it", stacklevel=2)
            return dr.replace_grad(dr.clip(value, *declared.within), value)
        return value

    def _shared(self, value: Any) -> Any:
        """A colour as one number where that holds all of it, so that a grey material costs what a number does."""
        import drjit as dr

        if not isinstance(value, self.mi.Color3f):
            return value
        apart = len({channel.index_ad for channel in value}) if dr.grad_enabled(value) else len(set(_channels(value)))
        return value.x if apart == 1 else value

    def _coatings(self) -> Sequence[Any]:
        """The films on each layer, worked out."""
        import drjit as dr

        mi = self.mi
        if not any(self.stack.films) or mi.is_spectral:
            return ()
        spans = []
        for address in (self.addresses[name] for name in self.images):
            if address.role in textured_films.UNKNOWN:
                texels = self._texels(address, textured_films.UNKNOWN)
                spans.append(textured_films.Span(address, float(texels.min()), float(texels.max())))
        number = mi.Float if dr.is_jit_v(mi.Float) else None
        some = {**dict.fromkeys(self.images, 0.0), **self._colours()}
        return textured_films.constant_films(Material.from_flat(self.stack, some, self._light), spans, number)

    @property
    def interferes(self) -> bool:
        """Whether films change what is reflected from wavelength to wavelength of a ray."""
        return self.mi.is_spectral and any(self.stack.films)

    @property
    def _light(self) -> Any:
        """What the channels of constants are of."""
        if self.mi.is_spectral:
            return self.mi.UnpolarizedSpectrum(*STEERING_NM)
        return "luminance" if self.mi.is_monochromatic else "srgb"

    def material(self, values: Mapping[str, Any], wavelengths_nm: Any = None) -> Material:
        """The material with these values by flat name; at the fixed wavelengths in spectral variants, unless given."""
        light = self._light if wavelengths_nm is None else wavelengths_nm
        return Material.from_flat(self.stack, values, light).coated(self.coatings)

    def at(self, si: Any, active: Any) -> Material:
        """The material at a surface point."""
        return self.material(self._at(si, active), self._of_ray(si))

    def steered(self, si: Any, active: Any) -> Material:
        """As `at`, but spectra are at fixed wavelengths and then at those of the ray, as `velatura.ops` has them.

        So the shape of a lobe does not depend on which wavelengths a ray carries.
        """
        values = self._at(si, active)
        if not self.mi.is_spectral:
            return self.material(values)
        fixed = self._at_fixed_wavelengths(si)
        spectra = {name: image for name, image in self.images.items() if image.colour}
        for name, image in spectra.items():
            steering = self.steering[name] if name in self.steering else image.at(fixed, active)
            values[name] = self.mi.ArrayXf([*steering, *values[name]])
        return self.material({**values, **self.constants}, self.mi.ArrayXf([*STEERING_NM, *si.wavelengths]))

    def _of_ray(self, si: Any) -> Any:
        return self.mi.UnpolarizedSpectrum(si.wavelengths) if self.mi.is_spectral else None

    def uniform_material(self) -> Material:
        """The material of values that are the same everywhere; spectra are at fixed wavelengths."""
        return self.material({**self._colours(), **self.steering})

    def tabulated(
        self, unknown: Mapping[str, tuple[float, float]]
    ) -> tuple[Material, list[tuple[list[Address], float, float]]]:
        """The material with some value of every texture; and for each texture that is not the same everywhere, or is
        being differentiated, the values that it gives, and the least and the greatest of them. `unknown` are those, by
        key, of what is only known on a shape.
        """
        given: dict[int, list[Address]] = {}
        for name, image in self.images.items():
            if name not in self.steering:
                given.setdefault(id(image), []).append(self.addresses[name])
        values, found = {**self._colours(), **self.steering}, []
        for addresses in given.values():
            texels = self._texels(addresses[0], unknown)
            if (texels != texels[:, :1]).any():
                found.append((addresses, float(texels.min()), float(texels.max())))
            first = texels[:, 0].tolist()
            for address in addresses:
                values[address.name] = self.mi.UnpolarizedSpectrum(first) if address.colour else self.mi.Float(first[0])
        return self.material(values), found

    def _texels(self, address: Address, unknown: Mapping[str, tuple[float, float]]) -> Any:
        """Values that a texture gives, (channels, ...): its texels, or the ends of what is `unknown`, as of meshes."""
        import drjit as dr

        mi, image = self.mi, self.images[address.name]
        if isinstance(image, Field):
            return np.array([[-180.0, 180.0]])
        channels = len(mi.UnpolarizedSpectrum()) if image.colour else 1
        if mi.is_spectral and image.colour:
            return np.tile([unknown.get(address.role, address.declared.within)], (channels, 1))
        found = []
        for value, texels in self._read(image):
            if isinstance(value, mi.TensorXf):
                texels = texels.reshape(-1, texels.shape[-1]).T
            # One number for all colours lies between them
            texels = texels[:channels] if 1 < channels <= len(texels) else texels.reshape(1, -1)
            moved = [texels * (1 + MOVED) + MOVED] if dr.grad_enabled(value) else []
            found += [np.broadcast_to(each, (channels, each.shape[-1])) for each in (texels, *moved)]
        if not found:
            return np.tile([unknown.get(address.role, address.declared.within)], (channels, 1))
        texels = np.concatenate(found, axis=1)
        return np.clip(texels * image.scale + image.offset, image.low, image.high)

    def _read(self, image: Image) -> Iterator[tuple[Any, Any]]:
        """Values of a texture in `traverse`, as they are and as numbers (rows, ...)."""
        import drjit as dr

        for name, value in self.mi.traverse(image.texture):
            if name.split(".")[-1] in _TEXELS:
                yield value, np.atleast_2d(np.array(dr.detach(value), float))

    def at_wavelengths(self, nm: Sequence[float], material: Material | None = None) -> Material:
        """The material of values that are the same everywhere, or another one, with spectra in channels at these
        wavelengths, as many as a multiple of those of a ray."""
        import drjit as dr

        carried = len(self.mi.UnpolarizedSpectrum())
        spectra: dict[str, list[Any]] = {name: [] for name in self.steering}
        for k in range(0, len(nm), carried):
            si = dr.zeros(self.mi.SurfaceInteraction3f)
            si.wavelengths = type(si.wavelengths)(*nm[k : k + carried])
            dr.make_opaque(si)
            for name, channels in spectra.items():
                channels.extend(self.images[name].at(si, True))
        flat = material.flat() if material else {}
        at_nm = {name: self.mi.ArrayXf(x) for name, x in spectra.items()}
        return self.material({**flat, **self.constants, **at_nm}, self.mi.ArrayXf(list(nm)))

    def looked_at(self) -> Material:
        """The material with its numeric constants as plain numbers, and its images unchanged."""
        import drjit as dr

        def plain(value: Any) -> Any:
            return value if isinstance(value, float) or dr.size_v(value) > 1 else float(value[0])

        return self.material({**{name: plain(value) for name, value in self.constants.items()}, **self.images})

    def symbolic(self, looked_at: Material) -> Material:
        """The same, with differentiated values unchanged, so that none equals another value, or another variable."""
        import drjit as dr

        apart = {name: value for name, value in self.constants.items() if dr.grad_enabled(value)}
        # One variable for several values, such as both axes of an interface, is one
        numbers = {value.index_ad: value for value in apart.values() if dr.depth_v(value) == 1}
        apart = {name: numbers[value.index_ad] if dr.depth_v(value) == 1 else value for name, value in apart.items()}
        return looked_at.each(lambda address, value: apart.get(address.name, value))

    def _at(self, si: Any, active: Any) -> dict[str, Any]:
        # One image for several values, such as both axes of an interface, is looked up once
        found = {id(image): image.at(si, active) for image in {id(x): x for x in self.images.values()}.values()}
        return {**self._colours(), **{name: found[id(image)] for name, image in self.images.items()}}

    def _at_fixed_wavelengths(self, si: Any) -> Any:
        fixed = self.mi.SurfaceInteraction3f(si)
        fixed.wavelengths = type(si.wavelengths)(*STEERING_NM)
        return fixed

    def _colours(self) -> dict[str, Any]:
        """The constants by flat name, colours as colours, and the exterior index, which is one to the model."""
        spectrum_type = self.mi.UnpolarizedSpectrum
        wide = {name for name, address in self.addresses.items() if address.colour or address.layer is None}
        return {name: spectrum_type(value) if name in wide else value for name, value in self.constants.items()}

    def traverse(self, callback: Any) -> None:
        """Offer every value under its flat name."""
        for name, value in self.parameters.items():
            callback.put(name, value, self._flags(name))
        for name, image in self.images.items():
            if isinstance(image, Image):
                callback.put(name, image.texture, self._flags(name))

    def _flags(self, name: str) -> Any:
        flags = self.mi.ParamFlags
        return flags.Differentiable if self.addresses[name].declared.differentiable else flags.NonDifferentiable

    # Queries of the values of a plugin

    def has(self, name: str) -> bool:
        """Whether the material has a value of that flat name."""
        return name in self.constants or name in self.images

    def attribute(self, name: str, si: Any, active: Any) -> Any:
        """A value at a surface point as a spectrum (a colour, or one number in monochromatic variants)."""
        return self.mi.UnpolarizedSpectrum(self._one(name, si, active))

    def attribute_1(self, name: str, si: Any, active: Any) -> Any:
        """A value at a surface point as one number: of a colour or spectrum, its luminance."""
        if self.addresses[name].colour:
            return self.mi.luminance(self.attribute_3(name, si, active))
        return self.mi.Float(self._one(name, si, active))

    def attribute_3(self, name: str, si: Any, active: Any) -> Any:
        """A value at a surface point as linear sRGB, under D65 where it is a spectrum."""
        mi, image = self.mi, self.images.get(name)
        if not (mi.is_spectral and image and image.colour):
            value = self._one(name, si, active)
            return mi.Color3f(value[0] if mi.is_monochromatic and self.addresses[name].colour and image else value)
        # Sum over wavelengths, as many at once as a ray carries
        nm, weights = srgb_weights()
        carried, rgb = len(mi.UnpolarizedSpectrum()), mi.Color3f(0)
        at = mi.SurfaceInteraction3f(si)
        for k in range(0, len(nm), carried):
            nodes = [min(k + i, len(nm) - 1) for i in range(carried)]
            at.wavelengths = type(si.wavelengths)([float(nm[node]) for node in nodes])
            value = image.at(at, active)
            for i, node in enumerate(range(k, min(k + carried, len(nm)))):
                rgb += mi.Color3f(*(float(w) for w in weights[:, node])) * value[i]
        return rgb

    def _one(self, name: str, si: Any, active: Any) -> Any:
        return self.images[name].at(si, active) if name in self.images else self.constants[name]

    def described(self) -> dict[str, str]:
        """All values by flat name as text: numbers, and the text of textures and spectra."""
        texts = {name: _text(value) for name, value in self.constants.items()}
        return texts | {name: str(image) for name, image in self.images.items()}

    # How a property becomes a value of the stack, and that one of Mitsuba's

    def _given(self, properties: Any, name: str) -> Any:
        """A property as in a material file; textures, and spectra in spectral variants, unchanged."""
        mi, value = self.mi, properties[name]
        if isinstance(value, bool | int | float | str):
            return value
        if properties.type(name).name == "Spectrum":
            # As Mitsuba's own plugins read a reflectance
            bounded = any(address.colour and address.declared.high <= 1 for address in addressed(name))
            value = properties.get_texture(name) if bounded else properties.get_unbounded_texture(name)
        if isinstance(value, mi.Object):
            if value.class_name() not in (_NUMBERS if mi.is_spectral else _SPECTRA):
                return value
            value = self._tried(name, value, colour=True)
        try:
            channels = np.ravel(np.array(value, float)).tolist()
        except (RuntimeError, TypeError, ValueError):
            allowed = "a number, a colour, a spectrum or a texture"
            raise InvalidInput(f"{name}: must be {allowed}, got {type(value).__name__}") from None
        return channels[0] if len(set(channels)) == 1 else tuple(channels)

    def _tried(self, name: str, texture: Any, colour: bool) -> Any:
        """The value of a texture that does not query a shape.

        Raises:
            InvalidInput: it has none in this variant.
        """
        import drjit as dr

        try:
            return (texture.eval if colour else texture.eval_1)(dr.zeros(self.mi.SurfaceInteraction3f))
        except (AttributeError, RuntimeError, TypeError):
            needs = f"needs a texture of {'colours' if colour else 'numbers'} in the variant {self.mi.variant()}"
            mend = "; write it as a spectrum" if colour and texture.class_name() in _SPECTRA else ""
            raise InvalidInput(f"{name}: {needs}{mend}") from None

    def _bind(self, address: Address, value: Any) -> None:
        mi, name = self.mi, address.name
        if isinstance(value, mi.Object):
            self.images[name] = self._object(address, value)
        elif isinstance(value, Texture):
            self.images[name] = self._image(address, value)
        elif isinstance(value, Brushing):
            self.images[name] = Field(value)
        elif address.colour and mi.is_spectral and not isinstance(value, float):
            self.images[name] = self._spectrum(address, value)
        else:
            value = address.declared.reduced(value) if isinstance(value, Measured) else value
            if isinstance(value, tuple) and mi.is_monochromatic:
                self.parameters[name] = mi.luminance(mi.Color3f(value))
            else:
                # Three channels even if grey, so that a colour can be optimised from there
                self.parameters[name] = mi.Color3f(value) if address.colour and mi.is_rgb else mi.Float(value)

    def _object(self, address: Address, texture: Any) -> Image:
        colour, kind = address.colour, texture.class_name()
        if kind in _SPECTRA or kind.startswith("BitmapTexture") or not isinstance(texture, self.mi.Texture):
            self._tried(address.name, texture, colour)
        return Image(texture, colour, **_range(address))

    def _image(self, address: Address, image: Texture) -> Image:
        colour = address.colour and image.channel in (None, "rgb")
        decoded, scale = texels(self.mi, address.name, image, colour), image.scale
        upsampled = self.mi.is_spectral and decoded.shape[-1] == 3
        if upsampled:
            peak = max(float(decoded.max()), 1.0)
            decoded, scale = np.clip(decoded / peak, 0, 1), scale * peak
        texture = {"type": "bitmap", "bitmap": self.mi.Bitmap(decoded), "raw": not upsampled}
        return Image(self.mi.load_dict(texture), colour, scale, image.offset, **_range(address))

    def _spectrum(self, address: Address, value: Any) -> Image:
        limits = _range(address)
        if isinstance(value, Measured):
            measured_nm, values = spectrum(value)
            begin, end = VISIBLE_NM
            inside = measured_nm[(measured_nm > begin) & (measured_nm < end)]
            nm = np.array([begin, *inside, end])  # beyond a table Mitsuba takes it to be 0
            pairs = list(zip(nm.tolist(), np.interp(nm, measured_nm, values).tolist()))
            return Image(self.mi.load_dict({"type": "spectrum", "value": pairs}), True, **limits)
        # Mitsuba finds spectra for colours up to 1, and smooth ones for those well below
        peak = 1.0 if limits["high"] <= 1 else 2 * max(*value, 1e-6)
        scaled = [channel / peak for channel in value]
        return Image(self.mi.load_dict({"type": "rgb", "value": scaled}), True, peak, **limits)


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


def _channels(value: Any) -> list[float]:
    import drjit as dr

    channels: list[float] = np.ravel(np.array(dr.detach(value), float)).tolist()
    return channels


def _text(value: Any) -> str:
    """A constant as text: a number, a colour, or several of either."""
    numbers = [f"{number:g}" for number in np.array(value, float).ravel()]
    return numbers[0] if len(numbers) == 1 else f"[{', '.join(numbers)}]"


def _described(mi: Any, material: str) -> Stack:
    """The stack named in a scene; files are resolved like those of Mitsuba's own plugins, beside the scene."""

    def find(path: str) -> str:
        return str(mi.file_resolver().resolve(path))

    if material.lstrip().startswith("{"):
        return loads(material, "material.json", find=find)
    file = foreign(material)
    if file:
        return load(find(file) + material[len(file) :])
    return load(find(material) if Path(material).suffix else material)


def _range(address: Address) -> dict[str, float]:
    low, high = address.declared.within
    return {"low": low, "high": high}
