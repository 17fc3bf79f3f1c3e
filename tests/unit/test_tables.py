"""The tables against an independent quadrature, published values and limits; their gradients, size and file."""

from __future__ import annotations

import subprocess
import sys
from math import log
from pathlib import Path
from typing import Any

import benchmarks
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from velatura import kernel, tables
from velatura.errors import InvalidInput
from velatura.optics import fresnel
from velatura.tables import coordinates, microsurface_walks
from velatura.tables.build import Built, belcour_grid, makers
from velatura.tables.build.quadrature import average, ignore
from velatura.tables.build.report import report

DEFAULT = {
    *("dielectric_multi", "conductor_multi", "inside_multi", "absorbing_inside_multi"),
    *("tir_published", "tir_published_outside"),
}
OTHER = {"dielectric", "conductor", "inside", "absorbing_inside", "tir_clean"}
OVER_A_DIFFUSE_BASE = {"entering", "returning", "passing", "staying"}
SHIPPED = tables.load()
MAKERS = makers()
COSINES = np.linspace(0.02, 1, 500)


# It makes the whole comparison, of 10^5 points; the tests make a part of the same
benchmark = benchmarks.benchmark("tables")
COMPARISONS = [(a, r) for a in benchmark.AVERAGES for r in a.regions]


@pytest.fixture(scope="module")
def llvm() -> Any:
    kernel.require_llvm()
    import drjit.llvm.ad

    return drjit.llvm.ad


def dielectric(eta: Any, cos_theta: Any, alpha: Any) -> Any:
    return tables.fgd(SHIPPED, tables.dielectric_row(SHIPPED, eta), cos_theta, alpha)


def conductor(eta: Any, kappa: Any, cos_theta: Any, alpha: Any) -> Any:
    return tables.fgd(SHIPPED, tables.conductor_row(SHIPPED, eta, kappa), cos_theta, alpha)


def dielectric_many(eta: Any, cos_theta: Any, alpha: Any) -> Any:
    return tables.fgd(SHIPPED, tables.dielectric_row(SHIPPED, eta, multiple=True), cos_theta, alpha)


def conductor_many(eta: Any, kappa: Any, cos_theta: Any, alpha: Any) -> Any:
    return tables.fgd(SHIPPED, tables.conductor_row(SHIPPED, eta, kappa, multiple=True), cos_theta, alpha)


def mirror(cos_theta: Any, alpha: Any) -> Any:
    return tables.fgd(SHIPPED, tables.mirror_row(SHIPPED), cos_theta, alpha)


# Accuracy


@pytest.mark.parametrize(("average", "region"), COMPARISONS, ids=[f"{a.name}, {r.name}" for a, r in COMPARISONS])
def test_look_ups_keep_their_bounds(average: Any, region: Any) -> None:
    error = benchmark.errors(average, region, 1500, seed=11, progress=lambda done: None)
    assert len(error) > 300
    assert np.abs(error).max() < region.max_error
    assert np.sqrt(np.mean(error**2)) < region.rms_error


def test_many_bounces_against_the_walk_of_the_reference() -> None:
    """24 points, each at its bound plus 4.5 standard errors of the walk: one false alarm in 6000."""
    kernel.require_llvm()
    error, noise = benchmark.compare_many(24, 100_000, seed=3, progress=lambda done: None)
    assert noise.max() < 2e-3
    assert np.all(np.abs(error) < benchmark.MANY_BOUNCES + benchmark.SIGMAS * noise)


def test_many_bounces_add_to_single_ones_and_lose_nothing() -> None:
    """Masking that knows heights lets more light out, and bounces only add."""
    cos_theta, alpha = np.random.default_rng(4).uniform(0.02, 1, (2, 400))
    for eta, kappa in ((0.2, 3.9), (1.5, 2.0), (2.5, 0.5)):
        once, many = conductor(eta, kappa, cos_theta, alpha), conductor_many(eta, kappa, cos_theta, alpha)
        assert np.all(many > once - 5e-3)
        assert np.all(many < 1)
    assert np.all(dielectric_many(1.5, cos_theta, alpha) > dielectric(1.5, cos_theta, alpha) - 5e-3)


