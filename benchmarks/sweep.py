"""Cost of sweeps beside what they compute, how they scale with workers, and what a scheduler of dask can bear.

    python benchmarks/sweep.py [--part overhead small workers scheduler store] [--load burn|sleep]

- overhead: 200 points of 100 ms by one worker, over a plain loop. Bound: 1.05.
- small: 10^5 points of 1 ms by one worker, over a plain loop of 2000 of them. Bound: 2.
- workers: 200 points of 100 ms by one worker, over two. Bound: 1.8.
- scheduler: processor time of a scheduler of dask for a task of a sweep that does nothing, with 2 and with 100 workers
  (in one process; their heartbeats count), and the bytes that a task sends.
- store: chunks, files and bytes of plans of up to 10^8 points, and the seconds and bytes that a chunk takes to write.

Engines are started and warm before they are timed; how long that takes is printed. Points of `burn` keep a core busy,
which needs as many free ones as there are workers (`taskset -c 0,1`); points of `sleep` wait, so that only what a sweep
adds depends on how busy the machine is.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rows import parsed

import velatura as vt
from velatura.sweeps import Plan, work
from velatura.sweeps.plan import versions
from velatura.sweeps.run import RATE
from velatura.sweeps.store import StoredVariable, create

BOUNDS = {"overhead": 1.05, "small": 2.0, "workers": 1.8}
TASKS, MANY = 5000, 100
TOTALS = (10**4, 10**6, 10**8)


def burn(stack: vt.Stack, seed: int, seconds: float) -> dict[str, float]:
    """Keeps a core busy."""
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass
    return {"x": float(seed)}


def sleep(stack: vt.Stack, seed: int, seconds: float) -> dict[str, float]:
    """Waits."""
    time.sleep(seconds)
    return {"x": float(seed)}


POINTS: dict[str, Callable[..., dict[str, float]]] = {"burn": burn, "sleep": sleep}


def space(count: int) -> vt.Space:
    """Points that differ."""
    vary = {"layer0_alpha": {"range": [0.01, 0.5]}, "layer0_rotation": {"range": [0, 90]}}
    return vt.Space(material="bare-gold", vary=vary, sampling="random", count=count)


@contextmanager
def cluster(workers: int) -> Iterator[Any]:
    """A client of a scheduler with workers, one thread each."""
    from distributed import Client, LocalCluster

    begin = time.perf_counter()
    at = "127.0.0.1:0"
    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=at) as made, Client(made) as client:
        with tempfile.TemporaryDirectory() as folder:
            vt.sweep(space(8), sleep, store=Path(folder, "warm.zarr"), executor=client, progress=quiet, seconds=0.01)
        print(f"  {workers} workers ready after {time.perf_counter() - begin:.1f} s")
        yield client


def quiet(done: int, total: int) -> None:
    """Shows nothing."""


def swept(client: Any, count: int, point: Any, seconds: float) -> float:
    """Seconds of a sweep."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        vt.sweep(space(count), point, store=Path(folder, "a.zarr"), executor=client, progress=quiet, seconds=seconds)
        return time.perf_counter() - begin


def looped(count: int, point: Any, seconds: float) -> float:
    """Seconds of a plain loop over the same stacks."""
    stacks, begin = vt.load("bare-gold"), time.perf_counter()
    rng = np.random.default_rng(0)
    for n in range(count):
        alpha, rotation = rng.random(2)
        point(stacks.replace(layer0_alpha=float(alpha), layer0_rotation=float(rotation)), n, seconds)
    return time.perf_counter() - begin


def overhead(point: Any) -> None:
    with cluster(1) as client:
        ratios = [swept(client, 200, point, 0.1) / looped(200, point, 0.1) for _ in range(3)]
    report("overhead", "of 200 points of 100 ms", float(np.median(ratios)))


def small(point: Any) -> None:
    with cluster(1) as client:
        found = swept(client, 100_000, point, 0.001) / (50 * looped(2000, point, 0.001))
    report("small", "of 10^5 points of 1 ms", found)


def workers(point: Any) -> None:
    with cluster(1) as client:
        alone = swept(client, 200, point, 0.1)
    with cluster(2) as client:
        report("workers", "of one worker over two, 200 points of 100 ms", alone / swept(client, 200, point, 0.1))


def report(part: str, of: str, ratio: float) -> None:
    """Print a ratio and its bound."""
    load = ", ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"{part}: {ratio:.3f} {of} (bound {BOUNDS[part]:g}; load {load} on {len(os.sched_getaffinity(0))} cores)")


# What a cluster has to bear ------------------------------------------------------------------------------------------


def nothing(packed: bytes, chunks: tuple[int, ...]) -> tuple[int, float]:
    """Has the arguments and the result of a task."""
    return len(chunks), 0.0


