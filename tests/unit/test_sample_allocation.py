"""How samples are shared among parts."""

import numpy as np
import pytest

from velatura.model.solved.sample_allocation import TARGET_SAMPLE_WEIGHT, Demand, shared


def wanted(energy: list[float], usual: list[float], heaviest: list[float]) -> Demand:
    return Demand(*(np.array([x]).T for x in (energy, usual, heaviest)))


def test_parts_whose_samples_are_light_have_shares_in_proportion_to_their_energies() -> None:
    found = shared(wanted([0.6, 0.2, 0.0], [0.6, 0.2, 0.0], [0.7, 0.3, 0.0]))
    np.testing.assert_allclose(found[:, 0], [0.75, 0.25, 0.0])


@pytest.mark.parametrize(
    ("usual", "heaviest"),
    [([0.5, 0.6, 0.1], [0.6, 1.1, 0.2]), ([0.9, 1.1, 0.1], [1.5, 2.5, 0.3]), ([4.0, 3.0, 1.0], [5.0, 4.0, 2.0])],
    ids=["enough for all", "for usual samples", "for none"],
)
def test_shares_keep_samples_light_as_far_as_they_suffice(usual: list[float], heaviest: list[float]) -> None:
    """Largest weights first, and else at least those of usual samples; the sum of shares is 1."""
    found = shared(wanted([0.3, 0.1, 0.1], usual, heaviest))[:, 0]
    assert found.sum() == pytest.approx(1)
    for weights in (heaviest, usual):
        if sum(weights) <= TARGET_SAMPLE_WEIGHT:
            assert np.all(np.array(weights) / found <= TARGET_SAMPLE_WEIGHT * (1 + 1e-9))
            break
    else:
        np.testing.assert_allclose(found, np.array(usual) / sum(usual), rtol=0.01)


def test_a_part_of_hardly_any_energy_takes_few_samples() -> None:
    assert shared(wanted([0.8, 1e-5], [0.8, 2.0], [0.8, 2.0]))[1, 0] < 0.01


def test_shares_do_not_jump_where_samples_become_heavier() -> None:
    """Light of some samples is cut off by their density, and so jumped with their shares."""
    heaviest = np.linspace(1.2, 4.0, 3001)
    numbers = [0.3, 0.1, 0.1], [0.9, 1.1, 0.1], [1.5, heaviest, 0.3]
    found = shared(Demand(*(np.array(np.broadcast_arrays(*each, heaviest)[:3]) for each in numbers)))
    assert np.ptp(found[1]) > 0.01
    assert np.abs(np.diff(found)).max() < 2e-4
