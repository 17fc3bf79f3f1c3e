"""The course of a sweep: what is missing in its store is computed, a few chunks at a time."""

from __future__ import annotations

import math
import re
import warnings
from collections import deque
from collections.abc import Callable, Mapping, Set
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from velatura import kernel
from velatura.errors import Damaged, InvalidInput, VelaturaError
from velatura.progress import bar
from velatura.stack.schema import show
from velatura.sweeps import work
from velatura.sweeps.engines import BREAKDOWNS, Engine, engine
from velatura.sweeps.plan import Plan, versions
from velatura.sweeps.space import Space
from velatura.sweeps.store import OWN, Layout, Store, StoredVariable, create, existing

if TYPE_CHECKING:
    from xarray import Dataset

SHORTEST, RATE = 1.0, 100  # seconds of a task at least, and how many end in a second, of all workers, at most
AHEAD = 2  # tasks that are submitted for each worker
ATTEMPTS = 2  # at a point alone, where a process has ended
TRIED = 16  # points that are looked at for one that shows what is found

Progress = Callable[[int, int], None]


def sweep(
    space: Space | Mapping[str, Any],
    what: str | Callable[..., Mapping[str, Any]] = "lobes",
    *,
    store: str | Path,
    executor: Any = None,
    workers: int | None = None,
    chunk: int | None = None,
    part: str | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Dataset:
    """Ask the same of many materials, on one machine or a cluster, and keep the answers in a Zarr store.

    What is in the store already is not computed again, so that the same call goes on with a sweep that was interrupted.
    Values and seeds of a point follow from its number and the seed of the space alone: results depend neither on the
    engine nor on what was interrupted.

    Args:
        space: a `Space`, or its mapping: `material`, `vary`, `sampling`, `count`, `seed`.
        what: "lobes", "albedo", "statistics", "distribution", "check", "render" or "inverse", as the functions of these
            names; or a function, called with the material and the seed of a point, that returns its arrays by name,
            each alone or as a pair of the names of its dimensions and the array.
        store: the folder, which all workers must see.
        executor: where it runs: None, one process of dask for each core of this machine; the address of a scheduler of
            dask, or its client; or any executor in the style of `concurrent.futures`.
        workers: processes of this machine; or how many tasks an executor runs at once, if it does not report it.
        chunk: points that are computed and written at once; by default, half the root of their number.
        part: "3/64": one part of the chunks alone, as a job of an array computes it; all parts share the store.
        progress: called with (points done, all points of the part); by default a bar with the time left.
        options: keyword arguments of `what` (`cos_theta=[1, 0.5]`).

    Returns:
        An `xarray.Dataset`, read from the store where it is looked at. A grid has a dimension for each value that
        varies; otherwise there is one, `point`, with the values as its coordinates. Numbers of points that failed are
        NaN, their `status` is 0, and `reason` says why. The attributes hold the plan as YAML, and all versions.

    Raises:
        InvalidInput: not a space, an unknown question or option, a part that is none, a store that holds something
            else, no scheduler at that address, or none of the first points has an answer.
        MissingTool: the extra `sweep` is not installed; or LLVM is missing on a worker.
        VelaturaError: the engine broke down; what is in the store stays.
    """
    if isinstance(space, Space):
        fields = {key: getattr(space, key) for key in Space.model_fields}
    elif isinstance(space, Mapping):
        fields = dict(space)
    else:
        raise InvalidInput(f"space: must be a Space or its mapping, got {show(space)}")
    plan = Plan.from_dict({**_given(fields), "what": what, "options": options, **({"chunk": chunk} if chunk else {})})
    return carry_out(plan, store, executor, workers, progress, part)


def _given(fields: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in fields.items() if value is not None}


def carry_out(
    plan: Plan,
    store: str | Path,
    executor: Any = None,
    workers: int | None = None,
    progress: Progress | None = None,
    part: str | None = None,
) -> Dataset:
    """Carry out a plan, or a part of it, as `sweep` does."""
    path, own = Path(store).absolute(), _slice(part)
    found = existing(path, plan)
    done = set[int]() if found is None else _sound(found, found.chunks[own])
    if found is None or len(done) < len(found.chunks[own]):
        with kernel.threads_restored(), engine(executor, workers) as runs:
            job = work.Job(plan, path, None, versions())
            if found is None:
                try:
                    layout = _looked(runs, job.packed(), plan)
                except BREAKDOWNS as error:
                    broke = f"{path}: the executor broke down ({type(error).__name__}) before a point was stored"
                    raise VelaturaError(broke) from None
                found = _begun(path, plan, layout, part)
            packed = replace(job, layout=found.layout).packed()
            course = _Course(runs, found, packed, found.chunks[own], done)
            with nullcontext(progress) if progress else bar(f"Sweeping {path.name}") as advance:
                course.run(advance)
    return found.open()


def _slice(part: str | None) -> slice:
    """The chunks of a part, "3/64": every 64th, from the third; all without one. Raises InvalidInput."""
    if part is None:
        return slice(None)
    found = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", part) if isinstance(part, str) else None
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise InvalidInput(f"part: must be K/N, of whole numbers with K from 1 to N, such as 3/64, got {show(part)}")
    return slice(int(found[1]) - 1, None, int(found[2]))


def _begun(path: Path, plan: Plan, layout: Layout, part: str | None) -> Store:
    """A new store; where another part has begun it meanwhile, that one."""
    try:
        return create(path, plan, layout)
    except InvalidInput:
        found = existing(path, plan) if part else None
        if found is None:
            raise
        return found


def _sound(store: Store, own: range) -> set[int]:
    """Chunks of these that are done; warns of those that are marked, and were damaged since."""
    marked, damaged = [chunk for chunk in store.marked() if chunk in own], dict[int, Path]()
    with bar(f"Checking {store.path.name}") as advance:
        for n, chunk in enumerate(marked):
            if file := store.damage(chunk):
                damaged[chunk] = file
            advance(n + 1, len(marked))
    if damaged:
        points, first = sum(map(store.count, damaged)), next(iter(damaged.values())).relative_to(store.path)
        warnings.warn(
            f"{store.path}: files are missing or altered, {first} the first; {points} points are computed anew",
            Damaged,
            stacklevel=4,
        )
    return set(marked) - damaged.keys()


def _looked(runs: Engine, packed: bytes, plan: Plan) -> Layout:
    """The layout of what is found at every point, as one of the first shows it."""
    why, tried = "", min(TRIED, math.prod(plan.shape))
    for number in range(tried):
        answer = _alone(runs, packed, number)
        if not isinstance(answer, str):
            return _checked({name: StoredVariable.of(*array) for name, array in answer.items()}, plan)
        why = why or answer
    points = "the only point has no answer" if tried == 1 else f"none of the first {tried} points has an answer"
    raise InvalidInput(f"{points}: {why}")


def _alone(runs: Engine, packed: bytes, number: int) -> work.Answered:
    """The answer of a point that may end its process; one that ends while others begin is asked again."""
    for _ in range(ATTEMPTS):
        try:
            (answer,) = runs.result(runs.submit(work.look, packed, (number,)))
        except runs.fatal:
            continue
        found: work.Answered = answer
        return found
    return "the process that looked at it ended"


def _checked(layout: Layout, plan: Plan) -> Layout:
    """Raises InvalidInput where names or sizes of what is found do not fit together."""
    sizes: dict[str, int] = {}
    for name, variable in layout.items():
        for dim, size in zip(variable.dims, variable.shape):
            if sizes.setdefault(dim, size) != size:
                raise InvalidInput(f"what: {name}: {dim} has {size} entries, and {sizes[dim]} in another array")
    for name in (*layout, *sizes):
        if name in {*OWN, *plan.vary, *plan.dims} or (name in layout and name in sizes):
            raise InvalidInput(f"what: {name}: another name is needed, this one has a meaning of its own")
    return layout


class _Course:
    """One run through what is missing.

    Args:
        runs: the engine.
        store: what is there already.
        packed: the job of the workers.
        own: the chunks that are asked for.
        done: chunks that are left as they are.
    """

    def __init__(self, runs: Engine, store: Store, packed: bytes, own: range, done: Set[int]) -> None:
        self._runs, self._store, self._packed = runs, store, packed
        self._todo = deque(chunk for chunk in own if chunk not in done)
        self._total = sum(map(store.count, own))
        self._tasks: dict[Any, tuple[int, ...]] = {}
        self._left = sum(map(store.count, self._todo))
        self._pace: float | None = None  # seconds that a chunk takes

    def run(self, progress: Progress) -> None:
        """Compute what is missing.

        Raises:
            VelaturaError: the engine broke down.
        """
        total = self._total
        progress(total - self._left, total)
        try:
            while self._todo or self._tasks:
                while self._todo and len(self._tasks) < AHEAD * self._runs.workers:
                    self._begin(tuple(self._todo.popleft() for _ in range(self._batch())))
                for task in self._runs.ended(self._tasks):
                    self._left -= self._ended(task, self._tasks.pop(task))
                    progress(total - self._left, total)
        except BREAKDOWNS as error:
            raise VelaturaError(
                f"{self._store.path}: the executor broke down ({type(error).__name__}) with {total - self._left} of "
                f"{total} points stored; the same call goes on from there"
            ) from None
        finally:
            for task in self._tasks:
                task.cancel()

    def _batch(self) -> int:
        """How many chunks the next task has: few at the end, so that all workers stay busy."""
        if self._pace is None:
            return 1
        seconds = max(SHORTEST, self._runs.workers / RATE)
        return max(min(int(seconds / self._pace), len(self._todo) // (AHEAD * self._runs.workers)), 1)

    def _begin(self, chunks: tuple[int, ...]) -> None:
        self._tasks[self._runs.submit(work.fill, self._packed, chunks)] = chunks

    def _ended(self, task: Any, chunks: tuple[int, ...]) -> int:
        """The points of a task that has ended; where it ended its process, it is split."""
        try:
            points, seconds = task.result()
        except self._runs.fatal:
            if len(chunks) > 1:
                for chunk in chunks:
                    self._begin((chunk,))
                return 0
            points = self._store.count(chunks[0])
            numbers = self._store.points(chunks[0])
            work.keep(self._packed, chunks[0], [_alone(self._runs, self._packed, number) for number in numbers])
        else:
            pace = seconds / len(chunks)
            self._pace = pace if self._pace is None else 0.5 * (self._pace + pace)
        return int(points)
