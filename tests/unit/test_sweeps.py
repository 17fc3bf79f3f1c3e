"""Spaces, plans, questions and stores of sweeps, in this process."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import velatura as vt
from velatura import kernel
from velatura.errors import Damaged
from velatura.sweeps import Plan, load_plan
from velatura.sweeps import run as sweeping
from velatura.sweeps.store import DONE, FAILED, StoredVariable, create, existing

Run = Callable[..., tuple[int, str, str]]

GOLD = {"material": "coated-gold", "vary": {"layer0_alpha": {"values": [0.1, 0.2]}}}
COLOURS = {"range": [0.1, 2.0], "per_channel": True}
DRAWN = {"sampling": "random", "count": 50, "seed": 4}
MANY = {"layer1_depth": {"range": [0, 1], "steps": 10**6}, "layer0_alpha": {"range": [0, 1], "steps": 2000}}
LOBES: dict[str, Any] = {"cos_theta": [1.0, 0.5], "model": "belcour2018"}


class InTurn(Executor):
    """Runs what is submitted at once."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except BaseException as error:
            future.set_exception(error)
        return future


def swept(space: Any, what: Any, store: Path, **options: Any) -> Any:
    """A sweep in this process, loaded."""
    return vt.sweep(space, what, store=store, executor=InTurn(), progress=lambda *_: None, **options).load()


def number(stack: vt.Stack, seed: int) -> dict[str, Any]:
    """The roughness of the first interface, and the seed."""
    return {"alpha": stack.flat()["layer0_alpha_u"], "drawn": np.random.default_rng(seed).random()}


