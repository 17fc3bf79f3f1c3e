"""The elementary functions that the model is written in, for every dialect of numbers.

The model is written once. Called with Python floats or NumPy arrays it runs on those; called with Dr.Jit arrays it runs
inside a renderer and is differentiable. The types of the arguments choose the dialect:

- floats give floats (Mitsuba's scalar variants compute with them);
- NumPy arrays, alone or mixed with floats, give NumPy arrays;
- Dr.Jit arrays, alone or mixed with floats, give Dr.Jit arrays;
- values of a class with a `dialect` of its own, alone or mixed with floats and NumPy arrays, give values of that class
  (the recorder's, which print as shader code).

Colour is the leading axis of an array; a float is the same in all channels. A Dr.Jit array with any number of channels
is a spectrum: half of it at fixed wavelengths, whose `mean` stands for all light, and half at those of a ray. An array
of NumPy with more than four channels is one, too: the first `FIXED` are at those wavelengths. `sqrt`
and `divide` clamp arguments outside their domain instead of answering NaN, so that the branch which a `select` throws
away poisons neither value nor gradient.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from functools import cache
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

Value = Any  # a float, a NumPy array, a Dr.Jit array or a recorded symbol

FIXED = 4  # wavelengths that stand for all light
TINY = 1e-15  # whose square, in gradients of quotients, single precision still holds


#: A position in two: the number of the node before it, at most a last one, and the rest
Split = Callable[[Value, int], tuple[Value, Value]]
Corners = Callable[[Sequence[int], Sequence[Value], Split], list[tuple[Value, Value]]]


class Gridded(Protocol):
    """Input of `interpolate`: values at the nodes i/(N-1) of a grid of some shape.

    Dr.Jit reads packets, of a module; NumPy reads `data`, with channels on the last axis. They begin at the node of a
    number.
    """

    @property
    def shape(self) -> tuple[int, ...]: ...

    @property
    def first(self) -> Value: ...

    def packets(self, dialect: Any) -> Any: ...


def _box(shape: Sequence[int], coordinates: Sequence[Value], split: Split) -> list[tuple[Value, Value]]:
    """The nodes around a point, by their places in a flat table, and their weights: of multilinear interpolation."""
    corners: list[tuple[Value, Value]] = []
    for x, nodes in zip(coordinates, shape):
        cell, upper = split(clip(x, 0.0, 1.0) * (nodes - 1), nodes - 2)
        ends = [(cell, 1 - upper), (cell + 1, upper)]
        corners = [(i * nodes + k, w * v) for i, w in corners for k, v in ends] if corners else ends
    return corners


def _simplex(shape: Sequence[int], coordinates: Sequence[Value], split: Split) -> list[tuple[Value, Value]]:
    """The nodes of the simplex that a point is in, as `_box`: each cell is cut into those that share its diagonal; from
    its first node to its last they take the axes in the order of the point's coordinates within the cell."""
    node: Value = 0
    uppers: list[Value] = []
    steps: list[Value] = []
    for x, nodes in zip(coordinates, shape):
        cell, upper = split(clip(x, 0.0, 1.0) * (nodes - 1), nodes - 2)
        node, steps = node * nodes + cell, [step * nodes for step in steps]
        step: Value = 0 * cell + 1
        # Sorted, the greatest coordinate first
        for k, (other, along) in enumerate(zip(uppers, steps)):
            more = upper > other
            uppers[k], upper = select(more, upper, other), select(more, other, upper)
            steps[k], step = select(more, step, along), select(more, along, step)
        uppers, steps = [*uppers, upper], [*steps, step]
    corners = []
    for step, (upper, following) in zip([0, *steps], pairwise([1, *uppers, 0])):
        node = node + step
        corners.append((node, upper - following))
    return corners


class Unrolled:
    """Loops of a dialect that has none of its own, and channels of one that interpolates numbers alone."""

    def each(self, function: Callable[..., Value], nodes: Sequence[float], values: Sequence[Value]) -> list[Value]:
        return [function(x, *values) for x in nodes]

    def repeat(self, function: Callable[..., Sequence[Value]], times: int, state: Sequence[Value]) -> Sequence[Value]:
        for _ in range(times):
            state = function(*state)
        return state

    def channel(self, value: Value, k: int | None) -> Value:
        return value

    def fma(self, a: Value, b: Value, c: Value) -> Value:
        return a * b + c

    def root(self, x: Value, least: float | None) -> Value:
        return sqrt(x if least is None else maximum(x, least))

    def around(self, x: Value, share: float) -> tuple[Value, Value, Value] | None:
        return None


