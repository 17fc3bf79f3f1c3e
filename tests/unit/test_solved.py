"""Uniform materials that are solved once, in NumPy: energies, densities and weights of samples."""

import functools

import numpy as np
import pytest
from fuzzing.stacks import random_stack

from velatura import load, tables
from velatura.model import named
from velatura.model.base import Query
from velatura.model.context import Context, channels
from velatura.model.solved import bsdf, solve
from velatura.model.solved.bsdf import Solved
from velatura.model.solved.energies.energies import energies
from velatura.model.solved.lobes.widths import nearly_straight
from velatura.model.variance import variance_kind
from velatura.optics import fresnel
from velatura.stack import Interface, Material, MaterialLike, Medium, Stack

PRESETS = ("coated-rough-metal", "varnished-paint", "scattering-medium-over-gold", "three-dielectrics-over-metal",
           "frosted-glass", "opal-glass")  # fmt: skip
BRUSHED = ("coated-gold",)
COSINES = (1.0, 0.7, 0.35)
SAMPLES = 1 << 13
HEAVIEST = 3.0  # sample
POWER = Query(radiance=False)


@functools.cache
def body(stack: MaterialLike) -> tuple[Material, Solved]:
    """A material and its solution, which several tests ask."""
    material = Material.of(load(stack)).solid()
    return material, solve.solve(material, named("velatura"), variance_kind(material), Context())


def uniform(seed: int) -> list[np.ndarray]:
    return list(np.random.default_rng(seed).random((3, SAMPLES)))


def from_cosine(cosine: float, phi: float = 0.4) -> tuple[np.ndarray, ...]:
    sine = np.sqrt(1 - cosine**2)
    return tuple(np.full(SAMPLES, x) for x in (sine * np.cos(phi), sine * np.sin(phi), cosine))


@pytest.mark.parametrize("preset", PRESETS + BRUSHED)
def test_samples_carry_the_energies_of_the_stack(preset: str) -> None:
    """Within 1.5 % and 4.5 standard errors of the solved energies; one of the 21 fails by chance in 7000 runs."""
    material, found = body(preset)
    for i, cosine in enumerate(COSINES):
        wi = from_cosine(cosine)
        wo, _ = found.sample(wi, *uniform(i))
        value, density = found.eval_pdf(wi, wo, POWER)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0)
        true = energies(material, np.array([cosine]), np.array([0.4]), tables.load(), nearly_straight)
        back = (true.lobes + true.veils).sum(axis=0) + true.rest
        for share, expected in (((wo[2] > 0), back), ((wo[2] < 0), true.passed)):
            mean, error = (weight * share).mean(axis=-1), (weight * share).std(axis=-1) / np.sqrt(SAMPLES)
            assert np.all(np.abs(mean - expected[:, 0]) < 0.015 * expected[:, 0] + 4.5 * error + 1e-3), (preset, cosine)
        assert weight.max() < HEAVIEST


