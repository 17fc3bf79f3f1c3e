"""Functions of NumPy inside a renderer's graph of derivatives: their gradients are differences.

A function is called twice more for every number whose gradient is asked for, at its value plus and minus a step, or one
step inside where that would leave the range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.stack import Address, Material

Array = NDArray[np.floating]

RELATIVE = 0.02  # step over a value
STEPS = {"alpha_u": 0.004, "alpha_v": 0.004, "rotation": 1.0}  # least steps; rotations are in degrees
STEP = 0.005


@dataclass
class Variable:
    """A number that is being differentiated, and the values of a material, with the channel, that it stands for."""

    number: Any
    places: list[tuple[Address, int]]

    def around(self, x: float) -> tuple[float, float]:
        """Numbers below and above x, within the range."""
        address = self.places[0][0]
        low, high = address.declared.within
        relative = 0.0 if address.key == "rotation" else RELATIVE * abs(x)
        step = max(relative, STEPS.get(address.key, STEP))
        return max(x - step, low), min(x + step, high)


def variables(material: Material) -> list[Variable]:
    """What is being differentiated in a material of Dr.Jit's values; one for all values that are the same variable."""
    import drjit as dr

    found: dict[int, Variable] = {}
    for address, value in material.values():
        if not dr.is_array_v(value) or not dr.grad_enabled(value):
            continue
        for channel, number in enumerate(value if dr.depth_v(value) > 1 else [value]):
            found.setdefault(number.index_ad, Variable(number, [])).places.append((address, channel))
    found.pop(0, None)  # channels without gradients
    return list(found.values())


def replaced(material: Material, given: Sequence[Variable], numbers: Sequence[float]) -> Material:
    """A material of NumPy's values, floats or colours (3, 1), with these in place of variables."""
    changed: dict[str, dict[int, float]] = {}
    for variable, x in zip(given, numbers):
        for address, channel in variable.places:
            changed.setdefault(address.name, {})[channel] = x

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


def differentiable(function: Callable[[list[float]], list[Array]], given: Sequence[Variable], number: Any) -> list[Any]:
    """Flat arrays that a function returns for the numbers of variables, of Dr.Jit's type `number`; differentiable. None
    keeps NumPy's."""
    if number is None:
        return function([])
    import drjit as dr

    def floats(values: Sequence[Any]) -> list[float]:
        return [float(np.array(dr.detach(value)).ravel()[0]) for value in values]

    class Differences(dr.CustomOp):
        def eval(self, numbers: list[Any]) -> list[Any]:
            self.numbers = floats(numbers)
            return [number(np.float32(column)) for column in function(self.numbers)]

        def slopes(self) -> Iterator[list[Array]]:
            """By variable, of all that the function returns."""
            for k, x in enumerate(self.numbers):
                low, high = given[k].around(x)
                below, above = (function([*self.numbers[:k], end, *self.numbers[k + 1 :]]) for end in (low, high))
                yield [(b - a) / (high - low) for a, b in zip(below, above)]

        def backward(self) -> None:
            outcome: Any = self.grad_out()
            wanted = [np.array(dr.detach(x), float) for x in outcome]
            sums = [sum(float(np.dot(a, b)) for a, b in zip(slopes, wanted)) for slopes in self.slopes()]
            self.set_grad_in("numbers", [number(x) for x in sums])

        def forward(self) -> None:
            given_gradients: Any = self.grad_in("numbers")
            gradients = floats(given_gradients)
            parts = zip(*([x * slope for slope in slopes] for x, slopes in zip(gradients, self.slopes())))
            self.set_grad_out([number(np.float32(sum(part))) for part in parts])

        def name(self) -> str:
            return "differences"

    numbers = [variable.number for variable in given]
    if not numbers:
        return [number(np.float32(column)) for column in function([])]
    return list(dr.custom(Differences, numbers))
