"""The open benchmark: its bins, its stacks and their schema, the truth that is shipped, and what scores say."""

from __future__ import annotations

import csv
import json
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from fuzzing import candidates as hostile
from scipy.stats import chi2, norm

import velatura as vt
from velatura import benchmark
from velatura.benchmark import candidates, scores, stacks, walks
from velatura.light.polar_bins import AZIMUTHAL, NODES, RADIAL, Bins
from velatura.stack import Stack

PATHS = 2**17  # of the walks that are made here
FALSE_ALARM = 1e-5  # of one test of statistics

DIRECTIONS = [(0.1, 0.0), (0.8, 2.0), (1.3, -1.0)]


def direction(theta: float, phi: float) -> np.ndarray:
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def case_of(id: str) -> benchmark.Case:
    return next(case for number in benchmark.EDITIONS for case in benchmark.edition(number) if case.id == id)


def only(*ids: str):
    """Makes a factory say nothing of all other stacks."""
    return lambda factory: lambda case: factory(case) if case.id in ids else None


# Bins ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("theta", "phi"), DIRECTIONS)
@pytest.mark.parametrize(("side", "eta"), [("reflected", 1.0), ("transmitted", 1.5), ("transmitted", 1 / 1.5)])
def test_nodes_cover_the_disc_bin_by_bin(theta: float, phi: float, side: str, eta: float) -> None:
    """Expected: the disc's area, moments of a disc, and every node in its own bin."""
    bins = Bins.of(direction(theta, phi), side, eta)
    wo, weight = bins.nodes()
    area = weight * np.abs(wo[2])
    assert area.sum() == pytest.approx(np.pi, rel=1e-12)
    assert (area * wo[0] ** 2).sum() == pytest.approx(np.pi / 4, rel=1e-4)
    assert np.allclose(np.sum(wo**2, axis=0), 1)
    assert (np.sign(wo[2]) == (1 if side == "reflected" else -1)).all()
    assert (bins.number(wo) == np.repeat(np.arange(RADIAL * AZIMUTHAL), NODES**2)).all()


def test_a_smooth_stack_sends_light_to_the_centre() -> None:
    """Expected: the mirror's and the refracted direction in the first row of bins."""
    wi = direction(0.7, 0.3)
    mirror = np.array([[-wi[0]], [-wi[1]], [wi[2]]])
    refracted = np.array([[-wi[0] / 1.5], [-wi[1] / 1.5], [-np.sqrt(1 - (1 - wi[2] ** 2) / 2.25)]])
    assert Bins.of(wi, "reflected", 1.5).number(mirror) < AZIMUTHAL
    assert Bins.of(wi, "transmitted", 1.5).number(refracted) < AZIMUTHAL


# The edition ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("number", "count"), [(1, 120), (2, 78)])
def test_stacks_follow_from_the_seed_and_keep_the_schema(number: int, count: int) -> None:
    """Expected: what the command draws is what is shipped, all of it, and valid by a validator of schemas."""
    import jsonschema  # takes a second, which every worker of the tests would pay

    edition = benchmark.EDITIONS[number]
    found = json.loads((edition.data / "stacks.json").read_text())
    schema = json.loads(stacks.SCHEMA.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(found, schema)
    assert found["stacks"] == [case.to_dict() for case in edition.all_drawn()]
    assert len(found["stacks"]) == count
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**found, "stacks": [{**found["stacks"][0], "bounces": "some"}]}, schema)


def test_layers_are_written_out() -> None:
    """Expected: a stack built from `layers` alone is the material beside them."""
    for case in (*benchmark.edition(1), *benchmark.edition(2)):
        fields, layers = case.to_dict(), []
        for layer in fields["layers"]:
            kind = layer.pop("kind")
            values = {
                name: tuple(value) if isinstance(value, list) and name != "films" else value
                for name, value in layer.items()
            }
            if kind in ("dielectric", "conductor", "mirror"):
                values["alpha"] = (values.pop("alpha_u"), values.pop("alpha_v"))
                values |= {"conductor": "mirror"} if kind == "mirror" else {}
                layers.append({"interface": values})
            else:
                layers.append({kind: values})
        rebuilt = Stack(layers, thin=fields["thin"])
        for name, value in rebuilt.flat().items():
            own = case.stack.flat()[name]
            if fields["thin"] and name == f"layer{len(layers) - 1}_eta":
                own = 1.0  # below a pane
            assert np.broadcast_to(value, 3) == pytest.approx(np.broadcast_to(own, 3))


