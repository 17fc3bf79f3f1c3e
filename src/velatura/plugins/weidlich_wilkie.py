"""The plugin `weidlich_wilkie`: layers of microfacets that all share one normal (Weidlich and Wilkie 2007).

    f = f_1(wi, wo) + T_12 a t f_2(wi', wo'),   a = exp(-tau (1/cos_i' + 1/cos_o')),   t = (1 - G) + T_21 G

with both directions refracted about their half-vector, and f_2 layered in turn.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import pi
from typing import Any

from velatura import kernel, ops
from velatura.binding import Asked, Binding, PointBSDF, plugin_class
from velatura.ops import Value
from velatura.optics import fresnel, ggx, refraction
from velatura.optics.ggx import Direction
from velatura.stack import BaseValues, InterfaceValues, Material, SlabValues, refuse_films
from velatura.stack.chain import Meeting, chain
from velatura.stack.layers import LayerValues

ALPHA_MIN = 1e-3  # lower roughness is evaluated as this
EXCEPTIONS = frozenset({"lossless"})  # laws of `velatura.checks`: light that is reflected twice, or passes, is lost


@kernel.plugin("weidlich_wilkie")
def make(mi: Any) -> type:
    """The class for the current variant."""

    class WeidlichWilkie(plugin_class(mi)):  # type: ignore[misc]
        """Layered material after Weidlich and Wilkie 2007, the baseline of the statistical models.

        Properties:
            material (string): a material file (YAML or JSON), the name of a preset, or JSON text.
            layerN_... (number, spectrum or texture; differentiable): values by flat name, as in `layered`.
            exterior (number, default 1): absolute index above.

        Light reflects once, at one of the interfaces; media absorb and do not scatter; nothing is transmitted.
        Interfaces of roughness below 0.001 are evaluated as of that. Each surface is a component, from the top, and
        those of a mixture follow each other, as in `layered`.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties, partial(WeidlichWilkieStack, mi))

    return WeidlichWilkie


class WeidlichWilkieStack:
    """One stack."""

    exceptions = EXCEPTIONS

    def __init__(self, mi: Any, binding: Binding) -> None:
        self.mi, self.binding, flags = mi, binding, mi.BSDFFlags
        stack = binding.stack
        refuse_films(stack, "weidlich_wilkie has")
        self.surfaces = stack.surfaces
        common = flags.FrontSide | (flags.SpatiallyVarying if binding.varies else flags.Empty)
        self.kinds = [flags.GlossyReflection] * len(self.surfaces)
        if stack.base:
            self.kinds[-1] = flags.DiffuseReflection
        glossy = flags.GlossyReflection | flags.Anisotropic
        self.components = [common | (glossy if kind == flags.GlossyReflection else kind) for kind in self.kinds]

    def update(self) -> None:
        pass

    def at(self, si: Any, asked: Asked, active: Any) -> WeidlichWilkiePoint:
        wanted = [surface for surface, is_asked in zip(self.surfaces, asked.components) if is_asked]
        return WeidlichWilkiePoint(self, self.binding.at(si, active), tuple(si.wi), wanted)

    def albedo(self, si: Any, active: Any) -> Any:
        import drjit as dr

        albedo = self.mi.UnpolarizedSpectrum(sum(_energies(self.binding.at(si, active), si.wi.z).values()))
        return dr.clip(albedo, 0, 1) & active & (si.wi.z > 0)


@dataclass(frozen=True)
class WeidlichWilkiePoint(PointBSDF):
    """A stack at a surface point, for light from one direction, by the `asked` surfaces."""

    stack: WeidlichWilkieStack
    material: Material
    wi: Direction
    asked: list[int]

    def draw(self, sample1: Any, sample2: Any, active: Any) -> tuple[Any, None]:
        import drjit as dr

        mi, kinds = self.stack.mi, self.stack.kinds
        bs = dr.zeros(mi.BSDFSample3f)
        wo, number = sample(self.material, self.wi, sample1, sample2.x, sample2.y, self.asked)
        bs.wo, bs.eta, bs.sampled_component = mi.Vector3f(*wo), 1.0, mi.UInt32(number)
        last = bs.sampled_component == len(kinds) - 1
        bs.sampled_type = dr.select(last, mi.UInt32(+kinds[-1]), mi.UInt32(+kinds[0]))
        return bs, None

    def eval_pdf(self, wo: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        mi, active = self.stack.mi, active & (self.wi[2] > 0) & (wo.z > 0)
        value = evaluate(self.material, self.wi, tuple(wo), self.asked)
        pdf = density(self.material, self.wi, tuple(wo), self.asked)
        return mi.depolarizer(mi.UnpolarizedSpectrum(value)) & active, dr.select(active, pdf, 0)


def evaluate(material: Material, wi: Direction, wo: Direction, asked: Sequence[int] | None = None) -> Value:
    """f(wi, wo) |cos theta_o|, a colour, for two directions above.

    `asked` are the surfaces whose light is asked for, by their place in the stack; None for all.
    """
    h = ggx.normalize((wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]))
    i, o = wi, wo
    asked = range(len(material.layers)) if asked is None else asked
    total: Value = 0.0
    passed: Value = 1.0
    for k, meeting in enumerate(chain(material)):
        layer = meeting.layer
        # Absorb on both ways through a medium
        if isinstance(layer, SlabValues):
            passed = passed * _absorbed(layer, ops.divide(1.0, i[2]) + ops.divide(1.0, o[2]))
            continue
        if isinstance(layer, BaseValues):
            total = total + passed * layer.albedo * ((k in asked) / pi)
            break
        # Reflect at an interface
        alpha_u, alpha_v, turned_i, turned_o, turned_h = _in_frame(layer, i, o, h)
        reflectance = _reflectance(meeting, ops.maximum(ggx.dot(i, h), 0.0))
        g = ggx.masking(turned_i, alpha_u, alpha_v) * ggx.masking(turned_o, alpha_u, alpha_v)
        lobe = ops.divide(ggx.ndf(turned_h, alpha_u, alpha_v) * g, 4 * ops.maximum(i[2] * o[2], 0.0))
        total = total + passed * reflectance * lobe * float(k in asked)
        if layer.kind != "dielectric":
            break
        # Pass it twice; what other facets shadow is not lost inside
        transmittance = 1 - reflectance
        passed = passed * transmittance * ((1 - g) + transmittance * g)
        eta = ops.mean(meeting.below / meeting.above)
        i, o = _refracted(i, h, eta), _refracted(o, h, eta)
        passed = ops.select((i[2] > 0) & (o[2] > 0), passed, 0.0)
    return total * wo[2]


