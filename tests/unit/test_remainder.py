"""The remainder: its fit against light that is known, its energy, and what a BSDF must keep."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from evaluation import evaluate
from numpy.typing import NDArray

import velatura as vt
from velatura import Interface, Medium, Stack, kernel, tables
from velatura.model.solved.energies.energies import INCIDENCES, energies
from velatura.model.solved.energies.nodes import Nodes
from velatura.model.solved.lobes import remainder
from velatura.model.solved.lobes.remainder import Remainder
from velatura.model.solved.transmission import internal_reflections
from velatura.optics import fresnel
from velatura.shader import record
from velatura.shader.lookups.columns import SolvedLookUp
from velatura.shader.recorder import symbol
from velatura.stack import Material

Array = NDArray[np.floating]
Direction = tuple[Any, Any, Any]

NODES = Nodes.of([1.0, 1.5], 24)
BEYOND = Nodes.of([1.0, 1.5, 1.8], 24)
COSINES = np.sqrt((np.arange(8) + 0.5) / 8)
SOME = Remainder(0.1, 0.2, -0.05, 0.3, -0.1, 0.05, 0.03, 0.02)  # nowhere clipped
BRIGHT_HORIZON = Remainder(0.1, -0.05, 0.1, 0.05, -0.1, 0.3, 0.05, 0.0)


def random_directions(count: int, seed: int) -> Direction:
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.01, 1, count), rng.uniform(0, 2 * np.pi, count)
    radius = np.sqrt(1 - z * z)
    return radius * np.cos(phi), radius * np.sin(phi), z


def incident(cosine: float, count: int) -> Direction:
    return np.full(count, np.sqrt(1 - cosine**2)), np.zeros(count), np.full(count, cosine)


def sample_disc(rng: np.random.Generator, count: int) -> Direction:
    p, phi = np.sqrt(rng.uniform(size=count)), 2 * np.pi * rng.uniform(size=count)
    return p * np.cos(phi), p * np.sin(phi), np.sqrt(1 - p * p)


def measures(
    f: Callable[[Direction, Direction], Array], count: int = 2000, nodes: Nodes = NODES, n: float = 1.0
) -> Array:
    """Light of a BSDF from the directions, at the nodes by mode, (1, 3, N, M): a sum over momenta up to n."""
    p, phi = np.meshgrid(
        np.sqrt((np.arange(count) + 0.5) / count), (np.arange(16) + 0.5) * (2 * np.pi / 16), indexing="ij"
    )
    wo = p * np.cos(phi), p * np.sin(phi), np.sqrt(1 - p * p)
    index, shares, beyond = nodes.shares(n * p)
    found = np.zeros((1, 3, nodes.count, len(COSINES)))
    for i, cosine in enumerate(COSINES):
        light = f(incident(cosine, 1), wo) * (np.pi / p.size)
        for m in range(3):
            odd = np.where(beyond, -1.0, 1.0) if m == 1 else 1.0
            # The mirror direction of wi lies at the azimuth pi
            spread = shares * odd * (light * np.cos(m * (phi - np.pi)))
            found[0, m, :, i] = np.bincount(index.ravel(), spread.ravel(), nodes.count)
    return found


def test_what_is_a_polynomial_is_found_again() -> None:
    """A diffuse reflection among them, whose only number is its albedo."""
    known = [(0.6, *[0.0] * 7), tuple(vars(SOME).values())]
    for numbers in known:

        def polynomial(wi: Direction, wo: Direction, numbers: Any = numbers) -> Any:
            return Remainder(*numbers).value(wi, wo) / wo[2]

        light = measures(polynomial)
        found, _ = remainder.fit(NODES, light, COSINES, np.ones((1, 8)))
        np.testing.assert_allclose(np.concatenate(list(vars(found).values())), numbers, atol=2e-3)


def test_polynomials_that_few_span_are_sums_of_these() -> None:
    """Exactly, in their order, and approximately to the error that is allowed, in the root mean square."""
    rng = np.random.default_rng(3)
    few, shares = rng.normal(size=(3, 24)), rng.normal(size=(50, 3))
    numbers = shares @ few + 1e-5 * rng.normal(size=(50, 24))
    found = remainder.of_few(numbers, 8)
    assert found and found[1].shape == (3, 24)
    wi, wo = incident(0.6, 500), sample_disc(rng, 500)
    errors = []
    for made, given in zip(found[0] @ found[1], numbers):
        for channel in range(3):
            values = (Remainder(*x.reshape(8, 3)[:, channel]).unclipped(wi, wo)[1] for x in (made, given))
            errors.append(np.subtract(*values))
    assert np.sqrt(np.mean(np.square(errors))) < remainder.ALIKE
    assert remainder.of_few(rng.normal(size=(50, 24)), 8) is None


def test_a_diffuse_base_under_a_smooth_coat_is_close_to_a_polynomial() -> None:
    """To a hundredth; Fresnel's transmittance is no polynomial."""

    def coated(wi: Direction, wo: Direction) -> Any:
        return (1 - fresnel.dielectric(wi[2], 1.5)) * (1 - fresnel.dielectric(wo[2], 1.5)) / np.pi

    light = measures(coated)
    found, _ = remainder.fit(NODES, light, COSINES, light[:, 0].sum(axis=1))
    z = np.sqrt((np.arange(1000) + 0.5) / 1000)
    mean = np.mean(1 - fresnel.dielectric(z, 1.5))
    for cosine in (1.0, 0.7, 0.35):
        energy = (1 - fresnel.dielectric(cosine, 1.5)) * mean
        assert found.albedo(cosine)[0] == pytest.approx(energy, rel=0.01)
    wi, wo = incident(0.7, 1000), (z * 0, np.sqrt(1 - z * z), z)
    apart = found.value(wi, wo) / z - coated(wi, wo)
    assert np.mean(np.abs(apart)) < 0.02 * np.mean(coated(wi, wo))


