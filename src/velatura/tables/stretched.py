"""The albedo of anisotropic lobes as they are drawn: single reflections by a mirror of two roughnesses.

drawn                   over the cosine, the roughness in the plane of incidence and that across it
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx
from velatura.tables import coordinates
from velatura.tables.quadrature import Progress
from velatura.tables.store import Table, Tables

SHAPE = (32, 24, 24)
NORMALS = 1 << 13  # drawn for each point, evenly: an error of 3e-4
COS_MIN, ALPHA_MIN = 1e-3, 1e-4  # stand in for 0


def makers() -> dict[str, Callable[[Progress], Table]]:
    """What makes the table."""
    return {"drawn": _drawn}


def _drawn(progress: Progress) -> Table:
    cosines = np.maximum(coordinates.to_cosine(np.linspace(0, 1, SHAPE[0])), COS_MIN)
    alphas = [np.maximum(coordinates.to_roughness(np.linspace(0, 1, n)), ALPHA_MIN) for n in SHAPE[1:]]
    alpha_x, alpha_y = (axis.ravel()[:, None] for axis in np.meshgrid(*alphas, indexing="ij"))
    slices = []
    for i, cosine in enumerate(cosines):
        slices.append(albedo(np.asarray(cosine), alpha_x, alpha_y).reshape(SHAPE[1:]))
        progress((i + 1) / len(cosines))
    return Table(np.stack(slices)[..., None].astype(np.float32))


def albedo(cos_theta: np.ndarray, alpha_x: np.ndarray, alpha_y: np.ndarray, normals: int = NORMALS) -> np.ndarray:
    """Share of the light that a mirror's facets, met once, reflect upwards; a trailing axis of 1 is averaged over.

    The outgoing masking, averaged over visible normals.
    """
    # Spread numbers evenly over the square (Roberts 2018)
    i = np.arange(normals)
    u_1, u_2 = (0.5 + i * 0.7548776662466927) % 1, (0.5 + i * 0.5698402909980532) % 1
    wi = np.sqrt(1 - cos_theta**2), 0.0, cos_theta
    wo = ggx.reflect(wi, ggx.sample_visible(wi, alpha_x, alpha_y, u_1, u_2))
    return np.asarray(ggx.masking(wo, alpha_x, alpha_y)).mean(axis=-1)


def drawn_albedo(tables: Tables, cos_theta: Value, alpha_x: Value, alpha_y: Value) -> Value:
    """Albedo of a lobe of roughness alpha_x in the plane of incidence and alpha_y across it."""
    return ops.interpolate(
        tables.drawn,
        coordinates.from_cosine(cos_theta),
        coordinates.from_roughness(alpha_x),
        coordinates.from_roughness(alpha_y),
    )[0]
