"""Smooth stacks of coherent films and thick media, against `tmm`; `benchmarks/films.py` has 10^4 of them."""

from __future__ import annotations

import numpy as np
import pytest
from mixed_films import light_of, random_mixed

from velatura import tables
from velatura.model.solved.energies.energies import energies
from velatura.model.solved.lobes.widths import nearly_straight
from velatura.stack import Material

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")


def test_coherent_films_between_thick_media_are_those_of_tmm() -> None:
    """s and p apart; films that absorb over metals, and total reflection inside."""
    rng = np.random.default_rng(20)
    for _ in range(200):
        mixed, cosine = random_mixed(rng)
        for kind in "sp":
            assert mixed.summed(kind, cosine) == pytest.approx(mixed.exact(kind, cosine), abs=1e-6)


def test_they_keep_energy_and_let_as_much_pass_from_either_side() -> None:
    rng = np.random.default_rng(21)
    clear, passing = 0, 0
    for _ in range(300):
        mixed, cosine = random_mixed(rng)
        cos2 = 1 - (1 - cosine**2) / np.real(mixed.indices[-1]) ** 2
        for kind in "sp":
            r, t = mixed.summed(kind, cosine)
            if mixed.is_clear:
                assert r + t == pytest.approx(1, abs=1e-9)
                clear += 1
            if not np.imag(mixed.indices[-1]) and cos2 > 0:
                assert mixed.reversed().summed(kind, np.sqrt(cos2))[1] == pytest.approx(t, abs=1e-9)
                passing += 1
    assert clear > 100 and passing > 200


@pytest.mark.parametrize("often", [False, True])
def test_the_model_is_tmm_at_the_normal(often: bool) -> None:
    """From both sides; elsewhere it adds unpolarised reflectances."""
    rng = np.random.default_rng(22)
    known = tables.load() if often else None
    for _ in range(10):
        mixed, _ = random_mixed(rng)
        with light_of(mixed.wavelength_nm):
            material = Material.of(mixed.stack)
            sides = [(material, mixed)]
            if material.transmits:
                sides.append((material.reversed(), mixed.reversed()))
            for seen, same in sides:
                found = energies(seen, np.ones(1), np.zeros(1), known, nearly_straight)
                reflected = (found.lobes + found.veils).sum(axis=0) + found.rest
                r, t = same.exact("s", 1.0)
                assert reflected == pytest.approx(np.full(reflected.shape, r), abs=1e-6)
                if material.transmits:
                    assert found.passed == pytest.approx(np.full(found.passed.shape, t), abs=1e-6)