@pytest.mark.parametrize("stack", [*PRESETS, *BRUSHED, 3, 37, 71])
def test_weights_are_bounded_without_loss(stack: str | int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the light of samples .1 % at most is more than weights may be; three random stacks with rough dielectrics of
    which few visible facets reflect are among them."""
    _, found = body(stack if isinstance(stack, str) else random_stack(np.random.default_rng((0, stack))))
    monkeypatch.setattr(bsdf, "MAX_SAMPLE_WEIGHT", 1e9)
    for i, cosine in enumerate((0.98, 0.8, 0.55, 0.3, 0.1)):
        wi = from_cosine(cosine, 2.4 * i)
        value, density = found.eval_pdf(wi, found.sample(wi, *uniform(i))[0], POWER)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0)
        lost = np.maximum(weight - HEAVIEST, 0).mean(axis=-1) / weight.mean(axis=-1)
        assert lost.max() < 1e-3, cosine


@pytest.mark.parametrize("alpha", [0.2, (0.1, 0.2)])
def test_light_from_inside_passes_a_rarer_medium_between_the_nodes(alpha: float | tuple[float, float]) -> None:
    """About the critical angle of the medium in the middle: samples carry what the columns have, to .02 of it beside 4
    standard errors (false alarms 1 in 1000)."""
    _, found = body(
        Stack([Interface(eta=1.3, alpha=alpha), Interface(eta=1.1, alpha=0.1), Interface(eta=1.4, alpha=alpha)])
    )
    critical = np.sqrt(1 - (1.1 / 1.4) ** 2)
    for i, cosine in enumerate(critical + np.linspace(-0.04, 0.04, 9)):
        x, y, z = from_cosine(cosine, 0.3)
        wi = x, y, -z
        wo, _ = found.sample(wi, *uniform(i))
        value, density = found.eval_pdf(wi, wo, POWER)
        weight = (np.where(density > 0, value / np.where(density > 0, density, 1), 0) * (wo[2] > 0)).mean(axis=0)
        expected = np.mean(found.seen(wi)[0].passed)
        assert abs(weight.mean() / expected - 1) < 0.02 + 4 * weight.std() / np.sqrt(SAMPLES) / expected, cosine


@pytest.mark.parametrize(
    "layers",
    [
        [Interface(eta=1.38, alpha=(0.34, 0.034), rotation=125), Interface(eta=1.0, alpha=(0.34, 0.034), rotation=144)],
        [Interface(eta=1.9, alpha=(0.42, 0.042), rotation=95)],
        [Interface(eta=1.45, alpha=(0.012, 0.12), rotation=81), Interface(eta=1.0, alpha=(0.41, 0.041), rotation=58)],
    ],
)
def test_samples_of_brushed_panes_are_light(layers: list[Interface]) -> None:
    """From either side; what keeps them light takes 2 % of the light at most, beside 4 standard errors (false alarms 1
    in 2000)."""
    _, found = body(Stack(layers))
    for i, cosine in enumerate((0.98, 0.5, 0.1, -0.1, -0.5, -0.98)):
        wi = from_cosine(abs(cosine), 1.1 * i)
        wi = (wi[0], wi[1], np.sign(cosine) * wi[2])
        wo, _ = found.sample(wi, *uniform(i))
        value, density = found.eval_pdf(wi, wo, POWER)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0)[0]
        assert weight.max() < HEAVIEST
        assert abs(weight.mean() - 1) < 0.02 + 4 * weight.std() / np.sqrt(SAMPLES), cosine


def test_no_light_is_gained_between_the_nodes_about_critical_angles() -> None:
    """Nearly smooth glass under a lower index, whose colours are reflected totally from angles of their own on: within
    2 % of all light, beside 4 standard errors (false alarms 1 in 1000). Interpolated weights gain 75 %."""
    glass = Interface(eta=(1.4345, 1.5284, 1.6536), alpha=0.0023)
    _, found = body(Stack([glass, Interface(eta=1.6606)], exterior=1.7504))
    for i, cosine in enumerate((0.3164, 0.3306, 0.4389, 0.49, 0.5814, -0.09, -0.0977, -0.36, -0.5077)):
        x, y, z = from_cosine(abs(cosine))
        wi = x, y, np.sign(cosine) * z
        value, density = found.eval_pdf(wi, found.sample(wi, *uniform(i))[0], POWER)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0)
        assert np.all(weight.mean(axis=-1) < 1.02 + 4 * weight.std(axis=-1) / np.sqrt(SAMPLES)), cosine


@pytest.mark.parametrize(
    ("etas", "alpha", "off"),
    [([1.5], 0.01, 0.01), ([1.5], 0.03, 0.01), ([1.5], (0.02, 0.04), 0.01), ([1.9, 1.6], 0.02, 0.05)],
)
def test_glass_keeps_all_light_between_the_nodes_about_its_critical_angle(
    etas: list[float], alpha: float | tuple[float, float], off: float
) -> None:
    """From inside, beside 4 standard errors (false alarms 1 in 1000)."""
    _, found = body(Stack([Interface(eta=eta, alpha=alpha) for eta in etas]))
    for i, sine in enumerate(np.linspace(0.95, 1.06, 12) / etas[-1]):
        x, y, z = from_cosine(np.sqrt(1 - sine**2))
        wi = x, y, -z
        value, density = found.eval_pdf(wi, found.sample(wi, *uniform(i))[0], POWER)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0)[0]
        assert abs(weight.mean() - 1) < off + 4 * weight.std() / np.sqrt(SAMPLES), sine


@pytest.mark.parametrize("base", [Interface(eta=0.2, k=3.5, alpha=0.6), Interface(eta=1.2, alpha=0.6)])
def test_densities_integrate_to_one_at_most(base: Interface) -> None:
    """Over uniform directions, within 4.5 standard errors; samples that leave below the horizon are lost."""
    _, found = body(Stack([Interface(eta=1.5, alpha=0.4), base]))
    u, v, _ = uniform(7)
    z = 2 * u - 1
    sine = np.sqrt(1 - z * z)
    wo = sine * np.cos(2 * np.pi * v), sine * np.sin(2 * np.pi * v), z
    for cosine in (0.7, 0.35):
        _, density = found.eval_pdf(from_cosine(cosine), wo, POWER)
        total, error = 4 * np.pi * density.mean(), 4 * np.pi * density.std() / np.sqrt(SAMPLES)
        assert 0.7 - 4.5 * error < total < 1 + 4.5 * error


@pytest.mark.parametrize("form", ["forward", "symmetric"])
def test_one_channel_is_one_of_three(form: str) -> None:
    """A grey material has one value in all numbers of channels, to rounding."""
    material = Material.of(Stack([Interface(eta=1.5, alpha=0.2), Interface(eta=1.2, alpha=0.3)]))
    model, kind, wi = named("velatura", form=form), variance_kind(material), from_cosine(0.6)
    grey = material.each(lambda address, value: value[:1] if address.colour else value)
    one, three = (
        solve.solve(each, model, kind, Context(colour=colour)).eval_pdf(wi, from_cosine(0.8, 3.0))
        for each, colour in ((grey, lambda *x: np.stack(x or [0.0])), (material, channels))
    )
    assert len(one[0]) == 1 and len(three[0]) == 3
    for a, b in zip(one, three):
        np.testing.assert_allclose(np.broadcast_to(a, np.shape(b)), b, rtol=1e-9)


MILK = Stack([Interface(eta=1.5, alpha=0.1), Interface(eta=1.2, alpha=0.3), Medium(sigma_s=0.9, g=0.7),
              Interface(eta=1.9, alpha=0.3)])  # fmt: skip


@pytest.mark.parametrize("stack", ["frosted-glass", MILK], ids=["glass", "milk"])
def test_light_from_below_sees_the_material_turned_over(stack: MaterialLike) -> None:
    """Media that scatter, too, that lie elsewhere as seen from below."""
    material, found = body(stack)
    turned = solve.solve(material.reversed(), named("velatura"), variance_kind(material), Context())
    i, o = from_cosine(0.6), from_cosine(0.5, 2.0)
    below = found.eval_pdf((i[0], i[1], -i[2]), (o[0], o[1], -o[2]), POWER)
    above = turned.eval_pdf(i, o, POWER)
    assert below[0] == pytest.approx(above[0], rel=1e-9) and below[1] == pytest.approx(above[1], rel=1e-9)


def test_shares_of_samples_sum_up_to_1_between_the_nodes() -> None:
    """Near the critical angle of a gap, where they change fast."""
    gap = [Interface(eta=1.7, alpha=0), Interface(eta=1.0, alpha=0.7), Interface(eta=1.6, alpha=0.1)]
    below = body(Stack(gap))[1].below
    assert below
    cosine = np.linspace(0.02, 1, 999)
    of = below.seen((np.sqrt(1 - cosine**2), 0 * cosine, cosine))
    assert of.columns.passes
    np.testing.assert_allclose(sum(of.chances) + of.columns.passes.share, 1, atol=1e-6)


def test_light_from_inside_passes_as_fresnel_says_beside_the_critical_angle() -> None:
    """Of smooth glass, where weights are interpolated between directions that light passes from and others: within .03
    of the incident light for cosines from .03 above the critical one on."""
    _, found = body(Stack([Interface(eta=1.43), Interface(eta=1.43, alpha=0.5)]))
    for cosine in np.sqrt(1 - 1.43**-2) + np.array([0.03, 0.035, 0.05, 0.1]):
        x, y, z = from_cosine(float(cosine), 0.3)
        wo, _ = found.sample((x, y, -z), *uniform(1))
        value, density = found.eval_pdf((x, y, -z), wo, POWER)
        weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0) * (wo[2] > 0)
        assert abs(weight.mean() - (1 - fresnel.dielectric(float(cosine), 1 / 1.43))) < 0.03