def test_it_takes_what_media_and_facets_scatter() -> None:
    """At cosines that it was not fitted to, to .005 of all light; forwards goes towards the mirror direction."""
    cosines = np.array([1.0, 0.8, 0.5, 0.25])
    paint = [Interface(eta=1.5, alpha=0.2), Medium(sigma_s=2.0, sigma_a=0.1, g=0.8), Interface(conductor="mirror")]
    rough = [Interface(eta=1.5, alpha=0.5), Interface(conductor="mirror", alpha=0.4)]
    for layers, often in ((paint, None), (rough, tables.load())):
        solved = energies(Material.of(Stack(layers)), cosines, 0 * cosines, often, lambda g: 0.0)
        found, _ = remainder.fit(solved.nodes, solved.remainder, INCIDENCES, np.ones((1, len(INCIDENCES))))
        np.testing.assert_allclose(found.albedo(cosines), solved.rest[0], atol=5e-3)
        assert found.b > 0


def test_what_passes_is_found_again_by_direction() -> None:
    """Within a cone of 1.5, the index below; without light it is even."""
    known = (0.7, 0.3, 1.5, 0.6, 0.2)
    sines = np.sqrt(1 - COSINES**2) / 1.5

    def beyond(wi: Direction, wo: Direction) -> Any:
        return internal_reflections.diffuse(known, (wi[0] / 1.5, wi[1], wi[2]), wo) / np.pi

    light = measures(beyond, nodes=BEYOND, n=1.5)[0]
    found = remainder.passing(BEYOND, light, 1.5, sines)
    np.testing.assert_allclose(found, np.transpose([known] * len(COSINES)), atol=0.01)
    np.testing.assert_array_equal(remainder.passing(BEYOND, 0 * light, 1.5, sines)[:, 0], remainder.EVEN)


@pytest.mark.parametrize(("alpha", "cosine"), [(0.3, 0.5), (0.5, 0.8), (0.5, 0.3)])
def test_light_of_repeated_facets_goes_on_as_it_came(alpha: float, cosine: float) -> None:
    """Mean direction of what passes rough glass, less what passes where facets are met once, against walks: within a
    fifth and .05, which is about two standard errors of the walks."""
    glass = Stack([Interface(eta=1.5, alpha=alpha)])
    once, often = (
        vt.reference.distribution(glass, [cosine], paths=300_000, seed=3, microsurface=x) for x in (False, True)
    )
    assert once.transmitted is not None and often.transmitted is not None
    more = (often.transmitted - once.transmitted)[0, 0].sum(axis=1)
    walked = -np.sum(more * (np.arange(40) + 0.5 - 20) / 20) / more.sum()
    incidence = np.array([cosine])
    solved = energies(Material.of(glass), incidence, 0 * incidence, tables.load(), lambda g: 0.0, incidences=incidence)
    even, forwards = solved.around[0, :2, :, 0]
    found = np.sum(forwards * solved.nodes.p) / 1.5 / even.sum()
    assert found > 0 and abs(found - walked) < 0.2 * walked + 0.05


