"""A material as a measurement: tensors that Mitsuba's plugin `measured` loads, without this package.

Dupuy & Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering": f cos theta_o is
tabulated over uniform numbers, which a density of half-vectors warps, for each direction of incidence.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.exports.request import Export, Request, origin
from velatura.stack.spectra import LUMINANCE

Array = NDArray[np.floating]

STEEPEST = 89.5  # degrees of incidence
FINE = 256  # angles of incidence of what values are divided by
NOTHING = 1e-12  # so that a density is above 0 where there is no light
EVENNESS = 0.35  # power of densities: below 1, so that values between a sharp lobe and a wide one have nodes as well
FLOOR = 0.01  # of a mean density, beside it, so that the warp has an inverse everywhere
DIMMEST = 1e-9  # of the brightest value that others are divided by
LOWEST, TINY = 0.05, 1e-6  # cosine of directions for which the loss is measured, and light that is none
TRIED = 20_000  # directions for which the loss is measured


class Grid(NamedTuple):
    """Numbers of angles of incidence, of azimuths over half a turn, and of nodes along axes of densities and values."""

    angles: int
    azimuths: int
    density: int
    values: int


ROUND, BRUSHED = Grid(40, 1, 128, 64), Grid(20, 17, 64, 48)


class Tables(NamedTuple):
    """Arrays of a file, over P azimuths and T angles of incidence."""

    theta_i: Array
    phi_i: Array
    ndf: Array
    sigma: Array
    vndf: Array
    luminance: Array
    rgb: Array


def write(request: Request) -> Export:
    """The file, and in notes what it leaves out and how far it is from the plugin `layered`.

    Raises:
        InvalidInput: as `Request.bsdf`.
    """
    with kernel.exclusive:
        drawn = _Drawn(request.bsdf("a measurement"))
        tables = tabulated(drawn)
        # Mitsuba writes and reads a file by its name
        with tempfile.TemporaryDirectory(prefix="velatura-") as folder:
            path = Path(folder, "written.bsdf")
            description = f"{request.material.name or 'a layered material'}; {origin()}".encode()
            fields = {name: np.ascontiguousarray(each, np.float32) for name, each in tables._asdict().items()}
            with contextlib.redirect_stdout(io.StringIO()):  # it says what it wrote
                drawn.mi.tensor_io.write(
                    str(path),
                    description=np.frombuffer(description, np.uint8),
                    jacobian=np.array([1], np.uint8),
                    **fields,
                )
            return Export("", data=path.read_bytes(), notes=_notes(drawn, str(path)))


class _Drawn:
    """A BSDF of the plugin, evaluated from above."""

    def __init__(self, bsdf: Any) -> None:
        self.bsdf, self.mi = bsdf, kernel.mitsuba()

    def eval(self, wi: Array, wo: Array) -> Array:
        """f cos theta_o of directions (3, ...)."""
        si = self.mi.SurfaceInteraction3f()
        si.wi = self.mi.Vector3f(wi.reshape(3, -1))
        value = self.bsdf.eval(self.mi.BSDFContext(), si, self.mi.Vector3f(wo.reshape(3, -1)))
        return np.array(value).reshape(wo.shape)

    @property
    def brushed(self) -> bool:
        """Whether its light follows the tangent."""
        return bool(self.mi.has_flag(self.bsdf.flags(), self.mi.BSDFFlags.Anisotropic))


def tabulated(drawn: _Drawn) -> Tables:
    """The arrays of a BSDF."""
    mi, grid = drawn.mi, BRUSHED if drawn.brushed else ROUND
    theta_i = np.radians(STEEPEST) * np.sin(np.linspace(0, np.pi / 2, grid.angles))
    phi_i = np.linspace(-np.pi, 0, grid.azimuths) if drawn.brushed else np.zeros(1)  # the rest is turned
    u, s = np.linspace(0, 1, grid.density), np.linspace(0, 1, grid.values)
    half, samples = (np.array([x.ravel() for x in np.meshgrid(axis, axis)]) for axis in (u, s))  # the tilt runs first

    # Values along the normal and in the mirror direction take most of the shape, and a density the rest of it
    along, _ = _reflected(drawn, np.zeros(1), 0.0, half)
    along = along / np.maximum(np.cos(np.pi * half[0] ** 2), LOWEST)  # without the cosine, which ends at the horizon
    shape = np.maximum(along, DIMMEST * along.max()).reshape(1, grid.density, grid.density)
    seen = half[0] < np.sqrt(0.5) - 0.5 / grid.density  # half-vectors of directions above the surface
    shape = _continued(shape, seen.reshape(shape.shape[1:]))[0]
    shape_at = mi.MarginalContinuous2D0(np.ascontiguousarray(shape, np.float32), [], False, False)
    growth = _growth(drawn)
    steps = np.interp(theta_i, *growth)[:, None]

    densities = []
    for phi in phi_i:
        light, area = _reflected(drawn, theta_i, phi, half)
        even = (light * area) ** EVENNESS
        densities.append(even + FLOOR * even.mean(axis=-1, keepdims=True) + NOTHING)
    vndf = np.reshape(densities, (len(phi_i), grid.angles, grid.density, grid.density)).astype(np.float32)
    warp = mi.MarginalContinuous2D2(vndf, [phi_i.tolist(), theta_i.tolist()])

    rgb, luminance = [], []
    for phi in phi_i:
        where = np.array([np.full(samples.shape[1] * grid.angles, phi), np.repeat(theta_i, samples.shape[1])])
        warped, density = warp.sample(mi.Point2f(np.tile(samples, grid.angles)), mi.Vector2f(where))
        turned = np.array(warped).reshape(2, grid.angles, -1)
        scale = np.array(shape_at.eval(warped)).reshape(grid.angles, -1) * steps
        wi, wo, area = _directions(theta_i, phi, turned, drawn.brushed)
        above = wo[2] > 0
        value = drawn.eval(wi, np.where(above, wo, np.array([0, 0, 1])[:, None, None])) / scale
        value = value.swapaxes(0, 1).reshape(grid.angles, 3, grid.values, grid.values)
        known = above.reshape(grid.angles, grid.values, grid.values)
        value = np.array([_continued(*each) for each in zip(value, known)])
        light = np.einsum("c,tcij->tij", LUMINANCE, value).reshape(scale.shape) * scale * area
        light /= np.array(density).reshape(scale.shape)
        rgb.append(value)
        luminance.append(light + FLOOR * light.mean(axis=-1, keepdims=True) + NOTHING)
    bright = np.reshape(luminance, (len(phi_i), grid.angles, grid.values, grid.values))
    return Tables(theta_i, phi_i, shape, np.tile(0.25 / growth[1], (2, 1)), vndf, bright, np.array(rgb))


def _growth(drawn: _Drawn) -> tuple[Array, Array]:
    """Angles of incidence, and the light in the mirror direction over that along the normal, which values leave out."""
    theta = np.linspace(0, 1, FINE) ** 2 * np.pi / 2  # as the file has them
    lit = np.minimum(theta, np.radians(STEEPEST))
    wi, wo = (np.array([side * np.sin(lit), 0 * lit, np.cos(lit)]) for side in (1, -1))
    light = np.tensordot(LUMINANCE, drawn.eval(wi, wo), 1)
    return theta, np.maximum(light / light[0], NOTHING)


def _reflected(drawn: _Drawn, theta: Array, phi: float, half: Array) -> tuple[Array, Array]:
    """Luminance of what is reflected about half-vectors (2, N), and the solid angle of `half`'s square: (T, N)."""
    half = np.broadcast_to(half[:, None], (2, len(theta), half.shape[1]))
    wi, wo, area = _directions(theta, phi, half, drawn.brushed)
    light = np.tensordot(LUMINANCE, drawn.eval(wi, wo), 1)
    return np.where(wo[2] > 0, light, 0.0), area


