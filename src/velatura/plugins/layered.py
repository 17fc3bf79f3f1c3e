"""The plugin `layered`: a stack of rough interfaces and media as a few GGX lobes."""

from __future__ import annotations

import sys
from typing import Any

from velatura import kernel, tables
from velatura.binding import Binding
from velatura.errors import InvalidInput
from velatura.model import DEFAULT, SWITCHES, bsdf, named, variance_kind
from velatura.model.models import EXCEPTIONS
from velatura.plugins import spectral


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
            model (string, default velatura): one of `velatura.MODELS`.
            reflectance, tir, map, scale, medium, form, fetch, lobes (strings): switches of the model.

        One reflected lobe per interface, over a diffuse base if there is one. A stack that ends in a dielectric
        transmits one lobe more, and is lit from both sides; the index above is `exterior`, that below is the last one,
        or `exterior` again where the material is `thin`. Wholly smooth, uniform stacks reflect as a mirror does, and
        refract as a pane.
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

        @property
        def exceptions(self) -> frozenset[str]:
            """Laws of `velatura.checks` that it does not keep, and is known not to."""
            balanced = self.body is not None and self.body.scaling is not None and not self.transmits
            return EXCEPTIONS["balanced"] if balanced else self.model.exceptions

        # The material, and what follows from it

        def traverse(self, callback: Any) -> None:
            self.binding.traverse(callback)

        def parameters_changed(self, keys: list[str]) -> None:
            self._update()

        def _update(self) -> None:
            """Work out what does not depend on direction, and how the surface reflects."""
            self.binding.update()
            binding, kinds = self.binding, self.binding.stack.kinds
            dr.make_opaque(binding.constants)  # a changed value needs no new kernel
            flat = {**binding.stack.flat(), **self._looked_at()}
            self.variance = variance_kind(kinds, {**flat, **binding.images})
            self.body: bsdf.Body | None = None
            if binding.uniform:
                number = mi.Float if dr.is_jit_v(mi.Float) else None
                self.body = self._prepared(binding.values(), number=number, settle=self._settled)
                dr.eval(self.body)
            self.spectra: spectral.Spectra | None = None
            sampled = binding.stack.interfaces and not binding.uniform and not binding.varies
            if sampled and dr.is_jit_v(mi.Float):
                steering = {**binding.values(), **binding.steering}
                fixed = self._prepared(steering, number=mi.Float, settle=self._settled)
                dr.eval(fixed)
                self.spectra = spectral.sample(mi, fixed, self._at_wavelengths)
                dr.eval(self.spectra.above, self.spectra.below, self.spectra.means)
            # Say how light leaves
            smooth = all(value == 0.0 for name, value in flat.items() if "_alpha_" in name)
            clear = all(value == 0.0 for name, value in flat.items() if name.endswith("_sigma_s"))
            self.delta = smooth and clear and not binding.varies and "diffuse" not in kinds
            self.transmits = binding.stack.transmits
            common = mi.BSDFFlags.FrontSide | (mi.BSDFFlags.SpatiallyVarying if binding.varies else mi.BSDFFlags.Empty)
            if self.variance.__name__ != "Isotropic":
                common |= mi.BSDFFlags.Anisotropic
            self.kinds = [mi.BSDFFlags.DeltaReflection if self.delta else mi.BSDFFlags.GlossyReflection]
            if self.transmits:
                common |= mi.BSDFFlags.BackSide | mi.BSDFFlags.NonSymmetric
                self.kinds += [mi.BSDFFlags.DeltaTransmission if self.delta else mi.BSDFFlags.GlossyTransmission]
            self.m_components = [kind | common for kind in self.kinds]
            self.m_flags = self.m_components[0] | self.m_components[-1]

        def _prepared(self, values: Any, **options: Any) -> bsdf.Body:
            stack = self.binding.stack
            return bsdf.body(stack.kinds, values, stack.thin, self.model, self.variance, **options)

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

        def _at_wavelengths(self, wavelengths: Any) -> bsdf.Body:
            si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wavelengths))
            si.wavelengths = wavelengths
            return self._prepared(self.binding.steered(si, True), constant=False)

        def _body(self, si: Any, active: Any) -> bsdf.Body:
            if self.body:
                return self.body
            body = self._prepared(self.binding.steered(si, active), constant=False)
            return self.spectra.at(body, si.wavelengths) if self.spectra else body

        # What a BSDF is asked

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            asked, body, wi = self._asked(ctx), self._body(si, active), tuple(si.wi)
            bs = mi.BSDFSample3f()
            if self.delta:
                drawn, bs.eta, bs.pdf, weight = bsdf.sample_smooth(body, wi, sample1, asked)
                bs.wo = mi.Vector3f(*drawn)
            else:
                drawn, bs.eta = bsdf.sample(body, wi, sample1, sample2.x, sample2.y, asked)
                bs.wo = mi.Vector3f(*drawn)
                value, bs.pdf = bsdf.eval_pdf(body, wi, drawn, asked)
                weight = value / dr.maximum(bs.pdf, 1e-30)
            through = si.wi.z * bs.wo.z < 0
            bs.sampled_component = dr.select(through, mi.UInt32(1), mi.UInt32(0))
            bs.sampled_type = dr.select(through, mi.UInt32(+self.kinds[-1]), mi.UInt32(+self.kinds[0]))
            return bs, mi.depolarizer(dr.select(active & (bs.pdf > 0), spectral.carried(mi, weight), 0))

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            if self.delta:
                return mi.Spectrum(0), mi.Float(0)
            value, pdf = bsdf.eval_pdf(self._body(si, active), tuple(si.wi), tuple(wo), self._asked(ctx))
            return mi.depolarizer(spectral.carried(mi, value)) & active, dr.select(active, pdf, 0)

        def _asked(self, ctx: Any) -> bsdf.Asked:
            """Whether reflection and transmission are wanted, and of what."""
            wanted = [ctx.is_enabled(kind, component) for component, kind in enumerate(self.kinds)]
            return bsdf.Asked(wanted[0], self.transmits and wanted[-1], ctx.mode == mi.TransportMode.Radiance)

        def to_string(self) -> str:
            return f"Layered[model={self.model.name}, kinds={', '.join(self.binding.stack.kinds)}]"

    return Layered
