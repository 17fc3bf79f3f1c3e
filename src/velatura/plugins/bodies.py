"""A material at the points of a surface, as BSDFs: one and the same everywhere, or one for each point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, is_dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from velatura.binding import STEERING_NM, Binding
from velatura.model.base import Body, Model
from velatura.model.context import Context, at_a_point
from velatura.model.papers import bsdf
from velatura.model.solved import spectra, texture_axes
from velatura.model.solved.textures import Textured
from velatura.model.variance import Variance
from velatura.plugins import progress, spectral
from velatura.renderer.differentiated import plain


@dataclass(frozen=True)
class Bodies:
    """The body of a material at each point, by `at(si, active)`; `diffuse` and `balanced` are those of all bodies.

    `textured` are the tables that it reads, where textures change what was solved; `lobed` gives lobes in closed form
    whose energies are computed for each ray, where `at` reads them from tables over wavelength.
    """

    at: Callable[[Any, Any], Body]
    diffuse: bool
    balanced: bool
    textured: Textured | None = None
    lobed: Callable[[Any, Any], Body] | None = None


def _places(mi: Any, si: Any) -> Any:
    """Places of fixed wavelengths on the spectrum, and of those of a ray."""
    return mi.ArrayXf([*spectral.places(STEERING_NM), *spectral.places(si.wavelengths)])


def _spectrum(mi: Any, *channels: Any) -> Any:
    """Colour at fixed wavelengths, and at those of a ray."""
    return mi.ArrayXf(list(channels) or [0.0] * (2 * len(mi.UnpolarizedSpectrum())))


def _plain(value: Any) -> Any:
    """All values in records, as lists: Dr.Jit passes named tuples over."""
    kind = type(value)
    if kind is float:
        return value
    if issubclass(kind, tuple | list):
        return [_plain(each) for each in value]
    return [_plain(each) for each in vars(value).values()] if is_dataclass(kind) else value


def of(mi: Any, binding: Binding, model: Model, variance: type[Variance], before: Bodies | None) -> Bodies:
    """The material with the values that it has now, by what was made `before` of other ones where that holds them."""
    import drjit as dr

    def settled(value: Any) -> Any:
        # Dr.Jit would widen a kept number that is not in memory to the directions of a query (drjit 1.5)
        dr.make_opaque(_plain(value))
        return value

    # Scalar variants compute every direction anew
    number = mi.Float if dr.is_jit_v(mi.Float) else None
    shown = progress.line("velatura: solving textured materials")
    context = Context(number=number, colour=mi.UnpolarizedSpectrum, settle=settled, progress=shown)
    if binding.uniform:
        body = settled(model.body(binding.uniform_material(), variance, context))
        return Bodies(lambda si, active: body, body.diffuse, body.balanced)
    values, nodes = binding.at_fixed_wavelengths, spectra.NODES
    if binding.interferes and not binding.varies:
        nodes = spectra.nodes_of(plain(binding.uniform_material()))
        nodes += -nodes % len(mi.UnpolarizedSpectrum())  # as many as rays carry at a time
    nm = [*STEERING_NM, *np.linspace(spectral.BEGIN_NM, spectral.END_NM, nodes).tolist()]
    places = np.array(spectral.places(nm))
    if binding.varies:
        if mi.is_spectral:
            context = replace(context, colour=partial(_spectrum, mi))
        material, ranges = binding.with_ranges(texture_axes.UNKNOWN)
        colours = binding.steering or binding.interferes
        waves = [spectra.axis(binding.at_wavelengths(nm, material), places)] if colours else []
        opaque, known = binding.with_gradients_opaque(), before and before.textured
        textured = model.textured(material, [*waves, *ranges], opaque, variance, context, known)
        if textured:

            def from_tables(si: Any, active: Any) -> Body:
                return textured.at(values(si, active), _places(mi, si) if mi.is_spectral else None)

            return Bodies(from_tables, True, textured.balanced, textured)
    elif solved := model.over_wavelengths(
        binding.uniform_material(), partial(binding.at_wavelengths, nm), places, variance, context
    ):
        solved = settled(solved)
        return Bodies(lambda si, active: solved.at(values(si, active), _places(mi, si)), True, solved.symmetric)
    else:
        model = model.pointwise

    # In closed form, from the values of each point
    def lobed(si: Any, active: Any) -> bsdf.Lobed:
        return bsdf.body(values(si, active), model, variance, at_a_point())

    diffuse = binding.stack.base is not None
    if binding.varies or number is None or not binding.stack.interfaces:
        return Bodies(lobed, diffuse, False)

    # Energies over wavelengths are sampled once
    def at_wavelengths(wavelengths: Any) -> bsdf.Lobed:
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wavelengths))
        si.wavelengths = wavelengths
        return lobed(si, True)

    over = nodes if binding.interferes else spectral.NODES
    fixed = settled(bsdf.body(binding.uniform_material(), model, variance, context))
    sampled = settled(spectral.sample(mi, fixed, at_wavelengths, over))
    return Bodies(lambda si, active: sampled.at(lobed(si, active), si.wavelengths), diffuse, False, lobed=lobed)
