"""The base class of layered plugins: a BSDF of the stacks of a material, each with its share of a point.

A mixture adds up the values and the densities of its stacks. A sample is drawn from one of them, chosen by share.
"""

from __future__ import annotations

import functools
import operator
import textwrap
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from velatura.binding.materials import Binding
from velatura.binding.mixture import Mixture
from velatura.binding.textures import Image
from velatura.binding.values import Values
from velatura.stack import srgb_weights

BELOW_ONE = 1 - 2.0**-24  # the last uniform number of single precision


@dataclass(frozen=True)
class Asked:
    """The components of a stack that are asked for, each of its own; of radiance, which scales with the squared index,
    or not."""

    components: Sequence[bool]
    radiance: bool


class StackBSDF(Protocol):
    """A stack as light meets it, for a plugin in one variant.

    `components` are the flags of its components, `kinds` their types alone; `exceptions` are the laws of
    `velatura.checks` that it is known not to keep.
    """

    components: Sequence[Any]
    kinds: Sequence[Any]

    @property
    def exceptions(self) -> frozenset[str]: ...

    def update(self) -> None:
        """Compute what follows from the values that the binding has now."""

    def at(self, si: Any, asked: Asked, active: Any) -> PointBSDF:
        """The stack at a surface point, for light from `si.wi`."""

    def albedo(self, si: Any, active: Any) -> Any: ...


