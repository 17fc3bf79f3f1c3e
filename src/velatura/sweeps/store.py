"""Stores: a folder in the format of Zarr, of which each chunk is written once, whole, and then marked.

Chunks are those of the array of points. The chunk of `status`, written last, marks those of all other variables.
"""

from __future__ import annotations

import functools
import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from velatura.errors import InvalidInput, needs
from velatura.files import check_folder, reason
from velatura.stack.schema import show
from velatura.sweeps.plan import Plan, versions
from velatura.sweeps.questions import NAMES, Array, meaning

if TYPE_CHECKING:
    from xarray import Dataset

LARGEST = 2**26  # bytes of a chunk of points
SHARE = 2  # part of the root of the number of points, in a chunk
DONE, FAILED, MISSING = 1, 0, -1  # values of `status`
OWN = ("seed", "status", "reason")  # variables of every store


@dataclass(frozen=True)
class Variable:
    """An array that is found at every point: names and sizes of its dimensions, and its type."""

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: str

    @property
    def bytes(self) -> int:
        """Of one point."""
        return math.prod(self.shape) * np.dtype(self.dtype).itemsize

    @classmethod
    def of(cls, dims: tuple[str, ...], array: Array) -> Variable:
        """What one point gave."""
        return cls(dims, array.shape, array.dtype.str)


Layout = Mapping[str, Variable]


