"""Interfaces with thin films at normal incidence, of many stacks at once: near enough to search by.

A model works out what films reflect at all angles, of one interface at a time. Here few wavelengths and few facets
stand for all; answers are read by the model itself (`DraggedStack`).
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.films.tables import Coated
from velatura.ops import Value
from velatura.optics.coatings import FINEST, PER_PERIOD, RANGE_NM
from velatura.optics.films import OpticalFilm, coherent
from velatura.stack import FilmValues, Interface, Material, Stack, srgb_sensitivity
from velatura.stack.values import Film
from velatura.tables import Average

Array = NDArray[np.float64]

NEAR = 0.03  # by which reflectances may differ from those of the model, as logarithms
COARSEST = 32  # wavenumbers at least
FACETS, SHARES = (x / 2 for x in np.polynomial.legendre.leggauss(6))  # of those that light meets, and their weights
BLOCK = 1 << 19  # interfaces times cosines times wavenumbers at a time


@functools.lru_cache(64)
def values(films: tuple[Film, ...]) -> tuple[FilmValues, ...]:
    """Films in the numbers of NumPy, without those of no thickness."""
    (layer,) = Material.of(Stack([Interface(eta=1.5, k=0.0, films=films)])).interfaces
    return tuple(film for film in layer.films if film.thickness_nm > 0)


class AtNormal(Coated):
    """Reflectance of films between media of indices eta_1 and eta_2 + i k_2, of N stacks: each (1, N), (3, N), or a
    number; k_2 is None where the interface transmits."""

    axis = None
    place = ()
    known = False

    def __init__(self, films: Sequence[FilmValues], eta_1: Value, eta_2: Value, k_2: Value | None) -> None:
        self.films, self.eta_1, self.eta_2, self.k_2 = films, eta_1, eta_2, k_2

    @property
    def absorbs(self) -> bool:
        """Whether less passes than is not reflected."""
        return self.k_2 is None and any(np.any(film.k > 0) for film in self.films)

    def reversed(self) -> AtNormal:
        """The films as light from below meets them."""
        return AtNormal(self.films[::-1], self.eta_2, self.eta_1, None)

    def averaged(self, often: bool) -> tuple[Average, Average]:
        """Averages over facets that are met once or often, by their roughness (N,); the share that a facet absorbs."""
        return lambda cos_theta, alpha: self._average(alpha, often), lambda cos_theta, alpha: self._absorbed

    @property
    def _absorbed(self) -> Array:
        return np.asarray(1 - self.at(1.0, None) - self.passing(1.0, 1.0, None))

    def passing(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """Transmittance of one smooth facet."""
        return self._colours(np.ones((1, 1)), "transmitted")[..., 0]

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """Reflectance of one smooth facet."""
        return self.at(cos_1, like)

    def at(self, cosine: Value, like: Value) -> Value:
        """Reflectance of one smooth facet."""
        return self._colours(np.ones((1, 1)))[..., 0]

    def _average(self, alpha: ArrayLike, often: bool) -> Array:
        alpha = np.atleast_1d(np.asarray(alpha, float))
        if not alpha.any():
            return self.at(1.0, None)
        # Facets that are seen have tangents alpha sqrt(u / (1 - u)), u even (Walter et al. 2007, Eq. 35)
        alpha2 = alpha[:, None] ** 2
        most = 1 / (1 + alpha2)  # of u, for light that leaves upwards
        u = most * (FACETS + 0.5)
        cosine = 1 / np.sqrt(1 + alpha2 * u / (1 - u))
        leaving = 2 * cosine**2 - 1
        passes = 2 / (1 + np.sqrt(1 + alpha2 * (1 / leaving**2 - 1)))
        each = self._colours(cosine)
        found = most[:, 0] * np.sum(SHARES * passes * each, axis=-1)
        again = most[:, 0] * np.sum(SHARES * (1 - passes) * each**2, axis=-1) + (1 - most[:, 0]) * each[..., -1] ** 2
        return np.asarray(found + again if often else found)

    def _colours(self, cosines: Array, share: str = "reflected") -> Array:
        """A share of the light at cosines (N, J), or (1, J), by channel: (3, N, J)."""
        k_2 = 0.0 if self.k_2 is None else self.k_2
        each = [np.atleast_2d(np.asarray(x, float)) for x in (self.eta_1, self.eta_2, k_2)]
        shape = np.broadcast_shapes(*(x.shape for x in each), (1, len(cosines)))
        cosines = np.broadcast_to(cosines, (shape[1], cosines.shape[1]))
        eta_1, eta_2, k_2 = (np.broadcast_to(x, shape) for x in each)
        grey = shape[0] == 1 and all(np.ptp(x) == 0 for film in self.films for x in (film.eta, film.k))
        slower = [OpticalFilm(x.eta, x.k, x.thickness_nm).in_colours() for x in self.films]
        thickness_nm = max(sum(float(np.max(film.optical_nm)) for film in slower), 1.0)
        wavelengths_nm, weights = _spectrum(thickness_nm)
        size = max(BLOCK // (cosines.shape[1] * len(wavelengths_nm)), 1)
        found = np.empty((3, *cosines.shape))
        for c in range(1 if grey else 3):
            own = slice(None) if grey else slice(c, c + 1)
            films = [OpticalFilm(x.eta[c, 0], x.k[c, 0], x.thickness_nm).in_colours() for x in self.films]
            for n in range(0, shape[1], size):
                one, two, k = (x[c % shape[0], n : n + size, None, None] for x in (eta_1, eta_2, k_2))
                r = coherent(cosines[n : n + size, :, None], wavelengths_nm, one, films, two, k)
                found[own, n : n + size] = np.moveaxis(getattr(r, share) @ weights[own].T, -1, 0)
        return np.clip(found, 0.0, 1.0)


@functools.lru_cache(64)
def _spectrum(thickness_nm: float) -> tuple[Array, Array]:
    """Wavelengths (W,), and the weights of the channels, (3, W)."""
    low, high = 1 / RANGE_NM[1], 1 / RANGE_NM[0]
    count = min(max(COARSEST, int(np.ceil(2 * PER_PERIOD * 2 * thickness_nm * (high - low)))), FINEST)
    wavelengths_nm = 1 / (low + (high - low) * (np.arange(count) + 0.5) / count)
    weights = srgb_sensitivity(wavelengths_nm) * wavelengths_nm**2
    return wavelengths_nm, weights / weights.sum(axis=1, keepdims=True)