@pytest.mark.parametrize("eta", [1.05, 1.5, 2.4])
def test_many_bounces_are_the_same_both_ways(eta: float) -> None:
    """Light that passes in diffusely passes out as well: (1 - R_outside) = eta^2 (1 - R_inside) in the cosine mean."""
    x, w = np.polynomial.legendre.leggauss(200)
    c, w = (x + 1) / 2, w / 2
    for alpha in (0.1, 0.4, 1.0):
        outside, inside = (np.sum(2 * c * w * (1 - dielectric_many(n, c, alpha))) for n in (eta, 1 / eta))
        assert outside == pytest.approx(eta**2 * inside, abs=4e-3 * eta**2)


@pytest.mark.parametrize(
    ("eta", "kappa", "ratios"),
    [(1.5, 0.0, (0.991, 0.890, 0.704)), (1 / 1.5, 0.0, (1.06, 1.22, 1.15)), (0.2, 3.9, (0.988, 0.877, 0.687))],
)
def test_published_values_at_normal_incidence(eta: float, kappa: float, ratios: tuple[float, ...]) -> None:
    """FGD over Fresnel at roughness .1, .3, .5, as Bati 2021 shows them in figure 6."""
    for alpha, ratio in zip((0.1, 0.3, 0.5), ratios):
        value = conductor(eta, kappa, 1.0, alpha) if kappa else dielectric(eta, 1.0, alpha)
        assert value / fresnel.normal_incidence(eta, kappa) == pytest.approx(ratio, abs=0.01)


@pytest.mark.parametrize(("eta", "kappa"), [(9.5131, 16.4317), (24.2, 42.0), (4.8298, 8.0), (12.0, 0.0)])
def test_high_indices(eta: float, kappa: float) -> None:
    cos_theta, alpha = np.random.default_rng(1).uniform(0.02, 1, (2, 300))
    value = conductor(eta, kappa, cos_theta, alpha) if kappa else dielectric(eta, cos_theta, alpha)
    truth = average(
        lambda r: (r.weight * fresnel.conductor(r.cos_d, eta, kappa)).sum(axis=1), "cos_d", cos_theta, alpha, nodes=16
    )
    assert np.abs(value - truth).max() < 5e-3
    assert np.sqrt(np.mean((value - truth) ** 2)) < 5e-4


# Limits


def test_a_mirror_of_roughness_1_at_normal_incidence() -> None:
    assert mirror(1.0, 1.0) == pytest.approx(1 - log(2), abs=1e-6)


@pytest.mark.parametrize("eta", [1.0, 1.05, 1.5, 4.0])
def test_smooth_dielectrics_are_fresnel(eta: float) -> None:
    assert np.abs(dielectric(eta, COSINES, 0.0) - fresnel.dielectric(COSINES, eta)).max() < 2e-3


@pytest.mark.parametrize("eta", [1.05, 1.5, 4.0])
def test_smooth_dielectrics_are_fresnel_after_any_number_of_bounces(eta: float) -> None:
    assert np.abs(dielectric_many(eta, COSINES, 0.0) - fresnel.dielectric(COSINES, eta)).max() < 5e-3


@pytest.mark.parametrize("index", [(0.2, 3.9), (3.0, 3.0), (9.5131, 16.4317)])
def test_smooth_conductors_are_fresnel_after_any_number_of_bounces(index: tuple[float, float]) -> None:
    assert np.abs(conductor_many(*index, COSINES, 0.0) - fresnel.conductor(COSINES, *index)).max() < 5e-3


def test_nothing_is_lost_between_the_facets_of_a_mirror() -> None:
    cos_theta, alpha = np.random.default_rng(5).uniform(0, 1, (2, 500))
    np.testing.assert_allclose(conductor_many(1.0, 1e5, cos_theta, alpha), 1, atol=1e-3)
    lost_once = 1 - mirror(cos_theta, alpha)
    assert lost_once.max() > 0.5


@pytest.mark.parametrize("index", [(0.2, 3.9), (1.0, 0.1), (3.0, 3.0), (9.5131, 16.4317)])
def test_smooth_conductors_are_fresnel(index: tuple[float, float]) -> None:
    assert np.abs(conductor(*index, COSINES, 0.0) - fresnel.conductor(COSINES, *index)).max() < 3e-3


