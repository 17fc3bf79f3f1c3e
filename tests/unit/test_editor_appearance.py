"""The Appearance panel's verbs: materials as lobes, drags, maps of classes, and what must hold of every answer."""

from __future__ import annotations

import base64
import copy
import json
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura.editor import appearance, class_maps
from velatura.editor.service import VERBS
from velatura.errors import InvalidInput
from velatura.inverse import Target, invert
from velatura.inverse.coats import scattered
from velatura.inverse.local.coordinates import Space
from velatura.inverse.local.dragged import DraggedStack
from velatura.inverse.nearest import nearest
from velatura.model import named
from velatura.model.roughness_maps import MAPS
from velatura.model.variance import Covariance, Roughness
from velatura.stack import Interface, Medium, Named, Stack, presets, rgb

pytestmark = pytest.mark.usefixtures("one_thread")

EXACT = 1e-6  # of energies and variances, at normal incidence
MODELS = ("bati2021", "belcour2018", "velatura")
COATED = {
    "layers": [
        {"interface": {"eta": 1.5, "alpha": 0.05}},
        {"medium": {"sigma_a": [0.1, 0.2, 0.3]}},
        {"interface": {"conductor": "Cu", "alpha": 0.2}},
    ]
}


def saved(name: str) -> dict[str, Any]:
    return next(state for state in appearance.targets({})["targets"] if state["name"] == name)


def deviation(material: dict[str, Any], target: dict[str, Any], model: str) -> float:
    """The largest difference of energies and variances between what is read of a material and a target."""
    read, f = vt.lobes(Stack.from_dict(material), 1.0, model=model), MAPS[named(model).map]
    worst, first = 0.0, 0
    for lobe in target["lobes"]:
        own = slice(first, first := first + lobe["interfaces"])
        worst = max(worst, float(np.abs(np.sum(read.energy[own], axis=0)[:, 0] - lobe["energy"]).max()))
        u, v = np.broadcast_to(lobe["alpha"], 2)
        wanted = Covariance.of(Roughness(u, v, np.radians(lobe["rotation"])), f)
        for alpha, rotation in zip(read.alpha[own], read.rotation[own]):
            has = Covariance.of(Roughness(alpha[0, 0], alpha[1, 0], rotation[0]), f)
            worst = max(worst, *(float(abs(a - b)) for a, b in zip(vars(has).values(), vars(wanted).values())))
    return worst


def check_physical(material: dict[str, Any], eta_max: float = 4.0) -> None:
    for layer in Stack.from_dict(material).layers:
        if isinstance(layer, Medium):
            assert np.min(layer.sigma_a) >= 0
        elif isinstance(layer, Interface):
            eta, k = np.array(layer.eta), layer.k
            assert 0 <= layer.alpha <= 1
            assert (np.all((eta >= 1) & (eta <= eta_max * (1 + 1e-7)))) if k is None else np.all(np.array(k) >= eta)


def dragged(target: dict[str, Any], rng: np.random.Generator, size: float = 0.08) -> dict[str, Any]:
    """A target with one lobe brighter or darker, of another colour, or more or less blurred."""
    wish = copy.deepcopy(target)
    lobe, what, factor = wish["lobes"][rng.integers(len(wish["lobes"]))], rng.integers(3), np.exp(size * rng.normal())
    if what == 0:
        lobe["energy"] = [e * factor for e in lobe["energy"]]
    elif what == 1:
        lobe["energy"][rng.integers(3)] *= factor
    else:
        lobe["alpha"] = min(lobe["alpha"] * factor + (0.002 if rng.random() < 0.2 else 0), 1.0)
    return wish


# A material as lobes -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
def test_a_material_is_read_and_found_again(model: str) -> None:
    answer = appearance.appearance({"material": COATED, "model": model})
    target = answer["target"]
    assert answer["says"] is None
    assert answer["layers"] == [[0], [1, 2]]
    assert [(lobe["interfaces"], lobe["base"]) for lobe in target["lobes"]] == [(1, "dielectric"), (1, "conductor")]
    assert deviation(COATED, target, model) < 1e-9
    f = MAPS[named(model).map]
    variances = [float(f.variance(lobe["alpha"])) for lobe in target["lobes"]]
    (haze,) = answer["haze"]
    assert haze["width"] == pytest.approx(np.sqrt(variances[1] / variances[0]))
    ratio = np.array(target["lobes"][1]["energy"]) / target["lobes"][0]["energy"]
    assert haze["energy"] == pytest.approx(ratio)
    same = appearance.invert({"material": COATED, "target": target, "model": model})
    assert deviation(same["material"], target, model) < 1e-6
    given, found = Stack.from_dict(COATED).flat(), Stack.from_dict(same["material"]).flat()
    for key in ("layer0_eta", "layer0_alpha_u"):
        assert found[key] == pytest.approx(given[key], abs=1e-6)
    # A metal by name becomes one in numbers, which has other colours in the default model
    error = 0.01 if model == "velatura" else 1e-5
    assert found["layer2_alpha_u"] == pytest.approx(given["layer2_alpha_u"], abs=0.1 * error)
    assert found["layer2_eta"] == pytest.approx(vt.stack.rgb(given["layer2_eta"]), abs=error)


@pytest.mark.parametrize("name", presets(mixtures=False))
def test_every_preset_is_read_or_says_why_not(name: str) -> None:
    material = appearance.document(vt.preset(name))
    answer = appearance.appearance({"material": material, "model": "bati2021"})
    json.dumps(answer, allow_nan=False)
    if answer["says"] is None:
        again = appearance.invert({"material": material, "target": answer["target"], "model": "bati2021"})
        assert again["snapped"] is None
        assert deviation(again["material"], answer["target"], "bati2021") < EXACT
    else:
        assert "\n" not in answer["says"]
        assert answer["says"].startswith(("layer ", "thin"))


def test_lobes_have_their_own_base_also_where_they_are_only_shown() -> None:
    for name, bases in (("coated-gold", ["dielectric", "conductor"]), ("frosted-glass", ["dielectric"] * 2)):
        answer = appearance.appearance({"material": appearance.document(vt.preset(name))})
        assert [lobe["base"] for lobe in answer["target"]["lobes"]] == bases
    brushed = {"interface": {"eta": 1, "alpha": [0.1, 0.3], "rotation": 30}}
    pane = {"thin": True, "layers": [{"interface": {"eta": 1.5}}, brushed]}
    answer = appearance.appearance({"material": pane, "model": "weier2020"})
    assert answer["says"].startswith("thin: ") and answer["target"]["lobes"][1]["base"] == "dielectric"
    assert deviation(pane, answer["target"], "weier2020") < EXACT


