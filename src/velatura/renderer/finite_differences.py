"""Functions of NumPy inside a renderer's graph of derivatives: their gradients are differences.

A function is called twice more for every number whose gradient is asked for: at the ends of a step around it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from velatura.ops import Value
from velatura.renderer.packets import aligned

Array = NDArray[np.floating]
Around = Callable[[int, float], tuple[float, float]]


@dataclass(frozen=True)
class DifferentiatedNumber:
    """A number that is being differentiated, and the values, with the channel, that it stands for."""

    number: Any
    places: list[tuple[int, int]]


def variables(values: Sequence[Value]) -> list[DifferentiatedNumber]:
    """Variables among values of Dr.Jit; one for all places that are the same variable."""
    if all(isinstance(value, (float, np.ndarray)) for value in values):
        return []
    import drjit as dr

    found: dict[int, DifferentiatedNumber] = {}
    for k, value in enumerate(values):
        if not dr.is_array_v(value) or not dr.grad_enabled(value):
            continue
        for channel, number in enumerate(value if dr.depth_v(value) > 1 else [value]):
            found.setdefault(number.index_ad, DifferentiatedNumber(number, [])).places.append((k, channel))
    found.pop(0, None)  # channels without gradients
    return list(found.values())


def differentiable(
    function: Callable[[list[float]], list[Array]], given: Sequence[DifferentiatedNumber], around: Around, number: Any
) -> list[Any]:
    """Flat arrays that a function returns for the numbers of variables, of Dr.Jit's type `number`; differentiable.
    Without variables they are NumPy's.

    `around` gives numbers below and above the k-th one, between which the function is taken to be linear.
    """
    if number is None or not given:
        return list(function([]))
    import drjit as dr

    def floats(values: Sequence[Any]) -> list[float]:
        return [float(np.array(dr.detach(value)).ravel()[0]) for value in values]

    class Differences(dr.CustomOp):
        def eval(self, numbers: list[Any]) -> list[Any]:
            self.numbers = floats(numbers)
            return [number(aligned(flat)) for flat in function(self.numbers)]

        def slopes(self) -> Iterator[list[Array]]:
            """Slopes of all that the function returns, by variable."""
            for k, x in enumerate(self.numbers):
                low, high = around(k, x)
                below, above = (function([*self.numbers[:k], end, *self.numbers[k + 1 :]]) for end in (low, high))
                yield [(b - a) / (high - low) for a, b in zip(below, above)]

        def backward(self) -> None:
            wanted = [np.array(dr.detach(x), float) for x in cast(list[Any], self.grad_out())]
            sums = [sum(float(np.dot(a, b)) for a, b in zip(slopes, wanted)) for slopes in self.slopes()]
            self.set_grad_in("numbers", [number(x) for x in sums])

        def forward(self) -> None:
            gradients = floats(cast(list[Any], self.grad_in("numbers")))
            parts = zip(*([x * slope for slope in slopes] for x, slopes in zip(gradients, self.slopes())))
            self.set_grad_out([number(np.float32(sum(part))) for part in parts])

        def name(self) -> str:
            return "differences"

    return list(dr.custom(Differences, [variable.number for variable in given]))


def numbers(flat: Any, number: Any) -> list[Any]:
    """The numbers of a flat array, each by itself; of Dr.Jit's type `number`, or floats for None."""
    if isinstance(flat, np.ndarray):
        return flat.tolist() if number is None else [number(x) for x in flat.tolist()]
    import drjit as dr

    return [dr.gather(number, flat, k) for k in range(dr.width(flat))]
