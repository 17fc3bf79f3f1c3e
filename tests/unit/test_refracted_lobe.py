"""Lobes in their own medium, against quadrature, exact limits and each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation import evaluate
from numpy.typing import NDArray
from scipy.stats import chi2

from velatura import kernel, ops
from velatura.model.papers import mixture
from velatura.model.papers.adding import Lobe
from velatura.model.solved.lobes import refracted_lobe
from velatura.model.solved.lobes.refracted_lobe import MediumIndex, RefractedLobe
from velatura.model.variance import Isotropic, Roughness
from velatura.optics import fresnel
from velatura.shader.recorder import symbol

Array = NDArray[np.floating]
Direction = tuple[Any, Any, Any]


def reflectance(eta: Any) -> Callable[[Any], Any]:
    return lambda cos2: fresnel.dielectric(ops.sqrt(cos2), eta)


def leaving(eta: float) -> Callable[[Any], Any]:
    return lambda cosine: 1 - fresnel.dielectric(cosine, eta)


# name -> of the first interface, of metals and dielectrics under coats, in a medium that light leaves easily
LOBES = {
    "first": RefractedLobe(1.0, Roughness(0.3, 0.1, 0.4), facets=reflectance(1.5)),
    "narrow": RefractedLobe(1.0, Roughness(0.05, 0.05, 0.0), 1.5, leaving=leaving(1.5)),
    "brushed": RefractedLobe(1.0, Roughness(0.4, 0.1, -0.7), 1.3, leaving=leaving(1.5)),
    "very rough": RefractedLobe(1.0, Roughness(0.6, 0.6, 0.0), 1.8, leaving=leaving(1.6)),
    "dielectric": RefractedLobe(1.0, Roughness(0.2, 0.3, 1.0), 2.0, reflectance(1 / 1.5), leaving(1.4)),
    "air gap": RefractedLobe(1.0, Roughness(0.2, 0.2, 0.0), 0.8, reflectance(1.5), leaving(1.3)),
}
COSINES = (1.0, 0.7, 0.3, 0.1)
AZIMUTH = 0.5


def incident(cosine: float, count: int = 1, azimuth: float = AZIMUTH) -> Direction:
    sine = np.sqrt(1 - cosine**2)
    return np.full(count, sine * np.cos(azimuth)), np.full(count, sine * np.sin(azimuth)), np.full(count, cosine)


def random_directions(count: int, seed: int) -> Direction:
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.01, 1, count), rng.uniform(0, 2 * np.pi, count)
    radius = np.sqrt(1 - z * z)
    return radius * np.cos(phi), radius * np.sin(phi), z


def hemisphere(rings: int, sectors: int, n: float) -> tuple[Direction, Array]:
    """Directions (rings, sectors) and the solid angle of each, times their number.

    They are even in the cosine inside a medium of index n; no ring has all of its own at one cosine.
    """
    n = min(n, 1.0)
    c, phi = np.meshgrid(np.arange(rings), (np.arange(sectors) + 0.5) * (2 * np.pi / sectors), indexing="ij")
    c = (c + (0.5 + np.arange(sectors) * 0.618034) % 1) / rings
    radius = n * np.sqrt(1 - c * c)
    z = np.sqrt(1 - radius * radius)
    return (radius * np.cos(phi), radius * np.sin(phi), z), 2 * np.pi * n * n * c / z


@pytest.mark.parametrize("name", LOBES)
def test_the_value_is_the_printed_formula(name: str) -> None:
    """Where light of both directions enters the medium: that of momenta below its index."""
    lobe = replace(LOBES[name], weight=0.7)
    wi, wo = random_directions(4000, 1), random_directions(4000, 2)
    inside = np.all([np.hypot(w[0], w[1]) < 0.98 * min(lobe.n, 1) for w in (wi, wo)], axis=0)
    wi, wo = (tuple(x[inside] for x in w) for w in (wi, wo))
    value, _ = refracted_lobe.eval_pdf(lobe, wi, wo)
    np.testing.assert_allclose(value, refracted_lobe.eval_plain(lobe, wi, wo), rtol=1e-9)


@pytest.mark.parametrize("cosine", COSINES)
@pytest.mark.parametrize("name", LOBES)
def test_samples_fall_where_the_density_says(name: str, cosine: float) -> None:
    """Chi-square over 12 x 24 cells and what is lost; together the cases raise a false alarm once in 1e4 runs."""
    n, cells = 200_000, (12, 24)
    lobe, rng = LOBES[name], np.random.default_rng(7)
    fine = 24 if lobe.n >= 1 else 64  # points across a cell; some light grazes the interface
    x, y, z = refracted_lobe.sample(lobe, incident(cosine, n), *rng.random((2, n)))
    above = z > 0
    inside = np.sqrt(np.maximum(1 - (x * x + y * y) / min(lobe.n, 1.0) ** 2, 0))
    cell = [np.minimum(u * k, k - 1).astype(int) for u, k in zip((inside, np.arctan2(y, x) / (2 * np.pi) % 1), cells)]
    counts = np.bincount((cell[0] * cells[1] + cell[1])[above], minlength=cells[0] * cells[1])

    rows, columns = cells[0] * fine * 2, cells[1] * fine
    o, solid = hemisphere(rows, columns, lobe.n)
    pdf = refracted_lobe.eval_pdf(lobe, incident(cosine), o)[1] * solid
    expected = pdf.reshape(cells[0], -1, cells[1], fine).mean(axis=(1, 3)).ravel() * (n / (cells[0] * cells[1]))
    counts, expected = np.append(counts, n - above.sum()), np.append(expected, n - expected.sum())
    clear = expected > 20
    pooled = [(numbers[clear], numbers[~clear].sum(keepdims=True)) for numbers in (counts, expected)]
    (counts, rest), (expected, expected_rest) = pooled
    statistic = np.sum((counts - expected) ** 2 / (expected + (3e-3 * expected) ** 2))  # the quadrature errs, too
    if expected_rest > 5:
        statistic += (rest[0] - expected_rest[0]) ** 2 / expected_rest[0]
    assert statistic < chi2.isf(1e-4 / (len(LOBES) * len(COSINES)), clear.sum())


@pytest.mark.parametrize("name", LOBES)
def test_the_integral_is_that_of_the_value(name: str) -> None:
    """Against a quadrature over the hemisphere; what the two differ by is the error of the lattice, .3 % on average."""
    lobe = LOBES[name]
    o, solid = hemisphere(800, 800, lobe.n)
    errors = []
    for cosine in COSINES:
        value, _ = refracted_lobe.eval_pdf(lobe, incident(cosine), o)
        errors.append(refracted_lobe.integral(lobe, incident(cosine))[0] / (value * solid).mean() - 1)
    assert np.abs(errors).max() < 0.012 and np.abs(errors).mean() < 6e-3


def test_one_call_integrates_over_many_directions_and_colours() -> None:
    """Whose roughness may differ."""
    eta, alpha = np.array([0.7, 0.9, 1.3]), np.linspace(0.1, 0.4, 4)
    wi = tuple(np.concatenate(w) for w in zip(*(incident(cosine) for cosine in COSINES)))
    lobe = replace(LOBES["brushed"], facets=reflectance(eta[:, None]), roughness=Roughness(alpha, 2 * alpha, 0.2))
    together = refracted_lobe.integral(lobe, wi)
    for k, cosine in enumerate(COSINES):
        for channel in range(3):
            roughness, facets = Roughness(alpha[k], 2 * alpha[k], 0.2), reflectance(eta[channel])
            alone = refracted_lobe.integral(replace(lobe, facets=facets, roughness=roughness), incident(cosine))
            np.testing.assert_allclose(together[channel, k], alone[0])


def test_the_first_lobe_is_the_microfacet_reflection() -> None:
    """As a mixture of one lobe evaluates it, for which the package has other tests."""
    lobe = LOBES["first"]
    wi, wo = random_directions(500, 1), random_directions(500, 2)
    value, pdf = refracted_lobe.eval_pdf(replace(lobe, facets=None), wi, wo)
    known = mixture.eval_pdf([Lobe(1.0, Isotropic(0.0), lobe.roughness)], None, wi, wo)
    np.testing.assert_allclose(value, known[0], rtol=1e-9)
    np.testing.assert_allclose(pdf, known[1], rtol=1e-9)


@pytest.mark.parametrize("name", LOBES)
def test_weights_are_bounded_and_samples_are_not_wasted(name: str) -> None:
    """Of the albedo squared, the variance of a sample is .6 at most; without the cone's share it would be 4."""
    lobe, rng, n = LOBES[name], np.random.default_rng(3), 20_000
    for cosine in COSINES:
        wi = incident(cosine, n)
        wo = refracted_lobe.sample(lobe, wi, *rng.random((2, n)))
        value, pdf = refracted_lobe.eval_pdf(lobe, wi, wo)
        weight = np.where(pdf > 0, value / np.where(pdf > 0, pdf, 1), 0)
        assert weight.max() <= 1 + 1e-9
        assert weight.var() < 0.6 * weight.mean() ** 2


