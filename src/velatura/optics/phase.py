"""The Henyey-Greenstein phase function.

`cos_theta` is the cosine between the directions of travel before and after scattering: 1 goes straight on.
"""

from __future__ import annotations

from math import pi

from velatura import ops
from velatura.ops import Value
from velatura.optics.ggx import Direction

G_MIN = 1e-3  # where it scatters evenly, and a division by g would be one by 0


def henyey_greenstein(cos_theta: Value, g: Value) -> Value:
    """Density per solid angle, in 1/sr, for asymmetry g in (-1, 1)."""
    d = (1 - g) * (1 - g) + 2 * g * (1 - cos_theta)
    return (1 - g * g) / (4 * pi * d * ops.sqrt(d))


def forwards(g: Value) -> Value:
    """Share that is scattered into the half in front."""
    g = ops.select(ops.absolute(g) < G_MIN, G_MIN, g)
    return (1 + g) / (2 * g) * (1 - (1 - g) / ops.sqrt(1 + g * g))


def sample_henyey_greenstein(g: Value, u: Value) -> Value:
    """Cosine drawn from the phase function by a uniform u in [0, 1).

    The distribution function's inverse, (1 + g^2 - ((1-g^2)/(1+g s))^2) / (2g) with s = 2u-1, multiplied out so that
    the division by g cancels.
    """
    s = 2 * u - 1
    d = 1 + g * s
    return (s + 0.5 * g * (3 + s * s) + g * g * s - 0.5 * g * g * g * (1 - s * s)) / (d * d)


def deflect(w: Direction, cos_theta: Value, phi: Value) -> Direction:
    """The direction of travel `w` turned by the angle of cosine `cos_theta`, at azimuth `phi` about it."""
    # Build two directions across w (Duff et al. 2017)
    sign = ops.select(w[2] < 0, -1.0, 1.0)
    a = -1 / (sign + w[2])
    b = w[0] * w[1] * a
    s = (1 + sign * w[0] * w[0] * a, sign * b, -sign * w[0])
    t = (b, sign + w[1] * w[1] * a, -w[1])
    # Turn
    sin_theta = ops.sqrt(1 - cos_theta * cos_theta)
    x, y = sin_theta * ops.cos(phi), sin_theta * ops.sin(phi)
    return (
        x * s[0] + y * t[0] + cos_theta * w[0],
        x * s[1] + y * t[1] + cos_theta * w[1],
        x * s[2] + y * t[2] + cos_theta * w[2],
    )