# Spaces --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"material": "coated-gol"}, "material: unknown preset 'coated-gol' (did you mean coated-gold?)"),
        ({"material": 3}, "material: a material must be a stack, a mixture, a file or the name of a preset, got 3"),
        ({"sampling": "sobel"}, "sampling: must be one of grid, random, sobol, got 'sobel'"),
        ({"samplin": "grid"}, "unknown key 'samplin' (did you mean sampling?)"),
        ({"count": 3}, "count: not with sampling: grid, whose steps give it"),
        ({"sampling": "sobol"}, "count: missing; sampling: sobol needs it"),
        ({**DRAWN, "count": 0}, "count: must be a whole number in 1 to 1073741824, got 0"),
        ({"seed": -1}, "seed: must be a whole number in 0 to 9223372036854775807, got -1"),
        ({"vary": {}}, "vary: must be flat names with values, range or distribution, got {}"),
        ({"vary": {"layer0_alpha": 0.1}}, "vary: layer0_alpha: must hold values, range or distribution, got 0.1"),
        (
            {"vary": {"layer0_alpha": {"values": [0.1, 2]}}},
            "vary: layer0_alpha: layer 0 (interface): alpha: must lie in 0 to 1, got 2",
        ),
        (
            {"vary": {"layer0_alpha": {"range": [0.1, 2], "steps": 3}}},
            "vary: layer0_alpha: layer 0 (interface): alpha: must lie in 0 to 1, got 2.0",
        ),
        (
            {"vary": {"layer0_alpha": {"range": [0.2, 0.1], "steps": 3}}},
            "vary: layer0_alpha: range: must be [low, high], two numbers, the lower one first, got [0.2, 0.1]",
        ),
        (
            {"vary": {"layer0_alpha": {"range": [0.1, 0.2]}}},
            "vary: layer0_alpha: steps: missing; sampling: grid needs it",
        ),
        (
            {"vary": {"layer0_alpha": {}}},
            "vary: layer0_alpha: must have one of values, range, and distribution: normal",
        ),
        (
            {"vary": {"layer0_alpha": {"distribution": "normal", "mean": 0.1}}, **DRAWN},
            "vary: layer0_alpha: distribution: normal needs mean and std",
        ),
        (
            {"vary": {"layer0_alpha": {"range": [0, 1], "distribution": "log-uniform"}}, **DRAWN},
            "vary: layer0_alpha: range: must begin above 0 for distribution: log-uniform, got 0",
        ),
        (
            {"vary": {"layer0_alpha": COLOURS}, **DRAWN},
            "vary: layer0_alpha: per_channel: only of a value that may differ between colours",
        ),
        ({"vary": {"layer0_alpa": {"range": [0, 1]}}, **DRAWN}, "vary: layer0_alpa: layer 0 "),
        ({"vary": {"layer2_conductor": {"range": [0, 1]}}, **DRAWN}, "conductor: must be the name of a metal, got 0"),
        ({"vary": MANY}, "vary: must have at most 1073741824 points, got 2000000000"),
    ],
)
def test_a_space_that_means_nothing_is_refused_in_one_line(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(vt.InvalidInput) as caught:
        vt.Space.from_dict({**GOLD, **changes})
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_points_follow_from_their_number() -> None:
    """Expected: of all samplings, the same values and seeds in any order; those of another seed differ."""
    vary = {"layer0_alpha": {"range": [0.1, 0.5]}, "layer1_sigma_a": COLOURS}
    for sampling in ("random", "sobol"):
        space = vt.Space(material="coated-gold", vary=vary, sampling=sampling, count=50, seed=4)
        every = space.points(range(50))
        assert [space.points([n])[0] for n in (41, 3, 3, 40)] == [every[n] for n in (41, 3, 3, 40)]
        assert space.points([5, 6, 9]) == [every[n] for n in (5, 6, 9)]
        assert len({str(point) for point in every}) == 50
        assert space.seeds([7]) == space.seeds(range(50))[7:8] and len(set(space.seeds(range(50)))) == 50
        other = vt.Space(material="coated-gold", vary=vary, sampling=sampling, count=50, seed=5)
        assert other.points([7]) != every[7:8] and other.seeds([7]) != space.seeds([7])
        assert all(0.1 <= p["layer0_alpha"] <= 0.5 and len(set(p["layer1_sigma_a"])) == 3 for p in every)


def test_values_are_distributed_as_they_should_be() -> None:
    """Expected: quantiles of Sobol points within 1 % of the range; a normal one is cut off where the parameter ends."""
    vary = {
        "layer0_alpha": {"distribution": "normal", "mean": 0.1, "std": 0.1},
        "layer1_depth": {"range": [0.01, 100.0], "distribution": "log-uniform"},
        "layer0_eta": {"range": [1.2, 2.2]},
        "layer2_conductor": {"values": ["Au", "Cu", "Al"]},
    }
    space = vt.Space(material="coated-gold", vary=vary, sampling="sobol", count=2048)
    points = space.points(range(2048))
    columns = {name: np.array([point[name] for point in points]) for name in vary}
    assert np.quantile(np.log10(columns["layer1_depth"]), [0.25, 0.75]) == pytest.approx([-1, 1], abs=0.04)
    assert np.quantile(columns["layer0_eta"], [0.25, 0.75]) == pytest.approx([1.45, 1.95], abs=0.01)
    assert columns["layer0_alpha"].min() >= 0
    # Of what lies above the mean minus one standard deviation, half lies above the mean plus .1993 of it
    assert np.median(columns["layer0_alpha"]) == pytest.approx(0.11993, abs=0.002)
    assert [abs((columns["layer2_conductor"] == metal).sum() - 683) < 7 for metal in ("Au", "Cu", "Al")] == [True] * 3


# Stores --------------------------------------------------------------------------------------------------------------


def test_a_grid_has_named_dimensions(tmp_path: Path) -> None:
    vary = {
        "layer0_alpha": {"range": [0.1, 0.3], "steps": 3},
        "layer2_conductor": {"values": ["Au", "Cu"]},
        "layer1_sigma_a": {"values": [1, [0.1, 0.2, 0.3]]},
    }
    found = swept({"material": "coated-gold", "vary": vary}, "albedo", tmp_path / "grid.zarr", **LOBES)
    dims = ("layer0_alpha", "layer2_conductor", "layer1_sigma_a_index")
    assert found.reflected.dims == (*dims, "colour", "direction")
    assert found.layer1_sigma_a.values.tolist() == [[1, 1, 1], [0.1, 0.2, 0.3]]
    assert found.layer1_sigma_a.attrs["units"] == "1/length"
    assert found.cos_theta.values.tolist() == [1, 0.5] and found.cos_theta.attrs["units"] == "1"
    alone = found.sel(layer0_alpha=0.2, layer2_conductor="Cu").isel(layer1_sigma_a_index=1)
    stack = vt.preset("coated-gold").replace(layer0_alpha=0.2, layer2_conductor="Cu", layer1_sigma_a=(0.1, 0.2, 0.3))
    lobes = vt.lobes(stack, **LOBES)
    assert np.array_equal(alone.reflected, sum(lobes.energy) + lobes.remainder)
    assert np.array_equal(alone.absorbed, lobes.absorbed)


@pytest.mark.parametrize("shape", [(7,), (3, 5), (5, 3, 4)])
def test_chunks_hold_every_point_once(shape: tuple[int, ...], tmp_path: Path) -> None:
    names = ("layer0_alpha", "layer1_depth", "layer0_eta")
    vary = {name: {"range": [0.5, 1.0], "steps": size} for name, size in zip(names, shape)}
    space = {"material": "coated-gold", "vary": vary}
    found = swept(space, number, tmp_path / "chunks.zarr", chunk=4)
    store = existing(tmp_path / "chunks.zarr", Plan.from_dict({**space, "what": number, "chunk": 4, "options": {}}))
    assert store
    numbers = [store.points(chunk) for chunk in store.chunks]
    assert sorted(n for each in numbers for n in each) == list(range(int(np.prod(shape))))
    assert max(map(len, numbers)) <= 4
    assert (found.alpha == found.layer0_alpha).all() and found.status.values.min() == DONE
    assert store.marked() == list(store.chunks) and not any(map(store.damage, store.chunks))


def test_a_store_says_what_it_holds(tmp_path: Path) -> None:
    found = swept({**GOLD, **DRAWN, "vary": {"layer0_alpha": {"range": [0, 1]}}}, number, tmp_path / "a.zarr")
    plan = yaml.safe_load(found.attrs["plan"])
    assert (plan["sampling"], plan["count"], plan["seed"]) == ("random", 50, 4)
    assert plan["what"]["function"].endswith("test_sweeps.number") and len(plan["what"]["source"]) == 16
    assert vt.Stack.from_dict(plan["material"]) == vt.preset("coated-gold")
    assert found.attrs["versions"]["velatura"] == vt.__version__ and "mitsuba" in found.attrs["versions"]
    assert found.layer0_alpha.attrs["long_name"] == "GGX roughness along the tangent and the bitangent"
    assert (found.alpha == found.layer0_alpha).all()
    assert found.drawn.values.tolist() == [np.random.default_rng(int(seed)).random() for seed in found.seed]


def test_another_plan_is_refused_in_one_line(tmp_path: Path) -> None:
    store = tmp_path / "a.zarr"
    swept(GOLD, number, store)
    for space, what, options, message in [
        ({**GOLD, "seed": 1}, number, {}, "holds another sweep, with seed: nothing, not 1"),
        (
            {**GOLD, "vary": {"layer0_alpha": {"values": [0.1, 0.3]}}},
            number,
            {},
            "with vary: layer0_alpha: values: [0.1, 0.2], not [0.1, 0.3]",
        ),
        (GOLD, "albedo", LOBES, "holds another sweep, with "),
    ]:
        with pytest.raises(vt.InvalidInput, match=r"a\.zarr: ") as caught:
            swept(space, what, store, **options)
        assert message in str(caught.value) and "\n" not in str(caught.value)
    for folder in (tmp_path, tmp_path / "none" / "b.zarr"):
        with pytest.raises(vt.InvalidInput, match=r"holds no sweep|there is no folder"):
            swept(GOLD, number, folder)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.zarr"]


DAMAGES: dict[str, tuple[Callable[[Path], Any], str]] = {
    "cut off": (lambda store: cut(store / "drawn" / "3"), "drawn/3"),
    "empty": (lambda store: (store / "drawn" / "3").write_bytes(b""), "drawn/3"),
    "one bit": (lambda store: flip(store / "alpha" / "3"), "alpha/3"),
    "of values": (lambda store: flip(store / "layer0_alpha" / "3"), "layer0_alpha/3"),
    "of reasons": (lambda store: (store / "reason" / "3").unlink(), "reason/3"),
    "marks": (lambda store: flip(store / "status" / "3"), "status/3"),
    "an array": (lambda store: shutil.rmtree(store / "drawn"), "drawn/0"),
}


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:3])


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-5] ^= 4  # before the four bytes of the checksum
    path.write_bytes(data)


