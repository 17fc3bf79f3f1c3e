"""Targets for `velatura`, which has no closed form: stacks whose lobes it reads as they were asked for."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from benchmarks import benchmark

import velatura as vt
from velatura.errors import InvalidInput
from velatura.figures.bati2021_targets import FIGURES
from velatura.inverse import Infeasible, Target, alternatives, invert, invert_stack
from velatura.inverse.lobes.partial_stack import read_whole
from velatura.inverse.local import coordinates, surrogate
from velatura.inverse.local.coordinates import Space
from velatura.inverse.local.dragged import DraggedStack, seen
from velatura.inverse.local.newton import SLOW_ROUNDS, Nearest, Problem
from velatura.inverse.reasons import REASONS
from velatura.inverse.refined import EXACT
from velatura.model import named
from velatura.stack import Interface, Medium, Stack

pytestmark = pytest.mark.usefixtures("one_thread")

MODEL = named("velatura")
COAT: dict[str, Any] = {"energy": 0.04, "alpha": 0.0}
METAL: dict[str, Any] = {"energy": (0.5, 0.35, 0.2), "alpha": 0.2, "base": "conductor"}


#: The lobes of a metal of alpha .3697 below a coat of index 2.1787 and alpha .3085: a third of what layers add up to.
METAL_BELOW_A_ROUGH_COAT = Target(
    [
        {"energy": 0.12412506886517612, "alpha": 0.3085},
        {
            "energy": (0.13217033189370983, 0.04794500911506048, 0.213543246674345),
            "alpha": 0.5256385620244106,
            "base": "conductor",
        },
    ]
)


def missed(target: Target, stack: Stack) -> float:
    """The largest difference of energies and roughnesses between a target and the lobes of a stack."""
    found, first, worst = vt.lobes(stack, 1.0, model=MODEL), 0, 0.0
    for lobe in target.lobes:
        own = slice(first, first := first + lobe.interfaces)
        worst = max(worst, float(np.abs(np.sum(found.energy[own], axis=0)[:, 0] - lobe.colour).max()))
        apart = np.sort(np.reshape(found.alpha[own], (-1, 2))) - np.sort(lobe.axes[:2])
        worst = max(worst, float(np.abs(apart).max()))
    return worst


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Arguments of all readings of stacks."""
    found: list[Any] = []

    def read(*args: Any) -> Any:
        found.append(args)
        return read_whole(*args)

    monkeypatch.setattr(coordinates, "read_whole", read)
    return found


