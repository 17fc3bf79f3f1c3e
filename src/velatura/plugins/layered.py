"""The plugin `layered`: a stack of rough interfaces and media as a few GGX lobes."""

from __future__ import annotations

import sys
from typing import Any, cast

import numpy as np

from velatura import kernel, tables
from velatura.binding import Binding, Image, plugin_class
from velatura.errors import InvalidInput
from velatura.model import DEFAULT, SWITCHES, named, variance_kind
from velatura.model.base import Query
from velatura.model.papers import bsdf
from velatura.model.papers.lobe_merging import merging
from velatura.model.variance import Isotropic
from velatura.plugins import bodies, spectral

GAIN = frozenset({"energy", "white furnace"})  # laws that a gain breaks

#: By form and shape of the stack, the laws that BSDFs do not keep. Light that a lobe sends below the surface is lost.
#: The forward form is not reciprocal, the symmetric one gains at grazing angles, and its samples have any weight. Of
#: materials that are solved, the forms are `solved` and `exchanged`, or `balanced` where opaque, isotropic and uniform.
EXCEPTIONS: dict[tuple[str, str], frozenset[str]] = {
    ("forward", "opaque"): frozenset({"lossless", "reciprocity"}),
    ("forward", "pane"): frozenset({"lossless", "reciprocity"}),
    ("solved", "opaque"): frozenset({"lossless", "reciprocity"}),
    ("solved", "pane"): frozenset({"lossless", "reciprocity"}) | GAIN,
    ("symmetric", "opaque"): frozenset({"lossless", "spread"}) | GAIN,
    ("symmetric", "pane"): frozenset({"lossless", "spread"}) | GAIN,
    ("exchanged", "opaque"): frozenset({"lossless"}) | GAIN,
    ("exchanged", "pane"): frozenset({"lossless"}) | GAIN,
    ("balanced", "opaque"): frozenset({"lossless"}),
}