@pytest.mark.parametrize("name", LOBES)
def test_the_lobe_turns_with_its_axes(name: str) -> None:
    lobe, turn = LOBES[name], 1.1

    def turned(w: Direction) -> Direction:
        return np.cos(turn) * w[0] - np.sin(turn) * w[1], np.sin(turn) * w[0] + np.cos(turn) * w[1], w[2]

    wi, wo = random_directions(500, 4), random_directions(500, 5)
    roughness = lobe.roughness._replace(rotation=lobe.roughness.rotation + turn)
    there = refracted_lobe.eval_pdf(lobe, wi, wo)
    back = refracted_lobe.eval_pdf(replace(lobe, roughness=roughness), turned(wi), turned(wo))
    np.testing.assert_allclose(there[0], back[0], rtol=1e-8)
    np.testing.assert_allclose(there[1], back[1], rtol=1e-8)


@pytest.mark.parametrize("name", ["first", "narrow", "brushed", "very rough", "dielectric"])
def test_the_lobe_is_reciprocal_but_for_what_lets_it_out(name: str) -> None:
    lobe = LOBES[name]
    wi, wo = random_directions(500, 6), random_directions(500, 7)
    out = lobe.leaving or (lambda cosine: 1.0)
    there = refracted_lobe.eval_pdf(lobe, wi, wo)[0] / (wo[2] * out(wo[2]))
    back = refracted_lobe.eval_pdf(lobe, wo, wi)[0] / (wi[2] * out(wi[2]))
    np.testing.assert_allclose(there, back, rtol=1e-9)


