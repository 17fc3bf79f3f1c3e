"""The figures of Bati et al. 2021: their numbers against what the paper says of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import bati2021_07, bati2021_17, bati2021_25


def drawn(module: Any, numbers: dict[str, Any], folder: Path) -> None:
    """The numbers are plain, and there is a picture of them."""
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    module.draw(numbers, folder / "figure.png")
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_classes_of_smooth_pairs(tmp_path: Path) -> None:
    """Figure 7. Expected: classes grow with energy and with the index above; the slab lies on its bound; what the
    model finds within bounds is the closed curve."""
    found = bati2021_07.compute(count=20)
    assert found["deviation"] < 1e-6
    first = found["cases"][0]
    inside = np.concatenate(first["inside"])
    assert inside.min() > 1 - 1e-9
    assert inside[:, 0].max() <= 2.2643
    root = (1 + 0.15**0.5) / (1 - 0.15**0.5)
    assert np.allclose(first["points"]["matched above"][0], (1, root))
    slab = first["points"]["slab"][0]
    assert np.allclose(np.cosh(np.log(slab[0])), 1 / 0.85) and slab[1] == 1
    for part, key in (("b", "energy"), ("c", "eta_0")):
        cases = sorted((case for case in found["cases"] if case["part"] == part), key=lambda case: case[key])
        width = [np.max(case["curve"], axis=0)[0] for case in cases]
        assert width == sorted(width)
    drawn(bati2021_07, found, tmp_path)


def test_the_order_of_lobes_shows_at_the_edge(tmp_path: Path) -> None:
    """Figure 17. Expected: the same energies head-on; at grazing angles a tint that depends on the order."""
    found = bati2021_17.compute(size=16, spp=2)
    blue, red = (found[order] for order in bati2021_17.ORDERS)
    assert np.allclose(blue["energy"][0], red["energy"][0], atol=1e-6)
    assert np.allclose(blue["energy"][0], np.add([0.025, 0.045, 0.05], [0.052, 0.025, 0.025]), atol=1e-6)
    assert blue["grazing"] < 0.8
    assert red["grazing"] > 1.1
    drawn(bati2021_17, found, tmp_path)


def test_lobes_obtained_are_those_expected(tmp_path: Path) -> None:
    """Figure 25. Expected: no difference, conductors included; the walk agrees on energies within 5 %."""
    found = bati2021_25.compute(targets=("15 c", "16"), paths=20_000)
    assert found["energy_error"] < 1e-6
    assert found["variance_error"] < 1e-6
    for row in found["rows"]:
        energy = row["energy"]
        assert np.allclose(energy["walk"], energy["expected"], rtol=0.05)
    drawn(bati2021_25, found, tmp_path)
