"""A stack for the walk: surfaces, and the slabs of one index between them.

Slab k lies above surface k, so slab 0 is the exterior, and slab n lies below all n surfaces. Lengths are measured in
the depth of a slab, so that only optical depths remain. Which surface a path meets differs from lane to lane: `pick`
chooses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any

from velatura import metals, ops
from velatura.films.of_material import films_of
from velatura.films.polarised import matrices, opaque_matrix, polarise
from velatura.films.reflectance import InterfaceFilms
from velatura.media.of_material import phase_of
from velatura.ops import Value
from velatura.optics import fresnel, ggx
from velatura.optics.ggx import Direction
from velatura.optics.phase import PhaseFunction
from velatura.optics.polarisation import Light, Mueller, complement, mueller
from velatura.reference.metal import WAVELENGTHS, WalkedMetal
from velatura.stack import Address, BaseValues, InterfaceValues, Material, SlabValues
from velatura.stack.chain import chain
from velatura.stack.values import Pair

ALPHA_MIN = 1e-5  # an interface smoother than this along both axes is perfectly smooth
MATCHED = 1e-3  # and so is one between indices this close, which bends no light


@dataclass(frozen=True)
class WalkedSurface:
    """The roughness of one surface, positive, and its frame, turned by `rotation` (radians)."""

    alpha_u: Value
    alpha_v: Value
    rotation: Value
    smooth: Value

    def into(self, w: Direction) -> Direction:
        """Coordinates in the frame of the surface."""
        return w if _is_zero(self.rotation) else ggx.rotate(w, self.rotation)

    def out_of(self, w: Direction) -> Direction:
        """Coordinates back in the frame of the stack."""
        return w if _is_zero(self.rotation) else ggx.rotate(w, -self.rotation)

    def sample_normal(self, w: Direction, u1: Value, u2: Value) -> Direction:
        """A normal visible from `w`."""
        h = ggx.sample_visible(w, self.alpha_u, self.alpha_v, u1, u2)
        x, y, z = (ops.select(self.smooth, smooth, rough) for smooth, rough in zip((0.0, 0.0, 1.0), h))
        return x, y, z

    def masking(self, w: Direction) -> Value:
        """Smith's G1 from either side."""
        mirrored = w[0], w[1], ops.absolute(w[2])
        return ops.select(self.smooth, 1.0, ggx.masking(mirrored, self.alpha_u, self.alpha_v))

    def visible(self, w: Direction, h: Direction, cosine: Value) -> Value:
        """Density of normals visible from `w` on either side, where `cosine` = |w·h|."""
        masking = ggx.masking((w[0], w[1], ops.absolute(w[2])), self.alpha_u, self.alpha_v)
        return ops.divide(masking * ggx.ndf(h, self.alpha_u, self.alpha_v) * cosine, ops.absolute(w[2]))


@dataclass(frozen=True)
class WalkedSlab:
    """A medium by its optical depths along the normal, and its phase function, None where it scatters nothing, which
    decides which code is compiled."""

    absorption: Value = 0.0
    scattering: Value = 0.0
    phase: PhaseFunction | None = None

    @classmethod
    def of(cls, layer: SlabValues) -> WalkedSlab:
        return cls(layer.tau_a, layer.tau_s, None if _is_zero(layer.tau_s) else phase_of(layer))

    def absorbed(self, length: Value) -> Value:
        """Share that absorption leaves along a way of that length."""
        return ops.exp(-self.absorption * length)

    def straight(self, length: Value) -> Value:
        """Share that passes a way of that length, neither absorbed nor scattered."""
        return ops.exp(-(self.absorption + self.scattering) * length)