@pytest.mark.parametrize("model", ["bati2021", "velatura"])
def test_an_interface_keeps_its_films_while_lobes_are_dragged(model: str) -> None:
    """Its lobes are those of the material, and what a wish changes is all but its films."""
    coat, medium, metal = copy.deepcopy(COATED["layers"])
    metal["interface"]["films"] = [{"eta": 2.0, "thickness_nm": 120}]
    material = {"layers": [coat, medium, metal]}
    found = appearance.appearance({"material": material, "model": model})
    assert found["says"] is None
    read = vt.lobes(Stack.from_dict(material), 1.0, model=model).energy
    np.testing.assert_allclose([lobe["energy"] for lobe in found["target"]["lobes"]], np.array(read)[..., 0], atol=1e-9)
    body = {"material": material, "target": found["target"], "model": model}
    again = appearance.invert(body)["target"]["lobes"]
    np.testing.assert_allclose([lobe["energy"] for lobe in again], np.array(read)[..., 0], atol=1e-6)

    # A brighter metal below an oxide, under a sharper coat
    wish = copy.deepcopy(found["target"])
    wish["lobes"][1]["energy"] = [1.1 * e for e in wish["lobes"][1]["energy"]]
    wish["lobes"][0]["alpha"] = 0.5 * wish["lobes"][0]["alpha"]
    for read_before in (None, found["target"]):
        answer = appearance.invert(body | {"target": wish} | ({"read": read_before} if read_before else {}))
        assert answer["snapped"] is None
        stack = Stack.from_dict(answer["material"])
        assert stack.interfaces[1].films == (vt.Film(eta=2.0, thickness_nm=120),)
        energies = [e[:, 0] for e in vt.lobes(stack, 1.0, model=model).energy]
        # While a drag is held, lobes are approximate
        np.testing.assert_allclose(
            energies, [lobe["energy"] for lobe in wish["lobes"]], atol=2e-2 if read_before else 1e-6
        )
    with pytest.raises(InvalidInput, match=r"^lobe 2: has no map of its class, since thin films"):
        class_maps.class_(body | {"lobe": 1})
    assert class_maps.class_(body | {"lobe": 0})["kind"] == "dielectric"


def test_a_pair_of_one_blur_is_one_lobe() -> None:
    state = saved("bati2021-17-red-over-blue")
    answer = appearance.appearance({"material": state["material"], "model": "bati2021"})
    assert [lobe["interfaces"] for lobe in answer["target"]["lobes"]] == [2, 2]
    for read, asked in zip(answer["target"]["lobes"], state["target"]["lobes"]):
        assert read["energy"] == pytest.approx(asked["energy"], abs=EXACT)


# Dragging ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ["15-c", "16", "19-b", "22-top"])
def test_drags_stay_physical_and_exact(name: str, model: str) -> None:
    rng = np.random.default_rng(0)
    state = appearance.invert({"target": saved(f"bati2021-{name}")["target"], "model": model})
    for _ in range(12 if named(model).closed_form else 4):
        wish = dragged(state["target"], rng)
        state = appearance.invert({"target": wish, "material": state["material"], "model": model})
        check_physical(state["material"])
        assert deviation(state["material"], state["target"], model) < EXACT
        if state["snapped"] is None:
            assert deviation(state["material"], wish, model) < EXACT


def test_answers_to_a_held_drag_are_approximate_and_exact_where_it_rests() -> None:
    """Of `velatura`, which has no closed form: a tenth of the lobes, in small steps."""
    state = appearance.invert({"target": saved("bati2021-22-top")["target"], "model": "velatura"})
    for _ in range(2):
        wish, read = copy.deepcopy(state["target"]), state["target"]
        wish["lobes"][1]["energy"] = [0.98 * e for e in wish["lobes"][1]["energy"]]
        wish["lobes"][1]["alpha"] *= 1.02
        asked = {"target": wish, "material": state["material"], "model": "velatura"}
        state = appearance.invert({**asked, "read": read})
        assert state["rough"]
        assert deviation(state["material"], state["target"], "velatura") < 1e-3
    found = appearance.invert({**asked, "material": state["material"]})
    assert "rough" not in found
    assert deviation(found["material"], wish, "velatura") < EXACT
    body = {"target": found["target"], "lobe": 1, "material": found["material"], "model": "velatura"}
    near = class_maps.class_(body)["member"]
    for rough in (True, False):
        moved = class_maps.member(
            {**body, "point": [1.02 * near[0], *near[1:]], **({"read": body["target"]} if rough else {})}
        )
        assert deviation(moved["material"], found["target"], "velatura") < (1e-3 if rough else EXACT)


BRUSHED: dict[str, Any] = {
    "layers": [
        {"interface": {"eta": 1.5, "alpha": [0.05, 0.1], "rotation": -10}},
        {"medium": {"sigma_a": [0.1, 0.2, 0.3]}},
        {"interface": {"conductor": "Cu", "alpha": [0.2, 0.3], "rotation": 130}},
    ]
}


@pytest.mark.parametrize("model", ["weier2020", "yamaguchi2019", "velatura"])
def test_brushed_lobes_are_dragged_along_both_axes_and_turned(model: str) -> None:
    """Axes keep their names, and directions within half a turn, while they are dragged beyond it."""
    here = appearance.appearance({"material": BRUSHED, "model": model})["target"]
    winds = model == "velatura"  # whose readings of brushed lobes wind by up to 1e-3
    assert deviation(BRUSHED, here, model) < EXACT
    assert here["lobes"][0]["alpha"] == pytest.approx([0.05, 0.1])
    assert here["lobes"][0]["rotation"] == pytest.approx(-10)
    u, v = here["lobes"][1]["alpha"]
    assert u < v and here["lobes"][1]["rotation"] == pytest.approx(130, abs=5)
    state = {"material": BRUSHED, "target": here}
    drags = ({"alpha": [u, 1.05 * v]}, {"rotation": 200.0}, {"alpha": [v, 1.2 * v]}, {"alpha": 0.4})
    for changes in drags[: 1 if winds else None]:
        wish = copy.deepcopy(state["target"])
        wish["lobes"][1] |= changes
        state = appearance.invert({**state, "target": wish, "model": model})
        assert state["snapped"] is None
        assert deviation(state["material"], wish, model) < (1e-3 if winds else EXACT)
        got = state["target"]["lobes"][1]
        assert got["alpha"] == pytest.approx(wish["lobes"][1]["alpha"], abs=1e-3 if winds else EXACT)
        if isinstance(got["alpha"], list):
            assert got["rotation"] == pytest.approx(wish["lobes"][1]["rotation"], abs=0.1 if winds else 1e-3)