@pytest.mark.parametrize("eta", [0.1, 0.4, 1 / 1.5, 0.95])
def test_smooth_interfaces_from_inside(eta: float) -> None:
    """But for a hundredth of a radian on both sides of the critical angle, where nodes cannot follow the bend."""
    c = COSINES[np.abs(np.arccos(COSINES) - np.arcsin(eta)) > 0.01]
    reflected = fresnel.dielectric(c, eta)
    assert np.abs(dielectric(eta, c, 0.0) - reflected).max() < 5e-3
    assert np.abs(tables.tir(SHIPPED, "published", eta, c, 0.0) - (1 - reflected)).max() < 5e-3
    assert np.abs(tables.tir(SHIPPED, "clean", eta, c, 0.0) - (reflected < 1)).max() < 1e-3


def test_published_tir_of_a_smooth_interface_counts_fresnel() -> None:
    assert tables.tir(SHIPPED, "published", 1 / 1.5, 1.0, 0.0) == pytest.approx(0.96, abs=1e-3)
    assert tables.tir(SHIPPED, "clean", 1 / 1.5, 1.0, 0.0) == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("alpha", [0.0, 0.2, 0.7])
def test_nothing_happens_between_equal_indices(alpha: float) -> None:
    for eta in (1.0, 1 - 1e-6):
        assert np.abs(dielectric(eta, COSINES, alpha)).max() < 1e-2
        assert np.abs(tables.tir(SHIPPED, "clean", eta, COSINES, alpha) - 1).max() < 1e-2


def test_a_perfect_conductor_is_a_mirror() -> None:
    np.testing.assert_allclose(conductor(1.0, 1e4, COSINES, 0.4), mirror(COSINES, 0.4), atol=1e-3)


# Dialects and rows


def test_colour_against_direction_in_all_dialects(llvm: Any) -> None:
    eta, cos_theta, alpha = np.array([1.5, 0.7, 1.0]), np.array([0.1, 0.6, 0.9, 1.0]), 0.2
    kappa = np.array([0.0, 0.2, 3.0])
    colour, lanes = llvm.Array3f, llvm.Float(cos_theta)
    for values, traced, single in (
        (
            dielectric(eta[:, None], cos_theta, alpha),
            dielectric(colour(*eta.tolist()), lanes, alpha),
            lambda i, c: dielectric(eta.tolist()[i], c, alpha),
        ),
        (
            conductor(eta[:, None], kappa[:, None], cos_theta, alpha),
            conductor(colour(*eta.tolist()), colour(*kappa.tolist()), lanes, alpha),
            lambda i, c: conductor(eta.tolist()[i], kappa.tolist()[i], c, alpha),
        ),
        (
            dielectric_many(eta[:, None], cos_theta, alpha),
            dielectric_many(colour(*eta.tolist()), lanes, alpha),
            lambda i, c: dielectric_many(eta.tolist()[i], c, alpha),
        ),
        (
            conductor_many(eta[:, None], kappa[:, None], cos_theta, alpha),
            conductor_many(colour(*eta.tolist()), colour(*kappa.tolist()), lanes, alpha),
            lambda i, c: conductor_many(eta.tolist()[i], kappa.tolist()[i], c, alpha),
        ),
        (
            tables.tir(SHIPPED, "published", eta[:, None], cos_theta, alpha),
            tables.tir(SHIPPED, "published", colour(*eta.tolist()), lanes, alpha),
            lambda i, c: tables.tir(SHIPPED, "published", eta.tolist()[i], c, alpha),
        ),
    ):
        assert values.shape == (3, 4)
        np.testing.assert_allclose(traced.numpy(), values, atol=2e-4)
        np.testing.assert_allclose([[single(i, c) for c in cos_theta.tolist()] for i in range(3)], values, atol=1e-12)


def test_constant_rows_leave_out_what_they_never_need() -> None:
    for eta in (np.array([1.2, 1.5, 1.0]), np.array([0.4, 0.9, 0.7]), np.array([0.5, 1.5, 0.8])):
        kappa = 0.5 * eta
        for row, full in (
            (tables.dielectric_row(SHIPPED, eta, constant=True), tables.dielectric_row(SHIPPED, eta)),
            (tables.conductor_row(SHIPPED, eta, kappa, constant=True), tables.conductor_row(SHIPPED, eta, kappa)),
        ):
            assert (row.rarer, row.denser) == (bool((eta < 1).any()), bool((eta >= 1).any()))
            np.testing.assert_array_equal(tables.fgd(SHIPPED, row, 0.6, 0.3), tables.fgd(SHIPPED, full, 0.6, 0.3))