@dataclass(frozen=True)
class WalkedLayers:
    """Surfaces and slabs from the top, slab n included; `base` is the kind of the last surface.

    With `microsurface`, light scatters many times between the facets of a surface. `films` are those on each surface,
    counted from below where the stack is `flipped`. Between media without an interface there is a smooth surface that
    bends no light: `above` are the numbers of other surfaces above each slab. Where a `metal` of measured index lies
    below, paths carry light of its wavelengths. `light` is that of the material.
    """

    base: str
    surfaces: tuple[WalkedSurface, ...]
    slabs: tuple[WalkedSlab, ...]
    index: tuple[Value, ...]
    extinction: Value = 0.0
    albedo: Value = 0.0
    microsurface: bool = False
    films: tuple[InterfaceFilms | None, ...] = ()
    flipped: Value = False
    above: tuple[int, ...] = ()
    metal: WalkedMetal | None = None
    light: Any = "srgb"

    @property
    def count(self) -> int:
        return len(self.surfaces)

    @property
    def transmits(self) -> bool:
        return self.base == "dielectric"

    @property
    def scatters(self) -> bool:
        """Whether any medium scatters."""
        return any(slab.phase for slab in self.slabs)

    def reversed(self, where: Value) -> WalkedLayers:
        """The stack seen from below where the condition holds; only for one that transmits."""

        surfaces, slabs, index = (
            ops.select_record(where, items[::-1], items) for items in (self.surfaces, self.slabs, self.index)
        )
        return replace(self, surfaces=surfaces, slabs=slabs, index=index, flipped=where)

    def start(self, one: Value) -> Value:
        """Weight of a path at first, in place of a colour of ones."""
        return self.metal.one if self.metal else one

    def seen(self, carried: Value, kind: Any) -> Value:
        """Weight of a path as a colour of a renderer's type."""
        return self.metal.seen(carried, kind) if self.metal else carried

    # Surfaces and slabs -----------------------------------------------------------------------------------------------

    def surface(self, j: Value) -> WalkedSurface:
        return pick(self.surfaces, j)

    def slab(self, k: Value) -> WalkedSlab:
        return pick(self.slabs, k)

    @property
    def hazy(self) -> bool:
        """Whether a medium lies outside of all surfaces, which light may come back from."""
        return bool(self.slabs[0].phase or self.slabs[-1].phase)

    def outside(self, k: Value) -> Value:
        """Whether light in slab k has left for good."""
        if self.hazy:
            return False
        return (k == 0) | (k == self.count) if self.transmits else k == 0

    def is_base(self, j: Value) -> Value:
        return True if self.count == 1 else j == self.count - 1

    def shares(self, j: Value, cosine: Value, n_in: Value, n_out: Value, above: Value) -> tuple[Value, Value]:
        """Fresnel reflectance and transmittance of a facet of surface j: colours, for light from the side of index
        `n_in`, which is the one above where the condition holds.

        All colours are refracted into one direction, that of the mean indices; where there is none, none pass.
        """
        if self.base == "mirror":
            base: Value = 1.0
        elif self.metal:
            base = self.metal.reflectance(cosine, n_in)
        elif self.base == "conductor" and self.films[-1]:
            base = self.films[-1].at(cosine, n_in)
        elif self.base == "conductor":
            base = fresnel.conductor(cosine, self.index[-1] / n_in, self.extinction / n_in)
        else:
            base = None
        if self.count == 1 and base is not None:
            return base, 0.0 * base
        cos_t = fresnel.cos_transmitted(cosine, relative_index(n_in, n_out))
        reflected = ops.select(cos_t > 0, fresnel.dielectric_between(cosine, cos_t, n_out / n_in), 1.0)
        passing = 1 - reflected
        if any(self._on_dielectrics):
            bare, above = (reflected, passing), self._from_above(above)
            each = [films.shares(above, cosine, cos_t, n_in) if films else bare for films in self._on_dielectrics]
            reflected, passing = (self._of_interface(column, j) for column in zip(*each))
        if base is None:
            return reflected, passing
        if self.metal:
            reflected, passing = self.metal.wide(reflected), self.metal.wide(passing)
        is_base = self.is_base(j)
        return ops.select(is_base, base, reflected), ops.select(is_base, 0.0, passing)

    @property
    def _on_dielectrics(self) -> Sequence[InterfaceFilms | None]:
        """The films on each surface, but for those of an opaque one."""
        return self.films if self.transmits else (*self.films[:-1], None)

    def _from_above(self, above: Value) -> Value:
        """Whether light comes from the side above as films are listed."""
        return above if self.flipped is False else self.flipped ^ above

    @property
    def polarises(self) -> bool:
        """Whether matrices of all films are known."""
        return all(polarise(films) for films in self.films if films)

    def mueller(self, j: Value, cosine: Value, n_in: Value, n_out: Value, above: Value) -> tuple[Mueller, Mueller]:
        """Mueller matrices of the light that a facet reflects, and refracts: `shares` of polarised light."""
        eta = relative_index(n_in, n_out)
        cos_t = fresnel.cos_transmitted(cosine, eta)
        passes = cos_t > 0
        between = mueller(*fresnel.dielectric_amplitudes(cosine, cos_t, n_out / n_in))
        total = mueller(*fresnel.total_amplitudes(cosine, eta))
        reflection = ops.select_record(passes, between, replace(total, s=1.0, p=1.0))
        refraction = complement(reflection)
        if any(self._on_dielectrics):
            bare, seen = (reflection, refraction), (self._from_above(above), cosine, cos_t, eta, n_in)
            each = [matrices(films, self.light, *seen) if films else bare for films in self._on_dielectrics]
            reflection, refraction = (self._of_interface(column, j) for column in zip(*each))
        if self.base == "mirror":
            base = Mueller(1.0, 1.0, -1.0, 0.0)
        elif self.metal:
            base = mueller(*self.metal.amplitudes(cosine, n_in))
            reflection, refraction = (
                Mueller(*map(self.metal.wide, vars(x).values())) for x in (reflection, refraction)
            )
        elif self.base == "conductor" and (films := self.films[-1]):
            base = opaque_matrix(films, self.light, cosine, n_in)
        elif self.base == "conductor":
            base = mueller(*fresnel.conductor_amplitudes(cosine, self.index[-1] / n_in, self.extinction / n_in))
        else:
            return reflection, refraction
        return ops.select_record(self.is_base(j), base, reflection), refraction

    def _of_interface(self, items: Sequence[Any], j: Value) -> Any:
        """Value or record of surface j, among those of the interfaces as they are listed."""
        return ops.select_record(self.flipped, pick(items[::-1], j), pick(items, j))

    def of_smooth(self, cosine: Value) -> tuple[Mueller, Mueller]:
        """Matrices of all light that smooth surfaces reflect, and transmit, in the frame along them; nothing scatters.

        Each surface in turn is put on top of those below it, between which light goes to and fro.
        """
        cosines = [cosine]
        for k in range(self.count):
            cosines.append(fresnel.cos_transmitted(cosines[k], relative_index(self.index[k], self.index[k + 1])))
        passed = Mueller(1.0, 1.0, 1.0, 0.0)
        reflected = passed * 0.0
        for k in reversed(range(self.count)):
            above, below = self.index[k], self.index[k + 1]
            left = self.slabs[k + 1].straight(ops.divide(1.0, cosines[k + 1]))
            reflection, refraction = self.mueller(k, cosines[k], above, below, True)
            if k == self.count - 1 and not self.transmits:
                reflected, passed = reflection, refraction
                continue
            back, out = self.mueller(k, cosines[k + 1], below, above, False)
            returned = reflected * (left * left)
            inside = refraction * (back * returned).repeated()
            reflected = reflection + inside * returned * out
            passed = inside * passed * left
        left = self.slabs[0].straight(ops.divide(1.0, cosine))
        return reflected * (left * left), passed * left

    def meet(
        self,
        j: Value,
        i: Direction,
        h: Direction,
        n_in: Value,
        n_out: Value,
        above: Value,
        light: Light | None,
    ) -> tuple[tuple[Value, Value], Light | None, Light | None]:
        """`shares` of a facet of normal h for light from i, and the light once reflected, or refracted; `light` is None
        where polarisation is left out."""
        cosine = ops.maximum(ggx.dot(i, h), 0.0)
        if light is None:
            return self.shares(j, cosine, n_in, n_out, above), None, None
        reflection, refraction = self.mueller(j, cosine, n_in, n_out, above)
        light = light.at((-i[0], -i[1], -i[2]), h)
        shares = light.share(reflection), light.share(refraction)
        return shares, light.sent(reflection), light.sent(refraction)


