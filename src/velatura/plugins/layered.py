"""The plugin `layered`: a stack of rough interfaces and media as a few GGX lobes."""

from __future__ import annotations

import sys
from typing import Any

from velatura import kernel, tables
from velatura.binding import Binding
from velatura.errors import InvalidInput
from velatura.model import DEFAULT, SWITCHES, adding, mixture, named
from velatura.model.diffuse import Base, under, with_mean_reflectance
from velatura.model.prepare import Prepared, prepare, variance_kind


@kernel.plugin("layered")
def make(mi: Any) -> type:
    """The class for the variant that is set."""
    import drjit as dr

    class Layered(mi.BSDF):
        """Layered material by statistics of light (Belcour 2018).

        Properties:
            material (string): a material file (YAML or JSON), the name of a preset, or JSON text.
            layerN_... (number, spectrum or texture; differentiable): values by flat name; they describe the whole
                stack, or change that of `material`. `layer0_eta`, `layer0_k`, `layer0_alpha_u`, `layer0_alpha_v`,
                `layer0_rotation`, `layer1_depth`, `layer1_sigma_a`, `layer1_sigma_s`, `layer1_g`, ...
            exterior (number, default 1): absolute index above.
            model (string, default belcour2018): one of `velatura.MODELS`.
            reflectance, tir, map, scale, medium (strings): switches of the model.

        One lobe per interface, over a diffuse base if there is one; reflection only. Wholly
        smooth, uniform stacks reflect as a mirror does.
        """

        def __init__(self, properties: Any) -> None:
            mi.BSDF.__init__(self, properties)
            switches = {name: str(properties[name]) for name in SWITCHES if name in properties}
            chosen = str(properties["model"]) if "model" in properties else DEFAULT
            self.model = named(chosen, **switches)
            if self.model.channels == "separate":
                raise InvalidInput(
                    "channels=separate: only for lobes and inverse, since a BSDF has one lobe for all colours"
                )
            if dr.is_jit_v(mi.Float):
                tables.load().upload(sys.modules[mi.Float.__module__])
            self.binding = Binding(mi, properties, {"model", *SWITCHES})
            self._update()

        # The material, and what follows from it

        def traverse(self, callback: Any) -> None:
            self.binding.traverse(callback)

        def parameters_changed(self, keys: list[str]) -> None:
            self._update()

        def _update(self) -> None:
            """Work out what does not depend on direction, and how the surface reflects."""
            binding, kinds = self.binding, self.binding.stack.kinds
            dr.make_opaque(binding.constants)  # a changed value needs no new kernel
            flat = {**binding.stack.flat(), **self._looked_at()}
            self.variance = variance_kind(kinds, {**flat, **binding.images})
            self.prepared: Prepared | None = None
            if binding.uniform:
                number = mi.Float if dr.is_jit_v(mi.Float) else None
                layers = prepare(kinds, binding.values(), self.model, self.variance, number=number)
                dr.eval(layers)
                self.prepared = with_mean_reflectance(layers, self._settled)
                dr.eval(self.prepared)
            smooth = all(value == 0.0 for name, value in flat.items() if "_alpha_" in name)
            clear = all(value == 0.0 for name, value in flat.items() if name.endswith("_sigma_s"))
            self.delta = smooth and clear and binding.uniform and "diffuse" not in kinds
            self.kind = mi.BSDFFlags.DeltaReflection if self.delta else mi.BSDFFlags.GlossyReflection
            varying = mi.BSDFFlags.SpatiallyVarying if not binding.uniform else mi.BSDFFlags.Empty
            flags = self.kind | mi.BSDFFlags.FrontSide | varying
            turned = mi.BSDFFlags.Anisotropic
            self.m_components = [flags if self.variance.__name__ == "Isotropic" else flags | turned]
            self.m_flags = self.m_components[0]

        def _settled(self, value: Any) -> Any:
            dr.make_opaque(value)
            return value

        def _looked_at(self) -> dict[str, Any]:
            """Constants as plain numbers; what is being differentiated stays symbolic, and so never equals another."""
            numbers = {}
            for name, value in self.binding.constants.items():
                if dr.is_jit_v(value) and dr.grad_enabled(value):
                    numbers[name] = value
                elif dr.size_v(value) <= 1:
                    numbers[name] = float(value) if isinstance(value, float) else float(value[0])
            return numbers

        def _lobes(self, si: Any, active: Any) -> tuple[list[adding.Lobe], Base | None]:
            prepared = self.prepared
            if prepared is None:
                values = self.binding.at(si, active)
                layers = prepare(self.binding.stack.kinds, values, self.model, self.variance, constant=False)
                prepared = with_mean_reflectance(layers)
            reflected, transmitted = adding.lobes(prepared, tuple(si.wi))
            return reflected, under(prepared, transmitted)

        # What a BSDF is asked

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs = mi.BSDFSample3f()
            active = active & (si.wi.z > 0)
            if not ctx.is_enabled(self.kind, 0):
                return bs, mi.UnpolarizedSpectrum(0)
            lobes, base = self._lobes(si, active)
            bs.eta, bs.sampled_component, bs.sampled_type = 1.0, 0, mi.UInt32(+self.kind)
            if self.delta:
                bs.wo, bs.pdf = mi.reflect(si.wi), 1.0
                energy = sum((lobe.energy for lobe in lobes), mi.UnpolarizedSpectrum(0))
                return bs, dr.select(active, energy, 0)
            bs.wo = mi.Vector3f(*mixture.sample(lobes, base, tuple(si.wi), sample1, sample2.x, sample2.y))
            value, bs.pdf = mixture.eval_pdf(lobes, base, tuple(si.wi), tuple(bs.wo))
            active = active & (bs.pdf > 0)
            return bs, dr.select(active, mi.UnpolarizedSpectrum(value) / dr.maximum(bs.pdf, 1e-30), 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            if self.delta or not ctx.is_enabled(self.kind, 0):
                return mi.UnpolarizedSpectrum(0), mi.Float(0)
            value, pdf = mixture.eval_pdf(*self._lobes(si, active), tuple(si.wi), tuple(wo))
            return mi.UnpolarizedSpectrum(value) & active, dr.select(active, pdf, 0)

        def to_string(self) -> str:
            return f"Layered[model={self.model.name}, kinds={', '.join(self.binding.stack.kinds)}]"

    return Layered
