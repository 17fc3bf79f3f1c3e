"""Media over diffuse bases without an interface, as chalk, dust and matt paint: statistics, plugin and walk agree."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from fuzzing.stacks import in_range
from numpy.typing import NDArray

import velatura as vt
from velatura import kernel
from velatura.renderer.packets import aligned

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

COSINES = np.array([1.0, 0.6, 0.2])
BOUND = 0.005  # of the incident light
PATHS = 300_000
NODES = 48


def matt(seed: int) -> vt.Stack:
    """A random stack without interfaces that scatters."""
    rng = np.random.default_rng((5, seed))
    while True:
        stack = in_range(rng)
        if not stack.interfaces:
            return stack


def reflected(bsdf: Any, cos_theta: float) -> NDArray[np.float64]:
    """Albedo (3,) by a midpoint rule over squared cosines and azimuths."""
    squares, phi = (np.ravel(x) for x in np.meshgrid(np.arange(NODES) + 0.5, np.arange(2 * NODES) + 0.5))
    cosine, phi = np.sqrt(squares / NODES), phi * np.pi / NODES
    sine = np.sqrt(1 - cosine * cosine)
    si = dr.zeros(mi.SurfaceInteraction3f, len(phi))
    si.wi = mi.Vector3f(math.sqrt(1 - cos_theta * cos_theta), 0.0, cos_theta)
    dr.make_opaque(si.wi)  # one kernel for all angles
    wo = mi.Vector3f(*(mi.Float(aligned(x)) for x in (sine * np.cos(phi), sine * np.sin(phi), cosine)))
    value = np.array(bsdf.eval(mi.BSDFContext(), si, wo))
    return np.asarray(np.pi * (value / cosine).mean(axis=1))


@pytest.mark.parametrize("seed", range(4))
def test_energies_are_those_of_the_walk(seed: int) -> None:
    """Of both forms; a walk's standard error is below .001, a fifth of the bound."""
    stack = matt(seed)
    lobes = vt.lobes(stack, COSINES)
    walk = vt.reference.statistics(stack, COSINES, paths=PATHS, seed=seed)
    assert lobes.energy == [] and len(walk.energy) == 1
    assert lobes.remainder == pytest.approx(walk.energy[0], abs=BOUND)
    for form in ("forward", "symmetric"):
        bsdf = vt.bsdf(stack, form=form)
        found = np.array([reflected(bsdf, float(cosine)) for cosine in COSINES]).T
        assert found == pytest.approx(lobes.remainder, abs=BOUND)


@pytest.mark.parametrize("seed", range(2))
def test_laws_hold(seed: int) -> None:
    """False alarms 1 in 1000 reports."""
    assert vt.check(matt(seed)).broken == ()
