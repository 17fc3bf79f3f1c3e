"""Films in the inverse: an interface of a target may carry some, and stacks keep those that they have."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from benchmarks import benchmark

import velatura as vt
from velatura.errors import InvalidInput
from velatura.inverse import Infeasible, Target, alternatives, invert_stack
from velatura.inverse.local.dragged import seen
from velatura.model import named
from velatura.stack import Interface, Stack

EXACT = 1e-6
OXIDE, QUARTER = [{"eta": 2.4, "thickness_nm": 60.0}], [{"eta": 1.38, "thickness_nm": 100.0}]
COAT: dict[str, Any] = {"energy": 0.04, "alpha": 0.05}
ANODISED: dict[str, Any] = {
    "energy": [0.2, 0.25, 0.35],
    "alpha": 0.25,
    "base": "conductor",
    "fixed": {"films": [OXIDE]},
}

METAL = Stack([Interface(eta=(2.7, 2.5, 2.3), k=(3.8, 3.4, 3.1), alpha=0.2, films=OXIDE)])
WRITTEN = Stack([Interface(eta=1.5, alpha=0.1), *METAL.layers])


def missed(target: Target, stack: Stack, model: str) -> float:
    """The largest difference of energies and roughnesses between a target and the lobes of a stack."""
    found, first, worst = vt.lobes(stack, 1.0, model=model), 0, 0.0
    for lobe in target.lobes:
        own = slice(first, first := first + lobe.interfaces)
        worst = max(worst, float(np.abs(np.sum(found.energy[own], axis=0)[:, 0] - lobe.colour).max()))
        worst = max(worst, float(np.abs(np.mean(found.alpha[own], axis=0)[:, 0] - lobe.roughness).max()))
    return worst


def films(stack: Stack) -> list[Any]:
    return [[film.to_dict() for film in layer.films] for layer in stack.interfaces]


@pytest.mark.parametrize(("model", "count"), [("velatura", 4), ("bati2021", 1), ("weier2020", 6)])
def test_lobes_of_random_stacks_with_films_are_met(model: str, count: int) -> None:
    """Rationale: such a target has a stack, at least one, and the answer is read by `vt.lobes` as asked."""
    own = benchmark("inverse")
    refused, off, _ = own.of_stacks(own.physical_targets(count, named(model), seed=0, coated=True), named(model))
    assert len(off) >= count - 1, refused
    assert np.max(off) < EXACT


@pytest.mark.parametrize("model", ["velatura", "bati2021"])
def test_the_metal_under_an_oxide_under_a_coat_is_found(model: str) -> None:
    target = Target([COAT, ANODISED])
    found = invert_stack(target, model).stack
    assert films(found) == [[], OXIDE]
    assert missed(target, found, model) < EXACT


@pytest.mark.parametrize("model", ["velatura", "bati2021"])
def test_the_index_of_a_coat_under_an_antireflection_film_is_found(model: str) -> None:
    """Expected: the coat, since a colour of the first lobe leaves but one index."""
    layers = [
        {"interface": {"eta": 1.7, "alpha": 0.05, "films": QUARTER}},
        {"interface": {"conductor": "Au", "alpha": 0.2}},
    ]
    given = Stack.from_dict({"layers": layers})
    form = Target([{"energy": 0.1, "fixed": {"films": [QUARTER]}}, {"energy": 0.5, "base": "conductor"}])
    found = invert_stack(seen(given, form, named(model)), model).stack
    assert found.interfaces[0].eta == pytest.approx(1.7, abs=1e-4)
    assert films(found) == [QUARTER, []]


def test_alternatives_keep_films_and_are_in_the_class() -> None:
    target = Target([COAT, ANODISED])
    found = alternatives(target, 3)
    assert len({solution.stack.interfaces[1].eta for solution in found}) == 3
    for solution in found:
        assert films(solution.stack) == [[], OXIDE]
        assert missed(target, solution.stack, "velatura") < 1e-5
    names = [coordinate.name for coordinate in found[0].classes[1].coordinates]
    assert names == ["tau_0", "tint"]


def test_a_refusal_beside_films_has_a_way_out() -> None:
    """A coat whose film reflects colours cannot be grey."""
    lobe = {"energy": 0.04, "fixed": {"films": [OXIDE]}}
    with pytest.raises(Infeasible, match=r"^no stack: lobe 1: ") as refused:
        invert_stack([lobe])
    nearest = refused.value.nearest
    assert nearest is not None
    again = Target.from_dict(nearest.to_dict())
    assert missed(nearest, invert_stack(again).stack, "velatura") < EXACT


# From a stack that has films


@pytest.mark.parametrize("model", ["velatura", "weier2020"])
def test_a_coat_keeps_the_appearance_of_films(model: str) -> None:
    found = vt.inverse.coat(WRITTEN, 1.4, 0.03, keep_appearance=True, model=model)
    assert found.losses == ()
    assert films(found.stack) == [[], [], OXIDE]
    for row in found.change():
        np.testing.assert_allclose(row["energy_after"], row["energy_before"], atol=EXACT)
        np.testing.assert_allclose(row["alpha_after"], row["alpha_before"], atol=EXACT)


def test_a_simpler_stack_has_its_films() -> None:
    """Expected: a metal under the same oxide, nearer to the whole than the metal is without its coat."""
    found = vt.inverse.simplify(WRITTEN, 1, "weier2020")
    assert films(found.stack) == [OXIDE]
    alone = WRITTEN.with_layers(WRITTEN.layers[1:])
    compared = vt.inverse.Directions.about_lobes(False)
    wanted, fitted, as_it_is = (
        vt.inverse.table_of(one, compared, "weier2020", with_energy=True).energy
        for one in (WRITTEN, found.stack, alone)
    )
    assert np.abs(fitted - wanted).max() < 0.5 * np.abs(as_it_is - wanted).max()


def test_the_thickness_of_a_film_is_fitted() -> None:
    """Expected: intervals that hold what the table was made of."""
    table = vt.inverse.table_of(METAL, vt.inverse.Directions.about_lobes(False), "weier2020")
    guess = METAL.replace(layer0_alpha=0.22, layer0_film0_thickness_nm=75.0, layer0_film0_eta=2.3)
    found = vt.inverse.fit(table, [guess], "weier2020")
    assert found.error < 1e-4
    truth = {"layer0_film0_thickness_nm": 60.0, "layer0_film0_eta": 2.4, "layer0_alpha": 0.2}
    estimates = {estimate.name: estimate for estimate in found.estimates}
    for name, value in truth.items():
        assert estimates[name].low - 1e-4 <= value <= estimates[name].high + 1e-4
    assert estimates["layer0_alpha"].value == pytest.approx(0.2, abs=1e-3)


# Refusals


@pytest.mark.parametrize(
    ("lobe", "message"),
    [
        ({"fixed": {"films": OXIDE}}, "lobe 1: fixed: films: must be a list of films, got "),
        ({"fixed": {"films": [OXIDE, OXIDE]}}, "lobe 1: fixed: films: must hold an entry for each interface, 1, got 2"),
        (
            {"base": "mirror", "fixed": {"films": [OXIDE]}},
            "lobe 1: fixed: films: interface 0, film 0: not on a mirror, which reflects all light",
        ),
        ({"fixed": {"films": [[{"eta": 2.4}]]}}, "lobe 1: fixed: films: .*film 0: thickness_nm: "),
    ],
)
def test_films_that_cannot_be_fixed_get_one_line(lobe: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInput, match=f"^{message}") as refused:
        invert_stack([{"energy": 0.1, **lobe}])
    assert "\n" not in str(refused.value)