@pytest.mark.parametrize("alphas", [(0.0685, 0.21), (0.2, 0.3, 0.41)])
def test_every_reading_of_a_search_is_of_another_stack(
    alphas: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: coordinates that differ by more than an exact answer may miss its lobes by."""
    *coats, metal = alphas
    lobes: list[dict[str, Any]] = [{"energy": 0.025, "alpha": alpha} for alpha in coats]
    target = Target([*lobes, {"energy": 0.3, "alpha": metal, "base": "conductor"}])
    read, points = Space.read, []

    def noted(space: Space, x: Any) -> Any:
        if space.slow:
            points.append(x[:, 0])
        return read(space, x)

    monkeypatch.setattr(Space, "read", noted)
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-6
    assert len(points) > 3
    assert min(np.linalg.norm(a - b) for a, b in combinations(points, 2)) > EXACT


@pytest.mark.parametrize("name", ["10 c", "15 c", "17 blue over red", "19 b", "22 bottom"])
def test_targets_of_the_figures_are_met_by_few_calls(name: str, calls: list[Any]) -> None:
    target = Target(FIGURES[name])
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-6
    assert len(calls) <= (10 if name != "17 blue over red" else 40)  # of which the first stack does not lead to one


#: Stacks from whose lobes those of the first one that the closed form finds are far, or that it leads to by none; the
#: interfaces of their second lobe, and the most readings that a search takes.
FAR = {
    "rarer below denser": (
        [
            Interface(eta=2.08, alpha=0.114),
            Interface(eta=1.72, alpha=0.151),
            Interface(eta=1.25, alpha=0.151),
            Medium(sigma_a=(0.15, 0.05, 0.08)),
            Interface(eta=(1.69, 0.75, 0.4), k=(2.83, 1.41, 0.65), alpha=0.193),
        ],
        2,
        13,
    ),
    "out of reach": (
        [
            Interface(eta=1.36, alpha=0.14),
            Medium(sigma_a=(0.38, 0.14, 0.17)),
            Interface(eta=2.17, alpha=0.188),
            Medium(sigma_a=(0.26, 0.29, 0.15)),
            Interface(eta=(0.66, 1.0, 1.05), k=(2.63, 3.59, 3.07), alpha=0.249),
        ],
        1,
        11,
    ),
}


@pytest.mark.parametrize("name", FAR)
def test_lobes_far_from_those_of_the_first_stack_take_few_readings(name: str, calls: list[Any]) -> None:
    """Expected: half of those, or three quarters, that a search took which gave up what led astray."""
    layers, interfaces, most = FAR[name]
    lobe = {"energy": 0.1, "alpha": 0.1}
    form = [lobe, {**lobe, "interfaces": interfaces}, {**lobe, "base": "conductor"}]
    target = seen(Stack(layers), Target(form), MODEL)
    calls.clear()
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-6
    assert 0 < len(calls) <= most


@pytest.mark.parametrize("alpha", [0.188, (0.1, 0.25)])
def test_readings_follow_nothing_that_lies_below(alpha: Any) -> None:
    """Expected: slopes by differences of the model itself that vanish, and some along all coordinates that are free."""
    layers, *_ = FAR["out of reach"]
    layers = [*layers[:2], Interface(eta=2.17, alpha=alpha, rotation=25), *layers[3:]]
    form = [{"energy": 0.1, "alpha": 0.1}, {"energy": 0.1, "alpha": alpha}]
    target = Target([*form, {"energy": 0.1, "alpha": 0.2, "base": "conductor"}])
    dragged = DraggedStack.of(Stack(layers), seen(Stack(layers), target, MODEL), MODEL)
    assert dragged is not None
    space, x = dragged.space, dragged.point.x
    slopes = np.abs(space.differences(x, np.arange(len(x))).slopes)
    assert slopes[~space.followed].max() < 1e-9
    assert (slopes[:, space.free].max(axis=0) > 1e-3).all()


def test_a_search_ends_with_the_first_stack_that_stays_far_from_a_wish_without_any(calls: list[Any]) -> None:
    """A sharp lobe below one of three interfaces that blurs. Expected: the readings of one search by Broyden's method
    at most."""
    lobes = [{"energy": 0.1, "alpha": 0.4, "interfaces": 3}, {"energy": 0.03, "alpha": 0.1}]
    assert invert.search(Target(lobes), MODEL) is None
    assert 0 < len(calls) <= SLOW_ROUNDS


def test_alternatives_share_the_lobes_that_the_model_itself_reads() -> None:
    target = Target(FIGURES["15 b"])
    found = alternatives(target, 3, MODEL)
    assert len({solution.stack.interfaces[0].eta for solution in found}) == 3
    for solution in found:
        assert missed(target, solution.stack) < 1e-6
    assert all(members.contains(*indices(found[0])).all() for members in found[0].classes)


def test_alternatives_have_other_tints() -> None:
    """Expected: brushed metals that differ by more than rounding, all with the lobe that was asked for."""
    target = Target([COAT, {**METAL, "alpha": (0.15, 0.4), "rotation": 60}])
    found = [solution.stack for solution in alternatives(target, 3, MODEL)]
    red = sorted(stack.interfaces[1].eta[0] for stack in found)
    assert min(np.diff(red)) > 0.01
    read = [vt.lobes(stack, 1.0, model=MODEL) for stack in found]
    assert all(one.energy[1][:, 0] == pytest.approx(METAL["energy"], abs=1e-5) for one in read)
    assert all(sorted(one.alpha[1][:, 0]) == pytest.approx([0.15, 0.4], abs=1e-5) for one in read)


def test_a_metal_whose_index_is_fixed_has_the_lobe_that_is_asked_for() -> None:
    metal = {"energy": 0.5, "alpha": 0.3, "base": "conductor", "fixed": {"eta": [1.2]}}
    target = Target([{**COAT, "alpha": 0.1}, metal])
    stack = invert_stack(target, MODEL).stack
    assert stack.interfaces[1].eta == pytest.approx(1.2)
    assert missed(target, stack) < 1e-6


def test_a_start_that_has_the_lobes_keeps_its_tint() -> None:
    metal = {"eta": [0.08, 0.4, 1.56], "k": [3.39, 2.5, 1.77], "alpha": 0.2}
    stack = Stack.from_dict({"layers": [{"interface": {"eta": 1.5}}, {"interface": metal}]})
    read = vt.lobes(stack, 1.0, model=MODEL)
    energy, alpha = tuple(read.energy[1][:, 0].tolist()), float(read.alpha[1][0, 0])
    lobes = [{"energy": 0.04}, {"energy": energy, "alpha": alpha, "base": "conductor"}]
    assert invert_stack({"lobes": lobes, "start": stack.to_dict()}, MODEL).stack == stack


JUMPS = {
    "index": [
        {"energy": 0.11543720020443492},
        {"energy": (0.031517551462987764, 0.03836517364447956, 0.032928344274168846), "alpha": 0.1512762717479406},
        {
            "energy": (0.2713277971252697, 0.22636485975841017, 0.23873940843396405),
            "alpha": 0.34743004489989143,
            "base": "conductor",
        },
    ],
    "pair": [
        {"energy": 0.10074278493622979, "alpha": 0.13738015393440114},
        {
            "energy": (0.02953765270632777, 0.03810921715032311, 0.03834429923487833),
            "alpha": 0.37782201995356396,
            "interfaces": 2,
        },
        {
            "energy": (0.028134647059087945, 0.027175565298252272, 0.029049491367064178),
            "alpha": 0.6092743051118422,
            "base": "conductor",
        },
    ],
}


@pytest.mark.parametrize("name", JUMPS)
def test_the_search_leads_past_a_jump_of_readings(name: str) -> None:
    target = Target(JUMPS[name])
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-6


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


@pytest.mark.parametrize(
    ("lobes", "stays"),
    [
        ([COAT, {"energy": (0.95, 0.75, 0.35), "alpha": 0.5, "base": "conductor"}], 0),
        ([{**COAT, "alpha": 0.2}, {"energy": (0.2, 0.1, 0.1), "alpha": 0.02, "base": "conductor"}], 0),
        ([{"energy": (0.1, 0.2, 0.1)}, METAL], 1),
        ([{**COAT, "fixed": {"eta": [1.5]}}, {**METAL, "alpha": 0.0, "fixed": {"alpha": [0.1]}}], 0),
    ],
)
def test_a_way_out_is_near_and_brings_the_stack_that_has_it(lobes: list[Any], stays: int, calls: list[Any]) -> None:
    """Expected: the other lobe stays; as JSON it is solved by one reading, and what is fixed is kept."""
    with pytest.raises(Infeasible) as error:
        invert_stack(lobes, MODEL)
    nearest = error.value.nearest
    assert nearest is not None and nearest.start is not None
    assert nearest.lobes[stays].colour == pytest.approx(Target(lobes).lobes[stays].colour, abs=1e-4)
    assert nearest.lobes[stays].roughness == pytest.approx(Target(lobes).lobes[stays].roughness, abs=1e-4)
    calls.clear()
    found = invert_stack(json.loads(json.dumps(nearest.to_dict())), MODEL)
    assert len(calls) == 1 and found.reached is None
    assert missed(nearest, found.stack) < 1e-6
    for layer, lobe in zip(found.stack.interfaces, nearest.lobes):
        assert lobe.fixed.of("eta", 0) in (None, layer.eta)


@pytest.mark.parametrize(
    ("lobes", "reasons"),
    [
        ([{"energy": 0.357, "alpha": 0.1}], {"energy", "unmet energy"}),
        ([{**COAT, "alpha": 0.3}, {"energy": 0.85, "alpha": 0.3, "base": "conductor"}], {"bright", "unmet energy"}),
    ],
)
def test_a_refusal_by_the_model_itself_has_its_own_reason_and_way_out(lobes: list[Any], reasons: set[str]) -> None:
    """Of lobes that the nearest model in closed form has a stack for. Expected: a little less energy, and no more."""
    assert invert.search(Target(lobes), MODEL.surrogate) is not None
    with pytest.raises(Infeasible) as error:
        invert_stack(lobes, MODEL)
    assert error.value.constraint in reasons and error.value.lobe == len(lobes)
    nearest, asked = error.value.nearest, lobes[-1]["energy"]
    assert nearest is not None
    assert 0.9 * asked < nearest.lobes[-1].colour[1] < asked
    assert nearest.lobes[-1].roughness == pytest.approx(lobes[-1]["alpha"], abs=1e-4)
    assert missed(nearest, invert_stack(nearest, MODEL).stack) < 1e-6


def test_what_is_missed_most_is_the_reason_where_no_bound_is_in_the_way() -> None:
    """Of a lobe and the next: energies come first, three each, then the variance of each interface."""
    target = Target([COAT, METAL])
    dragged = DraggedStack.of(invert_stack(target, "bati2021").stack, target, named("bati2021"))
    assert dragged is not None
    problem = Problem(dragged.point, dragged.point.reading.value)
    counted = list(dragged.space.counted)
    for at, reason in ((counted.index(3), "unmet energy"), (counted.index(7), "unmet blur")):
        found = problem._in_the_way(Nearest(dragged.point.x, 1.0, at))
        assert (found.lobe, found.reason) == (1, reason)
        assert found.why(target) == f"lobe 2: {REASONS[reason]}"


def test_random_refusals_have_ways_out() -> None:
    """A slice of the benchmark: reasons that can be, and ways out that are solved when they are fed back."""
    refusals = benchmark("refusals")
    for target, refusal, _ in refusals.refused(2, seed=3, most=2):
        assert refusals.wrong(target, refusal) is None


def test_a_refusal_is_explained_where_no_start_has_the_roughness_that_is_fixed() -> None:
    """Energies that sum to more than 1, and a first lobe that no stack on the way has."""
    first = {"energy": (0.2873503, 0.293682, 0.07576605), "alpha": 0.0}
    pair = {"energy": (0.4796654, 0.4247675, 0.3272766), "alpha": 0.2769960, "interfaces": 2}
    lobes = [first, {**pair, "fixed": {"alpha": (None, 0.4537447)}}, {"energy": 0.3514613, "alpha": 0.2176515}]
    with pytest.raises(Infeasible, match="energies sum") as error:
        invert_stack(lobes, MODEL)
    assert error.value.nearest is not None
    invert_stack(error.value.nearest, MODEL)


def test_a_search_begins_with_a_given_stack() -> None:
    """Expected: of all stacks that have a lobe the one that is given; another lobe is met near it."""
    target = Target(FIGURES["15 b"])
    other = alternatives(target, 3, MODEL)[2].stack
    begun = target.model_copy(update={"start": other})
    assert invert_stack(begun, MODEL).stack == other
    brighter = begun.with_lobe(0, energy=(0.1, 0.09, 0.15))
    near = invert_stack(brighter, MODEL).stack
    assert missed(brighter, near) < 1e-6
    assert near.interfaces[0].eta == pytest.approx(other.interfaces[0].eta, rel=0.05)


@pytest.mark.parametrize(
    ("start", "line"),
    [
        (3, "start: must be a material, or the name of a preset, got 3"),
        ({"layers": [{"interface": {"eta": -1}}]}, "start: layer 0 (interface): eta: must lie in"),
        ({"layers": [{"interface": {"eta": 1.5}}] * 2}, "start: must have as many interfaces as the lobes, 1, got 2"),
    ],
)
def test_what_no_search_can_begin_with(start: Any, line: str) -> None:
    with pytest.raises(InvalidInput) as error:
        invert_stack({"lobes": [COAT], "start": start}, MODEL)
    assert str(error.value).startswith(line)


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


def test_a_lobe_that_is_almost_smooth_is_answered_by_a_smooth_one() -> None:
    """Lower lobes of rough interfaces have an alpha of .001 at least."""
    target = Target([{"energy": (0.1, 0.086, 0.109), "alpha": 0.0002, "interfaces": 2}])
    found = invert_stack(target, MODEL)
    assert found.reached == target.with_lobe(0, alpha=0.0)
    assert missed(found.reached, found.stack) < 1e-6


def test_requests_are_changed_until_their_answers_are_read_as_is_wanted() -> None:
    """Of a reading that is neither linear nor of each request alone."""
    goal = np.array([0.3, 0.5])

    def read(x: Any) -> Any:
        return np.array([0.7 * x[0] + 0.2 * x[1] ** 2, 0.9 * x[1] + 0.1 * x[0]])

    found = surrogate.met(lambda x: x, read, goal, goal, goal)
    assert found is not None
    np.testing.assert_allclose(read(found), goal, rtol=1e-6)
    assert surrogate.met(lambda x: None, read, goal, goal, goal) is None


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
    found = surrogate.met(ask, read, 0.5 * goal, goal, goal)
    assert found is not None
    assert read(found)[0] == pytest.approx(0.6, abs=0.01)
    assert read(found)[1] == pytest.approx(0.3, abs=1e-6 if saturates else 0.1)
    assert len(asked) <= 24
    assert np.abs(asked).max() < 5


def test_lobes_of_random_stacks_are_not_refused() -> None:
    """A slice of the benchmark: single lobes and lobes below coats."""
    for target in benchmark("inverse").physical_targets(6, MODEL, seed=2):
        assert missed(target, invert_stack(target, MODEL).stack) < 1e-6


def test_lobes_of_rough_stacks_are_not_refused() -> None:
    """A slice of the benchmark, where models differ by factors; each stack itself is an answer."""
    for target in [METAL_BELOW_A_ROUGH_COAT, *benchmark("inverse").physical_targets(1, MODEL, seed=0, rough=True)]:
        assert missed(target, invert_stack(target, MODEL).stack) < 1e-6


def test_lobes_of_a_brushed_metal_below_a_rough_coat_are_not_refused() -> None:
    """The lobes hardly have axes, the metal does: its reflectance lies on its bound long before the axes are found."""
    coat, metal = Interface(eta=2.3, alpha=(0.562, 0.413)), Interface(eta=1.1, k=3.3, alpha=(0.203, 0.697))
    form = [{"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]
    target = seen(Stack([coat, Medium(sigma_a=0.34), metal]), Target(form), MODEL)
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-4


def test_lobes_below_crossed_brushings_are_not_refused() -> None:
    """Three lobes of a stack whose metal has a variance of 5 along one axis, which is seen through rough interfaces."""
    target = Target(
        [
            {"energy": 0.0977950542, "alpha": (0.1952292593, 0.2865580557), "rotation": 56.9166315394},
            {
                "energy": (0.00052383882934, 0.00049918184698, 0.00037131076677),
                "alpha": (0.5519836121, 0.6032901773),
                "rotation": 0.3202088188,
            },
            {
                "energy": (0.03070980562648, 0.01913767845185, 0.00973124902966),
                "alpha": (0.5992710787, 0.6141110260),
                "rotation": 0.0940769644,
                "base": "conductor",
            },
        ]
    )
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-4


@pytest.mark.parametrize("alpha", [(0.1, 0.1), (0.3, 0.98)])
def test_a_folded_point_is_the_same_stack_and_its_slopes_are_those_of_its_coordinates(alpha: Any) -> None:
    """Expected: slopes by differences in the other coordinates."""
    interfaces = [
        {"interface": {"eta": 1.5, "alpha": (0.1, 0.2), "rotation": 30}},
        {"interface": {"eta": 2.0, "alpha": alpha}},
    ]
    form = Target([{"energy": 0.04, "alpha": (0.1, 0.2), "rotation": 30}, {"energy": 0.02}])
    dragged = DraggedStack.of(Stack.from_dict({"layers": interfaces}), form, named("yamaguchi2019"))
    assert dragged is not None
    here = dragged.point
    here = replace(here, known=here.reading)
    there, back = here.refolded, here.refolded.refolded
    assert there.space.folded and not back.space.folded
    assert back.x == pytest.approx(here.x, rel=1e-9, abs=1e-12)
    free = here.space.free
    assert there.space.read(there.x[:, None])[:, 0] == pytest.approx(here.reading.value, rel=1e-9, abs=1e-12)
    slopes = there.space.reading(there.x, free).slopes
    assert there.reading.slopes == pytest.approx(slopes, rel=0.02, abs=1e-3 * np.abs(slopes).max())


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


@pytest.mark.parametrize(
    "lobes",
    [
        # Only denser second interfaces lead there; of those that cost least, all are rarer
        [
            {"energy": 0.02825181, "alpha": 0.04130944},
            {"energy": 0.02864003, "alpha": 0.1302877},
            {
                "energy": (0.2431342, 0.05512078, 0.2536692),
                "alpha": 0.3425981,
                "interfaces": 2,
                "base": "conductor",
            },
        ],
        # Without absorption that is not needed, a reading jumps there by 1e-4
        [
            {"energy": 0.005551816, "alpha": 0.09794332},
            {"energy": (0.01275877, 0.01369174, 0.007313994), "alpha": 0.1548001},
            {
                "energy": (0.4001884, 0.4113637, 0.1750696),
                "alpha": 0.2429325,
                "base": "conductor",
            },
        ],
    ],
    ids=["sides", "jump"],
)
def test_three_lobes_of_materials_are_met_away_from_the_least_absorption(lobes: list[Any]) -> None:
    """Two of the random stacks of `benchmarks/inverse.py` that took another start."""
    target = Target(lobes)
    assert missed(target, invert_stack(target, MODEL).stack) < 1e-6


def test_an_answer_does_not_depend_on_earlier_questions() -> None:
    target, other = Target(FIGURES["19 b"]), Target(FIGURES["15 c"])
    first = invert_stack(target, MODEL).stack
    invert_stack(other, MODEL)
    assert invert_stack(target, MODEL).stack == first
