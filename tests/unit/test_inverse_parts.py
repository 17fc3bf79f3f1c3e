"""Parts of the inverse by themselves: what may change in a descent or a drag, sets of directions, and choices."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from velatura.inverse import Above, Choice, Directions, EquivalenceClass, Target, invert_interface
from velatura.inverse.coats import _choices
from velatura.inverse.fitting.angles import ANGLES, AZIMUTHS, TILTS
from velatura.inverse.fitting.free_values import CONDUCTOR, DEPTH_MAX, FreeValues, extinction, share
from velatura.inverse.lobes import interface, stacks
from velatura.inverse.lobes.interface import DENSER, RARER
from velatura.inverse.lobes.partial_stack import Layers
from velatura.inverse.local.dragged import DraggedStack
from velatura.inverse.nearest import nearest
from velatura.model import named
from velatura.model.guards import ALPHA_MIN
from velatura.model.variance import Isotropic, Roughness
from velatura.optics import fresnel
from velatura.stack import Diffuse, Interface, Material, Medium, Stack

PLAIN = named("bati2021", reflectance="fresnel")
AVERAGED = named("bati2021")
HEAD_ON = Directions.of(np.zeros(2), np.zeros(2), np.zeros(2))

# What changes in a descent -------------------------------------------------------------------------------------------


def free(layer: Any, darkest: float = 0.0) -> dict[tuple[Any, ...], tuple[float, float, bool]]:
    """Bounds, and whether they are logarithmic, by keys and channel, of a layer below a coat."""
    stack = Stack([Interface(eta=1.5), layer, *([] if layer.surface else [Interface(conductor="mirror")])])
    found = FreeValues(start=stack, darkest=darkest).free
    return {(*one.keys, one.channel): (one.low, one.high, one.logarithmic) for one in found if one.layer == 1}


def test_a_dielectric_may_change_its_index_and_roughness() -> None:
    rough = (ALPHA_MIN, 1.0, True)
    assert free(Interface(eta=1.8, alpha=0.1)) == {("alpha_u", "alpha_v", None): rough, ("eta", None): (1.0, 4.0, True)}
    assert free(Interface(eta=0.8, alpha=0.1))[("eta", None)] == (0.8, 4.0, True)
    assert free(Interface(eta=5.0, alpha=0.1))[("eta", None)] == (1.0, 5.0, True)
    coloured = free(Interface(eta=(1.4, 1.5, 1.6), alpha=0.1))
    assert [key for key in coloured if key[0] == "eta"] == [("eta", 0), ("eta", 1), ("eta", 2)]
    along = free(Interface(eta=1.5, alpha=(0.1, 0.3)))
    assert [key for key in along if key[0] != "eta"] == [("alpha_u", None), ("alpha_v", None)]
    turned = free(Interface(eta=1.5, alpha=(0.1, 0.3), rotation=30))
    assert turned[("rotation", None)] == (-150, 210, False)
    assert ("rotation", None) not in free(Interface(eta=1.5, alpha=0.1, rotation=30))


def test_a_metal_may_change_its_reflectance_and_no_mirror_its_index() -> None:
    found = free(Interface(eta=(0.2, 2.0, 1.0), k=(3.0, 1.0, 1.0), alpha=0.1))
    assert [found[("eta", c)] for c in range(3)] == [(*CONDUCTOR, True)] * 3
    dark = float(share(np.array(2.0), np.array(1.0)))
    assert dark < 0
    assert [found[("k", c)] for c in range(3)] == [
        (0.0, 1.0, False),
        (pytest.approx(dark), 1.0, False),
        (0.0, 1.0, False),
    ]
    assert free(Interface(eta=0.2, k=3.0), darkest=-0.5)[("k", 0)] == (-0.5, 1.0, False)
    assert list(free(Interface(conductor="mirror", alpha=0.1))) == [("alpha_u", "alpha_v", None)]


def test_the_share_of_a_metal_and_its_extinction_are_each_others_inverse() -> None:
    eta, k = np.array([0.1, 1.0, 3.0]), np.array([4.0, 1.0, 1.5])
    np.testing.assert_allclose(extinction(eta, share(eta, k)), k, rtol=1e-9)
    np.testing.assert_allclose(share(eta, eta), 0, atol=1e-12)
    bright = extinction(eta, np.ones(3))
    np.testing.assert_allclose(fresnel.normal_incidence(eta, bright), 0.999)


def test_a_medium_and_a_base_may_change_their_colours() -> None:
    assert free(Medium(depth=2.0, sigma_a=0.1)) == {("sigma_a", c): (0.0, DEPTH_MAX / 2, False) for c in range(3)}
    assert free(Medium(depth=0.0, sigma_a=0.1)) == {}
    assert free(Diffuse(albedo=0.3)) == {("albedo", c): (0.0, 1.0, False) for c in range(3)}


# Directions ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turned", [False, True])
def test_directions_lie_about_the_mirror_direction(turned: bool) -> None:
    """Every half-vector has one of the slopes, at every angle of incidence one is the normal; all lie above."""
    found = Directions.about_lobes(turned)
    np.testing.assert_allclose(np.linalg.norm([found.wi, found.wo], axis=1), 1)
    assert found.above.all()
    slopes = np.tan(np.radians(found.tilt))
    assert np.abs(slopes[:, None] - np.array(TILTS)).min(axis=1).max() < 1e-9
    np.testing.assert_allclose(np.degrees(np.arccos(found.wi[2])), found.theta_i, atol=1e-6)
    assert set(found.theta_i) == set(ANGLES)
    for angle in ANGLES:
        own = found.take(found.theta_i == angle)
        assert np.sum(own.tilt < 1e-6) >= (len(AZIMUTHS) if turned else 1)
        assert {0.006, 0.1} <= {round(float(t), 3) for t in np.tan(np.radians(own.tilt))} | {0.1}
    # Azimuths of incidence, and how far half-vectors go round
    azimuth = np.degrees(np.arctan2(found.wi[1], found.wi[0]))[found.theta_i > 0]
    expected = AZIMUTHS if turned else (0.0,)
    assert sorted(set(np.round(azimuth, 6))) == pytest.approx(expected)
    assert found.brushed == turned
    h = (found.wi + found.wo)[:, (found.theta_i == 0) & (slopes > 0.01)]
    round_ = sorted(set(np.round(np.degrees(np.arctan2(h[1], h[0])) % 360, 3)))
    assert round_ == pytest.approx([45 * n for n in range(8)] if turned else [0, 60, 120, 180])


# Classes -------------------------------------------------------------------------------------------------------------


def test_where_light_is_totally_reflected_a_class_holds_what_the_model_solves() -> None:
    """Below a coat the closed form of each channel is not the class; what is solved member by member is."""
    model = named("belcour2018")
    coat = Layers("dielectric", np.full((1, 1), 1.6), None, Roughness(np.array([0.15]), np.array([0.15]), 0.0), 0.0)
    above, _ = Above.nothing(model).below(coat)
    variance = float(above.f.variance(0.35))
    members = EquivalenceClass(above, np.array([[0.04], [0.05], [0.06]]), variance, 2, Choice())
    axis = np.linspace(1.0, 3.0, 24)
    one, two = (x.ravel() for x in np.meshgrid(axis, axis, indexing="ij"))
    solved = np.logical_and(*(part.feasible for part in members.member(one, two)))
    held = members.contains(one, two)
    assert solved.any() and not solved.all()
    np.testing.assert_array_equal(held, solved)
    closed = np.logical_and.reduce([members.contains(one, two, channel=c) for c in range(3)])
    assert np.any(closed != held)


def test_the_class_of_a_lobe_knows_what_may_absorb_above_it() -> None:
    """Anything, above the first interface and a pair too, except where it is fixed."""
    target = Target(
        [
            {"energy": 0.04},
            {"energy": [0.1, 0.05, 0.05], "alpha": 0.2, "interfaces": 2, "fixed": {"tau": [[0.1, 0.2, 0.3], None]}},
            {"energy": 0.05, "alpha": 0.5, "fixed": {"tau": [0.5]}},
        ],
        eta_max=3.0,
    )
    above = stacks.start(target, AVERAGED)
    first, pair, last = (stacks.class_of(above, lobe, target, first=n == 0) for n, lobe in enumerate(target.lobes))
    assert (first.interfaces, first.choice.absorbs, first.choice.tau) == (1, True, None)
    assert (pair.interfaces, pair.choice.absorbs, pair.choice.tau) == (2, True, None)
    np.testing.assert_allclose(np.ravel(pair.tau), [0.1, 0.2, 0.3])
    assert last.choice.absorbs and np.ravel(last.choice.tau) == pytest.approx([0.5])
    assert pair.variance == pytest.approx(float(above.f.variance(0.2)))
    assert {members.choice.eta_max for members in (first, pair, last)} == {3.0}
    alone = Target([{"energy": 0.1, "interfaces": 2}])
    own = stacks.class_of(above, alone.lobes[0], alone, first=True)
    assert own.choice.absorbs and own.tau is None


# Conductors and choices ----------------------------------------------------------------------------------------------


def test_a_conductor_of_given_extinction_has_the_lower_index() -> None:
    """Bati et al. 2021, Eq. 1: of the two roots the one below kappa; nothing darker than where both are equal."""
    kappa = 3.0
    least = fresnel.normal_incidence(kappa, kappa)
    r = np.array([[least * 1.001, 0.7, 0.95, 0.999]])
    found = invert_interface(r, choice=Choice("conductor", kappa=kappa), model=PLAIN)
    b = (1 + r) / (1 - r)
    assert found.feasible.all()
    np.testing.assert_allclose(found.eta, b - np.sqrt(b * b - 1 - kappa**2), rtol=1e-5)
    np.testing.assert_allclose(found.kappa, kappa)
    assert np.all(found.eta <= kappa)
    darker = invert_interface(least * 0.99, choice=Choice("conductor", kappa=kappa), model=PLAIN)
    assert not darker.feasible.any() and darker.margins["metal"] < 0
    absorbed = interface.solve(
        Above.nothing(PLAIN, 1.0),
        np.full((3, 1), least * 0.5),
        Isotropic(np.zeros(1)),
        Choice("conductor", kappa=kappa),
    ).layers
    assert absorbed.feasible.all()
    np.testing.assert_allclose(absorbed.tau, 0.5 * np.log(2), rtol=1e-5)


def test_under_a_coat_an_interface_keeps_what_it_can() -> None:
    """Its index first, then its side; a metal its tint, by the index above it; a mirror absorbs nothing above it."""
    metal = Interface(eta=0.9, k=3.0)
    material = Material.of(Stack([Interface(eta=1.8), Interface(eta=1.3), metal]))
    denser, rarer = (_choices(material, n, 1.5) for n in range(2))
    assert [np.ravel(denser[0].eta)[0], np.ravel(rarer[0].eta)[0]] == [1.8, 1.3]
    assert [choice.side for choice in denser[1:]] == [DENSER, RARER]
    assert [choice.side for choice in rarer[1:]] == [RARER, DENSER]
    assert {choice.eta_max for choice in denser} == {1.8} and {choice.eta_max for choice in rarer} == {1.5}
    (kept,) = _choices(material, 2, 1.5)
    n, k = 0.9 / 1.3, 3.0 / 1.3
    r = fresnel.normal_incidence(n, k)
    low, high = (interface.conductor_index(np.array(r), tint) for tint in (0.0, 1.0))
    assert np.ravel(kept.tint)[0] == pytest.approx((n - low) / (high - low))
    same = _choices(Material.of(Stack([Interface(eta=1.5), Interface(eta=1.5)])), 1, 4.0)
    assert [choice.side for choice in same[1:]] == [DENSER, RARER]
    (mirror,) = _choices(Material.of(Stack([Interface(conductor="mirror")])), 0, 4.0)
    assert (mirror.kind, mirror.tau) == ("mirror", 0.0)


# The depth above a metal that is dragged -----------------------------------------------------------------------------

TARGET = Target([{"energy": 0.04}, {"energy": 0.4, "alpha": 0.2, "base": "conductor"}])


def test_what_absorbs_above_a_dragged_metal_may_get_thinner_and_no_thicker() -> None:
    tau = (0.2, 0.3, 0.4)
    stack = Stack([Interface(eta=1.5), Medium(sigma_a=tau), Interface(eta=1.0, k=4.0, alpha=0.2)])
    here = DraggedStack.of(stack, TARGET, AVERAGED)
    assert here is not None
    own = here.interfaces[1]
    assert own.depth is not None and here.point.x[own.depth] == 1.0
    assert {(b.sign, b.at) for b in here.space.bounds if b.coordinate == own.depth} == {(1, 0.0), (-1, 1.0)}
    half = here.point.x.copy()
    half[own.depth] = 0.5
    np.testing.assert_allclose(here.space.layers(half[:, None])[1].tau[:, 0], 0.5 * np.array(tau))
    # Brighter, step by step, than any metal below so much absorption: the medium gives way
    wish, there = here.now(TARGET), here
    own_colour = np.array(wish.lobes[1].colour)
    for factor in np.linspace(1, 1.5, 11)[1:]:
        wish = wish.with_lobe(1, energy=tuple(factor * own_colour))
        found = nearest(there, wish)
        there = found.stack
        assert found.met
    thinner: list[float] = [
        float(np.max(np.array(layer.sigma_a, float))) for layer in there.stack.layers if isinstance(layer, Medium)
    ]
    assert len(thinner) == 1 and 0.1 < thinner[0] < 0.39
    assert there.now(wish).lobes[1].colour == pytest.approx(tuple(1.5 * own_colour), abs=1e-6)


def test_a_metal_alone_has_nothing_above_it_that_absorbs() -> None:
    target = Target([{"energy": 0.4, "alpha": 0.2, "base": "conductor"}])
    here = DraggedStack.of(Stack([Interface(eta=1.0, k=4.0, alpha=0.2)]), target, AVERAGED)
    assert here is not None and here.interfaces[0].depth is None