def test_a_round_lobe_becomes_brushed_and_its_class_stays() -> None:
    wish = appearance.appearance({"material": COATED, "model": "weier2020"})["target"]
    wish["lobes"][1] |= {"alpha": [0.2, 0.4], "rotation": 40.0}
    state = appearance.invert({"material": COATED, "target": wish, "model": "weier2020"})
    assert state["snapped"] is None and deviation(state["material"], wish, "weier2020") < EXACT
    body = {"target": state["target"], "material": state["material"], "model": "weier2020"}
    card = class_maps.class_({**body, "lobe": 0})
    assert card["kind"] == "dielectric" and array(card["feasible"]).sum() > 10
    found = class_maps.member({**body, "lobe": 0, "point": [2.5]})
    assert deviation(found["material"], {"lobes": state["target"]["lobes"]}, "weier2020") < EXACT or found["snapped"]
    metal = class_maps.class_({**body, "lobe": 1})
    assert metal["kind"] == "conductor"
    found = class_maps.member({**body, "lobe": 1, "point": [0.9]})
    assert found["snapped"] is None and deviation(found["material"], wish, "weier2020") < EXACT


@pytest.mark.parametrize(("metal", "most"), [("numbers", 0.01), ("name", 0.02)])
def test_answers_to_held_drags_of_brushed_lobes_are_approximate(metal: str, most: float) -> None:
    """Small steps of `velatura` miss a hundredth of the variance, and turn by less than half a degree; a metal by name
    becomes one in numbers, which costs another hundredth."""
    brushed = copy.deepcopy(BRUSHED)
    if metal == "numbers":
        brushed["layers"][2]["interface"] |= {"eta": rgb(Named("Cu", "eta")), "k": rgb(Named("Cu", "k"))}
        del brushed["layers"][2]["interface"]["conductor"]
    here = appearance.appearance({"material": brushed, "model": "velatura"})["target"]
    for changes in ({"rotation": 132.0}, {"energy": [0.98 * e for e in here["lobes"][1]["energy"]]}):
        wish = copy.deepcopy(here)
        wish["lobes"][1] |= changes
        answer = appearance.invert({"material": brushed, "target": wish, "model": "velatura", "read": here})
        assert answer["rough"] and deviation(answer["material"], wish, "velatura") < most


@pytest.mark.parametrize("model", MODELS)
def test_a_conductor_that_is_darker_than_any_metal_is_read_as_it_is(model: str) -> None:
    """Dragged, it is a metal below something that absorbs; the lobes are those that were shown."""
    layers = [{"interface": {"eta": 1.5}}, {"interface": {"eta": 1.0, "k": [1.0, 0.0, 0.0], "alpha": 0.2}}]
    target = appearance.appearance({"material": {"layers": layers}, "model": model})["target"]
    assert deviation({"layers": layers}, target, model) < EXACT
    answer = appearance.invert({"material": {"layers": layers}, "target": target, "model": model})
    assert answer["snapped"] is None and deviation(answer["material"], target, model) < EXACT
    check_physical(answer["material"])


def media_of(material: dict[str, Any]) -> list[Medium]:
    return [layer for layer in Stack.from_dict(material).layers if isinstance(layer, Medium)]


SCATTERING = {
    "layers": [
        {"interface": {"eta": 1.5, "alpha": 0.05}},
        {"medium": {"depth": 0.5, "sigma_a": [0.1, 0.2, 0.3], "sigma_s": [0.4, 0.6, 0.8], "g": 0.9}},
        {"interface": {"conductor": "Cu", "alpha": 0.2}},
    ]
}


@pytest.mark.parametrize("model", MODELS)
def test_a_medium_that_scatters_stays_while_lobes_around_it_are_dragged(model: str) -> None:
    answer = appearance.appearance({"material": SCATTERING, "model": model})
    assert answer["says"] is None and deviation(SCATTERING, answer["target"], model) < EXACT
    assert all(held == {"interfaces": "a medium that scatters stays where it is"} for held in answer["held"])
    state = {"material": SCATTERING, "target": answer["target"]}
    for lobe, changes in ((0, {"energy": [0.05] * 3}), (1, {"energy": [0.3, 0.2, 0.1]}), (1, {"alpha": 0.5})):
        wish = copy.deepcopy(state["target"])
        wish["lobes"][lobe] |= changes
        state = appearance.invert({**state, "target": wish, "model": model})
        assert state["snapped"] is None and state["held"] == answer["held"]
        assert deviation(state["material"], wish, model) < EXACT
        (medium,) = media_of(state["material"])
        assert (medium.depth, medium.g) == (0.5, 0.9) and medium.sigma_s == pytest.approx((0.4, 0.6, 0.8))
        assert medium.sigma_a == pytest.approx((0.1, 0.2, 0.3))
    body = {"target": state["target"], "material": state["material"], "model": model, "lobe": 1}
    assert class_maps.class_(body)["kind"] == "conductor"
    found = class_maps.member({**body, "point": [0.9]})
    assert deviation(found["material"], state["target"], model) < EXACT
    wish = copy.deepcopy(state["target"])
    wish["lobes"][1]["interfaces"] = 2
    assert appearance.invert({**state, "target": wish, "model": model}) == {
        "feasible": False,
        "why": "a medium that scatters stays where it is, and the interfaces around it",
    }


def test_a_medium_that_scatters_below_all_interfaces_holds_nothing() -> None:
    first, medium, _ = SCATTERING["layers"]
    paint = {"layers": [first, medium, {"diffuse": {"albedo": 0.5}}]}
    assert appearance.appearance({"material": paint, "model": "bati2021"})["held"] == [{}]


