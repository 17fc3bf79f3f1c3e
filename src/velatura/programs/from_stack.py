"""The surfaces that a stack may be seen as."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura.model import Model, variance_kind
from velatura.model.lobe_statistics import StackLobes
from velatura.model.variance import Isotropic
from velatura.optics import fresnel
from velatura.programs.surface import Coat, Surface
from velatura.stack import RGB, InterfaceValues, Material, SlabValues

Array: TypeAlias = NDArray[np.floating]
Facets: TypeAlias = tuple[float, float, float]  # alpha along two axes, and the radians from the tangent to the first

SAME = 1e-6  # of roughnesses
NO_FACETS = (0.25, 0.25)  # alpha where nothing reflects by it


@dataclass(frozen=True)
class Described:
    """A stack for bakes: its values, the brushed lobes at normal incidence, the index that it transmits into (None if
    none), and the surfaces that it may be seen as, the likeliest first.
    """

    material: Material
    brushed: tuple[Facets, ...]
    below: float | None
    surfaces: tuple[Surface, ...]

    @classmethod
    def of(cls, material: Material, model: Model) -> Described:
        solid = material.solid()
        below = float(np.mean(solid.interfaces[-1].eta / solid.exterior)) if solid.transmits else None
        x, y, z = (np.array([w]) for w in (0.0, 0.0, 1.0))
        seen = model.statistics(solid, (x, y, z))
        brushed = variance_kind(solid) is not Isotropic
        lobes = tuple(_facets(seen, k) for k in range(len(seen.alpha) * brushed))
        return cls(solid, lobes, below, tuple(_surfaces(solid, seen)))

    @property
    def mixed(self) -> bool:
        """Whether media scatter light, above a base or a clear one."""
        return _scatters(self.material)

    @property
    def coated(self) -> bool:
        """Whether a surface has a coat."""
        return any(surface.coated for surface in self.surfaces)

    @property
    def film(self) -> bool:
        """Whether a surface has a film."""
        return any(surface.film for surface in self.surfaces)

    @property
    def tinted(self) -> bool:
        """Whether reflectances at the normal are not those of one index for all colours."""
        return any(
            each.kind != "dielectric" or bool(each.films) or np.ptp(np.broadcast_to(each.eta, (3, 1))) > 1e-6
            for each in self.material.interfaces
        )

    @property
    def blurred(self) -> bool:
        """Whether anything but facets of one interface spreads what is reflected, or light passes."""
        return self.below is not None or len(self.material.interfaces) > 1 or self.mixed

    @property
    def thin(self) -> bool:
        """Whether what light passes into has the index that it came from."""
        return self.below is not None and abs(self.below - 1) < 1e-3


def _surfaces(material: Material, seen: StackLobes) -> Iterator[Surface]:
    """Several ways to see the stack, from its lobes at normal incidence."""
    energy = np.array([each[:, 0] for each in seen.energy]).clip(0)  # (lobes, 3)
    remainder = seen.remainder[:, 0].clip(0)
    interfaces = list(material.interfaces)
    if not interfaces:
        yield Surface(NO_FACETS, colour=_rgb(remainder), eta=1.0, by_sight=True)
        return

    first = interfaces[0]
    film = _film(interfaces)
    all_light = energy.sum(axis=0) + remainder
    eta_1 = float(np.mean(first.eta / material.exterior)) if first.kind == "dielectric" else 1.0
    coated = first.kind == "dielectric" and len(energy) > 1
    if material.transmits:
        yield from _clear(seen, eta_1, film)
        return

    under = energy[1:] if coated else energy
    of_facets = under.sum(axis=0)
    strongest = int(np.argmax(under.mean(axis=1))) + coated if of_facets.mean() > 0 else 0
    alpha, turn = _along(seen, strongest)
    metallic = any(each.kind != "dielectric" for each in interfaces)
    mixed = _scatters(material)
    share = float(of_facets.mean() / max((of_facets + remainder).mean(), 1e-6)) if mixed else float(metallic)
    entered = 1 - fresnel.normal_incidence(eta_1)
    second = interfaces[1] if coated else first
    eta = float(np.mean(second.eta / first.eta)) if coated and second.kind == "dielectric" else 1.0
    color = (of_facets + remainder) / entered**2
    if not (mixed or metallic):
        color = remainder / (entered * (1 - fresnel.normal_incidence(eta)))
    plain = Surface(alpha, turn, _rgb(color), share, eta=max(eta_1, 1.0), film=film, by_sight=True)
    if coated:
        coat = Coat(eta_1, *_along(seen, 0))
        below = replace(plain, eta=max(eta, 1.0), coat=coat)
        yield below
        if 0 < share < 1:
            yield replace(below, metalness=1.0)
        deep = _absorbed(material)
        if deep.min() < 0.98:
            shown = _rgb(color / np.maximum(deep, color))
            yield replace(below, colour=shown, coat=replace(coat, colour=_rgb(deep)))
        yield replace(plain, alpha=coat.alpha, rotation=coat.rotation, metalness=0.0)
    elif first.kind == "dielectric":
        # A dielectric over a diffuse base
        yield replace(plain, metalness=0.0)
    else:
        yield replace(plain, colour=_rgb(all_light), metalness=1.0)


def _clear(seen: StackLobes, eta_1: float, film: tuple[float, float] | None) -> Iterator[Surface]:
    """One interface that does all, one that does not deflect light, and one below a coat; of three only the last."""
    energy = np.array([each[:, 0] for each in seen.energy]).clip(0)
    tint = _rgb(seen.passed[:, 0] / np.maximum(1 - energy.sum(axis=0), 1e-3))
    alpha, turn = _along(seen, int(np.argmax(energy.mean(axis=1))))
    eta = _index_of(float(energy.sum(axis=0).mean()))
    one = Surface(alpha, turn, tint, clear=1.0, eta=eta, tint=tint, film=film, by_sight=True)
    passed = seen.transmitted if len(energy) > 1 else None
    if len(energy) < 3 or not passed:
        yield one
        yield replace(one, eta=1.0)
    if passed:
        u, v = (float(x) for x in passed.alpha[:, 0])
        below = _index_of(float(energy[1:].sum(axis=0).mean()))
        yield replace(one, alpha=(max(u, v), min(u, v)), eta=below, coat=Coat(eta_1, *_along(seen, 0)))


def _scatters(material: Material) -> bool:
    return any(isinstance(layer, SlabValues) and layer.spreads for layer in material.layers)


def _facets(seen: StackLobes, k: int) -> Facets:
    """Roughness of a lobe with the greater one first, which programs have along the tangent."""
    (u, v), turn = seen.alpha[k][:, 0], float(seen.rotation[k][0])
    return (float(u), float(v), turn) if u > v * (1 - SAME) else (float(v), float(u), turn + np.pi / 2)


def _along(seen: StackLobes, k: int) -> tuple[tuple[float, float], float]:
    """Roughness of a lobe, and the degrees from the tangent to its first axis."""
    u, v, turn = _facets(seen, k)
    return (u, v), float(np.degrees(turn))


def _rgb(colour: Array) -> RGB:
    r, g, b = (float(x) for x in np.clip(colour, 0, 1))
    return r, g, b


def _film(interfaces: list[InterfaceValues]) -> tuple[float, float] | None:
    """All films of the first interface that has some, as one of the same optical thickness."""
    for each in interfaces:
        if each.films:
            nm = sum(float(film.thickness_nm) for film in each.films)
            path = sum(float(np.mean(film.eta)) * float(film.thickness_nm) for film in each.films)
            return (path / nm, nm) if nm > 0 else None
    return None


def _absorbed(material: Material) -> Array:
    """Transmittance of all media, for light that crosses them twice without scattering."""
    depth = sum((m.tau_a for m in material.layers if isinstance(m, SlabValues)), np.zeros((3, 1)))
    return np.asarray(np.exp(-2 * np.broadcast_to(depth, (3, 1))[:, 0]))


def _index_of(f_0: float) -> float:
    """The index of a dielectric of a reflectance at normal incidence."""
    root = np.sqrt(np.clip(f_0, 0, 0.8))
    return float((1 + root) / (1 - root))