@pytest.mark.parametrize("cosine", [1.0, 0.7, 0.2])
@pytest.mark.parametrize("polynomial", [SOME, BRIGHT_HORIZON])
def test_samples_give_the_albedo(polynomial: Remainder, cosine: float) -> None:
    """Within 4 standard errors; nothing of either is clipped. Cosines have the density that is reported, on either
    side of the normal."""
    n = 100_000
    wi = incident(cosine, n)
    wo = polynomial.sample(wi, *np.random.default_rng(2).random((3, n)))
    weights = polynomial.value(wi, wo) / polynomial.density(wi, wo)
    assert abs(weights.mean() - polynomial.albedo(cosine)) < 4 * weights.std() / np.sqrt(n) + 1e-9
    assert weights.max() < 2.5 * polynomial.albedo(cosine)
    z = (np.arange(4000) + 0.5) / 4000
    for side in (1, -1):
        quarter = [side * np.sqrt(1 - z * z) * f(np.pi * (z * 987 % 1 - 0.5)) for f in (np.cos, np.sin)]
        density = polynomial.density(incident(cosine, 4000), (quarter[0], quarter[1], z))
        expected = np.pi * density.reshape(8, -1).mean(axis=1) / 8
        counts, _ = np.histogram(wo[2][side * wo[0] > 0], 8, (0, 1))
        np.testing.assert_allclose(counts / n, expected, atol=5 * 0.5 / np.sqrt(n))


def test_it_is_reciprocal_positive_and_turns() -> None:
    wi, wo = random_directions(500, 3), random_directions(500, 4)
    dark = Remainder(0.1, -0.3, 0.0, 0.1, 0.0, 0.0, 0.4, -0.2)
    there, back = dark.value(wi, wo) / wo[2], dark.value(wo, wi) / wi[2]
    np.testing.assert_allclose(there, back, atol=1e-15)
    assert there.min() == 0 and there.max() > 0
    turned = [(0.6 * w[0] - 0.8 * w[1], 0.8 * w[0] + 0.6 * w[1], w[2]) for w in (wi, wo)]
    np.testing.assert_allclose(dark.value(*turned), dark.value(wi, wo), atol=1e-12)
    assert not dark.value(wi, (wo[0], wo[1], -wo[2])).any()


def test_all_dialects_agree() -> None:
    kernel.require_llvm()
    import drjit.llvm as llvm

    numbers = [np.array([x, 0.5 * x, -0.1 * x]) for x in vars(SOME).values()]
    values = [*random_directions(200, 5), *random_directions(200, 6)]

    def value(colours: Any, values: Any) -> Any:
        return Remainder(*colours).value(values[:3], values[3:])

    known = value([x[:, None] for x in numbers], values)
    names = [f"v{i}" for i in range(6)]
    recorded = value(numbers, [symbol.number(name) for name in names])
    jit = value([llvm.Array3f(*x.tolist()) for x in numbers], [llvm.Float(x) for x in values])
    np.testing.assert_allclose(evaluate([recorded], dict(zip(names, values)))[0], known, rtol=1e-9)
    np.testing.assert_allclose(np.array(jit), known, rtol=1e-4, atol=1e-6)


def test_columns_of_rounding_are_not_scaled_up() -> None:
    """Smooth facets are hardly met again: what brushed metals return so at the normal is rounding, as is its part along
    each axis. Expected: no number of the remainder exceeds that light."""
    for alpha in np.linspace(0.02, 0.05, 7).tolist():
        metal = Stack([Interface(eta=(0.15, 2.14, 2.47), k=(3.8, 0.55, 1.35), alpha=(alpha, 0.3 * alpha))])
        baked = record(metal).baked
        assert isinstance(baked, SolvedLookUp) and baked.solved
        assert np.abs(baked.solved.remainder).max() < 1e-4


def test_functions_beside_it_are_fitted_with_it_and_none_is_negative() -> None:
    """Expected: the shares of what light is made of; of what would have a negative one, nothing."""
    light = measures(lambda wi, wo: SOME.value(wi, wo) / wo[2])
    one, other = (np.random.default_rng(5).uniform(0, 0.02, (2, *light.shape))) * (1 + light)
    albedos = np.ones((1, len(COSINES)))
    alone, none = remainder.fit(NODES, light, COSINES, albedos)
    found, shares = remainder.fit(NODES, light + 0.7 * one, COSINES, albedos, [one, other])
    assert none.shape == (0, 1)
    assert shares[:, 0] == pytest.approx([0.7, 0.0], abs=0.02)
    np.testing.assert_allclose(list(vars(found).values()), list(vars(alone).values()), atol=0.02)
    _, shares = remainder.fit(NODES, light - 0.5 * one, COSINES, albedos, [one, other])
    assert shares[0, 0] == 0 <= shares[1, 0]
