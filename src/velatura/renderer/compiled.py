"""Functions of every source and every sample: by NumPy, and compiled by Dr.Jit in a process that asks for many.

A function is written on `velatura.ops`. NumPy begins at once; Dr.Jit takes a tenth of a second for each kind of
function, and then a third of NumPy's time. So a kernel follows once `MANY` values of its kind have been worked out
without it.
"""

from __future__ import annotations

import copy
import functools
import itertools
from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from dataclasses import fields, is_dataclass
from types import MethodType
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.ops import Value
from velatura.renderer.packets import aligned

Array = NDArray[Any]
Groups = Sequence[Sequence[Value]]

#: Of sources, samples and numbers: groups of values, and values that are summed up over the samples
Function = Callable[[Sequence[Value], Sequence[Value], Any], tuple[Groups, Sequence[Value]]]

MANY = 500_000  # values of a kind, about as long as a kernel of it takes to compile
LEAST = 15_000  # values at a time: for fewer, a kernel takes longer to describe than NumPy to run
BLOCK = 1 << 15  # values at a time, which a processor's cache holds
COMPILED_BLOCK = 1 << 18
REDUCED_BLOCK = 1 << 16  # of values that are reduced at once: larger arrays are new pages each time
COLOURS = 3

_asked: Counter[Hashable] = Counter()  # values so far, by kind


