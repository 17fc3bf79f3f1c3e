"""Parts of surfaces that several sources describe alike."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from velatura.programs.values import Array, Value, changed
from velatura.stack import RGB

# Reasons why a stack does not carry a parameter
FLAT = "surfaces of stacks are flat: in Mitsuba, put the BSDF into a normalmap or bumpmap"
TANGENT = "the tangent is dp/du: set the rotation of the interface"
FIBRES = "a stack has no fibres above it: left out"
LIGHT = "a stack emits no light: in Mitsuba, give the shape an area emitter"
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


def absorbed(transmittance: RGB, length: float) -> Array:
    """Extinction of a medium that has this transmittance over a length."""
    return np.log(1 / np.maximum(transmittance, 1e-6)) / length