def scheduler(point: Any) -> None:
    import psutil
    from distributed import Client

    plan = Plan.from_dict({**space(10**8).to_dict(), "what": point, "options": {"seconds": 0.001}})
    layout = {"x": StoredVariable((), (), "<f8")}
    packed = work.Job(plan, Path("/shared/runs/coats.zarr"), layout, versions()).packed()
    print(f"scheduler: the job of a task has {len(packed)} bytes")
    for count in (2, MANY):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "scheduler.json")
            start = ["-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
            process = subprocess.Popen(
                [sys.executable, *start, "--scheduler-file", str(file)], stderr=subprocess.DEVNULL
            )
            others = subprocess.Popen([sys.executable, __file__, "--workers-of", str(file), "--count", str(count)])
            try:
                with Client(scheduler_file=str(file), timeout=60) as client:
                    client.wait_for_workers(count, timeout=120)
                    cpu = psutil.Process(process.pid).cpu_times
                    begin, idle = time.perf_counter(), sum(cpu()[:2])
                    time.sleep(5)
                    beats = (sum(cpu()[:2]) - idle) / (time.perf_counter() - begin)
                    executor, tasks, before = client.get_executor(pure=False), set[Any](), sum(cpu()[:2])
                    begin, left = time.perf_counter(), TASKS
                    import concurrent.futures

                    while left or tasks:
                        while left and len(tasks) < 2 * count:
                            tasks.add(executor.submit(nothing, packed, (left,)))
                            left -= 1
                        tasks -= concurrent.futures.wait(tasks, 1, concurrent.futures.FIRST_COMPLETED).done
                    seconds, used = time.perf_counter() - begin, sum(cpu()[:2]) - before
                    memory = psutil.Process(process.pid).memory_info().rss
                print(
                    f"  {count} workers: {1e3 * used / TASKS:.2f} ms of the scheduler's processor a task,"
                    f" {TASKS / seconds:.0f} tasks a second, {100 * beats:.1f} % of a core for heartbeats,"
                    f" {memory / 2**20:.0f} MiB"
                )
            finally:
                for each in (others, process):
                    each.kill()
                    each.wait()
    print(f"  a sweep ends at most {RATE} tasks a second")


async def serve(file: str, count: int) -> None:
    """Workers of one thread each, all in this process."""
    from distributed import Worker

    while not Path(file).exists():
        await asyncio.sleep(0.1)
    made = [Worker(scheduler_file=file, nthreads=1, memory_limit=None, dashboard=False) for _ in range(count)]
    await asyncio.gather(*made)
    await asyncio.Event().wait()


def store(point: Any) -> None:
    from velatura.sweeps.questions import lobes

    print("store: points  a chunk  chunks   files of variables  bytes of a file       data")
    answer = lobes(vt.load("coated-gold"), 0, cos_theta=[1.0, 0.5], model="belcour2018")
    layout = {name: StoredVariable.of(*array) for name, array in answer.items()}
    found = {name: array for name, (_, array) in answer.items()}
    for count in TOTALS:
        fields = {**space(count).to_dict(), "material": vt.load("coated-gold").to_dict(), "vary": {
            "layer0_alpha": {"range": [0.01, 0.5]}, "layer1_depth": {"range": [0, 1]}}}  # fmt: skip
        plan = Plan.from_dict({**fields, "what": "lobes", "options": {"cos_theta": [1, 0.5]}})
        with tempfile.TemporaryDirectory() as folder:
            made = create(Path(folder, "a.zarr"), plan, layout)
            rng, begin = np.random.default_rng(0), time.perf_counter()
            for chunk in range(10):
                noisy = [{name: x * rng.random(x.shape) for name, x in found.items()} for _ in made.points(chunk)]
                if not chunk:
                    begin = time.perf_counter()
                made.write(chunk, noisy)
            seconds = (time.perf_counter() - begin) / 10
            chunks, files = int(np.prod(made.grid)), Path(folder, "a.zarr").glob("*/[0-9]*")
            sizes = [file.stat().st_size for file in files if file.name.split(".")[0] == "1"]
            print(f"  {count:12d} {made.chunk[0]:8d} {chunks:7d} {chunks * len(sizes):9d} of {len(sizes)}"
                  f" {min(sizes):9d} to {max(sizes)} {chunks * sum(sizes) / 1e6:10.0f} MB,"
                  f" {1e3 * seconds:.0f} ms to write a chunk")  # fmt: skip


PARTS = {part.__name__: part for part in (overhead, small, workers, scheduler, store)}


def main() -> None:
    options = parsed(
        __doc__,
        part=(list(PARTS), "", PARTS),
        load=("burn", "what points do", POINTS),
        workers_of=(str, argparse.SUPPRESS),
        count=(int, argparse.SUPPRESS),
    )
    if options.workers_of:
        asyncio.run(serve(options.workers_of, options.count))
        return
    for part in options.part:
        PARTS[part](POINTS[options.load])


if __name__ == "__main__":
    main()
