"""The plugin `layered`: a stack of rough interfaces and media as a few GGX lobes."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np

from velatura import kernel, tables
from velatura.binding import Asked, Binding, Image, PointBSDF, plugin_class
from velatura.errors import InvalidInput
from velatura.model import DEFAULT, SWITCHES, Model, named, variance_kind
from velatura.model.base import Body, Query
from velatura.model.papers import bsdf
from velatura.model.papers.lobe_merging import merging
from velatura.model.variance import Isotropic
from velatura.optics.ggx import Direction
from velatura.plugins import bodies, spectral

EXACT = "exact"  # the form whose values are estimates of the walk

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

    class Layered(plugin_class(mi)):  # type: ignore[misc]
        """Layered material by statistics of light (Belcour 2018).

        Properties:
            material (string): a material file (YAML or JSON), the name of a preset, or JSON text.
            layerN_... (number, spectrum or texture; differentiable): values by flat name; they describe the whole
                stack, or change that of `material`. `layer0_eta`, `layer0_k`, `layer0_alpha_u`, `layer0_alpha_v`,
                `layer0_rotation`, `layer1_depth`, `layer1_sigma_a`, `layer1_sigma_s`, `layer1_g`, ...
            exterior (number, default 1): absolute index above.
            model (string, default velatura): one of `velatura.MODELS`.
            reflectance, tir, map, scale, medium, form, fetch, lobes (strings): switches of the model. The form may also
                be `exact`: directions are drawn by the model, with its density, a few by the cosine, and values are
                unbiased estimates of the random walk, by which pictures converge to the truth. Gradients are those of
                the model's values.

        One reflected lobe per interface, over a diffuse base if there is one. A stack that ends in a dielectric
        transmits one lobe more, and is lit from both sides; the index above is `exterior`, that below is the last one,
        or `exterior` again where the material is `thin`. Wholly smooth, uniform stacks reflect as a mirror does, and
        refract as a pane.

        Each lobe is a component, from the top, and so is the diffuse base or, last, the transmitted lobe. The lobes of
        the forward form are flagged `NonSymmetric`, the transmitted lobe always. `eval_diffuse_reflectance` is the
        albedo of all components for light from `si.wi`.

        A mixture has the components of all its stacks, one after the other, and names with their part
        (`part0_weight`, `part1_layer0_eta`). Value and density are sums by the shares of the stacks; a sample is drawn
        from one of them. Smooth stacks among rough ones are sampled, and have no value. Where some stacks transmit, the
        others absorb light from below.

        Components of the exact form are all that is reflected (glossy), by the diffuse base if there is one, and all
        that passes. Wholly smooth, uniform stacks are those of the model, which is exact there.
        """

        def __init__(self, properties: Any) -> None:
            switches = {name: str(properties[name]) for name in SWITCHES if name in properties}
            if exact := switches.get("form") == EXACT:
                switches["form"] = "forward"
            chosen = str(properties["model"]) if "model" in properties else DEFAULT
            model = named(chosen, **switches)
            if exact and model.closed_form:
                raise InvalidInput(f"form={EXACT}: of the model {DEFAULT} only, whose samples find all light")
            if model.channels == "separate":
                raise InvalidInput(
                    "channels=separate: only for lobes and inverse, since a BSDF has one lobe for all colours"
                )
            if dr.is_jit_v(mi.Float):
                tables.load().upload(sys.modules[mi.Float.__module__])
            facts = {"model": model.name, **_changed(model), **({"form": EXACT} if exact else {})}
            super().__init__(
                properties, partial(_exact() if exact else LayeredStack, mi, model), {"model", *SWITCHES}, facts
            )

    return Layered


def _exact() -> type[LayeredStack]:
    """The stacks of the exact form, which few use."""
    from velatura.plugins.exact import ExactStack

    return ExactStack


def _changed(model: Model) -> dict[str, str]:
    """The switches of a model that are not its own."""
    own = named(model.name)
    return {name: getattr(model, name) for name in SWITCHES if getattr(model, name) != getattr(own, name)}


class LayeredStack:
    """One stack, by a model."""

    def __init__(self, mi: Any, model: Model, binding: Binding) -> None:
        self.mi, self.model, self.binding = mi, model, binding
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

    def update(self) -> None:
        self._update(self.bodies)

    def _update(self, before: bodies.Bodies | None) -> None:
        """Compute the values that do not depend on direction, and the flags of the surface."""
        binding, flags = self.binding, self.mi.BSDFFlags
        seen = binding.with_constants()
        self.variance = variance_kind(binding.with_gradients_opaque())
        self.bodies = bodies.of(self.mi, binding, self.model, self.variance, before)
        # Say how light leaves
        self.delta = not binding.varies and not any(layer.spreads for layer in seen.layers)
        self.transmits = binding.stack.transmits
        common = flags.FrontSide | (flags.SpatiallyVarying if binding.varies else flags.Empty)
        common |= flags.Empty if self.variance is Isotropic else flags.Anisotropic
        common |= flags.BackSide if self.transmits else flags.Empty
        one_way = flags.NonSymmetric if self.model.form == "forward" and not self.delta else flags.Empty
        lobes = len(merging(self.model, len(binding.stack.interfaces)))
        self.kinds = [flags.DeltaReflection if self.delta else flags.GlossyReflection] * lobes
        self.components = [kind | common | one_way for kind in self.kinds]
        if self.bodies.diffuse:
            self.kinds += [flags.DiffuseReflection]
            self.components += [self.kinds[-1] | common | one_way]
        if self.transmits:
            self.kinds += [flags.DeltaTransmission if self.delta else flags.GlossyTransmission]
            self.components += [self.kinds[-1] | common | flags.NonSymmetric]

    # As light meets it

    def at(self, si: Any, asked: Asked, active: Any) -> PointBSDF:
        body, wi, wanted = self.bodies.at(si, active), tuple(si.wi), list(asked.components)
        passing = wanted.pop() if self.transmits else False
        query = Query(all(wanted) or wanted, passing, asked.radiance)
        return LayeredPoint(self, body if self.delta else body.at_direction(wi), wi, query)

    def albedo(self, si: Any, active: Any) -> Any:
        import drjit as dr

        albedo = self.bodies.at(si, active).albedo(tuple(si.wi))
        lit = active & (si.wi.z != 0 if self.transmits else si.wi.z > 0)
        return dr.clip(spectral.carried(self.mi, albedo), 0, 1) & lit


@dataclass(frozen=True)
class LayeredPoint(PointBSDF):
    """A stack at a surface point, for light from one direction."""

    stack: LayeredStack
    body: Body
    wi: Direction
    asked: Query

    def draw(self, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        mi, kinds = self.stack.mi, self.stack.kinds
        bs = dr.zeros(mi.BSDFSample3f)
        if self.stack.delta:
            smooth = cast(bsdf.Lobed, self.body)
            drawn, bs.eta, bs.pdf, weight = smooth.sample_smooth(self.wi, sample1, self.asked)
            bs.wo = mi.Vector3f(*drawn)
            part = smooth.component(self.wi, drawn, sample1, self.asked, smooth=True)
            weight = mi.depolarizer(dr.select(active & (bs.pdf > 0), spectral.carried(mi, weight), 0))
        else:
            drawn, bs.eta = self.body.sample(self.wi, sample1, sample2.x, sample2.y, self.asked)
            bs.wo, weight = mi.Vector3f(*drawn), None
            # The direction as it is given, whose numbers in scalar variants are rounded
            part = self.body.component(self.wi, tuple(bs.wo), sample1, self.asked)
        bs.sampled_component = mi.UInt32(part)
        sampled = mi.UInt32(+kinds[0])
        for number, kind in enumerate(kinds):
            if kind != kinds[0]:
                sampled = dr.select(bs.sampled_component == number, mi.UInt32(+kind), sampled)
        bs.sampled_type = sampled
        return bs, weight

    def eval_pdf(self, wo: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        mi = self.stack.mi
        if self.stack.delta:
            return mi.Spectrum(0), mi.Float(0)
        value, pdf = self.body.eval_pdf(self.wi, tuple(wo), self.asked)
        return mi.depolarizer(spectral.carried(mi, value)) & active, dr.select(active, pdf, 0)