def from_material(types: Any, material: Material, microsurface: bool) -> WalkedLayers:
    """The layers of a material, in numbers and colours of any dialect; `types` is a module of the dialect's types."""
    surfaces: list[WalkedSurface] = []
    slabs: list[WalkedSlab] = []
    index: list[Value] = [material.exterior]
    films: list[InterfaceFilms | None] = []
    above = [0]
    medium, last = None, material.layers[-1]
    for meeting in chain(material, films_of(material)):
        layer = meeting.layer
        if isinstance(layer, SlabValues) and medium is None:
            medium = WalkedSlab.of(layer)
            continue
        slabs.append(medium or WalkedSlab())
        films.append(meeting.films)
        index.append(1.0 if meeting.below is None else meeting.below)
        if isinstance(layer, SlabValues):
            surfaces.append(WalkedSurface(ALPHA_MIN, ALPHA_MIN, 0.0, True))
            medium = WalkedSlab.of(layer)
        else:
            surfaces.append(_surface(layer, *index[-2:]))
            medium = None
        above.append(above[-1] + (medium is None))
    extinction = last.k if isinstance(last, InterfaceValues) and last.k is not None else 0.0
    spectrum, metal = metals.of(material, WAVELENGTHS), None
    if spectrum:
        metal = WalkedMetal(types, spectrum)
        slabs = [
            replace(slab, absorption=metal.wide(slab.absorption), scattering=metal.wide(slab.scattering))
            for slab in slabs
        ]
    return WalkedLayers(
        "diffuse" if isinstance(last, BaseValues) else last.kind,
        tuple(surfaces),
        (*slabs, WalkedSlab()),
        tuple(index),
        extinction,
        last.albedo if isinstance(last, BaseValues) else 0.0,
        microsurface,
        tuple(films),
        above=tuple(above),
        metal=metal,
        light=material.light,
    )


