"""The surfaces that a material may be seen as."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura.model import Model, variance_kind
from velatura.model.lobe_statistics import StackLobes
from velatura.model.side_by_side import SideBySide
from velatura.model.variance import Isotropic
from velatura.optics import fresnel
from velatura.programs.surface import NO_COAT, Coat, Surface
from velatura.stack import RGB, InterfaceValues, Material, SlabValues

Array: TypeAlias = NDArray[np.floating]
Facets: TypeAlias = tuple[float, float, float]  # alpha along two axes, and the radians from the tangent to the first

SAME = 1e-6  # of roughnesses
ALTERNATIVES = 3  # surfaces that a mixture may be seen as, beside the likeliest
NO_FACETS = (0.25, 0.25)  # alpha where nothing reflects by it


@dataclass(frozen=True)
class Described:
    """A material for bakes: the values of its stacks, with the shares of these; the brushed lobes at normal incidence,
    the index that it transmits into (None if none), and the surfaces that it may be seen as, the likeliest first.
    """

    parts: tuple[tuple[float, Material], ...]
    brushed: tuple[Facets, ...]
    below: float | None
    surfaces: tuple[Surface, ...]

    @classmethod
    def of(cls, material: Material, model: Model) -> Described:
        """A single stack."""
        solid = material.solid()
        below = float(np.mean(solid.interfaces[-1].eta / solid.exterior)) if solid.transmits else None
        x, y, z = (np.array([w]) for w in (0.0, 0.0, 1.0))
        seen = model.statistics(solid, (x, y, z))
        brushed = variance_kind(solid) is not Isotropic
        lobes = tuple(_facets(seen, k) for k in range(len(seen.alpha) * brushed))
        return cls(((1.0, solid),), lobes, below, tuple(_surfaces(solid, seen)))

    @classmethod
    def beside(cls, each: Sequence[tuple[float, Described]]) -> Described:
        """Stacks side by side, each with its share: surfaces that have the means of theirs."""
        if len(each) == 1:
            return each[0][1]
        below = next((stack.below for _, stack in each if stack.below is not None), None)
        likeliest = [(share, stack.surfaces[0]) for share, stack in each]
        surfaces = [blended(likeliest)]
        for n, (share, stack) in enumerate(each):
            others = (blended([*likeliest[:n], (share, other), *likeliest[n + 1 :]]) for other in stack.surfaces[1:])
            surfaces += islice(others, ALTERNATIVES + 1 - len(surfaces))
        lobes = tuple(dict.fromkeys(lobe for _, stack in each for lobe in stack.brushed))
        parts = tuple((share, material) for share, stack in each for _, material in stack.parts)
        return cls(parts, lobes, below, tuple(surfaces))

    def body(self, model: Model) -> SideBySide:
        """The material as light meets it."""
        return SideBySide.of(self.parts, model)

    @property
    def material(self) -> Material:
        """A single stack's values."""
        ((_, material),) = self.parts
        return material

    @property
    def mixed(self) -> bool:
        """Whether media scatter light, above a base or a clear one."""
        return any(_scatters(material) for _, material in self.parts)

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
            for _, material in self.parts
            for each in material.interfaces
        )

    @property
    def blurred(self) -> bool:
        """Whether anything but facets of one interface spreads what is reflected, or light passes."""
        several = len(self.parts) > 1 or any(len(material.interfaces) > 1 for _, material in self.parts)
        return self.below is not None or several or self.mixed

    @property
    def thin(self) -> bool:
        """Whether what light passes into has the index that it came from."""
        return self.below is not None and abs(self.below - 1) < 1e-3


def blended(parts: Sequence[tuple[float, Surface]]) -> Surface:
    """The surface that has the means of those of parts, by their shares: of colours, roughnesses and indices.

    Shares that are metal and coated add up, and so do those of the rest of the base that are clear. Brushing, film and
    coat are those of the greatest share.
    """

    def mean(value: Callable[[Surface], Any], weight: Callable[[Surface], float] = lambda _: 1.0) -> Any:
        weights = [share * weight(each) for share, each in parts]
        values = [np.asarray(value(each), float) for _, each in parts]
        return np.average(values, axis=0, weights=weights if sum(weights) > 0 else None)

    by_share = [each for _, each in sorted(parts, key=lambda part: -part[0])]
    coat = next((each.coat for each in by_share if each.coated), NO_COAT)
    u, v = mean(lambda each: each.alpha).tolist()
    return Surface(
        (u, v),
        by_share[0].rotation,
        _rgb(mean(lambda each: each.colour, lambda each: 1 - each.clear)),
        metalness=float(mean(lambda each: each.metalness)),
        clear=float(mean(lambda each: each.clear, lambda each: 1 - each.metalness)),
        eta=float(mean(lambda each: each.eta, lambda each: 1 - each.metalness)),
        tint=_rgb(mean(lambda each: each.tint, lambda each: each.clear)),
        film=next((each.film for each in by_share if each.film), None),
        coat=replace(coat, share=float(mean(lambda each: each.coat.share * each.coated))),
        by_sight=True,
    )


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
