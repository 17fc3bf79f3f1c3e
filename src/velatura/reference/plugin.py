"""The plugin `layered_reference`: a stack of rough interfaces and media by random walks, exact but noisy."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from velatura import kernel
from velatura.binding import Binding
from velatura.errors import InvalidInput
from velatura.reference import proxy
from velatura.reference.connection import way_out
from velatura.reference.layers import ALPHA_MIN, Layers, from_values, relative_index
from velatura.reference.walk import walk

_MAX_DEPTH = 1000

#: Laws of `velatura.checks` that cannot hold: `pdf` is not the density of `sample`, and `eval` is an estimate. Nor is
#: anything lossless where light that meets a second facet of an interface is lost.
EXCEPTIONS = frozenset({"normalisation", "chi-square", "weights"})
LOSS = frozenset({"lossless"})


@kernel.plugin("layered_reference")
def make(mi: Any) -> type:
    """The class for the variant that is set."""
    import drjit as dr

    flags = mi.BSDFFlags

    class LayeredReference(mi.BSDF):
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
        converge to the truth, but the plugin fails a chi-square test. An interface whose roughness is below 0.001 along
        both axes is perfectly smooth. Not differentiable.
        """

        def __init__(self, properties: Any) -> None:
            mi.BSDF.__init__(self, properties)
            options = {"seed": 0, "microsurface": False, "max_depth": _MAX_DEPTH}
            chosen = {name: properties[name] if name in properties else options[name] for name in options}
            self.seed = _integer("seed", chosen["seed"], 0, 2**32 - 1)
            self.max_depth = _integer("max_depth", chosen["max_depth"], 1, 10**6)
            self.microsurface = _switch("microsurface", chosen["microsurface"])
            self.exceptions = EXCEPTIONS if self.microsurface else EXCEPTIONS | LOSS
            self.binding = Binding(mi, properties, set(options))
            self._update()

        # The material, and what follows from it

        def traverse(self, callback: Any) -> None:
            self.binding.traverse(callback)

        def parameters_changed(self, keys: list[str]) -> None:
            self.binding.update()
            self._update()

        def _update(self) -> None:
            """Find out what the walk may leave out, and which kinds of scattering there are."""
            binding = self.binding
            peaks = {name: float(np.max(np.abs(np.array(value)))) for name, value in binding.constants.items()}
            # Zeros that spare work in every step
            spared = ("_rotation", "_sigma_a", "_sigma_s")
            self.zeros = {name: 0.0 for name, peak in peaks.items() if peak == 0 and name.endswith(spared)}
            # An interface whose roughness varies may be smooth here and rough there
            kinds = binding.stack.kinds
            surfaces = [i for i, kind in enumerate(kinds) if kind != "medium"]
            widest = [_widest(peaks, kinds[i], i) for i in surfaces]
            scatters = any(name.endswith("_sigma_s") and name not in self.zeros for name in binding.stack.flat())
            glossy = scatters or any(alpha is None or alpha >= ALPHA_MIN for alpha in widest)
            smooth = [alpha is None or alpha < ALPHA_MIN for alpha in widest]
            self.transmits = binding.stack.transmits
            # Declare them
            sides = flags.FrontSide | (flags.BackSide if self.transmits else flags.Empty)
            varying = flags.Empty if binding.uniform else flags.SpatiallyVarying
            common = sides | varying | flags.Anisotropic
            empty = flags.Empty
            reflection = (flags.GlossyReflection if glossy else empty) | (flags.DeltaReflection if smooth[0] else empty)
            components = [reflection | common]
            if self.transmits:
                delta = flags.DeltaTransmission if all(smooth) else empty
                components.append((flags.GlossyTransmission if glossy else empty) | delta | common | flags.NonSymmetric)
            self.glossy = glossy
            self.m_components = components
            self.m_flags = components[0] | components[-1]

        def _layers(self, si: Any, active: Any, flipped: Any) -> Layers:
            """The layers at a point, seen from below where `flipped`."""
            values = {**self.binding.at(si, active), **self.zeros}
            layers = from_values(self.binding.stack.kinds, values, self.binding.stack.thin, self.microsurface)
            return layers.reversed(flipped) if self.transmits else layers

        def _stream(self, *numbers: Any) -> Any:
            """Random numbers that follow from the seed and from what was asked."""
            a, b = mi.UInt32(self.seed), mi.UInt32(0)
            bits = [_bits(mi, x) for x in numbers]
            for x, y in zip(bits[::2], bits[1::2]):
                a, b = mi.sample_tea_32(a ^ x, b ^ y, 4)
            return mi.PCG32(initstate=mi.UInt64(a), initseq=mi.UInt64(b))

        # What a BSDF is asked

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            # Walk, from above
            wi, flipped = si.wi, si.wi.z < 0
            active = active & (True if self.transmits else wi.z > 0)
            layers = self._layers(si, active, flipped)
            rng = self._stream(sample1, sample2.x, sample2.y, wi.x, wi.y, si.p.x, si.p.y, si.p.z)
            seen = (wi.x, wi.y, dr.abs(wi.z))
            path = walk(mi, layers, seen, rng, mi.UnpolarizedSpectrum(1), active, self.max_depth)
            # Describe how it ended
            reflected = path.w[2] > 0
            bs = mi.BSDFSample3f()
            bs.wo = mi.Vector3f(path.w[0], path.w[1], dr.select(flipped, -path.w[2], path.w[2]))
            bs.eta = dr.select(reflected, 1.0, mi.Float(relative_index(layers.index[0], layers.index[-1])))
            bs.pdf = dr.select(path.smooth, 1.0, proxy.density(layers, seen, path.w))
            bs.sampled_component = dr.select(reflected, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = _sampled_type(path.smooth, reflected)
            passed = active & (path.alive ^ True) & self._asked(ctx, reflected)
            if ctx.mode == mi.TransportMode.Radiance:
                path.weight /= bs.eta * bs.eta
            return bs, mi.depolarizer(dr.select(passed, path.weight, 0))

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            # Walk towards the upper side, by which light leaves
            wi, flipped = si.wi, wo.z < 0
            active = active & self._asked(ctx, wi.z * wo.z > 0)
            active = active & (True if self.transmits else (wi.z > 0) & (wo.z > 0)) & self.glossy
            layers = self._layers(si, active, flipped)
            rng = self._stream(wi.x, wi.y, wo.x, wo.y, si.p.x, si.p.y, si.p.z, si.uv.x, si.uv.y, wo.z)
            out, rng = way_out(mi, layers, (wo.x, wo.y, dr.abs(wo.z)), rng)
            seen = (wi.x, wi.y, dr.select(flipped, -wi.z, wi.z))
            path = walk(mi, layers, seen, rng, mi.UnpolarizedSpectrum(1), active, self.max_depth, out)
            # Turn energy into radiance
            if self.transmits and ctx.mode == mi.TransportMode.Radiance:
                scale = dr.select(seen[2] > 0, 1.0, relative_index(layers.index[0], layers.index[-1]))
                path.value *= scale * scale
            return mi.depolarizer(dr.select(active, path.value, 0))

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            flipped = si.wi.z < 0
            active = active & self._asked(ctx, si.wi.z * wo.z > 0) & self.glossy
            active = active & (True if self.transmits else (si.wi.z > 0) & (wo.z > 0))
            layers = self._layers(si, active, flipped)
            turned = (wo.x, wo.y, dr.select(flipped, -wo.z, wo.z))
            return dr.select(active, proxy.density(layers, (si.wi.x, si.wi.y, dr.abs(si.wi.z)), turned), 0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def _asked(self, ctx: Any, reflected: Any) -> Any:
            """Whether reflection or transmission, whichever it is, was asked for."""
            reflection = ctx.is_enabled(flags.GlossyReflection, 0)
            transmission = self.transmits and ctx.is_enabled(flags.GlossyTransmission, 1)
            return (reflected & reflection) | ((reflected ^ True) & transmission)

        def to_string(self) -> str:
            return f"LayeredReference[kinds={', '.join(self.binding.stack.kinds)}]"

    def _sampled_type(smooth: Any, reflected: Any) -> Any:
        def number(flag: Any) -> Any:
            return mi.UInt32(+flag)

        delta = dr.select(reflected, number(flags.DeltaReflection), number(flags.DeltaTransmission))
        glossy = dr.select(reflected, number(flags.GlossyReflection), number(flags.GlossyTransmission))
        return dr.select(smooth, delta, glossy)

    return LayeredReference


def _widest(peaks: dict[str, float], kind: str, layer: int) -> float | None:
    """The larger roughness of a surface: None where that is a texture's business, 1 for a diffuse base."""
    if kind == "diffuse":
        return 1.0
    alphas = [peaks.get(f"layer{layer}_alpha_{axis}") for axis in "uv"]
    return max(alpha for alpha in alphas if alpha is not None) if None not in alphas else None


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
