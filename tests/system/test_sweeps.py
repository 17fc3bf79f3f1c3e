"""Sweeps with real parts: pools of processes, a scheduler of dask with workers, and kills in the middle.

Expected everywhere: data that are equal, bit by bit, to those of one thread that nothing interrupted.
"""

from __future__ import annotations

import contextlib
import os
import re
import runpy
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from interrupts import hear
from sweeping import COUNT, marked, point, pool, same, swept

import velatura as vt

SHARED = str(Path(__file__).parents[1] / "shared")
QUIET = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": SHARED}
FEW = 5  # chunks that are done before something is killed
PATIENCE = 120.0  # seconds
CONSTANTS = [1.577, 0.404, 1.70, 1.94]  # of the tutorial's fit


def wait_for(condition: Callable[[], object]) -> Any:
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return found


def killed_client(store: Path, executor: str) -> None:
    """Begin the sweep in a process, and kill that with all its children."""
    client = subprocess.Popen(
        [sys.executable, "-c", "from sweeping import main; main()", str(store), executor],
        env=QUIET,
        start_new_session=True,
    )
    wait_for(lambda: marked(store) >= FEW)
    os.killpg(client.pid, signal.SIGKILL)
    assert client.wait() == -signal.SIGKILL
    assert marked(store) < COUNT / 2


class Killer:
    """Kills a process once, when half of the points are done."""

    def __init__(self, pid: int) -> None:
        self.pid: int | None = pid

    def __call__(self, done: int, total: int) -> None:
        if self.pid and done >= total / 2:
            os.kill(self.pid, signal.SIGKILL)
            self.pid = None


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """By one thread, from the beginning to the end."""
    with ThreadPoolExecutor(1) as executor:
        return swept(tmp_path_factory.mktemp("expected") / "points.zarr", executor).load()


@contextlib.contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """The address of a scheduler, and its process before those of workers."""
    started = list[subprocess.Popen[bytes]]()

    def start(*arguments: str) -> None:
        with open(folder / f"{len(started)}.txt", "w") as log:
            command = [sys.executable, "-m", "distributed.cli.dask_" + arguments[0], *arguments[1:]]
            started.append(subprocess.Popen(command, env=QUIET, cwd=folder, stdout=log, stderr=log))

    def address() -> str | None:
        text = re.search(r"Scheduler at:\s+(tcp://\S+)", (folder / "0.txt").read_text())
        return text and text[1]

    try:
        start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        at = wait_for(address)
        for _ in range(workers):
            start("worker", at, "--no-nanny", "--nthreads", "1", "--no-dashboard")
        yield at, started
    finally:
        for process in started:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """The address of a scheduler, and two workers."""
    with cluster(tmp_path_factory.mktemp("dask"), 2) as (address, (_, *workers)):
        yield address, workers


def test_points_without_an_answer_have_their_reason(expected: Any) -> None:
    failed = expected.status.values == 0
    assert 0 < failed.sum() < 40 and set(expected.status.values[~failed]) == {1}
    assert set(expected.reason.values[failed]) == {"ValueError: unlucky"}
    assert np.isnan(expected.numbers.values[failed]).all() and np.isnan(expected.energy.values[failed]).all()
    for n in (0, COUNT - 1):
        values = {name: expected[name].values[n] for name in ("layer0_alpha", "layer0_conductor")}
        again = point(vt.load("bare-gold").replace(**values), int(expected.seed[n]))
        assert np.array_equal(again["numbers"], expected.numbers[n])
        assert np.array_equal(again["energy"][1], expected.energy[n])


def test_a_pool_goes_on_after_kills_of_client_and_worker(expected: Any, tmp_path: Path) -> None:
    store = tmp_path / "points.zarr"
    killed_client(store, "pool")
    with pool(1) as executor:
        pid = executor.submit(os.getpid).result()
        with pytest.raises(vt.VelaturaError, match=r"points\.zarr: the executor broke down .* goes on from there"):
            swept(store, executor, progress=Killer(pid))
    assert marked(store) < COUNT / 2
    with pool(1) as executor:
        assert same(swept(store, executor), expected)


