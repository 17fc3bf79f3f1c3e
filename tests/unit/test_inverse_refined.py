"""Targets for `velatura`, which has no closed form: stacks whose lobes it reads as they were asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from benchmarks import benchmark

import velatura as vt
from velatura.inverse import Infeasible, Target, alternatives, invert_stack, requests
from velatura.inverse.drag import coordinates
from velatura.inverse.figure_targets import FIGURES
from velatura.inverse.partial_stack import read_whole
from velatura.model import named
from velatura.stack import Medium, Stack

MODEL = named("velatura")
COAT: dict[str, Any] = {"energy": 0.04, "alpha": 0.0}
METAL: dict[str, Any] = {"energy": (0.5, 0.35, 0.2), "alpha": 0.2, "base": "conductor"}


def missed(target: Target, stack: Stack) -> float:
    """The largest difference of energies and roughnesses between a target and the lobes of a stack."""
    found, first, worst = vt.lobes(stack, 1.0, model=MODEL), 0, 0.0
    for lobe in target.lobes:
        own = slice(first, first := first + lobe.interfaces)
        worst = max(worst, float(np.abs(np.sum(found.energy[own], axis=0)[:, 0] - lobe.colour).max()))
        worst = max(worst, float(np.abs(np.array(found.alpha[own]) - lobe.roughness).max()))
    return worst


@pytest.mark.parametrize("name", ["10 c", "15 c", "17 blue over red", "19 b", "22 bottom"])
def test_targets_of_the_figures_are_met_by_few_calls(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def read(*args: Any) -> Any:
        calls.append(args)
        return read_whole(*args)

    monkeypatch.setattr(coordinates, "read_whole", read)
    target = Target(FIGURES[name])
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-6
    assert len(calls) <= (10 if name != "17 blue over red" else 40)  # of which the first stack does not lead to one


def test_alternatives_share_the_lobes_that_the_model_itself_reads() -> None:
    target = Target(FIGURES["15 b"])
    found = alternatives(target, 3, MODEL)
    assert len({solution.stack.interfaces[0].eta for solution in found}) == 3
    for solution in found:
        assert missed(target, solution.stack) < 1e-6
    assert all(members.contains(*indices(found[0])).all() for members in found[0].classes)


def indices(solution: Any) -> list[Any]:
    return [part.eta[0] for part in solution.layers]


@pytest.mark.parametrize(
    ("lobes", "constraint"),
    [
        ([{"energy": 0.6}], "energy"),
        ([{"energy": (0.1, 0.2, 0.1)}], "colour"),
        ([{"energy": 0.1, "alpha": 0.2}, {"energy": 0.1, "alpha": 0.02}], "blur"),
        ([{"energy": 0.2}, {**METAL, "energy": (0.9, 0.7, 0.5)}], "sum"),
    ],
)
def test_what_is_offered_in_place_of_a_refused_target_has_a_stack(lobes: list[Any], constraint: str) -> None:
    with pytest.raises(Infeasible) as error:
        invert_stack(lobes, MODEL)
    assert error.value.constraint == constraint
    nearest = error.value.nearest
    assert nearest is not None
    assert missed(nearest, invert_stack(nearest, MODEL).stack) < 1e-6


def test_what_is_fixed_is_kept_and_the_rest_met() -> None:
    fixed = {"eta": [1.5]}, {"tau": [0.05]}
    target = Target([{**COAT, "fixed": fixed[0]}, {**METAL, "fixed": fixed[1]}])
    found = invert_stack(target, MODEL)
    assert found.reached is None
    assert found.stack.interfaces[0].eta == 1.5
    assert found.stack.layers[1] == Medium(sigma_a=0.05)
    assert missed(target, found.stack) < 1e-5


def test_an_answer_says_what_it_reaches_where_what_is_fixed_misses_the_target() -> None:
    target = Target([{**COAT, "energy": 0.0405, "alpha": 0.1, "fixed": {"eta": [1.5]}}, METAL])
    found = invert_stack(target, MODEL)
    assert found.reached is not None
    assert found.reached.lobes[0].colour[0] == pytest.approx(0.0398, abs=1e-4)
    assert missed(found.reached, found.stack) < 1e-9
    assert found.reached.lobes[1].colour == pytest.approx(METAL["energy"], rel=1e-4)


def test_requests_are_changed_until_their_answers_are_read_as_is_wanted() -> None:
    """Of a reading that is neither linear nor of each request alone."""
    goal = np.array([0.3, 0.5])

    def read(x: Any) -> Any:
        return np.array([0.7 * x[0] + 0.2 * x[1] ** 2, 0.9 * x[1] + 0.1 * x[0]])

    found = requests.met(lambda x: x, read, goal, goal, goal)
    assert found is not None
    np.testing.assert_allclose(read(found), goal, rtol=1e-6)
    assert requests.met(lambda x: None, read, goal, goal, goal) is None


@pytest.mark.parametrize("saturates", [False, True])
def test_requests_for_what_no_answer_has_end_soon_near_the_goal(saturates: bool) -> None:
    """Where requests beyond a bound have no answer, or all of them the same."""
    asked: list[Any] = []

    def ask(x: Any) -> Any:
        asked.append(x)
        return x if saturates or x[0] <= 0.6 else None

    def read(x: Any) -> Any:
        return np.minimum(x, (0.6, 1.0))

    goal = np.array([0.8, 0.3])
    found = requests.met(ask, read, 0.5 * goal, goal, goal)
    assert found is not None
    assert read(found)[0] == pytest.approx(0.6, abs=0.01)
    assert read(found)[1] == pytest.approx(0.3, abs=1e-6 if saturates else 0.1)
    assert len(asked) <= 24
    assert np.abs(asked).max() < 5


def test_lobes_of_random_stacks_are_not_refused() -> None:
    """A slice of the benchmark: single lobes and lobes below coats."""
    for target in benchmark("inverse").physical_targets(6, MODEL, seed=2):
        assert missed(target, invert_stack(target, MODEL).stack) < 1e-6


def test_three_lobes_are_met_as_closely_as_one() -> None:
    """Where Broyden's method gains little in its last round."""
    colours = (0.0139, 0.0169, 0.0174), (0.431, 0.445, 0.425)
    target = Target(
        [
            {"energy": 0.0241, "alpha": 0.0685},
            {"energy": colours[0], "alpha": 0.2097},
            {"energy": colours[1], "alpha": 0.4283, "base": "conductor"},
        ]
    )
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-7


def test_an_answer_does_not_depend_on_earlier_questions() -> None:
    target, other = Target(FIGURES["19 b"]), Target(FIGURES["15 c"])
    first = invert_stack(target, MODEL).stack
    invert_stack(other, MODEL)
    assert invert_stack(target, MODEL).stack == first