@pytest.mark.parametrize("name", ["narrow", "brushed", "very rough", "dielectric"])
def test_a_denser_medium_needs_no_bounds(name: str) -> None:
    """What is known to be denser than outside is as it is without that, grazing directions included."""
    lobe, known = LOBES[name], replace(LOBES[name], n=MediumIndex.of(LOBES[name].n, denser=True))
    wi, wo = random_directions(500, 20), random_directions(500, 21)
    wi[2][:5] = wo[2][5:10] = 1e-4
    u = np.random.default_rng(22).random((2, 500))
    np.testing.assert_allclose(refracted_lobe.eval_pdf(known, wi, wo), refracted_lobe.eval_pdf(lobe, wi, wo), rtol=1e-5)
    np.testing.assert_allclose(refracted_lobe.sample(known, wi, *u), refracted_lobe.sample(lobe, wi, *u), atol=1e-5)
    lost = np.array([1.3, -0.9]), np.array([0.4, 1.2]), np.zeros(2)  # as a renderer has samples that leave nowhere
    assert not np.any(refracted_lobe.eval_pdf(known, incident(0.8, 2), lost))


@pytest.mark.parametrize("cosine", [1.0, 0.6, 0.3])
def test_a_smooth_lobe_is_the_reflection_of_a_smooth_layer(cosine: float) -> None:
    """Its albedo is the product of the Fresnel factors, and its light goes in the mirror direction."""
    n, eta = 1.7, 0.8
    lobe = RefractedLobe(1.0, Roughness(0.0, 0.0, 0.0), n, reflectance(eta), leaving(1.4))
    inside = np.sqrt(1 - (1 - cosine**2) / n**2)
    smooth = fresnel.dielectric(inside, eta) * (1 - fresnel.dielectric(cosine, 1.4))
    wi = incident(cosine)
    assert refracted_lobe.integral(lobe, wi)[0] == pytest.approx(smooth, rel=4e-3)  # alpha is 1e-3 at least
    x, y, _ = refracted_lobe.sample(lobe, incident(cosine, 200), *np.random.default_rng(9).random((2, 200)))
    assert np.median(np.hypot(x + wi[0], y + wi[1])) < 5e-3


