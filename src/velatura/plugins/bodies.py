"""A material at the points of a surface, as BSDFs: one and the same everywhere, or one for each point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from velatura.binding import STEERING_NM, Binding
from velatura.model import axes, bsdf, solved_spectra
from velatura.model.bsdf import Body
from velatura.model.context import Context, at_a_point
from velatura.model.models import Model
from velatura.model.textured import Textured
from velatura.model.variance import Variance
from velatura.plugins import spectral
from velatura.plugins.spectral import Spectra


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

    @property
    def diffuse(self) -> bool:
        return self.binding.stack.base is not None

    @property
    def balanced(self) -> bool:
        return False

    def at(self, si: Any, active: Any) -> Body:
        lobed = self.lobed(si, active)
        return self.spectra.at(lobed, si.wavelengths) if self.spectra else lobed

    def lobed(self, si: Any, active: Any) -> bsdf.Lobed:
        return bsdf.body(self.binding.steered(si, active), self.model, self.variance, at_a_point())


@dataclass(frozen=True)
class Tabulated:
    """Bodies by tables over what textures change."""

    binding: Binding
    textured: Textured

    @property
    def diffuse(self) -> bool:
        return True

    @property
    def balanced(self) -> bool:
        return self.textured.balanced

    def at(self, si: Any, active: Any) -> Body:
        return self.textured.at(self.binding.at(si, active))


@dataclass(frozen=True)
class OverWavelengths:
    """A uniform material that was solved over wavelengths."""

    mi: Any
    binding: Binding
    spectra: solved_spectra.Spectra

    diffuse = True

    @property
    def balanced(self) -> bool:
        return self.spectra.symmetric

    def at(self, si: Any, active: Any) -> Body:
        places = self.mi.ArrayXf([*spectral.places(STEERING_NM), *spectral.places(si.wavelengths)])
        return self.spectra.at(self.binding.steered(si, active), places)


def of(mi: Any, binding: Binding, model: Model, variance: type[Variance], before: Bodies | None) -> Bodies:
    """The material with the values that it has now, by what was made `before` of other ones where that holds them."""
    import drjit as dr

    def settled(value: Any) -> Any:
        dr.make_opaque(value)
        return value

    # Scalar variants compute every direction anew
    number = mi.Float if dr.is_jit_v(mi.Float) else None
    context = Context(number=number, colour=mi.UnpolarizedSpectrum, settle=settled)
    if binding.uniform:
        body = model.recursion.body(binding.uniform_material(), model, variance, context)
        dr.eval(body)
        return Uniform(body)
    if not binding.varies and model.recursion.solves(binding.uniform_material()):
        nm = [*STEERING_NM, *np.linspace(spectral.BEGIN_NM, spectral.END_NM, solved_spectra.NODES).tolist()]
        material, places = binding.at_wavelengths(nm), np.array(spectral.places(nm))
        solved = solved_spectra.solve(material, places, model, variance, context)
        dr.eval(solved.sides)
        return OverWavelengths(mi, binding, solved)
    if not binding.varies:
        model = model.recursion.unsolved(model)
    prepared = Prepared(binding, model, variance)
    if binding.varies and not mi.is_spectral:
        material, ranges = binding.tabulated(axes.UNKNOWN)
        known = before.textured if isinstance(before, Tabulated) else None
        symbolic = binding.symbolic(binding.looked_at())
        textured = model.recursion.textured(material, ranges, symbolic, model, variance, context, known)
        if textured:
            return Tabulated(binding, textured)
    if binding.varies or number is None or not binding.stack.interfaces:
        return prepared

    def at_wavelengths(wavelengths: Any) -> bsdf.Lobed:
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wavelengths))
        si.wavelengths = wavelengths
        return prepared.lobed(si, True)

    fixed = bsdf.body(binding.uniform_material(), model, variance, context)
    dr.eval(fixed)
    spectra = spectral.sample(mi, fixed, at_wavelengths)
    dr.eval(spectra.above, spectra.below, spectra.means)
    return Prepared(binding, model, variance, spectra)
