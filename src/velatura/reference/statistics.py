"""Statistics of a stack's lobes by random walks: energy, mean, covariance and roughness, with standard errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.optics import fresnel, ggx
from velatura.optics.directions import directions
from velatura.reference import roughness
from velatura.reference.batches import ends, mean_and_error, relative_index
from velatura.results import Fields
from velatura.stack import Described, Interface, Layer, MaterialLike, Mix, Stack, load

Array = NDArray[np.floating]


@dataclass(frozen=True, repr=False)
class WalkedLobe(Fields):
    """One lobe, for N directions; or the standard errors of one.

    energy (3, N) by colour; mean (2, N) and covariance (3, N: xx, xy, yy) of the outgoing directions on the projected
    disc; alpha (2, N), the equivalent roughness along two axes, the first turned from the tangent by rotation (N,),
    radians anticlockwise. All but the energy weigh a path by the mean of its colours, and are NaN where no path came.
    """

    energy: Array
    alpha: Array
    rotation: Array
    mean: Array
    covariance: Array


@dataclass(frozen=True, repr=False)
class Statistics(Fields):
    """Lobes by the deepest interface, in lists from the top, and transmitted light (None below an opaque base).

    A diffuse base comes last, as an interface would. Light that a medium scatters back counts for the interface below
    it. `truncated` (N,) is the energy of paths that were cut off, in no lobe. `standard_error` has the same names.
    """

    energy: list[Array]
    alpha: list[Array]
    rotation: list[Array]
    mean: list[Array]
    covariance: list[Array]
    transmitted: WalkedLobe | None
    truncated: Array
    standard_error: Statistics | None = None

    def times(self, share: float) -> Statistics:
        """The same lobes with a share of the light."""
        below, error = self.transmitted, self.standard_error
        return replace(
            self,
            energy=[share * energy for energy in self.energy],
            transmitted=below and replace(below, energy=share * below.energy),
            truncated=share * self.truncated,
            standard_error=error and error.times(share),
        )


@dataclass(frozen=True, repr=False)
class MixtureStatistics(Fields):
    """The lobes of all stacks of a mixture, in `parts`, with energies times the shares of these.

    Lists run over the reflected lobes of all parts, one after the other, and `transmitted` over parts that transmit;
    truncated (N,) is a sum. `standard_error` has the same names.
    """

    parts: list[Statistics]

    @property
    def energy(self) -> list[Array]:
        return self._each("energy")

    @property
    def alpha(self) -> list[Array]:
        return self._each("alpha")

    @property
    def rotation(self) -> list[Array]:
        return self._each("rotation")

    @property
    def mean(self) -> list[Array]:
        return self._each("mean")

    @property
    def covariance(self) -> list[Array]:
        return self._each("covariance")

    @property
    def transmitted(self) -> list[WalkedLobe]:
        return [part.transmitted for part in self.parts if part.transmitted]

    @property
    def truncated(self) -> Array:
        return np.asarray(sum(part.truncated for part in self.parts))

    @property
    def standard_error(self) -> MixtureStatistics | None:
        errors = [part.standard_error for part in self.parts if part.standard_error]
        return MixtureStatistics(errors) if errors else None

    def _each(self, name: str) -> list[Array]:
        return [lobe for part in self.parts for lobe in getattr(part, name)]


@overload
def statistics(
    stack: Stack,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    paths: int = 10**6,
    seed: int = 0,
    microsurface: bool = False,
    polarised: bool = False,
) -> Statistics: ...


@overload
def statistics(
    stack: MaterialLike,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    paths: int = 10**6,
    seed: int = 0,
    microsurface: bool = False,
    polarised: bool = False,
) -> Statistics | MixtureStatistics: ...


def statistics(
    stack: MaterialLike,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    paths: int = 10**6,
    seed: int = 0,
    microsurface: bool = False,
    polarised: bool = False,
) -> Statistics | MixtureStatistics:
    """Statistics of the light that a material reflects and transmits, by random walks through it.

    The equivalent alpha of a lobe is that of the single GGX reflection, at the same incidence, whose half-vectors have
    the same median slope. Where all interfaces down to the lobe's are isotropic, that is the median length of slopes;
    otherwise the median of their sizes along each principal axis of the half-vectors' covariance. The half-vectors of
    transmitted light are those of its mirror image and of `wi` refracted through the whole stack (Belcour 2018, 4.2).

    Light of a metal by name or by tables is walked at three wavelengths of each channel (docs/explanation/model.md).
    Each stack of a mixture is walked for itself, with all `paths`.

    Args:
        stack: a material (a stack, a mixture, a file, or a preset's name).
        cos_theta: cosines of the directions of incidence, in (0, 1]: a number, or a list of N.
        phi: their azimuths from the tangent, radians: one for all, or N.
        paths: walks for each direction.
        seed: of the random numbers; the same one gives the same result.
        microsurface: whether light scatters many times between the facets of an interface (Heitz et al. 2016).
        polarised: whether facets polarise the light, which comes in unpolarised; it takes longer. Media and diffuse
            bases depolarise what they scatter.

    Raises:
        InvalidInput: no valid material, a cosine outside its range, lists of different lengths, or a texture where a
            number is needed.
        MissingTool: LLVM is missing or too old; the message names the package to install.
    """
    material: Described = load(stack)
    if not isinstance(material, Mix):
        return _of_stack(material, cos_theta, phi, paths, seed, microsurface, polarised)
    shares = material.weighted("statistics are those of one point; replace it by a number")
    walked = (cos_theta, phi, paths, seed, microsurface, polarised)
    return MixtureStatistics([_of_stack(stack, *walked).times(share) for share, stack in shares])


def _of_stack(
    stack: Stack, cos_theta: ArrayLike, phi: ArrayLike, paths: int, seed: int, microsurface: bool, polarised: bool
) -> Statistics:
    columns = [_column(stack, wi, paths, seed, microsurface, polarised) for wi in directions(cos_theta, phi)]
    truncated = np.array([lost for _, lost in columns])
    values, errors = (_collect([[pair[i] for pair in lobes] for lobes, _ in columns]) for i in (0, 1))
    standard_error = _statistics(stack, errors, np.zeros_like(truncated), None)
    return _statistics(stack, values, truncated, standard_error)


# From lobes of single directions to arrays


def _collect(columns: Sequence[Sequence[WalkedLobe]]) -> list[WalkedLobe]:
    names = [f.name for f in fields(WalkedLobe)]
    return [WalkedLobe(**{n: np.stack([getattr(x, n) for x in row], axis=-1) for n in names}) for row in zip(*columns)]


def _statistics(stack: Stack, lobes: Sequence[WalkedLobe], truncated: Array, error: Statistics | None) -> Statistics:
    reflected, transmitted = (lobes[:-1], lobes[-1]) if stack.transmits else (lobes, None)
    lists = {f.name: [getattr(lobe, f.name) for lobe in reflected] for f in fields(WalkedLobe)}
    return Statistics(**lists, transmitted=transmitted, truncated=truncated, standard_error=error)


# From paths to lobes of one direction


def _column(
    stack: Stack, wi: Array, paths: int, seed: int, microsurface: bool, polarised: bool
) -> tuple[list[tuple[WalkedLobe, WalkedLobe]], float]:
    """The lobes of one direction with their errors, and the energy lost by cutting paths off."""
    found = ends(stack, wi, paths, seed, microsurface, polarised)
    surfaces = [stack.layers[place] for place in stack.surfaces]
    turned = any(_anisotropic(s) and s.rotation != 0 for s in stack.interfaces)
    lobes = []
    up = found.w[2] > 0
    for k in range(len(surfaces)):
        here = up & (found.deepest == k)
        radial = not any(map(_anisotropic, surfaces[: k + 1]))
        lobes.append(_lobe(wi, found.w[:, here], found.weight[:, here], paths, radial, turned))
    if stack.transmits:
        eta = relative_index(stack)
        wi_below = np.array([wi[0] / eta, wi[1] / eta, fresnel.cos_transmitted(wi[2], eta)])
        mirrored = found.w[:, ~up] * np.array([[1], [1], [-1]], found.w.dtype)
        radial = not any(map(_anisotropic, surfaces))
        lobes.append(_lobe(wi_below, mirrored, found.weight[:, ~up], paths, radial, turned))
    return lobes, found.truncated


def _anisotropic(surface: Layer) -> bool:
    return isinstance(surface, Interface) and isinstance(surface.alpha, tuple)


def _lobe(wi: Array, wo: Array, weight: Array, paths: int, radial: bool, turned: bool) -> tuple[WalkedLobe, WalkedLobe]:
    """Moments of paths that leave along wo (3, n) with weight (3, n), out of all `paths`; and their errors."""
    # Energy
    energy, energy_error = mean_and_error(weight, paths)
    # Moments on the disc
    grey = weight.mean(axis=0)
    mean, mean_error, covariance, covariance_error = moments(wo[:2], grey)
    # Axes of the half-vectors, and the roughness along them
    x, y = roughness.slopes(wi, wo)
    rotation, rotation_error = (0.0, 0.0) if radial else _axes(x, y, grey, turned)
    along = np.stack(ggx.rotate((x, y, 0), rotation)[:2])
    target, target_error = roughness.medians(along, grey, radial)
    alpha = roughness.matching(np.array(ggx.rotate(tuple(wi), rotation)), target, radial)
    alpha_error = target_error * np.where(target > 0, alpha / np.where(target > 0, target, 1), 0)
    value = WalkedLobe(energy, alpha, np.array(rotation), mean, covariance)
    return value, WalkedLobe(energy_error, alpha_error, np.array(rotation_error), mean_error, covariance_error)


def moments(x: Array, weight: Array) -> tuple[Array, Array, Array, Array]:
    """Weighted mean (2,) and covariance (3,) of points (2, n), each followed by its standard error."""
    mean, mean_error = _average(x, weight)
    d = x - mean[:, None].astype(x.dtype)
    covariance, covariance_error = _average(np.stack([d[0] * d[0], d[0] * d[1], d[1] * d[1]]), weight)
    return mean, mean_error, covariance, covariance_error


def _average(x: Array, weight: Array) -> tuple[Array, Array]:
    """Weighted mean over the last axis, as a ratio of sums, and its standard error; NaN where there is no weight."""
    total = weight.sum(dtype=float) or np.nan
    mean = np.sum(weight * x, axis=-1, dtype=float) / total
    spread = weight * (x - mean[:, None].astype(x.dtype))
    return mean, np.sqrt(np.sum(spread * spread, axis=-1, dtype=float)) / total


def _axes(x: Array, y: Array, weight: Array, turned: bool) -> tuple[float, float]:
    """Angle of a principal axis of normals of slopes x and y on the disc, and its standard error.

    It is the longer axis if the interfaces are `turned`, as they may be by any angle, else the one near the tangent.
    """
    cosine = 1 / np.sqrt(1 + x * x + y * y)
    p = np.stack([x * cosine, y * cosine])
    mean, _, (xx, xy, yy), _ = moments(p, weight)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    # Carry the errors of the covariance over to the angle
    dx, dy = p - mean[:, None].astype(p.dtype)
    slope = ((xx - yy) * (dx * dy - xy) - xy * (dx * dx - dy * dy - xx + yy)) / ((xx - yy) ** 2 + 4 * xy**2)
    error = np.sqrt(np.sum((weight * slope) ** 2, dtype=float)) / (weight.sum(dtype=float) or np.nan)
    if not turned:
        angle = (angle + np.pi / 4) % (np.pi / 2) - np.pi / 4
    return float(angle), float(error)