@pytest.mark.parametrize(("number", "count"), [(1, 120), (2, 78)])
def test_the_truth_is_small_and_adds_up(number: int, count: int) -> None:
    """Expected: 3 MB at most; bins that add up to the energies, within their rounding; no light from
    nothing; the same energies in the table."""
    data = benchmark.EDITIONS[number].data
    assert sum(file.stat().st_size for file in Path(str(data)).iterdir()) <= 3e6
    true = benchmark.truth(number)
    assert len({id for id, _, _ in true}) == count
    for light in true.values():
        assert light.energy.sum(axis=(0, 1)) == pytest.approx(light.total, rel=1e-4, abs=1e-6)
        assert (light.energy_error[light.energy > 0] > 0).all()
        assert (light.total < 1 + 5 * light.total_error + 1e-6).all()
    with (data / "energies.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["stack"], row["side"]) for row in rows] == [(id, side) for id, _, side in true]
    for row, light in zip(rows, true.values()):
        assert [float(row[f"energy_{c}"]) for c in "rgb"] == pytest.approx(light.total, rel=1e-4)


@pytest.mark.parametrize("id", ["one-interface-01", "frosted-pane-00"])
def test_the_truth_follows_from_the_seed(id: str) -> None:
    """Expected: the shipped light of one direction, to the rounding of its file and a tenth of its standard error, as
    machines round differently."""
    case = case_of(id)
    light = walks.walked(case, 1)["transmitted"]
    shipped = benchmark.truth(case.edition)[id, 1, "transmitted"]
    for name in ("energy", "total", "mean", "covariance"):
        allowed = 1e-4 * np.abs(getattr(light, name)) + 0.1 * getattr(shipped, f"{name}_error") + 1e-7
        assert (np.abs(getattr(light, name) - getattr(shipped, name)) <= allowed).all()


def test_walks_are_kept_and_continued(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: files of the same bytes from the same seed, without another walk where all are there."""
    cases = [case_of("one-interface-00"), case_of("one-interface-01")]
    monkeypatch.setattr(benchmark.Edition, "all_drawn", lambda self, of_each, seed: cases)
    for folder in ("a", "b"):
        walks.walk_all(tmp_path / folder, paths=1000)
    written = {name: (tmp_path / "a" / name).read_bytes() for name in ("stacks.json", "truth.npz", "energies.csv")}
    assert written == {name: (tmp_path / "b" / name).read_bytes() for name in written}
    monkeypatch.setattr(walks, "walked", None)
    walks.walk_all(tmp_path / "a", paths=1000)
    assert written == {name: (tmp_path / "a" / name).read_bytes() for name in written}


# Scores --------------------------------------------------------------------------------------------------------------


def test_a_lambertian_has_its_albedo_in_its_bins() -> None:
    """Expected: an albedo of .3 in all, and in each bin its share of the disc's area."""
    case = case_of("diffuse-base-00")
    found = candidates.seen(case, lambda wi, wo: np.full(wo.shape, 0.3 / np.pi) * wo[:, 2:])
    for (n, side), light in found.items():
        assert light.total == pytest.approx(0.3, rel=1e-9)
        wo, weight = Bins.of(case.incident[n], side, 1.0).nodes(8)
        area = (weight * wo[2]).reshape(RADIAL, AZIMUTHAL, -1).sum(axis=-1)
        assert light.energy[..., 0] == pytest.approx(0.3 / np.pi * area, rel=1e-3)


def test_another_seed_of_the_walk_is_within_the_noise() -> None:
    """Rationale: errors of the truth are what they are said to be. Expected: energies and bins of two stacks, one of
    which passes light, by chi squared with a false alarm in 10^5 each; variation as the noise foretells."""
    found, true = [], benchmark.truth()
    for id in ("two-interfaces-03", "pane-01"):
        case = case_of(id)
        for (n, side), light in candidates.seen(case, benchmark.Walk(7, PATHS)).items():
            mine = true[id, n, side]
            z = (light.total - mine.total) / np.hypot(light.total_error, mine.total_error).clip(1e-6)
            assert np.abs(z[1]) < norm.isf(FALSE_ALARM / 2)
            # One half of a symmetric grid, one colour, and bins that many paths are in
            half = np.s_[:, : AZIMUTHAL // 2 if case.symmetric else AZIMUTHAL, 1]
            error = np.hypot(light.energy_error, mine.energy_error)[half]
            many = light.energy[half] > 100 / PATHS
            squares = (((light.energy - mine.energy)[half] / error.clip(1e-12))[many] ** 2).sum()
            assert squares < chi2.isf(FALSE_ALARM, many.sum())
            found.append((np.abs(light.energy - mine.energy).sum(), 0.798 * error.sum()))
    assert len(found) == 4 + 8


def test_a_wrong_roughness_scores_worse() -> None:
    """Rationale: one interface whose facets are met once is Mitsuba's own, on either side and beyond the critical
    angle. Expected: variation at the noise, no error of energy or width; with alpha x 1.2, far above, and a width that
    is 20 % off."""
    ids = "one-interface-00", "one-interface-05"

    def made(factor: float):
        def of(case: benchmark.Case):
            fields = benchmark.entrant("rough-interface")(case)
            return {key: factor * x if key.startswith("alpha") else x for key, x in fields.items()}

        return benchmark.score(only(*ids)(of), kinds=["one interface"])

    right, wrong = made(1.0), made(1.2)
    assert len(right.records) == len(wrong.records) >= 8
    assert {r.side for r in right.records} == {"reflected", "transmitted"}
    for record in right.records:
        assert record.variation < 1.3 * record.floor + 0.01
        assert abs(record.width) < 5 * record.width_noise + 0.01
        assert all(abs(x) < 5 * e + 0.005 for x, e in zip(record.albedo, record.albedo_noise))
    assert right.summary()["variation"] < 0.5 * wrong.summary()["variation"]
    reflected = [r.width for r in wrong.records if r.side == "reflected" and r.stack == ids[0]]
    assert reflected == pytest.approx([np.log(1.2)] * len(reflected), abs=0.04)


def test_a_candidate_is_a_function_a_plugin_or_nothing() -> None:
    """Expected: what it does not say is not scored, and counts in what it was asked; reasons are counted."""
    asked = sum(case.kind == "one interface" for case in benchmark.edition())

    def nothing_passes(case: benchmark.Case):
        def value(wi, wo):
            return np.where(wo[:, 2:] * wi[:, 2:] > 0, wo * 0 + 0.1, np.nan)

        return value

    found = benchmark.score(nothing_passes, kinds=["one interface"])
    assert found.records and {r.side for r in found.records} == {"reflected"}
    assert found.summary()["records"] < found.summary()["asked"]
    assert "spread" not in found.summary()

    def refusing(case: benchmark.Case):
        raise vt.InvalidInput("no such stack")

    found = benchmark.score(refusing, kinds=["one interface"])
    assert found.refused == {"no such stack": asked}
    assert found.summary() == {"records": 0, "asked": found.asked["one interface"]}
    with pytest.raises(vt.InvalidInput, match="must have the shape"):
        benchmark.score(lambda case: lambda wi, wo: wo[:, 0], kinds=["one interface"])
    with pytest.raises(vt.InvalidInput, match="got int"):
        benchmark.score(lambda case: 3, kinds=["one interface"])
    with pytest.raises(vt.InvalidInput, match="kind"):
        benchmark.score(lambda case: None, kinds=["no interface"])


def test_a_black_candidate_has_half_of_the_light_in_wrong_places() -> None:
    """Expected: .5 by definition, an albedo error of 1, and no width."""
    found = benchmark.score(lambda case: lambda wi, wo: 0 * wo, kinds=["films"])
    for record in found.records:
        assert record.variation == pytest.approx(0.5, rel=1e-3)
        assert record.width is None and all(x == pytest.approx(-1) for x in record.albedo if x is not None)
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))


@pytest.mark.parametrize(("number", "name"), list(enumerate(hostile.FUNCTIONS)))
def test_a_hostile_candidate_is_refused_in_one_line_or_scored(number: int, name: str) -> None:
    """Expected: a line that names the stack, or scores that are numbers; stacks and truth as they were."""
    assert not hostile.scored(name, number)


def test_a_failure_has_its_cause() -> None:
    """Expected: the error of a candidate's own code, for its author to see the place."""

    def broken(case: benchmark.Case):
        raise KeyError("alpha")

    with pytest.raises(vt.InvalidInput, match=r"^films-00: the candidate failed: KeyError: 'alpha'$") as found:
        benchmark.score(broken, kinds=["films"])
    assert isinstance(found.value.__cause__, KeyError)


def test_a_name_is_no_formula_in_a_figure(tmp_path: Path) -> None:
    found = benchmark.score(lambda case: None, "$\\foo{$", ["films"])
    benchmark.save_figure([found], tmp_path / "scores.svg")
    assert (tmp_path / "scores.svg").stat().st_size > 1000


def test_scores_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    factory = only("one-interface-00")(lambda case: {"type": "roughconductor", "alpha": 0.1})
    place = tmp_path / "new" / "mine.json"
    found = benchmark.kept_score(place, factory, "mine", ["one interface"])
    assert found.cost is None and found.summary()["spread"] >= 0
    monkeypatch.setattr(scores, "score", None)
    timed = benchmark.kept_score(place, factory, "mine", ["one interface"], timed=True)
    assert timed.cost and timed.summary("one interface") == found.summary("one interface")
    again = benchmark.kept_score(place, factory, "mine", ["one interface"])
    assert again.summary() == timed.summary()
    with pytest.raises(vt.InvalidInput, match="other kinds"):
        benchmark.kept_score(place, factory, "mine", ["films"])
    with pytest.raises(vt.InvalidInput, match="other kinds"):
        benchmark.kept_score(place, factory, "mine", ["glaze"], edition=2)
    good = json.loads(place.read_text())
    for text in (
        "{}",
        "[]",
        "[" * 100_000,
        '{"records": NaN}',
        json.dumps({**good, "cost": "x"}).replace('"x"', "1e999"),
    ):
        place.write_text(text)
        with pytest.raises(vt.InvalidInput, match="holds no scores") as refused:
            benchmark.kept_score(place, factory, "mine", ["one interface"])
        assert str(refused.value).isprintable()


@pytest.mark.parametrize(
    ("id", "applies"),
    [
        ("one-interface-00", {"rough-interface", "weidlich_wilkie"}),
        ("one-interface-01", {"rough-interface"}),
        ("scattering-01", set()),
        ("films-00", set()),
    ],
)
def test_entrants_leave_out_what_they_cannot_express(id: str, applies: set[str]) -> None:
    found = set()
    for name in ("rough-interface", "roughplastic", "weidlich_wilkie"):
        try:
            if benchmark.entrant(name)(case_of(id)) is not None:
                found.add(name)
        except vt.InvalidInput as refusal:
            assert "film" in str(refusal)
    assert found == applies


def test_all_kinds_are_drawn_with_the_light_that_they_need() -> None:
    """Expected: alpha of .02 at least, panes from both sides, solids from inside and beyond the critical angle."""
    for case in benchmark.edition():
        alphas: list[np.ndarray] = [np.broadcast_to(interface.alpha, 2) for interface in case.stack.interfaces]
        assert all((a >= 0.02).all() and (a[0] == a[1] or (a >= 0.05).all()) for a in alphas)
        assert np.linalg.norm(case.incident, axis=1) == pytest.approx(1)
        below = case.incident[case.incident[:, 2] < 0]
        momenta = case.eta * np.hypot(*below[:, :2].T)
        if case.kind == "from inside":
            assert (momenta > 1).sum() == 2 and (momenta < 1).sum() == 2
        assert bool(len(below)) == (case.stack.transmits)
    symmetric = list(chain(case.symmetric for case in benchmark.edition() if case.kind in ("brushed", "turned")))
    assert not any(symmetric)


def test_the_second_edition_is_lit_from_above_up_to_grazing_angles() -> None:
    """Expected: facets that are met often, alpha of .005 at least, .02 where it has two axes."""
    for case in benchmark.edition(2):
        assert case.often and case.incident[:, 2] == pytest.approx([0.9, 0.5, 0.2, 0.08])
        assert np.linalg.norm(case.incident, axis=1) == pytest.approx(1)
        alphas: list[np.ndarray] = [np.broadcast_to(interface.alpha, 2) for interface in case.stack.interfaces]
        assert all((a >= 0.005).all() and (a[0] == a[1] or (a >= 0.02).all()) for a in alphas)
        assert bool(case.incident[:, 1].any()) != case.symmetric
    assert {case.kind for case in benchmark.edition(2) if not case.symmetric} == {
        "brushed under lacquer",
        "crossed brushing",
    }


@pytest.mark.parametrize("id", ["very-smooth-02", "brushed-under-lacquer-02", "glaze-01"])
def test_nodes_resolve_narrow_light(id: str) -> None:
    """Rationale: lobes of alpha .005, seen at grazing angles, are far narrower than a bin. Expected: the energy that
    samples of the model have, within .002 and six of their standard errors: a false alarm in 10^7."""
    case = case_of(id)
    plugin = candidates.made(benchmark.entrant("velatura")(case))
    found, u = candidates.seen(case, plugin), candidates.evenly(14, 0)
    for n, wi in enumerate(case.incident):
        drawn = plugin.probe.sample(np.broadcast_to(wi, u.shape), u)
        for side, kept in (("reflected", drawn.wo[:, 2] > 0), ("transmitted", drawn.wo[:, 2] < 0)):
            light = (drawn.weight * kept[:, None]).mean(axis=1)
            if light.mean() > 0:
                bound = 0.002 + 6 * light.std() / np.sqrt(len(light))
                assert found[n, side].total.mean() == pytest.approx(light.mean(), abs=bound)


def test_unknown_editions_are_refused(run) -> None:
    status, _, err = run("benchmark", "score", "--edition", "3", "--model", "walk")
    assert (status, err) == (2, "velatura: edition: must be one of 1, 2, got 3\n")


def test_unknown_entrants_are_refused(run) -> None:
    status, _, err = run("benchmark", "score", "--model", "belcour2019")
    assert status == 2 and "belcour2018" in err
