"""Metals by their colours: the index that gives a reflectance at the normal, and one towards the edge or a tint."""

from __future__ import annotations

import numpy as np

from velatura.optics import fresnel
from velatura.programs.values import Array

BRIGHT = 0.7  # metals that reflect more have k above n
MOST = 1 - 2e-3  # reflectance at the normal of which indices are sought


def of_edge(reflectance: Array, edge: Array) -> tuple[Array, Array]:
    """Index n + i k relative to the medium above, by its reflectances at the normal and at the cosine `fresnel.EDGE`.

    For a given reflectance at the normal, that at the edge falls as n grows, from the smallest n to where k is 0, or n
    for what is brighter than `BRIGHT`. What lies beyond takes the nearest.
    """
    r, edge = np.broadcast_arrays(np.clip(reflectance, 0, MOST), edge)
    least, most = _ends(r)
    equal = (1 + r + np.sqrt(np.maximum(6 * r - 1 - r * r, 0))) / (2 * (1 - r))  # to k (Bati et al. 2021, Eq. 9)
    most = np.where(r > BRIGHT, equal, most)
    for _ in range(60):
        n = 0.5 * (least + most)
        brighter = np.asarray(fresnel.conductor(fresnel.EDGE, n, _extinction(r, n))) > edge
        least, most = np.where(brighter, n, least), np.where(brighter, most, n)
    return n, _extinction(r, n)


def of_f82_tint(reflectance: Array, tint: Array) -> tuple[Array, Array]:
    """Index by the reflectance at the normal and the share of Schlick's curve that is left at the edge.

    (Kutz et al. 2021)
    """
    return of_edge(reflectance, tint * np.asarray(fresnel.schlick(fresnel.EDGE, np.clip(reflectance, 0, MOST))))


def of_edge_tint(reflectance: Array, tint: Array) -> tuple[Array, Array]:
    """Index by the reflectance at the normal and the position of n between its bounds, from the upper one.

    (Gulbrandsen 2014)
    """
    r = np.clip(reflectance, 0, MOST)
    least, most = _ends(r)
    n = tint * least + (1 - tint) * most
    return n, _extinction(r, n)


def _ends(r: Array) -> tuple[Array, Array]:
    """The least and the largest n of metals of that reflectance."""
    return (1 - r) / (1 + r), (1 + np.sqrt(r)) / (1 - np.sqrt(r))


def _extinction(r: Array, n: Array) -> Array:
    return np.sqrt(np.maximum(r * (n + 1) ** 2 - (n - 1) ** 2, 0) / (1 - r))
