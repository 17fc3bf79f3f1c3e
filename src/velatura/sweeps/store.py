"""Stores: a folder in the format of Zarr, of which each chunk is written once, whole, and then marked.

Chunks are those of the array of points. The chunk of `status`, written last, marks those of all other variables. Every
variable has a file for every chunk that is marked, which ends in its checksum (RFC 8878, 3.1.1); everything else in the
store follows from the plan and the layout, which the attributes hold.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import json
import math
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from velatura.errors import InvalidInput, needs
from velatura.files import check_folder, reason
from velatura.stack.schema import show
from velatura.stack.text import parsed
from velatura.sweeps.plan import Plan, versions
from velatura.sweeps.questions import NAMES, Array, meaning

if TYPE_CHECKING:
    from xarray import Dataset

LARGEST = 2**26  # bytes of a chunk of points
SHARE = 2  # part of the root of the number of points, in a chunk
DONE, FAILED, MISSING = 1, 0, -1  # values of `status`
OWN = ("seed", "status", "reason")  # variables of every store
LEVEL = 0  # of compression, the least


@dataclass(frozen=True)
class StoredVariable:
    """An array that is found at every point: names and sizes of its dimensions, and its type."""

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: str

    @property
    def bytes(self) -> int:
        """Bytes of one point."""
        return math.prod(self.shape) * np.dtype(self.dtype).itemsize

    @classmethod
    def of(cls, dims: tuple[str, ...], array: Array) -> StoredVariable:
        """The variable of which one point gave an array."""
        return cls(dims, array.shape, array.dtype.str)

    @classmethod
    def read(cls, fields: Mapping[str, Any]) -> StoredVariable:
        """The variable from its fields, as they are written in a file."""
        return cls(tuple(fields["dims"]), tuple(fields["shape"]), fields["dtype"])


Layout = Mapping[str, StoredVariable]


class Store:
    """An open store.

    Args:
        path: its folder, which all processes see.
        plan: what it holds; layout: what is found at every point.
    """

    def __init__(self, path: Path, plan: Plan, layout: Layout) -> None:
        import zarr

        self.plan, self.path, self.layout = plan, path, layout
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

    @property
    def chunks(self) -> range:
        """The numbers of all chunks."""
        return range(math.prod(self.grid))

    def marked(self) -> list[int]:
        """The chunks that are marked."""
        there = set(os.listdir(self.path / "status"))
        return [chunk for chunk in self.chunks if self._file("status", chunk).name in there]

    def damage(self, chunk: int) -> Path | None:
        """A file of a chunk that is missing or is not as it was written, if there is one."""
        drawn = () if self.plan.sampling == "grid" else tuple(self.plan.vary)
        files = (self._file(name, chunk) for name in (*self.layout, *drawn, *OWN))
        return next((file for file in files if not _sound(file)), None)

    def _file(self, name: str, chunk: int) -> Path:
        """The part of a variable: its chunks hold the other dimensions whole."""
        others = len(self._array(name).shape) - len(self.grid)
        return self.path / name / ".".join(map(str, (*np.unravel_index(chunk, self.grid), *[0] * others)))

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

    def write(self, chunk: int, answers: Sequence[Mapping[str, Array] | str]) -> None:
        """Write what was found at the points of a chunk, or why nothing was, and mark it."""
        region, numbers = self.region(chunk), self.points(chunk)
        shape = tuple(part.stop - part.start for part in region)
        whys = [answer if isinstance(answer, str) else "" for answer in answers]
        for name, variable in self.layout.items():
            found = np.full((len(answers), *variable.shape), np.nan, variable.dtype)
            for n, answer in enumerate(answers):
                if not isinstance(answer, str):
                    found[n] = answer[name]
            self._array(name)[region] = found.reshape(shape + variable.shape)
        if self.plan.sampling != "grid":
            points = self.plan.points(numbers)
            for name, coordinate in self.plan.coordinates.items():
                self._array(name)[region] = _stored([coordinate.stored(point[name]) for point in points])
        self._array("seed")[region] = np.reshape(self.plan.seeds(numbers), shape)
        self._array("reason")[region] = np.array(whys, object).reshape(shape)
        self._array("status")[region] = np.reshape([FAILED if why else DONE for why in whys], shape)

    def _array(self, name: str) -> Any:
        import zarr

        if name not in self._arrays:
            # Chunks of missing numbers alone have files, too, as always in Zarr 2
            written = {} if _before_3() else {"array.write_empty_chunks": True}
            with zarr.config.set(written) if written else contextlib.nullcontext():
                self._arrays[name] = self._group[name]
        return self._arrays[name]

    def open(self) -> Dataset:
        """The data, read when they are looked at."""
        import xarray

        found = xarray.open_zarr(str(self.path))
        return found[sorted(found.data_vars, key=lambda name: (name in OWN, name))]


def _before_3() -> bool:
    import zarr

    return bool(zarr.__version__ < "3")


def _sound(file: Path) -> bool:
    """Whether a chunk is there and as it was written."""
    from numcodecs import Zstd

    try:
        return Zstd().decode(file.read_bytes()) is not None
    except (OSError, RuntimeError, ValueError, MemoryError):
        return False


# Begin and go on -----------------------------------------------------------------------------------------------------


def existing(path: Path, plan: Plan) -> Store | None:
    """The store of a plan that was begun before; None where there is none yet.

    All that is missing or altered in it but points is written anew.

    Raises:
        InvalidInput: something else is there, the store of another plan, or one of other versions; or no store can be
            made there.
    """
    with needs("sweep"):
        import cloudpickle  # noqa: F401
        import distributed  # noqa: F401
        import xarray  # noqa: F401
        import zarr  # noqa: F401
    if not os.path.lexists(path):
        if not os.path.isdir(path.parent):
            raise InvalidInput(f"{path}: there is no folder {path.parent}")
        check_folder(path.parent, str(path))
        return None
    try:
        attributes = json.loads((path / ".zattrs").read_bytes())
        before, made = dict(parsed(attributes["plan"], "yaml", path)), dict(attributes["versions"])
        layout = {name: StoredVariable.read(fields) for name, fields in attributes["layout"].items()}
    except Exception:  # of any kind, by what is there
        raise InvalidInput(f"{path}: is there already, and holds no sweep") from None
    now = plan.to_dict()
    for key in {**now, **before}:
        if now.get(key) != before.get(key):
            raise InvalidInput(f"{path}: holds another sweep, {_difference(key, before.get(key), now.get(key))}")
    for name, here in versions().items():
        if made.get(name) != here:
            raise InvalidInput(f"{path}: was begun with {name} {made.get(name)}, and this is {here}")
    with _refusing(path), tempfile.TemporaryDirectory(prefix="velatura-") as folder:
        fresh = Path(folder, "store")
        _fill(fresh, plan, layout)
        for file in filter(Path.is_file, fresh.rglob("*")):
            kept = path / file.relative_to(fresh)
            if not (_agrees(kept, file) if file.suffix else _sound(kept)):
                kept.parent.mkdir(exist_ok=True)
                shutil.copyfile(file, kept)
    return Store(path, plan, layout)


def _agrees(kept: Path, fresh: Path) -> bool:
    """Whether metadata are there, with all that fresh ones hold."""

    def holds(one: Any, other: Any) -> bool:
        if isinstance(one, dict) and isinstance(other, dict):
            return all(key in one and holds(one[key], other[key]) for key in other)
        return bool(one == other)

    try:
        return holds(json.loads(kept.read_bytes()), json.loads(fresh.read_bytes()))
    except (OSError, ValueError, RecursionError):
        return False


def _difference(key: str, before: Any, now: Any) -> str:
    """Where two values differ, in words."""
    if isinstance(before, dict) and isinstance(now, dict):
        inner = next(name for name in {**before, **now} if before.get(name) != now.get(name))
        return _difference(f"{key}: {inner}", before.get(inner), now.get(inner))
    return f"with {key}: {show(before)}, not {show(now)}"


def create(path: Path, plan: Plan, layout: Layout) -> Store:
    """A new store, which appears whole.

    Raises:
        InvalidInput: it cannot be written, or another sweep has begun it.
    """
    with (
        _refusing(path),
        tempfile.TemporaryDirectory(prefix=".velatura-", dir=path.parent, ignore_cleanup_errors=True) as folder,
    ):
        unfinished = Path(folder, "store")
        _fill(unfinished, plan, layout)
        os.rename(unfinished, path)
    return Store(path, plan, layout)


@contextlib.contextmanager
def _refusing(path: Path) -> Iterator[None]:
    """Raises InvalidInput about a store where the system refuses to write it."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOTEMPTY, errno.EEXIST):
            raise InvalidInput(f"{path}: another sweep has begun it meanwhile; the same call goes on with it") from None
        raise InvalidInput(f"{path}: cannot be written: {reason(error)}") from None


def _fill(path: Path, plan: Plan, layout: Layout) -> None:
    """Everything but the points."""
    import zarr
    from numcodecs import Zstd

    # Format 2 in every version of Zarr: its text has one encoding, and the files of a variable lie in one folder
    format: dict[str, Any] = {} if _before_3() else {"zarr_format": 2}
    compressor = Zstd(level=LEVEL, checksum=True)
    group = zarr.open_group(str(path), mode="w-", **format)
    chunk, dims = _chunk(plan, layout), plan.dims

    def add(name: str, dims: Sequence[str], shape: Sequence[int], kind: Any, fill: Any, **about: str) -> Any:
        chunks = tuple(chunk[: len(plan.shape)]) + tuple(shape[len(plan.shape) :])
        chunks = chunks if tuple(dims[: len(plan.dims)]) == plan.dims else tuple(shape)
        made = group.full(
            name=name,
            shape=tuple(shape),
            chunks=chunks,
            dtype=kind,
            fill_value=fill,
            compressor=compressor,
            **format,
        )
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
            "layout": {name: asdict(variable) for name, variable in layout.items()},
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