@pytest.mark.parametrize("model", MODELS)
def test_a_mirror_takes_its_colour_from_what_absorbs_above_it(model: str) -> None:
    mirror = {"interface": {"conductor": "mirror", "alpha": 0.2}}
    coated = {"layers": [{"interface": {"eta": 1.5, "alpha": 0.05}}, mirror]}
    answer = appearance.appearance({"material": coated, "model": model})
    assert [lobe["base"] for lobe in answer["target"]["lobes"]] == ["dielectric", "mirror"]
    assert answer["held"] == [{}, {}] and deviation(coated, answer["target"], model) < EXACT
    wish = copy.deepcopy(answer["target"])
    wish["lobes"][1] |= {"energy": [0.6, 0.4, 0.2], "alpha": 0.3}
    found = appearance.invert({"material": coated, "target": wish, "model": model})
    assert found["snapped"] is None and deviation(found["material"], wish, model) < EXACT
    assert Stack.from_dict(found["material"]).interfaces[-1].conductor == "mirror"
    assert np.all(np.diff(media_of(found["material"])[0].sigma_a) > 0)
    fresh = appearance.invert({"target": wish, "model": model})
    assert fresh["snapped"] is None and deviation(fresh["material"], wish, model) < EXACT
    wish["lobes"][1]["energy"] = [1.2] * 3
    brighter = appearance.invert({"material": coated, "target": wish, "model": model})
    assert brighter["snapped"].startswith("lobe 2: ") and max(brighter["target"]["lobes"][1]["energy"]) < 1
    assert class_maps.class_({"material": coated, "target": answer["target"], "model": model, "lobe": 1})["point"] == []

    alone = {"layers": [mirror]}
    answer = appearance.appearance({"material": alone, "model": model})
    assert answer["held"][0]["energy"] == "nothing above this mirror absorbs, so that it reflects all light"
    wish = copy.deepcopy(answer["target"])
    wish["lobes"][0] |= {"energy": [0.5] * 3, "alpha": 0.4}
    found = appearance.invert({"material": alone, "target": wish, "model": model})
    assert found["snapped"] == f"lobe 1: {answer['held'][0]['energy']}"
    assert found["target"]["lobes"][0]["alpha"] == pytest.approx(0.4, abs=EXACT)
    assert Stack.from_dict(found["material"]).interfaces[-1].conductor == "mirror"


def test_a_pair_over_a_mirror_has_a_line_of_members() -> None:
    lobes = [{"energy": [0.5, 0.4, 0.3], "alpha": 0.2, "interfaces": 2, "base": "mirror"}]
    state = appearance.invert({"target": {"lobes": lobes}, "model": "bati2021"})
    body = {"target": state["target"], "material": state["material"], "model": "bati2021", "lobe": 0}
    card = class_maps.class_(body)
    assert card["kind"] == "pair over a mirror" and array(card["feasible"]).sum() > 3
    found = class_maps.member({**body, "point": [1.3]})
    assert Stack.from_dict(found["material"]).interfaces[0].eta == pytest.approx(1.3)
    assert deviation(found["material"], {"lobes": state["target"]["lobes"]}, "bati2021") < EXACT


def test_what_is_kept_stays_under_small_drags() -> None:
    """The index between a pair does not move, and the rest moves by little."""
    state = appearance.invert({"target": saved("bati2021-15-c")["target"], "model": "bati2021"})
    index = Stack.from_dict(state["material"]).interfaces[0].eta
    wish = copy.deepcopy(state["target"])
    for _ in range(20):
        wish["lobes"][0]["alpha"] *= 1.005
        before = Stack.from_dict(state["material"]).interfaces[1]
        state = appearance.invert({"target": wish, "material": state["material"], "model": "bati2021"})
        after = Stack.from_dict(state["material"]).interfaces
        assert after[0].eta == pytest.approx(index, rel=1e-12)
        assert abs(after[1].eta - before.eta) < 0.01
    assert state["snapped"] is None


def test_an_infeasible_wish_snaps_to_the_edge() -> None:
    """A wish that is far too bright ends at the brightest pair, to a hundredth of the way."""
    state = appearance.invert({"target": saved("bati2021-15-a")["target"], "model": "bati2021"})
    wish = copy.deepcopy(state["target"])
    wish["lobes"][0]["energy"] = [0.7] * 3
    answer = appearance.invert({"target": wish, "material": state["material"], "model": "bati2021"})
    energy = answer["target"]["lobes"][0]["energy"]
    assert answer["snapped"] == "lobe 1: no index up to 4 reflects as much"
    check_physical(answer["material"])
    assert deviation(answer["material"], answer["target"], "bati2021") < EXACT
    assert energy[0] == pytest.approx(9 / 17, abs=0.01)  # 1 - 2 / C_max of a smooth pair up to 4
    more = Target([{"energy": energy[0] + 0.02, "alpha": 0.0, "interfaces": 2}])
    assert invert.search(more, named("bati2021")) is None


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("model", MODELS)
def test_answers_describe_the_stack_regardless_of_earlier_questions(model: str) -> None:
    """Of stacks at the edge of what can be, every wish is answered by the lobes of the stack in the answer; a blur that
    is not asked to change stays. A wish of either stack has the same answer again after other questions."""
    asked = []
    for (eta_1, alpha_1), (eta_2, alpha_2) in (((1.0, 0.3), (3.9, 0.2)), ((1.5, 0.1), (2.0, 0.1))):
        layers = [{"interface": {"eta": eta_1, "alpha": alpha_1}}, {"interface": {"eta": eta_2, "alpha": alpha_2}}]
        body = {"material": {"layers": layers}, "model": model, "interfaces": [2]}
        here = appearance.appearance(body)["target"]
        for energy, alpha in ((0.9, None), (0.5, 0.0)):
            wish = copy.deepcopy(here)
            wish["lobes"][0] |= {"energy": [energy] * 3, **({} if alpha is None else {"alpha": alpha})}
            answer = appearance.invert({**body, "target": wish})
            asked.append(({**body, "target": wish}, answer))
            has = appearance.appearance({**body, "material": answer["material"]})["target"]
            for said, read, before in zip(answer["target"]["lobes"], has["lobes"], here["lobes"]):
                assert said["energy"] == pytest.approx(read["energy"], abs=EXACT)
                assert said["alpha"] == pytest.approx(read["alpha"], abs=EXACT)
                if alpha is None:
                    assert said["alpha"] == pytest.approx(before["alpha"], abs=1e-4)
    for question, answer in asked[1:3]:
        assert appearance.invert(question) == answer