def test_between_equal_indices_nothing_jumps() -> None:
    """A lobe under an interface that hardly bends light is one outside."""
    wi, wo = random_directions(500, 10), random_directions(500, 11)
    lobe = replace(LOBES["brushed"], leaving=None)
    outside, near = (refracted_lobe.eval_pdf(replace(lobe, n=n), wi, wo) for n in (1.0, 1 + 1e-7))
    np.testing.assert_allclose(outside[0], near[0], rtol=1e-3)
    np.testing.assert_allclose(outside[1], near[1], rtol=1e-3, atol=5e-3)


def test_all_dialects_agree() -> None:
    """Dr.Jit in single precision and what is recorded, against NumPy; colours among the values."""
    kernel.require_llvm()
    import drjit.llvm as llvm

    eta = np.array([0.7, 0.9, 1.3])
    wi, wo = random_directions(200, 12), random_directions(200, 13)
    u = np.random.default_rng(14).random((2, 200))

    def outputs(number: Callable[[Any], Any], colour: Any, *values: Any) -> list[Any]:
        lobe = RefractedLobe(
            0.5, Roughness(number(0.2), number(0.4), number(0.3)), number(1.6), reflectance(colour), leaving(1.5)
        )
        w, o = values[:3], values[3:6]
        return [*refracted_lobe.eval_pdf(lobe, w, o), *refracted_lobe.sample(lobe, w, *values[6:])]

    values = [*wi, *wo, *u]
    known = outputs(np.float64, eta[:, None], *values)
    jit = outputs(llvm.Float, llvm.Array3f(*eta.tolist()), *(llvm.Float(x) for x in values))
    names = [f"v{i}" for i in range(len(values))]
    recorded = outputs(float, eta, *(symbol.number(name) for name in names))
    for result in (jit, evaluate(recorded, dict(zip(names, values)))):
        for a, b in zip(known, result):
            np.testing.assert_allclose(np.array(b), a, rtol=2e-4, atol=2e-6)


def test_values_and_gradients_are_finite() -> None:
    """In single precision: at normal and grazing directions, for alpha 0 to 1, where indices are equal."""
    kernel.require_llvm()
    import drjit as dr
    import drjit.llvm.ad as ad

    cosines, alphas = (1.0, 0.5, 1e-4), (0.0, 1e-3, 0.3, 1.0)
    grid = np.meshgrid(cosines, (*cosines, -0.1), (0.0, 2.0, np.pi), alphas, alphas, (0.7, 1.0, 1.000001, 1.5, 3.0))
    cos_i, cos_o, phi, *values = (x.ravel() for x in grid)
    i, o = ((np.sqrt(1 - c * c) * np.cos(p), np.sqrt(1 - c * c) * np.sin(p), c) for c, p in ((cos_i, 0), (cos_o, phi)))
    wi, wo = (tuple(ad.Float(x) for x in w) for w in (i, o))
    parameters = [ad.Float(x) for x in (*values, 0.3 + 0 * phi, 1.5 / values[-1])]
    for x in parameters:
        dr.enable_grad(x)
    u, v, index, rotation, eta = parameters
    lobe = RefractedLobe(1.0, Roughness(u, v, rotation), index, reflectance(eta), leaving(1.5))
    value, pdf = refracted_lobe.eval_pdf(lobe, wi, wo)
    x, y, z = refracted_lobe.sample(lobe, wi, ad.Float(np.abs(o[0])), ad.Float(phi / 4))
    dr.backward(dr.sum(value + pdf + x + y + z))
    assert all(np.isfinite(np.array(each)).all() for each in (value, pdf, x, y, z))
    assert all(np.isfinite(np.array(dr.grad(each))).all() for each in parameters)
