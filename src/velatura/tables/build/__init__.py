"""Integrate the averages of Fresnel over GGX interfaces and compress them.

Of single reflections (`single_scattering`):

    dielectric              U at 8 angles, for relative indices above 1
    conductor               U at 12 angles, for kappa >= eta, and for eta >= 1 with any kappa
    inside                  mean Fresnel of dielectrics of relative index below 1
    absorbing_inside        the same for kappa < eta < 1, as U at 9 angles that follow the critical angle
    tir_published           mean of 1 - F(cos_theta_o) for relative indices below 1 (Belcour 2018, 5.1, as released)
    tir_published_outside   its U at 8 angles, for relative indices above 1
    tir_clean               energy fraction reflected within the critical cone

Of light that may bounce between the facets (`multiple_scattering`), as U at angles where Fresnel is raised to powers:

    dielectric_multi        14 channels, for relative indices above 1
    conductor_multi         18 channels, for the same metals as `conductor`
    absorbing_inside_multi  12 channels, for kappa < eta < 1
    inside_multi            the energy itself, of dielectrics of relative index below 1

Of diffuse light, by parts in a few directions (`velatura.tables.diffuse_nodes`, `diffuse_matrices`):

    entering, returning     what the first interface lets in, and sends back from below
    passing, staying        what others let through, and send back
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

from velatura.tables.build import diffuse_matrices, multiple_scattering, single_scattering
from velatura.tables.build.quadrature import Progress, ignore
from velatura.tables.store import Table, Tables


@dataclass(frozen=True)
class Built:
    """The tables and the seconds that each took."""

    tables: Tables
    seconds: dict[str, float]


def build(progress: Progress = ignore) -> Built:
    """All tables from nothing; deterministic."""
    tables: dict[str, Table] = {}
    seconds: dict[str, float] = {}
    todo = makers()

    def advance(share_of_one: float) -> None:
        progress((len(tables) + share_of_one) / len(todo))

    for name, make in todo.items():
        start = perf_counter()
        tables[name] = make(advance)
        seconds[name] = perf_counter() - start
        advance(0.0)
    return Built(Tables(**tables), seconds)


def makers() -> dict[str, Callable[[Progress], Table]]:
    """The functions that make the tables, by name."""
    parts = single_scattering, multiple_scattering, diffuse_matrices
    return {name: make for part in parts for name, make in part.makers().items()}
