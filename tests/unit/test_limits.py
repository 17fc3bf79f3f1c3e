"""Exact limits of solved materials: layers that do nothing, smooth stacks, and directions at the ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from velatura import tables
from velatura.model import named, solution
from velatura.model.bsdf import Asked
from velatura.model.context import Context
from velatura.model.prepare import variance_kind
from velatura.model.transport.energies import Energies, energies
from velatura.model.widths import nearly_straight
from velatura.sampling import low_discrepancy
from velatura.stack import Interface, Material, Medium, Stack

COSINES = np.array([1.0, 0.7, 0.35, 0.1])
GOLD = Interface(eta=(0.18, 0.42, 1.37), k=(3.42, 2.35, 1.77), alpha=0.2)
COAT, PAINT = Interface(eta=1.5, alpha=0.15), Medium(depth=1, sigma_s=1.5, sigma_a=0.1, g=0.6)


def solved(layers: list[Any], often: bool) -> Energies:
    known = tables.load() if often else None
    return energies(Material.of(Stack(layers)), COSINES, 0 * COSINES, known, nearly_straight)


# Interfaces without a step


STEPPED: dict[str, tuple[list[Any], float]] = {
    "gold": ([GOLD], 1.0),
    "coated gold": ([COAT, GOLD], 1.0),
    "paint": ([COAT, PAINT, GOLD], 1.0),
    "glass": ([COAT], 1.0),
    "pane": ([COAT, Interface(eta=1.0, alpha=0.3)], 1.0),
}


@pytest.mark.parametrize("often", [False, True], ids=["once", "often"])
@pytest.mark.parametrize("name", STEPPED)
def test_a_rough_interface_of_almost_no_step_changes_no_energy(name: str, often: bool) -> None:
    """Of any lobe, nor of what passes."""
    layers, n = STEPPED[name]
    plain = solved(layers, often)
    for step, bound in ((0.0, 1e-3), (1e-6, 2e-3), (1e-4, 8e-3)):
        stepped = solved([Interface(eta=n + step, alpha=0.4), *layers], often)
        assert stepped.lobes[1:] == pytest.approx(plain.lobes, abs=bound)
        assert stepped.veils[1:] == pytest.approx(plain.veils, abs=bound)
        for x in ("rest", "straight", "bounced", "passed"):
            assert np.abs(getattr(stepped, x) - getattr(plain, x)).max() < bound, (x, step)


@pytest.mark.parametrize("depth", [0.0, 1e-6])
def test_smoke_of_no_depth_changes_no_energy(depth: float) -> None:
    smoke = Medium(depth=depth, sigma_s=1.0, g=0.7)
    rough = Interface(eta=0.2, k=3.5, alpha=0.5)
    plain, clouded = solved([rough], True), solved([smoke, rough], True)
    assert clouded.lobes == pytest.approx(plain.lobes, abs=1e-3)
    assert clouded.rest == pytest.approx(plain.rest, abs=1e-3)


# As they are drawn


def drawn(layers: list[Any], cosine: float) -> np.ndarray:
    """Light from a cosine over even directions on both sides, by colour."""
    material = Material.of(Stack(layers)).solid()
    found = solution.solve(material, named("velatura"), variance_kind(material), Context())
    u, v = low_discrepancy.square(1597)
    radius, phi = np.sqrt(u), 2 * np.pi * v
    wo = radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - u)
    wi = np.full(u.size, np.sqrt(1 - cosine**2)), np.zeros(u.size), np.full(u.size, cosine)
    both = (found.eval_pdf(wi, (wo[0], wo[1], side * wo[2]), Asked(radiance=False))[0] / wo[2] for side in (1, -1))
    return np.concatenate([np.broadcast_to(light, (3, u.size)) for light in both], axis=1)


BENEATH: dict[str, tuple[list[Any], list[Any]]] = {
    "over gold": ([], [GOLD]),
    "over coated gold": ([], [COAT, GOLD]),
    "in coated gold": ([COAT], [GOLD]),
    "over glass": ([], [COAT]),
    "under glass": ([COAT], []),
    "in a pane": ([COAT], [Interface(eta=1.0, alpha=0.2)]),
    "under a pane": ([COAT, Interface(eta=1.0, alpha=0.2)], []),
}


@pytest.mark.parametrize("name", BENEATH)
def test_a_rough_interface_of_almost_no_step_changes_no_lobe(name: str) -> None:
    """Total variation."""
    above, below = BENEATH[name]
    n = above[-1].eta if above else 1.0
    plain = drawn([*above, *below], 0.5)
    for step, bound in ((0.0, 1e-4), (1e-6, 1e-3), (1e-3, 0.01)):
        stepped = drawn([*above, Interface(eta=n * (1 + step), alpha=0.4), *below], 0.5)
        assert 0.5 * np.abs(stepped - plain).sum() < bound * plain.sum()