class _Numpy(Unrolled):
    exp, log, power, sin, cos = np.exp, np.log, np.power, np.sin, np.cos
    arctan2, absolute, minimum, maximum, floor = np.arctan2, np.abs, np.minimum, np.maximum, np.floor
    select = staticmethod(np.where)

    @staticmethod
    def sqrt(x: Value) -> Value:
        return np.sqrt(np.maximum(x, 0))

    @staticmethod
    def log_gamma(x: Value) -> Value:
        from scipy.special import gammaln

        return gammaln(x)

    @staticmethod
    def mean(x: Value) -> Value:
        return np.add.reduce(x[:FIXED], axis=0) / min(len(x), FIXED) if np.ndim(x) else x  # quicker than `np.mean`

    @staticmethod
    def interpolate(table: Any, coordinates: Sequence[Value], corners: Corners = _box) -> list[Value]:
        def split(position: Value, last: int) -> tuple[Value, Value]:
            cell = np.minimum(np.asarray(position).astype(int), last)
            return cell, position - cell.astype(np.result_type(position))

        channels = table.data.shape[-1]
        flat = table.data.reshape(-1, channels)
        around = corners(table.shape, coordinates, split)
        total = sum(np.asarray(w)[..., None] * flat[i + table.first] for i, w in around)
        return [total[..., c] for c in range(channels)]


class _Float(Unrolled):
    """Python floats: NumPy's functions, with results as Python floats.

    (A NumPy scalar times a Dr.Jit array would be a NumPy array.)
    """

    def __getattr__(self, name: str) -> Callable[..., Value]:
        function = getattr(_Numpy, name)

        def on_floats(*args: Value) -> Value:
            result = function(*args)
            return [float(x) for x in result] if isinstance(result, list) else np.asarray(result).item()

        setattr(self, name, on_floats)
        return on_floats


