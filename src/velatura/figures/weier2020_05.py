"""Weier & Belcour 2020, figure 5: Schlick's Fresnel averaged over an anisotropic interface, fetched three ways.

Roughness (0, 0.5), as printed, in a white furnace, where a surface shows its directional albedo: that of the isotropic
interface of the lower roughness, that of the isotropic one for a stretched direction (Listing 1), and the truth by
quadrature over visible normals. The index, 1.5, is chosen here. Beside them stands what the other models fetch.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura.api import lobes
from velatura.figures import Progress, canvas
from velatura.figures.bounces import Array, uniform
from velatura.figures.disc import Direction, grid
from velatura.optics import fresnel, ggx
from velatura.stack import Interface, Stack

ETA, ALPHA = 1.5, (0.0, 0.5)
COLUMNS: dict[str, tuple[Any, str]] = {
    "isotropic": (min(ALPHA), "stretched"),
    "stretched": (ALPHA, "stretched"),
    "averaged": (ALPHA, "averaged"),
}
_SMOOTH = 1e-3  # what 0 is evaluated as


def compute(side: int = 41, count: int = 4096, progress: Progress | None = None) -> dict[str, Any]:
    """The `albedo` of `truth` and by fetch, over incidences on a grid over the disc; None outside and grazing.

    `error` is by fetch the root mean square and the largest difference from the truth.
    """
    x, y = (values.ravel() for values in grid(side))
    lit = x * x + y * y < 0.99
    x, y = x[lit], y[lit]
    wi = x, y, np.sqrt(1 - x * x - y * y)
    albedo = {"truth": averaged(wi, ETA, ALPHA, count)}
    for name, (alpha, fetch) in canvas.track(list(COLUMNS.items()), progress):
        albedo[name] = fetched(wi, ETA, alpha, fetch)
    error = {name: albedo[name] - albedo["truth"] for name in COLUMNS}
    return {
        "albedo": {name: _spread(values, lit, side) for name, values in albedo.items()},
        "error": {name: [float(np.sqrt(np.mean(e**2))), float(np.abs(e).max())] for name, e in error.items()},
    }


def fetched(wi: Direction, eta: float, alpha: Any, fetch: str) -> Array:
    """Schlick's Fresnel averaged over an interface, as a model fetches it, for N directions (N,)."""
    x, y, z = wi
    choices = {"reflectance": "split-sum", "tir": "off", "fetch": fetch}
    modelled = lobes(Stack([Interface(eta=eta, alpha=alpha)]), z, np.arctan2(y, x), model="weier2020", **choices)
    return np.asarray(modelled.energy[0][0])


def averaged(wi: Direction, eta: float, alpha: tuple[float, float], count: int) -> Array:
    """The same by quadrature over `count` visible normals, times the masking of what is reflected."""
    u1, u2 = uniform(count)[:2, None]
    u, v = (max(a, _SMOOTH) for a in alpha)
    wi = tuple(component[:, None] for component in wi)
    h = ggx.sample_visible(wi, u, v, u1, u2)
    f = fresnel.schlick(np.minimum(ggx.dot(wi, h), 1), fresnel.normal_incidence(eta))
    return np.asarray(np.mean(f * ggx.masking(ggx.reflect(wi, h), u, v), axis=1))


def _spread(values: Array, lit: Any, side: int) -> list[list[float | None]]:
    whole = np.full(side * side, np.nan)
    whole[lit] = values
    return [[float(a) if np.isfinite(a) else None for a in row] for row in whole.reshape(side, side)]


@canvas.page(13, 3.6)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The albedos over the disc of incidences, the rougher axis upwards."""
    row = figure.subplots(1, len(numbers["albedo"]))
    for axes, (name, albedo) in zip(row, numbers["albedo"].items()):
        image = np.array(albedo, float).T
        drawn = axes.imshow(image, origin="lower", extent=(-1, 1, -1, 1), cmap="viridis", vmin=0, vmax=0.4)
        error = numbers["error"].get(name)
        axes.set_title(f"{name}: error {error[0]:.3f}" if error else name, fontsize="medium")
        axes.set(xticks=(-1, 0, 1), yticks=(-1, 0, 1), xlabel="x of incidence", ylabel="y, along the rougher axis")
    figure.colorbar(drawn, ax=row, shrink=0.8, label="albedo")
