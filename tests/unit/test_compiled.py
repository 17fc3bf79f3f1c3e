"""Functions over many samples: the same by NumPy and by a kernel; and results that are kept."""

import gc
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel, ops
from velatura.model import named
from velatura.model.context import Context
from velatura.model.rough_interface import KEPT
from velatura.model.solved import reciprocal_balance
from velatura.model.solved.solve import solve
from velatura.model.variance import variance_kind
from velatura.renderer import compiled
from velatura.renderer.compiled import Alike, Colour, Deposit, Found
from velatura.renderer.directional_grid import Curves
from velatura.renderer.kept import Kept
from velatura.stack import Interface, Material, Stack


@dataclass(frozen=True)
class Wave:
    size: float
    colour: np.ndarray
    where: object = None

    def at(self, x: Any) -> Any:
        return self.size * ops.cos(x)


def function(sources: Any, samples: Any, numbers: Any) -> Found:
    (p,), (u,), (wave, at, shift, one) = sources, samples, numbers
    first = ops.floor(p * u * (ROWS - 3)) - 1
    light = Deposit(first, [p, u, 0.5 * p, 0.25 * u], [p, at(p * u), u], [1.0, p])
    return Found([wave.colour * p * u, ops.log_gamma(1 + u)], [at(p * u) + shift, one * p], [light])


def numbers(where: object = None) -> Any:
    wave = Wave(0.7, np.array([0.2, 0.5, 0.9])[:, None, None], where)
    return [wave, wave.at, 0.25, 1.0]


def by_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "MANY", -1)
    monkeypatch.setattr(compiled, "LEAST", 0)


