"""The albedo of anisotropic lobes as they are drawn: single reflections by a mirror of two roughnesses.

drawn                   over the cosine, the roughness in the plane of incidence and that across it
"""

from __future__ import annotations

from velatura import ops
from velatura.ops import Value
from velatura.tables import coordinates
from velatura.tables.store import Tables


def drawn_albedo(tables: Tables, cos_theta: Value, alpha_x: Value, alpha_y: Value) -> Value:
    """Albedo of a lobe of roughness alpha_x in the plane of incidence and alpha_y across it."""
    return ops.interpolate(
        tables.drawn,
        coordinates.from_cosine(cos_theta),
        coordinates.from_roughness(alpha_x),
        coordinates.from_roughness(alpha_y),
    )[0]