def test_dask_goes_on_after_kills_of_client_and_worker(
    expected: Any, dask: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path
) -> None:
    """Expected: the work of a killed worker is done by the other one."""
    (address, (worker, _)), store = dask, tmp_path / "points.zarr"
    killed_client(store, address)
    assert same(swept(store, address, progress=Killer(worker.pid)), expected)
    assert worker.wait() == -signal.SIGKILL


def test_a_scheduler_that_dies_ends_the_sweep_in_one_line(
    expected: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Expected: an error that says how to go on, nothing printed, no worker left, and by other processes equal data."""
    store = tmp_path / "points.zarr"
    with cluster(tmp_path, 1) as (address, (scheduler, worker)):
        with pytest.raises(vt.VelaturaError, match=r"points\.zarr: the executor broke down .* goes on from there"):
            swept(store, address, progress=Killer(scheduler.pid))
        assert worker.wait(timeout=PATIENCE) == 0
        with pytest.raises(vt.InvalidInput, match="no scheduler of dask answers there"):
            swept(store, address)
    assert capfd.readouterr() == ("", "")
    assert COUNT / 2 <= 5 * marked(store) < COUNT
    with ThreadPoolExecutor(1) as executor:
        assert same(swept(store, executor), expected)


def test_a_client_that_has_no_scheduler_ends_the_sweep_in_one_line(tmp_path: Path) -> None:
    """Expected: before the first point as well."""
    from distributed import Client

    with cluster(tmp_path, 0) as (address, (scheduler,)), Client(address, timeout=2) as client:
        scheduler.kill()
        with pytest.raises(vt.VelaturaError, match=r"points\.zarr: the executor .* before a point was stored"):
            swept(tmp_path / "points.zarr", client)
    assert not (tmp_path / "points.zarr").exists()


def test_an_interrupt_ends_in_one_line_and_a_scheduler_goes_on(
    dask: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path
) -> None:
    """Expected: of Ctrl-C, which a terminal sends to all processes, one line; then the rest of a grid by dask."""
    plan, store = tmp_path / "plan.yaml", tmp_path / "grid.zarr"
    plan.write_text(
        "material: bare-gold\n"
        "vary:\n"
        "  layer0_alpha: {range: [0.01, 0.5], steps: 40}\n"
        "  layer0_rotation: {values: [0, 30, 60]}\n"
        "what: lobes\n"
        "options: {cos_theta: [1, 0.5], model: belcour2018}\n"
        "chunk: 1\n"
    )
    command = [sys.executable, "-m", "velatura", "sweep", str(plan), "-o", str(store)]
    process = subprocess.Popen(
        [*command, "--workers", "1"], env=QUIET, start_new_session=True, preexec_fn=hear, stderr=subprocess.PIPE
    )
    wait_for((store / "status" / "0.2").exists)
    os.killpg(process.pid, signal.SIGINT)
    assert process.communicate(timeout=PATIENCE)[1] == b"velatura: interrupted\n"
    assert process.returncode == 130

    again = subprocess.run([*command, "--scheduler", dask[0]], env=QUIET, capture_output=True, text=True)
    assert (again.returncode, again.stderr) == (0, "")
    assert re.fullmatch(r"\S+grid\.zarr: 120 points, \d+\.\d s\n", again.stdout)
    import xarray

    found = xarray.open_zarr(store)
    assert found.energy.dims == ("layer0_alpha", "layer0_rotation", "interface", "colour", "direction")
    alone = found.sel(layer0_alpha=0.5, layer0_rotation=30)
    stack = vt.load("bare-gold").replace(layer0_alpha=0.5, layer0_rotation=30)
    assert np.array_equal(alone.energy, np.array(vt.lobes(stack, [1, 0.5], model="belcour2018").energy))


def test_a_point_that_ends_its_process_is_recorded(tmp_path: Path) -> None:
    """Expected: a reason in place of numbers, and those of all other points, by new processes of dask."""
    import dask
    import distributed  # noqa: F401  (has the configuration that is changed)

    def deadly(stack: vt.Stack, seed: int) -> dict[str, float]:
        if stack.flat()["layer0_alpha_u"] == 0.1:
            os.kill(os.getpid(), signal.SIGKILL)
        return {"x": 1.0}

    space = vt.Space(material="bare-gold", vary={"layer0_alpha": {"values": [0.1, 0.2, 0.3]}})
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}):
        found = vt.sweep(space, deadly, store=tmp_path / "a.zarr", workers=1, chunk=3)
    assert found.status.values.tolist() == [0, 1, 1]
    assert found.reason.values[0] == "the process that looked at it ended"
    assert np.isnan(found.x.values[0]) and found.x.values[1:].tolist() == [1, 1]


@pytest.fixture
def left(monkeypatch: pytest.MonkeyPatch) -> None:
    """No nanny of dask starts a worker again, as on a busy machine, where it is late."""
    import distributed

    async def leave(self: distributed.Nanny, exitcode: int) -> None: ...

    monkeypatch.setattr(distributed.Nanny, "_on_worker_exit", leave)


def swept_with_a_kill(folder: Path, alpha: float = 0.3) -> Any:
    """Four points, of which one ends its process when it is first looked at."""
    killed = folder / "killed"

    def deadly(stack: vt.Stack, seed: int) -> dict[str, float]:
        if stack.flat()["layer0_alpha_u"] == alpha and not killed.exists():
            killed.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return {"x": 1.0}

    space = vt.Space(material="bare-gold", vary={"layer0_alpha": {"values": [0.1, 0.2, 0.3, 0.4]}})
    found = vt.sweep(space, deadly, store=folder / "a.zarr", workers=1, chunk=1)
    assert killed.exists()
    return found.x.values.tolist()


@pytest.mark.usefixtures("left")
def test_a_process_that_dask_gives_up_is_started_again(tmp_path: Path) -> None:
    import dask
    import distributed  # noqa: F401  (has the configuration that is changed)

    with dask.config.set({"distributed.deploy.lost-worker-timeout": "1s"}):
        assert swept_with_a_kill(tmp_path) == [1.0] * 4


@pytest.mark.usefixtures("left")
@pytest.mark.parametrize(("alpha", "failures"), [(0.1, 3), (0.3, 0)])
def test_a_point_that_is_looked_at_alone_does_not_wait_for_ever(
    alpha: float, failures: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: an error where no process starts again; by the first point, or by one that has ended its process."""
    import dask
    import distributed  # noqa: F401  (has the configuration that is changed)

    from velatura.sweeps import engines

    monkeypatch.setattr(engines, "ABSENT", 1.0)
    where = "before a point was stored" if alpha == 0.1 else r"with \d of 4 points stored"
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": failures}),
        pytest.raises(vt.VelaturaError, match=rf"a\.zarr: the executor broke down .* {where}"),
    ):
        swept_with_a_kill(tmp_path, alpha)


