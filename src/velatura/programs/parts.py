"""Parts of surfaces that several sources describe alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from velatura.optics import fresnel
from velatura.programs.imported import Notes
from velatura.programs.surface import NO_COAT, Coat, weighed
from velatura.programs.values import Array, Value, changed
from velatura.stack import RGB

# Reasons why a stack does not carry a parameter
FLAT = "surfaces of stacks are flat: in Mitsuba, put the BSDF into a normalmap or bumpmap"
TANGENT = "the tangent is dp/du: set the rotation of the interface"
FIBRES = "a stack has no fibres above it: left out"
LIGHT = "a stack emits no light: in Mitsuba, give the shape an area emitter"
COVERS = "a stack covers all of its surface: in Mitsuba, put the BSDF into a mask"
LAMBERTIAN = "a diffuse base is Lambertian"
OPAQUE = "a diffuse base lets no light through: taken as solid"
BELOW = "a diffuse base of that colour: light leaves where it enters"
UNDISPERSED = "all colours are refracted alike"


def alphas(roughness: Value, of: Callable[[Array], tuple[Array, Array]]) -> tuple[Value, Value]:
    """alpha along the tangent and across it, at most 1, as a function `of` the roughness."""
    along, across = (changed(roughness, lambda r, n=n: np.minimum(of(r)[n], 1)) for n in (0, 1))  # type: ignore[misc]
    return along, across


def alike(roughness: Value) -> tuple[Value, Value]:
    """alpha along both axes, the square of a roughness."""
    return alphas(roughness, lambda r: (r * r, r * r))


def coated(notes: Notes, name: str, weight: float, coat: Coat) -> Coat:
    """A coat of that coverage: one that covers a part becomes one that reflects, absorbs and darkens as much less."""
    if weight == 0:
        return NO_COAT
    if weight == 1:
        return coat
    notes.add(name, weight, "a stack is no mixture: a coat of a lower index, which reflects and absorbs as much less")
    colour = changed(coat.colour, lambda c: 1 + weight * (c - 1))
    weaker = weighed(coat.eta, 1.0, weight)
    share = min(1.0, weight * _darkened(coat.eta) / max(_darkened(weaker), 1e-6))
    return replace(coat, eta=weaker, colour=colour, darkening=share * coat.darkening)


def _darkened(eta: float) -> float:
    """The share of its light that a base of albedo one half loses below a coat (OpenPBR 1.1, "Darkening")."""
    kept = 1 - (1 - fresnel.normal_incidence(eta)) / eta**2
    return float(np.clip(1 - (1 - kept) / (1 - 0.5 * kept), 0, 1))


def absorbed(transmittance: RGB, length: float) -> Array:
    """Extinction of a medium that has this transmittance over a length."""
    return np.log(1 / np.maximum(transmittance, 1e-6)) / length
