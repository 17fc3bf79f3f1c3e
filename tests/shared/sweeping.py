"""A sweep for tests: points of 20 ms, and a program that sweeps by an engine until it is killed."""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import velatura as vt

COUNT = 120
SPACE = vt.Space(
    material="bare-gold",
    vary={"layer0_alpha": {"range": [0.01, 0.5]}, "layer0_conductor": {"values": ["Au", "Cu"]}},
    sampling="sobol",
    count=COUNT,
)


def point(stack: vt.Stack, seed: int) -> dict[str, Any]:
    """Lobes, and random numbers; no answer for one in ten."""
    time.sleep(0.02)
    numbers = np.random.default_rng(seed).random(4)
    if numbers[0] < 0.1:
        raise ValueError("unlucky")
    found = vt.lobes(stack, [1.0, 0.5], model="belcour2018")
    return {"numbers": numbers, "energy": (("colour", "direction"), found.energy[0])}


def swept(store: Path, executor: Any, **options: Any) -> Any:
    """The sweep."""
    return vt.sweep(SPACE, point, store=store, executor=executor, **options)


@contextmanager
def pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes."""
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as executor:
        yield executor


def marked(store: Path) -> int:
    """How many chunks are done."""
    status = store / "status"
    return sum(name.name.isdigit() for name in status.iterdir()) if status.exists() else 0


def same(one: Any, other: Any) -> bool:
    """Whether two data sets are equal, bit by bit."""
    return set(one.variables) == set(other.variables) and all(
        one[name].dims == other[name].dims
        and one[name].dtype == other[name].dtype
        and one[name].values.tobytes() == other[name].values.tobytes()
        if one[name].dtype != object
        else [str(x) for x in one[name].values.flat] == [str(x) for x in other[name].values.flat]
        for name in one.variables
    )


def main() -> None:
    """Sweep into a store, by a pool or the scheduler at an address."""
    store, executor = Path(sys.argv[1]), sys.argv[2]
    if executor == "pool":
        with pool(1) as processes:
            swept(store, processes)
    else:
        swept(store, executor)
