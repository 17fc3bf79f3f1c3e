"""Cubics that keep to the rise and fall of values, against SciPy's."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from velatura.model.solved import monotone_cubic


@pytest.mark.parametrize("count", [2, 3, 4, 32])
def test_it_is_scipys(count):
    rng = np.random.default_rng(count)
    nodes = np.concatenate([[0], np.cumsum(rng.uniform(0.1, 1, count - 1))])
    rows = rng.normal(size=(8, count))
    rows[1], rows[2], rows[3] = np.round(rows[1]), np.cumsum(np.abs(rows[2])), 0
    rows[4], rows[5], rows[6, 1:] = 1e-300 * rows[4], np.repeat(rows[5], 2)[:count], rows[6, 1]
    places = np.linspace(0, nodes[-1], 101)
    with np.errstate(over="ignore"):
        expected = PchipInterpolator(nodes, rows, axis=-1)(places)
    np.testing.assert_allclose(monotone_cubic.interpolated(nodes, rows, places), expected, rtol=1e-11, atol=1e-13)
