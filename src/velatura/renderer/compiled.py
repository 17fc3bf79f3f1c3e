"""Functions of every source and every sample: by NumPy, and compiled by Dr.Jit in a process that asks for many.

A function is written on `velatura.ops`. NumPy begins at once; Dr.Jit takes a tenth of a second for each kind of
function, and then a third of NumPy's time. So kernels follow once `MANY` values have been worked out without them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.ops import Value

Array = NDArray[Any]
Groups = Sequence[Sequence[Value]]

#: Of sources, samples and numbers: groups of values, and values that are summed up over the samples
Function = Callable[[Sequence[Value], Sequence[Value], Sequence[Value]], tuple[Groups, Sequence[Value]]]

MANY = 4_000_000  # values, about a second's
BLOCK = 1 << 15  # values at a time, which a processor's cache holds
COMPILED_BLOCK = 1 << 18

_asked = 0  # values so far


def over(
    function: Function,
    sources: Sequence[Array],
    samples: Sequence[Array],
    numbers: Sequence[float],
    compilable: bool = True,
) -> tuple[list[Array], Array]:
    """Values of a function of each source (S,) and each sample (N,): of each group of K values (S, N, K), and sums over
    the samples (L, S). One that is not `compilable` reads other arrays of NumPy."""
    global _asked
    module = kernel.llvm() if compilable and len(sources[0]) and _asked > MANY else None
    count = len(samples[0])
    size = max((COMPILED_BLOCK if module else BLOCK) // count, 1)
    found = []
    for first in range(0, max(len(sources[0]), 1), size):
        some = [x[first : first + size] for x in sources]
        if module is None:
            found.append(_plain(function, some, samples, numbers))
            _asked += len(some[0]) * count
        else:
            found.append(_compiled(module, function, some, samples, numbers))
    groups, sums = zip(*found)
    if len(found) == 1:
        return groups[0], sums[0]
    return [np.concatenate(each) for each in zip(*groups)], np.concatenate(sums, axis=-1)


def _plain(
    function: Function, sources: Sequence[Array], samples: Sequence[Array], numbers: Sequence[float]
) -> tuple[list[Array], Array]:
    groups, sums = function([x[:, None] for x in sources], samples, numbers)
    shape = len(sources[0]), len(samples[0])
    found = []
    for group in groups:
        each = np.empty((*shape, len(group)))
        for k, value in enumerate(group):
            each[..., k] = value
        found.append(each)
    return found, np.array([np.broadcast_to(value, shape).sum(axis=1) for value in sums])


def _compiled(
    module: Any, function: Function, sources: Sequence[Array], samples: Sequence[Array], numbers: Sequence[float]
) -> tuple[list[Array], Array]:
    """One kernel for all values: numbers are read from an array, so that others need no kernel of their own."""
    import drjit as dr

    number, integer = module.Float64, module.UInt32
    shape = len(sources[0]), len(samples[0])
    given = number(np.array([shape[1], *numbers]))

    def read(values: Any, place: Any) -> Any:
        return dr.gather(number, values, place)

    size = shape[0] * shape[1]
    place = dr.arange(integer, size)
    count = integer(read(given, integer(0)))
    source = place // count
    sample = place - source * count
    groups, sums = function(
        [read(number(x), source) for x in sources],
        [read(number(x), sample) for x in samples],
        [read(given, integer(k + 1)) for k in range(len(numbers))],
    )
    whole = dr.zeros(number, size)
    found = [[number(value) + whole for value in group] for group in [*groups, sums]]
    dr.eval(found)
    *arrays, totals = ([x.numpy().reshape(shape) for x in group] for group in found)
    return [np.stack(each, axis=-1) for each in arrays], np.array([x.sum(axis=1) for x in totals])
