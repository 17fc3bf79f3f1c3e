"""Energies of media against van de Hulst, Chandrasekhar, Sweigart, DISORT, adding-doubling of others, and walks."""

from __future__ import annotations

import numpy as np
import pytest
import slab_radiances
from radiative_transfer import KNOWN, rows

from velatura.model import named
from velatura.model.context import Context
from velatura.model.solved import solve
from velatura.model.variance import variance_kind
from velatura.stack import Interface, Material, Medium, Stack

MOST, MEAN = 2e-3, 5e-4  # of the incident light


@pytest.mark.parametrize(
    "table", ["slabs", "plates", "disort_64", "walks", "semi_infinite", "rayleigh", "phases", "mie"]
)
def test_energies_are_those_of_outside_solvers(table: str) -> None:
    if table == "mie":
        pytest.importorskip("miepython")
    errors = {row.name: np.abs(row.errors()) for row in rows(table)}
    assert {name: error for name, error in errors.items() if error.max() > MOST} == {}
    assert np.concatenate([*errors.values()]).mean() < MEAN


@pytest.mark.parametrize("form", ["forward", "symmetric"])
@pytest.mark.parametrize(("part", "side", "bound"), [("reflected", 1, 0.012), ("transmitted_diffuse", -1, 0.045)])
def test_radiance_of_a_slab_is_that_of_van_de_hulst(form: str, part: str, side: int, bound: float) -> None:
    """Isotropic scattering: the same at all azimuths. The slab ends in an interface without a step of the index."""
    (known,) = KNOWN["radiance"]
    sigma_s = known["albedo"]
    slab = Medium(depth=known["depth"], sigma_s=sigma_s, sigma_a=1 - sigma_s, g=known["g"])
    material = Material.of(Stack([slab, Interface(eta=1.0, alpha=0)])).solid()
    body = solve.solve(material, named("velatura", form=form), variance_kind(material), Context())
    mu_0, mu = np.array(known[part]["mu0"]), known["mu"]
    for phi in (0.3, 1.2, 2.5):
        wi = np.sqrt(1 - mu_0 * mu_0), 0 * mu_0, mu_0
        wo = np.sqrt(1 - mu * mu) * np.cos(phi), np.sqrt(1 - mu * mu) * np.sin(phi), side * mu + 0 * mu_0
        value, _ = body.eval_pdf(wi, wo)
        assert np.pi * value[0] / mu == pytest.approx(np.array(known[part]["value"]), rel=bound)


@pytest.mark.parametrize("form", ["forward", "symmetric"])
def test_values_of_slabs_are_those_of_disort(form: str) -> None:
    """Bounds are those of `benchmarks/slabs.py`, where all cases are."""
    some = [case for case in slab_radiances.cases() if case.medium.depth == 1 and case.medium.sigma_s == 0.9]
    reflected = np.array([slab_radiances.errors(case, form)[0] for case in some])
    most = {"Rayleigh": 0.01, "g 0": 0.01, "g 0.5": 0.035, "g 0.8": 0.12, "g 0.9": 0.2}
    assert np.all(reflected < [most[case.name] for case in some])
    assert reflected.mean() < 0.05