# Gradients


@pytest.mark.parametrize(("eta", "kappa"), [(1.5, None), (0.7, None), (0.2, 3.9), (2.5, 1.0), (0.8, 0.3)])
def test_gradients_follow_the_index(eta: float, kappa: float | None, llvm: Any) -> None:
    import drjit as dr

    def albedo(index: tuple[Any, ...]) -> Any:
        return dielectric(index[0], 0.55, 0.3) if kappa is None else conductor(index[0], index[1], 0.55, 0.3)

    index = (eta,) if kappa is None else (eta, kappa)
    traced = tuple(llvm.Float(v) for v in index)
    for v in traced:
        dr.enable_grad(v)
    dr.backward(albedo(traced))
    for i, v in enumerate(traced):
        step = np.eye(len(index))[i] * 1e-4
        difference = albedo(tuple((np.array(index) + step).tolist())) - albedo(tuple((np.array(index) - step).tolist()))
        assert v.grad[0] == pytest.approx(difference / 2e-4, rel=2e-3, abs=2e-4)


@pytest.mark.parametrize("form", ["published", "clean"])
def test_gradients_of_total_reflection(form: str, llvm: Any) -> None:
    import drjit as dr

    eta = llvm.Float(0.7)
    dr.enable_grad(eta)
    dr.backward(tables.tir(SHIPPED, form, eta, 0.55, 0.3))
    above, below = (tables.tir(SHIPPED, form, 0.7 + step, 0.55, 0.3) for step in (1e-4, -1e-4))
    assert eta.grad[0] == pytest.approx((above - below) / 2e-4, rel=2e-3)


def test_gradients_are_finite_at_the_edges(llvm: Any) -> None:
    import drjit as dr

    points = np.meshgrid([0, 0.8, 1], [0.05, 0.6, 1, 1.5], [0, 0.6, 3], [0, 0.3, 1])
    c, eta, kappa, alpha = (llvm.Float(p.ravel().astype(np.float32)) for p in points)
    for look_up in (
        lambda: dielectric(eta, c, alpha),
        lambda: conductor(eta, kappa, c, alpha),
        lambda: dielectric_many(eta, c, alpha),
        lambda: conductor_many(eta, kappa, c, alpha),
        lambda: tables.tir(SHIPPED, "published", eta, c, alpha),
        lambda: tables.tir(SHIPPED, "clean", eta, c, alpha),
    ):
        for v in (c, eta, kappa, alpha):
            dr.enable_grad(v)
        value = look_up()
        dr.backward(value)
        assert np.isfinite(value.numpy()).all()
        for v in (c, eta, kappa, alpha):
            assert np.isfinite(v.grad.numpy()).all()
            dr.disable_grad(v)


# Coordinates


@given(st.floats(0, 1), st.floats(0.05, 1.57))
def test_the_angular_axis_can_be_inverted(x: float, theta_c: float) -> None:
    assert coordinates.from_angle(coordinates.to_angle(x, theta_c), theta_c) == pytest.approx(x, abs=1e-5)


@given(st.floats(0, 1))
def test_the_other_axes_can_be_inverted(x: float) -> None:
    assert coordinates.from_cosine(coordinates.to_cosine(x)) == pytest.approx(x, abs=1e-12)
    assert coordinates.from_roughness(coordinates.to_roughness(x)) == pytest.approx(x, abs=1e-12)
    assert coordinates.from_critical_angle(coordinates.to_critical_angle(x)) == pytest.approx(x, abs=1e-12)


def test_the_angular_axis_has_its_ends_and_the_critical_angle_where_it_says() -> None:
    for x, theta in ((1.0, 0.0), (0.5, 0.7), (0.0, np.pi / 2)):
        assert coordinates.to_angle(x, 0.7) == pytest.approx(np.cos(theta), abs=1e-12)


# Size, file, report


