"""Klems matrices, read by Radiance's own library."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import velatura as vt
from velatura import kernel
from velatura.exports import klems
from velatura.exports.klems import COUNTS, EDGES, FIRST, RINGS, SOLID_ANGLES, sides
from velatura.stack.spectra import LUMINANCE

pytestmark = pytest.mark.usefixtures("one_thread")

Run = Callable[..., tuple[int, str, str]]

PANE = vt.Stack(
    [vt.Interface(eta=1.5, alpha=(0.05, 0.4), rotation=30), vt.Medium(sigma_a=0.2), vt.Interface(eta=1, alpha=0.1)],
    name="</Name> & <b>",
)
REFLECTED, PASSED = 5, 6  # what Radiance is asked for, of light that is not diffuse
NODES = 16  # angles of a ring over which energies are averaged


@pytest.fixture(scope="module")
def pane(tmp_path_factory: pytest.TempPathFactory) -> Any:
    radiance = pytest.importorskip("pyradiance.bsdf")
    path = tmp_path_factory.mktemp("klems") / "pane.xml"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(klems, "SAMPLES", 2**12)
        vt.export(PANE, "bsdf-xml").save(path)
    return radiance, radiance.load_file(str(path))


def vectors(ring: int, patch: int, up: int, travels: bool) -> NDArray[np.float64]:
    """Directions of a patch in the frame of Radiance, (3, N), even in projection: to the light where it travels."""
    rng = np.random.default_rng([ring, patch, up + 1, travels])
    sine = np.sqrt(rng.uniform(EDGES[ring], EDGES[ring + 1], 100_000))
    phi = 2 * np.pi * (patch + rng.uniform(-0.5, 0.5, len(sine))) / COUNTS[ring] + np.pi * travels
    return np.array([sine * np.cos(phi), sine * np.sin(phi), up * np.sqrt(1 - sine**2)])


def angles(ring: int, patch: int, up: int, travels: bool) -> tuple[float, float]:
    theta = float(RINGS[ring].theta)
    return theta if up > 0 else 180 - theta, 360.0 * patch / float(COUNTS[ring]) + 180.0 * travels


@pytest.mark.parametrize(
    ("side", "fallen", "left", "passes"),
    [(-1, (4, 5), (4, 5), True), (-1, (4, 5), (4, 4), True), (-1, (7, 3), (7, 3), False), (1, (3, 2), (3, 1), True)],
)
def test_radiance_reads_the_bsdf_of_the_plugin(
    pane: Any, side: int, fallen: tuple[int, int], left: tuple[int, int], passes: bool
) -> None:
    """Expected: the mean of the plugin's values between directions of both patches; light from the front comes from
    below in Radiance, whose frame is ours turned about the bitangent. Noise of an entry: .06 of it at most."""
    radiance, read = pane
    up = -side if passes else side
    found = radiance.query(read, *angles(*left, up, False), *angles(*fallen, side, True))
    mi, turned = kernel.mitsuba(), np.array([[-1.0], [1.0], [-1.0]])
    si, wo = mi.SurfaceInteraction3f(), turned * vectors(*left, up, False)
    si.wi = mi.Vector3f(turned * vectors(*fallen, side, True))
    value = vt.bsdf(PANE).eval(mi.BSDFContext(mi.TransportMode.Importance), si, mi.Vector3f(wo))
    expected = (LUMINANCE @ np.array(value) / np.abs(wo[2])).mean()
    assert float(np.ravel(found)[1]) == pytest.approx(expected, rel=0.2)


def test_radiance_finds_the_energies_of_the_lobes(pane: Any) -> None:
    """Expected: what is reflected and passes, averaged over the angles of a ring at one azimuth, within noise."""
    radiance, read = pane
    for n in (0, 4, 7):
        squared = EDGES[n] + (np.arange(NODES) + 0.5) / NODES * (EDGES[n + 1] - EDGES[n])
        azimuths = 2 * np.pi * (np.linspace(-0.5, 0.5, 4, endpoint=False) + 1 / 8) / COUNTS[n]
        found = [vt.lobes(PANE, np.sqrt(1 - squared), -phi) for phi in azimuths]
        reflected = np.mean([LUMINANCE @ (sum(each.energy) + each.remainder) for each in found])
        passed = np.mean([LUMINANCE @ each.passed for each in found])
        theta, phi = angles(n, 0, -1, True)
        assert radiance.direct_hemi(read, theta, phi, REFLECTED) == pytest.approx(reflected, abs=6e-3)
        assert radiance.direct_hemi(read, theta, phi, PASSED) == pytest.approx(passed, abs=6e-3)


def test_mirrors_lie_on_the_diagonal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: what a smooth pane passes and reflects leaves in the patch of the same name."""
    monkeypatch.setattr(klems, "SAMPLES", 2**8)
    smooth = vt.Stack([vt.Interface(eta=1.5), vt.Interface(eta=1)])
    for passed, reflected in (sides(vt.bsdf(smooth), side) for side in (1, -1)):
        for each in (passed, reflected):
            light = each * SOLID_ANGLES[:, None]
            inner = slice(0, FIRST[-1])
            assert light.diagonal()[inner].sum() > 0.95 * light[:, inner].sum()


def test_a_matrix_is_refused_where_there_are_textures(run: Run, tmp_path: Path) -> None:
    status, _, err = run("export", "dusty-varnish", "--to", "bsdf-xml", "-o", str(tmp_path / "a.xml"))
    assert status == 2 and "part0_weight: a matrix is of one point, and has no textures" in err
