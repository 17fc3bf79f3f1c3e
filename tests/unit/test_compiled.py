"""Functions over many samples: the same by NumPy and by a kernel; and results that are kept."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import ops
from velatura.model.rough_interface import KEPT
from velatura.renderer import compiled
from velatura.renderer.kept import Kept


@dataclass(frozen=True)
class Wave:
    size: float
    colour: np.ndarray
    where: object = None

    def at(self, x: Any) -> Any:
        return self.size * ops.cos(x)


def function(sources: Any, samples: Any, numbers: Any) -> Any:
    (p,), (u,), (wave, at, shift, one) = sources, samples, numbers
    return [[at(p * u) + shift, one * p], [u]], [wave.colour * p * u, ops.log_gamma(1 + u)]


def numbers(where: object = None) -> Any:
    wave = Wave(0.7, np.array([0.2, 0.5, 0.9])[:, None, None], where)
    return [wave, wave.at, 0.25, 1.0]


def by_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "MANY", -1)
    monkeypatch.setattr(compiled, "LEAST", 0)


SOURCES = [np.linspace(0.1, 1.0, 7)]
SAMPLES = [np.linspace(0.0, 1.0, 5)]


def test_kernels_and_numpy_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    groups, sums = compiled.over(function, SOURCES, SAMPLES, numbers())
    by_kernels(monkeypatch)
    compiled_groups, compiled_sums = compiled.over(function, SOURCES, SAMPLES, numbers())
    assert [x.shape for x in groups] == [(7, 5, 2), (7, 5, 1)] and sums.shape == (4, 7)
    for plain, kernel in zip([*groups, sums], [*compiled_groups, compiled_sums]):
        assert kernel == pytest.approx(plain, abs=1e-12)
    product = SOURCES[0][:, None] * SAMPLES[0]
    assert groups[0][..., 0] == pytest.approx(0.7 * np.cos(product) + 0.25, abs=1e-15)
    assert sums[2] == pytest.approx(0.9 * product.sum(axis=1), abs=1e-14)


def test_objects_that_no_kernel_reads_run_by_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise AssertionError

    by_kernels(monkeypatch)
    monkeypatch.setattr(compiled, "_compiled", refused)
    groups, _ = compiled.over(function, SOURCES, SAMPLES, numbers(object()))
    assert groups[0].shape == (7, 5, 2)


def test_another_number_or_address_needs_no_other_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    import drjit as dr

    def kernels(shift: float, place: int) -> set[Any]:
        held = np.empty(16 + SOURCES[0].size)[place : place + SOURCES[0].size]
        held[:] = SOURCES[0]
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            compiled.over(function, [held], SAMPLES, [*numbers()[:2], shift, 1.0])
            return {each["hash"] for each in dr.kernel_history([dr.KernelType.JIT])}

    vt.bsdf(vt.load("coated-gold"))
    by_kernels(monkeypatch)
    first = kernels(0.3, 0)
    assert first and all(kernels(0.6, place) == first for place in range(9))


def test_lobes_are_the_same_by_numpy_and_by_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    stacks = [vt.load(name) for name in ("coated-gold", "pearl-lacquer", "frosted-glass")]
    found = []
    for kernels in (False, True):
        by_kernels(monkeypatch) if kernels else monkeypatch.setattr(compiled, "MANY", 1 << 60)
        KEPT.clear()
        lobes = [vt.lobes(stack, [1.0, 0.5, 0.1], 0.3) for stack in stacks]
        found.append([(each.energy, each.alpha) for each in lobes])
    for (energy, alpha), (compiled_energy, compiled_alpha) in zip(*found):
        assert np.array(compiled_energy) == pytest.approx(np.array(energy), abs=1e-12)
        assert np.array(compiled_alpha) == pytest.approx(np.array(alpha), abs=1e-9)


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