@kernel.plugin("layered")
def make(mi: Any) -> type:
    """The class for the current variant."""
    import drjit as dr

    flags = mi.BSDFFlags

    class Layered(plugin_class(mi)):  # type: ignore[misc]
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

        Each lobe is a component, from the top, and so is the diffuse base or, last, the transmitted lobe. The lobes of
        the forward form are flagged `NonSymmetric`, the transmitted lobe always. `eval_diffuse_reflectance` is the
        albedo of all components for light from `si.wi`.
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
            self._update(None)

        @property
        def exceptions(self) -> frozenset[str]:
            """Laws of `velatura.checks` that it is known not to keep."""
            solved = not self.model.closed_form
            if solved and self.delta:
                return frozenset()
            shape, form = "pane" if self.transmits else "opaque", self.model.form
            if form == "forward" and solved:
                form = "solved"
            elif self.bodies.balanced:
                form = "balanced" if shape == "opaque" and self.variance is Isotropic else "exchanged"
            declared = EXCEPTIONS[form, shape]
            # The albedo of a base hardly resolves a critical angle outside; where it is a sum over cosines, it errs by
            # up to 2.5 % below several interfaces
            seen = self.binding.with_constants()
            known = [layer.eta for layer in seen.interfaces if not (layer.eta is None or isinstance(layer.eta, Image))]
            below_outside = any(np.mean(np.array(eta)) < np.max(np.array(seen.exterior)) for eta in known)
            inexact = self.binding.stack.base and (below_outside or (len(seen.interfaces) > 1 and not solved))
            return declared | GAIN if inexact else declared

        # The material, and what follows from it

        def parameters_changed(self, keys: list[str]) -> None:
            self._update(self.bodies)

        def _update(self, before: bodies.Bodies | None) -> None:
            """Compute the values that do not depend on direction, and the flags of the surface."""
            binding = self.binding
            binding.update()
            seen = binding.with_constants()
            self.variance = variance_kind(binding.with_gradients_opaque())
            self.bodies = bodies.of(mi, binding, self.model, self.variance, before)
            # Say how light leaves
            self.delta = not binding.varies and not any(layer.spreads for layer in seen.layers)
            self.transmits = binding.stack.transmits
            common = flags.FrontSide | (flags.SpatiallyVarying if binding.varies else flags.Empty)
            common |= flags.Empty if self.variance is Isotropic else flags.Anisotropic
            common |= flags.BackSide if self.transmits else flags.Empty
            one_way = flags.NonSymmetric if self.model.form == "forward" and not self.delta else flags.Empty
            lobes = len(merging(self.model, len(binding.stack.interfaces)))
            self.kinds = [flags.DeltaReflection if self.delta else flags.GlossyReflection] * lobes
            components = [kind | common | one_way for kind in self.kinds]
            if self.bodies.diffuse:
                self.kinds += [flags.DiffuseReflection]
                components += [self.kinds[-1] | common | one_way]
            if self.transmits:
                self.kinds += [flags.DeltaTransmission if self.delta else flags.GlossyTransmission]
                components += [self.kinds[-1] | common | flags.NonSymmetric]
            self.has_components(components)

        # The interface of a BSDF

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            asked, body, wi = self._asked(ctx), self.bodies.at(si, active), tuple(si.wi)
            bs = mi.BSDFSample3f()
            if self.delta:
                smooth = cast(bsdf.Lobed, body)
                drawn, bs.eta, bs.pdf, weight = smooth.sample_smooth(wi, sample1, asked)
                bs.wo = mi.Vector3f(*drawn)
                part = smooth.component(wi, drawn, sample1, asked, smooth=True)
            else:
                body = body.at_direction(wi)
                drawn, bs.eta = body.sample(wi, sample1, sample2.x, sample2.y, asked)
                bs.wo = mi.Vector3f(*drawn)
                # The direction as it is given, whose numbers in scalar variants are rounded
                drawn = tuple(bs.wo)
                value, bs.pdf = body.eval_pdf(wi, drawn, asked)
                weight = value / dr.maximum(bs.pdf, 1e-30)
                part = body.component(wi, drawn, sample1, asked)
            bs.sampled_component = mi.UInt32(part)
            sampled = mi.UInt32(+self.kinds[0])
            for number, kind in enumerate(self.kinds):
                if kind != self.kinds[0]:
                    sampled = dr.select(bs.sampled_component == number, mi.UInt32(+kind), sampled)
            bs.sampled_type = sampled
            return bs, mi.depolarizer(dr.select(active & (bs.pdf > 0), spectral.carried(mi, weight), 0))

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            if self.delta:
                return mi.Spectrum(0), mi.Float(0)
            value, pdf = self.bodies.at(si, active).eval_pdf(tuple(si.wi), tuple(wo), self._asked(ctx))
            return mi.depolarizer(spectral.carried(mi, value)) & active, dr.select(active, pdf, 0)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            albedo = self.bodies.at(si, active).albedo(tuple(si.wi))
            lit = active & (si.wi.z != 0 if self.transmits else si.wi.z > 0)
            return dr.clip(spectral.carried(mi, albedo), 0, 1) & lit

        def _asked(self, ctx: Any) -> Query:
            """The components that are wanted, and of what."""
            wanted = [ctx.is_enabled(kind, component) for component, kind in enumerate(self.kinds)]
            passing = wanted.pop() if self.transmits else False
            return Query(all(wanted) or wanted, passing, ctx.mode == mi.TransportMode.Radiance)

        @property
        def facts(self) -> dict[str, str]:
            """The model, and its switches that are not its own."""
            own = named(self.model.name)
            changed = {name: getattr(self.model, name) for name in SWITCHES}
            changed = {name: value for name, value in changed.items() if value != getattr(own, name)}
            return {"model": self.model.name, **changed, "kinds": ", ".join(self.binding.stack.kinds)}

    return Layered
