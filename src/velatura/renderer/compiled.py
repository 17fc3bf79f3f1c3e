"""Functions of every source and every sample: by NumPy, and compiled by Dr.Jit in a process that asks for many.

A function is written on `velatura.ops`. NumPy begins at once; Dr.Jit takes some hundredths of a second for each kind of
function, and then a tenth of NumPy's time: a loop over the samples, whose sums never leave the processor. So a kernel
follows once so many values of its kind have been worked out without it, or where one is kept on disk.
"""

from __future__ import annotations

import contextlib
import copy
import functools
import gc
import hashlib
import itertools
import math
from collections import Counter, OrderedDict
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from types import MethodType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.ops import Value
from velatura.renderer.directional_grid import Curves
from velatura.renderer.packets import WIDTH, Packets, aligned, packets
from velatura.version import __version__

Array = NDArray[Any]

MANY = 500_000  # values of a kind, about as long as a kernel of it takes to compile where none is kept on disk
FEW_LIGHTS = 8  # that fall on rows, beyond which values take as long again
LONG = 320  # numbers that a kernel reads, of nine interfaces, beyond which it is never compiled: that would take long
LEAST = 100  # values at a time: for fewer, a kernel takes longer to launch than NumPy to run
SHARED = 2_000_000  # values at a time, from which several threads run a kernel; see `_lanes`
BLOCK = 1 << 15  # values at a time, which a processor's cache holds
COLOURS = 3
LISTS, FLOATS, CONSTANTS = (list, tuple), (float, np.floating), (int, str, type)  # unions take longer to make
KERNELS = 64  # kinds whose launches are kept
UNUSED = 256  # kinds whose launches were kept, from which their kernels are released
WAIT = 0.1  # seconds for a thread that launches another kernel; NumPy takes its place where one renders, or compiles
SIZES = 16  # of each: which numbers of sources, samples and rows are alike

_asked: Counter[Hashable] = Counter()  # values that NumPy has worked out, by kind
_kernels: OrderedDict[Hashable, Any] = OrderedDict()
_unused = 0  # kinds


class Deposit(NamedTuple):
    """Light that falls on rows: its `values` times `waves`, shared among the rows from the one of number `first` on.
    What is before the first row falls on one beyond the last."""

    first: Value
    shares: Sequence[Value]
    values: Sequence[Value]
    waves: Sequence[Value]


class Alike(NamedTuple):
    """Lights that fall on rows in the same way: the values of each, as many for all, and the deposit that these make.
    A kernel holds that function once, in a loop: most of the time to compile it goes into deposits."""

    lights: Sequence[Sequence[Value]]
    deposit: Callable[[Sequence[Value]], Deposit]


class Found(NamedTuple):
    """Results of a function for sources and samples: values that are summed up over the samples, values of which the
    largest is wanted, and light that falls on rows."""

    sums: Sequence[Value] = ()
    largest: Sequence[Value] = ()
    deposits: Sequence[Deposit | Alike] = ()


@dataclass(frozen=True)
class Colour:
    """Makes a colour of its channels, in NumPy or in a kernel: of the kind of `white`, a colour of ones."""

    white: Value

    def __call__(self, *channels: Value) -> Value:
        if isinstance(self.white, np.ndarray):
            return np.stack(channels)
        return channels[0] if len(channels) == 1 else type(self.white)(*channels)


class Number(float):
    """A number that never belongs to the kind of a function, 0.0 and 1.0 included."""


#: Of sources, samples and numbers; in kernels a choice between two constants is one of single precision
Function = Callable[[Sequence[Value], Sequence[Value], Any], Found]


