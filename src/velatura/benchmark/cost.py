"""The cost of an evaluation, as a ratio to one of Mitsuba's `roughconductor` in runs that take turns."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.benchmark.candidates import Candidate, Factory, Plugin, asked, evenly, made
from velatura.benchmark.stacks import Case
from velatura.checks.probe import Probe
from velatura.errors import InvalidInput

Array = NDArray[np.floating]

POWER = 20  # of 2, pairs of a run
TURNS = 15  # runs of either


def median_cost(factory: Factory, cases: Iterable[Case]) -> float | None:
    """That over kinds of stacks, of the first of each that a candidate expresses; None for what is no plugin."""
    first: dict[str, tuple[Case, Candidate]] = {}
    for case in cases:
        if case.kind not in first:
            try:
                with asked(case):
                    candidate = made(factory(case))
            except InvalidInput:
                continue
            if candidate is not None:
                first[case.kind] = case, candidate
    found = [_cost(case, candidate) for case, candidate in first.values() if isinstance(candidate, Plugin)]
    return float(np.median(found)) if found else None


def _cost(case: Case, candidate: Plugin) -> float:
    """Ratio of the quickest runs of both compiled kernels on one thread."""
    metal = Plugin(kernel.load_dict({"type": "roughconductor", "distribution": "ggx", "alpha": 0.2}))
    run, yardstick = (_kernel(plugin.probe, case) for plugin in (candidate, metal))
    with kernel.threads_restored():
        kernel.use_threads(1)
        times = [(run(), yardstick()) for _ in range(TURNS)]
    mine, its = np.min(times, axis=0)
    return float(mine / its)


def _directions(case: Case) -> tuple[Array, Array]:
    """Pairs of the first direction, which comes from above, and others above by the cosine law."""
    u = evenly(POWER, 1)
    radius, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
    wo = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - u[:, 0])], axis=1)
    return np.tile(case.incident[0], (len(wo), 1)), wo


def _kernel(probe: Probe, case: Case) -> Callable[[], float]:
    """Returns a function that runs the kernel of a BSDF, and gives its milliseconds."""
    import drjit as dr

    wi, wo = _directions(case)

    @kernel.exclusive
    def run() -> float:
        si, direction = probe.interaction(wi), probe.vector(wo)
        dr.eval(si, direction)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
            dr.kernel_history_clear()
            dr.eval(probe.bsdf.eval(probe.context, si, direction))
            dr.sync_thread()
            return float(sum(each["execution_time"] for each in dr.kernel_history()))

    return run
