"""Kubelka and Munk's theory of two diffuse fluxes (Kubelka 1948), and Saunderson's correction for a surface.

K and S are coefficients of absorption and scattering per unit of length. Reflectances are those of diffuse light inside
of the medium. The package follows light itself (`velatura.model.solved.energies`); this is what measurements of paint
are stated in, and where fits begin.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.optics import fresnel

Array = NDArray[np.floating]

NODES = 64  # of directions
LEAST = 1e-12


def opaque(k: ArrayLike, s: ArrayLike) -> Array:
    """Reflectance of a layer that is so thick that nothing shows through."""
    k, s = np.asarray(k, float), np.asarray(s, float)
    # Kubelka 1948, a - sqrt(a^2 - 1) with a = (S + K) / S, without cancellation
    return s / np.maximum(s + k + np.sqrt(k * (k + 2 * s)), LEAST)


def ratio(reflectance: ArrayLike) -> Array:
    """K / S of an opaque layer."""
    r = np.maximum(reflectance, LEAST)
    return np.asarray((1 - r) ** 2 / (2 * r))


def over(k: ArrayLike, s: ArrayLike, depth: ArrayLike, ground: ArrayLike) -> Array:
    """Reflectance of a layer of some depth over a ground; S > 0."""
    k, s = np.asarray(k, float), np.asarray(s, float)
    a = 1 + k / s
    b = np.maximum(np.sqrt(a * a - 1), 1e-6)  # near 0 it is that of 0
    coth = b / np.tanh(np.maximum(b * s * depth, LEAST))
    # Kubelka 1948, "reflectance of a layer with a background"
    return np.asarray((1 - ground * (a - coth)) / (a - ground + coth))


def coefficients(
    over_black: ArrayLike, over_white: ArrayLike, black: ArrayLike, white: ArrayLike, depth: float
) -> tuple[Array, Array]:
    """K and S of a layer of some depth, of its reflectances over two grounds; not finite where no layer has these.

    Its reflectance over a ground G, R (a - G + c) = 1 - G (a - c), is linear in a = (S + K) / S and in c, which is
    b coth(b S depth), as b^2 = a^2 - 1.
    """
    pairs = [(np.asarray(r, float), np.asarray(g, float)) for r, g in ((over_black, black), (over_white, white))]
    (p, q, one), (u, v, other) = ((r + g, r - g, 1 + r * g) for r, g in pairs)
    with np.errstate(all="ignore"):
        # Solve p a + q c = 1 + R G for both grounds
        determinant = p * v - u * q
        a, c = (one * v - other * q) / determinant, (p * other - u * one) / determinant
        b = np.sqrt(a * a - 1)
        s = np.arctanh(b / c) / (b * depth)
    return s * (a - 1), s


def surface(eta: float) -> tuple[float, float]:
    """Reflectances of a smooth surface of relative index eta > 1: along the normal from outside, and of diffuse light
    from inside."""
    x, weights = np.polynomial.legendre.leggauss(NODES)
    critical = np.sqrt(1 - 1 / eta**2)  # cosine of total reflection, beside which the rest is smooth
    cosines = critical + (1 - critical) * (x + 1) / 2
    passed = (1 - fresnel.dielectric(cosines, 1 / eta)) * 2 * cosines
    inside = 1 - (1 - critical) / 2 * float(weights @ passed)
    return float(fresnel.normal_incidence(eta)), inside


def outside(reflectance: ArrayLike, eta: float) -> Array:
    """Reflectance along the normal under a smooth surface of relative index eta, with the surface's own (Saunderson
    1942)."""
    first, inside = surface(eta)
    r = np.asarray(reflectance, float)
    return first + (1 - first) * (1 - inside) * r / (1 - inside * r)


def below(seen: ArrayLike, eta: float) -> Array:
    """Reflectance of diffuse light below a smooth surface, of that seen along the normal; the inverse of `outside`."""
    first, inside = surface(eta)
    left = np.asarray(seen, float) - first
    return np.asarray(left / ((1 - first) * (1 - inside) + inside * left))
