"""Averages of interfaces with thin films, of which the tables know nothing."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films.tables import Coated, ColourTable
from velatura.ops import Value
from velatura.tables import coordinates

if TYPE_CHECKING:
    from velatura.model.rough_interface import Array, Facets

NODES = (65, 33)  # over direction and roughness
SAMPLES, SAMPLES_INSIDE = 377, 610  # of normals
WALKED = 4  # roughnesses for one at which light walks between facets
COARSE, FEW = (33, 9), 144  # nodes, and normals, of coarse ones


class FilmAverage(ColourTable):
    """The directional albedo of an isotropic interface, sampled over direction and roughness, and after it what films
    of a dielectric absorb.

    `critical` is the critical angle that the angular axis follows, None for an axis in the cosine.
    """

    def __init__(self, data: NDArray[np.floating], channels: int, critical: float | None) -> None:
        super().__init__(data)
        self.channels, self.critical = channels, critical

    def __call__(self, cos_theta: Value, alpha: Value, like: Value) -> list[Value]:
        """Colours of the kind of `like`."""
        x = coordinates.from_incidence(cos_theta, self.critical)
        return self.colours(like, x, coordinates.from_roughness(alpha), count=self.channels)


@functools.lru_cache(32)
def film_average(films: Coated, often: bool, coarse: bool = False) -> FilmAverage:
    """The average of an interface whose facets are met once or often; made once. A `coarse` one is quicker, for what
    moves."""
    from velatura.model.rough_interface import Facets, shares_of_films  # slow to import

    opaque, n12 = films.n12 is None, films.n12 or 1.0
    critical = None if opaque or n12 >= 1 else float(np.arcsin(n12))
    x, y = (np.linspace(0, 1, n) for n in (COARSE if coarse else NODES))
    cosines = np.asarray(coordinates.to_incidence(x, critical))
    p = np.sqrt(np.maximum(1 - cosines * cosines, 0))
    samples = FEW if coarse else SAMPLES if critical is None else SAMPLES_INSIDE
    one, below = np.ones(1), np.full(1, n12)
    each = [
        Facets(one, below, one if opaque else None, alpha, alpha, films=films)
        for alpha in coordinates.to_roughness(y).tolist()
    ]
    first = [_at_first(facets, p, samples, often) for facets in each]
    kept, absorbed, blocked = (np.array(x) for x in zip(*first))
    if often:
        walked = np.array([shares_of_films(facets, p) for facets in each[::WALKED]])
        place = np.arange(len(y)) / WALKED
        before = np.minimum(place.astype(int), len(walked) - 2)
        upper = (place - before)[:, None, None, None]
        reflected, passed = np.moveaxis((1 - upper) * walked[before] + upper * walked[before + 1], 1, 0)
        kept, absorbed = kept + blocked * reflected, absorbed + blocked * (1 - reflected - passed)
    channels = kept.shape[1]
    found = np.concatenate([kept, absorbed], axis=1) if films.absorbs else kept
    found = found.transpose(2, 0, 1)
    if coarse:
        even = np.meshgrid(*(np.linspace(0, 1, n) for n in NODES), indexing="ij")
        found = np.stack(ops.interpolate(ColourTable(found), *(each.ravel() for each in even)), axis=-1)
    return FilmAverage(found.reshape(*NODES, -1).copy(), channels, critical)


def _at_first(facets: Facets, p: Array, samples: int, often: bool) -> tuple[Array, Array, Array]:
    """Shares (C, N) of light of lengths p that facets with films reflect when they are first met, that films of a
    dielectric absorb, and that meets others then."""
    from velatura.model.rough_interface import FirstShares

    shares = FirstShares.of(facets, p, samples, often)
    if facets.opaque:
        return shares.kept, 0 * shares.kept, shares.whole
    blocked = shares.blocked_reflected + shares.blocked_refracted
    return shares.kept, 1 - shares.kept - shares.passed - blocked, blocked
