"""A renderer's constants as numbers; those that are being differentiated, and steps over which to take differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from velatura import kernel
from velatura.ops import Value
from velatura.renderer import finite_differences
from velatura.stack import Address, Material

# Steps over a value; those of films are small to phases
RELATIVES = {"alpha_u": 0.06, "alpha_v": 0.06, "rotation": 0.0, "film_thickness_nm": 0.0, "film_eta": 0.004}
RELATIVE = 0.02
STEPS = {
    "alpha_u": 0.004,
    "alpha_v": 0.004,
    "rotation": 1.0,
    "film_thickness_nm": 3.0,
}  # least; rotations are in degrees
STEP = 0.005


@dataclass(frozen=True)
class Variables:
    """Differentiated numbers of a material, each with the values, and their channel, that it stands for."""

    given: list[finite_differences.DifferentiatedNumber]
    addresses: list[Address]

    @classmethod
    def of(cls, material: Material) -> Variables:
        """The numbers that are differentiated among a renderer's values."""
        addresses, values = zip(*material.values())
        return cls(finite_differences.variables(values), list(addresses))

    def around(self, k: int, x: float) -> tuple[float, float]:
        """Numbers a step below and above that of the k-th variable, x, within the range."""
        address = self.addresses[self.given[k].places[0][0]]
        low, high = address.declared.within
        step = max(RELATIVES.get(address.role, RELATIVE) * abs(x), STEPS.get(address.role, STEP))
        return max(x - step, low), min(x + step, high)

    def replaced(self, material: Material, numbers: Sequence[float]) -> Material:
        """The material of NumPy's values, floats or colours (C, 1), with these numbers of the variables."""
        changed: dict[str, dict[int, float]] = {}
        for variable, x in zip(self.given, numbers):
            for k, channel in variable.places:
                changed.setdefault(self.addresses[k].name, {})[channel] = x

        def value(address: Address, old: Any) -> Any:
            new = changed.get(address.name)
            if new is None:
                return old
            if not address.colour:
                return new[0]
            colour = np.array(old, float)
            for channel, x in new.items():
                colour[channel] = x
            return colour

        return material.each(value)


def plain(material: Material) -> Material:
    """A material of a renderer's constants with values of NumPy: floats, and colours (C, 1)."""

    def value(found: Value, colour: bool) -> Any:
        channels = np.ravel(found).tolist() if isinstance(found, float | np.ndarray) else kernel.numbers(found)
        return np.array(channels, float)[:, None] if colour else float(channels[0])

    numbers = material.each(lambda address, found: value(found, address.colour)).coated([None] * len(material.layers))
    return numbers if isinstance(material.light, str) else replace(numbers, light=np.ravel(np.array(material.light)))