def either_way(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """By NumPy, then by kernels."""
    monkeypatch.setattr(compiled, "LEAST", 1 << 60)
    yield
    by_kernels(monkeypatch)
    yield


ROWS = 9
SOURCES = [np.linspace(0.1, 1.0, 7)]
SAMPLES = [np.linspace(0.0, 1.0, 5)]


def test_kernels_and_numpy_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    for count, shared in ((7, compiled.SHARED), (64, compiled.SHARED), (64, 0), (1, 0)):
        monkeypatch.setattr(compiled, "SHARED", shared)
        sources = [np.linspace(0.1, 1.0, count)]
        sums, largest, (light,) = compiled.over(function, sources, SAMPLES, numbers(), ROWS)
        with monkeypatch.context() as patched:
            by_kernels(patched)
            found = compiled.over(function, sources, SAMPLES, numbers(), ROWS)
        assert sums.shape == (4, count) and largest.shape == (2, count) and light.shape == (3, 2, ROWS + 1, count)
        for plain, fused in zip([sums, largest, light], [*found[:2], *found[2]]):
            assert fused == pytest.approx(plain, abs=1e-12)
    product = sources[0][:, None] * SAMPLES[0]
    assert largest[0] == pytest.approx((0.7 * np.cos(product) + 0.25).max(axis=1), abs=1e-15)
    assert sums[2] == pytest.approx(0.9 * product.sum(axis=1), abs=1e-14)


def test_one_thread_takes_as_many_sources_as_dr_jit_s_vectors_hold() -> None:
    import drjit as dr

    vt.bsdf(vt.load("coated-gold"))
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.eval(dr.arange(dr.llvm.UInt32, 3) * 5)
        written = dr.kernel_history([dr.KernelType.JIT])[-1]["ir"].getvalue()
    assert f"<{kernel.vector_width()} x i32>" in written


def test_kernels_are_released_once_many_are_unused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless another thread works with Mitsuba; and then kernels give the same as before."""
    by_kernels(monkeypatch)
    monkeypatch.setattr(compiled, "UNUSED", 1)
    monkeypatch.setattr(compiled, "KERNELS", 1)
    compiled._kernels.clear()
    (sums, *_), _ = (compiled.over(function, SOURCES, SAMPLES, numbers(where), ROWS) for where in (None, "elsewhere"))
    with ThreadPoolExecutor(1) as other:
        with kernel.exclusive:
            other.submit(compiled.release_kernels).result()
        assert len(compiled._kernels) == 1
        other.submit(compiled.release_kernels).result()
    assert not compiled._kernels
    assert compiled.over(function, SOURCES, SAMPLES, numbers(), ROWS)[0] == pytest.approx(sums, abs=0)


def read(sources: Any, samples: Any, numbers: Any) -> Found:
    (x, t), (u,), (table, colour) = sources, samples, numbers
    first, second, third, last = table((x * u, t * u, u * u))
    return Found([colour(first, second, third)], [last])


def test_kernels_read_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    shape = 5, 4
    table = Curves(np.random.default_rng(3).random((*shape, 4)), shape)
    given = table, Colour(np.ones((3, 1, 1)))
    sources = [np.linspace(0.1, 1.0, 7), np.linspace(0.9, 0.0, 7)]
    sums, largest, _ = compiled.over(read, sources, SAMPLES, given)
    by_kernels(monkeypatch)
    for fused, plain in zip(compiled.over(read, sources, SAMPLES, given), (sums, largest)):
        assert fused == pytest.approx(plain, abs=1e-12)
    # Samples of the last source lie along the first azimuth, at the nodes
    assert largest[0, -1] == pytest.approx(table.data[:, 0, 3].max(), abs=1e-12)


def test_light_falls_on_its_rows() -> None:
    _, _, (light,) = compiled.over(function, SOURCES, SAMPLES, numbers(), ROWS)
    wanted = np.zeros((ROWS + 1, len(SOURCES[0])))
    for k, p in enumerate(SOURCES[0]):
        for u in SAMPLES[0]:
            first = int(np.floor(p * u * (ROWS - 3))) - 1
            for j, share in enumerate((p, u, 0.5 * p, 0.25 * u)):
                wanted[first + j, k] += share * u * p  # number -1 is the last one
    assert light[2, 1] == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize("kernels", [False, True])
def test_lights_that_are_alike_fall_as_if_each_were_by_itself(kernels: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    def deposit(light: Any) -> Deposit:
        place, x = light
        return Deposit(ops.floor(place * (ROWS - 3)) - 1, [x, 0.5 * x, x * x, 1.0], [x, place], [1.0, x, place])

    def grouped(sources: Any, samples: Any, numbers: Any) -> Found:
        (p,), (u,) = sources, samples
        return Found([p], [], [deposit([u, p]), Alike([[p * u, u], [u, 0.5], [p * u * u, p + u]], deposit)])

    def each(sources: Any, samples: Any, numbers: Any) -> Found:
        (p,), (u,) = sources, samples
        return Found([p], [], [*map(deposit, ([u, p], [p * u, u], [u, 0.5], [p * u * u, p + u]))])

    truth = compiled.over(each, SOURCES, SAMPLES, [], ROWS)
    if kernels:
        by_kernels(monkeypatch)
    _, _, lights = compiled.over(grouped, SOURCES, SAMPLES, [], ROWS)
    assert len(lights) == 4
    for light, wanted in zip(lights, truth[2]):
        assert light == pytest.approx(wanted, abs=1e-13)


def test_kernels_that_read_many_numbers_are_never_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    by_kernels(monkeypatch)
    monkeypatch.setattr(compiled, "LONG", 2)
    monkeypatch.setattr(compiled, "_compiled", lambda *_: pytest.fail("a kernel is launched"))
    assert compiled.over(function, SOURCES, SAMPLES, numbers(), ROWS)[0].shape == (4, 7)


def test_objects_that_no_kernel_reads_run_by_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise AssertionError

    by_kernels(monkeypatch)
    monkeypatch.setattr(compiled, "_compiled", refused)
    sums, _, _ = compiled.over(function, SOURCES, SAMPLES, numbers(object()), ROWS)
    assert sums.shape == (4, 7)


def test_kernels_that_are_kept_on_disk_are_used_at_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    compiled_by: list[Any] = []
    monkeypatch.setenv("DRJIT_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiled, "LEAST", 0)
    original = compiled._compiled

    def noted(*values: Any) -> Any:
        compiled_by.append(values[1])
        return original(*values)

    monkeypatch.setattr(compiled, "_compiled", noted)
    for many in (1 << 60, -1, 1 << 60):
        monkeypatch.setattr(compiled, "MANY", many)
        for memory in (compiled._mark.cache_clear, compiled._kernels.clear, compiled._asked.clear):
            memory()
        compiled.over(function, SOURCES, SAMPLES, numbers(), ROWS)
    first, second = compiled_by
    assert first == second and [*tmp_path.iterdir()] == [compiled._mark(first)]
    compiled._mark.cache_clear()


def test_kernels_are_used_at_once_where_results_must_not_depend_on_the_past(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("DRJIT_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiled, "LEAST", 0)
    monkeypatch.setattr(compiled, "_mark", lambda kind: tmp_path / "none")
    plain: list[int] = []
    original = compiled._plain

    def counted(function: Any, sources: Any, *others: Any) -> Any:
        plain.append(len(sources[0]))
        return original(function, sources, *others)

    monkeypatch.setattr(compiled, "_plain", counted)
    for memory in (compiled._kernels.clear, compiled._asked.clear):
        memory()
    with kernel.compiled_first():
        found = [compiled.over(function, SOURCES, SAMPLES, numbers(), ROWS) for _ in range(3)]
    assert plain == []
    assert len({(sums.tobytes(), largest.tobytes(), light.tobytes()) for sums, largest, (light,) in found}) == 1


def test_garbage_waits_until_a_kernel_is_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rationale: Dr.Jit ended the process where an array of NumPy's in a circle was freed while it recorded."""
    import drjit as dr

    by_kernels(monkeypatch)
    arrays = [dr.llvm.Float64(np.arange(1000.0)) for _ in range(20)]

    def littering(sources: Any, *given: Any) -> Found:
        while arrays and not isinstance(sources[0], np.ndarray):
            circle: list[Any] = [arrays.pop()]
            circle.append(circle)
        return function(sources, *given)

    thresholds = gc.get_threshold()
    gc.set_threshold(1)
    try:
        compiled.over(littering, SOURCES, SAMPLES, numbers(), ROWS)
    finally:
        gc.set_threshold(*thresholds)


LAUNCHES = """
import sys, threading, time
sys.setswitchinterval(1e-5)
sys.path.insert(0, sys.argv[1])
import pytest
from test_compiled import SAMPLES, SOURCES, by_kernels, compiled, function, kernel, numbers

by_kernels(pytest.MonkeyPatch())
compiled.over(function, SOURCES, SAMPLES, numbers(), 8)
end = time.monotonic() + 2

def repeat(work):
    while time.monotonic() < end:
        work()

launch = lambda: compiled.over(function, SOURCES, SAMPLES, numbers(), 8)
threads = [threading.Thread(target=repeat, args=[work]) for work in (launch, launch, kernel.return_memory)]
for thread in threads: thread.start()
for thread in threads: thread.join()
"""


def test_threads_that_launch_kernels_and_return_memory_do_not_wait_for_ever() -> None:
    """Rationale: one had Dr.Jit's lock and waited for Python's, the other had Python's and waited for Dr.Jit's."""
    command = [sys.executable, "-c", LAUNCHES, str(Path(__file__).parent)]
    subprocess.run(command, check=True, timeout=120)


def test_another_number_or_address_needs_no_other_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    import drjit as dr

    def kernels(shift: float, place: int) -> set[Any]:
        held = np.empty(16 + SOURCES[0].size)[place : place + SOURCES[0].size]
        held[:] = SOURCES[0]
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            compiled.over(function, [held], SAMPLES, [*numbers()[:2], shift, 1.0], ROWS)
            return {each["hash"] for each in dr.kernel_history([dr.KernelType.JIT])}

    vt.bsdf(vt.load("coated-gold"))
    by_kernels(monkeypatch)
    first = kernels(0.3, 0)
    assert first and all(kernels(0.6, place) == first for place in range(9))


def test_lobes_are_the_same_by_numpy_and_by_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    stacks = [vt.load(name) for name in ("coated-gold", "pearl-lacquer", "frosted-glass")]
    found = []
    for _ in either_way(monkeypatch):
        KEPT.clear()
        lobes = [vt.lobes(stack, [1.0, 0.5, 0.1], 0.3) for stack in stacks]
        found.append([(each.energy, each.alpha) for each in lobes])
    for (energy, alpha), (compiled_energy, compiled_alpha) in zip(*found):
        assert np.array(compiled_energy) == pytest.approx(np.array(energy), abs=1e-12)
        assert np.array(compiled_alpha) == pytest.approx(np.array(alpha), abs=1e-9)


def test_the_symmetric_form_is_the_same_by_numpy_and_by_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where next to nothing is reflected, roots have the error of rounding beside it: 1e-8."""
    glass = Stack([Interface(eta=1.5, alpha=0.2)])
    brushed = Stack([Interface(eta=1.5, alpha=0.1), Interface(alpha=(0.1, 0.3), eta=0.2, k=3.0)])
    monkeypatch.setattr(reciprocal_balance, "SAMPLES", {0: 64})
    found = []
    for _ in either_way(monkeypatch):
        for stack in (glass, brushed):
            material = Material.of(stack).solid()
            body = solve(material, named("velatura", form="symmetric"), variance_kind(material), Context())
            x, y, z = np.array([-0.6, 0.0, -0.4]), np.array([0.0, 0.6, 0.0]), np.array([0.8, 0.8, -0.9])
            found.append(np.array([*body.eval_pdf((0 * x + 0.6, 0 * x, 0 * x + 0.8), (x, y, z))[0]]))
    for plain, fused in zip(found[:2], found[2:]):
        assert np.any(plain > 0.1) and fused == pytest.approx(plain, abs=1e-7)


def test_what_was_asked_for_last_is_kept_up_to_a_size() -> None:
    made = []

    def ask(kept: Kept, key: int) -> np.ndarray:
        def make() -> np.ndarray:
            made.append(key)
            return np.full(100, float(key))

        return kept.once(key, make)

    kept = Kept(2400)
    for key in (1, 2, 3, 1, 4, 1, 2):
        assert ask(kept, key)[0] == key
    assert made == [1, 2, 3, 4, 2]


def test_an_array_that_a_result_has_twice_counts_once() -> None:
    kept, array = Kept(2400), np.zeros(100)
    for key in (1, 2, 3):
        kept.once(key, lambda: (array, [array, array]))
    kept.once(1, lambda: pytest.fail("the first result is not kept"))