def _directions(theta: Array, phi: float, half: Array, brushed: bool) -> tuple[Array, Array, Array]:
    """wi and wo (3, T, N), and the solid angle of wo beside that of `half` (T, N): tilts and azimuths of half-vectors
    (2, T, N) in 0 to 1, for angles of incidence (T,).

    The azimuth counts from that of wi unless the material is brushed (Dupuy & Jakob 2018, section 5).
    """
    tilt, turn = half[0] ** 2 * np.pi / 2, (2 * half[1] - 1) * np.pi + (0.0 if brushed else phi)
    h = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
    wi = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])[..., None]
    cosine = np.sum(wi * h, axis=0)
    area = np.maximum(4 * np.abs(cosine) * np.sin(tilt) * half[0], 1e-9)
    return np.broadcast_to(wi, h.shape), 2 * cosine * h - wi, area


def _continued(value: Array, known: NDArray[np.bool_]) -> Array:
    """Values (C, H, W), where they are not known those of the nearest place."""
    from scipy.ndimage import distance_transform_edt

    if known.all() or not known.any():
        return value
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return value[:, nearest[0], nearest[1]]


def _notes(drawn: _Drawn, path: str) -> tuple[str, ...]:
    """How far Mitsuba's plugin with the file is from ours, and what is left out."""
    mi, context = drawn.mi, drawn.mi.BSDFContext()
    rng = np.random.default_rng(0)
    si = mi.SurfaceInteraction3f()
    cosine, turn = rng.uniform(LOWEST, 1, TRIED), rng.uniform(0, 2 * np.pi, TRIED)
    sine = np.sqrt(1 - cosine**2)
    si.wi = mi.Vector3f(np.array([sine * np.cos(turn), sine * np.sin(turn), cosine]))
    u = rng.uniform(0, 1, (3, TRIED))
    drawn_there, weight = drawn.bsdf.sample(context, si, mi.Float(u[0]), mi.Point2f(u[1:]))
    smooth = np.array(mi.has_flag(drawn_there.sampled_type, mi.BSDFFlags.Delta))
    below = np.array(drawn_there.wo.z) < 0
    density = np.array(drawn_there.pdf)
    density[density <= 0] = np.inf
    own = drawn.bsdf.eval(context, si, drawn_there.wo)
    theirs = mi.load_dict({"type": "measured", "filename": path}).eval(context, si, drawn_there.wo)
    one, other = (np.where(below | smooth, 0, np.array(each) / density).mean(axis=0) for each in (own, theirs))
    variation, albedo = np.abs(other - one).mean() / 2 / max(one.mean(), TINY), abs((other - one).mean())
    notes = [
        f"Mitsuba's measured differs from layered by {_share(variation)} of reflected light in total variation, and "
        f"by {_share(albedo)} of all light in albedo."
    ]
    weight = np.array(weight).mean(axis=0)
    for left, what in ((below, "passes"), (smooth & ~below, "perfectly smooth interfaces reflect")):
        light = np.where(left, weight, 0).mean()
        if light > TINY:
            notes.append(f"What {what} is left out, {_share(light)} of all light.")
    return tuple(notes)


def _share(x: float) -> str:
    return f"{100 * x:.2g} %"
