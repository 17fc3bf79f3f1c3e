"""Schlick's Fresnel averaged over rough interfaces: R0 y + x, the split sum (Karis 2013; Weier & Belcour 2020, 3.2).

x is the mean of (1 - cos_d)^5 over the microfacets that are seen, and y that of 1 - (1 - cos_d)^5. Schlick's Fresnel is
close enough to Fresnel's own that the low-rank table of dielectrics holds both, x to 1.2e-3.
"""

from __future__ import annotations

from velatura.ops import Value
from velatura.optics import fresnel
from velatura.tables.fetch import Row
from velatura.tables.store import Tables


def schlick_row(tables: Tables, r_0: Value) -> Row:
    """Row of an interface that reflects r_0 at normal incidence."""
    return Row(tables.dielectric, [fresnel.schlick(c, r_0) for c in tables.dielectric.nodes], 1.0, None, rarer=False)
