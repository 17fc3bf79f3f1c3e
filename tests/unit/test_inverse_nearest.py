"""One answer to a wish: under the hand, at rest, and by `invert_stack` from the same material."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura.editor import appearance
from velatura.inverse import Infeasible, Target, invert, invert_stack
from velatura.inverse.lobes.interface import CONDUCTOR_MAX
from velatura.inverse.local.coordinates import Space
from velatura.inverse.local.dragged import DraggedStack, seen
from velatura.inverse.local.line import EXACT, KNOWN, QUICK, Line, _Search
from velatura.inverse.nearest import READINGS, Nearest, nearest
from velatura.model import Model, named
from velatura.model.variance import Roughness
from velatura.optics import fresnel
from velatura.stack import Stack

pytestmark = pytest.mark.usefixtures("one_thread")

AVERAGED = named("bati2021")
PLASTIC = Stack(
    [vt.Interface(eta=1.5, alpha=0.1), vt.Medium(sigma_a=(0.1, 0.3, 0.6)), vt.Interface(eta=1.8, alpha=0.2)]
)
METAL = Stack(
    [vt.Interface(eta=1.5, alpha=0.1), vt.Medium(sigma_a=0.1), vt.Interface(eta=0.5, k=(3, 2.5, 2), alpha=0.2)]
)


def lobes_of(stack: Stack) -> Target:
    base = "conductor" if stack.interfaces[-1].opaque else "dielectric"
    return seen(stack, Target([{"energy": 0.1}, {"energy": 0.1, "base": base}]), AVERAGED)


def answer(stack: Stack, wish: Target, model: Model = AVERAGED, quick: bool = False) -> Nearest:
    present = DraggedStack.of(stack, wish, model)
    assert present is not None
    return nearest(present, wish, quick=quick)


@pytest.mark.parametrize("stack", [PLASTIC, METAL], ids=["plastic", "metal"])
@pytest.mark.parametrize("change", [0.2, 2.0, 30.0])
def test_what_a_wish_does_not_change_stays(stack: Stack, change: float) -> None:
    """Expected: a wish is met, or the answer lies on the line to it, and just beyond there is no stack."""
    now = lobes_of(stack)
    for k, other in ((0, 1), (1, 0)):
        wish = now.with_energy(k, np.minimum(change * np.array(now.lobes[k].colour), 0.95))
        found = answer(stack, wish)
        has = seen(found.stack.stack, wish, AVERAGED)
        assert has.lobes[other].colour == pytest.approx(now.lobes[other].colour, abs=2e-5)
        assert [lobe.roughness for lobe in has.lobes] == pytest.approx([lobe.roughness for lobe in now.lobes], abs=2e-5)
        there = np.array(now.lobes[k].colour) + found.part * np.subtract(wish.lobes[k].colour, now.lobes[k].colour)
        assert has.lobes[k].colour == pytest.approx(tuple(there), abs=2e-5)
        assert found.met == (found.part > 0.9999)
        if not found.met:
            beyond = np.array(now.lobes[k].colour) + min(found.part + 0.03, 1) * np.subtract(
                wish.lobes[k].colour, now.lobes[k].colour
            )
            assert not answer(stack, now.with_energy(k, beyond)).met


def test_a_lobe_below_nothing_that_absorbs_gets_the_mean_of_a_colour() -> None:
    now = lobes_of(PLASTIC)
    found = answer(PLASTIC, now.with_energy(0, (0.06, 0.03, 0.03)))
    assert not found.met and found.reason == "colour" and found.part == pytest.approx(1)
    assert found.reached.lobes[0].colour == pytest.approx((0.04,) * 3, abs=1e-6)


def test_a_wish_gets_one_answer_by_all_ways() -> None:
    """Copper under water, whose lobe no brighter metal keeps below a coat that reflects .32; its own lobes are those of
    its spectrum."""
    copper = vt.preset("wet-copper")
    body = {"material": copper.to_dict(), "model": "velatura"}
    now = Target.from_dict(appearance.appearance(body)["target"])
    wish = now.with_energy(0, (0.32, 0.32, 0.32))
    asked = {**body, "target": appearance.described(wish)}
    rest, hand = appearance.invert(asked), appearance.invert({**asked, "read": appearance.described(now)})
    with pytest.raises(Infeasible) as error:
        invert_stack(wish.model_copy(update={"start": copper}))
    assert error.value.nearest is not None and hand["rough"] and rest["snapped"] == error.value.why
    energies: list[Any] = [Target.from_dict(one["target"]).lobes for one in (rest, hand)]
    energies.append(error.value.nearest.lobes)
    own, of_metal = np.array([[lobe.colour for lobe in lobes] for lobes in energies]).swapaxes(0, 1)
    assert own[0] == pytest.approx(own[2], abs=2e-3) and own[1] == pytest.approx(own[0], rel=0.02)
    assert of_metal == pytest.approx(np.array([now.lobes[1].colour] * 3), abs=5e-3)
    assert own[0, 0] > 3 * now.lobes[0].colour[0]


def test_a_closed_form_gives_one_answer_under_the_hand_and_at_rest() -> None:
    """A pair wished brighter than what its index allows, where a coarse search ends early."""
    media = vt.Medium(sigma_a=(0.04, 0.0, 0.05))
    pair = Stack([vt.Interface(eta=1.88, alpha=0.12), media, vt.Interface(eta=1.31, alpha=0.02)])
    now = seen(pair, Target([{"energy": 0.1, "interfaces": 2}]), AVERAGED)
    wish = now.with_energy(0, (0.445, 0.453, 0.443))
    hand, rest = (answer(pair, wish, quick=quick) for quick in (True, False))
    assert not rest.met and hand.exact and hand.part == rest.part


def test_an_index_on_the_other_side_of_that_above_is_found() -> None:
    """An interface reflects less than wished by any lower index, down to 1, where the line to the wish ends; by one of
    4 it reflects nearly as much. Expected: that, under the hand and at rest."""
    metal = vt.Interface(eta=(1.124, 1.122, 1.068), k=(1.39, 1.388, 1.27), alpha=0.45)
    stack, model = Stack([vt.Interface(eta=1.505), vt.Interface(eta=1.143, alpha=0.19), metal]), named("velatura")
    now = seen(stack, Target([{"energy": 0.1}, {"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]), model)
    wish = now.with_energy(1, (0.157, 0.157, 0.157))
    hand, rest = (answer(stack, wish, model, quick=quick) for quick in (True, False))
    assert hand.part == pytest.approx(rest.part, abs=2e-3) and rest.part > 0.9
    assert rest.stack.stack.interfaces[1].eta == pytest.approx(4, abs=0.01)


def test_rounding_does_not_change_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a stack that is written and read again, and of readings, which kernels and NumPy give to 1e-13.

    Expected: of indices that differ by 1e-14, and readings by 1e-13 at random, the same stack under the hand to the
    last digit, far from the present one.
    """
    model, rng, read = named("velatura"), np.random.default_rng(0), Space._solved

    def coated(scale: float) -> Stack:
        metal = vt.Interface(eta=tuple(scale * np.array([0.5, 0.4, 0.6])), k=3, alpha=0.2)
        return Stack([vt.Interface(eta=1.4, alpha=0.1), vt.Medium(sigma_a=0.1), metal])

    now = seen(coated(1), Target([{"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]), model)
    wish = now.with_energy(0, (0.6, 0.6, 0.6))
    monkeypatch.setattr(Space, "_solved", lambda *where: read(*where) * (1 + 1e-13 * rng.normal()))
    found = [answer(coated(scale), wish, model, quick=True) for scale in (1, 1 + 1e-14)]
    assert found[0].stack.stack == found[1].stack.stack and found[0].part > 0.5


def test_a_search_begins_alike_from_a_material_and_from_its_file() -> None:
    """Expected: the same numbers, also of one that is all but 0, as of axes that lie together but for 3e-7 degrees:
    what the file differs by is rounding, and a digit of such a number."""
    layers = [
        {"interface": {"eta": eta, "alpha": list(alpha), "rotation": rotation}}
        for eta, alpha, rotation in (
            (1.8778618222453656, (0.24990507341710935, 0.19537972918646332), 2.267795964587063e-07),
            (1.1165737351462477, (0.06647251098576758, 0.04584325006201998), 5.4359012030614886e-05),
            (1.459480105235685, (0.4704255284597616, 0.25883647934038234), 89.99999639040888),
            (2.095059785317866, (0.368725991355685, 0.1995137500499877), 90.00000100703683),
        )
    ]
    lobe: dict[str, Any] = {"energy": 0.1, "alpha": [0.25, 0.2], "interfaces": 2}
    wish = Target([lobe, {**lobe, "rotation": 90}])
    stack = DraggedStack.of(Stack.from_dict({"layers": layers}), wish, named("velatura"))
    assert stack is not None
    again = DraggedStack.of(stack.stack, wish, named("velatura"))
    assert again is not None and not np.array_equal(stack.point.x, again.point.x)
    assert np.array_equal(stack.rounded(KNOWN).point.x, again.rounded(KNOWN).point.x)


def test_a_search_ends_where_nothing_leads_back_to_the_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Readings that are all the same, beside the line, half of the way on. Expected: the start, after fewer readings
    than may follow to lead back to the line alone."""
    model = named("velatura")
    now = seen(METAL, Target([{"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]), model)
    wish = now.with_energy(0, (0.08, 0.08, 0.08))
    present = DraggedStack.of(METAL, wish, model)
    assert present is not None
    here, goal, read = present.point.reading.value, present.space.goal(wish), list[Any]()

    def beside(_: Space, x: Any) -> Any:
        read.append(x)
        return (here + goal) / 2 + np.eye(len(here))[-1] / 10

    monkeypatch.setattr(Space, "_solved", beside)
    found = Line(present.point, here, goal).last(READINGS)
    assert found.part == 0 and 0 < len(read) < READINGS[0]


def test_readings_that_jump_lead_to_no_number_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    """Readings of the closed form, a tenth more and less by turns: of points close together, they say that energies
    follow steeply. Expected: an answer on the line, of finite indices, and no overflow."""
    model, readings = named("velatura"), itertools.count()
    now = seen(METAL, Target([{"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]), model)
    wish = now.with_energy(0, (0.001,) * 3)

    def jumping(space: Space, x: Any) -> Any:
        return space.quickly.read(x)[:, 0] * (1.1 if next(readings) % 2 else 0.9)

    monkeypatch.setattr(Space, "_solved", jumping)
    monkeypatch.setattr("velatura.inverse.nearest.READINGS", (6,))  # that many lead to it
    with np.errstate(over="raise", divide="raise", invalid="raise"):
        found = answer(METAL, wish, model)
    assert 0 <= found.part <= 1 and np.isfinite(found.stack.point.x).all()


def test_an_exact_search_goes_back_to_what_the_quick_one_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bound that is found quickly, a little beside the line; then all readings are those of the start, far from it.

    Expected: the search returns to that bound, which is the answer under the hand, and not to a point before it.
    """
    model = named("velatura")
    monkeypatch.setattr(Space, "_solved", lambda space, x: space.quickly.read(x)[:, 0])
    now = seen(METAL, Target([{"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]), model)
    wish = now.with_energy(0, (0.9,) * 3)
    present = DraggedStack.of(METAL, wish, model)
    assert present is not None
    here = present.point.reading.value
    line = Line(present.point, here, present.space.goal(wish))
    search = _Search.of(line)
    search.go(READINGS[0])
    (reached, read), allowed = search.seen[-1], (line.allowed, search.line.allowed)
    assert search.settled and reached.off < min(allowed) < max(allowed)
    search.seen[-1] = dataclasses.replace(reached, off=float(np.mean(allowed))), read
    monkeypatch.setattr(Space, "_solved", lambda *_: here)
    search.refine(line, 1)
    assert search.landing and search.base[0].part == reached.part > 0.1


@pytest.mark.parametrize("enough", [QUICK, EXACT])
def test_a_search_under_the_hand_is_led_back_to_the_line_as_one_at_rest_is(
    monkeypatch: pytest.MonkeyPatch, enough: float
) -> None:
    """Rationale: of a pair wished far rougher, the first try to lead back to the line ended .17 beside it, and the next
    one, which only the answer at rest had, on the line, .353 of the way. Expected: both have a next one, if the first
    one ends beside the line alone."""
    model, tries = named("velatura"), list[int]()
    monkeypatch.setattr(Space, "_solved", lambda space, x: space.quickly.read(x)[:, 0])
    monkeypatch.setattr(_Search, "go", lambda *_: None)
    monkeypatch.setattr(_Search, "land", lambda _, readings: tries.append(readings))
    monkeypatch.setattr(_Search, "refine", lambda *_: None)
    wish = Target([{"energy": 0.1}, {"energy": 0.1, "base": "conductor"}])
    present = DraggedStack.of(METAL, wish, model)
    assert present is not None
    here, goal = present.point.reading.value, present.space.goal(wish)
    for beside, expected in ((0.0, 1), (0.1, 2)):
        tries.clear()
        origin = here + beside * np.eye(len(here))[-1]
        Line(present.point, origin, goal + origin - here, enough=enough).last(READINGS)
        assert tries == [READINGS[0]] * expected


def test_a_lobe_that_stays_smooth_is_followed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A smooth pair that is wished four times as bright. The least blur would be read as one of .001.

    Expected: the wish, by fewer readings than one search may take, and interfaces that are smooth.
    """
    model, read, readings = named("velatura"), Space._solved, itertools.count()
    pair = Stack([vt.Interface(eta=1.4595), vt.Medium(sigma_a=(0.0223, 0.021, 0.0)), vt.Interface(eta=2.05)])
    now = seen(pair, Target([{"energy": 0.1, "interfaces": 2}]), model)
    monkeypatch.setattr(Space, "_solved", lambda *where: (next(readings), read(*where))[1])
    found = answer(pair, now.with_energy(0, 3.92 * np.array(now.lobes[0].colour)), model)
    assert found.met and next(readings) < 8
    assert [layer.alpha for layer in found.stack.stack.interfaces] == [0.0, 0.0]


def test_a_refusal_of_a_wish_from_a_material_offers_the_nearest_answer_first() -> None:
    """A way out without the material reads the same, "lobe 1 energy 0.36", and comes after one of another form."""
    glass = Stack([vt.Interface(eta=1.5)])
    wish = Target([{"energy": 0.44}])
    found = answer(glass, wish)
    with pytest.raises(Infeasible) as error:
        invert_stack(wish.model_copy(update={"start": glass}), AVERAGED)
    first, *others = error.value.directions
    assert first.target.start == found.stack.stack
    assert first.target.lobes[0].colour == pytest.approx(found.reached.lobes[0].colour)
    assert first.words not in [other.words for other in others]


def test_a_refused_wish_leaves_the_material_as_it_is() -> None:
    """At the bound already: the material itself comes back, so that undo has no step of it."""
    glass = Stack([vt.Interface(eta=4.0)])
    body = {"material": glass.to_dict(), "model": "bati2021"}
    now = appearance.appearance(body)["target"]
    now["lobes"][0]["energy"] = [0.6] * 3
    answered = appearance.invert({**body, "target": now})
    assert answered["snapped"] == "lobe 1: no index up to 4 reflects as much"
    assert answered["material"] == glass.to_dict()


def test_ways_out_bring_what_takes_them() -> None:
    target = {"lobes": [{"energy": [0.06, 0.03, 0.03], "alpha": 0.1}]}
    ways = appearance.ways({"target": target, "model": "bati2021"})["ways"]
    tinted = next(way for way in ways if way["words"] == "a tinted medium above lobe 1")
    found = appearance.invert({"target": tinted["target"], "model": "bati2021"})
    assert found["snapped"] is None and "medium" in found["material"]["layers"][0]
    assert found["target"]["lobes"][0]["energy"] == pytest.approx([0.06, 0.03, 0.03], abs=1e-6)


@pytest.mark.parametrize(("energy", "alpha"), [(0.7, 0.05), (0.97, 0.2), (1.0, 0.4)])
def test_a_pair_wished_brighter_and_blurred_at_once_is_refused_for_what_stops_it(energy: float, alpha: float) -> None:
    """Smooth at first, so that the search begins at a bound of blurs.

    Expected: an index is what ends, since a search among all pairs finds more blur with the energy that is reached, and
    no more energy with that blur.
    """
    pair = Stack([vt.Interface(eta=2.13), vt.Interface(eta=1.54)])
    wish = Target([{"energy": energy, "alpha": alpha, "interfaces": 2}])
    found = answer(pair, wish)
    assert found.reason == "energy"
    reached = found.reached.lobes[0]
    for brighter, blurrier, exists in ((1.0, 1.2, True), (1.1, 1.0, False)):
        lobe = {"energy": brighter * reached.colour[0], "alpha": blurrier * reached.roughness, "interfaces": 2}
        assert (invert.search(Target([lobe]), AVERAGED) is not None) == exists


def test_a_smooth_pair_moves_towards_a_wish_that_is_too_bright() -> None:
    """By the default model, which reads the pair at rest as it does, since no interface of it is rough.

    Expected: what the model in closed form reaches for the same wish, of which this one differs by little.
    """
    pair = Stack([vt.Interface(eta=2.13), vt.Interface(eta=1.54)])
    wish = Target([{"energy": 0.7, "alpha": 0.05, "interfaces": 2}])
    solved, averaged = (answer(pair, wish, model) for model in (named("velatura"), AVERAGED))
    assert solved.reason == averaged.reason == "energy"
    assert solved.part == pytest.approx(averaged.part, rel=0.05)
    assert solved.reached.lobes[0].colour == pytest.approx(averaged.reached.lobes[0].colour, rel=0.02)


def test_a_bound_is_the_same_under_the_hand_and_at_rest() -> None:
    """By the default model, a coat that is wished brighter than its gold allows.

    Expected: the gold below is as bright as metals are, in a channel, and its lobe has stayed.
    """
    model = named("velatura")
    metal = vt.Interface(eta=(0.18, 0.42, 1.37), k=(3.07, 2.35, 1.77), alpha=0.2)
    gold = Stack([vt.Interface(eta=1.5, alpha=0.05), vt.Medium(sigma_a=(0, 0.2, 0.8)), metal])
    now = seen(gold, Target([{"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]), model)
    hand, rest = (answer(gold, now.with_energy(0, (0.4,) * 3), model, quick) for quick in (True, False))
    assert rest.reason in ("bright", "energy")  # the metal and the clear medium above are both at their ends
    assert hand.part == pytest.approx(rest.part, rel=0.02)
    coat, metal = rest.stack.stack.interfaces
    brightest = fresnel.normal_incidence(np.divide(metal.eta, coat.eta), np.divide(metal.k, coat.eta)).max()
    assert brightest == pytest.approx(CONDUCTOR_MAX, abs=1e-6)
    assert np.array(rest.reached.lobes[1].colour) == pytest.approx(now.lobes[1].colour, abs=2e-3)


def test_a_metal_that_is_blurred_more_gives_up_energy_at_rest_as_under_the_hand() -> None:
    """By the default model, a green metal that nothing covers, wished very rough; at rest, several bounds meet.

    Expected: both ways the wished blur, less energy, and the same lobe and reason.
    """
    model = named("velatura")
    metal = Stack([vt.Interface(eta=(2.038, 3.434, 1.288), k=(3.311, 5.821, 1.870), alpha=0.13)])
    now = seen(metal, Target([{"energy": 0.1, "base": "conductor"}]), model)
    hand, rest = (
        answer(metal, now.with_roughness(0, Roughness(0.9, 0.9, 0.0)), model, quick) for quick in (True, False)
    )
    assert (hand.part, hand.reason) == (rest.part, rest.reason) == (1.0, "bright")
    for found in (hand, rest):
        (lobe,) = found.reached.lobes
        assert lobe.roughness == pytest.approx(0.9, abs=1e-3)
        assert np.all(np.array(lobe.colour) < now.lobes[0].colour)
        assert lobe.colour == pytest.approx(now.lobes[0].colour, rel=0.05)


def test_a_wish_far_beyond_what_is_possible_is_approached_by_a_part_of_it() -> None:
    """By the default model, a pair over metal wished brighter than it can be, below two rough interfaces.

    The search for all of the wish leads nowhere. Expected: most of the way, and the other lobes have stayed.
    """
    model = named("velatura")
    metal = vt.Interface(eta=(2.158, 2.503, 1.997), k=(3.149, 3.834, 2.814), alpha=0.3462)
    coats = [vt.Interface(eta=1.229, alpha=0.1246), vt.Interface(eta=1.369, alpha=0.27)]
    tinted = [vt.Interface(eta=1.656, alpha=0.413), vt.Medium(sigma_a=(0.407, 0.0, 0.102)), metal]
    stack = Stack([*coats, *tinted])
    form = [{"energy": 0.1}, {"energy": 0.1}, {"energy": 0.1, "interfaces": 2, "base": "conductor"}]
    now = seen(stack, Target(form), model)
    found = answer(stack, now.with_energy(2, 3.57 * np.array(now.lobes[2].colour)), model, quick=True)
    assert found.part > 0.7
    for k in range(2):
        assert found.reached.lobes[k].colour == pytest.approx(now.lobes[k].colour, rel=1e-3)


def test_a_wish_that_a_part_of_it_leads_to_is_met() -> None:
    """By the default model, a coat whose energy is to be two thirds more, over a pair and a metal. The search from the
    present stack leads nowhere, and from half of the way it leads to all of it. Expected: the model reads the wish."""
    model = named("velatura")
    metal = vt.Interface(eta=(0.942, 0.709, 0.709), k=(1.124, 0.709, 0.709), alpha=0.4216)
    coats = [vt.Interface(eta=1.1446, alpha=0.1403), vt.Interface(eta=1.6555, alpha=0.3565)]
    tinted = [vt.Medium(sigma_a=(0.0221, 0.0, 0.0365)), vt.Interface(eta=1.0026, alpha=0.205)]
    stack = Stack([*coats, *tinted, vt.Medium(sigma_a=(0.0, 0.1329, 0.5226)), metal])
    form = [{"energy": 0.1}, {"energy": 0.1, "interfaces": 2}, {"energy": 0.1, "base": "conductor"}]
    now = seen(stack, Target(form), model)
    wish = now.with_energy(0, (0.00764,) * 3)
    found = answer(stack, wish, model)
    assert found.met
    for lobe, own in zip(wish.lobes, seen(found.stack.stack, wish, model).lobes):
        assert own.colour == pytest.approx(lobe.colour, abs=1e-5)
        assert own.roughness == pytest.approx(lobe.roughness, abs=1e-4)


@pytest.mark.parametrize("model", ["bati2021", "velatura"])
def test_a_lobe_of_three_interfaces_is_dragged(model: str) -> None:
    """Expected: a brighter lobe with the blur that it had; of one beyond all dielectrics most of the way, by what
    a search of all finds."""
    chosen = named(model)
    triple = invert_stack([{"energy": 0.2, "alpha": 0.1, "interfaces": 3}], chosen).stack
    now = seen(triple, Target([{"energy": 0.1, "interfaces": 3}]), chosen)
    found = answer(triple, now.with_energy(0, (0.26,) * 3), chosen)
    assert found.met and found.reached.lobes[0].roughness == pytest.approx(0.1, abs=1e-4)
    assert found.reached.lobes[0].colour[0] == pytest.approx(0.26, abs=1e-5)
    beyond = answer(triple, now.with_energy(0, (0.7,) * 3), chosen)
    assert not beyond.met and 0.38 < beyond.reached.lobes[0].colour[0] < 0.7


def beyond(stack: Stack, form: list[dict[str, Any]], lobe: int, **wished: Any) -> tuple[Nearest, Nearest, Target]:
    """Answers of the default model, under the hand and at rest, to a wish beyond all stacks, and the present lobes."""
    model = named("velatura")
    now = seen(stack, Target(form), model)
    wish = now.with_lobe(lobe, **wished)
    hand, rest = (answer(stack, wish, model, quick) for quick in (True, False))
    return hand, rest, now


def test_a_rough_stack_that_is_wished_far_rougher_has_the_same_bound_under_the_hand_and_at_rest() -> None:
    """Two coats over a metal, whose second lobe is wished at an alpha of .9: what scatters above the metal ends it.

    Expected: both bounds alike, and further than .172 of the way, where bisection ended; other lobes within .5 %.
    """
    metal = vt.Interface(eta=(1.9985, 2.0561, 2.0365), k=(2.7622, 2.8839, 2.8428), alpha=0.327)
    coats = [vt.Interface(eta=1.2208, alpha=0.1165), vt.Medium(sigma_a=(0.0113, 0.0428, 0.0))]
    second = [vt.Interface(eta=1.722, alpha=0.2144), vt.Medium(sigma_a=(0.1129, 0.2437, 0.2178))]
    form: list[dict[str, Any]] = [{"energy": 0.1}, {"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]
    hand, rest, now = beyond(Stack([*coats, *second, metal]), form, 1, alpha=0.9)
    assert not rest.met and not hand.met
    assert hand.part == pytest.approx(rest.part, abs=0.02)
    assert min(hand.part, rest.part) > 0.19
    for found in (hand, rest):
        for k in (0, 2):
            assert found.reached.lobes[k].colour == pytest.approx(now.lobes[k].colour, rel=0.005)


def test_a_brushed_stack_that_is_wished_far_brighter_has_the_same_bound_under_the_hand_and_at_rest() -> None:
    """A smooth coat over brushed layers, wished more than ten times as bright: its index ends at 4.

    Expected: both bounds there, since a smooth interface of index 4 reflects (3/5)^2.
    """
    brushed = vt.Interface(eta=1.3495, alpha=(0.1167, 0.0386), rotation=127.5)
    metal = vt.Interface(eta=(2.545, 2.0635, 2.591), k=(4.087, 3.171, 4.173), alpha=(0.2627, 0.1241), rotation=65.2)
    form: list[dict[str, Any]] = [{"energy": 0.1}, {"energy": 0.1}, {"energy": 0.1, "base": "conductor"}]
    hand, rest, _ = beyond(Stack([vt.Interface(eta=1.634), brushed, metal]), form, 0, energy=0.6026)
    assert hand.part == pytest.approx(rest.part, abs=0.005)
    for found in (hand, rest):
        assert found.reached.lobes[0].colour[0] == pytest.approx(0.36, abs=2e-3)
