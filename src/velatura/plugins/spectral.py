"""Lobes of a uniform stack in spectral variants, sampled once over direction and wavelength.

Their shapes are those of fixed wavelengths, and so is the share of samples that each gets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

from velatura import ops
from velatura.model.papers import bsdf, precomputed_lobes
from velatura.model.papers.adding import Lobe
from velatura.model.papers.prepare import Prepared
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid, low_discrepancy

BEGIN_NM, END_NM = 360.0, 830.0  # of the wavelengths that Mitsuba renders
NODES = 48  # over these, a multiple of those of a ray


@dataclass(frozen=True, eq=False)
class SampledSpectra:
    """The sides of a stack, one or both: the lobes of fixed wavelengths, and the energies of all; and the means of a
    diffuse base over wavelength."""

    mi: Any
    fixed: bsdf.Lobed
    sides: list[tuple[precomputed_lobes.PrecomputedLobes, directional_grid.Curves]]
    means: directional_grid.Curves | None

    def at(self, body: bsdf.Lobed, wavelengths_nm: Any) -> bsdf.Lobed:
        """The body for a ray, with the sampled values."""
        (place,) = places([wavelengths_nm])
        lobes = [self._lobes(*side, place) for side in self.sides]
        above = self._with_means(body.above, place)
        return replace(body, above=above, lobes_above=lobes[0], lobes_below=lobes[-1])

    def _lobes(
        self, fixed: precomputed_lobes.PrecomputedLobes, energies: directional_grid.Curves, place: Any
    ) -> precomputed_lobes.Lobes:
        """The lobes at the wavelengths of a ray, by their place among all."""

        def lobes(w: Direction) -> tuple[list[Lobe], Lobe | None]:
            reflected, passed = fixed(w)
            channels = iter(energies(w, place))

            def with_spectra(lobe: Lobe) -> Lobe:
                return replace(lobe, energy=self.mi.ArrayXf([*lobe.energy, *next(channels)]))

            reflected = [with_spectra(lobe) for lobe in reflected]
            return reflected, with_spectra(passed) if passed else None

        return lobes

    def _with_means(self, prepared: Prepared, place: Any) -> Prepared:
        base = self.fixed.above.base
        if base is None or prepared.base is None or self.means is None:
            return prepared
        fixed = (self.mi.UnpolarizedSpectrum(x) for x in base.means)
        r, t, *importance = (self.mi.ArrayXf([*a, *b]) for a, b in zip(fixed, ops.interpolate(self.means, place)))
        means = replace(prepared.base, mean_reflectance=r, mean_transmittance=t, importance=tuple(importance))
        return replace(prepared, base=means)


def sample(mi: Any, fixed: bsdf.Lobed, body_at: Callable[[Any], bsdf.Lobed], nodes: int) -> SampledSpectra:
    """The spectra of a stack from its body for fixed wavelengths, and from that for those of rays, over as many
    wavelengths: a multiple of those of a ray."""
    sides = [_side(mi, fixed.lobes_above, lambda nm: body_at(nm).lobes_above, nodes)]
    if fixed.below:
        sides.append(_side(mi, fixed.lobes_below, lambda nm: body_at(nm).lobes_below, nodes))
    base, means = body_at(_all_wavelengths(mi, nodes)).above.base, None
    if base is not None:
        columns = [_over_wavelengths(mi, x, 1, nodes) for x in base.means]
        means = directional_grid.curves(columns, (nodes,), mi.Float)
    return SampledSpectra(mi, fixed, sides, means)


def _side(
    mi: Any, fixed: precomputed_lobes.Lobes, lobes_at: Callable[[Any], precomputed_lobes.Lobes], nodes: int
) -> tuple[precomputed_lobes.PrecomputedLobes, directional_grid.Curves]:
    import drjit as dr

    # See every direction at all wavelengths
    assert isinstance(fixed, precomputed_lobes.PrecomputedLobes)
    shape = fixed.curves.shape
    w = directional_grid.directions(shape, mi.Float)
    count, none = dr.width(w[2]), dr.zeros(mi.Float, dr.width(w[2]))
    wavelengths = _all_wavelengths(mi, nodes, count)
    rays = dr.width(wavelengths) // count
    x, y, z = (low_discrepancy.repeated(c + none, rays) for c in w)
    reflected, passed = lobes_at(wavelengths)((x, y, z))

    # Keep what depends on them
    seen = [*reflected, *([passed] if fixed.transmits and passed else [])]
    flat = [_over_wavelengths(mi, lobe.energy, count, nodes) for lobe in seen]
    return fixed, directional_grid.curves(flat, (*shape, nodes), mi.Float)


def _all_wavelengths(mi: Any, nodes: int, times: int = 1) -> Any:
    """The nodes, several to a ray, for as many times."""
    import drjit as dr

    carries = len(mi.UnpolarizedSpectrum())
    first = dr.tile(dr.arange(mi.Float, nodes // carries), times) * carries
    step = (END_NM - BEGIN_NM) / (nodes - 1)
    return mi.UnpolarizedSpectrum([BEGIN_NM + step * (first + i) for i in range(carries)])


def _over_wavelengths(mi: Any, colour: Value, times: int, nodes: int) -> Any:
    """The values at all wavelengths in order, as many times."""
    import drjit as dr

    carries = len(mi.UnpolarizedSpectrum())
    return dr.ravel(carried(mi, colour) + dr.zeros(mi.UnpolarizedSpectrum, times * nodes // carries))


def places(wavelengths_nm: Iterable[Value]) -> list[Value]:
    """Wavelengths by their places on the spectrum, from 0 to 1."""
    return [(nm - BEGIN_NM) / (END_NM - BEGIN_NM) for nm in wavelengths_nm]


def carried(mi: Any, colour: Value) -> Any:
    """The part of a colour that a ray carries: the second half of a spectrum."""
    if isinstance(colour, mi.ArrayXf):
        colour = list(colour)[len(colour) // 2 :]
    return mi.UnpolarizedSpectrum(colour)
