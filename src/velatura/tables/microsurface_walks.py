"""Light that meets several facets of one rough interface: walks through the Smith microsurface (Heitz et al. 2016).

The outcome of each meeting is summed as an expectation: the share of the light that leaves, and both reflection and
refraction of the rest. Only the facets are drawn, those of the first meetings from a Sobol sequence. So a few thousand
walks give a directional albedo to a thousandth.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from velatura.optics import fresnel, ggx, microsurface, refraction
from velatura.optics.ggx import Direction
from velatura.renderer.low_discrepancy import cube

QUASI_RANDOM = 4  # meetings whose numbers come from the sequence; later ones, which matter less, draw random numbers
DIMENSIONS = 9  # of a sequence that all points share, likewise
FAINT = 0.05  # weight below which walks are ended at random, and the others take their weight
MOST_MEETINGS = 1000

Array = np.ndarray

#: Shares (C, walks) of light that facets reflect, and let pass, by its cosines and whether it comes from above.
Facets = Callable[[Array, Array], tuple[Array, Array]]


class Walks:
    """Walks for light that comes from above at (cos_theta, alpha > 0), both of shape (points,), single precision.

    One entry per walk: the point it belongs to, direction of travel, rank of its height, both as seen from its own
    medium (which is upside down for light that is not `outside`), and weight, which may have channels before it. The
    walks of all points draw the same numbers if they are `alike`, and each point's own ones otherwise.
    """

    def __init__(
        self, cos_theta: Array, alpha: Array, paths: int, rng: np.random.Generator, alike: bool = False
    ) -> None:
        self.rng, self.paths, self.meetings, self._alike = rng, paths, 0, alike
        self.point = np.repeat(np.arange(len(alpha)), paths)
        self.alpha = alpha.astype(np.float32)[self.point]
        cosine = cos_theta.astype(np.float32)[self.point]
        self.w: Direction = -np.sqrt(1 - cosine**2), np.zeros_like(cosine), -cosine
        self.rank = np.ones_like(cosine)
        self.weight = np.ones_like(cosine)
        self.outside = np.ones(len(cosine), bool)
        self._path = np.arange(len(cosine))
        if alike:
            numbers = np.tile(cube(paths, DIMENSIONS), len(alpha))
        else:
            from scipy.stats import qmc

            numbers = np.concatenate([qmc.Sobol(3 * QUASI_RANDOM, seed=rng).random(paths) for _ in alpha]).T
        self._numbers = np.minimum(numbers.astype(np.float32), np.float32(1 - 2**-24))
        self._meets = np.ones_like(cosine)

    def __len__(self) -> int:
        return len(self.rank)

    def leave(self) -> Array:
        """Weight that leaves the interface now, per walk; what stays is left in the walks."""
        self._meets = 1 - microsurface.escape(self.w, self.rank, self.alpha, self.alpha)
        leaving = self.weight * (1 - self._meets)
        self.weight = self.weight * self._meets
        return leaving

    def end_faint(self) -> Array:
        """End some of the faint walks; indices of those that go on."""
        carried = self.weight if self.weight.ndim == 1 else self.weight.mean(axis=0)
        kept = np.flatnonzero(carried > FAINT * self._random(1)[0])
        with np.errstate(divide="ignore", invalid="ignore"):
            self.weight = np.where(carried < FAINT, self.weight * (np.float32(FAINT) / carried), self.weight)
        self._take(kept)
        return kept

    def meet(self) -> tuple[Direction, Direction]:
        """Fly to the next facets; directions towards where light came from, and normals."""
        u = self._draw()
        rank = microsurface.fly(self.w, self.rank, self.alpha, self.alpha, u[0] * self._meets)
        self.rank = np.minimum(rank, 1)
        self.meetings += 1
        i = reverse(self.w)
        return i, ggx.sample_visible(i, self.alpha, self.alpha, u[1], u[2])

    def reflect(self, i: Direction, h: Direction) -> None:
        self.w = ggx.reflect(i, h)

    def scatter(self, i: Direction, h: Direction, eta: Array, facets: Facets | None = None) -> None:
        """Reflect and refract: two walks out of each one; `eta` by point, as seen from above. Facets reflect as
        Fresnel's unless they are given."""
        eta_here = eta.astype(np.float32)[self.point]
        eta_here = np.where(self.outside, eta_here, 1 / eta_here)
        cosine = np.clip(ggx.dot(i, h), 0, 1)
        if facets is None:
            reflectance = fresnel.dielectric(cosine, eta_here)
            passing = 1 - reflectance
        else:
            reflectance, passing = facets(cosine, self.outside)
        refracted = reverse(refraction.refract(i, h, eta_here))
        self._take(np.tile(np.arange(len(self)), 2))
        x, y, z = map(np.concatenate, zip(ggx.reflect(i, h), refracted))
        self.w = x, y, z
        self.weight = self.weight * np.concatenate([reflectance, passing], axis=-1)
        # For refracted light the surface is upside down
        below = len(cosine)
        self.rank[below:] = 1 - self.rank[below:]
        self.outside[below:] ^= True

    def _take(self, index: Array) -> None:
        self.w = self.w[0][index], self.w[1][index], self.w[2][index]
        for name in ("point", "alpha", "rank", "weight", "outside", "_path", "_meets"):
            setattr(self, name, getattr(self, name)[..., index])

    def _draw(self) -> Array:
        if 3 * self.meetings < len(self._numbers):
            return self._numbers[3 * self.meetings : 3 * self.meetings + 3, self._path]
        return self._random(3)

    def _random(self, count: int) -> Array:
        """Numbers (count, walks), those of a path where all points draw the same, however many have ended."""
        if self._alike:
            return self.rng.random((count, self.paths), dtype=np.float32)[:, self._path % self.paths]
        return self.rng.random((count, len(self)), dtype=np.float32)