def zeros(material: Material) -> set[Address]:
    """Values that are known to be 0, and as plain numbers spare work in every step. A roughness does not: whether it is
    0 decides between two ways to go on."""
    return {
        address for address, value in material.values() if _is_zero(value) and not isinstance(address.declared, Pair)
    }


def pick(items: Sequence[Any], index: Value) -> Any:
    """The value or record at an index that differs from lane to lane; without a look-up where all are one."""
    chosen = items[-1]
    for i, item in reversed(list(enumerate(items[:-1]))):
        chosen = ops.select_record(index == i, item, chosen)
    return chosen


def relative_index(n_in: Value, n_out: Value) -> Value:
    """One relative index for all colours, by which light is refracted; exactly inverted for light that returns."""
    return ops.mean(n_out) / ops.mean(n_in)


def _surface(layer: InterfaceValues | BaseValues, above: Value, below: Value) -> WalkedSurface:
    if isinstance(layer, BaseValues):
        return WalkedSurface(1.0, 1.0, 0.0, False)
    u, v, rotation = layer.alpha_u, layer.alpha_v, layer.rotation
    matched = layer.kind == "dielectric" and ops.absolute(relative_index(above, below) - 1) < MATCHED
    smooth = (ops.maximum(u, v) < ALPHA_MIN) | matched
    turn = 0.0 if _is_zero(rotation) else rotation * (pi / 180)
    return WalkedSurface(ops.maximum(u, ALPHA_MIN), ops.maximum(v, ALPHA_MIN), turn, smooth)


def _is_zero(x: Value) -> bool:
    return isinstance(x, float) and x == 0.0