def contents(store: Path) -> dict[str, bytes]:
    """Every file of a store."""
    return {str(file.relative_to(store)): file.read_bytes() for file in store.rglob("*") if file.is_file()}


@pytest.fixture(scope="module")
def intact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of 50 points in 5 chunks; one of its points has no answer."""
    store = tmp_path_factory.mktemp("intact") / "a.zarr"
    assert (swept(PARTLY, partly, store, chunk=10).status == FAILED).sum() == 1
    return store


def partly(stack: vt.Stack, seed: int) -> dict[str, Any]:
    """As `number`; no answer where the interface is roughest."""
    found = number(stack, seed)
    if found["alpha"] > 0.967:
        raise ValueError("too rough")
    return found


PARTLY = {**GOLD, **DRAWN, "vary": {"layer0_alpha": {"range": [0, 1]}}}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_points_are_computed_anew(damage: str, intact: Path, tmp_path: Path) -> None:
    """Expected: of any damage to a file of a chunk, one warning that names the file, and then the store as it was."""
    store = shutil.copytree(intact, tmp_path / "a.zarr")
    spoil, file = DAMAGES[damage]
    spoil(store)
    points = 50 if damage == "an array" else 10
    with pytest.warns(Damaged) as caught:
        swept(PARTLY, partly, store, chunk=10)
    message = f"{store}: files are missing or altered, {file} the first; {points} points are computed anew"
    assert [str(each.message) for each in caught] == [message]
    assert contents(store) == contents(intact)


@pytest.mark.parametrize("name", [".zmetadata", ".zgroup", "status/.zarray", "drawn/.zattrs", "layer0_alpha/.zarray"])
def test_metadata_are_written_anew(name: str, intact: Path, tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    """Expected: of metadata that are missing or cut off, no warning by anyone, and the store as it was."""
    for n, spoil in enumerate([Path.unlink, cut]):
        store = shutil.copytree(intact, tmp_path / f"{n}.zarr")
        spoil(store / name)
        swept(PARTLY, partly, store, chunk=10)
        assert not recwarn.list and contents(store) == contents(intact)


def test_a_coordinate_of_a_grid_is_written_anew(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    swept(GOLD, number, tmp_path / "a.zarr")
    before = contents(tmp_path / "a.zarr")
    flip(tmp_path / "a.zarr" / "layer0_alpha" / "0")
    assert swept(GOLD, number, tmp_path / "a.zarr").layer0_alpha.values.tolist() == [0.1, 0.2]
    assert not recwarn.list and contents(tmp_path / "a.zarr") == before


def test_foreign_files_are_left_alone(intact: Path, tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    store = shutil.copytree(intact, tmp_path / "a.zarr")
    for name in ("status/99999", "status/0.0", "status/²", "status/007", "notes.txt"):
        (store / name).write_text("mine")
    (store / "status" / "4").unlink()
    assert (swept(PARTLY, partly, store, chunk=10).status == DONE).sum() == 49
    assert not recwarn.list and (store / "status" / "99999").read_text() == "mine"


def test_a_store_that_another_sweep_has_begun_meanwhile_is_left_to_it(tmp_path: Path) -> None:
    """Expected: of two sweeps that begin one store at once, the later one ends in one line; then it goes on."""
    store, plan = tmp_path / "a.zarr", Plan.from_dict({**GOLD, "what": number, "options": {}})
    layout = dict.fromkeys(("alpha", "drawn"), StoredVariable((), (), "<f8"))
    create(store, plan, layout)
    with pytest.raises(vt.InvalidInput) as caught:
        create(store, plan, layout)
    assert str(caught.value) == f"{store}: another sweep has begun it meanwhile; the same call goes on with it"
    assert swept(GOLD, number, store).alpha.values.tolist() == [0.1, 0.2]
    assert [path.name for path in tmp_path.iterdir()] == ["a.zarr"]


@pytest.mark.parametrize(
    "plan", ["&a [*a]", "!!python/object/apply:os.getcwd []", "{a: &a [1, 1], b: [*a, *a]}", "3", 3]
)
def test_a_store_whose_plan_is_none_is_refused(plan: Any, intact: Path, tmp_path: Path) -> None:
    store = shutil.copytree(intact, tmp_path / "a.zarr")
    fields = json.loads((store / ".zattrs").read_bytes())
    (store / ".zattrs").write_text(json.dumps({**fields, "plan": plan}))
    with pytest.raises(vt.InvalidInput, match=r"a\.zarr: (is there already, and holds no sweep|holds another sweep)"):
        swept(PARTLY, partly, store, chunk=10)


# Questions -----------------------------------------------------------------------------------------------------------


def test_parts_make_the_store_that_one_sweep_makes(tmp_path: Path) -> None:
    """Also where one is repeated, and where another one has begun the store meanwhile."""
    space = {**GOLD, "vary": {"layer0_alpha": {"range": [0.1, 0.5]}}, **DRAWN, "count": 7}
    whole, parts = (tmp_path / name for name in ("whole", "parts"))
    for part in ("2/3", "2/3", "3/3", "1/3"):
        found = swept(space, number, parts, chunk=2, part=part)
        if part == "2/3":
            assert found.status.notnull().values.tolist() == [False] * 2 + [True] * 2 + [False] * 3
    assert found.equals(swept(space, number, whole, chunk=2))
    for part in ("0/3", "4/3", "one", "1/3/5"):
        with pytest.raises(vt.InvalidInput, match=r"^part: must be K/N"):
            swept(space, number, parts, chunk=2, part=part)
    plan = Plan.from_dict({**space, "what": number, "options": {}, "chunk": 2})
    begun = existing(parts, plan)
    assert begun and sweeping._begun(parts, plan, begun.layout, "1/3").path == parts


def test_a_point_that_fails_does_not_stop_the_others(tmp_path: Path) -> None:
    """Expected: errors, other shapes and other names are reasons."""

    def uneven(stack: vt.Stack, seed: int) -> dict[str, Any]:
        alpha = stack.flat()["layer0_alpha_u"]
        if alpha == 0.2:
            raise vt.InvalidInput("too rough")
        return {"alpha": np.zeros(3 if alpha == 0.3 else 2), **({"more": 1} if alpha == 0.4 else {})}

    space = {"material": "coated-gold", "vary": {"layer0_alpha": {"values": [0.2, 0.1, 0.3, 0.4]}}}
    found = swept(space, uneven, tmp_path / "a.zarr")
    assert found.status.values.tolist() == [FAILED, DONE, FAILED, FAILED]
    assert found.reason.values.tolist()[::2] == ["too rough", "alpha: has the shape (3,), where others have (2,)"]
    assert found.reason.values[3] == "more: is found at some points only"
    assert np.isnan(found.alpha.values[[0, 2, 3]]).all() and (found.alpha.values[1] == 0).all()


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda stack, seed: 3, "must return arrays by name, got int"),
        (lambda stack, seed: {"a": "text"}, "a: must be numbers, got <U4"),
        (lambda stack, seed: {"a": (("x",), 3.0)}, "a: must have 1 dimensions, got an array of shape ()"),
        (lambda stack, seed: {"a": (("x",), [1]), "b": (("x",), [1, 2])}, "b: x has 2 entries, and 1 in another array"),
        (lambda stack, seed: {"seed": 3}, "seed: another name is needed"),
        (lambda stack: {}, "options: too many positional arguments"),
    ],
)
def test_what_is_no_answer_is_refused_before_the_sweep(answer: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(vt.InvalidInput) as caught:
        swept(GOLD, answer, tmp_path / "a.zarr")
    assert message in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("what", "options", "variable", "dims"),
    [
        ("lobes", LOBES, "transmitted_alpha", ("axis", "direction")),
        ("lobes", {**LOBES, "channels": "separate"}, "alpha", ("interface", "colour", "axis", "direction")),
        ("albedo", LOBES, "transmitted", ("colour", "direction")),
        ("statistics", {"cos_theta": 0.7, "paths": 2000}, "alpha_error", ("interface", "axis", "direction")),
        ("distribution", {"cos_theta": 0.7, "paths": 2000, "bins": 4}, "transmitted", ("colour", "direction", *"xy")),
        ("check", {"model": "belcour2018"}, "value", ("law",)),
        ("inverse", {"model": "bati2021"}, "own_alpha", ("interface", "axis")),
    ],
)
def test_every_question_has_an_answer(
    what: str, options: dict[str, Any], variable: str, dims: tuple[str, ...], tmp_path: Path
) -> None:
    """Expected: a value with its names; the same as the function of that name gives, where it takes a seed."""
    glass = vt.Stack([vt.Interface(eta=1.5, alpha=0.1)])
    material = "bare-gold" if what == "check" else glass  # laws take longer of what transmits
    found = swept(
        {"material": material, "vary": {"layer0_alpha": {"values": [0.2]}}}, what, tmp_path / "a.zarr", **options
    )
    assert found.reason.isnull().all()
    assert found[variable].dims == ("layer0_alpha", *dims) and found[variable].attrs["long_name"]
    stack, seed = glass.replace(layer0_alpha=0.2), int(found.seed[0])
    if what == "statistics":
        error = vt.reference.statistics(stack, seed=seed, **options).standard_error
        assert error and np.array_equal(found.alpha_error[0], error.alpha)
    if what == "distribution":
        assert np.array_equal(found.transmitted[0], vt.reference.distribution(stack, seed=seed, **options).transmitted)
    if what == "inverse":
        assert np.allclose(found.own_alpha[0], 0.2) and np.allclose(found.eta[0], 1.5)


def test_weights_and_values_of_parts_are_swept(tmp_path: Path) -> None:
    """Expected: lobes of all stacks; sums that are linear in a weight; what each part transmits for itself."""
    glass = vt.Stack([vt.Interface(eta=1.5, alpha=0.1)])
    mix = vt.Mix([(0.5, glass), (None, vt.Mix([(0.5, "bare-gold"), (None, glass)]))])
    vary = {
        "part0_weight": {"range": [0.0, 1.0], "steps": 3},
        "part1_part0_layer0_alpha": {"values": [0.1, 0.3]},
    }
    space = {"material": mix, "vary": vary}
    found = swept(space, "lobes", tmp_path / "a.zarr", **LOBES)
    assert found.reason.isnull().all() and found.energy.dims[:3] == (*vary, "interface")
    one = mix.replace(part0_weight=0.5, part1_part0_layer0_alpha=0.3)
    assert np.array_equal(found.energy[1, 1], vt.lobes(one, **LOBES).energy)
    assert found.transmitted_energy.dims == (*vary, "part", "colour", "direction")
    albedo = swept(space, "albedo", tmp_path / "b.zarr", **LOBES).reflected
    assert np.allclose(albedo[1], (albedo[0] + albedo[2]) / 2, atol=1e-12) and np.allclose(albedo[2, 0], albedo[2, 1])
    walked = swept(space, "statistics", tmp_path / "c.zarr", cos_theta=0.7, paths=500)
    assert walked.reason.isnull().all() and walked.transmitted_mean_error.dims[2:] == ("part", "component", "direction")
    assert (walked.energy[2, :, 1:] == 0).all() and (walked.energy[1, :, 1:] > 0).all()
    others = {"material": mix, "vary": {"material": {"values": ["worn-painted-steel", mix]}}}
    albedo = swept(others, "albedo", tmp_path / "d.zarr", **LOBES)
    assert albedo.status.values.tolist() == [FAILED, DONE] and "part0_weight=0.5" in albedo.reason.values[0]
    with pytest.raises(vt.InvalidInput, match="inverse: takes a single stack, not a mixture"):
        swept(space, "inverse", tmp_path / "e.zarr", model="bati2021")


def test_the_inverse_of_a_stack_keeps_its_films(tmp_path: Path) -> None:
    oxide = vt.Stack([vt.Interface(conductor="Al", alpha=0.1, films=[vt.Film(eta=2.4, thickness_nm=60)])])
    varied = {"layer0_film0_thickness_nm": {"values": [60.0, 90.0]}}
    found = swept({"material": oxide, "vary": varied}, "inverse", tmp_path / "a.zarr", model="weier2020")
    assert found.reason.isnull().all()
    assert np.allclose(found.energy, found.asked_energy, atol=2e-3)


def test_unknown_questions_and_options_are_refused(tmp_path: Path) -> None:
    for what, options, message in [
        ("lobe", {}, "what: unknown question 'lobe' (did you mean lobes?)"),
        ("lobes", {}, "options: missing a required argument: 'cos_theta'"),
        ("statistics", {"cos_theta": 1, "path": 3}, "options: got an unexpected keyword argument 'path'"),
        (
            "lobes",
            {"cos_theta": 2},
            "none of the first 2 points has an answer: cos_theta: must lie in 0 (excluded) to 1",
        ),
        ("lobes", {"cos_theta": object()}, "options: cos_theta: must be a number, text, or a list or mapping of these"),
    ]:
        with pytest.raises(vt.InvalidInput) as caught:
            swept(GOLD, what, tmp_path / "a.zarr", **options)
        assert message in str(caught.value)
    with pytest.raises(vt.InvalidInput, match=r"^space: must be a Space or its mapping, got 'plan.yaml'$"):
        vt.sweep("plan.yaml", store=tmp_path / "a.zarr")


def test_one_thread_renders_and_the_session_keeps_its_own(tmp_path: Path) -> None:
    """Rationale: sums of several threads are rounded by chance. Expected: equal pictures; as many threads as before."""
    import drjit as dr

    before = dr.thread_count()
    options: dict[str, Any] = {"size": 16, "spp": 4, "model": "belcour2018", "env": "lobby"}  # a file of OpenEXR
    one = {**GOLD, "vary": {"layer0_alpha": {"values": [0.1]}}}
    pictures = [swept(one, "render", tmp_path / f"{n}.zarr", **options).image for n in range(2)]
    assert pictures[0].dims == ("layer0_alpha", "row", "column", "colour")
    assert dr.thread_count() == before and pictures[0].values.tobytes() == pictures[1].values.tobytes()

    def alike(stack: vt.Stack, seed: int) -> dict[str, Any]:
        return {"x": dr.thread_count() if kernel.compiles_first() else 0}

    assert swept(GOLD, alike, tmp_path / "c.zarr").x.values.tolist() == [1, 1]
    assert not kernel.compiles_first()
    assert dr.thread_count() == before


# Engines and plans ---------------------------------------------------------------------------------------------------


def test_an_executor_without_a_future_of_its_own_is_asked_whether_it_is_done(tmp_path: Path) -> None:
    """Rationale: jobs of submitit have `done`, `result` and `cancel`, and are no futures."""

    class Jobs:
        def __init__(self) -> None:
            self.pool = ThreadPoolExecutor(2)

        def submit(self, *arguments: Any) -> Any:
            future = self.pool.submit(*arguments)
            return type("Job", (), {name: getattr(future, name) for name in ("done", "result", "cancel")})

    found = vt.sweep(GOLD, number, store=tmp_path / "a.zarr", executor=Jobs(), workers=2)
    assert found.alpha.values.tolist() == [0.1, 0.2]
    with pytest.raises(vt.InvalidInput, match="executor: must be an executor, a client of dask, or the address"):
        vt.sweep(GOLD, number, store=tmp_path / "b.zarr", executor=3)


def test_a_plan_names_files_beside_it_and_its_mistakes(run: Run, tmp_path: Path) -> None:
    vt.save(vt.preset("bare-gold"), tmp_path / "gold.yaml")
    plan = tmp_path / "plan.yaml"
    fields = {**GOLD, "material": "gold.yaml", "what": "albedo", "options": {"cos_theta": 1}}
    plan.write_text(yaml.safe_dump(fields))
    assert load_plan(plan).material == vt.preset("bare-gold")
    mixed = {"mix": [{"weight": 0.5, "material": "gold.yaml"}, {"material": "coated-gold"}]}
    vary = {"part0_weight": {"values": [0.2]}}
    plan.write_text(yaml.safe_dump({**fields, "material": mixed, "vary": vary}))
    assert load_plan(plan).material == vt.Mix([(0.5, "bare-gold"), (None, "coated-gold")])
    for key, value, message in [
        ("whta", "albedo", "unknown key 'whta' (did you mean what?)"),
        ("what", "albdo", "what: unknown question 'albdo' (did you mean albedo?)"),
        ("chunk", 0, "chunk: must be a whole number in 1 to 1073741824, got 0"),
        ("material", "silver.yaml", "silver.yaml: file not found"),
    ]:
        plan.write_text(yaml.safe_dump({**fields, key: value}))
        status, out, err = run("sweep", str(plan), "-o", str(tmp_path / "a.zarr"))
        assert (status, out) == (2, "") and err.startswith(f"velatura: {plan}: ") and message in err
        assert len(err.splitlines()) == 1
    assert not (tmp_path / "a.zarr").exists()


def test_without_the_extra_one_line_names_it(tmp_path: Path) -> None:
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump({**GOLD, "options": {"cos_theta": 1}}))
    script = "import sys; sys.modules['zarr'] = None; from velatura.cli import main; main()"
    command = [sys.executable, "-c", script, "sweep", "plan.yaml", "-o", "a.zarr"]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    mend = f'{sys.executable} -m pip install "velatura[sweep]"'
    assert (ended.returncode, ended.stderr) == (1, f"velatura: zarr is not installed: run `{mend}`\n")
