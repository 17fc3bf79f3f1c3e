"""Functions of direction in several tables, of which the same ones are kept once."""

from __future__ import annotations

import numpy as np
import pytest

from velatura import kernel
from velatura.renderer import directional_grid
from velatura.renderer.directional_grid import Packed, Packing, Summed

RNG = np.random.default_rng(0)
SHAPE = (7,)
GROUPS = [0, 1, 0, 0, 1, 0, 1]
SAME = [0, 1, 2, 0, 1, 2, 0]  # by row, the first of its values; the last one lies in another table


@pytest.mark.parametrize(("shared", "sizes"), [(True, [2, 2]), (False, [4, 3])])
def test_packed_functions_are_those_that_were_given(shared: bool, sizes: list[int]) -> None:
    rows = RNG.uniform(size=(3, *SHAPE))[SAME]
    packing = Packing.of(rows, GROUPS, shared)
    assert [len(table) for table in packing.tables] == sizes
    packed = packing.curves(directional_grid.curves(list(x), SHAPE, None) for x in packing.split(rows))
    w = directional_grid.direction(RNG.uniform(size=50), np.zeros(50))
    expected = directional_grid.curves(list(rows), SHAPE, None)(w)
    np.testing.assert_allclose(packed(w), expected, rtol=1e-12)
    np.testing.assert_allclose(packed.at(np.sqrt(w[2])), expected, rtol=1e-12)


def test_functions_that_are_alike_by_chance_are_several() -> None:
    row = RNG.uniform(size=SHAPE).astype(np.float32).astype(float)
    rows = np.array([row, row * (1 + 1e-9), row * (1 + 1e-15)])
    assert (rows.astype(np.float32) == rows[0].astype(np.float32)).all()
    assert Packing.of(rows, [0, 0, 0]).places == (0, 1, 0)


def test_functions_that_are_sums_of_few() -> None:
    few, shares = RNG.uniform(size=(2, *SHAPE)), RNG.uniform(size=(2, 5))
    packing = Packing.of(few, [0, 0])
    packed = packing.curves(directional_grid.curves(list(x), SHAPE, None) for x in packing.split(few))
    w = directional_grid.direction(RNG.uniform(size=50), np.zeros(50))
    expected = directional_grid.curves(list(shares.T @ few), SHAPE, None)(w)
    np.testing.assert_allclose(Summed(packed, shares.tolist()).at(np.sqrt(w[2])), expected, rtol=1e-12)


@pytest.mark.parametrize("shape", [(7,), (7, 5)])
@pytest.mark.parametrize("renderer", [False, True])
def test_functions_of_either_side_are_those_of_one(shape: tuple[int, ...], renderer: bool) -> None:
    """Two grids of one table: where a condition holds the first one is read, else the second."""
    rows = RNG.uniform(size=(2, 3, np.prod(shape))).astype(np.float32)
    number = None
    x, y, z = directional_grid.direction(RNG.uniform(size=50), RNG.uniform(size=50))
    w, where = (x, y, z), RNG.random(50) < 0.5
    first, second = (directional_grid.curves(list(side), shape, None)(w) for side in rows)
    if renderer:
        mi = kernel.mitsuba("llvm_ad_rgb")
        number, w, where = mi.Float, tuple(map(mi.Float, w)), mi.Mask(where)
    flat = np.concatenate([side.T.ravel() for side in rows])
    table = directional_grid.interleaved(flat, (2 * shape[0], *shape[1:]), number)
    above, below = (Packed((grid,), (0, 1, 2)) for grid in table.grids(shape))
    found = np.array(above.either(below, where)(w))
    np.testing.assert_allclose(found, np.where(np.array(where), first, second), atol=1e-5)
