"""Values of a plugin by flat name: constants, which are kept within their ranges, textures, spectra and fields."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura import kernel
from velatura.binding import properties as properties_of
from velatura.binding.textures import Range
from velatura.errors import InvalidInput, OutOfRange
from velatura.stack import Address


class Values:
    """Values by flat name, as Mitsuba has them.

    Args:
        mi: Mitsuba, with a variant set.
        values: as described, or objects of Mitsuba.
        prefix: of the names in messages: the part of a mixture that they are in.

    Attributes:
        addresses: of all values by flat name.
        derived: names of values that follow from others.
        parameters: Dr.Jit values by flat name, as they were given or last changed.
        constants: the same, within the ranges of their parameters.
        images: textures, spectra and fields by flat name.
        ranges: what these give, by flat name; None where that is known on a shape only.
    """

    def __init__(self, mi: Any, values: Mapping[Address, Any], prefix: str = "") -> None:
        self.mi, self.prefix = mi, prefix
        self.addresses = {address.name: address for address in values}
        self.derived: set[str] = set()
        self.parameters, self.images = properties_of.bound(mi, values, prefix)
        self.constants: dict[str, Any] = {}
        self.ranges: dict[str, Range | None] = {}
        self.clamped: set[str] = set()

    @property
    def varies(self) -> bool:
        """Whether any value changes from point to point."""
        return any(image.varies for image in self.images.values())

    def value(self, name: str, si: Any, active: Any) -> Any:
        """The value of a flat name at a surface point."""
        return self.images[name].at(si, active) if name in self.images else self.constants[name]

    # After any has changed

    def update(self) -> None:
        """Update constants and ranges.

        Raises:
            InvalidInput: a number or a texel is not finite.
        """
        import drjit as dr

        ranges: dict[int, Range | None] = {}  # one for values that share an image
        for name, image in self.images.items():
            if id(image) not in ranges:
                ranges[id(image)] = image.range(self.mi, self.prefix + name)
            self.ranges[name] = ranges[id(image)]
        within = {name: self._within_range(name, value) for name, value in self.parameters.items()}
        self.constants = {name: self._shared(value) for name, value in within.items()}
        dr.make_opaque(self.constants)  # a changed value needs no new kernel

    def _within_range(self, name: str, value: Any) -> Any:
        """The value itself, or the nearest one that is allowed, with one warning.

        Gradients pass all the same, or an optimiser that has overshot would not come back.

        Raises:
            InvalidInput: it is not finite, so that none is near.
        """
        import drjit as dr

        declared, channels = self.addresses[name].declared, kernel.numbers(value)
        try:
            for channel in channels:
                declared.check(channel)
        except ValueError as error:
            refusal = f"{self.prefix}{name}: {error}"
            if not np.isfinite(channels).all():
                raise InvalidInput(refusal) from None
            if name not in self.clamped:
                self.clamped.add(name)
                warnings.warn(f"{refusal}; the nearest value that is allowed stands for it", OutOfRange, stacklevel=2)
            return dr.replace_grad(dr.clip(value, *declared.within), value)
        return value

    def _shared(self, value: Any) -> Any:
        """A colour as one number where that holds all of it, so that a grey material costs what a number does."""
        import drjit as dr

        if not isinstance(value, self.mi.Color3f):
            return value
        own = [channel.index_ad for channel in value] if dr.grad_enabled(value) else kernel.numbers(value)
        return value.x if len(set(own)) == 1 else value
