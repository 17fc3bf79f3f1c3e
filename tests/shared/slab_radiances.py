"""Values of slabs without a step of the index, as PythonicDISORT 1.8 (MIT) with 64 streams has them.

`slab_radiances.npz` holds by case the asymmetry (NaN: Rayleigh's phase function), depth, albedo and cosine of
incidence, and f, reflected and passed, at the cosines `MU` and azimuths `PHI` from the way that light travels.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import velatura as vt
from velatura.model import named
from velatura.model.context import Context
from velatura.model.solved import solve
from velatura.model.solved.bsdf import Solved
from velatura.model.variance import variance_kind
from velatura.stack import Material

Array = NDArray[np.floating]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
MU, PHI = 0.5 * NODES + 0.5, (np.arange(6) + 0.5) * np.pi / 6
COSINES = np.broadcast_to((MU * WEIGHTS)[:, None], (8, 6))


@dataclass(frozen=True)
class Case:
    """A slab, and its values for light from one cosine, (8, 6)."""

    name: str
    medium: vt.Medium
    mu_0: float
    reflected: Array
    passed: Array


@functools.cache
def cases() -> list[Case]:
    """All of them."""
    with np.load(Path(__file__).with_suffix(".npz")) as file:
        columns = [file[name].astype(float) for name in ("g", "depth", "albedo", "mu_0", "reflected", "passed")]
    found = []
    for g, depth, albedo, mu_0, reflected, passed in zip(*(np.round(x, 6) for x in columns)):
        phase = {"phase": "rayleigh"} if np.isnan(g) else {"g": float(g)}
        medium = vt.Medium(depth=depth, sigma_s=albedo, sigma_a=round(1 - albedo, 6), **phase)
        name = "Rayleigh" if np.isnan(g) else f"g {g:g}"
        found.append(Case(name, medium, float(mu_0), reflected, passed))
    return found


@functools.lru_cache(256)
def _body(medium: vt.Medium, form: str) -> Solved:
    material = Material.of(vt.Stack([medium, vt.Interface(eta=1.0)])).solid()
    return solve.solve(material, named("velatura", form=form), variance_kind(material), Context())


def errors(case: Case, form: str) -> tuple[float, float]:
    """Cosine-weighted errors of the default model over the light, reflected and passed."""
    z, phi = (x.ravel() for x in np.meshgrid(MU, PHI, indexing="ij"))
    sine, one = np.sqrt(1 - z * z), np.ones_like(z)
    wi = np.sqrt(1 - case.mu_0**2) * one, 0 * one, case.mu_0 * one
    body = _body(case.medium, form)

    def error(side: float, truth: Array) -> float:
        wo = -sine * np.cos(phi), sine * np.sin(phi), side * z
        value = body.eval_pdf(wi, wo)[0][0].reshape(truth.shape) / MU[:, None]
        return float(np.sum(COSINES * np.abs(value - truth)) / np.sum(COSINES * truth))

    return error(1.0, case.reflected), error(-1.0, case.passed)
