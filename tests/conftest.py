"""Fixtures that unit and system tests share."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
import quick_kernels
from hypothesis import settings

from velatura import kernel
from velatura.cli import main

# Draw the same examples every time, however long a busy machine takes over them
settings.register_profile("velatura", deadline=None, derandomize=True)
settings.load_profile("velatura")

# jsonschema reads a grammar for the format of addresses, for 2 s, if this is there; no test asks it for formats
sys.modules.setdefault("rfc3987_syntax", None)

Run = Callable[..., tuple[int, str, str]]


def pytest_configure(config: pytest.Config) -> None:
    if config.pluginmanager.hasplugin("cacheprovider"):
        quick_kernels.compile_quickly(Path(config.cache.mkdir("kernels")))


def pytest_collection_finish() -> None:
    """Keep the garbage collector from what stays until the end, modules and thousands of tests, and have it look at the
    rest less often, of which next to nothing lies in circles."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)


@pytest.fixture(scope="module")
def one_thread() -> Iterator[None]:
    """One thread of Dr.Jit, since others that wait for the next of many small kernels take time from other workers."""
    with kernel.threads_restored():
        kernel.use_threads(1)
        yield


@pytest.fixture
def few_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Laws by a quarter of the samples in a quarter of the cells, in a third of the time: errors of some percent still
    show, and the rate of false alarms is the same."""
    from velatura.checks import evidence, grid, laws, probe

    for module in (evidence, laws):
        monkeypatch.setattr(module, "SAMPLES", 2**14)
        monkeypatch.setattr(module, "PILOT", 2**12)
    monkeypatch.setattr(grid, "CELLS", 16)
    monkeypatch.setattr(probe, "_BATCH", 2**14)


@pytest.fixture
def coarse_solutions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Materials solved by a quarter of the samples on half of the nodes, for tests that compare two programs which both
    have the same solution, however near the truth that is."""
    from velatura.model.solved import equivalent_roughness, grid, reciprocal_balance, solve, statistics, wide_light
    from velatura.model.solved.energies import energies

    monkeypatch.setattr(energies, "NODES", 12)
    monkeypatch.setattr(solve, "SAMPLES", 89)
    monkeypatch.setattr(statistics, "energies", partial(energies.energies, samples=89))
    monkeypatch.setattr(solve, "NORMALS", {True: 377, False: 233})
    monkeypatch.setattr(solve, "BETWEEN", {True: 34, False: 34})
    monkeypatch.setattr(solve, "EVENLY", 89)
    monkeypatch.setattr(wide_light, "EVENLY", 55)
    monkeypatch.setattr(reciprocal_balance, "SAMPLES", {0: 89})
    monkeypatch.setattr(equivalent_roughness, "SAMPLES", 4 * 89)
    monkeypatch.setattr(grid, "COSINES", 16)
    monkeypatch.setattr(grid, "AZIMUTHS", {False: 8, True: 8})


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs the command line in this process: exit status, standard output, standard error."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["velatura", *arguments])
        with pytest.raises(SystemExit) as exit:
            main()
        out, err = capsys.readouterr()
        return int(exit.value.code or 0), out, err

    return run
