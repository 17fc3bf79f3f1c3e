"""Parts of surfaces that several sources describe alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from velatura.imports.given import ROUNDING, Given
from velatura.imports.result import Notes, shown
from velatura.imports.surface import INDICES, Coat, weighed
from velatura.imports.values import Array, Value, changed
from velatura.optics import fresnel
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


def index(given: Given, name: str) -> float:
    """An index, within what stacks take."""
    value = given.number(name)
    kept = float(np.clip(value, *INDICES))
    if kept != value:
        given.notes.add(name, value, f"outside {INDICES[0]:g} to {INDICES[1]:g}: the end stands for it")
    return kept


def alphas(roughness: Value, of: Callable[[Array], tuple[Array, Array]]) -> tuple[Value, Value]:
    """alpha along the tangent and across it, at most 1, as a function `of` the roughness."""
    along, across = (changed(roughness, lambda r, n=n: np.minimum(of(r)[n], 1)) for n in (0, 1))  # type: ignore[misc]
    return along, across


def alike(roughness: Value) -> tuple[Value, Value]:
    """alpha along both axes, the square of a roughness."""
    return alphas(roughness, lambda r: (r * r, r * r))


def coated(notes: Notes, name: str, weight: float, coat: Coat) -> Coat | None:
    """A coat of that coverage: one that covers a part becomes one that reflects, absorbs and darkens as much less."""
    if weight == 0:
        return None
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


def tinted(given: Given, name: str, factor: float, tint: RGB) -> RGB:
    """Factors on the reflectance of a dielectric at the normal, by colours."""
    if max(tint) - min(tint) < ROUNDING:
        tint = (sum(tint) / 3,) * 3
    else:
        given.notes.add(name, given[name], "as an index by colour, with no tint towards the edge")
    red, green, blue = (factor * each for each in tint)
    return red, green, blue


def blended(given: Given, base: str, weight: float, below: str, share: float) -> Value:
    """The colour of a diffuse base: a weighed one, mixed with that of scattering below."""
    if share == 1:
        return given[below]
    if share == 0 or not isinstance(given[base], tuple):
        if share:
            given.notes.add(below, given[below], f"{base} stands for both, as it is an image")
        return changed(given[base], lambda c: weight * c)
    mixed = (1 - share) * weight * np.array(given.colour(base)) + share * np.array(given.colour(below))
    return tuple(mixed.tolist())


def absorbed(transmittance: RGB, length: float) -> Array:
    """Extinction of a medium that has this transmittance over a length."""
    return np.log(1 / np.maximum(transmittance, 1e-6)) / length


def inside(given: Given, name: str, sigma_a: Array, sigma_s: RGB = (0.0, 0.0, 0.0), g: float = 0.0) -> None:
    """Note a medium that fills a shape, which no stack holds."""
    if not (np.any(sigma_a) or np.any(sigma_s)):
        return
    values = f"sigma_a {shown(tuple(map(float, sigma_a)))}"
    values += f", sigma_s {shown(sigma_s)}, g {shown(g)}" if any(sigma_s) else ""
    why = f"fills the shape: in Mitsuba, an interior medium of {values} per unit of length of the scene"
    given.notes.add(name, given[name], why)
