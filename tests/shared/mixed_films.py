"""Smooth stacks of thin films between thick media at one wavelength, by `velatura.optics.films` and by `tmm`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
import tmm

from velatura import stack
from velatura.films import of_material, polarised
from velatura.optics import coatings, films
from velatura.optics.films import OpticalFilm, Response
from velatura.stack import Interface, Layer, Medium, Stack

THICK = 1e9  # nm, of a medium, whose extinction then changes no reflectance


@contextmanager
def light_of(wavelength_nm: float) -> Iterator[None]:
    """Colours of films are those of light of one wavelength in this block."""

    def at(shares: Any, cosines: np.ndarray, *_: Any) -> np.ndarray:
        return np.repeat(shares(np.array([wavelength_nm]), cosines).swapaxes(1, 2), 3, axis=1)

    def forget() -> None:
        of_material._coated.cache_clear()
        polarised.polarised_films.cache_clear()

    forget()
    try:
        with patch.object(coatings, "integrated", at):
            yield
    finally:
        forget()


@dataclass(frozen=True)
class Mixed:
    """Media of indices from the top, of optical depths along the normal, and the films on the interfaces between them.

    The last medium may be a metal, and films may absorb.
    """

    indices: tuple[complex, ...]
    depths: tuple[float, ...]
    films: tuple[tuple[OpticalFilm, ...], ...]
    wavelength_nm: float

    @property
    def is_clear(self) -> bool:
        absorbs = any(f.k for on_it in self.films for f in on_it)
        return not absorbs and not any(self.depths) and not np.imag(self.indices[-1])

    @property
    def stack(self) -> Stack:
        """The same as a material."""
        layers: list[Layer] = []
        for n, depth, on_it in zip(self.indices[1:], self.depths[1:], self.films):
            carried = tuple(stack.Film(eta=f.eta, k=f.k, thickness_nm=f.thickness_nm) for f in on_it)
            metal = np.imag(n) > 0
            layers.append(Interface(eta=float(np.real(n)), k=float(np.imag(n)) if metal else None, films=carried))
            if depth:
                layers.append(Medium(depth=depth, sigma_a=1.0))
        return Stack(layers)

    def reversed(self) -> Mixed:
        below = tuple(on_it[::-1] for on_it in self.films[::-1])
        return Mixed(self.indices[::-1], self.depths[::-1], below, self.wavelength_nm)

    def exact(self, kind: str, cosine: float) -> tuple[float, float]:
        """Reflectance and transmittance of s or p, by `tmm`."""
        indices, lengths, kinds = [self.indices[0]], [np.inf], ["i"]
        for on_it, n, depth in zip(self.films, self.indices[1:], self.depths[1:]):
            indices += [complex(f.eta, f.k) for f in on_it]
            lengths += [f.thickness_nm for f in on_it]
            kinds += ["c"] * len(on_it)
            indices.append(n + 1j * depth * self.wavelength_nm / (4 * np.pi * THICK))
            lengths.append(THICK)
            kinds.append("i")
        lengths[-1] = np.inf
        found = tmm.inc_tmm(kind, indices, lengths, kinds, np.arccos(cosine), self.wavelength_nm)
        return float(found["R"]), float(found["T"])

    def summed(self, kind: str, cosine: float) -> tuple[float, float]:
        """The same by amplitudes within interfaces, and sums of energies between them, from the bottom."""
        p2 = np.real(self.indices[0]) ** 2 * (1 - cosine**2)
        r, t = 0.0, 1.0
        for k in reversed(range(len(self.films))):
            above, below = self.indices[k], self.indices[k + 1]
            cos_1, cos_2 = (np.sqrt(max(1 - p2 / np.real(n) ** 2, 0.0)) for n in (above, below))
            if cos_1 == 0:
                continue  # no light comes here
            down = _shares(self._response(cos_1, above, self.films[k], below), kind)
            if np.imag(below) or cos_2 == 0:
                r, t = down
                continue
            up, _ = _shares(self._response(cos_2, below, self.films[k][::-1], above), kind)
            # The medium below, then the interface
            through = float(np.exp(-self.depths[k + 1] / cos_2))
            r, t = through**2 * r, through * t
            r, t = down[0] + down[1] ** 2 * r / (1 - up * r), down[1] * t / (1 - up * r)
        return r, t

    def _response(self, cosine: float, above: complex, on_it: tuple[OpticalFilm, ...], below: complex) -> Response:
        media = float(np.real(above)), on_it, float(np.real(below)), float(np.imag(below))
        return films.coherent(cosine, self.wavelength_nm, *media)


def _shares(found: Response, kind: str) -> tuple[float, float]:
    return float(getattr(found, f"reflected_{kind}")), float(getattr(found, f"transmitted_{kind}"))


def random_mixed(rng: np.random.Generator, thickest_nm: float = 5000.0) -> tuple[Mixed, float]:
    """A stack of one to four interfaces, each with none to three films, and a cosine above it."""
    count = int(rng.integers(1, 5))
    metal, clear = rng.random() < 0.4, rng.random() < 0.3
    indices = [1.0 + 0j, *(complex(n) for n in rng.uniform(1.05, 2.5, count))]
    if metal:
        indices[-1] = complex(rng.uniform(0.2, 3), rng.uniform(0.5, 6))
    depths = [0.0, *(0.0 if clear or rng.random() < 0.4 else rng.uniform(0, 1) for _ in range(count - 1)), 0.0]
    on_it = tuple(
        tuple(
            OpticalFilm(
                float(rng.uniform(1.05, 3)),
                float(rng.uniform(0, 1)) if not clear and rng.random() < 0.3 else 0.0,
                float(rng.uniform(0, thickest_nm) * rng.random() ** 2),
            )
            for _ in range(rng.integers(0, 4))
        )
        for _ in range(count)
    )
    return Mixed(tuple(indices), tuple(depths), on_it, float(rng.uniform(380, 780))), float(rng.uniform(0.02, 1))