def over(
    function: Function,
    sources: Sequence[Array],
    samples: Sequence[Array],
    numbers: Any,
    reduced: Callable[[list[Array]], list[Array]] | None = None,
) -> tuple[list[Array], Array]:
    """Values of a function of each source (S,) and each sample (N,), or its own (S, N): of each group of K values
    (S, N, K), and sums over the samples (L, S).

    `numbers` are a list, a tuple or a record: of others, of numbers, and of colours (3, 1, ...). What is no number, and
    0.0 and 1.0, belong to the kind of function. It runs by NumPy alone if other objects are among them. `reduced` makes
    arrays (..., S) of the groups of some sources at a time, which are what is returned.
    """
    count = samples[0].shape[-1]
    module = None
    if len(sources[0]) * count > LEAST and not _foreign(numbers):
        kind = function.__module__, function.__qualname__, *(x.ndim for x in samples), _kind(numbers)
        module = kernel.llvm() if _asked[kind] > MANY else None
        _asked[kind] += 0 if module else len(sources[0]) * count
    compiled_block = REDUCED_BLOCK if reduced else COMPILED_BLOCK
    size = max((compiled_block if module else BLOCK) // count, 1)
    found = []
    for first in range(0, max(len(sources[0]), 1), size):
        some, own = [x[first : first + size] for x in sources], [_part(x, first, size) for x in samples]
        if module is None:
            values, sums = _plain(function, some, own, numbers)
        else:
            values, sums = _compiled(module, function, some, own, numbers)
        found.append((reduced(values) if reduced else values, sums))
    groups, totals = zip(*found)
    if len(found) == 1:
        return groups[0], totals[0]
    axis = -1 if reduced else 0
    return [np.concatenate(each, axis=axis) for each in zip(*groups)], np.concatenate(totals, axis=-1)


def _part(samples: Array, first: int, size: int) -> Array:
    return samples[first : first + size] if samples.ndim > 1 else samples


def _plain(
    function: Function, sources: Sequence[Array], samples: Sequence[Array], numbers: Any
) -> tuple[list[Array], Array]:
    groups, sums = function([x[:, None] for x in sources], samples, numbers)
    shape = len(sources[0]), samples[0].shape[-1]
    found = []
    for group in map(_channels, groups):
        each = np.empty((*shape, len(group)))
        for k, value in enumerate(group):
            each[..., k] = value
        found.append(each)
    return found, np.array([np.broadcast_to(value, shape).sum(axis=1) for value in _channels(sums)])


def _compiled(
    module: Any, function: Function, sources: Sequence[Array], samples: Sequence[Array], numbers: Any
) -> tuple[list[Array], Array]:
    """One kernel for all values: numbers are read from an array, so that others need no kernel of their own."""
    import drjit as dr

    number, integer = module.Float64, module.UInt32

    def array(values: Any) -> Any:
        # Arrays at other addresses would have a kernel of their own
        return number(aligned(np.ravel(values), np.float64))

    shape = len(sources[0]), samples[0].shape[-1]
    flat: list[float] = []
    _mapped(numbers, flat.append)
    given = array([*flat, 0.0])

    def read(values: Any, place: Any) -> Any:
        return dr.gather(number, values, place)

    source, sample = _places(integer, *shape)
    places = itertools.count()
    groups, sums = function(
        [read(array(x), source) for x in sources],
        [array(x) if x.ndim > 1 else read(array(x), sample) for x in samples],
        _mapped(numbers, lambda _: read(given, integer(next(places))), module.Array3f64),
    )
    size = shape[0] * shape[1]

    def whole(value: Any) -> Any:
        each = number(value)
        return each if dr.width(each) == size else each + dr.zeros(number, size)

    found = [[whole(value) for value in _channels(group)] for group in [*groups, sums]]
    dr.eval(found)
    *arrays, totals = ([x.numpy().reshape(shape) for x in group] for group in found)
    stacked = [each[0][..., None] if len(each) == 1 else np.stack(each, axis=-1) for each in arrays]
    return stacked, np.array([x.sum(axis=1) for x in totals])


@functools.lru_cache(maxsize=32)
def _places(integer: Any, sources: int, samples: int) -> tuple[Any, Any]:
    """The source and the sample of each value; quicker to read than to divide for."""
    source, sample = np.divmod(np.arange(sources * samples, dtype=np.uint32), np.uint32(samples))
    return integer(aligned(source, np.uint32)), integer(aligned(sample, np.uint32))


def _channels(group: Sequence[Value]) -> list[Value]:
    """Numbers, and channels of colours, which are arrays with one axis more."""
    found: list[Value] = []
    for value in group:
        own = (
            np.ndim(value) > 2
            if isinstance(value, float | np.ndarray)
            else hasattr(value, "__len__") and _nested(value)
        )
        found += list(value) if own else [value]
    return found


def _nested(value: Any) -> bool:
    import drjit as dr

    return bool(dr.depth_v(value) > 1)


def _mapped(value: Any, number: Callable[[float], Any], colour: Callable[[list[Any]], Any] = list) -> Any:
    """The value with all of its numbers, and its colours, replaced."""
    if isinstance(value, list | tuple):
        each = [_mapped(x, number, colour) for x in value]
        return type(value)(*each) if hasattr(value, "_fields") else type(value)(each)
    if is_dataclass(value) and not isinstance(value, type):
        found = copy.copy(value)
        for x in fields(value):
            object.__setattr__(found, x.name, _mapped(getattr(value, x.name), number, colour))
        return found
    if isinstance(value, MethodType):
        return getattr(_mapped(value.__self__, number, colour), value.__name__)
    if isinstance(value, np.ndarray) and value.size > 1:
        return colour([number(float(x)) for x in value.ravel()])
    if isinstance(value, float | np.floating | np.ndarray):
        plain = float(np.asarray(value).item())
        return plain if plain in (0, 1) else number(plain)
    return value


def _kind(value: Any) -> Hashable:
    """A value without its numbers: equal for values that one kernel serves."""
    if isinstance(value, list | tuple):
        return type(value), *map(_kind, value)
    if is_dataclass(value) and not isinstance(value, type):
        return type(value), *(_kind(getattr(value, x.name)) for x in fields(value))
    if isinstance(value, MethodType):
        return value.__name__, _kind(value.__self__)
    if isinstance(value, np.ndarray) and value.size > 1:
        return np.ndarray
    if isinstance(value, float | np.floating | np.ndarray):
        plain = float(np.asarray(value).item())
        return plain if plain in (0, 1) else float
    return cast(Hashable, value)


def _foreign(value: Any) -> bool:
    """Whether a value has objects that kernels cannot read."""
    if isinstance(value, list | tuple):
        return any(map(_foreign, value))
    if is_dataclass(value) and not isinstance(value, type):
        return any(_foreign(getattr(value, x.name)) for x in fields(value))
    if isinstance(value, MethodType):
        return _foreign(value.__self__)
    if isinstance(value, np.ndarray):
        return value.size > 1 and (value.ndim == 1 or value.size != COLOURS)
    return not isinstance(value, float | int | np.floating | type(None))