@pytest.mark.usefixtures("left")
def test_a_sweep_without_processes_ends_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: an error where no process starts again; then the rest by the same call."""
    from velatura.sweeps import engines

    with monkeypatch.context() as patched:
        patched.setattr(engines, "ABSENT", 1.0)
        with pytest.raises(vt.VelaturaError, match=r"a\.zarr: the executor broke down .* with \d of 4 points stored"):
            swept_with_a_kill(tmp_path)
    assert swept_with_a_kill(tmp_path) == [1.0] * 4


def test_jobs_of_submitit_are_an_executor(tmp_path: Path) -> None:
    """Expected: its jobs, processes here as they are jobs of SLURM elsewhere, fill the store."""
    import submitit

    executor = submitit.LocalExecutor(folder=tmp_path / "jobs")
    executor.update_parameters(timeout_min=1)
    space = vt.Space(material="bare-gold", vary={"layer0_alpha": {"values": [0.1, 0.2]}})
    options: dict[str, Any] = {"cos_theta": [1.0], "model": "belcour2018"}
    found = vt.sweep(space, "albedo", store=tmp_path / "a.zarr", executor=executor, workers=1, chunk=2, **options)
    assert found.status.values.tolist() == [1, 1] and (found.reflected > 0.3).all()


def test_the_tutorial_fits_a_slice_of_its_map(tmp_path: Path) -> None:
    """Expected: of 8 by 8 coats, the constants that 100 by 100 give, within 5 %."""
    script = runpy.run_path(str(Path(__file__).parents[2] / "docs" / "examples" / "coats.py"))
    with ThreadPoolExecutor(1) as executor:
        alpha = script["apparent"](script["coats"](tmp_path / "coats.zarr", steps=8, executor=executor))
    constants, rest = script["fitted"](alpha)
    assert constants == pytest.approx(CONSTANTS, rel=0.05)
    assert float(abs(rest).mean()) < 0.03