def test_the_lobes_that_are_reported_are_read_from_the_returned_stack() -> None:
    """Of `velatura`, whose solutions have a tolerance: to rounding, where a wish is met, and where it is not."""
    state = appearance.invert({"target": saved("bati2021-19-b")["target"], "model": "velatura"})
    wish = copy.deepcopy(state["target"])
    wish["lobes"][1]["alpha"] *= 1.1
    body = {"material": state["material"], "model": "velatura"}
    met = appearance.invert({**body, "target": wish})
    wish["lobes"][1]["energy"] = [0.95, 0.95, 0.9]
    snapped = appearance.invert({**body, "target": wish})
    assert met["snapped"] is None and snapped["snapped"] is not None
    moved = class_maps.member({**body, "target": state["target"], "lobe": 1, "point": [0.3]})
    for answer in (state, met, snapped, moved):
        assert deviation(answer["material"], answer["target"], "velatura") < 1e-10


def test_a_mirror_that_is_blurred_more_gives_up_energy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Brushed, below a brushed coat: its facets lose what no brighter metal makes good. The answer at rest takes few
    readings of the model."""
    body = {"material": vt.load(vt.preset("crossed-brushing")).to_dict(), "model": "velatura"}
    wish = copy.deepcopy(appearance.appearance(body)["target"])
    before = wish["lobes"][1]["energy"][0]
    wish["lobes"][1]["alpha"] = [1.3 * alpha for alpha in wish["lobes"][1]["alpha"]]
    solved, readings = Space._solved, list[Any]()

    def counted(*of: Any) -> Any:
        readings.append(of)
        return solved(*of)

    monkeypatch.setattr(Space, "_solved", counted)
    answer = appearance.invert({**body, "target": wish})
    assert len(readings) < 80
    lobe = answer["target"]["lobes"][1]
    assert answer["snapped"].startswith("lobe 2: not even the brightest metal")
    assert lobe["alpha"] == pytest.approx(wish["lobes"][1]["alpha"], rel=1e-3)
    assert before - 0.005 < lobe["energy"][0] < before


@pytest.mark.filterwarnings("error")
def test_a_member_of_a_lobe_without_energy_is_found() -> None:
    """Below an interface that reflects nothing, since both indices are the same, another index may be taken."""
    material = {"layers": [{"interface": {"eta": 1.5, "alpha": 0.1}}, {"interface": {"eta": 1.5, "alpha": 0.1}}]}
    body = {"material": material, "model": "bati2021", "interfaces": [1, 1]}
    target = appearance.appearance(body)["target"]
    answer = class_maps.member({**body, "target": target, "lobe": 1, "point": [1.7]})
    check_physical(answer["material"])


def test_a_coloured_wish_for_one_interface_snaps_to_grey() -> None:
    state = appearance.invert({"target": saved("bati2021-19-a")["target"], "model": "bati2021"})
    wish = copy.deepcopy(state["target"])
    wish["lobes"][0]["energy"] = [0.12, 0.1, 0.1]
    answer = appearance.invert({"target": wish, "material": state["material"], "model": "bati2021"})
    assert answer["target"]["lobes"][0]["energy"] == pytest.approx([0.32 / 3] * 3)
    assert answer["snapped"].startswith("lobe 1: nothing above it absorbs")


def test_other_interfaces_or_base_give_a_fresh_stack() -> None:
    state = appearance.invert({"target": saved("bati2021-19-b")["target"], "model": "bati2021"})
    wish = copy.deepcopy(state["target"])
    wish["lobes"][0]["interfaces"] = 2
    answer = appearance.invert({"target": wish, "material": state["material"], "model": "bati2021"})
    assert len(Stack.from_dict(answer["material"]).interfaces) == 3
    assert deviation(answer["material"], wish, "bati2021") < EXACT


def test_a_diffuse_base_keeps_its_energy() -> None:
    paint = {"layers": [{"interface": {"eta": 1.5, "alpha": 0.1}}, {"diffuse": {"albedo": [0.5, 0.3, 0.1]}}]}
    target = appearance.appearance({"material": paint, "model": "bati2021"})["target"]
    target["lobes"][0]["energy"] = [0.06] * 3
    answer = appearance.invert({"material": paint, "target": target, "model": "bati2021"})
    energies = [scattered(Stack.from_dict(m), named("bati2021")) for m in (paint, answer["material"])]
    assert energies[1] == pytest.approx(energies[0], abs=1e-6)


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ({"target": {"lobes": [{"energy": -1}]}}, "lobe 1: energy"),
        ({"target": {"lobes": [{"energy": 0.1}]}, "model": "none"}, "model"),
        ({"target": {"lobes": [{"energy": 0.1}]}, "switches": 3}, "switches"),
    ],
)
def test_a_wrong_body_is_one_line(body: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidInput, match=says) as error:
        appearance.invert(body)
    assert "\n" not in str(error.value)


# Classes -------------------------------------------------------------------------------------------------------------


def array(answer: dict[str, Any]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(answer["data"]), answer["dtype"]).reshape(answer["shape"])


@pytest.mark.parametrize("model", MODELS)
def test_members_of_a_pair_look_the_same(model: str) -> None:
    state = appearance.invert({"target": saved("bati2021-15-b")["target"], "model": model})
    body = {"target": state["target"], "lobe": 0, "material": state["material"], "model": model}
    card = class_maps.class_(body)
    assert card["kind"] == "dielectric pair"
    feasible, absorption = array(card["feasible"]).astype(bool), array(card["absorption"])
    assert feasible.shape == absorption.shape == (48, 48)
    assert np.array_equal(np.isfinite(absorption), feasible)
    inside, axis = np.argwhere(feasible), card["axes"][0]["values"]
    for y, x in inside[:: len(inside) // 4]:
        found = class_maps.member({**body, "point": [axis[x], axis[y]]})
        assert deviation(found["material"], state["target"], model) < EXACT
        check_physical(found["material"])
        if model == "bati2021":
            assert found["snapped"] is None
            etas = [part.eta for part in Stack.from_dict(found["material"]).interfaces]
            assert etas == pytest.approx([axis[x], axis[y]], rel=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_the_member_lies_on_the_outline_of_all_where_nothing_absorbs_in_vain(model: str) -> None:
    state = appearance.invert({"target": saved("bati2021-15-c")["target"], "model": model})
    card = class_maps.class_({"target": state["target"], "lobe": 0, "material": state["material"], "model": model})
    points = [point for line in card["outlines"] if line["channel"] == "all" for point in line["points"]]
    apart = np.hypot(*(np.log(points) - np.log(card["member"])).T)
    assert apart.min() < 0.03  # half of the distance of two columns


def test_a_member_outside_snaps_to_the_class() -> None:
    state = appearance.invert({"target": saved("bati2021-15-b")["target"], "model": "bati2021"})
    body = {"target": state["target"], "lobe": 0, "material": state["material"], "model": "bati2021"}
    x = class_maps.class_(body)["member"][0]
    found = class_maps.member({**body, "point": [x, x]})  # where there would be no lower interface
    assert deviation(found["material"], state["target"], "bati2021") < EXACT
    assert Stack.from_dict(found["material"]).interfaces[0].eta == pytest.approx(x)


@pytest.mark.parametrize("point", [(1.195, 2.364), (1.31, 2.645), (1.265, 3.207)])
def test_a_member_that_absorbs_is_found_from_a_clear_one(point: tuple[float, float]) -> None:
    """By the default model; the first point is so near to clear members that hardly anything absorbs."""
    etas = ({"eta": 1.8778618213234128}, {"eta": 1.3935834785724517})
    metal = {"eta": 0.8122738976499411, "k": 1.1323806899389746, "alpha": 0.2861869729463316}
    layers = [*({"interface": values} for values in etas), {"medium": {"sigma_a": 0.4864}}, {"interface": metal}]
    body = {"material": {"layers": layers}}
    target = appearance.appearance(body)["target"]
    assert [lobe["interfaces"] for lobe in target["lobes"]] == [2, 1]
    found = class_maps.member({**body, "target": target, "lobe": 0, "point": point})
    assert found["snapped"] is None
    assert [part.eta for part in Stack.from_dict(found["material"]).interfaces[:2]] == pytest.approx(point, rel=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_a_conductor_moves_along_its_curves(model: str) -> None:
    state = appearance.invert({"target": saved("bati2021-19-b")["target"], "model": model})
    body = {"target": state["target"], "lobe": 1, "material": state["material"], "model": model}
    card = class_maps.class_(body)
    assert card["kind"] == "conductor"
    goal = card["outlines"][1]["points"][28]
    found = class_maps.member({**body, "point": goal})
    assert deviation(found["material"], state["target"], model) < EXACT
    metal = Stack.from_dict(found["material"]).interfaces[-1]
    assert (metal.eta[1], metal.k[1]) == pytest.approx(goal, rel=0.02)  # curves are those of smooth metals
    again = appearance.invert({**body, "material": found["material"], "target": found["target"]})
    assert Stack.from_dict(again["material"]).interfaces[-1].eta == pytest.approx(metal.eta, rel=1e-6)


# Coats and figures ---------------------------------------------------------------------------------------------------


def test_a_coat_keeps_the_appearance_or_says_why_not() -> None:
    bare = {"layers": [{"interface": {"conductor": "Au", "alpha": 0.2}}]}
    answer = appearance.coated({"material": bare, "eta": 1.5, "alpha": 0.02, "keep": True, "model": "bati2021"})
    (row,) = answer["lobes"]
    assert answer["coat"]["energy"] == pytest.approx([0.04] * 3, rel=0.02)
    assert answer["coat"]["alpha"] == pytest.approx([0.02, 0.02])
    assert row["energy_after"] == pytest.approx(row["energy_before"], abs=1e-6)
    sharp = {"layers": [{"interface": {"conductor": "Au", "alpha": 0.001}}]}
    near = appearance.coated({"material": sharp, "eta": 1.5, "alpha": 0.3, "keep": True, "model": "bati2021"})
    (loss,) = near["losses"]
    assert loss.startswith("layer 0 (interface): cannot keep all of its appearance") and answer["losses"] == []
    assert near["lobes"][0]["alpha_after"][0] > near["lobes"][0]["alpha_before"][0]
    cloudy = {"layers": [{"medium": {"sigma_s": 1.0}}, {"interface": {"conductor": "Au"}}]}
    refused = appearance.coated({"material": cloudy, "eta": 1.5, "alpha": 0.3, "keep": True, "model": "bati2021"})
    assert set(refused) == {"error"}
    assert "\n" not in refused["error"]


def test_all_figures_are_saved_states() -> None:
    states = appearance.targets({})["targets"]
    assert {state["name"].split("-")[1] for state in states} == {str(n) for n in range(15, 23)}
    assert [state["name"] for state in states if state["snapped"]] == ["bati2021-21-left"]
    for state in states:
        assert deviation(state["material"], state["target"], state["model"]) < EXACT


def test_absorption_over_a_metal_gives_way_to_a_brighter_wish() -> None:
    stack = copy.deepcopy(COATED)
    stack["layers"][2] = {"interface": {"eta": 0.02, "k": 8, "alpha": 0.2}}
    here = appearance.appearance({"material": stack, "model": "bati2021"})
    wish = copy.deepcopy(here["target"])
    wish["lobes"][1]["energy"] = [e * 1.1 for e in wish["lobes"][1]["energy"]]
    answer = appearance.invert({"target": wish, "material": stack, "model": "bati2021"})
    assert answer["snapped"] is None
    assert deviation(answer["material"], wish, "bati2021") < EXACT


def test_the_first_lobe_has_the_colour_of_what_absorbs_above_it() -> None:
    tau = np.array([0.1, 0.2, 0.3])
    stack = {"layers": [{"medium": {"sigma_a": tau.tolist()}}, {"interface": {"eta": 1.5, "alpha": 0.1}}]}
    wish = appearance.appearance({"material": stack, "model": "bati2021"})["target"]
    wish["lobes"][0]["energy"] = [0.03, 0.03, 0.03]
    answer = appearance.invert({"target": wish, "material": stack, "model": "bati2021"})
    energy = np.array(answer["target"]["lobes"][0]["energy"])
    np.testing.assert_allclose(energy / energy[0], np.exp(-2 * (tau - tau[0])), rtol=1e-6)


@pytest.mark.parametrize(
    ("interface", "energy", "reason", "reached"),
    [
        ({"eta": 3.8, "alpha": 0.02}, 0.37, "energy", 0.36),
        ({"conductor": "Cu", "alpha": 0.02}, 0.1, "metal", 3 - 2 * 2**0.5),
    ],
)
def test_a_part_of_the_way_ends_on_the_bound_that_is_named(
    interface: dict[str, Any], energy: float, reason: str, reached: float
) -> None:
    model, material = named("bati2021", reflectance="fresnel"), {"layers": [{"interface": interface}]}
    here = appearance.appearance({"material": material, "model": "bati2021"})["target"]
    stack = DraggedStack.of(Stack.from_dict(material), Target.from_dict(here), model)
    assert stack is not None
    found = nearest(stack, stack.target.with_lobe(0, energy=(energy,) * 3))
    assert found.reason == reason
    assert np.min(np.abs(np.array(found.reached.lobes[0].colour) - reached)) < 1e-6


@pytest.mark.parametrize(
    ("lobe", "energy", "says"),
    [
        ({"energy": [0.08, 0.04, 0.05]}, [0.0567] * 3, "lobe 1: nothing above it absorbs"),
        ({"energy": [0.95, 0.75, 0.35], "alpha": 0.4, "base": "conductor"}, [0.7849, 0.75, 0.35], "lobe 1: not even"),
        ({"energy": [0.5, 0.1, 0.1], "base": "conductor"}, [0.5, 0.1716, 0.1716], "lobe 1: a conductor"),
        ({"energy": 0.6, "interfaces": 2}, [0.529] * 3, "lobe 1: no index up to 4"),
    ],
)
def test_a_wish_that_cannot_be_is_answered_by_the_nearest_with_the_reason(
    lobe: dict[str, Any], energy: list[float], says: str
) -> None:
    """The nearest of the same form, as `velatura invert` names it; the reason is one that such a lobe can have."""
    answer = appearance.invert({"target": {"lobes": [lobe]}, "model": "bati2021"})
    assert answer["target"]["lobes"][0]["energy"] == pytest.approx(energy, abs=1e-3)
    assert answer["snapped"].startswith(says)


# Depths of members ---------------------------------------------------------------------------------------------------


def _depths(material: dict[str, Any]) -> list[Any]:
    return [layer["medium"]["sigma_a"] for layer in material["layers"] if "medium" in layer]


@pytest.mark.parametrize("model", ["bati2021", "velatura"])
def test_the_coat_of_a_metal_absorbs_what_is_asked_and_the_lobe_stays(model: str) -> None:
    """Bati et al. 2021, figure 16: green absorbed in the coat, then another index; the edge gets pink."""
    state = appearance.invert({"target": saved("bati2021-16")["target"], "model": model})
    body = {"target": state["target"], "lobe": 0, "material": state["material"], "model": model}
    card = class_maps.class_(body)
    assert card["kind"] == "pair over a conductor"
    assert [axis["label"] for axis in card["axes"]] == ["eta 1", "absorption of the coat"]
    assert list(card["depths"]) == ["tau_0", "tau_1"]
    feasible = array(card["feasible"]).astype(bool)
    assert feasible[0].any() and feasible.any(axis=1).sum() > 20
    most = card["depths"]["tau_1"]["high"]
    assert min(most) > 0.3 and max(card["depths"]["tau_1"]["value"]) == 0
    found = class_maps.member({**body, "depths": {"tau_1": [0.0, 0.3, 0.0]}})
    assert found["snapped"] is None
    assert _depths(found["material"]) == [pytest.approx([0.0, 0.3, 0.0], abs=1e-9)]
    lower = class_maps.member(
        {**body, "target": found["target"], "material": found["material"], "point": [1.2, card["point"][1]]}
    )
    assert Stack.from_dict(lower["material"]).interfaces[0].eta == pytest.approx(1.2)
    edges = []
    for one in (state, found, lower):
        assert deviation(one["material"], state["target"], model) < EXACT
        check_physical(one["material"])
        red, green, blue = invert.grazing(Stack.from_dict(one["material"]), model).mean(axis=1)
        edges.append((red + blue) / (2 * green))
    assert edges[0] < edges[1] < edges[2]
    # Deeper than any metal can make up for, it ends where the brightest one does
    far = class_maps.member({**body, "depths": {"tau_1": [0.0, 3.0, 0.0]}})
    assert far["snapped"].startswith("lobe 1: not even") and deviation(far["material"], state["target"], model) < EXACT
    assert _depths(far["material"])[0][1] == pytest.approx(most[1], rel=1e-4 if model == "bati2021" else 0.05)


@pytest.mark.parametrize("name", ["15-c", "17-red-over-blue"])
def test_what_absorbs_above_a_pair_is_taken_and_held(name: str) -> None:
    """tau_0 above the first lobe, tau_n above a lower one; then other lobes are dragged, and it stays."""
    state = saved(f"bati2021-{name}")
    lobe = len(state["target"]["lobes"]) - 1
    body = {"target": state["target"], "lobe": lobe, "material": state["material"], "model": "bati2021"}
    card = class_maps.class_(body)
    assert list(card["depths"]) == ["tau_0"] and max(card["depths"]["tau_0"]["value"]) == 0
    wanted = [0.02, 0.05, 0.03]
    found = class_maps.member({**body, "depths": {"tau_0": wanted}})
    assert found["snapped"] is None
    assert any(np.allclose(tau, wanted, atol=1e-9) for tau in _depths(found["material"]))
    assert deviation(found["material"], state["target"], "bati2021") < EXACT
    again = class_maps.class_({**body, "target": found["target"], "material": found["material"]})
    assert again["depths"]["tau_0"]["value"] == pytest.approx(wanted)
    wish = copy.deepcopy(found["target"])
    wish["lobes"][lobe]["alpha"] *= 1.03
    moved = appearance.invert({**body, "target": wish, "material": found["material"]})
    assert moved["snapped"] is None and any(np.allclose(tau, wanted, atol=1e-9) for tau in _depths(moved["material"]))
    back = class_maps.member(
        {**body, "target": found["target"], "material": found["material"], "depths": {"tau_0": [0, 0, 0]}}
    )
    assert not back["target"]["lobes"][lobe]["fixed"] and len(back["material"]["layers"]) == len(
        state["material"]["layers"]
    )


def test_what_absorbs_above_one_dielectric_follows_its_index() -> None:
    state = saved("bati2021-19-b")
    body = {"target": state["target"], "lobe": 0, "material": state["material"], "model": "bati2021"}
    card = class_maps.class_(body)
    assert card["kind"] == "dielectric" and card["depths"] == {}
    assert array(card["feasible"]).sum() > 10
    found = class_maps.member({**body, "point": [2.5]})
    assert Stack.from_dict(found["material"]).interfaces[0].eta == pytest.approx(2.5, rel=1e-3)
    assert np.ravel(_depths(found["material"])[0])[0] == pytest.approx(0.304, abs=0.001)
    assert deviation(found["material"], state["target"], "bati2021") < EXACT


@pytest.mark.parametrize(
    ("name", "depths", "says"),
    [
        ("16", {"tau_2": [0, 0, 0]}, "depths: tau_2: must be one of tau_0, tau_1"),
        ("15-c", {"tau_1": [0, 0, 0]}, "depths: tau_1: must be one of tau_0"),
        ("16", {"tau_1": [0, -1, 0]}, "depths: tau_1: must lie in 0 to 50"),
        ("16", {"tau_1": [0, 1]}, "depths: tau_1: must be a number, "),
    ],
)
def test_a_wrong_depth_is_one_line(name: str, depths: dict[str, Any], says: str) -> None:
    state = saved(f"bati2021-{name}")
    body = {"target": state["target"], "lobe": 0, "material": state["material"], "model": "bati2021"}
    with pytest.raises(InvalidInput) as error:
        class_maps.member({**body, "depths": depths})
    assert str(error.value).startswith(says)


# Wishes beyond lobes -------------------------------------------------------------------------------------------------


def test_a_wish_is_answered_from_the_material_that_it_began_with() -> None:
    """Expected: what the material shows is what was asked for, coarsely too, and a reason where it cannot be."""
    plate = vt.preset("tinted-plate").to_dict()
    wish = {"passed": {"energy": [0.5, 0.3, 0.2]}}
    body = {"material": plate, "model": "bati2021", "target": wish}
    for coarse in (True, False):
        answer = VERBS["wish"]({**body, "coarse": coarse})
        assert answer["snapped"] is None
        passed = next(each for each in answer["wishes"] if each["key"] == "passed")
        assert passed["energy"] == pytest.approx([0.5, 0.3, 0.2], abs=2e-3)
    own = vt.inverse.answer({**wish, "start": plate}, "bati2021").stack
    assert vt.Stack.from_dict(answer["material"]) == own  # at rest
    answer = VERBS["wish"]({**body, "target": {"passed": {"energy": 0.99}}})
    assert answer["snapped"].startswith("no stack of these layers is found that has passed energy 0.99")
    assert vt.Stack.from_dict(answer["material"]).flat()["layer1_sigma_a"] == pytest.approx(0, abs=1e-6)


def test_a_drag_of_lobes_takes_no_other_wish() -> None:
    target = {"lobes": [{"energy": 0.1}], "passed": {"energy": 0.5}}
    for verb in ("invert", "ways", "class"):
        with pytest.raises(InvalidInput, match="passed: is no wish for lobes"):
            VERBS[verb]({"target": target, "lobe": 0})


def test_a_mixture_is_asked_for_its_colour_alone() -> None:
    """Expected: the answer of the library; the weight is that of two chalks, whose light adds up."""
    chalks = [{"layers": [{"diffuse": {"albedo": albedo}}]} for albedo in (0.8, 0.2)]
    mix = {"mix": [{"weight": 0.5, "material": chalks[0]}, {"material": chalks[1]}]}
    (shown,) = VERBS["wishes"]({"material": mix})["wishes"]
    assert shown["key"] == "mixture" and shown["energy"] == pytest.approx([0.5] * 3, abs=1e-4)
    answer = VERBS["wish"]({"material": mix, "target": {"mixture": {"energy": 0.35}}, "coarse": True})
    assert answer["snapped"] is None and answer["wishes"][0]["energy"] == pytest.approx([0.35] * 3, abs=1e-3)
    assert answer["material"]["mix"][0]["weight"] == pytest.approx(0.25, abs=1e-3)
    with pytest.raises(InvalidInput, match="the inverse takes a single stack, not a mixture, of which only mixture"):
        VERBS["wish"]({"material": mix, "target": {"body": {"energy": 0.35}}})


def test_a_material_is_made_of_what_is_available() -> None:
    """Expected: the answers of the library, the nearest first, which is the material where it can be had."""
    gold = {"layers": [{"interface": {"eta": 1.5, "alpha": 0.1}}, {"interface": {"conductor": "Au", "alpha": 0.2}}]}
    body = {"material": gold, "model": "bati2021", "available": [1.5, "water", "Au"]}
    first, second = VERBS["stock"](body)["choices"]
    assert first["off"] < 1e-3 < second["off"]
    surfaces = vt.Stack.from_dict(second["material"]).interfaces
    assert surfaces[0].eta == "water" and surfaces[1].conductor == "Au"
    found = vt.inverse.answers({"start": gold, "available": body["available"]}, 1, "bati2021")[0]
    assert vt.Stack.from_dict(first["material"]) == found.stack
    with pytest.raises(InvalidInput, match="available: must be a list, got nothing"):
        VERBS["stock"]({"material": gold})


def test_a_material_states_what_it_lacks_for_a_wish() -> None:
    """Expected: for a clear pane its haze, and a medium; the way adds what is lacking, which is no more after it."""
    pane = {"layers": [{"interface": {"eta": 1.5, "alpha": 0.1}}, {"interface": {"eta": 1.0}}]}
    found = {each["key"]: each for each in VERBS["wishes"]({"material": pane, "model": "bati2021"})["wishes"]}
    assert set(found) == {"grazing", "passed", "body", "film"}
    assert found["passed"]["haze"] > 0 and found["passed"]["way"] == "a tinted medium below layer 0"
    tilted = vt.lobes(Stack.from_dict(pane), np.cos(np.radians(75)), model="bati2021")
    for lobe, energy, alpha in zip(found["grazing"]["lobes"], tilted.energy, tilted.alpha):
        assert lobe["energy"] == pytest.approx(energy[:, 0].tolist())
        assert lobe["alpha"] == pytest.approx(alpha.mean())
    for key in ("passed", "body", "film"):
        other = VERBS["wishes"]({"material": found[key]["material"], "model": "bati2021"})["wishes"]
        assert not [each for each in other if each["key"] == key and "lacks" in each]
    metal = {"layers": [{"interface": {"conductor": "Cu"}}]}
    assert {each["key"] for each in VERBS["wishes"]({"material": metal, "angle": 60})["wishes"]} == {"grazing", "film"}
    with pytest.raises(InvalidInput, match="angle: must lie in 0 to 89"):
        VERBS["wishes"]({"material": metal, "angle": 90})