class _DrJit(Unrolled):
    def __init__(self) -> None:
        import drjit as dr

        self.exp, self.log, self.sin, self.cos = dr.exp, dr.log, dr.sin, dr.cos
        self.power, self.arctan2, self.absolute = dr.power, dr.atan2, dr.abs
        self.select, self.floor, self.log_gamma = dr.select, dr.floor, dr.lgamma
        self._dr = dr

    # Of `dr.maximum`, a processor makes four instructions to pass NaN on, and one of this; where both are the same, the
    # first one keeps its gradient

    def maximum(self, a: Value, b: Value) -> Value:
        return self._chosen(b > a, b, a)

    def minimum(self, a: Value, b: Value) -> Value:
        return self._chosen(b < a, b, a)

    def _chosen(self, where: Value, a: Value, b: Value) -> Value:
        found = self._dr.select(where, a, b)
        # A choice may take a colour of Mitsuba's for an array
        kind = type(a) if self._is_colour(a) else type(b)
        return found if type(found) is kind or not self._is_colour(found) else kind(found)

    def fma(self, a: Value, b: Value, c: Value) -> Value:
        return self._dr.fma(a, b, c)

    def sqrt(self, x: Value) -> Value:
        return self._dr.safe_sqrt(x) if self._dr.grad_enabled(x) else self.root(x, 0.0)

    def root(self, x: Value, least: float | None) -> Value:
        return self._dr.sqrt(x if least is None else self.maximum(x, least))

    def around(self, x: Value, share: float) -> tuple[Value, Value, Value] | None:
        if not self._dr.grad_enabled(x):
            return None
        at = self._dr.detach(x)
        return (1 - share) * at, at, (1 + share) * at

    def _is_colour(self, x: Value) -> bool:
        return self._dr.is_array_v(x) and (self._dr.depth_v(x) > 1 or not self._dr.is_jit_v(x))

    def channel(self, value: Value, k: int | None) -> Value:
        if not self._is_colour(value):
            return value
        return self.mean(value) if k is None else value[k]

    def mean(self, x: Value) -> Value:
        if not self._is_colour(x):
            return x
        return self._dr.mean(x[: len(x) // 2] if self._dr.size_v(x) < 0 else x)

    def interpolate(self, table: Gridded, coordinates: Sequence[Value], corners: Corners = _box) -> list[Value]:
        colour = next((x for x in coordinates if self._is_colour(x)), None)
        if colour is not None:
            channels = [[x[c] if self._is_colour(x) else x for x in coordinates] for c in range(len(colour))]
            each = (_dialect(*x).interpolate(table, x, corners) for x in channels)
            return [type(colour)(list(values)) for values in zip(*each)]
        dr, number = self._dr, next(type(x) for x in coordinates if not isinstance(x, float))
        dialect: Any = sys.modules[number.__module__]

        def split(position: Value, last: int) -> tuple[Value, Value]:
            cell = dr.minimum(dialect.UInt32(position), last)
            return cell, position - number(cell)

        around, found = corners(table.shape, [number(x) for x in coordinates], split), []
        packets, first = table.packets(dialect), table.first
        several = dialect.ArrayXf64 if number is dialect.Float64 else dialect.ArrayXf
        if not isinstance(first, int) or first:
            around = [(node + dialect.UInt32(first), weight) for node, weight in around]
        for begin, width in packets.parts:
            kind, shape = (number, None) if width == 1 else (several, (width, 1))
            total: Value = 0.0
            for node, weight in around:
                index = node * (packets.stride // width) + begin // width
                total = dr.fma(dr.gather(kind, packets.values, index, shape=shape), weight, total)
            found += [total] if width == 1 else list(total)
        return found[: packets.count]


@cache
def _drjit() -> _DrJit:
    return _DrJit()


_FLOAT, _NUMPY = _Float(), _Numpy()


@cache
def _of_type(kind: type) -> Any:
    if issubclass(kind, (np.ndarray, np.generic)):
        return _NUMPY
    return _FLOAT if issubclass(kind, (float, int)) else getattr(kind, "dialect", None) or _drjit()


def _dialect(*args: Value) -> Any:
    found: Any = _FLOAT
    for x in args:
        dialect = _of_type(x.__class__)
        if dialect is _NUMPY:
            found = dialect
        elif dialect is not _FLOAT:
            return dialect
    return found


# Titles and names that are printed with the values; numbers ignore them

_readable: ContextVar[bool] = ContextVar("readable", default=False)
_title: ContextVar[str] = ContextVar("title", default="")


@contextmanager
def readable() -> Iterator[None]:
    """Record readable values in this block: with names, and loops as loops."""
    outside = _readable.set(True)
    try:
        yield
    finally:
        _readable.reset(outside)


def is_readable() -> bool:
    """Whether the current recording is readable."""
    return _readable.get()


@contextmanager
def block(title: str) -> Iterator[None]:
    """A part of the model, and the title under which its values are printed."""
    outside = _title.set(title)
    try:
        yield
    finally:
        _title.reset(outside)


def title() -> str:
    """The title of the innermost block; "" outside of all."""
    return _title.get()


def names(**values: Value) -> None:
    """Names under which values are printed, unless they have been given others before; of a tuple or list by item."""
    if not is_readable():
        return
    for name, value in values.items():
        if isinstance(value, tuple | list):
            parts = "xyz" if isinstance(value, tuple) and len(value) == 3 else range(len(value))
            names(**{f"{name}_{part}": each for part, each in zip(parts, value)})
        elif dialect := getattr(type(value), "dialect", None):
            dialect.name(value, name)


class NamedFields:
    """A record whose values are printed under the names of its fields."""

    def __post_init__(self) -> None:
        if is_readable():
            names(**vars(self))


def sqrt(x: Value, least: float | None = 0.0) -> Value:
    """Square root of max(x, least); None for an x that is known to be positive."""
    return _dialect(x).sqrt(x) if least == 0.0 else _dialect(x).root(x, least)


def around(x: Value, share: float) -> tuple[Value, Value, Value] | None:
    """Numbers a share of x below it, at it, and above it, without gradients; None for x that is not differentiated."""
    found: tuple[Value, Value, Value] | None = _dialect(x).around(x, share)
    return found


def exp(x: Value) -> Value:
    return _dialect(x).exp(x)


def log(x: Value) -> Value:
    return _dialect(x).log(x)


def fma(a: Value, b: Value, c: Value) -> Value:
    """a * b + c, in one step where a dialect has one."""
    return _dialect(a, b, c).fma(a, b, c)


def power(x: Value, exponent: Value) -> Value:
    return _dialect(x, exponent).power(x, exponent)


def sin(x: Value) -> Value:
    return _dialect(x).sin(x)


def cos(x: Value) -> Value:
    return _dialect(x).cos(x)


def arctan2(y: Value, x: Value) -> Value:
    return _dialect(y, x).arctan2(y, x)


def absolute(x: Value) -> Value:
    return _dialect(x).absolute(x)


def floor(x: Value) -> Value:
    return _dialect(x).floor(x)


def log_gamma(x: Value) -> Value:
    """Logarithm of the gamma function."""
    return _dialect(x).log_gamma(x)


def minimum(a: Value, b: Value) -> Value:
    return _dialect(a, b).minimum(a, b)


def maximum(a: Value, b: Value) -> Value:
    return _dialect(a, b).maximum(a, b)


def clip(x: Value, low: Value, high: Value) -> Value:
    return minimum(maximum(x, low), high)


def select(condition: Value, a: Value, b: Value) -> Value:
    """`a` where the condition holds, else `b`; both are worked out."""
    return _dialect(condition, a, b).select(condition, a, b)


def select_record(condition: Value, yes: Any, no: Any) -> Any:
    """`yes` where the condition holds, else `no`: dataclasses, tuples and lists value by value.

    What is the same in both, or an equal constant, stays as it is; None in either is None. A class whose records are
    no sum of their values states its own choice as a static method `selected`, of the same arguments.
    """
    if yes is no:
        return yes
    own = getattr(type(yes), "selected", None) or getattr(type(no), "selected", None)
    if own:
        return own(condition, yes, no)
    if yes is None or no is None:
        return None
    if isinstance(yes, tuple | list):
        items = [select_record(condition, x, y) for x, y in zip(yes, no)]
        return type(yes)(*items) if hasattr(yes, "_fields") else type(yes)(items)
    if is_dataclass(yes):
        kind: Any = type(yes)
        return kind(*(select_record(condition, getattr(yes, x.name), getattr(no, x.name)) for x in fields(yes)))
    known = isinstance(yes, float | bool) and isinstance(no, float | bool) and yes == no
    return yes if known else select(condition, yes, no)


def divide(a: Value, b: Value) -> Value:
    """a / b for b >= 0, with b kept off zero."""
    return a / maximum(b, TINY)


def mean(colour: Value) -> Value:
    """Mean over the channels."""
    return _dialect(colour).mean(colour)


def channel(value: Value, k: int | None = None) -> Value:
    """The k-th channel, or the mean, of what is interpolated, maybe at colours; a number is that of all channels."""
    return _dialect(value).channel(value, k)


def interpolate(table: Gridded, *coordinates: Value) -> list[Value]:
    """Multilinear interpolation of a table at coordinates in [0, 1], one array per channel of the table."""
    return _dialect(*coordinates).interpolate(table, coordinates)


def interpolate_in_simplices(table: Gridded, *coordinates: Value) -> list[Value]:
    """Interpolation as `interpolate`, linear within each simplex of a cell: of n axes, it reads n + 1 nodes instead of
    2**n. For tables with nodes so close together that products of coordinates within a cell do not count."""
    return _dialect(*coordinates).interpolate(table, coordinates, _simplex)


def each(function: Callable[..., Value], nodes: Sequence[float], *values: Value) -> list[Value]:
    """`function` of every node, a constant, and of the values; a loop if it is recorded.

    It may answer a list of values. `values` choose the dialect, though the function may read others, too.
    """
    return _dialect(*values).each(function, nodes, values)


def repeat(function: Callable[..., Sequence[Value]], times: int, *state: Value) -> Sequence[Value]:
    """A state, one value or several, after `function` is applied to it a number of times; a loop if it is recorded."""
    return _dialect(*state).repeat(function, times, state)
