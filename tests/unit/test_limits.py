"""Exact limits of solved materials: layers that do nothing, smooth stacks, and directions at the ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import tables
from velatura.model import named
from velatura.model.base import Query
from velatura.model.context import Context
from velatura.model.papers import diffuse_base
from velatura.model.papers.prepare import prepare
from velatura.model.solved import solve
from velatura.model.solved.bsdf import Solved
from velatura.model.solved.energies.energies import Energies, energies
from velatura.model.solved.lobes.widths import nearly_straight
from velatura.model.variance import variance_kind
from velatura.optics import fresnel
from velatura.renderer import low_discrepancy
from velatura.stack import Diffuse, Interface, Material, Medium, Stack

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


def body(layers: list[Any], reflectance: str = "fgd-multi") -> Solved:
    material = Material.of(Stack(layers)).solid()
    return solve.solve(material, named("velatura", reflectance=reflectance), variance_kind(material), Context())


def at(cosine: float, phi: float = 0.0, count: int = 1) -> tuple[np.ndarray, ...]:
    sine = np.sqrt(1 - cosine**2)
    return tuple(np.full(count, x) for x in (sine * np.cos(phi), sine * np.sin(phi), cosine))


def over_both_sides() -> tuple[np.ndarray, ...]:
    """Directions with a density of the cosine on either side."""
    r2, turns = low_discrepancy.square(1597)
    r, phi, z = np.sqrt(r2), 2 * np.pi * turns, np.sqrt(1 - r2)
    return np.tile(r * np.cos(phi), 2), np.tile(r * np.sin(phi), 2), np.append(z, -z)


def drawn(layers: list[Any], cosine: float) -> np.ndarray:
    """Light from a cosine over even directions on both sides, by colour."""
    wo = over_both_sides()
    light, _ = body(layers).eval_pdf(at(cosine, 0.0, len(wo[0])), wo, Query(radiance=False))
    return np.broadcast_to(light / np.abs(wo[2]), (3, len(wo[0])))


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


LOSSLESS: dict[str, list[Any]] = {
    "glass": [Interface(eta=1.5, alpha=0.3)],
    "pane": [Interface(eta=1.5, alpha=0.2), Interface(eta=1.0, alpha=0.4)],
    "milk": [COAT, Medium(depth=1, sigma_s=2.0, g=0.8), Interface(eta=1.8, alpha=0.1)],
    "brushed": [Interface(eta=1.5, alpha=(0.1, 0.3), rotation=30), Interface(conductor="mirror", alpha=(0.3, 0.1))],
    "white": [COAT, Medium(depth=1, sigma_s=3.0, g=-0.3), Diffuse(albedo=1.0)],
}


@pytest.mark.parametrize("name", LOSSLESS)
def test_lossless_stacks_keep_all_light_between_the_nodes_too(name: str) -> None:
    """From both sides, where there are two."""
    found = body(LOSSLESS[name])
    for side in (1, -1) if found.below else (1,):
        for cosine in (0.99, 0.83, 0.61, 0.37, 0.13):
            x, y, z = at(cosine, 0.7)
            assert found.albedo((x, y, side * z)) == pytest.approx(1, abs=2e-3), (side, cosine)


@pytest.mark.parametrize("often", [False, True], ids=["once", "often"])
@pytest.mark.parametrize("eta", [1.1, 1.5, 2.2])
def test_a_smooth_interface_is_fresnel_as_drawn(eta: float, often: bool) -> None:
    found = body([Interface(eta=eta, alpha=0)], "fgd-multi" if often else "fgd")
    for cosine in (1.0, 0.7, 0.35, 0.1):
        (of, _) = found.seen(at(cosine))
        expected = fresnel.dielectric(cosine, eta)
        assert sum(of.energies) == pytest.approx(expected, abs=2e-4) and of.passed == pytest.approx(
            1 - expected, abs=2e-4
        )


def test_turning_all_layers_turns_the_light_at_the_normal() -> None:
    """A brushed metal under a smooth and a brushed coat, turned by any angle."""

    def stack(turn: float) -> list[Any]:
        return [Interface(eta=1.5, alpha=0.0), Interface(eta=1.7, alpha=(0.1, 0.3), rotation=20 + turn),
                Interface(conductor="Al", alpha=(0.4, 0.1), rotation=turn - 35)]  # fmt: skip

    wo = over_both_sides()
    plain = body(stack(0.0))
    for turn in (30.0, 41.0):
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        turned = c * wo[0] - s * wo[1], s * wo[0] + c * wo[1], wo[2]
        for cosine in (1.0, 0.8):
            here, _ = plain.eval_pdf(at(cosine, 0.3, len(wo[0])), wo)
            there, _ = body(stack(turn)).eval_pdf(at(cosine, 0.3 + np.radians(turn), len(wo[0])), turned)
            assert np.abs(there - here).sum() < 0.01 * here.sum(), (turn, cosine)


ENDS: dict[str, list[Any]] = {
    "smooth": [Interface(eta=1.5, alpha=0), Interface(eta=0.2, k=3.0, alpha=0)],
    "smooth glass": [Interface(eta=1.5, alpha=0), Interface(eta=1.5, alpha=0)],
    "equal indices": [Interface(eta=1.0, alpha=0.3), Interface(eta=1.0, alpha=0.1)],
    "air gap": [Interface(eta=1.8, alpha=0.3), Interface(eta=1.0, alpha=0.3), Interface(eta=1.6, alpha=0.0)],
    "as rough as can be": [Interface(eta=2.2, alpha=1), Medium(sigma_s=1, g=0.9), Interface(eta=1.0, alpha=1)],
    "black": [Interface(eta=1.0, alpha=0.3), Medium(sigma_a=1e4), Diffuse(albedo=0)],
}


@pytest.mark.parametrize("name", ENDS)
def test_all_is_finite_at_the_ends(name: str) -> None:
    found, wo = body(ENDS[name]), over_both_sides()
    ends = [np.append(w, e) for w, e in zip(wo, ([0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, -1.0, 1e-6]))]
    u = np.random.default_rng(0).random((3, len(ends[0])))
    for cosine in (1.0, 0.5, 1e-3, 1e-6, -1e-6, -0.5, -1.0):
        wi = at(cosine, 0.4, len(ends[0]))
        for x in (*found.eval_pdf(wi, (ends[0], ends[1], ends[2])), *found.sample(wi, *u)[0]):
            assert np.isfinite(x).all(), cosine


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("indices", [(1e4, 1e-3, 1e4), (1e-3, 1e4)])
def test_lobes_of_indices_far_apart_are_finite(indices: tuple[float, ...]) -> None:
    """Also their roughnesses, which are worked out in single precision."""
    coats = [Interface(eta=eta, alpha=0.2) for eta in indices]
    found = vt.lobes(Stack([*coats, Interface(conductor="Au", alpha=0.2)]), [1, 0.5, 0.05, 1e-4])
    for alpha in (*found.alpha, *found.own_alpha):
        assert ((alpha >= 0) & (alpha <= 1)).all()


@pytest.mark.parametrize("name", ["realtime", "belcour2018"])
def test_a_base_below_a_medium_that_is_far_rarer_reflects_a_share_in_single_precision(name: str) -> None:
    """Light enters it in a cone that the nodes of diffuse light do not resolve."""
    layers = [Interface(eta=1.0, alpha=1.0), Interface(eta=3000.0, alpha=0.2), Diffuse(albedo=0.5)]
    prepared = diffuse_base.with_means(prepare(Material.of(Stack(layers, exterior=1e4)), named(name)))
    assert prepared.base
    worth = np.array([np.ravel(x)[0] for x in (*prepared.base.importance, prepared.base.mean_reflectance)])
    assert np.abs(worth).max() < 1e3  # products of some of them fit
    base = diffuse_base.under(prepared, (np.zeros(2), np.array([0.0, 0.6]), np.array([1.0, 0.8])))
    assert base and ((base.energy >= 0) & (base.energy <= 1)).all()
