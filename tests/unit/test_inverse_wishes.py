"""Wishes beyond lobes at normal incidence.

Truth: limits that have formulas, brute searches, and the model's own reading of the answer; `benchmarks/wishes.py`
holds answers against random walks.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura.inverse import Infeasible, Target, answer, answers, invert_stack
from velatura.inverse.answer import nearest_answers
from velatura.inverse.wishes import KINDS
from velatura.inverse.wishes.passed import haze, roughness
from velatura.inverse.wishes.wish import compared
from velatura.model import named
from velatura.stack import Diffuse, Interface, Medium, Mix, Stack
from velatura.stack.spectra import lab
from velatura.stack.values import Film

PANE = Stack([Interface(eta=1.5, alpha=0.1), Medium(depth=1.0, sigma_a=0.1), Interface(eta=1.0, alpha=0.1)])
CLEAR = Stack([PANE.layers[0], PANE.layers[2]])
PLASTIC = Stack([Interface(eta="polystyrene", alpha=0.1), Diffuse(albedo=0.5)])
COATED = Stack([Interface(eta=1.5, alpha=0.1), Medium(sigma_a=0.1), Interface(eta=1.5, k=3.0, alpha=0.2)])
OXIDE = Stack([Interface(eta=(2.7, 2.5, 2.2), k=(3.8, 3.4, 3.0), films=(Film(eta=2.4, thickness_nm=50.0),))])
RED, BLUE = (Stack([Diffuse(albedo=albedo)]) for albedo in ((0.8, 0.1, 0.1), (0.1, 0.2, 0.6)))
DUST = Mix([(0.5, Stack([Interface(eta=1.5), Diffuse(albedo=0.1)])), (None, Stack([Diffuse(albedo=0.6)]))])
PIGMENTED = Stack([PANE.layers[0], Medium(pigments=[{"K": 0.1, "S": 0.2, "concentration": 0.5}]), PANE.layers[2]])
PAIR = [{"energy": 0.15, "alpha": 0.1, "interfaces": 2}]

#: A wish that can be met of each kind, and the keys of values that may change for it.
WISHES: dict[str, tuple[dict[str, Any], set[str]]] = {
    "grazing": ({"lobes": PAIR, "grazing": {"energy": 0.25}}, set()),
    "passed": ({"start": PANE, "passed": {"energy": (0.5, 0.3, 0.6), "haze": 0.7}}, {"sigma_a", "alpha_u", "alpha_v"}),
    "body": ({"start": PLASTIC, "body": {"energy": (0.2, 0.05, 0.3)}}, {"albedo"}),
    "film": ({"start": OXIDE, "film": {"energy": (0.3, 0.2, 0.1), "thickest_nm": 200.0}}, {"film0_thickness_nm"}),
    "mixture": ({"start": DUST, "mixture": {"energy": 0.45}}, {"weight"}),
}


@pytest.mark.parametrize("model", ["velatura", "bati2021"])
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "film"])
def test_the_answer_has_what_is_asked_for(kind: str, model: str) -> None:
    """Expected: what the model reads of the stack is the wish; lobes are those that were asked for."""
    target = Target(**WISHES[kind][0])
    found = answer(target, model)
    assert found.met
    for wish, has in zip(target.further, found.reached.further):
        assert has.goal == pytest.approx(wish.goal, abs=1e-3)
    for lobe, own in zip(target.lobes, found.reached.lobes):
        assert own.colour == pytest.approx(lobe.colour, rel=1e-3)
        assert own.axes == pytest.approx(lobe.axes, abs=1e-3)


@pytest.mark.parametrize("kind", [kind for kind, (wish, _) in WISHES.items() if "start" in wish])
def test_what_no_wish_is_about_stays(kind: str) -> None:
    """Expected: other values are those of the present material, by name where they had one."""
    wish, moving = WISHES[kind]
    start, found = wish["start"], answer(wish, "weier2020").stack
    changed = {key.partition("_")[2] for key, value in found.flat().items() if value != start.flat()[key]}
    assert changed and changed <= moving


def test_weights_of_chalks_are_those_of_their_albedos() -> None:
    """The limit: nothing lies above the bases, of which one is a mixture itself, and light adds up."""
    wish = {
        "start": Mix([(0.2, RED), (None, Mix([(0.5, BLUE), (None, RED)]))]),
        "mixture": {"energy": (0.59, 0.13, 0.25)},
    }
    assert answer(wish).stack.flat()["part0_weight"] == pytest.approx(0.4, abs=1e-4)


def test_no_other_weights_have_a_nearer_colour() -> None:
    """Truth: all weights of three chalks in steps of .01; a grey brighter than all that they give."""
    albedos = np.array([[0.8, 0.1, 0.1], [0.1, 0.2, 0.6], [0.3, 0.5, 0.1]])
    mix = Mix(zip((0.2, 0.3, None), (Stack([Diffuse(albedo=tuple(each))]) for each in albedos)))
    found = nearest_answers(Target(start=mix, mixture={"energy": 0.6}), 1, named("velatura"))[0]
    shares = np.array([(a, b, 1 - a - b) for a in np.linspace(0, 1, 101) for b in np.linspace(0, 1 - a, 101)])
    brute = float(np.linalg.norm(lab(shares @ albedos) / 100 - compared(0.6, None), axis=1).min())
    assert not found.met and brute - 1e-3 < found.missed <= brute + 1e-6


def test_a_start_may_be_named_like_a_preset() -> None:
    by_name, itself = (Target(start=start, body={"energy": 0.2}) for start in ("red-enamel", vt.preset("red-enamel")))
    assert by_name == itself


def test_a_base_alone_has_the_albedo_that_is_seen() -> None:
    """The limit: nothing lies above it."""
    found = answer({"start": Stack([Diffuse(albedo=0.9)]), "body": {"energy": (0.1, 0.3, 0.8)}}).stack
    assert found.flat()["layer0_albedo"] == pytest.approx((0.1, 0.3, 0.8), abs=1e-4)


def test_a_base_alone_looks_the_same_at_grazing() -> None:
    """The limit: no interface reflects in a lobe."""
    chalk = {"start": Stack([Diffuse(albedo=0.5)]), "grazing": {"energy": 0.5}}
    assert answer(chalk, "bati2021").missed < 1e-6


def test_a_medium_without_interfaces_passes_light_by_its_depth() -> None:
    """The limit: an index of 1 reflects nothing, and of light at 60 degrees exp(-2 sigma_a) passes."""
    slab = Stack([Interface(eta=1.0), Medium(depth=1.0, sigma_a=0.1), Interface(eta=1.0)])
    found = answer({"start": slab, "passed": {"energy": (0.5, 0.2, 0.9), "angle": 60}}).stack
    assert found.flat()["layer1_sigma_a"] == pytest.approx(tuple(-0.5 * np.log([0.5, 0.2, 0.9])), abs=1e-4)


def test_haze_is_the_share_of_a_lobe_beyond_two_and_a_half_degrees() -> None:
    """Truth: facets with GGX slopes, of which half-vectors tilted by t turn light by 2 t."""
    tilt = np.linspace(0, np.pi / 2, 400_001)[:-1]
    for alpha in (0.01, 0.05, 0.3):
        ggx = alpha**2 / (np.pi * np.cos(tilt) ** 4 * (alpha**2 + np.tan(tilt) ** 2) ** 2)
        share = 2 * np.pi * ggx * np.cos(tilt) * np.sin(tilt)
        beyond = np.trapezoid(np.where(tilt > np.radians(1.25), share, 0), tilt) / np.trapezoid(share, tilt)
        assert haze(alpha) == pytest.approx(beyond, abs=1e-4)
        assert roughness(haze(alpha)) == pytest.approx(alpha)


def test_no_other_thickness_has_a_nearer_colour() -> None:
    """Truth: all thicknesses in steps of 8 nm. Expected also: others are nearer than those beside them."""
    wish = Target(start=OXIDE, film={"energy": (0.1, 0.3, 0.25), "thickest_nm": 250.0})

    def missed(nm: float) -> float:
        seen = vt.lobes(OXIDE.replace(layer0_film0_thickness_nm=nm), 1.0, model="weier2020")
        return float(np.linalg.norm(compared(seen.energy[0][:, 0], None) - wish.further[0].goal))

    found = answers(wish, 2, "weier2020")
    first, *others = (each.stack.flat()["layer0_film0_thickness_nm"] for each in found)
    brute = min(missed(float(nm)) for nm in range(1, 251, 8))
    assert missed(first) <= brute + 1e-6
    assert len(others) == 1
    for nm in others:
        assert missed(first) <= missed(nm) <= min(missed(nm - 2), missed(min(nm + 2, 250)))


def test_a_thickness_stays_within_its_bounds() -> None:
    wish = {"energy": (0.1, 0.3, 0.25), "thinnest_nm": 20.0, "thickest_nm": 40.0}
    found = answer(Target(start=OXIDE, film=wish), "weier2020")
    assert 20 - 1e-9 <= found.stack.flat()["layer0_film0_thickness_nm"] <= 40 + 1e-9


def test_a_wish_at_grazing_keeps_the_lobes_of_the_present_material() -> None:
    """Expected: less energy there, by a metal of another tint, and the same lobes."""
    found = answer({"start": COATED, "grazing": {"energy": 0.42, "angle": 70}}, "bati2021")
    before, after = (vt.lobes(stack, 1.0, model="bati2021") for stack in (COATED, found.stack))
    assert np.allclose(before.energy, after.energy, atol=1e-3)
    assert np.allclose(before.alpha, after.alpha, atol=2e-3)


@pytest.mark.parametrize("model", ["velatura", "bati2021"])
@pytest.mark.parametrize(("lobe", "key"), [(1, "energy"), (1, "alpha"), (2, "energy"), (2, "alpha")])
def test_a_lobe_at_grazing_gives_way_at_normal_incidence_in_what_is_asked(lobe: int, key: str, model: str) -> None:
    """Expected: the lobe has what is asked for at 70 degrees; at normal incidence the other lobe and the rest stay."""
    before = vt.lobes(COATED, np.cos(np.radians([0, 70])), model=model)
    energy, alpha = before.energy[lobe - 1][:, 1], before.alpha[lobe - 1][:, 1]
    asked = {"energy": tuple((0.9 * energy).tolist()), "alpha": 0.9 * float(alpha.mean())}[key]
    found = answer({"start": COATED, "grazing": {"lobe": lobe, key: asked, "angle": 70}}, model)
    after = vt.lobes(found.stack, np.cos(np.radians([0, 70])), model=model)
    own = {"energy": after.energy[lobe - 1][:, 1], "alpha": after.alpha[lobe - 1][:, 1].mean()}[key]
    assert own == pytest.approx(asked, abs=1e-3)
    kept = [(n, each) for n in (0, 1) for each in ("energy", "alpha") if (n, each) != (lobe - 1, key)]
    for n, each in kept:
        assert getattr(after, each)[n][:, 0] == pytest.approx(getattr(before, each)[n][:, 0], abs=2e-3)


@pytest.mark.parametrize(
    ("wish", "why"),
    [
        ({"start": CLEAR, "passed": {"energy": 0.5}}, "passed: no medium absorbs"),
        ({"start": CLEAR, "body": {"energy": 0.2}}, "body: no medium scatters"),
        ({"start": COATED, "film": {"energy": 0.2, "thickest_nm": 100.0}}, "film: no interface has films"),
        ({"start": DUST, "mixture": {"energy": 0.9}}, "no weights of these parts give mixture energy 0.9"),
        ({"start": PANE, "passed": {"energy": 0.99}}, "no stack of these layers is found that has passed energy 0.99"),
        (
            {"start": COATED, "grazing": {"energy": 0.9}},
            "no stack of these layers with its lobes is found that has graz",
        ),
        (
            {"start": COATED, "grazing": {"energy": 0.9, "lobe": 1}},
            "no stack of these layers with the rest of its lobes is found that has graz",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_a_way_out_that_can(wish: dict[str, Any], why: str) -> None:
    with pytest.raises(Infeasible) as caught:
        answer(wish, "bati2021")
    assert caught.value.why.startswith(why)
    assert answer(caught.value.directions[0].target.to_dict(), "bati2021").stack.flat()


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ({"start": COATED, "passed": {"energy": 0.2}}, "passed: layer 2 (conductor) is opaque; end the stack"),
        ({"start": COATED, "body": {"energy": 0.2}}, "body: no medium scatters, and layer 2 (conductor) is no diffuse"),
        ({"start": COATED, "grazing": {"energy": 0.2, "lobe": 3}}, "grazing: lobe: the material has 2, got 3"),
        ({"lobes": PAIR, "grazing": {"energy": 0.2, "lobe": 2}}, "grazing: lobe: the target has 1, got 2"),
        ({"start": COATED, "grazing": {"alpha": 0.2}}, "grazing: alpha: is of one lobe; write lobe"),
        ({"start": PANE, "passed": {}}, "passed: must ask for energy or alpha or haze"),
        ({"start": PANE, "passed": {"alpha": 0.1, "haze": 0.1}}, "passed: haze: not together with alpha"),
        ({"start": PANE, "passed": {"haze": 0.1, "angle": 10}}, "passed: haze: is that at normal incidence"),
        ({"start": PANE, "passed": {"energy": 1.5}}, "passed: energy: must lie in 0 to 1, got 1.5"),
        ({"start": PANE, "passed": [{"energy": 0.5}] * 5}, "passed: must be a mapping of angle, energy, alpha, haze"),
        (
            {"start": OXIDE, "film": [{"energy": 0.5}] * 2},
            "film: must be a mapping of angle, energy, layer, film, thin",
        ),
        (
            {"start": OXIDE, "film": {"energy": 0.5, "thinnest_nm": 2000.0}},
            "film: thickest_nm: must be above thinnest_nm",
        ),
        ({"lobes": PAIR, "available": []}, "available: must be a list of 24 indices, names of substances, or lacqu"),
        ({"lobes": PAIR, "available": ["watr"]}, "available: eta: unknown name 'watr' (did you mean water?)"),
        ({"lobes": PAIR, "available": ["Au"]}, "available: holds no substance for any interface; name dielectrics"),
        ({"available": ["water"]}, "lobes: must hold at least one lobe; without any, write a start"),
        ({"lobes": PAIR, "available": [{"eta": 1.5}]}, "available: sigma_a: missing"),
        ({"lobes": PAIR, "available": [True]}, "available: must hold indices, names of substances, or lacquers, got"),
        ({"lobes": PAIR, "thinnest": -1}, "thinnest: must lie in 0 to 1e9, got -1"),
        ({"start": PIGMENTED, "thinnest": 2}, "thinnest: layer 1 has a depth of 1, which its pigments need"),
        (
            {"start": DUST, "mixture": {"energy": 0.4}, "thinnest": 1},
            "start: the inverse takes a single stack, not a mix",
        ),
        ({"start": PANE, "mixture": {"energy": 0.5}}, "mixture: chooses weights; write a start with mix"),
        ({"start": DUST, "body": {"energy": 0.5}}, "start: the inverse takes a single stack, not a mixture, of which"),
        (
            {"start": "worn-painted-steel", "mixture": {"energy": 0.5}},
            "part0_weight: is a texture, and is to be chosen",
        ),
        ({"start": "pane.yaml", "body": {"energy": 0.5}}, "start: unknown preset 'pane.yaml'"),
        ({"start": PANE, "passed": {"colour": 1}}, "passed: unknown key 'colour'"),
        ({"passed": {"energy": 0.5}}, "lobes: must hold at least one lobe; without any, write a start"),
        ({}, "lobes: must hold at least one lobe, or grazing, passed, body, film, mixture, available, th"),
    ],
)
def test_what_is_no_wish_is_refused_in_one_line(wish: dict[str, Any], words: str) -> None:
    with pytest.raises(vt.InvalidInput) as caught:
        answer(wish, "bati2021")
    assert str(caught.value).startswith(words) and "\n" not in str(caught.value)


def test_a_wish_is_read_as_it_is_written() -> None:
    for wish, _ in WISHES.values():
        target = Target(**wish)
        assert Target.from_dict(target.to_dict()) == target


def test_a_search_for_lobes_alone_takes_no_other_wish() -> None:
    with pytest.raises(vt.InvalidInput, match="passed: is no wish for lobes; velatura invert"):
        invert_stack(WISHES["passed"][0], "bati2021")
    found = answer(PAIR, "bati2021")
    assert found.met and found.stack == invert_stack(PAIR, "bati2021").stack


def test_what_is_fixed_above_the_first_lobe_stays() -> None:
    lobes = [{"energy": (0.1, 0.12, 0.14), "alpha": 0.1, "interfaces": 2, "fixed": {"tau": [0.2, None]}}]
    found = answer({"lobes": lobes, "grazing": {"energy": (0.08, 0.1, 0.12), "angle": 70}}, "bati2021").stack
    assert found.kinds[0] == "medium"
    assert found.layers[0].flat()["sigma_a"] == pytest.approx(0.2)


def test_pigments_stay_where_something_else_may_change() -> None:
    """Expected: the coat is rougher, and the medium has the pigments that it had."""
    found = answer({"start": PIGMENTED, "passed": {"haze": 0.97}}, "velatura").stack
    assert found.layers[1] == PIGMENTED.layers[1]
    assert found.interfaces[0].alpha > 0.1


# Substances that are available ---------------------------------------------------------------------------------------


def test_a_stack_of_available_substances_is_found_by_its_lobes() -> None:
    """Truth: the stack whose lobes are asked for.

    Expected: its substances by name first, then others, ever further off; what is fixed stays.
    """
    true = Stack([Interface(eta="bk7", alpha=0.1), Medium(sigma_a=0.2), Interface(conductor="Cu", alpha=0.2)])
    seen = vt.lobes(true, 1.0, model="bati2021")
    top, metal = (
        {"energy": tuple(energy[:, 0].tolist()), "alpha": float(alpha[0, 0])}
        for energy, alpha in zip(seen.energy, seen.alpha)
    )
    wish = {"lobes": [top, {**metal, "base": "conductor"}], "available": ["water", "bk7", 1.8, "Au", "Cu", "Al"]}
    first, *others = answers(wish, 4, "bati2021")
    assert (first.stack.interfaces[0].eta, first.stack.interfaces[1].conductor) == ("bk7", "Cu")
    assert first.met and first.stack.interfaces[0].alpha == pytest.approx(0.1, abs=1e-3)
    assert len(others) == 3
    assert [each.missed for each in others] == sorted(each.missed for each in others)
    for each in others:
        assert each.stack.interfaces[0].eta in ("water", "bk7", 1.8)
        assert each.stack.interfaces[1].conductor in ("Au", "Cu", "Al")
    pinned = {"lobes": [{**top, "fixed": {"eta": [1.33]}}, wish["lobes"][1]], "available": ["bk7", "Cu"]}
    assert answer(pinned, "bati2021").stack.interfaces[0].eta == pytest.approx(1.33)


def test_a_material_is_made_of_what_is_available() -> None:
    """Expected: the lobes of the present material, as near as its substances come; where it has these, itself."""
    wish = {"start": COATED, "available": [1.5, "water", "Au"]}
    near = answer(wish, "bati2021")
    assert near.stack.interfaces[0].eta == 1.5 and near.stack.interfaces[1].conductor == "Au"
    assert near.reached.lobes[0].colour == pytest.approx(near.target.lobes[0].colour, rel=1e-3)
    same = answer({"start": near.stack, "available": [1.5, "Au"]}, "bati2021")
    assert same.met and [same.stack.flat()[key] for key in ("layer1_sigma_a", "layer2_alpha_u")] == [
        pytest.approx(near.stack.flat()[key], abs=1e-3) for key in ("layer1_sigma_a", "layer2_alpha_u")
    ]


@pytest.mark.parametrize(("thinnest", "depth"), [(0.0, 2.5), (1.0, 2.5), (4.0, 4.0)])
def test_a_lacquer_is_laid_as_thick_as_its_colour_asks_for(thinnest: float, depth: float) -> None:
    """Truth: the stack whose lobes are asked for, with 2.5 of the lacquer; a thicker one is darker."""
    red = {"eta": 1.5, "sigma_a": (0.02, 0.2, 0.3)}
    true = Stack([Interface(eta=1.5, alpha=0.1), Medium(depth=2.5, sigma_a=red["sigma_a"]), Interface(conductor="Al")])
    found = answer({"start": true, "available": [red, "Al"], "thinnest": thinnest}, "bati2021")
    coat = found.stack.layers[1].flat()
    assert coat["sigma_a"] == red["sigma_a"] and coat["depth"] == pytest.approx(depth, rel=1e-3)
    assert found.met == (depth == 2.5)


def test_coats_are_at_least_so_thick() -> None:
    """Expected: media of that depth, clear ones included, with the optical depths that others have without."""
    free, thick = (answer({"lobes": PAIR, "thinnest": thinnest}, "bati2021") for thinnest in (1e-3, 25.0))
    thin, coat = (each.stack.layers[1].flat() for each in (free, thick))
    assert thick.met and coat["depth"] == 25
    assert np.multiply(coat["sigma_a"], 25) == pytest.approx(np.multiply(thin["sigma_a"], thin["depth"]))
    before, after = (vt.lobes(each.stack, 1.0, model="bati2021").energy for each in (free, thick))
    assert np.allclose(before, after, atol=1e-9)