class PointBSDF(Protocol):
    """A stack at a surface point, for light from one direction, as the methods of `mi.BSDF` have it."""

    def draw(self, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        """A sample, with the number of its component in the stack, and its weight: None where that is the value over
        the density, which `eval_pdf` computes for the sample."""

    def eval(self, wo: Any, active: Any) -> Any:
        return self.eval_pdf(wo, active)[0]

    def pdf(self, wo: Any, active: Any) -> Any:
        return self.eval_pdf(wo, active)[1]

    def eval_pdf(self, wo: Any, active: Any) -> tuple[Any, Any]: ...


def plugin_class(mi: Any) -> type:
    """The base class of all layered plugins in the current variant."""
    import drjit as dr

    class MaterialBSDF(mi.BSDF):
        """A BSDF of a material.

        Args:
            properties: of the plugin.
            stack_bsdf: makes the BSDF of one stack.
            options: names of properties that are no values of the material.
            facts: by name, which `to_string` begins with.
        """

        def __init__(
            self,
            properties: Any,
            stack_bsdf: Callable[[Binding], StackBSDF],
            options: Collection[str] = (),
            facts: dict[str, str] | None = None,
        ) -> None:
            mi.BSDF.__init__(self, properties)
            self.facts = facts or {}
            self.mixture = Mixture(mi, properties, options)
            self.stacks = [stack_bsdf(binding) for binding in self.mixture.bindings]
            self._declare()

        def parameters_changed(self, keys: list[str]) -> None:
            for stack, changed in zip(self.stacks, self.mixture.update(keys)):
                if changed:
                    stack.update()
            self._declare()

        def _declare(self) -> None:
            """Declare the components, those of one stack after the other."""
            varying = mi.BSDFFlags.SpatiallyVarying if self.mixture.weights.varies else mi.BSDFFlags.Empty
            self.m_components = [flags | varying for stack in self.stacks for flags in stack.components]
            self.m_flags = functools.reduce(operator.or_, self.m_components)

        @property
        def exceptions(self) -> frozenset[str]:
            """Laws of `velatura.checks` that it is known not to keep: those of any stack. Light that passes one stack
            is lost at an opaque one beside it, seen from below."""
            declared = frozenset[str]().union(*(stack.exceptions for stack in self.stacks))
            passing = {binding.stack.transmits for binding in self.mixture.bindings}
            return declared | {"lossless"} if len(passing) > 1 else declared

        # The interface of a BSDF

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            each, shares, chances = self._each(ctx, si, active)

            # Draw from one of the stacks
            which, u = _chosen(mi, sample1, chances)
            bs, weight, given, first, own = dr.zeros(mi.BSDFSample3f), mi.Spectrum(0), False, 0, []
            for k, point in enumerate(each):
                here = which == k
                drawn, its_weight = point.draw(u, sample2, active & here)
                drawn.pdf *= chances[k]
                drawn.sampled_component += first
                bs = dr.select(here, drawn, bs)
                if its_weight is not None:
                    weight = dr.select(here, its_weight * (shares[k] / dr.maximum(chances[k], 1e-30)), weight)
                    given = given | here
                own.append(its_weight is not None)
                first += len(self.stacks[k].kinds)
            if own == [True]:
                return bs, weight

            # Evaluate all at once; a smooth one has a probability and a weight of its own
            lit = _lit(shares, active)
            if all(own):
                pdf = _total(chances, [point.pdf(bs.wo, here) for point, here in zip(each, lit)])
            else:
                values, densities = zip(*(point.eval_pdf(bs.wo, here) for point, here in zip(each, lit)))
                pdf = _total(chances, densities)
                weight = dr.select(given, weight, _total(shares, values) / dr.maximum(pdf, 1e-30))
                # A direction that its stack has lost, below a horizon, is none of the others'
                kept = functools.reduce(operator.or_, ((which == k) & (p > 0) for k, p in enumerate(densities)))
                pdf = dr.select(given | kept, pdf, 0)
            smooth = given & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            bs.pdf = dr.select(smooth, bs.pdf, pdf)
            return bs, weight & active & (bs.pdf > 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            each, shares, _ = self._each(ctx, si, active)
            return _total(shares, [point.eval(wo, lit) for point, lit in zip(each, _lit(shares, active))])

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            each, _, chances = self._each(ctx, si, active)
            return _total(chances, [point.pdf(wo, lit) for point, lit in zip(each, _lit(chances, active))])

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            each, shares, chances = self._each(ctx, si, active)
            values, densities = zip(*(point.eval_pdf(wo, lit) for point, lit in zip(each, _lit(shares, active))))
            return _total(shares, values), _total(chances, densities)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            return _total(self.mixture.shares(si, active), [stack.albedo(si, active) for stack in self.stacks])

        def _each(self, ctx: Any, si: Any, active: Any) -> tuple[list[PointBSDF], list[Any], list[Any]]:
            """Every stack at a point, its share, and the chance that a sample is drawn from it: its share among those
            of which a component is asked for. Shares are differentiated by values, since samples do not follow them."""
            each, first, any_asked = [], 0, []
            for stack in self.stacks:
                kinds, first = stack.kinds, first + len(stack.kinds)
                wanted = [ctx.is_enabled(kind, first - len(kinds) + k) for k, kind in enumerate(kinds)]
                any_asked.append(any(wanted))
                each.append(stack.at(si, Asked(wanted, ctx.mode == mi.TransportMode.Radiance), active))
            shares = self.mixture.shares(si, active)
            chances = [dr.detach(share) for share in shares]
            if not all(any_asked) and any(any_asked):
                chances = [chance if asked else 0.0 for chance, asked in zip(chances, any_asked)]
                total = dr.maximum(sum(chances), 1e-30)
                chances = [chance / total for chance in chances]
            return each, shares, chances

        # Values by their flat names

        def traverse(self, callback: Any) -> None:
            for values, name in self.mixture:
                image = values.images.get(name)
                if name in values.derived or not (name in values.parameters or isinstance(image, Image)):
                    continue
                smooth = values.addresses[name].declared.differentiable
                flags = mi.ParamFlags.Differentiable if smooth else mi.ParamFlags.NonDifferentiable
                value = image.texture if isinstance(image, Image) else values.parameters[name]
                callback.put(values.prefix + name, value, flags)

        def has_attribute(self, name: str, active: Any = True) -> Any:
            return self.mixture.named(name) is not None

        def eval_attribute(self, name: str, si: Any, active: Any = True) -> Any:
            found = self.mixture.named(name)
            return mi.UnpolarizedSpectrum(found[0].value(found[1], si, active) if found else 0)

        def eval_attribute_1(self, name: str, si: Any, active: Any = True) -> Any:
            found = self.mixture.named(name)
            if not found:
                return mi.Float(0)
            values, own = found
            if values.addresses[own].colour:
                return mi.luminance(_linear_srgb(values, own, si, active))
            return mi.Float(values.value(own, si, active))

        def eval_attribute_3(self, name: str, si: Any, active: Any = True) -> Any:
            found = self.mixture.named(name)
            return _linear_srgb(*found, si, active) if found else mi.Color3f(0)

        def to_string(self) -> str:
            kinds = " + ".join(", ".join(binding.stack.kinds) for binding in self.mixture.bindings)
            shown: dict[str, Any] = {**self.facts, "kinds": kinds}
            each = (self.mixture.weights, *self.mixture.bindings)
            shown |= {v.prefix + name: _text(value) for v in each for name, value in v.constants.items()}
            shown |= {v.prefix + name: image for v in each for name, image in v.images.items()}
            listed = ",\n".join(f"{name} = {text}" for name, text in shown.items())
            return f"{type(self).__name__}[\n{textwrap.indent(listed, '  ')}\n]"

    return MaterialBSDF


def _chosen(mi: Any, u: Any, chances: Sequence[Any]) -> tuple[Any, Any]:
    """The number of the stack that a uniform number falls on, and a uniform number for what follows."""
    import drjit as dr

    if len(chances) == 1:
        return 0, u
    which, begin, end, width = mi.UInt32(0), mi.Float(0), chances[0], chances[0]
    for k, chance in enumerate(chances[1:], start=1):
        later = (u >= end) & (chance > 0)
        which, begin, width = (
            dr.select(later, a, b) for a, b in ((mi.UInt32(k), which), (end, begin), (chance, width))
        )
        end = end + chance
    return which, dr.clip((u - begin) / dr.maximum(width, 1e-30), 0, BELOW_ONE)


def _lit(shares: Sequence[Any], active: Any) -> list[Any]:
    """Where stacks are to be evaluated: where they have a share, or all over if that is differentiated."""
    import drjit as dr

    if len(shares) == 1:
        return [active]
    return [active if dr.grad_enabled(share) else active & (share > 0) for share in shares]


def _total(shares: Sequence[Any], values: Sequence[Any]) -> Any:
    """The sum of values by their shares."""
    return functools.reduce(operator.add, (value * share for share, value in zip(shares, values)))


def _linear_srgb(values: Values, name: str, si: Any, active: Any) -> Any:
    """A value at a surface point as linear sRGB, under D65 where it is a spectrum."""
    mi, image = values.mi, values.images.get(name)
    if not (mi.is_spectral and image and image.colour):
        value = values.value(name, si, active)
        return mi.Color3f(value[0] if mi.is_monochromatic and values.addresses[name].colour and image else value)
    # Sum over wavelengths, as many at once as a ray carries
    nm, weights = srgb_weights()
    carried, rgb = len(mi.UnpolarizedSpectrum()), mi.Color3f(0)
    at = mi.SurfaceInteraction3f(si)
    for k in range(0, len(nm), carried):
        nodes = [min(k + i, len(nm) - 1) for i in range(carried)]
        at.wavelengths = type(si.wavelengths)([float(nm[node]) for node in nodes])
        value = image.at(at, active)
        for i, node in enumerate(range(k, min(k + carried, len(nm)))):
            rgb += mi.Color3f(*(float(w) for w in weights[:, node])) * value[i]
    return rgb


def _text(value: Any) -> str:
    """A constant as text: a number, a colour, or several of either."""
    numbers = [f"{number:g}" for number in np.array(value, float).ravel()]
    return numbers[0] if len(numbers) == 1 else f"[{', '.join(numbers)}]"
