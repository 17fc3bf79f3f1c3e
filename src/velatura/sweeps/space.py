"""Spaces: a material of which some values vary, and the points that sample it, each known by its number alone."""

from __future__ import annotations

import functools
import json
import math
import threading
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from velatura.errors import InvalidInput, within
from velatura.stack import Described, Mix, Stack, addressed, load
from velatura.stack.schema import Parameter, Record, Taken, by_default
from velatura.stack.values import LARGEST, Choice, Flag, Scalar, Whole, Written

Array = NDArray[Any]

MOST = 2**30  # points of a Sobol sequence


# Declarations of the keys of a file ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Number(Whole):
    """A whole number in a range, of points unless said otherwise."""

    high: int = MOST

    @property
    def values(self) -> str:
        return f"a whole number in {self.low} to {self.high}"


class Listed(Parameter):
    """Values of a parameter, as a file of a material would hold them."""

    what = "a list of at least one value"

    def check(self, value: Any) -> tuple[Any, ...]:
        value = value.tolist() if isinstance(value, np.ndarray) else value
        if not isinstance(value, list | tuple) or not value:
            raise self.refuse(value)
        return tuple(tuple(entry) if isinstance(entry, list) else entry for entry in value)


class RangeEnds(Parameter):
    """Both ends of a range."""

    what = "[low, high], two numbers, the lower one first"

    def check(self, value: Any) -> tuple[float, float]:
        if not isinstance(value, list | tuple) or len(value) != 2 or not all(map(_is_number, value)):
            raise self.refuse(value)
        if not value[0] < value[1]:
            raise self.refuse(value)
        return float(value[0]), float(value[1])


class MaterialSource(Parameter):
    """A material: a file, the name of a preset, or what a file would hold."""

    what = "a material"

    def check(self, value: Any) -> Described:
        try:
            found: Described = load(value)
            return found
        except InvalidInput as error:
            raise ValueError(str(error)) from None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool) and math.isfinite(float(value))


# How one value varies ------------------------------------------------------------------------------------------------


class Axis(Record):
    """How a value varies: over a list, over a range, or around a mean.

    Args:
        values: each as a file of a material has it. On a grid all of them, otherwise each as likely as the others.
        range: both ends; on a grid in `steps`, with both ends, otherwise anywhere.
        distribution: in a range `uniform` (the default) or `log-uniform`, on a grid the spacing of the steps; or
            `normal`, by `mean` and `std`, cut off where the parameter ends, and on no grid.
        per_channel: a number of its own for red, green and blue, on no grid.
    """

    holds = "values, range or distribution"

    values: Annotated[Taken[Sequence[Any] | NDArray[Any] | None, tuple[Any, ...] | None], Listed("the values")] = (
        by_default(None)
    )
    range: Annotated[Taken[Sequence[float] | None, tuple[float, float] | None], RangeEnds("both ends")] = by_default(
        None
    )
    steps: Annotated[int | None, Number("values in the range, on a grid", low=2, high=10**6)] = None
    distribution: Annotated[str, Choice("how likely values are", options=("uniform", "log-uniform", "normal"))] = (
        "uniform"
    )
    mean: Annotated[float | None, Scalar("mean of a normal distribution", texturable=False)] = None
    std: Annotated[
        float | None, Scalar("standard deviation of a normal distribution", low=0, strict=True, texturable=False)
    ] = None
    per_channel: Annotated[bool, Flag("a number of its own for each colour")] = False

    @model_validator(mode="after")
    def _one_way_to_say_it(self) -> Axis:
        normal = self.distribution == "normal"
        if normal and (self.mean is None or self.std is None):
            raise ValueError("distribution: normal needs mean and std")
        if not normal and (self.mean is not None or self.std is not None):
            raise ValueError("mean and std: only with distribution: normal")
        if sum((self.values is not None, self.range is not None, normal)) != 1:
            raise ValueError("must have one of values, range, and distribution: normal")
        if self.values is not None and (self.distribution != "uniform" or self.per_channel):
            raise ValueError("values: not together with distribution or per_channel")
        if self.steps is not None and self.range is None:
            raise ValueError("steps: only with range")
        if self.distribution == "log-uniform" and self.range and self.range[0] <= 0:
            raise ValueError(f"range: must begin above 0 for distribution: log-uniform, got {self.range[0]:g}")
        return self

    @property
    def extremes(self) -> tuple[Any, ...]:
        """Values that the parameter must be able to take."""
        return self.values or self.range or (self.mean,)

    @property
    def grid(self) -> tuple[Any, ...]:
        """All values on a grid."""
        if self.values is not None:
            return self.values
        assert self.range and self.steps
        return _between(*self.range, self.steps, self.distribution)

    @property
    def numbers(self) -> int:
        """How many uniform numbers a value is made of."""
        return 3 if self.per_channel else 1

    def at(self, u: Array, bounds: tuple[float, float]) -> Any:
        """The value at uniform numbers (1,) or (3,), within the range of its parameter."""
        if self.values is not None:
            return self.values[int(u[0] * len(self.values))]
        drawn = self._drawn(u, bounds)
        return tuple(drawn.tolist()) if self.per_channel else float(drawn[0])

    def _drawn(self, u: Array, bounds: tuple[float, float]) -> Array:
        if self.range is None:
            from scipy.special import ndtr, ndtri

            assert self.mean is not None and self.std is not None
            low, high = (ndtr((end - self.mean) / self.std) for end in bounds)
            return np.clip(self.mean + self.std * ndtri(low + u * (high - low)), *bounds)
        low, high = self.range
        if self.distribution == "log-uniform":
            return np.clip(low * (high / low) ** u, low, high)
        return np.asarray(low + u * (high - low))


