"""Events of a path at one surface: scattering into a random direction, or into a given one.

All directions are local: the path comes from `wi`, which points away from the surface into the upper side, on either
side of the stack. Energy is followed, not radiance: no squared index enters. Where the path carries a polarisation,
facets reflect the share of it that follows; densities, which only weigh strategies, are those of unpolarised light.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx, refraction
from velatura.optics.ggx import Direction
from velatura.optics.polarisation import Light
from velatura.reference.layers import WalkedLayers, WalkedSurface, relative_index
from velatura.reference.metal import mean

HUGE = 1e15  # products of densities stay finite


@dataclass(frozen=True)
class SurfaceMeeting:
    """A path that meets surface `j` from `wi`, out of a slab of index `n_in`; beyond lies index `n_out`.

    That is in the stack where the light comes from `above`, or else below the surface. `light` is its polarisation,
    along -wi; None where that is left out. `sample` has no choice where the path `reflects`, or `refracts`.
    """

    layers: WalkedLayers
    j: Value
    n_in: Value
    n_out: Value
    wi: Direction
    above: Value
    light: Light | None = None
    reflects: Value = False
    refracts: Value = False

    @property
    def eta(self) -> Value:
        return relative_index(self.n_in, self.n_out)

    @property
    def opaque(self) -> Value:
        return False if self.layers.transmits else self.layers.is_base(self.j)

    def shares(self, cosine: Value) -> tuple[Value, Value]:
        """Reflectance and transmittance of a facet."""
        return self.layers.shares(self.j, cosine, self.n_in, self.n_out, self.above)

    def meet(self, i: Direction, h: Direction) -> tuple[tuple[Value, Value], Light | None, Light | None]:
        """`shares` of a facet of normal h for light from i, both in the frame of the surface, and the light once
        reflected, or refracted."""
        surface = self.layers.surface(self.j)
        light = self.light and self.light.seen_by(surface.into)
        shares, *sent = self.layers.meet(self.j, i, h, self.n_in, self.n_out, self.above, light)
        mirrored, refracted = (each and each.seen_by(surface.out_of) for each in sent)
        return shares, mirrored, refracted


@dataclass(frozen=True)
class ScatteringEvent:
    """A direction with its weight: value over density where it was drawn, else the value f |cos theta_o|.

    The densities weigh strategies against each other: that of scattering on (`sample`), and that of coming back the
    same way when refraction is certain (`sample_refraction`). At a smooth surface both are infinite, and stand for
    their ratio: the second is 1, and the first holds how far refraction spreads directions. `certain` is the density of
    `sample_refraction` here, and `reverse` that of `sample` coming back; of `sample_refraction` the latter is that of
    `sample` here. `light` is the polarisation along wo, None where it is left out or was not followed.
    """

    wo: Direction
    weight: Value
    reflected: Value
    density: Value
    density_back: Value
    certain: Value
    reverse: Value
    light: Light | None = None


def sample(meeting: SurfaceMeeting, carried: Value, u1: Value, u2: Value, u3: Value) -> ScatteringEvent:
    """Scatter once; reflection or refraction is chosen by the mean of the colours that the path carries."""
    return _with_diffuse_base(
        meeting,
        lambda: _sample_interface(meeting, carried, u1, u2, u3),
        lambda: _sample_diffuse(meeting, u1, u2),
    )


def evaluate(meeting: SurfaceMeeting, wo: Direction, reflected: Value) -> ScatteringEvent:
    """Scattering into `wo`, on the upper side where `reflected`; 0 at a smooth surface."""
    return _with_diffuse_base(
        meeting,
        lambda: _evaluate_interface(meeting, wo, reflected),
        lambda: _evaluate_diffuse(meeting, wo),
    )


def sample_refraction(meeting: SurfaceMeeting, u1: Value, u2: Value) -> ScatteringEvent:
    """Refract at a dielectric without a choice; `density` is that of this, `density_back` of `sample` coming back."""
    # Refract about a visible normal
    surface, eta = meeting.layers.surface(meeting.j), meeting.eta
    i = surface.into(meeting.wi)
    h = surface.sample_normal(i, u1, u2)
    o = refraction.refract(i, h, eta)
    # Weigh
    (_, transmittance), _, light = meeting.meet(i, h)
    weight = ops.select(o[2] < 0, transmittance * surface.masking(o), 0.0)
    density, back = _densities(surface, i, h, o, eta)
    density = ops.select(surface.smooth, 1.0, density)
    share = mean(transmittance)
    back = ops.select(surface.smooth, _spread(o, i, 1 / eta), back) * share
    return ScatteringEvent(surface.out_of(o), weight, False, density, back, density, density * share, light)


def sample_reflection(meeting: SurfaceMeeting, u1: Value, u2: Value) -> ScatteringEvent:
    """Reflect without a choice; densities as of `sample_refraction`."""
    return _with_diffuse_base(
        meeting,
        lambda: _sample_reflection(meeting, u1, u2),
        lambda: _from_outside(_sample_diffuse(meeting, u1, u2)),
    )


def _sample_reflection(meeting: SurfaceMeeting, u1: Value, u2: Value) -> ScatteringEvent:
    surface = meeting.layers.surface(meeting.j)
    i = surface.into(meeting.wi)
    h = surface.sample_normal(i, u1, u2)
    o = ggx.reflect(i, h)
    (reflectance, _), light, _ = meeting.meet(i, h)
    weight = ops.select(o[2] > 0, reflectance * surface.masking(o), 0.0)
    density, back = (ops.select(surface.smooth, 1.0, each) for each in _densities(surface, i, h, o, 1.0))
    share = mean(reflectance)
    return ScatteringEvent(surface.out_of(o), weight, True, density, back * share, density, density * share, light)


def _from_outside(event: ScatteringEvent) -> ScatteringEvent:
    """An event that has no other choice, with the densities of `sample_reflection`."""
    return replace(event, reverse=event.density)


def _sample_interface(meeting: SurfaceMeeting, carried: Value, u1: Value, u2: Value, u3: Value) -> ScatteringEvent:
    # Meet a visible normal
    surface, eta = meeting.layers.surface(meeting.j), meeting.eta
    i = surface.into(meeting.wi)
    h = surface.sample_normal(i, u1, u2)
    # Choose between reflection and refraction
    (reflectance, passing), mirrored, refracted = meeting.meet(i, h)
    chance = ops.divide(mean(carried * reflectance), mean(carried * (reflectance + passing)))
    chance = ops.select(meeting.refracts, 0.0, ops.select(meeting.opaque | meeting.reflects, 1.0, chance))
    reflected = u3 < chance
    o = ops.select_record(reflected, ggx.reflect(i, h), refraction.refract(i, h, eta))
    # Weigh
    share = ops.select(reflected, reflectance, passing)
    weight = ops.divide(share, ops.select(reflected, chance, 1 - chance)) * surface.masking(o)
    weight = ops.select(_same(o[2] > 0, reflected), weight, 0.0)
    certain, back = _densities(surface, i, h, o, ops.select(reflected, 1.0, eta))
    certain = ops.select(surface.smooth, ops.select(reflected, 1.0, _spread(i, o, eta)), certain)
    back = ops.select(surface.smooth, 1.0, back)
    light = ops.select_record(reflected, mirrored, refracted)
    wo, share = surface.out_of(o), mean(share)
    return ScatteringEvent(wo, weight, reflected, certain * share, back, certain, back * share, light)


def _evaluate_interface(meeting: SurfaceMeeting, wo: Direction, reflected: Value) -> ScatteringEvent:
    # Find the normal that serves
    surface, eta = meeting.layers.surface(meeting.j), ops.select(reflected, 1.0, meeting.eta)
    i, o = surface.into(meeting.wi), surface.into(wo)
    h = refraction.half_vector(i, o, eta)
    cos_i = ggx.dot(i, h)
    serves = (cos_i > 0) & _same(ggx.dot(o, h) > 0, reflected) & _negate(surface.smooth)
    # Evaluate
    shares, mirrored, refracted = meeting.meet(i, h)
    share, light = ops.select(reflected, *shares), ops.select_record(reflected, mirrored, refracted)
    certain, back = _densities(surface, i, h, o, eta)
    density, reverse = (ops.select(serves, each, 0.0) for each in (certain, back))
    weight, share = share * density * surface.masking(o), mean(share)
    return ScatteringEvent(wo, weight, reflected, density * share, back, certain, reverse * share, light)


def _densities(surface: WalkedSurface, i: Direction, h: Direction, o: Direction, eta: Value) -> tuple[Value, Value]:
    """Densities of the way from i to o by visible normals, per solid angle, and of the way back; Fresnel left out."""
    cos_i, cos_o = ggx.dot(i, h), ggx.dot(o, h)
    onward = surface.visible(i, h, ops.absolute(cos_i)) * refraction.jacobian(cos_i, cos_o, eta)
    back = surface.visible(o, h, ops.absolute(cos_o)) * refraction.jacobian(cos_o, cos_i, 1 / eta)
    return ops.minimum(onward, HUGE), ops.minimum(back, HUGE)


def _spread(i: Direction, o: Direction, eta: Value) -> Value:
    """Solid angle around i over that around o, where a smooth surface refracts one into the other."""
    return ops.divide(eta * eta * ops.absolute(o[2]), ops.absolute(i[2]))


def _sample_diffuse(meeting: SurfaceMeeting, u1: Value, u2: Value) -> ScatteringEvent:
    radius, phi, z = ops.sqrt(u1), 2 * pi * u2, ops.sqrt(1 - u1)
    wo = radius * ops.cos(phi), radius * ops.sin(phi), z
    light = meeting.light and meeting.light.depolarised(wo)
    density, back = z / pi, meeting.wi[2] / pi
    return ScatteringEvent(wo, meeting.layers.albedo, True, density, back, density, back, light)


def _evaluate_diffuse(meeting: SurfaceMeeting, wo: Direction) -> ScatteringEvent:
    density, back = ops.maximum(wo[2], 0.0) / pi, meeting.wi[2] / pi
    light = meeting.light and meeting.light.depolarised(wo)
    return ScatteringEvent(wo, meeting.layers.albedo * density, True, density, back, density, back, light)


def _with_diffuse_base(
    meeting: SurfaceMeeting, interface: Callable[[], ScatteringEvent], diffuse: Callable[[], ScatteringEvent]
) -> ScatteringEvent:
    if meeting.layers.base != "diffuse":
        return interface()
    if meeting.layers.count == 1:
        return diffuse()
    scattered: ScatteringEvent = ops.select_record(meeting.opaque, diffuse(), interface())
    return scattered


def _same(a: Value, b: Value) -> Value:
    return _negate(a ^ b)


def _negate(condition: Value) -> Value:
    return condition ^ True
