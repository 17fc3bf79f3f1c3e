"""The lobes of a uniform stack, computed once over direction, so that a look-up of all of them is one fetch.

Where all interfaces are isotropic they depend on the cosine alone; else on the azimuth as well, and are the same after
half a turn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

from velatura.model.papers.adding import Lobe
from velatura.model.papers.prepare import Prepared
from velatura.model.roughness_maps import AS_IT_IS
from velatura.model.variance import Isotropic
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid

# Reflected, and transmitted if anything is, for a direction above the surface
Lobes = Callable[[Direction], tuple[list[Lobe], Lobe | None]]


class SampledLobes(Protocol):
    """Columns of numbers that were sampled over direction."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    def __call__(self, w: Direction) -> Iterable[Value]: ...


@dataclass(frozen=True)
class PrecomputedLobes:
    """Energies and roughnesses of all lobes, the transmitted one last if there is one; `colour` makes an energy of
    `width` channels. There are `count` lobes."""

    curves: SampledLobes
    colour: Callable[..., Value]
    width: int
    prepared: Prepared
    count: int
    transmits: bool

    def __call__(self, w: Direction) -> tuple[list[Lobe], Lobe | None]:
        channels = iter(self.curves(w))
        lobes = [self._lobe(channels) for _ in range(self.count)]
        return (lobes[:-1], lobes[-1]) if self.transmits else (lobes, None)

    def _lobe(self, channels: Iterator[Value]) -> Lobe:
        energy = self._colour(channels)
        kind = self.prepared.variance
        roughness = kind(*(next(channels) for _ in kind.__dataclass_fields__)).roughness(AS_IT_IS)
        return Lobe(energy, kind.of(roughness, self.prepared.f), roughness)

    def _colour(self, channels: Iterator[Value]) -> Value:
        return self.colour(*(next(channels) for _ in range(self.width)))


def sample(
    lobes: Lobes, prepared: Prepared, number: type, colour: Callable[..., Value], transmits: bool
) -> PrecomputedLobes:
    """The lobes over direction, for Dr.Jit's types of numbers and colours."""
    shape = directional_grid.LINE if prepared.variance is Isotropic else directional_grid.PLANE
    reflected, passed = lobes(directional_grid.directions(shape, number))
    seen = [*reflected, passed] if transmits and passed is not None else reflected

    held = [column for lobe in seen for column in columns(lobe, prepared, colour)]
    curves = directional_grid.curves(held, shape, number)
    return PrecomputedLobes(curves, colour, len(colour()), prepared, len(seen), transmits)


def columns(lobe: Lobe, prepared: Prepared, apart: Callable[[Value], Iterable[Value]]) -> list[Value]:
    """The numbers of a lobe in a `PrecomputedLobes`, in order; `apart` gives the channels of a colour."""
    return [*apart(lobe.energy), *vars(prepared.variance.of(lobe.roughness, AS_IT_IS)).values()]
