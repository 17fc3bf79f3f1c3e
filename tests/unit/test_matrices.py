"""Matrices of blocks, against dense ones of the same values."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from velatura.model.solved.energies import matrices
from velatura.model.solved.energies.matrices import Blocks, Matrix

ROWS = 12
KINDS = {"one": 1, "blocks": 4, "dense": ROWS}


def drawn(kind: str, rng: np.random.Generator, colours: int = 3) -> Matrix:
    width = KINDS[kind]
    values = rng.uniform(-0.1, 0.1, (colours, 2, ROWS // width, width, width))
    return values[:, :, 0] if kind == "dense" else Blocks(values)


def dense(matrix: Matrix) -> np.ndarray:
    return matrix.dense if isinstance(matrix, Blocks) else matrix


@pytest.mark.parametrize(("first", "second"), [*product(KINDS, KINDS)])
def test_products_and_sums_are_those_of_dense_matrices(first: str, second: str) -> None:
    rng = np.random.default_rng(4)
    a, b = drawn(first, rng, colours=1), drawn(second, rng)
    assert dense(matrices.product(a, b)) == pytest.approx(dense(a) @ dense(b), abs=1e-15)
    assert dense(matrices.total(a, b)) == pytest.approx(dense(a) + dense(b), abs=1e-15)


@pytest.mark.parametrize("kind", KINDS)
def test_columns_rows_and_powers_are_those_of_dense_matrices(kind: str) -> None:
    rng = np.random.default_rng(5)
    a, columns = drawn(kind, rng), rng.uniform(size=(1, 2, ROWS, 5))
    rows = columns.swapaxes(-1, -2)
    assert matrices.applied(a, columns) == pytest.approx(dense(a) @ columns, abs=1e-15)
    assert matrices.composed(rows, a) == pytest.approx(rows @ dense(a), abs=1e-15)
    assert matrices.applied(a, columns[..., :0]).shape == (3, 2, ROWS, 0)
    powers = np.linalg.inv(1.001 * np.eye(ROWS) - dense(a))
    assert dense(matrices.repeated(a, 0.001)) == pytest.approx(powers, abs=1e-13)


def test_products_with_nothing_stay_of_blocks() -> None:
    nothing = Blocks.diagonal(np.zeros((1, 1, ROWS)))
    a = drawn("dense", np.random.default_rng(6))
    assert matrices.product(a, nothing) is nothing and matrices.product(nothing, a) is nothing


@pytest.mark.parametrize(("rows", "inner", "columns"), [(90, 90, 90), (1, 180, 1500), (180, 180, 7)])
def test_large_products_are_those_of_their_blocks(rows: int, inner: int, columns: int) -> None:
    rng = np.random.default_rng(7)
    first, second = rng.normal(size=(3, 1, rows, inner)), rng.normal(size=(1, 1, inner, columns))
    assert matrices.applied(first, second) == pytest.approx(first @ second, abs=1e-12)
