"""The plugin `layered_reference`: a stack of rough interfaces and media by random walks, exact but noisy."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from velatura import kernel, metals, ops
from velatura.binding import Asked, Binding, plugin_class
from velatura.errors import InvalidInput
from velatura.optics.polarisation import Transport, all_light, horizontal
from velatura.reference import proxy
from velatura.reference.layers import ALPHA_MIN, WalkedLayers, from_material, relative_index, zeros
from velatura.reference.metal import WAVELENGTHS
from velatura.reference.next_event import way_out
from velatura.reference.walk import Path, walk
from velatura.stack import Address, InterfaceValues, LayerValues
from velatura.stack.values import Pair

_MAX_DEPTH = 1000

#: Laws of `velatura.checks` that cannot hold: `pdf` is not the density of `sample`, and `eval` is an estimate. Nor is
#: anything lossless where light that meets a second facet of an interface is lost.
EXCEPTIONS = frozenset({"normalisation", "chi-square", "weights"})
LOSS = frozenset({"lossless"})
#: Light that has met a measured metal often may lie outside sRGB: then a channel of an estimate is negative; and where
#: the metal itself does, a channel is more than all light.
OUTSIDE, GAIN = frozenset({"finite"}), frozenset({"energy"})


@kernel.plugin("layered_reference")
def make(mi: Any) -> type:
    """The class for the current variant."""

    class LayeredReference(plugin_class(mi)):  # type: ignore[misc]
        """Layered material by position-free random walks (Guo et al. 2018).

        Properties:
            material (string): a material file (YAML or JSON), the name of a preset, or JSON text.
            layerN_... (number, spectrum or texture): values by flat name; they describe the whole stack, or change that
                of `material`. `layer0_eta`, `layer0_k`, `layer0_alpha_u`, `layer0_alpha_v`, `layer0_rotation`,
                `layer1_depth`, `layer1_sigma_a`, `layer1_sigma_s`, `layer1_g`, ...
            exterior (number, default 1): absolute index above.
            microsurface (boolean, default false): scatter many times between the facets of an interface (Heitz et al.
                2016). Otherwise light that meets a second facet is lost, as in Mitsuba's rough BSDFs.
            max_depth (integer, default 1000): events after which a path is cut off.
            seed (integer, default 0): of the random numbers; the same seed gives the same picture.

        `sample` walks, `eval` is an unbiased estimate, and `pdf` only resembles the density of `sample`: pictures
        converge to the truth, but the plugin fails a chi-square test. An interface whose roughness is below 1e-5 along
        both axes is perfectly smooth. Not differentiable. In RGB variants, an estimate for a stack that ends in a metal
        by name or by tables may have a negative channel, since light that has met it often lies outside sRGB.

        In polarised variants samples and values are Mueller matrices: interfaces polarise what they reflect and
        refract, media and diffuse bases depolarise what they scatter. Paths are drawn as for unpolarised light.

        Components are light that met only smooth interfaces (delta), light that the diffuse base scattered (diffuse),
        and all other light (glossy), by side. Those of a mixture follow each other; a path walks in one of its stacks.
        """

        def __init__(self, properties: Any) -> None:
            options = {"seed": 0, "microsurface": False, "max_depth": _MAX_DEPTH}
            chosen = {name: properties[name] if name in properties else options[name] for name in options}
            settings = Settings(
                seed=_integer("seed", chosen["seed"], 0, 2**32 - 1),
                max_depth=_integer("max_depth", chosen["max_depth"], 1, 10**6),
                microsurface=_switch("microsurface", chosen["microsurface"]),
            )
            super().__init__(properties, partial(WalkedStack, mi, settings), set(options), settings.facts)

    return LayeredReference


@dataclass(frozen=True)
class Settings:
    """How paths walk: properties of the plugin, the least roughness of interfaces, and from either end or from one."""

    seed: int
    max_depth: int
    microsurface: bool
    least_alpha: float = 0.0
    either_end: bool = False

    @property
    def facts(self) -> dict[str, str]:
        microsurface = str(self.microsurface).lower()
        return {"microsurface": microsurface, "max_depth": str(self.max_depth), "seed": str(self.seed)}


class WalkedStack:
    """One stack, by walks through it."""

    def __init__(self, mi: Any, settings: Settings, binding: Binding) -> None:
        self.mi, self.settings, self.binding = mi, settings, binding
        self.update()

    # The material, and what follows from it

    def update(self) -> None:
        """Determine the parts that the walk may leave out, and the kinds of scattering."""
        binding, flags = self.binding, self.mi.BSDFFlags
        peaks = {name: float(np.max(np.abs(np.array(value)))) for name, value in binding.constants.items()}
        seen = binding.material({**peaks, **binding.images})
        self.zeros = zeros(seen)
        metal = metals.of(seen, WAVELENGTHS)
        self.exceptions = EXCEPTIONS if self.settings.microsurface else EXCEPTIONS | LOSS
        if metal:
            self.exceptions |= OUTSIDE | GAIN if metal.exceeds else OUTSIDE
        # An interface whose roughness varies may be smooth here and rough there
        widest = [_widest(seen.layers[k]) for k in seen.surfaces]
        scatters = any(layer.spreads for k, layer in enumerate(seen.layers) if k not in seen.surfaces)
        least = self.settings.least_alpha
        rough = [alpha is None or max(alpha, least) >= ALPHA_MIN for alpha in widest]
        smooth = [least < ALPHA_MIN and (alpha is None or alpha < ALPHA_MIN) for alpha in widest]
        self.transmits, self.painted = binding.stack.transmits, binding.stack.base is not None
        self.glossy = scatters or any(rough)
        # Declare them
        sides = flags.FrontSide | (flags.BackSide if self.transmits else flags.Empty)
        varying = flags.Empty if binding.uniform else flags.SpatiallyVarying
        common = sides | varying | flags.Anisotropic
        there = {
            flags.GlossyReflection: scatters or any(rough[:-1] if self.painted else rough),
            flags.DeltaReflection: smooth[0] or (self.transmits and smooth[-1]),
            flags.DiffuseReflection: self.painted,
            flags.GlossyTransmission: self.transmits and self.glossy,
            flags.DeltaTransmission: self.transmits and all(smooth),
        }
        self.kinds = [kind for kind, is_there in there.items() if is_there]
        passing = (flags.GlossyTransmission, flags.DeltaTransmission)
        one_way = [flags.NonSymmetric if kind in passing else flags.Empty for kind in self.kinds]
        self.components = [kind | common | extra for kind, extra in zip(self.kinds, one_way)]

    def layers(self, si: Any, active: Any, flipped: Any) -> WalkedLayers:
        """The layers at a point, seen from below where `flipped`."""
        material = self.binding.at(si, active)
        material = material.each(self._walked)
        layers = from_material(self.mi, material, self.settings.microsurface)
        return layers.reversed(flipped) if self.transmits else layers

    def _walked(self, address: Address, value: Any) -> Any:
        """A value of a material as paths meet it."""
        if address in self.zeros:
            return 0.0
        least = self.settings.least_alpha
        return ops.maximum(value, least) if least and isinstance(address.declared, Pair) else value

    def stream(self, *numbers: Any) -> Any:
        """Random numbers that follow from the seed and from the query."""
        mi = self.mi
        a, b = mi.UInt32(self.settings.seed), mi.UInt32(0)
        bits = [_bits(mi, x) for x in numbers]
        for x, y in zip(bits[::2], bits[1::2]):
            a, b = mi.sample_tea_32(a ^ x, b ^ y, 4)
        return mi.PCG32(initstate=mi.UInt64(a), initseq=mi.UInt64(b))

    # As light meets it

    def at(self, si: Any, asked: Asked, active: Any) -> WalkedPoint:
        return WalkedPoint(self, si, dict(zip(self.kinds, asked.components)), asked.radiance)

    def albedo(self, si: Any, active: Any) -> Any:
        """Albedo by one path, and so an estimate."""
        import drjit as dr

        mi = self.mi
        random = self.stream(si.p.x, si.p.y, si.p.z, si.wi.x, si.wi.y, si.wi.z)
        u = mi.Point3f(random.next_float32(), random.next_float32(), random.next_float32())
        point = self.at(si, Asked([True] * len(self.kinds), False), active)
        _, weight = point.draw(u.x, mi.Point2f(u.y, u.z), active)
        return dr.clip(mi.unpolarized_spectrum(weight), 0, 1)


@dataclass(frozen=True)
class WalkedPoint:
    """A stack at a surface point, for light from one direction; `asked` is whether light of a kind is asked for."""

    stack: WalkedStack
    si: Any
    asked: dict[Any, bool]
    radiance: bool

    @property
    def eta(self) -> Any:
        """Index on the other side, over that on the side of the direction."""
        layers = self.stack.layers(self.si, True, self.si.wi.z < 0)
        return self.stack.mi.Float(relative_index(layers.index[0], layers.index[-1]))

    def draw(self, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        # Walk, from above
        stack, mi, si, wi = self.stack, self.stack.mi, self.si, self.si.wi
        flipped = wi.z < 0
        active = active & (True if stack.transmits else wi.z > 0)
        layers = stack.layers(si, active, flipped)
        rng = stack.stream(sample1, sample2.x, sample2.y, wi.x, wi.y, si.p.x, si.p.y, si.p.z)
        seen = (wi.x, wi.y, dr.abs(wi.z))
        one = layers.start(mi.UnpolarizedSpectrum(1))
        light = self._all_light(layers, seen, one)
        path = walk(mi, layers, seen, rng, one, active, stack.settings.max_depth, light=light)
        # Describe how it ended
        reflected = path.w[2] > 0
        bs = mi.BSDFSample3f()
        bs.wo = mi.Vector3f(path.w[0], path.w[1], dr.select(flipped, -path.w[2], path.w[2]))
        bs.eta = dr.select(reflected, 1.0, mi.Float(relative_index(layers.index[0], layers.index[-1])))
        bs.pdf = dr.select(path.smooth, 1.0, proxy.density(layers, seen, path.w))
        bs.sampled_component, bs.sampled_type, asked = self._drawn(reflected, path)
        passed = active & (path.alive ^ True) & asked
        squeezed = bs.eta * bs.eta if self.radiance else 1.0
        parts = path.light.rows(path.w) if isinstance(path.light, Transport) else [1.0]
        weights = [layers.seen(path.weight * part, mi.UnpolarizedSpectrum) for part in parts]
        values = [dr.select(passed, weight / squeezed, 0) for weight in weights]
        return bs, self._matrix(values, bs.wo, mi.Bool(False), flipped)

    def eval(self, wo: Any, active: Any) -> Any:
        import drjit as dr

        stack, mi, si, wi = self.stack, self.stack.mi, self.si, self.si.wi
        active = active & self._asked(wi.z * wo.z > 0)
        active = active & (True if stack.transmits else (wi.z > 0) & (wo.z > 0)) & stack.glossy
        rng = stack.stream(wi.x, wi.y, wo.x, wo.y, si.p.x, si.p.y, si.p.z, si.uv.x, si.uv.y, wo.z)
        # Walk from either end, towards the upper side, by which light leaves
        either = stack.settings.either_end
        turned = rng.next_float32() < 0.5 if either else mi.Bool(False)
        begin, end = dr.select(turned, wo, wi), dr.select(turned, wi, wo)
        flipped = end.z < 0
        layers = stack.layers(si, active, flipped)
        seen = (begin.x, begin.y, dr.select(flipped, -begin.z, begin.z))
        turns = seen[2] > 0 if either else False
        one = layers.start(mi.UnpolarizedSpectrum(1))
        leaving = end.x, end.y, dr.abs(end.z)
        out, rng = way_out(mi, layers, leaving, rng, turns, self._all_light(layers, leaving, one))
        depth, light = stack.settings.max_depth, self._all_light(layers, seen, one)
        path = walk(mi, layers, seen, rng, one, active, depth, out, self._painted, light, either)
        # Turn it around, and energy into radiance
        factor = dr.select(turned, dr.abs(wo.z) / dr.maximum(dr.abs(wi.z), 1e-7), 1.0)
        if stack.transmits:
            scale = dr.select(seen[2] > 0, 1.0, relative_index(layers.index[0], layers.index[-1]))
            factor *= dr.select(turned ^ mi.Bool(self.radiance), scale * scale, 1.0)
        values = [dr.select(active, factor * layers.seen(x, mi.UnpolarizedSpectrum), 0) for x in path.value]
        return self._matrix(values, wo, turned, flipped)

    def _all_light(self, layers: WalkedLayers, w: Any, one: Any) -> Transport | None:
        """Light along -w, as a path begins; None in variants without polarisation, and where a film has no matrix."""
        polarised = self.stack.mi.is_polarized and layers.polarises
        return all_light((-w[0], -w[1], -w[2]), one) if polarised else None

    def smooth(self, wo: Any) -> Any:
        """Mueller matrix of a stack of smooth interfaces, for its mirrored direction or the refracted one."""
        import drjit as dr

        mi, wi = self.stack.mi, self.si.wi
        flipped = wi.z < 0
        layers = self.stack.layers(self.si, True, flipped)
        found = ops.select_record(wi.z * wo.z > 0, *layers.of_smooth(dr.abs(wi.z)))
        one = layers.start(mi.UnpolarizedSpectrum(1))
        s, p, real, imaginary = (layers.seen(part * one, mi.UnpolarizedSpectrum) for part in vars(found).values())
        both, more, none = 0.5 * (s + p), 0.5 * (s - p), 0.0 * s
        rows = [both, more, none, none, more, both, none, none]
        rows += [none, none, real, -imaginary, none, none, imaginary, real]
        # Light that goes the other way has the same matrix
        return self._matrix(rows, wo, mi.Bool(False), flipped)

    def _matrix(self, parts: list[Any], wo: Any, turned: Any, flipped: Any) -> Any:
        """Mueller matrix in the frames of the renderer, by its `parts` row by row, of light that walks in; one part is
        that of depolarised light.

        Where the walk is `turned`, it came from `wo`; where it is `flipped`, its coordinates are upside down.
        """
        import drjit as dr

        mi = self.stack.mi
        if len(parts) == 1:
            return mi.depolarizer(parts[0])
        # Light walks in from the side from which the renderer has it come, or the other way
        other_way = turned ^ mi.Bool(self.radiance)
        mirrored, back = (1.0, 1.0, -1.0, -1.0), (1.0, 1.0, -1.0, 1.0)
        matrix = mi.Spectrum(0.0)
        for row in range(4):
            for column in range(4):
                part = dr.select(other_way, back[row] * back[column] * parts[4 * column + row], parts[4 * row + column])
                matrix[row, column] = part * dr.select(flipped, mirrored[row] * mirrored[column], 1.0)
        # From frames along the surface
        into, away = (wo, self.si.wi) if self.radiance else (self.si.wi, wo)
        before, after = (mi.Vector3f(*horizontal(tuple(w))) for w in (into, away))
        basis = mi.mueller.stokes_basis
        return mi.mueller.rotate_mueller_basis(matrix, -into, before, basis(-into), away, after, basis(away))

    def pdf(self, wo: Any, active: Any) -> Any:
        import drjit as dr

        stack, wi = self.stack, self.si.wi
        flipped = wi.z < 0
        active = active & self._asked(wi.z * wo.z > 0) & stack.glossy
        active = active & (True if stack.transmits else (wi.z > 0) & (wo.z > 0))
        layers = stack.layers(self.si, active, flipped)
        turned = (wo.x, wo.y, dr.select(flipped, -wo.z, wo.z))
        return dr.select(active, proxy.density(layers, (wi.x, wi.y, dr.abs(wi.z)), turned), 0)

    def eval_pdf(self, wo: Any, active: Any) -> tuple[Any, Any]:
        return self.eval(wo, active), self.pdf(wo, active)

    def _wanted(self, kind: Any) -> bool:
        return self.asked.get(kind, False)

    def _asked(self, reflected: Any) -> Any:
        """Whether any scattered light of that side is queried."""
        flags = self.stack.mi.BSDFFlags
        reflection = self._wanted(flags.GlossyReflection) or self._wanted(flags.DiffuseReflection)
        transmission = self._wanted(flags.GlossyTransmission)
        return (reflected & reflection) | ((reflected ^ True) & transmission)

    @property
    def _painted(self) -> bool | None:
        """Whether scattered light is asked for of the base alone, or of all else; None for both."""
        flags = self.stack.mi.BSDFFlags
        diffuse = self._wanted(flags.DiffuseReflection)
        return None if diffuse == self._wanted(flags.GlossyReflection) or not self.stack.painted else diffuse

    def _drawn(self, reflected: Any, path: Path) -> tuple[Any, Any, Any]:
        """Number and type of the component that a path belongs to, and whether it was asked for."""
        import drjit as dr

        mi, kinds, flags = self.stack.mi, self.stack.kinds, self.stack.mi.BSDFFlags
        passed = reflected ^ True
        belongs = {
            flags.GlossyReflection: reflected & ((path.smooth | path.painted) ^ True),
            flags.DeltaReflection: reflected & path.smooth,
            flags.DiffuseReflection: reflected & path.painted,
            flags.GlossyTransmission: passed & (path.smooth ^ True),
            flags.DeltaTransmission: passed & path.smooth,
        }
        number, kind, asked = mi.UInt32(0), mi.UInt32(+kinds[0]), mi.Bool(False)
        for k, each in enumerate(kinds):
            number, kind = dr.select(belongs[each], k, number), dr.select(belongs[each], +each, kind)
            asked |= belongs[each] & self._wanted(each)
        return number, kind, asked


def _widest(layer: LayerValues) -> float | None:
    """The larger roughness of a surface: None if a texture gives it, 1 for a diffuse base."""
    if not isinstance(layer, InterfaceValues):
        return 1.0
    alphas = (layer.alpha_u, layer.alpha_v)
    return max(alphas) if all(isinstance(alpha, float) for alpha in alphas) else None


def _bits(mi: Any, x: Any) -> Any:
    import drjit as dr

    if dr.is_jit_v(x):
        return dr.reinterpret_array(mi.UInt32, mi.Float32(x))
    return struct.unpack("I", struct.pack("f", x))[0]


def _integer(name: str, value: Any, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InvalidInput(f"{name}: must be a whole number from {low} to {high}, got {value!r}")
    return value


def _switch(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise InvalidInput(f"{name}: must be true or false, got {value!r}")
    return value