# All of them ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StoredAxis:
    """How the values of an axis are stored.

    Args:
        form: `number`, `colour`, `pair`, or `text` of anything else.
        unit, doc: of the parameter.
    """

    form: str
    unit: str
    doc: str

    @property
    def dims(self) -> tuple[str, ...]:
        """Dimensions of one value."""
        return {"colour": ("colour",), "pair": ("axis",)}.get(self.form, ())

    def stored(self, value: Any) -> Any:
        """A value as it is written."""
        if self.form == "text":
            return (value.name or json.dumps(value.to_dict())) if isinstance(value, Stack | Mix) else str(value)
        return np.broadcast_to(np.asarray(value, float), {"colour": (3,), "pair": (2,)}.get(self.form, ()))


class Axes(Parameter):
    """Flat names of values, or `material`, and how they vary."""

    what = "flat names with values, range or distribution"

    def check(self, value: Any) -> dict[str, Axis]:
        if not isinstance(value, Mapping) or not value:
            raise self.refuse(value)
        return {str(name): self._axis(str(name), entry) for name, entry in value.items()}

    def _axis(self, name: str, entry: Any) -> Axis:
        with within(name, ValueError):
            axis = entry if isinstance(entry, Axis) else Axis.from_dict(entry)
            if name != "material":
                return axis
            if axis.values is None:
                raise InvalidInput("needs values")
            return Axis(values=tuple(MaterialSource("a material").check(each) for each in axis.values))