def over(
    function: Function,
    sources: Sequence[Array],
    samples: Sequence[Array],
    numbers: Any,
    rows: int = 0,
    kind: Hashable = (),
) -> tuple[Array, Array, list[Array]]:
    """Results of a function for each source (S,) over all samples (N,), or its own (S, N): sums (L, S), the largest
    (G, S), and of each light what falls on `rows`, and on the one beyond: (values, waves, rows + 1, S).

    `numbers` are a list, a tuple or a record: of others, of numbers, of colours (3, 1, ...), and of `Curves` of NumPy.
    What is no number, and 0.0 and 1.0 unless each is a `Number`, belong to the kind of function, as does all else that
    it depends on, `kind`. It runs by NumPy alone if other objects are among them.
    """
    count, width = samples[0].shape[-1], len(sources[0])
    asked = None
    if width * count > LEAST:
        with contextlib.suppress(_Foreign):
            read = _Read([], [])
            asked = function.__module__, function.__qualname__, kind, *(x.ndim for x in samples), _kind(numbers, read)
            if len(sources) + len(read.flat) > LONG:
                raise _Foreign
            many = _asked[asked] > MANY
            kernels = kernel.llvm() if many or kernel.compiles_first() or _mark(asked).exists() else None
            if kernels:
                # A launch looks at its arguments by Python while it holds Dr.Jit's own lock, and a thread that asks
                # Dr.Jit for anything else meanwhile holds Python's: both would wait for ever
                with kernel.exclusive.within(math.inf if kernel.compiles_first() else WAIT) as alone:
                    if alone:
                        return _compiled(kernels, asked, function, sources, samples, numbers, read, rows)
    size = max(BLOCK // count, 1)
    found = []
    for first in range(0, max(width, 1), size):
        some, own = [x[first : first + size] for x in sources], [_part(x, first, size) for x in samples]
        found.append(_plain(function, some, own, numbers, rows))
    sums, largest, deposits = zip(*found)
    lights = [np.concatenate(each, axis=-1) for each in zip(*deposits)]
    if asked:
        _asked[asked] += width * count * (1 + len(lights) // FEW_LIGHTS)
    return np.concatenate(sums, axis=-1), np.concatenate(largest, axis=-1), lights


def _part(samples: Array, first: int, size: int) -> Array:
    return samples[first : first + size] if samples.ndim > 1 else samples


def _plain(
    function: Function, sources: Sequence[Array], samples: Sequence[Array], numbers: Any, rows: int
) -> tuple[Array, Array, list[Array]]:
    found = function([x[:, None] for x in sources], samples, numbers)
    shape = len(sources[0]), samples[0].shape[-1]

    def each(values: Sequence[Value]) -> list[Array]:
        return [np.broadcast_to(value, shape) for value in _channels(values)]

    sums = _rows([value.sum(axis=1) for value in each(found.sums)], shape[0])
    largest = _rows([value.max(axis=1) for value in each(found.largest)], shape[0])
    return sums, largest, [_deposited(light, shape, rows) for group in found.deposits for light in _deposits(group)]


def _deposits(group: Deposit | Alike) -> Iterator[Deposit]:
    """The deposit of each light."""
    if isinstance(group, Deposit):
        yield group
    else:
        yield from map(group.deposit, group.lights)


def _rows(each: Sequence[Array], width: int) -> Array:
    """Rows of that width, or none."""
    return np.array(each) if each else np.zeros((0, width))


def _deposited(light: Deposit, shape: tuple[int, int], rows: int) -> Array:
    """Light that falls on rows, samples being columns of a sparse matrix."""
    from scipy.sparse import csc_array  # slow to load

    values, waves = _channels(light.values), light.waves
    shares, each = _columns(light.shares, shape), _columns([x * wave for x in values for wave in waves], shape)
    first, source = np.asarray(light.first).astype(np.int32), np.arange(shape[0], dtype=np.int32)[:, None]
    steps = np.int32(shape[0]) * np.arange(shares.shape[-1], dtype=np.int32)
    places = (first * np.int32(shape[0]) + source)[..., None] + steps
    places[..., 0] += np.where(first < 0, np.int32((rows + 1) * shape[0]), 0)
    entries = shares.ravel(), places.ravel(), np.arange(0, shares.size + 1, shares.shape[-1], dtype=np.int32)
    found = csc_array(entries, ((rows + 1) * shape[0], shape[0] * shape[1])) @ each.reshape(-1, each.shape[-1])
    return found.T.reshape(len(values), len(waves), rows + 1, shape[0])


def _columns(each: Sequence[Value], shape: tuple[int, int]) -> Array:
    """Values side by side, (S, N, values)."""
    found = np.empty((*shape, len(each)))
    for k, value in enumerate(each):
        found[..., k] = value
    return found


class _Read(NamedTuple):
    """All that a kernel reads of the numbers of a function: numbers, those of colours one by one, and tables."""

    flat: list[float]
    tables: list[Curves]


@dataclass(frozen=True)
class _Kernel:
    """A frozen function of Dr.Jit, how many sums and largest values it has, and of each group of lights that are alike
    how many there are, and how many values, times waves, each deposits."""

    launch: Any
    counts: tuple[int, int]
    groups: list[tuple[int, int, int]]


def _compiled(
    module: Any,
    kind: Hashable,
    function: Function,
    sources: Sequence[Array],
    samples: Sequence[Array],
    numbers: Any,
    read: _Read,
    rows: int,
) -> tuple[Array, Array, list[Array]]:
    """One kernel for all values: numbers are read from an array, so that others need no kernel of their own."""
    global _unused
    import drjit as dr

    def array(values: Any) -> Any:
        # Arrays at other addresses would have a kernel of their own
        return module.Float64(aligned(np.ravel(values), np.float64))

    width, count = len(sources[0]), samples[0].shape[-1]
    lanes = _lanes(width, count)
    sizes = module.UInt32(aligned(np.array([width, count, rows, lanes]), np.uint32))
    # Sources of a sample lie side by side
    tables = [packets(x.data.ravel(), x.data.shape[-1], module, double=True) for x in read.tables]
    lit = [array(x) for x in sources], [array(x.T if x.ndim > 1 else x) for x in samples]
    given = *lit, array([0.0, *read.flat]), [table.values for table in tables], sizes
    if kind not in _kernels:
        _kernels[kind] = _kernel(module, function, sources, samples, numbers, tables, rows)
        with contextlib.suppress(OSError):
            _mark(kind).touch()
        if len(_kernels) > KERNELS:
            _kernels.popitem(last=False)
            _unused += 1
    _kernels.move_to_end(kind)
    of_kind = _kernels[kind]
    found = dr.opaque(module.Float64, 0.0, max(sum(of_kind.counts), 1) * width)
    outs = [
        [dr.opaque(module.Float64, 0.0, alike * (rows + 1) * width * part) for _, part in _packets(values * waves)]
        for alike, values, waves in of_kind.groups
    ]
    with _uncollected():
        found, outs = of_kind.launch(_numbered(module.UInt32, lanes), *given, found, outs)
    # Copies, since an array of NumPy's that has Dr.Jit's memory asks it for its lock wherever it is released
    totals, greatest, _ = np.split(np.array(found.numpy()).reshape(-1, width), np.cumsum(of_kind.counts))
    lights = []
    for (alike, values, waves), parts in zip(of_kind.groups, outs):
        each = np.concatenate([x.numpy().reshape(alike, rows + 1, width, -1) for x in parts], axis=-1)
        each = np.moveaxis(each[..., : values * waves], -1, 1)
        lights += [*each.reshape(alike, values, waves, rows + 1, width)]
    return totals, greatest, lights


def release_kernels() -> None:
    """Release all kernels of Dr.Jit, which keeps each one, if many serve no kind that is kept. Those that are asked for
    again are read from its cache on disk. Nothing happens while another thread works with Mitsuba, or launches one."""
    global _unused
    import drjit as dr

    if _unused < UNUSED:
        return
    with kernel.exclusive.within(0) as alone:
        if alone:
            dr.sync_thread()
            _kernels.clear()  # launches need the kernels that they have recorded
            dr.flush_kernel_cache()
            _unused = 0


def _kernel(
    module: Any,
    function: Function,
    sources: Sequence[Array],
    samples: Sequence[Array],
    numbers: Any,
    tables: Sequence[Packets],
    rows: int,
) -> _Kernel:
    """The kernel of a kind: for each source a loop over the samples, and for each lane one over its sources."""
    import drjit as dr

    number, integer = module.Float64, module.UInt32
    own = [x.ndim > 1 for x in samples]
    one = function([x[:1, None] for x in sources], [x[..., :1][:1] for x in samples], numbers)
    counts = len(_channels(one.sums)), len(_channels(one.largest))
    groups = []
    for group in one.deposits:
        first, *others = _deposits(group)
        groups.append((1 + len(others), len(_channels(first.values)), len(first.waves)))

    def launch(
        lane: Any,
        of_sources: Sequence[Any],
        of_samples: Sequence[Any],
        given: Any,
        of_tables: Sequence[Any],
        sizes: Any,
        out: Any,
        outs: Sequence[Any],
    ) -> tuple[Any, Sequence[Any]]:
        width, count, last, lanes = (dr.gather(integer, sizes, k) for k in range(4))
        places, held = itertools.count(1), iter([replace(x, values=values) for x, values in zip(tables, of_tables)])
        read = _mapped(
            numbers,
            _Reader(lambda _: dr.gather(number, given, next(places)), module.Array3f64, lambda _: next(held)),
        )

        def step(source: Any) -> tuple[Any]:
            # Read before the loop, from which LLVM takes all that depends on sources alone
            at_source = [dr.gather(number, x, source) for x in of_sources]

            def add(k: Any, sums: list[Any], largest: list[Any]) -> tuple[Any, list[Any], list[Any]]:
                each = [dr.gather(number, x, k * width + source if of_own else k) for x, of_own in zip(of_samples, own)]
                more = function(at_source, each, read)
                for group, parts in zip(more.deposits, outs):
                    deposit(group, parts, source)
                sums = [total + value for total, value in zip(sums, _channels(more.sums))]
                largest = [dr.maximum(most, value) for most, value in zip(largest, _channels(more.largest))]
                return k + 1, sums, largest

            start = integer(0), [number(0)] * counts[0], [number(-np.inf)] * counts[1]
            _, sums, largest = dr.while_loop(start, lambda k, *_: k < count, add, mode="symbolic")
            for j, value in enumerate([*sums, *largest]):
                dr.scatter(out, value, j * width + source, mode=dr.ReduceMode.NoConflicts)
            return (source + lanes,)

        def deposit(group: Deposit | Alike, parts: Sequence[Any], source: Any) -> None:
            if isinstance(group, Deposit):
                return fall(group, parts, source)
            lights, place = group
            columns = [*zip(*lights)]

            def one(k: Any) -> tuple[Any]:
                fall(place([chosen(k, column) for column in columns]), parts, k * ((last + 1) * width) + source)
                return (k + 1,)

            dr.while_loop((integer(0),), lambda k: k < len(lights), one, mode="symbolic")

        def chosen(k: Any, column: Sequence[Any]) -> Any:
            found = number(column[0])
            for j, value in enumerate(column[1:], start=1):
                found = dr.select(k == j, value, found)
            return found

        def fall(light: Deposit, parts: Sequence[Any], source: Any) -> None:
            values = [value * wave for value in _channels(light.values) for wave in light.waves]
            first = module.Int64(light.first)
            for j, share in enumerate(light.shares):
                row = dr.select(first < 0, last, integer(first)) if j == 0 else integer(first + j)
                for (begin, size), part in zip(_packets(len(values)), parts):
                    packet = [share * value for value in values[begin : begin + size]]
                    packet += [number(0)] * (size - len(packet))
                    more = packet[0] if size == 1 else module.ArrayXf64(packet)
                    dr.scatter_reduce(dr.ReduceOp.Add, part, more, row * width + source, mode=dr.ReduceMode.NoConflicts)

        dr.while_loop((integer(lane),), lambda source: source < width, step, mode="symbolic")
        return out, outs

    frozen = dr.freeze(launch, limit=SIZES, warn_after=1 << 30)
    return _Kernel(frozen, counts, groups)


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Collect no garbage in the block: an array of NumPy's that Dr.Jit lets go while it records ends the process."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


@functools.lru_cache(maxsize=256)
def _mark(kind: Hashable) -> Path:
    """The file, empty, that says that a kernel of a kind lies beside it, compiled by this or another process."""
    digest = hashlib.sha256(repr((__version__, kind)).encode()).hexdigest()
    return kernel.kept_kernels() / f"velatura-{digest[:32]}"


def _lanes(width: int, count: int) -> int:
    """How many sources run side by side: as many as the calling thread takes at once, unless there is much to do. Other
    threads, once Dr.Jit has woken them, keep processors busy for 20 ms more, while they look for work."""
    return width if width * count >= SHARED else min(width, kernel.vector_width())


def _packets(count: int) -> list[tuple[int, int]]:
    """Where values that are written together begin, and how many they are: a power of two."""
    return [(k, 1 << (min(count - k, WIDTH) - 1).bit_length()) for k in range(0, count, WIDTH)]


@functools.lru_cache(maxsize=32)
def _numbered(integer: Any, count: int) -> Any:
    return integer(aligned(np.arange(count), np.uint32))


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


class _Reader(NamedTuple):
    """Functions that make a kernel's values of numbers, of the channels of a colour, and of a table."""

    number: Callable[[float], Any]
    colour: Callable[[list[Any]], Any]
    table: Callable[[Curves], Packets]


def _mapped(value: Any, reader: _Reader) -> Any:
    """The value with all of its numbers, its colours and its tables replaced."""
    if isinstance(value, Number):
        return reader.number(value)
    if isinstance(value, list | tuple):
        each = [_mapped(x, reader) for x in value]
        return type(value)(*each) if hasattr(value, "_fields") else type(value)(each)
    if isinstance(value, Curves):
        return replace(value, data=reader.table(value))
    if is_dataclass(value) and not isinstance(value, type):
        found = copy.copy(value)
        for x in fields(value):
            object.__setattr__(found, x.name, _mapped(getattr(value, x.name), reader))
        return found
    if isinstance(value, MethodType):
        return getattr(_mapped(value.__self__, reader), value.__name__)
    if isinstance(value, np.ndarray) and value.size > 1:
        return reader.colour([reader.number(float(x)) for x in value.ravel()])
    if isinstance(value, float | np.floating | np.ndarray):
        plain = float(np.asarray(value).item())
        return plain if plain in (0, 1) else reader.number(plain)
    return value


class _Foreign(Exception):
    """A value has objects that kernels cannot read."""


def _kind(value: Any, read: _Read) -> Hashable:
    """A value without its numbers, which `read` gets in the order of `_mapped`: equal where one kernel serves.

    Raises _Foreign for what no kernel reads.
    """
    own: Any = type(value)
    if own is float:  # as most are; a launch has hundreds of values
        if value in (0, 1):
            return value
        read.flat.append(value)
        return float
    if own is Number:
        read.flat.append(value)
        return Number
    if isinstance(value, LISTS):
        return own, *[_kind(x, read) for x in value]
    if isinstance(value, np.ndarray):
        if value.size > 1:
            if value.ndim == 1 or value.size != COLOURS:
                raise _Foreign
            read.flat.extend(value.ravel().tolist())
            return np.ndarray
        return _kind(value.item(), read)
    if value is None or isinstance(value, CONSTANTS):
        return value
    if isinstance(value, FLOATS):
        return _kind(float(value), read)
    if isinstance(value, Curves) and isinstance(value.data, np.ndarray):
        read.tables.append(value)
        return Curves, value.data.shape
    if isinstance(value, MethodType):
        return value.__name__, _kind(value.__self__, read)
    names = _fields(own)
    if names is None:
        raise _Foreign
    return own, *[_kind(getattr(value, name), read) for name in names]


@functools.lru_cache(maxsize=256)
def _fields(kind: type) -> list[str] | None:
    """Names of the fields of a record; None of what is none."""
    return [x.name for x in fields(kind)] if is_dataclass(kind) else None