def density(material: Material, wi: Direction, wo: Direction, asked: Sequence[int]) -> Value:
    """Density of `sample`, per solid angle, for two directions above."""
    h = ggx.normalize((wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]))
    total: Value = 0.0
    for k, share in _shares(material, asked):
        layer = material.layers[k]
        if not isinstance(layer, InterfaceValues):
            total = total + share * wo[2] / pi
            continue
        alpha_u, alpha_v, i, m = _in_frame(layer, wi, h)
        visible = ggx.ndf(m, alpha_u, alpha_v) * ggx.masking(i, alpha_u, alpha_v)
        total = total + share * visible * ops.divide(0.25, ops.maximum(wi[2], 0.0))
    return total


def sample(
    material: Material, wi: Direction, u: Value, u1: Value, u2: Value, asked: Sequence[int]
) -> tuple[Direction, Value]:
    """A direction, and the number of its surface: a lobe by its share, then a normal of that lobe that is visible from
    outside.

    The direction may lie below the surface, where it is worth nothing.
    """
    wo: Direction = (0.0, 0.0, 1.0)
    number, begin = 0.0, 0.0
    for k, share in _shares(material, asked):
        layer = material.layers[k]
        if not isinstance(layer, InterfaceValues):
            radius, phi = ops.sqrt(u1), 2 * pi * u2
            drawn = (radius * ops.cos(phi), radius * ops.sin(phi), ops.sqrt(1 - u1))
        else:
            alpha_u, alpha_v, i = _in_frame(layer, wi)
            h = ggx.sample_visible(i, alpha_u, alpha_v, u1, u2)
            drawn = ggx.rotate(ggx.reflect(i, h), -_rotation(layer))
        x, y, z = (ops.select(u >= begin, a, b) for a, b in zip(drawn, wo))
        wo, number = (x, y, z), ops.select(u >= begin, float(material.surfaces.index(k)), number)
        begin = begin + share
    return wo, number


def _shares(material: Material, asked: Sequence[int]) -> Iterator[tuple[int, Value]]:
    """Every queried surface with its share of samples: about its energy at normal incidence."""
    all_energies = _energies(material, 1.0)
    energies = {k: ops.mean(all_energies[k]) + 0.02 for k in asked}  # at a slant it may be more
    total = sum(energies.values())
    for k, energy in energies.items():
        yield k, energy / total


def _energies(material: Material, cosine: Value) -> dict[int, Value]:
    """Energy reflected by every surface, a colour, by its place: that of a stack of smooth ones."""
    energies: dict[int, Value] = {}
    left: Value = 1.0
    for k, meeting in enumerate(chain(material)):
        layer = meeting.layer
        if isinstance(layer, SlabValues):
            left = left * _absorbed(layer, 2 * ops.divide(1.0, cosine))
            continue
        if isinstance(layer, BaseValues):
            energies[k] = left * layer.albedo
            break
        reflectance = _reflectance(meeting, cosine)
        energies[k] = left * reflectance
        if layer.kind == "dielectric":
            left = left * (1 - reflectance) * (1 - reflectance)
            cosine = fresnel.cos_transmitted(cosine, ops.mean(meeting.below / meeting.above))
    return energies


def _absorbed(layer: SlabValues, ways: Value) -> Value:
    """Transmittance of a medium there and back; `ways` is the sum of both ways, in depths."""
    return ops.exp(-layer.tau_a * ways)


def _reflectance(meeting: Meeting[LayerValues], cosine: Value) -> Value:
    layer = meeting.layer
    assert isinstance(layer, InterfaceValues)
    if layer.kind == "mirror":
        return 1.0
    eta = meeting.below / meeting.above
    if layer.kind == "conductor":
        return fresnel.conductor(cosine, eta, layer.k / meeting.above)
    return fresnel.dielectric(cosine, eta)


def _refracted(w: Direction, h: Direction, eta: Value) -> Direction:
    """The direction below of light along w, pointing away from the next surface."""
    t = refraction.refract(w, h, eta)
    return -t[0], -t[1], -t[2]


def _rotation(layer: InterfaceValues) -> Value:
    return layer.rotation * (pi / 180)


def _in_frame(layer: InterfaceValues, *directions: Direction) -> tuple[Any, ...]:
    """Both roughnesses of an interface, and directions in its frame."""
    alpha_u, alpha_v = ops.maximum(layer.alpha_u, ALPHA_MIN), ops.maximum(layer.alpha_v, ALPHA_MIN)
    return alpha_u, alpha_v, *(ggx.rotate(w, _rotation(layer)) for w in directions)
