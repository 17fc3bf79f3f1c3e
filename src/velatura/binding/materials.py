"""A stack of a plugin: with values at a point, with uniform ones, or with ranges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from velatura import kernel
from velatura.binding.textures import Range
from velatura.binding.values import Values
from velatura.films.textured import UNKNOWN, Span, constant_films
from velatura.stack import Address, Material, MeasuredIndex, Stack

#: Wavelengths (nm) that stand for all light where all colours share one number, as one refracted direction: each for a
#: quarter of the mean of the three curves that make sRGB of a spectrum under D65.
STEERING_NM = (445.0, 525.0, 585.0, 620.0)


class Binding(Values):
    """The values of one stack.

    Args:
        mi: Mitsuba, with a variant set.
        stack: as described; textures given as objects have a number standing in.
        values: those of the stack, and objects of Mitsuba in their place.
        prefix: of the names in messages.

    Attributes:
        derived: names of values that follow from others: the asymmetry of a phase function that is written.
        metals: of every layer, the index over wavelength that its eta and k are colours of; None where they are not.
        steering: colours of those that are the same everywhere, at `STEERING_NM`; in spectral variants.

    Raises:
        InvalidInput: in one line, for anything that a material file would be refused for.
    """

    def __init__(self, mi: Any, stack: Stack, values: Mapping[Address, Any], prefix: str = "") -> None:
        super().__init__(mi, values, prefix)
        self.stack = stack
        phases = stack.phases
        self.derived = {at.name for at in values if at.key == "g" and at.layer is not None and phases[at.layer]}
        self.steering: dict[str, Any] = {}
        self.coatings: Sequence[Any] = ()
        self.metals: Sequence[MeasuredIndex | None] = ()
        self._measured = self._of_measured_metals()
        self.update()

    @property
    def uniform(self) -> bool:
        """Whether no value changes from point to point, or with the wavelengths of a ray."""
        return not self.images and not self.interferes

    @property
    def interferes(self) -> bool:
        """Whether films change what is reflected from wavelength to wavelength of a ray."""
        return self.mi.is_spectral and any(self.stack.films)

    def _of_measured_metals(self) -> dict[int, tuple[MeasuredIndex, dict[str, list[float]]]]:
        """The metals that were measured, by layer, with their colours by flat name; none where these are spectra."""
        found = {}
        for k, index in enumerate(self.stack.measured):
            names = [f"layer{k}_{part}" for part in ("eta", "k")]
            if index and self.parameters.keys() >= set(names):
                found[k] = index, {name: kernel.numbers(self.parameters[name]) for name in names}
        return found

    # Values, after any has changed

    def update(self) -> None:
        """Update constants, ranges and steering values.

        Raises:
            InvalidInput: a number or a texel is not finite.
        """
        import drjit as dr

        super().update()
        self.coatings, self.metals = self._coatings(), self._metals()
        if self.mi.is_spectral:
            si = self._interaction_at_fixed_wavelengths(dr.zeros(self.mi.SurfaceInteraction3f))
            flat = [name for name, image in self.images.items() if image.colour and not image.varies]
            self.steering = {name: self.images[name].at(si, True) for name in flat}
            dr.make_opaque(self.steering)

    def _coatings(self) -> Sequence[Any]:
        """The films on each layer, worked out."""
        import drjit as dr

        mi, spans = self.mi, []
        if not any(self.stack.films) or mi.is_spectral:
            return ()
        for address in (self.addresses[name] for name in self.images):
            if address.role in UNKNOWN:
                found = self._range(address, UNKNOWN)
                spans.append(Span(address, found.low, found.high))
        number = mi.Float if dr.is_jit_v(mi.Float) else None
        some = {**dict.fromkeys(self.images, 0.0), **self._colours()}
        return constant_films(Material.from_flat(self.stack, some, self._light), spans, number, mi.is_polarized)

    def _metals(self) -> Sequence[MeasuredIndex | None]:
        """The measured index of each layer, while its colours are as they were at first, and not differentiated."""
        import drjit as dr

        found: list[MeasuredIndex | None] = [None] * len(self.stack.layers)
        for k, (index, first) in self._measured.items():
            now = {name: self.parameters[name] for name in first}
            changed = any(dr.grad_enabled(value) or kernel.numbers(value) != first[name] for name, value in now.items())
            found[k] = None if changed else index
        return found

    def _range(self, address: Address, unknown: Mapping[str, tuple[float, float]]) -> Range:
        """The range of a texture, or that of its role where it is `unknown`, as of meshes."""
        channels = len(self.mi.UnpolarizedSpectrum()) if self.images[address.name].colour else 1
        ends = unknown.get(address.role, address.declared.within)
        return self.ranges[address.name] or Range.between(*ends, channels)

    @property
    def _light(self) -> Any:
        """The light that the channels of constants are of."""
        if self.mi.is_spectral:
            return self.mi.UnpolarizedSpectrum(*STEERING_NM)
        return "luminance" if self.mi.is_monochromatic else "srgb"

    def _colours(self) -> dict[str, Any]:
        """The constants by flat name, colours as colours, and the exterior index, which is one to the model."""
        spectrum_type = self.mi.UnpolarizedSpectrum
        wide = {name for name, address in self.addresses.items() if address.colour or address.layer is None}
        return {name: spectrum_type(value) if name in wide else value for name, value in self.constants.items()}

    # The material

    def material(self, values: Mapping[str, Any], wavelengths_nm: Any = None) -> Material:
        """The material with these values by flat name; at the fixed wavelengths in spectral variants, unless given."""
        light = self._light if wavelengths_nm is None else wavelengths_nm
        return Material.from_flat(self.stack, values, light).coated(self.coatings).of_metals(self.metals)

    def at(self, si: Any, active: Any) -> Material:
        """The material at a surface point."""
        nm = self.mi.UnpolarizedSpectrum(si.wavelengths) if self.mi.is_spectral else None
        return self.material(self._at(si, active), nm)

    def at_fixed_wavelengths(self, si: Any, active: Any) -> Material:
        """The material at a surface point, spectra at fixed wavelengths and then at those of the ray (`velatura.ops`).

        So the shape of a lobe does not depend on which wavelengths a ray carries.
        """
        values = self._at(si, active)
        if not self.mi.is_spectral:
            return self.material(values)
        fixed = self._interaction_at_fixed_wavelengths(si)
        spectra = {name: image for name, image in self.images.items() if image.colour}
        for name, image in spectra.items():
            steering = self.steering[name] if name in self.steering else image.at(fixed, active)
            values[name] = self.mi.ArrayXf([*steering, *values[name]])
        return self.material({**values, **self.constants}, self.mi.ArrayXf([*STEERING_NM, *si.wavelengths]))

    def _at(self, si: Any, active: Any) -> dict[str, Any]:
        # One image for several values, such as both axes of an interface, is looked up once
        found = {id(image): image.at(si, active) for image in {id(x): x for x in self.images.values()}.values()}
        return {**self._colours(), **{name: found[id(image)] for name, image in self.images.items()}}

    def _interaction_at_fixed_wavelengths(self, si: Any) -> Any:
        fixed = self.mi.SurfaceInteraction3f(si)
        fixed.wavelengths = type(si.wavelengths)(*STEERING_NM)
        return fixed

    def uniform_material(self) -> Material:
        """The material of values that are the same everywhere; spectra are at fixed wavelengths."""
        return self.material({**self._colours(), **self.steering})

    def with_ranges(
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
            range_ = self._range(addresses[0], unknown)
            if range_.differs:
                found.append((addresses, range_.low, range_.high))
            for address in addresses:
                first = range_.first
                values[address.name] = self.mi.UnpolarizedSpectrum(first) if address.colour else self.mi.Float(first[0])
        return self.material(values), found

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

    def with_constants(self) -> Material:
        """The material with its numeric constants as plain numbers, and its images unchanged."""
        import drjit as dr

        def plain(value: Any) -> Any:
            return value if isinstance(value, float) or dr.size_v(value) > 1 else float(value[0])

        return self.material({**{name: plain(value) for name, value in self.constants.items()}, **self.images})

    def with_gradients_opaque(self) -> Material:
        """The same, with differentiated values unchanged, so that none equals another value, or another variable."""
        import drjit as dr

        apart = {name: value for name, value in self.constants.items() if dr.grad_enabled(value)}
        # One variable for several values, such as both axes of an interface, is one
        numbers = {value.index_ad: value for value in apart.values() if dr.depth_v(value) == 1}
        apart = {name: numbers[value.index_ad] if dr.depth_v(value) == 1 else value for name, value in apart.items()}
        return self.with_constants().each(lambda address, value: apart.get(address.name, value))
