"""Light over a diffuse base: the parts that it is followed by, and stacks that are known exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import velatura as vt
from velatura import tables
from velatura.model import named
from velatura.model.papers import bsdf
from velatura.model.papers.prepare import PreparedBase
from velatura.optics import fresnel
from velatura.stack import Material
from velatura.tables import coordinates, diffuse_nodes
from velatura.tables.build import diffuse_matrices

Array = NDArray[np.floating]

SHIPPED = tables.load()
COSINES = np.array([1.0, 0.7, 0.4, 0.2])


def prepared(stack: vt.Stack, model: str = "velatura", **switches: str) -> bsdf.Lobed:
    return bsdf.body(Material.of(stack), named(model, **switches))


def seen(stack: vt.Stack, model: str = "velatura", **switches: str) -> tuple[Array, PreparedBase]:
    """Albedos (3, cosines) of the base, and what it was prepared as."""
    body = prepared(stack, model, **switches)
    base = body.base((np.sqrt(1 - COSINES**2), 0 * COSINES, COSINES))
    assert base is not None and body.above.base is not None
    return np.broadcast_to(base.energy, (3, len(COSINES))), body.above.base


def smooth(indices: tuple[float, float], taus: tuple[float, float], albedo: float) -> Array:
    """The albedo under two smooth interfaces: along each direction light bounces as in a pane, by geometric series."""

    def pane(p: Array) -> tuple[Array, Array]:
        """For light of tangential momentum p: what reaches the base, and what comes back to it from there."""
        n_1, n_2 = indices
        c_0, c_1, c_2 = (np.sqrt(np.maximum(1 - p * p / (n * n), 0)) for n in (1.0, n_1, n_2))
        a_1, a_2 = (np.exp(-tau / np.maximum(c, 1e-6)) for tau, c in zip(taus, (c_1, c_2)))
        r_1 = np.where(p < 1, fresnel.dielectric(c_0, n_1), 1.0)
        r_2 = np.where(p < n_1, fresnel.dielectric(np.maximum(c_2, 1e-9), n_1 / n_2), 1.0)
        through = np.where(p < n_1, (1 - r_1) * a_1 * (1 - r_2) * a_2 / np.maximum(1 - r_1 * r_2 * a_1**2, 1e-9), 0.0)
        back = r_2 + np.where(p < n_1, (1 - r_2) ** 2 * a_1**2 * r_1 / np.maximum(1 - r_1 * r_2 * a_1**2, 1e-9), 0.0)
        return through, np.minimum(back, 1.0) * a_2**2

    p2 = indices[1] ** 2 * (np.arange(400_000) + 0.5) / 400_000
    through, back = pane(np.sqrt(p2))
    escaping, reflected = np.mean(np.where(p2 < 1, through, 0.0)), np.mean(back)
    return pane(np.sqrt(1 - COSINES**2))[0] * albedo * escaping / (1 - albedo * reflected)


@pytest.mark.parametrize("indices", [(1.3, 1.6), (1.7, 1.3), (2.2, 1.5), (1.5, 2.1)])
@pytest.mark.parametrize("taus", [(0.0, 0.0), (0.3, 0.6)])
def test_two_smooth_interfaces_are_known_exactly(indices: tuple[float, float], taus: tuple[float, float]) -> None:
    """Within 1 % at all cosines, where interpolation counts most: the kink at the critical angle lies between nodes."""
    layers = [x for n, tau in zip(indices, taus) for x in (vt.Interface(eta=n), vt.Medium(sigma_a=tau))]
    found, _ = seen(vt.Stack([*layers, vt.Diffuse(albedo=0.9)]), "belcour2018", reflectance="fresnel")
    np.testing.assert_allclose(found[0], smooth(indices, taus, 0.9), rtol=1e-2)


@pytest.mark.parametrize("model", ["velatura", "belcour2018", "weier2020"])
@pytest.mark.parametrize("alphas", [(0.2,), (0.3, 0.5), (0.6, 0.1), (0.4, 0.0, 0.3)])
def test_white_paint_under_clear_rough_coats_loses_nothing(alphas: tuple[float, ...], model: str) -> None:
    """Of diffuse light from the base all comes back or leaves, within 0.4 %."""
    coats = [vt.Interface(eta=eta, alpha=alpha) for eta, alpha in zip((1.9, 1.4, 1.6), alphas)]
    _, base = seen(vt.Stack([*coats, vt.Diffuse(albedo=1.0)]), model)
    np.testing.assert_allclose(base.mean_reflectance + base.mean_transmittance, 1, atol=4e-3)


def test_an_interface_without_contrast_is_not_there() -> None:
    """However rough; the index is at a node of no table."""
    coat, medium, paint = vt.Interface(eta=1.47, alpha=0.2), vt.Medium(sigma_a=0.5), vt.Diffuse(albedo=0.7)
    alone, _ = seen(vt.Stack([coat, medium, paint]))
    again, _ = seen(vt.Stack([coat, medium, vt.Interface(eta=1.47, alpha=0.5), paint]))
    np.testing.assert_allclose(again, alone, rtol=2e-3)


def test_a_medium_without_interface_absorbs() -> None:
    found, _ = seen(vt.Stack([vt.Medium(sigma_a=0.4), vt.Diffuse(albedo=0.6)]))
    c = (np.arange(100_000) + 0.5) / 100_000
    escaping = np.mean(2 * c * np.exp(-0.4 / c))
    np.testing.assert_allclose(found[0], np.exp(-0.4 / COSINES) * 0.6 * escaping, rtol=2e-3)


@pytest.mark.parametrize("model", ["velatura", "belcour2018"])
def test_the_base_is_reciprocal(model: str) -> None:
    stack = vt.Stack(
        [vt.Interface(eta=1.9, alpha=(0.1, 0.4), rotation=20), vt.Interface(eta=1.4, alpha=0.3), vt.Diffuse()]
    )
    body = bsdf.body(Material.of(stack), named(model))
    wi, wo = (0.6, 0.0, 0.8), (0.3, -0.4, np.sqrt(0.75))
    there, back = body.base(wi), body.base(wo)
    assert there is not None and back is not None
    np.testing.assert_allclose(there.value(wo), back.value(wi), rtol=1e-12)


# Parts


@pytest.mark.parametrize("n", [1.0, 1.2, 1.5, 2.2])
def test_parts_of_even_light_are_its_means(n: float) -> None:
    """Of functions of the cosine, against sums over projected solid angle."""
    u = (np.arange(200_000) + 0.5) / 200_000
    lagrange = diffuse_matrices.parts(np.sqrt(1 - u), n)
    np.testing.assert_allclose(lagrange.mean(axis=1), diffuse_nodes.even(n), atol=1e-4)
    assert sum(diffuse_nodes.even(n)) == pytest.approx(1, abs=1e-12)


def test_tables_lose_no_light() -> None:
    count = diffuse_nodes.COUNT
    passing, staying = (t.data.reshape(*t.shape, count, count) for t in (SHIPPED.passing, SHIPPED.staying))
    np.testing.assert_allclose(SHIPPED.entering.data.sum(axis=-1), 1, atol=1e-5)
    np.testing.assert_allclose((passing + staying).sum(axis=-1), 1, atol=1e-2)


def test_the_shipped_parts_are_what_the_builder_makes() -> None:
    i, k = 4, 7
    alpha = float(coordinates.to_roughness(np.linspace(0, 1, diffuse_matrices.RETURNING[0]))[i])
    n = float(coordinates.to_index(np.linspace(0, 1, diffuse_matrices.RETURNING[1]))[k])
    made: Any = diffuse_matrices.returned(alpha, n)
    np.testing.assert_allclose(made, SHIPPED.returning.data[i, k], atol=1e-6)


def test_what_enters_smoothly_goes_where_snell_says() -> None:
    """The parts hold parabolas in p^2 exactly: mean of p^2 and of p^4, within errors of interpolation."""
    p2 = 1 - COSINES**2
    entered = diffuse_nodes.entering(SHIPPED, COSINES, 0 * COSINES, 0 * COSINES + 1.55)
    found = np.array(entered)[: len(diffuse_nodes.OPEN)]
    for power in (1, 2):
        np.testing.assert_allclose(np.array(diffuse_nodes.OPEN) ** power @ found, p2**power, atol=2e-3)


def test_what_passes_an_interface_of_lower_index_is_never_negative() -> None:
    """At grazing angles next to nothing enters, and polynomials swing around that."""
    cosines = np.linspace(0.01, 1, 200)
    layers = [vt.Interface(eta=1.49, alpha=0.1), vt.Medium(sigma_a=0.2), vt.Diffuse(albedo=0.9)]
    base = prepared(vt.Stack(layers, exterior=1.6)).base((np.sqrt(1 - cosines**2), 0 * cosines, cosines))
    assert base is not None and np.min(base.energy) >= 0
