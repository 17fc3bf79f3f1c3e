"""Engines: what runs tasks, dask or any executor of the style of `concurrent.futures`."""

from __future__ import annotations

import concurrent.futures
import contextlib
import functools
import gc
import logging
import os
import signal
import time
from collections.abc import Callable, Collection, Iterator
from multiprocessing import resource_tracker
from typing import Any

from velatura.errors import InvalidInput

REFRESH = 1.0  # seconds after which newly joined workers are counted
POLL = 0.05  # seconds between looks at tasks that do not report their end
PATIENCE = 10  # seconds for a scheduler to answer
START = 60  # seconds for a process of this machine to start
ABSENT = 2 * START  # seconds without any process, after which a sweep on this machine ends


#: Errors of an engine that runs no more: of its own, and of tasks that it takes no more care of.
BREAKDOWNS = (concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError)


class Engine:
    """Runs tasks; raises one of `BREAKDOWNS` where it cannot.

    Args:
        submit: of an executor; returns what has `done`, `result` and `cancel`.
        workers: how many tasks run at once.
        fatal: errors of tasks that end the processes that run them.
        tend: called while tasks run; starts processes that are lost.
    """

    def __init__(
        self,
        submit: Callable[..., Any],
        workers: Callable[[], int],
        fatal: tuple[type[BaseException], ...] = (),
        tend: Callable[[], None] = lambda: None,
    ) -> None:
        self.submit, self.fatal, self._tend = submit, fatal, tend
        self._workers, self._counted, self._looked = workers, 0, -REFRESH

    @property
    def workers(self) -> int:
        """How many tasks run at once, as it was a moment ago."""
        if time.monotonic() - self._looked >= REFRESH:
            self._counted, self._looked = max(self._workers(), 1), time.monotonic()
        return self._counted

    def result(self, task: Any) -> Any:
        """The result of a task, once it has ended."""
        while not self.ended((task,)):
            pass
        return task.result()

    def ended(self, tasks: Collection[Any]) -> list[Any]:
        """Tasks that have ended, after a wait for the first one, not longer than `REFRESH`."""
        self._tend()
        if all(isinstance(task, concurrent.futures.Future) for task in tasks):
            first = concurrent.futures.FIRST_COMPLETED
            return list(concurrent.futures.wait(tasks, REFRESH, first).done)
        found = [task for task in tasks if task.done()]
        if not found:
            time.sleep(POLL)
        return found


@contextlib.contextmanager
def engine(executor: Any, workers: int | None) -> Iterator[Engine]:
    """The engine that an executor, a client of dask, the address of a scheduler, or None stands for.

    Raises:
        InvalidInput: none of these, or no scheduler answers.
    """
    if executor is None:
        count = workers or _cores()
        with _local(count) as client:
            yield _of_client(client, _started_again(client.cluster, count))
    elif isinstance(executor, str):
        with _at(executor) as client:
            yield _of_client(client)
    elif hasattr(executor, "get_executor"):
        yield _of_client(executor)
    elif hasattr(executor, "submit"):
        count = workers or getattr(executor, "_max_workers", None) or _cores()
        yield Engine(executor.submit, lambda: count)
    else:
        raise InvalidInput("executor: must be an executor, a client of dask, or the address of a scheduler")


def _cores() -> int:
    """Processors that this process may use, of all where the system has no such limit."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def _local(workers: int) -> Iterator[Any]:
    """Processes on this machine."""
    from distributed import Client, LocalCluster

    with contextlib.ExitStack() as stack:
        stack.callback(gc.collect)  # semaphores of its processes, which would be reported as leaked
        with _interrupts_wait():
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=None,
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
                death_timeout=START,
            )
            stack.enter_context(cluster)
        yield stack.enter_context(Client(cluster))


def _started_again(cluster: Any, count: int) -> Callable[[], None]:
    """Starts processes that the cluster has given up: it does so for good with those that a busy machine starts again
    too late (`distributed.deploy.lost-worker-timeout`).

    What is returned raises BrokenExecutor once there has been none for `ABSENT` seconds.
    """
    seen = time.monotonic()

    def tend() -> None:
        nonlocal seen
        present = len(cluster.scheduler_info["workers"])
        if present:
            seen = time.monotonic()
        elif time.monotonic() > seen + ABSENT:
            raise concurrent.futures.BrokenExecutor(f"no process has started for {ABSENT} s")
        if present < count:
            cluster.scale(count)

    return tend


@contextlib.contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Hold Ctrl-C back while the block runs, and from threads and processes that begin in it for good.

    It reaches all processes of a terminal; this one ends the others. Windows cannot hold it back.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # which it would itself let through, once it had begun
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _at(address: str) -> Iterator[Any]:
    from distributed import Client

    with _silent(logging.getLogger("distributed.client")):
        try:
            client = Client(address, timeout=PATIENCE)
        except (OSError, ValueError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InvalidInput(f"{address}: no scheduler of dask answers there ({reason})") from None
        with client:
            yield client


@contextlib.contextmanager
def _silent(logger: logging.Logger) -> Iterator[None]:
    """Nothing is logged in the block, such as the end of a scheduler with its stack of calls."""
    before = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(before)


def _of_client(client: Any, tend: Callable[[], None] = lambda: None) -> Engine:
    from distributed.scheduler import KilledWorker

    executor = client.get_executor(pure=False)

    @_or_broken
    def submit(*task: Any) -> Any:
        return executor.submit(*task)

    @_or_broken
    def workers() -> int:
        return sum(client.nthreads().values())

    return Engine(submit, workers, (KilledWorker,), tend)


def _or_broken(asked: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which raises BrokenExecutor in place of the errors of a client that has lost its scheduler.

    They are of many classes, some of them plain `Exception`.
    """

    @functools.wraps(asked)
    def ask(*arguments: Any) -> Any:
        try:
            return asked(*arguments)
        except Exception as error:
            raise concurrent.futures.BrokenExecutor(str(error)) from None

    return ask