class Space(Record):
    """A material of which some values vary, and the points that are looked at.

    Args:
        material: a stack, a mixture, a file, the name of a preset, or the mapping of a file.
        vary: by flat name (`layer0_alpha`, `part0_weight`, as `replace` takes them) an `Axis`, or its mapping. The
            values of `material` are materials in place of that one.
        sampling: `grid`, all combinations; `random`, independent points; `sobol`, points of a scrambled Sobol sequence,
            which fill the space evenly.
        count: points of the latter two.
        seed: of the points, and of the random numbers at each.

    Raises:
        InvalidInput: in one line that names the key and what is allowed.
    """

    material: Annotated[
        Taken[Stack | Mix | str | Path | Written, Stack | Mix],
        MaterialSource("a material: a file, a preset, or its layers"),
    ]
    vary: Annotated[Taken[Mapping[str, Axis | Written], dict[str, Axis]], Axes("flat names, and how each varies")]
    sampling: Annotated[str, Choice("how points are chosen", options=("grid", "random", "sobol"))] = "grid"
    count: Annotated[int | None, Number("points, of random and sobol", low=1)] = None
    seed: Annotated[int, Number("of points, and of the random numbers at each", high=2**63 - 1)] = 0

    @model_validator(mode="after")
    def _fits_together(self) -> Space:
        grid = self.sampling == "grid"
        if grid and self.count is not None:
            raise ValueError("count: not with sampling: grid, whose steps give it")
        if not grid and self.count is None:
            raise ValueError(f"count: missing; sampling: {self.sampling} needs it")
        for name, axis in self.vary.items():
            self._accepts(name, axis)
        if math.prod(self.shape) > MOST:
            raise ValueError(f"vary: must have at most {MOST} points, got {math.prod(self.shape)}")
        return self

    def _accepts(self, name: str, axis: Axis) -> None:
        where, grid = f"vary: {name}", self.sampling == "grid"
        if grid and axis.range and axis.steps is None:
            raise ValueError(f"{where}: steps: missing; sampling: grid needs it")
        if grid and (axis.per_channel or axis.distribution == "normal"):
            key = "per_channel" if axis.per_channel else "distribution: normal"
            raise ValueError(f"{where}: {key}: only with sampling: random or sobol")
        if not grid and axis.steps is not None:
            raise ValueError(f"{where}: steps: only with sampling: grid")
        if axis.per_channel and not all(address.colour for address in addressed(name)):
            raise ValueError(f"{where}: per_channel: only of a value that may differ between colours")
        for value in axis.extremes:
            try:
                self.stack({name: value})
            except InvalidInput as error:
                raise ValueError(f"vary: {error}" if str(error).startswith(name) else f"{where}: {error}") from None

    @property
    def shape(self) -> tuple[int, ...]:
        """How many points there are: along each axis of a grid, else in a row."""
        if self.sampling != "grid":
            return (self.count or 0,)
        return tuple(len(axis.values or ()) or axis.steps or 0 for axis in self.vary.values())

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of these dimensions: the value's, unless each has several numbers."""
        if self.sampling != "grid":
            return ("point",)
        return tuple(f"{name}_index" if each.dims else name for name, each in self.coordinates.items())

    @property
    def coordinates(self) -> dict[str, StoredAxis]:
        """How the values of every axis are stored."""
        return {name: self._coordinate(name, axis) for name, axis in self.vary.items()}

    def _coordinate(self, name: str, axis: Axis) -> StoredAxis:
        forms = {_form(value) for value in axis.values or ()} or {"colour" if axis.per_channel else "number"}
        form = max(forms, key=("number", "pair", "colour", "text").index)
        form = "text" if {"pair", "colour"} <= forms else form
        address = next(iter(addressed(name)), None)
        return StoredAxis(form, address.declared.unit if address else "", address.declared.doc if address else "")

    def points(self, numbers: Sequence[int]) -> list[dict[str, Any]]:
        """Values by flat name of points by their numbers, which ascend; those of a grid in C order."""
        if self.sampling == "grid":
            indices = zip(*(i.tolist() for i in np.unravel_index(list(numbers), self.shape)))
            return [{name: axis.grid[i] for (name, axis), i in zip(self.vary.items(), each)} for each in indices]
        return [self._point(u) for u in self._uniform(numbers)]

    def stack(self, values: Mapping[str, Any]) -> Described:
        """The stack or the mixture of a point."""
        others = {name: value for name, value in values.items() if name != "material"}
        base: Described = values.get("material", self.material)
        return base.replace(**others) if others else base

    def seeds(self, numbers: Sequence[int]) -> list[int]:
        """The seed of each point, below 2^32: by its number, independent of all others."""
        return [int(self._sequence(n).generate_state(1)[0]) for n in numbers]

    def _point(self, u: Array) -> dict[str, Any]:
        ends = np.cumsum([axis.numbers for axis in self.vary.values()])
        parts = np.split(u, ends[:-1])
        return {name: axis.at(part, _bounds(name)) for (name, axis), part in zip(self.vary.items(), parts)}

    def _uniform(self, numbers: Sequence[int]) -> Array:
        """Uniform numbers (n, d) of points."""
        count = sum(axis.numbers for axis in self.vary.values())
        if self.sampling == "sobol":
            first, last = numbers[0], numbers[-1] + 1
            return _sobol(count, self.seed).points(first, last - first)[np.subtract(numbers, first)]
        return np.array([np.random.default_rng(self._sequence(n).spawn(1)[0]).random(count) for n in numbers])

    def _sequence(self, number: int) -> np.random.SeedSequence:
        return np.random.SeedSequence(self.seed, spawn_key=(number,))

    def to_dict(self) -> dict[str, Any]:
        """The mapping of a file, the material written out."""
        vary = {name: axis.to_dict() for name, axis in self.vary.items()}
        return {**super().to_dict(), "material": self.material.to_dict(), "vary": vary}


@functools.lru_cache(64)
def _between(low: float, high: float, steps: int, distribution: str) -> tuple[float, ...]:
    spaced = np.geomspace if distribution == "log-uniform" else np.linspace
    return tuple(spaced(low, high, steps).tolist())


def _form(value: Any) -> str:
    if _is_number(value):
        return "number"
    if isinstance(value, tuple) and all(map(_is_number, value)) and len(value) in (2, 3):
        return "pair" if len(value) == 2 else "colour"
    return "text"


@functools.cache
def _bounds(name: str) -> tuple[float, float]:
    address = next(iter(addressed(name)), None)
    return address.declared.within if address else (-LARGEST, LARGEST)


class _Sobol:
    """A scrambled Sobol sequence, cheap to ask for what comes after what was asked before."""

    def __init__(self, dimensions: int, seed: int) -> None:
        from scipy.stats import qmc

        self._engine, self._next, self._lock = qmc.Sobol(dimensions, seed=seed), 0, threading.Lock()

    def points(self, number: int, count: int) -> Array:
        """Some points (n, d), from the one of that number."""
        with self._lock, warnings.catch_warnings():
            if number < self._next:
                self._engine.reset()
                self._next = 0
            warnings.simplefilter("ignore", UserWarning)  # any number of points is asked for
            if number > self._next:
                self._engine.fast_forward(number - self._next)
            self._next = number + count
            return np.asarray(self._engine.random(count))


@functools.lru_cache(4)
def _sobol(dimensions: int, seed: int) -> _Sobol:
    return _Sobol(dimensions, seed)
