"""The lobes of a uniform isotropic stack, added up once over the cosine, so that all of them are one fetch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from velatura import ops
from velatura.model.adding import Lobe
from velatura.model.prepare import Prepared, PreparedInterface
from velatura.model.variance import Isotropic, PerAxis, Roughness
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.tables import curve

Lobes = Callable[[Direction], tuple[list[Lobe], Lobe]]  # reflected and transmitted, for a direction above the surface


@dataclass(frozen=True)
class Memo:
    """Energies of type `colour` and roughnesses of all lobes, the transmitted one last.

    Lobes that have axes of their own, in the plane of incidence and across it, have a gain too; `facets` are those of
    lobes that are drawn with them.
    """

    curves: curve.Curves
    colour: type
    prepared: Prepared
    axes: bool
    facets: list[PreparedInterface | None]

    def __call__(self, w: Direction) -> tuple[list[Lobe], Lobe]:
        channels, colours = iter(self.curves(w[2])), len(self.colour())
        lobes = []
        for facets in self.facets:
            energy = self.colour(*(next(channels) for _ in range(colours)))
            alpha_u = next(channels)
            if not self.axes:
                variance = Isotropic(self.prepared.f.variance(alpha_u))
                lobes.append(Lobe(energy, variance, Roughness(alpha_u, alpha_u, 0.0)))
                continue
            roughness = Roughness(alpha_u, next(channels), ops.arctan2(w[1], w[0]))
            gain = self.colour(*(next(channels) for _ in range(colours)))
            lobes.append(Lobe(energy, PerAxis.of(roughness, self.prepared.f), roughness, gain, facets))
        return lobes[:-1], lobes[-1]


def sample(lobes: Lobes, prepared: Prepared, number: type, colour: type) -> Memo:
    """The lobes over the cosine, for Dr.Jit's types of numbers and colours."""
    axes = prepared.model.calibrations is not None
    facets: list[PreparedInterface | None] = []

    def columns(cosine: Value) -> list[Value]:
        reflected, passed = lobes((ops.sqrt(1 - cosine * cosine), 0.0, cosine))
        facets[:] = [lobe.facets for lobe in (*reflected, passed)]
        return [c for lobe in (*reflected, passed) for c in channels(lobe)]

    def channels(lobe: Lobe) -> list[Value]:
        isotropic = [*colour(lobe.energy), lobe.roughness.alpha_u]
        return [*isotropic, lobe.roughness.alpha_v, *colour(lobe.gain)] if axes else isotropic

    return Memo(curve.sample(columns, number), colour, prepared, axes, facets)
