"""How the long facets of a stack's metal lie below its coats: what its lobe is parted by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from velatura import ops
from velatura.model import fitted
from velatura.model.rough_interface import Facets
from velatura.ops import Value


def crossing(facets: Sequence[Facets]) -> float:
    """How far the long facets of an opaque interface cross those of an interface above: from 0, for parallel ones,
    isotropic ones and such as make no step of the index, to 1."""
    *coats, last = facets
    if not last.opaque:
        return 0.0
    along = [each.rotation + (each.alpha_v > each.alpha_u) * 0.5 * np.pi for each in facets]
    across = (coat.brushed * np.sin(angle - along[-1]) ** 2 * _stepped(coat) for coat, angle in zip(coats, along))
    return float(-np.expm1(-last.brushed * max(across, default=0.0) / fitted.CROSSING))


def thrown_back(facets: Sequence[Facets]) -> float:
    """How far light that coats throw back to a brushed opaque interface is apart from light that meets this once: from
    0, for isotropic facets and below such coats as make no step of the index, to 1; as far as facets do not cross."""
    *coats, last = facets
    if not last.opaque:
        return 0.0
    step = max(map(_stepped, coats), default=0.0)
    return float(long(last.brushed)) * step * (1 - crossing(facets))


def long(brushed: Value) -> Value:
    """How far facets count as long, from 0 to 1, by 1 - alpha_min / alpha_max; in any dialect."""
    return ops.minimum(brushed * (1 / fitted.LONG), 1.0)


def _stepped(coat: Facets) -> float:
    return coat.step / (coat.step + fitted.CROSSING_FADE)


def parts_lobe(facets: Sequence[Facets]) -> bool:
    """Whether the lobe of the last interface is drawn as two."""
    return crossing(facets) > 0 or thrown_back(facets) > 0
