"""The table of `velatura.tables.anisotropic_albedo`, integrated."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from velatura.optics import ggx
from velatura.renderer.low_discrepancy import square
from velatura.tables import coordinates
from velatura.tables.build.quadrature import ALPHA_MIN, COS_MIN, Progress
from velatura.tables.store import Table

SHAPE = (32, 24, 24)
NORMALS = 1 << 13  # drawn for each point, evenly: an error of 3e-4


def makers() -> dict[str, Callable[[Progress], Table]]:
    """The function that makes the table, by name."""
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
    u_1, u_2 = square(normals)
    wi = np.sqrt(1 - cos_theta**2), 0.0, cos_theta
    wo = ggx.reflect(wi, ggx.sample_visible(wi, alpha_x, alpha_y, u_1, u_2))
    return np.asarray(ggx.masking(wo, alpha_x, alpha_y)).mean(axis=-1)
