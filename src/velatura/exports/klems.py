"""A material as matrices between patches of directions: XML as WINDOW and Radiance read it (Klems 1994).

A column is light that falls in from a patch, a row light that leaves in one: the mean BSDF between both, so that sums
over a column by the projected solid angles of rows are energies.

Their frame is that of Radiance, in which light from the front travels along +z: ours, turned by half a turn about the
bitangent. A patch of light that falls in is named by the azimuth in which it travels, so that what a smooth pane passes
and what it mirrors lie on the diagonal.
"""

from __future__ import annotations

from typing import Any, NamedTuple
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.exports.request import Export, Request, origin
from velatura.stack.spectra import LUMINANCE

Array = NDArray[np.floating]


class Ring(NamedTuple):
    """Patches of equal azimuths between two angles from the normal, in degrees; `theta` names the ring."""

    theta: float
    low: float
    high: float
    patches: int


#: The basis "LBNL/Klems Full": 145 patches.
RINGS = tuple(
    Ring(theta, low, high, patches)
    for theta, low, high, patches in (
        (0, 0, 5, 1),
        (10, 5, 15, 8),
        (20, 15, 25, 16),
        (30, 25, 35, 20),
        (40, 35, 45, 24),
        (50, 45, 55, 24),
        (60, 55, 65, 24),
        (70, 65, 75, 16),
        (82.5, 75, 90, 12),
    )
)
COUNTS = np.array([ring.patches for ring in RINGS])
PATCHES, FIRST = int(COUNTS.sum()), np.cumsum(COUNTS) - COUNTS  # in all, and of each ring
EDGES = np.sin(np.radians([0, *(ring.high for ring in RINGS)])) ** 2  # squared sines
SOLID_ANGLES = np.repeat(np.pi * np.diff(EDGES) / COUNTS, COUNTS)  # projected, of each patch
SAMPLES = 2**15  # directions drawn for light from each patch


def write(request: Request) -> Export:
    """Matrices of light from the front and from the back, reflected and passed.

    Raises:
        InvalidInput: as `Request.bsdf`.
    """
    with kernel.exclusive:
        bsdf, mi = request.bsdf("a matrix"), kernel.mitsuba()
        both = bool(mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide))
        blocks = {}
        for side, name in ((1, "Front"), (-1, "Back")):
            passed, reflected = sides(bsdf, side) if both or side > 0 else np.zeros((2, PATCHES, PATCHES))
            blocks[f"Transmission {name}"], blocks[f"Reflection {name}"] = passed, reflected
    return Export(_text(request.material.name or "layered material", blocks))


def sides(bsdf: Any, side: int) -> tuple[Array, Array]:
    """Mean BSDF of what passes and of what is reflected of light from a side (1: front, -1: back): (145, 145)."""
    from scipy.stats import qmc

    mi = kernel.mitsuba()
    context = mi.BSDFContext(mi.TransportMode.Importance)
    u = qmc.Sobol(5, seed=0).random(SAMPLES).T
    found = np.zeros((2, PATCHES, PATCHES))
    for n, ring in enumerate(RINGS):
        sine = np.tile(np.sqrt(EDGES[n] + u[0] * (EDGES[n + 1] - EDGES[n])), ring.patches)
        which = np.repeat(np.arange(ring.patches), SAMPLES)
        phi = 2 * np.pi * (which + np.tile(u[1], ring.patches) - 0.5) / ring.patches
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(np.array([sine * np.cos(phi), -sine * np.sin(phi), side * np.sqrt(1 - sine**2)]))
        drawn = mi.Float(np.tile(u[2], ring.patches)), mi.Point2f(np.tile(u[3:], ring.patches))
        bs, weight = bsdf.sample(context, si, *drawn)
        wo, light = np.array(bs.wo), LUMINANCE @ np.array(weight)
        seen = np.isfinite(light) & (light > 0)
        at = (wo[2] * side > 0).astype(int)[seen], patch(wo)[seen], FIRST[n] + which[seen]
        np.add.at(found, at, light[seen] / SAMPLES)
    return found[0] / SOLID_ANGLES[:, None], found[1] / SOLID_ANGLES[:, None]


def patch(w: Array) -> NDArray[np.intp]:
    """The patches (N,) that hold directions (3, N) in which light leaves, of either side."""
    ring = np.clip(np.searchsorted(EDGES, np.minimum(w[0] ** 2 + w[1] ** 2, 1), "right") - 1, 0, len(RINGS) - 1)
    turn = np.arctan2(w[1], -w[0]) / (2 * np.pi)
    return np.asarray(FIRST[ring] + np.round(turn * COUNTS[ring]).astype(int) % COUNTS[ring])


def _text(name: str, blocks: dict[str, Array]) -> str:
    basis = "".join(
        f"<AngleBasisBlock><Theta>{ring.theta:g}</Theta><nPhis>{ring.patches}</nPhis>"
        f"<ThetaBounds><LowerTheta>{ring.low:g}</LowerTheta><UpperTheta>{ring.high:g}</UpperTheta></ThetaBounds></AngleBasisBlock>\n"
        for ring in RINGS
    )
    data = "".join(_block(direction, values) for direction, values in blocks.items())
    return f"""\
<?xml version="1.0" encoding="UTF-8"?>
<!-- {origin()} -->
<WindowElement xmlns="http://windows.lbl.gov" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
<Material><Name>{escape(name)}</Name><Manufacturer>Velatura</Manufacturer><DeviceType>Other</DeviceType></Material>
<DataDefinition>
<IncidentDataStructure>Columns</IncidentDataStructure>
<AngleBasis><AngleBasisName>LBNL/Klems Full</AngleBasisName>
{basis}</AngleBasis>
</DataDefinition>
{data}</Layer>
</Optical>
</WindowElement>
"""


def _block(direction: str, values: Array) -> str:
    kind = "BTDF" if direction.startswith("Transmission") else "BRDF"
    rows = "\n".join(",".join(f"{value:.6g}" for value in row) for row in values)
    return f"""\
<WavelengthData>
<LayerNumber>System</LayerNumber>
<Wavelength unit="Integral">Visible</Wavelength>
<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>
<DetectorSpectrum>ASTM E308 1931 Y.dsp</DetectorSpectrum>
<WavelengthDataBlock>
<WavelengthDataDirection>{direction}</WavelengthDataDirection>
<ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis>
<RowAngleBasis>LBNL/Klems Full</RowAngleBasis>
<ScatteringDataType>{kind}</ScatteringDataType>
<ScatteringData>
{rows}
</ScatteringData>
</WavelengthDataBlock>
</WavelengthData>
"""
