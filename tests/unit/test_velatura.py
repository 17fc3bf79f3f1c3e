"""The model `velatura`: its limits, which hold by construction, and walks that it was not fitted to."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import velatura as vt
from velatura.comparison.evaluated_lobes import account
from velatura.model import named
from velatura.stack import Interface, Material, Medium, Stack

COSINES = np.array([1.0, 0.75, 0.5, 0.3, 0.1])
REFLECTANCES = ("fgd", "fgd-multi")
GOLD: dict[str, Any] = {"eta": (0.18, 0.42, 1.37), "k": (3.42, 2.35, 1.77)}

# Indices and roughnesses over a mirror of roughness base: what the base looks like at normal incidence, by random walks
WALKED = [
    ([(1.5, 0.0)], 0.1, 0.155),
    ([(2.0, 0.0)], 0.1, 0.217),
    ([(1.5, 0.1)], 0.0, 0.043),
    ([(1.5, 0.1), (2.0, 0.0)], 0.0, 0.043),
    ([(1.5, 0.2), (2.25, 0.0)], 0.0, 0.082),
    ([(2.0, 0.2), (1.2, 0.0)], 0.0, 0.171),
]


def lobes(stack: Stack, cosines: Any = COSINES, reflectance: str = "fgd-multi", phi: float = 0.0) -> Any:
    return vt.lobes(stack, cosines, phi, model="velatura", reflectance=reflectance)


def over_mirror(coats: list[tuple[float, float]], base: float) -> Stack:
    return Stack([*(Interface(eta=n, alpha=a) for n, a in coats), Interface(conductor="mirror", alpha=base)])


@pytest.mark.parametrize(("coats", "base", "true"), WALKED)
def test_a_base_looks_as_rough_as_in_walks(coats: list[tuple[float, float]], base: float, true: float) -> None:
    """Within 8 %; the published recursions miss these by up to 90 %."""
    alpha = lobes(over_mirror(coats, base), [1.0], "fgd").alpha[-1]
    assert abs(np.log(alpha / true)).max() < 0.08


@pytest.mark.parametrize(
    ("layers", "cosine", "true"),
    [
        (
            [Interface(eta=1.6, alpha=0.05), Medium(sigma_a=(0.1, 0.3, 0.8)), Interface(conductor="mirror", alpha=0.5)],
            1.0,
            (0.492, 0.248, 0.0743),
        ),
        ([Interface(eta=2.0, alpha=0.3), Interface(eta=1.2, alpha=0.3)], 0.5, (0.183, 0.183, 0.183)),
    ],
    ids=["over a rough base", "above a lower index"],
)
def test_trapped_light_is_absorbed_and_reflected_as_in_walks(
    layers: list[Any], cosine: float, true: tuple[float, float, float]
) -> None:
    """All that the layers below the first interface reflect, within 3 % of 10^5 walks, which are exact to 1 %."""
    found = lobes(Stack(layers), [cosine])
    np.testing.assert_allclose((found.energy[-1] + found.remainder)[:, 0], true, rtol=0.03)


@pytest.mark.parametrize("reflectance", REFLECTANCES)
def test_smooth_steps_of_the_index_below_a_rough_coat_change_no_blur(reflectance: str) -> None:
    """Where they reflect little: within 3 % at cosines of .75 and 1, of which 1 % is what they reflect back."""
    one = lobes(over_mirror([(1.5, 0.1)], 0.0), COSINES[:2], reflectance)
    many = lobes(over_mirror([(1.5, 0.1), (1.6, 0.0), (1.7, 0.0), (1.8, 0.0)], 0.0), COSINES[:2], reflectance)
    np.testing.assert_allclose(many.alpha[-1], one.alpha[-1], rtol=0.03)


@pytest.mark.parametrize("reflectance", REFLECTANCES)
def test_smooth_stacks_reflect_by_fresnel_and_absorption(reflectance: str) -> None:
    """The slab over gold, summed by hand: R = F + T e^-2tau/c G / (1 - F e^-2tau/c G)."""
    tau = np.array([0.1, 0.3, 0.6])[:, None]
    slab = Stack([Interface(eta=1.5), Medium(depth=1.0, sigma_a=(0.1, 0.3, 0.6)), Interface(**GOLD)])
    from velatura.optics import fresnel

    cosine = COSINES[:4]
    below = np.sqrt(1 - (1 - cosine**2) / 1.5**2)
    f = fresnel.dielectric(cosine, 1.5)
    g = fresnel.conductor(below, *(np.array(GOLD[part])[:, None] / 1.5 for part in ("eta", "k")))
    g = g * np.exp(-2 * tau / below)
    truth = f + (1 - f) ** 2 * g / (1 - f * g)
    found = lobes(slab, cosine, reflectance)
    np.testing.assert_allclose(sum(found.energy), truth, rtol=2e-3)
    assert max(alpha.max() for alpha in found.alpha) == 0


def test_one_interface_is_the_reflection_by_facets_that_it_is() -> None:
    """What is evaluated is F D G / 4 cos, with Fresnel at the half-vector, within 3 %: its weights are interpolated."""
    from velatura.model import variance_kind
    from velatura.model.context import Context
    from velatura.optics import fresnel, ggx

    stack = Stack([Interface(alpha=(0.1, 0.3), rotation=20, **GOLD)])
    material, model = Material.of(stack), named("velatura", reflectance="fgd")
    body = model.body(material, variance_kind(material), Context())
    rng = np.random.default_rng(0)
    wi, wo = (w / np.linalg.norm(w, axis=0) for w in abs(rng.normal(size=(2, 3, 200))))
    value, _ = body.eval_pdf(tuple(wi), tuple(wo))
    h = ggx.normalize(tuple(wi + wo))
    i, o, m = (ggx.rotate(tuple(w), np.radians(20)) for w in (wi, wo, h))
    f = fresnel.conductor(ggx.dot(tuple(wi), h), *(np.array(GOLD[part])[:, None] for part in ("eta", "k")))
    truth = f * ggx.ndf(m, 0.1, 0.3) * ggx.masking(i, 0.1, 0.3) * ggx.masking(o, 0.1, 0.3) / (4 * wi[2])
    np.testing.assert_allclose(value, truth, rtol=0.03)
    assert np.median(np.abs(value / truth - 1)) < 0.01


@settings(max_examples=20)
@given(st.floats(0, 180), st.floats(0, 360), st.sampled_from(REFLECTANCES))
def test_turning_all_interfaces_and_the_light_turns_the_lobes(by: float, azimuth: float, reflectance: str) -> None:
    def turned(angle: float) -> Any:
        coat = Interface(eta=1.5, alpha=(0.05, 0.2), rotation=20 + angle)
        base = Interface(alpha=(0.3, 0.1), rotation=70 + angle, **GOLD)
        return lobes(Stack([coat, base]), [0.9, 0.4], reflectance, np.radians(azimuth + angle))

    before, after = turned(0.0), turned(by)
    for k in range(2):
        np.testing.assert_allclose(after.energy[k], before.energy[k], rtol=1e-6)
        np.testing.assert_allclose(after.alpha[k], before.alpha[k], rtol=1e-5)
        twice = 2 * (after.rotation[k] - before.rotation[k] - np.radians(by))
        np.testing.assert_allclose(np.cos(twice), 1, atol=1e-6)


def test_an_isotropic_stack_looks_isotropic_from_above() -> None:
    stack = Stack([Interface(eta=1.8, alpha=0.1), Interface(eta=1.0, alpha=0.1)])
    for alpha in lobes(stack, [1.0]).alpha:
        assert alpha[0] == pytest.approx(alpha[1], rel=1e-9)


@pytest.mark.parametrize("alpha", [0.0, 0.1])
def test_nothing_jumps_at_the_critical_angle(alpha: float) -> None:
    """Light that comes from a denser medium, in steps of 1e-4 of the cosine: no lobe changes by more than 5 %."""
    stack = Stack([Interface(eta=1.2, alpha=alpha), Interface(alpha=0.1, **GOLD)], exterior=1.5)
    critical = np.sqrt(1 - (1.2 / 1.5) ** 2)
    energy = lobes(stack, critical + np.arange(-50, 51) * 1e-4).energy
    steps = [max(abs(b - a).max() for a, b in pairwise(lobe.T)) for lobe in energy]
    assert max(steps) < (0.12 if alpha == 0 else 0.05)  # Fresnel itself has a vertical tangent there


@pytest.mark.parametrize("name", ["furnace", "furnace-rough", "crossed-brushing"])
def test_a_lossless_stack_keeps_all_light(name: str) -> None:
    found = lobes(vt.preset(name))
    np.testing.assert_allclose(sum(found.energy) + found.remainder, 1, atol=2e-5)


@pytest.mark.parametrize("name", ["furnace", "furnace-rough"])
def test_what_is_drawn_has_the_energy_of_the_lobes(name: str) -> None:
    found = account(vt.preset(name), [0.7, 0.1], named("velatura"))
    np.testing.assert_allclose(found.evaluated, 1, atol=5e-3)


def test_gradients_and_values_are_finite_everywhere() -> None:
    stack = Stack(
        [
            Interface(eta=1.5, alpha=0.0),
            Medium(depth=0.0, sigma_a=0.0),
            Interface(eta=1.5, alpha=(0.0, 1.0)),
            Medium(depth=1.0, sigma_s=2.0, g=-0.5),
            Interface(eta=1.2, alpha=1.0),
            Interface(conductor="mirror", alpha=0.0),
        ]
    )
    found = lobes(stack, [1.0, 0.5, 1e-4])
    for lobe in (*found.energy, *found.alpha, *found.covariance):
        assert np.all(np.isfinite(lobe))
