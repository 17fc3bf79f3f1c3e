"""Exact limits of energies on random stacks: what the laws of optics say of any of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import tmm
from fuzzing.stacks import in_range

from velatura import tables
from velatura.model.solved.energies.energies import Energies, energies
from velatura.model.solved.lobes.widths import nearly_straight
from velatura.optics import fresnel
from velatura.stack import Interface, Material, Medium, Stack

COSINES = np.array([1.0, 0.7, 0.35, 0.1])
AZIMUTH = 0.4
SEEDS = range(8)


def solved(material: Material, often: bool = True, phi: float = AZIMUTH) -> Energies:
    known = tables.load() if often else None
    return energies(material, COSINES, phi + 0 * COSINES, known, nearly_straight)


def reflected(found: Energies) -> Any:
    return (found.lobes + found.veils).sum(axis=0) + found.rest


def both(stack: Stack) -> list[Material]:
    """As it is seen from above and, where it transmits, from below."""
    material = Material.of(stack)
    return [material, material.reversed()] if material.transmits else [material]


def alike(a: Energies, b: Energies, bound: float) -> None:
    assert reflected(a) == pytest.approx(reflected(b), abs=bound)
    assert a.passed == pytest.approx(b.passed, abs=bound)


@pytest.mark.parametrize("seed", SEEDS)
def test_smooth_stacks_are_an_incoherent_sum(seed: int) -> None:
    """From both sides: at the normal that of `tmm`; at any cosine that of unpolarised reflectances."""
    rng = np.random.default_rng((1, seed))
    count = 1 + seed % 4
    indices = [1.0, *rng.uniform(1.05, 2.5, count)]
    taus = [0.0, *rng.uniform(0, 1, count - 1), 0.0]
    layers: list[Any] = [Interface(eta=indices[1], alpha=0)]
    for n, tau in zip(indices[2:], taus[1:]):
        layers += [Medium(sigma_a=tau), Interface(eta=n, alpha=0)]
    for material, n, tau in zip(both(Stack(layers)), (indices, indices[::-1]), (taus, taus[::-1])):
        for often in (False, True):
            found = solved(material, often)
            absorbing = [x + 1j * t * 500 / (4 * np.pi * 1e6) for x, t in zip(n, tau)]
            expected = tmm.inc_tmm("s", absorbing, [np.inf, *[1e6] * (count - 1), np.inf], ["i"] * (count + 1), 0, 500)
            assert reflected(found)[:, 0] == pytest.approx(np.full(len(reflected(found)), expected["R"]), abs=1e-6)
            assert found.passed[:, 0] == pytest.approx(np.full(len(found.passed), expected["T"]), abs=1e-6)
            for k, cosine in enumerate(COSINES):
                r, t = added(n, tau, float(cosine))
                assert reflected(found)[0, k] == pytest.approx(r, abs=1e-6)
                assert found.passed[0, k] == pytest.approx(t, abs=1e-6)


def added(n: list[float], taus: list[float], cosine: float) -> tuple[float, float]:
    """Unpolarised reflectance and transmittance of smooth interfaces between media, from the bottom."""
    p2 = n[0] ** 2 * (1 - cosine**2)
    cosines = [np.sqrt(max(1 - p2 / x**2, 0)) for x in n]
    r, t = 0.0, 1.0
    for k in reversed(range(len(n) - 1)):
        own = float(fresnel.dielectric(cosines[k], n[k + 1] / n[k])) if cosines[k] > 0 else 1.0
        through = np.exp(-taus[k + 1] / max(cosines[k + 1], 1e-9))
        r, t = through**2 * r, through * t
        r, t = own + (1 - own) ** 2 * r / (1 - own * r), (1 - own) * t / (1 - own * r)
    return r, t


@pytest.mark.parametrize("seed", SEEDS)
def test_lossless_stacks_keep_all_light(seed: int) -> None:
    """From both sides, brushed, turned and scattering."""
    stack = in_range(np.random.default_rng((2, seed)), lossless=True)
    for material in both(stack):
        found = solved(material)
        assert reflected(found) + found.passed == pytest.approx(np.ones_like(found.passed), abs=1e-3)


@pytest.mark.parametrize("seed", SEEDS)
def test_layers_that_do_nothing_change_nothing(seed: int) -> None:
    """No step of the index, a medium of no depth, or one that is cut in two, anywhere in a stack."""
    rng = np.random.default_rng((3, seed))
    stack = in_range(rng)
    plain = solved(Material.of(stack))
    layers = list(stack.layers)
    k = int(rng.integers(len(layers)))
    above = [layer.eta for layer in layers[:k] if isinstance(layer, Interface)]
    n = above[-1] if above else stack.exterior
    nothing = Interface(eta=n, alpha=rng.uniform(0, 0.8))
    under = Medium(depth=0.0, sigma_s=1.0, sigma_a=0.5, g=0.5)
    alike(solved(Material.of(with_layers(stack, [*layers[:k], nothing, *layers[k:]]))), plain, 1e-3)
    if not any(isinstance(layer, Medium) for layer in layers[max(k - 1, 0) : k + 1]):
        alike(solved(Material.of(with_layers(stack, [*layers[:k], under, *layers[k:]]))), plain, 1e-3)
    for j, layer in enumerate(layers):
        if isinstance(layer, Medium):
            index = [each.eta for each in layers[:j] if isinstance(each, Interface)]
            half = Medium(depth=layer.depth / 2, sigma_a=layer.sigma_a, sigma_s=layer.sigma_s, g=layer.g)
            cut = Interface(eta=index[-1] if index else stack.exterior, alpha=0.3)
            alike(
                solved(Material.of(with_layers(stack, [*layers[:j], half, cut, half, *layers[j + 1 :]]))), plain, 1e-3
            )


def with_layers(stack: Stack, layers: list[Any]) -> Stack:
    return Stack(layers, exterior=stack.exterior, thin=stack.thin)


@pytest.mark.parametrize("seed", SEEDS)
def test_turning_all_layers_turns_all_energies(seed: int) -> None:
    """Facets are met once, or often, in turn."""
    stack = in_range(np.random.default_rng((4, seed)), brushed=True)
    turned = stack.turned(37.0)
    assert turned is not None
    before, after = (
        solved(Material.of(each), seed % 2 == 1, AZIMUTH + np.radians(turn))
        for each, turn in ((stack, 0), (turned, 37))
    )
    alike(before, after, 3e-3)
