"""Numbers of a material that are being differentiated, and the steps over which differences are taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from velatura.sampling import differences
from velatura.stack import Address, Material

RELATIVES = {"alpha_u": 0.04, "alpha_v": 0.04, "rotation": 0.0}  # steps over a value
RELATIVE = 0.02
STEPS = {"alpha_u": 0.004, "alpha_v": 0.004, "rotation": 1.0}  # least steps; rotations are in degrees
STEP = 0.005


@dataclass(frozen=True)
class Variables:
    """Those of a material, each with the values, and their channel, that it stands for."""

    given: list[differences.Variable]
    addresses: list[Address]

    @classmethod
    def of(cls, material: Material) -> Variables:
        """Those among a renderer's values."""
        addresses, values = zip(*material.values())
        return cls(differences.variables(values), list(addresses))

    def around(self, k: int, x: float) -> tuple[float, float]:
        """Numbers a step below and above that of the k-th variable, x, within the range."""
        address = self.addresses[self.given[k].places[0][0]]
        low, high = address.declared.within
        step = max(RELATIVES.get(address.key, RELATIVE) * abs(x), STEPS.get(address.key, STEP))
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