class Store:
    """An open store.

    Args:
        path: its folder, which all processes see.
        plan: what it holds.
    """

    def __init__(self, path: Path, plan: Plan) -> None:
        import zarr

        self.plan, self.path = plan, path
        self._group = zarr.open_group(str(path), mode="r+")
        self.chunk: tuple[int, ...] = self._group["status"].chunks
        self._arrays: dict[str, Any] = {}

    @property
    def size(self) -> int:
        """The number of points."""
        return math.prod(self.plan.shape)

    @functools.cached_property
    def grid(self) -> tuple[int, ...]:
        """How many chunks there are along each dimension of points."""
        return tuple(-(-size // part) for size, part in zip(self.plan.shape, self.chunk))

    def done(self) -> set[int]:
        """The chunks that are marked."""
        names = (name.split(".") for name in os.listdir(self.path / "status"))
        places = [tuple(map(int, name)) for name in names if all(part.isdigit() for part in name)]
        return {int(np.ravel_multi_index(place, self.grid)) for place in places}

    def region(self, chunk: int) -> tuple[slice, ...]:
        """Where a chunk lies among the points."""
        places = np.unravel_index(chunk, self.grid)
        return tuple(
            slice(int(i) * part, min((int(i) + 1) * part, size))
            for i, part, size in zip(places, self.chunk, self.plan.shape)
        )

    def count(self, chunk: int) -> int:
        """How many points a chunk has."""
        return math.prod(part.stop - part.start for part in self.region(chunk))

    def points(self, chunk: int) -> list[int]:
        """The numbers of its points."""
        ranges = [np.arange(part.start, part.stop) for part in self.region(chunk)]
        return [int(n) for n in np.ravel_multi_index(np.ix_(*ranges), self.plan.shape).ravel()]

    def layout(self) -> Layout:
        """What is found at every point."""
        found, dims = dict[str, Variable](), self.plan.dims
        for name, array in self._group.arrays():
            each = tuple(array.attrs["_ARRAY_DIMENSIONS"])
            if each[: len(dims)] == dims and name not in (*OWN, *self.plan.vary):
                found[name] = Variable(each[len(dims) :], array.shape[len(dims) :], array.dtype.str)
        return found

    def write(self, chunk: int, layout: Layout, answers: Sequence[Mapping[str, Array] | str]) -> None:
        """Write what was found at the points of a chunk, or why nothing was, and mark it."""
        region, numbers = self.region(chunk), self.points(chunk)
        shape = tuple(part.stop - part.start for part in region)
        whys = [answer if isinstance(answer, str) else "" for answer in answers]
        for name, variable in layout.items():
            found = np.full((len(answers), *variable.shape), np.nan, variable.dtype)
            for n, answer in enumerate(answers):
                if not isinstance(answer, str):
                    found[n] = answer[name]
            self._set(name, region, found.reshape(shape + variable.shape))
        if self.plan.sampling != "grid":
            points = self.plan.points(numbers)
            for name, coordinate in self.plan.coordinates.items():
                self._set(name, region, _stored([coordinate.stored(point[name]) for point in points]))
        self._set("seed", region, np.reshape(self.plan.seeds(numbers), shape))
        if any(whys):
            self._set("reason", region, np.array(whys, object).reshape(shape))
        self._set("status", region, np.reshape([FAILED if why else DONE for why in whys], shape))

    def _set(self, name: str, region: tuple[slice, ...], values: Array) -> None:
        if name not in self._arrays:
            self._arrays[name] = self._group[name]
        self._arrays[name][region] = values

    def open(self) -> Dataset:
        """The data, read when they are looked at."""
        import xarray

        found = xarray.open_zarr(str(self.path))
        return found[sorted(found.data_vars, key=lambda name: (name in OWN, name))]


# Begin and go on -----------------------------------------------------------------------------------------------------


def existing(path: Path, plan: Plan) -> Store | None:
    """The store of a plan that was begun before; None where there is none yet.

    Raises:
        InvalidInput: something else is there, the store of another plan, or one of other versions; or no store can be
            made there.
    """
    with needs("sweep"):
        import cloudpickle  # noqa: F401
        import distributed  # noqa: F401
        import xarray  # noqa: F401
        import zarr
    if not os.path.lexists(path):
        if not os.path.isdir(path.parent):
            raise InvalidInput(f"{path}: there is no folder {path.parent}")
        check_folder(path.parent, str(path))
        return None
    try:
        attributes = dict(zarr.open_group(str(path), mode="r").attrs)
        before, made = yaml.safe_load(str(attributes["plan"])), attributes["versions"]
    except Exception:  # of any kind, by what is there
        raise InvalidInput(f"{path}: is there already, and holds no sweep") from None
    now = plan.to_dict()
    for key in {**now, **before}:
        if now.get(key) != before.get(key):
            raise InvalidInput(f"{path}: holds another sweep, {_difference(key, before.get(key), now.get(key))}")
    for name, here in versions().items():
        if made.get(name) != here:
            raise InvalidInput(f"{path}: was begun with {name} {made.get(name)}, and this is {here}")
    return Store(path, plan)


def _difference(key: str, before: Any, now: Any) -> str:
    """Where two values differ, in words."""
    if isinstance(before, dict) and isinstance(now, dict):
        inner = next(name for name in {**before, **now} if before.get(name) != now.get(name))
        return _difference(f"{key}: {inner}", before.get(inner), now.get(inner))
    return f"with {key}: {show(before)}, not {show(now)}"


def create(path: Path, plan: Plan, layout: Layout) -> Store:
    """A new store, which appears whole.

    Raises:
        InvalidInput: it cannot be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=".velatura-", dir=path.parent, ignore_cleanup_errors=True) as folder:
            unfinished = Path(folder, "store")
            _fill(unfinished, plan, layout)
            os.rename(unfinished, path)
    except OSError as error:
        raise InvalidInput(f"{path}: cannot be written: {reason(error)}") from None
    return Store(path, plan)


def _fill(path: Path, plan: Plan, layout: Layout) -> None:
    """Everything but the points."""
    import zarr

    # Format 2 in every version of Zarr: its text has one encoding, and the files of a variable lie in one folder
    format: dict[str, Any] = {} if zarr.__version__ < "3" else {"zarr_format": 2}
    group = zarr.open_group(str(path), mode="w-", **format)
    chunk, dims = _chunk(plan, layout), plan.dims

    def add(name: str, dims: Sequence[str], shape: Sequence[int], kind: Any, fill: Any, **about: str) -> Any:
        chunks = tuple(chunk[: len(plan.shape)]) + tuple(shape[len(plan.shape) :])
        chunks = chunks if tuple(dims[: len(plan.dims)]) == plan.dims else tuple(shape)
        made = group.full(name=name, shape=tuple(shape), chunks=chunks, dtype=kind, fill_value=fill, **format)
        made.attrs.update({"_ARRAY_DIMENSIONS": list(dims), **{k: v for k, v in about.items() if v}})
        return made

    # What is found, and how it went
    for name, variable in layout.items():
        add(name, dims + variable.dims, plan.shape + variable.shape, variable.dtype, np.nan, **meaning(name))
    add("seed", dims, plan.shape, np.int64, MISSING, long_name="seed of the random numbers")
    add("reason", dims, plan.shape, str, "", long_name="why nothing was found")
    status = add("status", dims, plan.shape, np.int8, MISSING, long_name="1 found, 0 failed, missing where not yet")
    status.attrs.update({"flag_values": [FAILED, DONE], "flag_meanings": "failed found"})

    # Coordinates
    fixed: dict[str, tuple[tuple[str, ...], Array, dict[str, str]]] = {}
    sizes = {dim: size for variable in layout.values() for dim, size in zip(variable.dims, variable.shape)}
    for name, (own, values) in plan.question.coordinates(**plan.options).items():
        fixed[name] = own, values, meaning(name)
    for (name, axis), coordinate in zip(plan.vary.items(), plan.coordinates.values()):
        about = {"units": coordinate.unit, "long_name": coordinate.doc}
        if plan.sampling == "grid":
            values = _stored([coordinate.stored(value) for value in axis.grid])
            fixed[name] = (dims[list(plan.vary).index(name)], *coordinate.dims), values, about
        else:
            text = coordinate.form == "text"
            shape = plan.shape + np.shape(coordinate.stored(axis.at(np.zeros(3), (0, 0))))
            add(name, dims + coordinate.dims, shape, str if text else float, "" if text else np.nan, **about)
        sizes.update(zip(coordinate.dims, (len(NAMES[dim]) for dim in coordinate.dims)))
    for dim, names in NAMES.items():
        if sizes.get(dim) == len(names):
            fixed.setdefault(dim, ((dim,), np.array(names), {}))
    for name, (own, values, about) in fixed.items():
        text = values.dtype.kind in "UO"
        made = add(name, own, values.shape, str if text else float, "" if text else np.nan, **about)
        made[...] = values.astype(object) if text else values

    group.attrs.update(
        {
            "plan": yaml.safe_dump(plan.to_dict(), sort_keys=False, allow_unicode=True),
            "versions": versions(),
            "coordinates": " ".join(name for name in {**fixed, **plan.vary} if name not in (*dims, *sizes)),
        }
    )
    zarr.consolidate_metadata(str(path))


def _chunk(plan: Plan, layout: Layout) -> tuple[int, ...]:
    """The shape of a chunk of points, which depends on nothing but the plan and the size of what is found."""
    count, size = math.prod(plan.shape), sum(variable.bytes for variable in layout.values())
    most = plan.chunk or math.isqrt(count) // SHARE
    most, chunk = max(min(most, LARGEST // max(size, 1)), 1), list[int]()
    for length in reversed(plan.shape):
        chunk.insert(0, max(min(length, most), 1))
        most //= length
    return tuple(chunk)


def _stored(values: Sequence[Any]) -> Array:
    text = isinstance(values[0], str)
    return np.array(values, object if text else float)