def reverse(w: Direction) -> Direction:
    return -w[0], -w[1], -w[2]


def reflected_later(cos_theta: Array, alpha: Array, eta: Array, paths: int, rng: np.random.Generator) -> Array:
    """Energy that a dielectric of relative index eta reflects after more than one meeting, shape (points,)."""
    walks = Walks(cos_theta, alpha, paths, rng)
    energy = np.zeros(len(alpha))
    while len(walks) and walks.meetings < MOST_MEETINGS:
        walks.scatter(*walks.meet(), eta)
        leaving = np.where(walks.outside, walks.leave(), 0)
        if walks.meetings > 1:
            energy += np.bincount(walks.point, leaving, minlength=len(energy))
        walks.end_faint()
    return energy / paths


def shares_in_the_end(
    facets: Facets, eta: float | None, cos_theta: Array, alpha: Array, paths: int, straight: float = 0.0
) -> tuple[Array, Array]:
    """Shares (C, points) of light, of what meets facets again, that are reflected, and that pass, in the end.

    facets: what is opaque takes its share already at the first meeting, so that the share is of light that meets
        facets again if they first reflect all.
    eta: relative index; None for what is opaque.
    straight: share of refracted light that meets facets again and is not counted, since it passes these as well.

    Points draw the same numbers, and so they have nearly the same error.
    """
    walks, count = Walks(cos_theta, alpha, paths, np.random.default_rng(0), alike=True), len(alpha)
    again: Array = np.zeros(1)
    energies: list[Array] = [np.zeros(1), np.zeros(1)]
    while len(walks) and walks.meetings < MOST_MEETINGS:
        i, h = walks.meet()
        if eta is None:
            walks.reflect(i, h)
        else:
            walks.scatter(i, h, np.full(count, eta), facets)
        leaving = walks.leave()
        if walks.meetings == 1:
            passes = np.where(walks.outside, 0, straight * walks.weight)
            again = _by_point(np.atleast_2d(walks.weight - passes), walks, count)
            energies[1] = -_by_point(np.atleast_2d(passes), walks, count)
        if eta is None:
            reflectance, _ = facets(np.clip(ggx.dot(i, h), 0, 1), walks.outside)
            leaving, walks.weight = leaving * reflectance, walks.weight * reflectance
        if walks.meetings > 1:
            here = walks.outside, ~walks.outside
            energies = [
                energy + _by_point(np.where(side, leaving, 0), walks, count) for energy, side in zip(energies, here)
            ]
        walks.end_faint()
    reflected, passed = energies[0], np.maximum(energies[1], 0)
    # Of the few walks of an almost smooth interface those that are kept may weigh too much; more would be a gain
    again = np.maximum(np.maximum(again, reflected + passed), np.finfo(float).tiny)
    return reflected / again, passed / again


def _by_point(weights: Array, walks: Walks, count: int) -> Array:
    return np.array([np.bincount(walks.point, each, minlength=count) for each in weights])


def reflected_by_metals(
    cos_theta: float, alpha: float, curves: Array, paths: int, rng: np.random.Generator
) -> tuple[Array, float]:
    """The same at one point, for some conductors, and for a mirror.

    `curves`, shape (bins, conductors), are Fresnel at the middles of bins equal in the square root of the cosine.
    """
    walks = Walks(np.array([cos_theta]), np.array([alpha]), paths, rng)
    curves, product = curves.astype(np.float32), np.ones((paths, curves.shape[1]), np.float32)
    energy, of_mirror = np.zeros(curves.shape[1]), 0.0
    while len(walks) and walks.meetings < MOST_MEETINGS:
        i, h = walks.meet()
        walks.reflect(i, h)
        place = np.sqrt(np.clip(ggx.dot(i, h), 0, 1)) * len(curves)
        product *= curves[np.minimum(place.astype(int), len(curves) - 1)]
        leaving = walks.leave()
        if walks.meetings > 1:
            energy += leaving @ product
            of_mirror += leaving.sum(dtype=float)
        product = product[walks.end_faint()]
    return energy / paths, of_mirror / paths
