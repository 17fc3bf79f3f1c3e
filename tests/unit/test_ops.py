"""The elementary functions give the same answers in every dialect, and each dialect its own kind of number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from velatura import kernel, ops
from velatura.tables import Table

X, Y = np.random.default_rng(1).uniform(0.05, 0.95, (2, 50))
GRID = Table(np.random.default_rng(2).random((5, 4, 2)).astype(np.float32))

# name -> a function of two numbers from [0.05, 0.95]
FUNCTIONS: dict[str, Callable[[Any, Any], Any]] = {
    "sqrt": lambda x, y: ops.sqrt(x),
    "sqrt of a negative number": lambda x, y: ops.sqrt(-x),
    "exp": lambda x, y: ops.exp(x),
    "log": lambda x, y: ops.log(x),
    "power": ops.power,
    "sin": lambda x, y: ops.sin(x),
    "cos": lambda x, y: ops.cos(x),
    "arctan2": ops.arctan2,
    "absolute": lambda x, y: ops.absolute(x - y),
    "minimum": ops.minimum,
    "maximum": ops.maximum,
    "clip": lambda x, y: ops.clip(x, 0.3, 0.6),
    "select": lambda x, y: ops.select(x < y, x, 2.0),
    "select by two conditions": lambda x, y: ops.select((x < y) & (x < 0.5), 1.0, x),
    "divide": ops.divide,
    "divide by 0": lambda x, y: ops.divide(0 * x, 0 * y),
    "interpolate": lambda x, y: ops.interpolate(GRID, x, y)[1],
    "interpolate in simplices": lambda x, y: ops.interpolate_in_simplices(GRID, x, y)[1],
}


@pytest.fixture(scope="module")
def llvm() -> Any:
    kernel.require_llvm()
    import drjit.llvm.ad

    return drjit.llvm.ad


@pytest.fixture(scope="module")
def scalar() -> Any:
    import mitsuba.scalar_rgb

    return mitsuba.scalar_rgb


@pytest.mark.parametrize("name", FUNCTIONS)
def test_floats_and_arrays_agree(name: str) -> None:
    function = FUNCTIONS[name]
    array = function(X, Y)
    assert isinstance(array, np.ndarray)
    assert array.dtype == float
    single = [function(float(x), float(y)) for x, y in zip(X, Y)]
    assert all(type(value) is float for value in single)
    np.testing.assert_allclose(single, array, rtol=1e-15)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_drjit_agrees_with_numpy(name: str, llvm: Any) -> None:
    x, y = X.astype(np.float32), Y.astype(np.float32)
    values = FUNCTIONS[name](llvm.Float(x), llvm.Float(y))
    assert type(values) is llvm.Float
    np.testing.assert_allclose(values.numpy(), FUNCTIONS[name](x.astype(float), y.astype(float)), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("mixed", [False, True])
def test_scalar_colours_agree_with_numpy(name: str, mixed: bool, scalar: Any) -> None:
    """A colour of Mitsuba's scalar variants holds Python floats and yet is no float."""
    x, y = [0.1, 0.4, 0.8], 0.5 if mixed else [0.7, 0.3, 0.2]
    values = FUNCTIONS[name](scalar.Color3f(x), y if mixed else scalar.Color3f(y))
    assert type(values) is scalar.Color3f
    np.testing.assert_allclose(list(values), FUNCTIONS[name](np.array(x), np.array(y)), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_arrays_mix_with_floats(name: str, llvm: Any) -> None:
    expected = FUNCTIONS[name](X, np.full_like(X, 0.5))
    np.testing.assert_allclose(np.broadcast_to(FUNCTIONS[name](X, 0.5), X.shape), expected, rtol=1e-15)
    np.testing.assert_allclose(FUNCTIONS[name](llvm.Float(X), 0.5).numpy(), expected, rtol=1e-5, atol=1e-6)


# Colour


def test_channels_are_the_leading_axis(llvm: Any, scalar: Any) -> None:
    colour = np.array([[0.1, 0.9], [0.4, 0.6], [0.7, 0.0]])  # three channels, two lanes
    np.testing.assert_allclose(ops.mean(colour), [0.4, 0.5])
    lanes = ops.mean(llvm.Array3f(*map(llvm.Float, colour)))
    assert type(lanes) is llvm.Float
    np.testing.assert_allclose(lanes.numpy(), [0.4, 0.5], rtol=1e-6)
    single = ops.mean(scalar.Color3f(colour[:, 0]))
    assert type(single) is float
    assert single == pytest.approx(0.4)


def test_what_has_no_channels_is_its_own_mean(llvm: Any) -> None:
    assert ops.mean(0.3) == 0.3
    lanes = llvm.Float([0.1, 0.2])
    assert ops.mean(lanes) is lanes


def test_colour_meets_direction(llvm: Any, scalar: Any) -> None:
    """A table read at one coordinate per channel and one per direction gives one value per channel and direction."""
    colour, direction = np.array([0.2, 0.5, 0.9]), np.array([0.1, 0.7])
    values = ops.interpolate(GRID, colour[:, None], direction)[0]
    assert values.shape == (3, 2)
    single = [[ops.interpolate(GRID, c, d)[0] for d in direction.tolist()] for c in colour.tolist()]
    np.testing.assert_allclose(values, single, rtol=1e-15)
    lanes = ops.interpolate(GRID, llvm.Array3f(*colour.tolist()), llvm.Float(direction))[0]
    assert type(lanes) is llvm.Array3f
    np.testing.assert_allclose(lanes.numpy(), values, rtol=1e-5)
    one = ops.interpolate(GRID, scalar.Color3f(colour), float(direction[1]))[0]
    np.testing.assert_allclose(list(one), values[:, 1], rtol=1e-5)


# Interpolation


@pytest.mark.parametrize("interpolate", [ops.interpolate, ops.interpolate_in_simplices])
@given(x=st.floats(-0.5, 1.5), y=st.floats(-0.5, 1.5))
def test_interpolation_is_linear_between_nodes_and_constant_outside(interpolate: Any, x: float, y: float) -> None:
    def plane(x: Any, y: Any) -> Any:
        return 3 * x - 2 * y + 1

    nodes = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 4), indexing="ij")
    table = Table(plane(*nodes)[..., None])
    assert interpolate(table, x, y)[0] == pytest.approx(plane(min(max(x, 0), 1), min(max(y, 0), 1)))


