"""A material at the points of a surface, as BSDFs: one and the same everywhere, or one for each point."""

from __future__ import annotations

from dataclasses import dataclass, is_dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from velatura.binding import STEERING_NM, Binding
from velatura.model.base import Body, Model
from velatura.model.context import Context, at_a_point
from velatura.model.papers import bsdf
from velatura.model.solved import spectra, texture_axes
from velatura.model.solved.textures import Textured
from velatura.model.variance import Variance
from velatura.plugins import progress, spectral
from velatura.plugins.spectral import Spectra
from velatura.renderer.differentiated import plain


class Bodies(Protocol):
    """`diffuse` and `balanced` are those of all bodies."""

    @property
    def diffuse(self) -> bool: ...

    @property
    def balanced(self) -> bool: ...

    def at(self, si: Any, active: Any) -> Body:
        """The material at a surface point."""


@dataclass(frozen=True)
class Uniform:
    """One body for all points and wavelengths."""

    body: Body

    @property
    def diffuse(self) -> bool:
        return self.body.diffuse

    @property
    def balanced(self) -> bool:
        return self.body.balanced

    def at(self, si: Any, active: Any) -> Body:
        return self.body


@dataclass(frozen=True)
class Prepared:
    """Lobes in closed form, prepared from the values of each point; where the material is uniform, with energies that
    were sampled once over wavelengths."""

    binding: Binding
    model: Model
    variance: type[Variance]
    spectra: Spectra | None = None

    balanced = False

    @property
    def diffuse(self) -> bool:
        return self.binding.stack.base is not None

    def at(self, si: Any, active: Any) -> Body:
        lobed = self.lobed(si, active)
        return self.spectra.at(lobed, si.wavelengths) if self.spectra else lobed

    def lobed(self, si: Any, active: Any) -> bsdf.Lobed:
        return bsdf.body(self.binding.at_fixed_wavelengths(si, active), self.model, self.variance, at_a_point())


@dataclass(frozen=True)
class Tabulated:
    """Bodies by tables over what textures change."""

    mi: Any
    binding: Binding
    textured: Textured

    diffuse = True  # the remainder comes after the lobes

    @property
    def balanced(self) -> bool:
        return self.textured.balanced

    def at(self, si: Any, active: Any) -> Body:
        material = self.binding.at_fixed_wavelengths(si, active)
        return self.textured.at(material, _places(self.mi, si) if self.mi.is_spectral else None)


@dataclass(frozen=True)
class OverWavelengths:
    """A uniform material that was solved over wavelengths."""

    mi: Any
    binding: Binding
    solved: spectra.Spectra

    diffuse = True

    @property
    def balanced(self) -> bool:
        return self.solved.symmetric

    def at(self, si: Any, active: Any) -> Body:
        return self.solved.at(self.binding.at_fixed_wavelengths(si, active), _places(self.mi, si))


def _places(mi: Any, si: Any) -> Any:
    """Of fixed wavelengths on the spectrum, and of those of a ray."""
    return mi.ArrayXf([*spectral.places(STEERING_NM), *spectral.places(si.wavelengths)])


def _spectrum(mi: Any, *channels: Any) -> Any:
    """A colour at fixed wavelengths, and at those of a ray."""
    return mi.ArrayXf(list(channels) or [0.0] * (2 * len(mi.UnpolarizedSpectrum())))


def _plain(value: Any) -> Any:
    """All values in records, as lists: Dr.Jit passes named tuples over."""
    if is_dataclass(value) and not isinstance(value, type):
        return [_plain(each) for each in vars(value).values()]
    return [_plain(each) for each in value] if isinstance(value, tuple | list) else value


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
        body = model.body(binding.uniform_material(), variance, context)
        return Uniform(settled(body))
    nodes = spectra.NODES
    if binding.interferes and not binding.varies:
        nodes = spectra.nodes_of(plain(binding.uniform_material()))
        nodes += -nodes % len(mi.UnpolarizedSpectrum())  # as many as rays carry at a time
    nm = [*STEERING_NM, *np.linspace(spectral.BEGIN_NM, spectral.END_NM, nodes).tolist()]
    places = np.array(spectral.places(nm))
    if not binding.varies:
        over = model.over_wavelengths(binding.at_wavelengths(nm), places, variance, context)
        if over:
            return OverWavelengths(mi, binding, settled(over))
        model = model.pointwise
    prepared = Prepared(binding, model, variance)
    if binding.varies:
        if mi.is_spectral:
            context = replace(context, colour=partial(_spectrum, mi))
        material, ranges = binding.with_ranges(texture_axes.UNKNOWN)
        colours = binding.steering or binding.interferes
        waves = [spectra.axis(binding.at_wavelengths(nm, material), places)] if colours else []
        known = before.textured if isinstance(before, Tabulated) else None
        symbolic = binding.with_gradients_opaque()
        textured = model.textured(material, [*waves, *ranges], symbolic, variance, context, known)
        if textured:
            return Tabulated(mi, binding, textured)
    if binding.varies or number is None or not binding.stack.interfaces:
        return prepared

    def at_wavelengths(wavelengths: Any) -> bsdf.Lobed:
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wavelengths))
        si.wavelengths = wavelengths
        return prepared.lobed(si, True)

    over = nodes if binding.interferes else spectral.NODES
    fixed = settled(bsdf.body(binding.uniform_material(), model, variance, context))
    return Prepared(binding, model, variance, settled(spectral.sample(mi, fixed, at_wavelengths, over)))
