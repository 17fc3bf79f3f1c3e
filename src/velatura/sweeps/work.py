"""The work of a worker: it looks at points, one after another, and writes chunks of them."""

from __future__ import annotations

import functools
import gc
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel
from velatura.errors import InvalidInput, MissingTool, VelaturaError, one_line
from velatura.sweeps.plan import Plan, versions
from velatura.sweeps.questions import Array
from velatura.sweeps.store import Layout, Store

TIDY = 10.0  # seconds between collections of garbage
_tidied = 0.0

#: What one point gave: arrays with the names of their dimensions, or the reason why it gave none.
Answered = Mapping[str, tuple[tuple[str, ...], Array]] | str


@dataclass(frozen=True)
class Job:
    """The task that every worker is given once.

    Args:
        path: the store; layout: what is found at every point, None as long as it is not known.
        versions: those of the process that asks.
    """

    plan: Plan
    path: Path
    layout: Layout | None
    versions: Mapping[str, str]

    def packed(self) -> bytes:
        """The work in bytes, functions of scripts and notebooks included.

        Raises:
            InvalidInput: it cannot be sent to another process.
        """
        import cloudpickle

        try:
            return bytes(cloudpickle.dumps(self))
        except Exception as error:
            raise InvalidInput(f"what: cannot be sent to other processes: {error}") from None

    @functools.cached_property
    def store(self) -> Store:
        """The store, opened once."""
        assert self.layout is not None
        return Store(self.path, self.plan, self.layout)


@functools.lru_cache(2)
def _unpacked(packed: bytes) -> Job:
    import cloudpickle

    job: Job = cloudpickle.loads(packed)
    for name, version in versions().items():
        if version != job.versions[name]:
            raise InvalidInput(f"a worker has {name} {version}, and this is {job.versions[name]}")
    return job


def look(packed: bytes, numbers: Sequence[int]) -> list[Answered]:
    """The answers of points."""
    job = _unpacked(packed)
    plan, ask = job.plan, job.plan.question.ask
    kernel.use_threads(1)  # workers share the machine, and sums of several threads are rounded by chance
    found: list[Answered] = []
    for values, seed in zip(plan.points(numbers), plan.seeds(numbers)):
        try:
            with kernel.compiled_first():  # rather than by NumPy until a process has done much
                found.append(_named(ask(plan.stack(values), seed, **plan.options)))
        except MissingTool:
            raise
        except VelaturaError as error:
            found.append(str(error))
        except Exception as error:
            found.append(one_line(f"{type(error).__name__}: {error}"))
    return found


def fill(packed: bytes, chunks: Sequence[int]) -> tuple[int, float]:
    """Compute and write chunks; returns the points that they have, and the seconds it took."""
    store, points, start = _unpacked(packed).store, 0, time.perf_counter()
    for chunk in chunks:
        answers = look(packed, store.points(chunk))
        keep(packed, chunk, answers)
        points += len(answers)
    _tidy()
    return points, time.perf_counter() - start


def _tidy() -> None:
    """Keep memory flat, now and then: both take a tenth of a second."""
    global _tidied
    if "drjit" in sys.modules and time.monotonic() > _tidied + TIDY:
        gc.collect()
        sys.modules["drjit"].flush_malloc_cache()
        _tidied = time.monotonic()


def keep(packed: bytes, chunk: int, answers: Sequence[Answered]) -> None:
    """Write the answers of a chunk's points."""
    job = _unpacked(packed)
    store = job.store
    store.write(chunk, [_fitting(answer, store.layout) for answer in answers])


def _fitting(answer: Answered, layout: Layout) -> Mapping[str, Array] | str:
    """The arrays of a point, or why it has none that are like those of the others."""
    if isinstance(answer, str):
        return answer
    for name in layout.keys() | answer.keys():
        if name not in answer or name not in layout:
            return f"{name}: is found at {'some points' if name in answer else 'other points'} only"
        if answer[name][1].shape != layout[name].shape:
            return f"{name}: has the shape {answer[name][1].shape}, where others have {layout[name].shape}"
    return {name: array for name, (_, array) in answer.items()}


def _named(found: Any) -> dict[str, tuple[tuple[str, ...], Array]]:
    """The answer of a question, checked, with names for dimensions that have none."""
    if not isinstance(found, Mapping) or not found:
        raise InvalidInput(f"what: must return arrays by name, got {type(found).__name__}")
    return {str(name): _array(str(name), value) for name, value in found.items()}


def _array(name: str, value: Any) -> tuple[tuple[str, ...], Array]:
    dims: tuple[str, ...] | None = None
    if isinstance(value, tuple) and len(value) == 2 and _are_names(value[0]):
        dims, value = tuple(value[0]), value[1]
    array = np.asarray(value)
    if array.dtype.kind in "iub":  # which have no NaN
        array = array.astype(float)
    if array.dtype.kind not in "fc":
        raise InvalidInput(f"{name}: must be numbers, got {array.dtype}")
    dims = tuple(f"{name}_{n}" for n in range(array.ndim)) if dims is None else dims
    if len(dims) != array.ndim:
        raise InvalidInput(f"{name}: must have {len(dims)} dimensions, got an array of shape {array.shape}")
    return dims, array


def _are_names(value: Any) -> bool:
    return isinstance(value, tuple | list) and all(isinstance(dim, str) for dim in value)
