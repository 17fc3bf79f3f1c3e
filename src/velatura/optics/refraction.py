"""Refraction about a microfacet normal.

`w` points away from the surface on the side of `h` (w·h > 0); the refracted direction points away on the other side.
`eta` is the index there over the index on the side of `w`.
"""

from __future__ import annotations

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel, ggx
from velatura.optics.ggx import Direction

_FLAT = 1e-9  # where the two directions cancel out there is no normal, and none may be a null vector


def refract(w: Direction, h: Direction, eta: Value) -> Direction:
    """The refracted direction, by Snell's law; it grazes the facet where light is totally reflected."""
    return ggx.normalize(refract_at(w, h, ggx.dot(w, h), eta))


def refract_at(w: Direction, h: Direction, cosine: Value, eta: Value) -> Direction:
    """The same by the cosine w·h that is known, of length 1 only where light passes."""
    t = cosine / eta - fresnel.cos_transmitted(cosine, eta)
    return t * h[0] - w[0] / eta, t * h[1] - w[1] / eta, t * h[2] - w[2] / eta


def half_vector(w: Direction, o: Direction, eta: Value) -> Direction:
    """The normal, turned upwards, that sends `w` into `o`: by refraction, or by reflection where eta = 1.

    (Walter 2007, Eqs. 13 and 16)
    """
    h = ggx.normalize((w[0] + eta * o[0], w[1] + eta * o[1], w[2] + eta * o[2]))
    up = ops.select(h[2] < 0, -1.0, 1.0)
    return up * h[0], up * h[1], ops.maximum(up * h[2], _FLAT)


def jacobian(cos_w: Value, cos_o: Value, eta: Value) -> Value:
    """Solid angle of normals over that of `o`, given w·h and o·h; eta = 1 for reflection (Walter 2007, Eqs. 14, 17)."""
    q = cos_w + eta * cos_o
    return ops.divide(eta * eta * ops.absolute(cos_o), q * q)