@pytest.mark.parametrize("interpolate", [ops.interpolate, ops.interpolate_in_simplices])
def test_interpolation_meets_the_nodes(interpolate: Any) -> None:
    for i, j in ((0, 0), (2, 1), (4, 3)):
        np.testing.assert_allclose(interpolate(GRID, i / 4, j / 3), GRID.data[i, j], rtol=1e-7)


@pytest.mark.parametrize("axes", [1, 2, 3, 4])
def test_interpolation_in_simplices_is_that_of_a_triangulation(axes: int, llvm: Any) -> None:
    """In NumPy and Dr.Jit, with gradients: of a cell's simplices, by barycentric coordinates."""
    import drjit as dr

    rng = np.random.default_rng(axes)
    table, points = Table(rng.random((2,) * axes + (3,)).astype(np.float32)), rng.random((axes, 40))
    expected, slopes = [], []
    for point in points.T:
        order = np.argsort(-point)
        nodes = np.vstack([np.zeros(axes, int), np.cumsum(np.eye(axes, dtype=int)[order], axis=0)])
        values = np.array([table.data[tuple(node)][2] for node in nodes])
        plane = np.linalg.solve(np.column_stack([nodes, np.ones(axes + 1)]), values)
        expected.append(plane[:-1] @ point + plane[-1])
        slopes.append(plane[:-1])
    np.testing.assert_allclose(ops.interpolate_in_simplices(table, *points)[2], expected, rtol=1e-5)
    at = [llvm.Float(x) for x in points]
    dr.enable_grad(at)
    found = ops.interpolate_in_simplices(table, *at)[2]
    np.testing.assert_allclose(found.numpy(), expected, rtol=1e-5)
    dr.backward(dr.sum(found))
    np.testing.assert_allclose([x.grad.numpy() for x in at], np.transpose(slopes), atol=1e-5)


@pytest.mark.parametrize("axes", [2, 3])
def test_a_table_may_be_read_first_inside_a_loop(axes: int, llvm: Any) -> None:
    """A renderer records loops and calls; the texture that is made at first use must survive the recording."""
    import drjit as dr

    table = Table(np.random.default_rng(3).random((4,) * axes + (3,)).astype(np.float32))
    at = [llvm.Float([0.2, 0.9])] * axes

    def unfinished(i: Any, total: Any) -> Any:
        return i < 2

    def add(i: Any, total: Any) -> tuple[Any, Any]:
        return i + 1, total + ops.interpolate(table, *at)[2]

    _, total = dr.while_loop((llvm.UInt32(0, 0), llvm.Float(0, 0)), unfinished, add)
    expected = 2 * ops.interpolate(table, *([np.array([0.2, 0.9])] * axes))[2]
    np.testing.assert_allclose(total.numpy(), expected, rtol=1e-5)
    np.testing.assert_allclose(ops.interpolate(table, *at)[2].numpy(), expected / 2, rtol=1e-5)


# The edge of the domain


@pytest.mark.parametrize(
    ("function", "value"),
    [
        (ops.sqrt, 0.0),
        (lambda x: ops.sqrt(x - 1), 0.0),
        (lambda x: ops.divide(x, x), 0.0),
        (lambda x: ops.select(x > 0, ops.divide(1.0, x), 2.0), 2.0),
        (lambda x: ops.select(x > 0, ops.log(ops.maximum(x, ops.TINY)), 0.0), 0.0),
    ],
)
def test_values_and_gradients_are_finite_at_the_edge(function: Callable[[Any], Any], value: float, llvm: Any) -> None:
    import drjit as dr

    x = llvm.Float([0.0, 0.5])
    dr.enable_grad(x)
    y = function(x)
    dr.backward(y)
    assert y[0] == value
    assert np.isfinite(x.grad.numpy()).all()
    assert function(0.0) == value


def test_records_are_selected_value_by_value() -> None:
    @dataclass
    class Pair:
        a: Any
        b: tuple[Any, ...] | None

    yes, no = Pair(X, (1.0, Y)), Pair(Y, (1.0, X))
    found = ops.select_record(X < Y, yes, no)
    assert np.array_equal(found.a, np.where(X < Y, X, Y)) and np.array_equal(found.b[1], np.where(X < Y, Y, X))
    assert found.b[0] == 1.0 and isinstance(found.b[0], float)
    assert ops.select_record(X < Y, yes, yes) is yes
    assert ops.select_record(X < Y, yes, replace(no, b=None)).b is None