def test_what_the_default_model_needs_is_small() -> None:
    sizes = {name: table.data.nbytes for name, table in SHIPPED.items()}
    assert sizes.keys() == DEFAULT | OTHER | OVER_A_DIFFUSE_BASE
    assert sum(sizes[name] for name in DEFAULT) <= 2 * 2**20
    assert sum(sizes[name] for name in OVER_A_DIFFUSE_BASE) <= 2**20
    assert all(table.data.dtype == np.float32 for _, table in SHIPPED.items())


@pytest.mark.parametrize("name", ["dielectric", "conductor", "absorbing_inside", "tir_published_outside"])
def test_the_shipped_file_is_what_the_builder_makes(name: str) -> None:
    built, shipped = MAKERS[name](ignore), getattr(SHIPPED, name)
    assert built.nodes == shipped.nodes
    np.testing.assert_allclose(built.data, shipped.data, atol=1e-6)


def test_walks_are_seeded() -> None:
    point = np.array([0.6]), np.array([0.4]), np.array([1 / 1.5])
    first, again, other = (
        microsurface_walks.reflected_later(*point, 4096, np.random.default_rng(s))[0] for s in (1, 1, 2)
    )
    assert first == again != other
    assert first == pytest.approx(other, abs=8e-3)


def test_tables_survive_their_file(tmp_path: Path) -> None:
    path = tmp_path / "tables.npz"
    tables.save(SHIPPED, path)
    with np.load(path) as saved, np.load(tables.FILE) as shipped:
        assert set(saved) == set(shipped)
        assert all(np.array_equal(saved[name], shipped[name]) for name in shipped)


def test_a_failed_save_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(file: Any, **arrays: Any) -> None:
        file.write(b"half")
        raise OSError("disk full")

    path = tmp_path / "tables.npz"
    path.write_text("before")
    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(InvalidInput, match=r"tables\.npz: cannot be written: disk full"):
        tables.save(SHIPPED, path)
    assert [file.name for file in tmp_path.iterdir()] == ["tables.npz"]
    assert path.read_text() == "before"


def test_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Building takes long, so what is measured here is the shipped file."""

    def build(progress: Any) -> Built:
        progress(1.0)
        return Built(SHIPPED, {name: 0.5 for name, _ in SHIPPED.items()})

    monkeypatch.setattr("velatura.tables.build.report.build", build)
    monkeypatch.setattr("velatura.tables.build.report.POINTS", 100)
    monkeypatch.setattr("velatura.tables.build.report.WALKED", 10)
    heard: list[float] = []
    rows = {row["table"]: row for row in report(heard.append)}
    assert heard == sorted(heard)
    assert heard[-1] == pytest.approx(1)
    assert rows.keys() == DEFAULT | OTHER | OVER_A_DIFFUSE_BASE
    assert rows["conductor"] == rows["conductor"] | {
        "shape": list(SHIPPED.conductor.data.shape),
        "bytes": SHIPPED.conductor.data.nbytes,
        "rank": 12,
        "build_s": 0.5,
    }
    assert rows["inside"]["rank"] is None
    assert all(0 < row["rms_error"] < row["max_error"] < 2e-2 for row in rows.values())


def test_the_yardstick_is_larger_and_worse() -> None:
    grid = belcour_grid.build()
    assert grid.data.nbytes == 64 * 2**20
    node = 31 / 63
    assert belcour_grid.fgd(grid, node, node, 4 * node, 4 * node) == pytest.approx(
        conductor(4 * node, 4 * node, node, node), abs=1e-3
    )
    cos_theta, alpha, eta, kappa = benchmark.draw(2000, seed=0)
    truth = conductor(eta, kappa, cos_theta, alpha)  # ten times better
    error = belcour_grid.fgd(grid, cos_theta, alpha, eta, kappa) - truth
    assert 1e-3 < np.sqrt(np.mean(error**2)) < 5e-3


def test_threads_share_the_tables() -> None:
    """Concurrent first calls get the same tables."""
    script = (
        "from concurrent.futures import ThreadPoolExecutor; from velatura import tables\n"
        "print(len({id(found) for found in ThreadPoolExecutor(8).map(lambda _: tables.load(), range(8))}))"
    )
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert run.stdout == "1\n"
