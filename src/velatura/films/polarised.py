"""Mueller matrices of interfaces with thin films, sampled once over the cosine."""

from __future__ import annotations

import functools
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films.of_material import SENSITIVITIES
from velatura.films.reflectance import InterfaceFilms
from velatura.films.spectral import AtWavelengths
from velatura.films.tables import NODES, Coated, ColourTable
from velatura.ops import Value
from velatura.optics.coatings import Coating, Sensitivity
from velatura.optics.polarisation import Mueller

Array = NDArray[np.floating]

TOTAL = 513  # directions under total reflection, where phases turn fast


class PolarisedFilms:
    """Matrices by colour, for light from either side.

    `within` are sampled over the cosine on the rarer side: of light reflected from there, and from the denser side, and
    of what is refracted. `total`, of light under total reflection, is over the angle whose cosine is that on the denser
    side over the one at the critical angle. It is None for what is opaque, which has the first of the others alone.
    """

    def __init__(self, within: ColourTable, total: ColourTable | None) -> None:
        self.within, self.total = within, total
        self.channels = within.data.shape[-1] // (12 if total else 4)

    def opaque(self, cosine: Value, like: Value) -> Mueller:
        """Matrix of light that an opaque interface reflects, by colours of the kind of `like`."""
        return Mueller(*self.within.colours(like, cosine, count=self.channels))

    def dielectric(
        self, from_rarer: Value, cosine: Value, cos_t: Value, eta: Value, like: Value
    ) -> tuple[Mueller, Mueller]:
        """Matrices of reflected and of refracted light, for cosines on its own side and beyond, 0 where it is totally
        reflected, and the index there over that here."""
        assert self.total
        passes = cos_t > 0
        found = self.within.colours(like, ops.select(from_rarer, cosine, cos_t), count=self.channels)
        share = ops.minimum(ops.divide(cosine, ops.sqrt(1 - eta * eta)), 1.0)
        angle = ops.arctan2(ops.sqrt(1 - share * share), share) * (2 / pi)
        each = zip(found[:4], found[4:8], self.total.colours(like, angle, count=self.channels))
        reflection = Mueller(*(ops.select(passes, ops.select(from_rarer, a, b), total) for a, b, total in each))
        return reflection, Mueller(*found[8:])


def matrices(
    films: InterfaceFilms, light: Any, above: Value, cosine: Value, cos_t: Value, eta: Value, like: Value
) -> tuple[Mueller, Mueller]:
    """Matrices of light that an interface reflects and transmits, as `InterfaceFilms.shares`; eta is the index beyond
    over that here, and `light` that of the material."""
    if isinstance(films, AtWavelengths):
        return films.matrices(above, cosine, cos_t)
    assert isinstance(films, Coated)
    return _tabulated(films, light).dielectric(films.from_rarer(above), cosine, cos_t, eta, like)


def opaque_matrix(films: InterfaceFilms, light: Any, cosine: Value, like: Value) -> Mueller:
    """Matrix of light that an opaque interface reflects."""
    return films.matrix(cosine) if isinstance(films, AtWavelengths) else _tabulated(films, light).opaque(cosine, like)


def polarise(films: InterfaceFilms) -> bool:
    """Whether matrices of films are known: not where a table is over a thickness."""
    return isinstance(films, AtWavelengths) or (isinstance(films, Coated) and films.coating is not None)


def _tabulated(films: InterfaceFilms, light: Any) -> PolarisedFilms:
    assert isinstance(films, Coated) and films.coating
    return polarised_films(films.coating, films.n12 is None, SENSITIVITIES[light])


@functools.lru_cache(16)
def polarised_films(coating: Coating, opaque: bool, sensitivity: Sensitivity) -> PolarisedFilms:
    """Matrices of films between a medium of the lower index, above, and one of the higher, or an opaque one."""
    cosines = np.linspace(0, 1, NODES)

    def matrix(of: Coating, name: str, cos: Array, most: Array | float = 1.0) -> list[Array]:
        """Numbers of a matrix, of shares up to `most` in the mean of s and p."""
        names = [f"{name}_{part}" for part in ("s", "p", "real", "imaginary")]
        return [*vars(Mueller(*of.shares(names, cos, sensitivity)).bounded(most)).values()]

    reflected = matrix(coating, "reflected", cosines)
    if opaque:
        return PolarisedFilms(_sampled(reflected), None)
    back = coating.reversed()
    below = matrix(back, "reflected", coating.below(cosines))
    passed = matrix(coating, "transmitted", cosines, 1 - 0.5 * np.maximum(sum(reflected[:2]), sum(below[:2])))
    total = matrix(back, "reflected", coating.totally_reflected(np.cos(np.linspace(0, pi / 2, TOTAL))))
    return PolarisedFilms(_sampled([*reflected, *below, *passed]), _sampled(total))


def _sampled(parts: list[Array]) -> ColourTable:
    return ColourTable(np.concatenate(parts).T.copy())
