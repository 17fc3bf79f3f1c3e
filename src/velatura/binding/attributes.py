"""The base class of layered plugins: queries of the values of a material by their flat names."""

from __future__ import annotations

import functools
import operator
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.binding.materials import Binding
from velatura.binding.textures import Image
from velatura.stack import srgb_weights


def plugin_class(mi: Any) -> type:
    """The base class of all layered plugins in the current variant, with the queries of their values.

    Theirs is a `binding`, `facts` by name, which `to_string` begins with, and `eval_pdf`.
    """

    class MaterialBSDF(mi.BSDF):
        binding: Binding
        facts: dict[str, str]

        def has_components(self, components: Sequence[Any]) -> None:
            """Declare the flags of each component."""
            self.m_components = list(components)
            self.m_flags = functools.reduce(operator.or_, self.m_components)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def traverse(self, callback: Any) -> None:
            textures = {name: x.texture for name, x in self.binding.images.items() if isinstance(x, Image)}
            for name, value in {**self.binding.parameters, **textures}.items():
                if name in self.binding.derived:
                    continue
                smooth = self.binding.addresses[name].declared.differentiable
                flags = mi.ParamFlags.Differentiable if smooth else mi.ParamFlags.NonDifferentiable
                callback.put(name, value, flags)

        def has_attribute(self, name: str, active: Any = True) -> Any:
            return name in self.binding.constants or name in self.binding.images

        def eval_attribute(self, name: str, si: Any, active: Any = True) -> Any:
            return mi.UnpolarizedSpectrum(self.binding.value(name, si, active) if self.has_attribute(name) else 0)

        def eval_attribute_1(self, name: str, si: Any, active: Any = True) -> Any:
            if not self.has_attribute(name):
                return mi.Float(0)
            if self.binding.addresses[name].colour:
                return mi.luminance(_linear_srgb(self.binding, name, si, active))
            return mi.Float(self.binding.value(name, si, active))

        def eval_attribute_3(self, name: str, si: Any, active: Any = True) -> Any:
            return _linear_srgb(self.binding, name, si, active) if self.has_attribute(name) else mi.Color3f(0)

        def to_string(self) -> str:
            constants = {name: _text(value) for name, value in self.binding.constants.items()}
            values = {**self.facts, **constants, **self.binding.images}
            listed = ",\n".join(f"{name} = {text}" for name, text in values.items())
            return f"{type(self).__name__}[\n{textwrap.indent(listed, '  ')}\n]"

    return MaterialBSDF


def _linear_srgb(binding: Binding, name: str, si: Any, active: Any) -> Any:
    """A value at a surface point as linear sRGB, under D65 where it is a spectrum."""
    mi, image = binding.mi, binding.images.get(name)
    if not (mi.is_spectral and image and image.colour):
        value = binding.value(name, si, active)
        return mi.Color3f(value[0] if mi.is_monochromatic and binding.addresses[name].colour and image else value)
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
