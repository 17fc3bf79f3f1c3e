"""Solutions that the page interpolates along the values of a material, against the solver.

Rationale: a page without Python draws changed values by them, and says that they are nearly those of the model. The
measure is the light that is elsewhere than the solved BSDF has it, whose distance from the closed form shows what that
is worth.
"""

from __future__ import annotations

import numpy as np
import pytest
from interpolating import Interpolated, flat, random_values

from velatura.editor import tabulated
from velatura.model import DEFAULT, named
from velatura.stack import Interface, Stack, preset

MODEL = named(DEFAULT)
STACKS = {
    "absorbing coat": preset("coloured-absorbing-coat"),
    "paint": preset("varnished-paint"),
    "brushed metal": Stack([Interface(conductor="Al", alpha=(0.1, 0.3), rotation=30)]),
}
ALONE, TOGETHER = 0.05, 0.1  # of the light, where one value moves, and two do


def moved(made: Interpolated, count: int, rng: np.random.Generator) -> list[Stack]:
    """Stacks with random values on so many axes, of several near their own ones."""
    axes, near = made.table["axes"], flat(made.stack) if count > 1 else None
    stacks = []
    for k in range(len(axes)):
        chosen = [k, *((k + 1 + j) % len(axes) for j in range(count - 1))]
        stacks.append(
            made.stack.replace(**{n: x for j in chosen for n, x in random_values(axes[j], rng, near).items()})
        )
    return stacks


def errors(made: Interpolated, stacks: list[Stack], rng: np.random.Generator) -> np.ndarray:
    """Those of what is interpolated and of the closed form, (stacks, 2), without stacks that are beyond."""
    found = zip(stacks, made.at(stacks))
    return np.array([made.distances(stack, each, rng) for stack, each in found if each])


@pytest.mark.parametrize("stack", STACKS.values(), ids=STACKS)
def test_values_that_move_have_nearly_the_light_of_the_solver(stack: Stack) -> None:
    """Expected: by a few per cent where one value moves, and nearer than the closed form in the mean where two do."""
    made, rng = Interpolated(stack, MODEL), np.random.default_rng(3)
    one, two = (errors(made, moved(made, count, rng), rng) for count in (1, 2))
    assert len(one) == len(made.table["axes"]) and len(two)
    assert (one[:, 0] < ALONE).all() and (one[:, 0] < one[:, 1]).all()
    assert two[:, 0].mean() < min(TOGETHER, two[:, 1].mean())


def test_wide_light_of_glass_is_that_of_the_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: likewise, where numbers of light are weighed by its energy, of one axis."""
    axes = tabulated.axes
    monkeypatch.setattr(tabulated, "axes", lambda stack: axes(stack)[:1])
    made, rng = Interpolated(preset("frosted-glass"), MODEL), np.random.default_rng(4)
    (found,) = errors(made, [made.stack.replace(layer0_alpha=0.47)], rng)
    assert found[0] < ALONE < found[1]


def test_a_material_itself_is_as_it_was_solved_and_what_is_far_is_not_interpolated() -> None:
    made = Interpolated(preset("glossy-plastic"), MODEL)
    changes = [
        {},
        {"layer0_eta": 3.5},
        {"layer0_alpha": 0.9, "layer0_eta": 2.5, "layer1_albedo": 1.0},
        {"layer0_alpha": 0},
    ]
    same, beyond, far, smooth = made.at([made.stack.replace(**each) for each in changes])
    assert same is not None and smooth is not None
    for name, own in vars(made.own).items():
        np.testing.assert_allclose(getattr(same, name), own, rtol=1e-6)
    assert beyond is far is None


def test_axes_are_of_what_may_move() -> None:
    """Expected: both roughnesses of what is brushed, with its turn; no indices of metals by name, nor beside films."""
    names = [axis.names for axis in tabulated.axes(preset("coated-gold"))]
    coat = [["layer0_alpha_u", "layer0_alpha_v"], ["layer0_eta"], ["layer1_sigma_a", "layer1_depth"]]
    assert names == [*coat, ["layer2_alpha_u"], ["layer2_alpha_v"], ["layer2_rotation"]]
    assert [axis.names for axis in tabulated.axes(preset("anodised-titanium"))] == [
        ["layer0_alpha_u"],
        ["layer0_alpha_v"],
        ["layer0_rotation"],
    ]
    low, high = (
        tabulated.axes(Stack([Interface(eta=eta), Interface(eta=1.8), Interface(eta=1.0)]))[1].along for eta in (1.4, 2)
    )
    assert low.high < 1.8 < high.low


def test_axes_end_where_light_takes_other_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: no roughness of a smooth pane, whose program draws other facets."""
    axes = tabulated.axes
    monkeypatch.setattr(tabulated, "axes", lambda stack: axes(stack)[:1])
    assert tabulated.tabulated(Stack([Interface(eta=1.5), Interface(eta=1.0)]), MODEL)["axes"] == []
