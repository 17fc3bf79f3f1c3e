"""Lobes of one rough interface as densities over the projected disc, without Fresnel, scaled to 1 at their highest."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura.optics import ggx, refraction

Array = NDArray[np.floating]
Direction = ggx.Direction


class Ellipse(NamedTuple):
    """Standard deviations along the axes of a spot, and the turn of the longer one from y, in degrees [-90, 90)."""

    long: float
    short: float
    turn: float

    @property
    def aspect(self) -> float:
        return self.long / self.short

    @property
    def size(self) -> float:
        """The mean radius."""
        return float(np.sqrt(self.long * self.short))


def incidence(theta: float, phi: float = 0.0) -> Direction:
    """The direction of a zenith angle and an azimuth in degrees."""
    t, p = np.radians(theta), np.radians(phi)
    return np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)


def grid(count: int) -> tuple[Array, Array]:
    """Coordinates x and y (count, count), x along the first axis, of points spread over the square around the disc."""
    ticks = (np.arange(count) + 0.5) * 2 / count - 1
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    return x, y


def normals(x: Array, y: Array, alpha_u: float, alpha_v: float) -> Array:
    """The distribution of normals, D cos over the disc's own cosine."""
    return _scaled(x, y, ggx.ndf((x, y, _height(x, y)), alpha_u, alpha_v))


def reflected(wi: Direction, x: Array, y: Array, alpha_u: float, alpha_v: float) -> Array:
    """Radiance that a rough mirror reflects to the points of the disc."""
    return _lobe(wi, (x, y, _height(x, y)), alpha_u, alpha_v, 1.0)


def refracted(wi: Direction, x: Array, y: Array, alpha_u: float, alpha_v: float, eta: float) -> Array:
    """Radiance that a rough interface of relative index eta transmits to the points of the disc below."""
    return _lobe(wi, (x, y, -_height(x, y)), alpha_u, alpha_v, eta)


def ellipse(x: Array, y: Array, lobe: Array, level: float = 0.5) -> Ellipse:
    """The spot where a lobe is at least so high, by its second moments."""
    points = np.stack([x[lobe >= level], y[lobe >= level]])
    values, vectors = np.linalg.eigh(np.cov(points))
    angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
    short, long = (float(np.sqrt(v)) for v in values)
    return Ellipse(long, short, float(angle % 180 - 90))


def show(axes: Any, lobe: Any, title: str) -> None:
    """A lobe on a whole grid, with the outline of the disc."""
    turn = np.linspace(0, 2 * np.pi, 200)
    axes.imshow(np.transpose(lobe), origin="lower", extent=(-1, 1, -1, 1), cmap="Blues")
    axes.plot(np.cos(turn), np.sin(turn), color="0.5", linewidth=1)
    axes.set(aspect="equal", xticks=(), yticks=())
    axes.set_title(title, fontsize="medium")


def _height(x: Array, y: Array) -> Array:
    return np.sqrt(np.maximum(1 - x * x - y * y, 0))


def _lobe(wi: Direction, wo: Direction, alpha_u: float, alpha_v: float, eta: float) -> Array:
    h = refraction.half_vector(wi, wo, eta)
    cos_i, cos_o, height = ggx.dot(wi, h), ggx.dot(wo, h), np.abs(wo[2])
    seen = (cos_i > 0) & (cos_o * wo[2] > 0)
    visible = ggx.ndf(h, alpha_u, alpha_v) * ggx.masking((wo[0], wo[1], height), alpha_u, alpha_v)
    density = visible * cos_i * refraction.jacobian(cos_i, cos_o, eta) / np.maximum(height, 1e-6)
    return _scaled(wo[0], wo[1], np.where(seen, density, 0.0))


def _scaled(x: Array, y: Array, density: Array) -> Array:
    density = np.where(x * x + y * y < 1, density, 0.0)
    return np.asarray(density / density.max())
