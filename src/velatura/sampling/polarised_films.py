"""Mueller matrices of interfaces with thin films, sampled once over the cosine."""

from __future__ import annotations

import functools
from math import pi

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value
from velatura.optics.coatings import Coating, Sensitivity
from velatura.optics.polarisation import Mueller
from velatura.sampling.coated import NODES, Sampled

Array = NDArray[np.floating]

TOTAL = 513  # directions under total reflection, where phases turn fast


class PolarisedFilms:
    """Matrices by colour, for light from either side; refraction is that of films that absorb nothing.

    `within` are sampled over the cosine on the rarer side; `total`, under total reflection, over the angle whose cosine
    is that on the denser side over the one at the critical angle. It is None for what is opaque.
    """

    def __init__(self, within: Sampled, total: Sampled | None) -> None:
        self.within, self.total = within, total

    def opaque(self, cosine: Value, like: Value) -> Mueller:
        """Of light that an opaque interface reflects, by colours of the kind of `like`."""
        return Mueller(*self.within.colours(like, cosine))

    def dielectric(self, cosine: Value, cos_t: Value, eta: Value, like: Value) -> tuple[Mueller, Mueller]:
        """Of light that is reflected, and refracted, for cosines on both sides, 0 beyond where it is totally reflected,
        and the index there over that here."""
        assert self.total
        passes, from_rarer = cos_t > 0, eta > 1
        s, p, *products = self.within.colours(like, ops.select(from_rarer, cosine, cos_t))
        real, imaginary, real_below, imaginary_below, real_through, imaginary_through = products
        share = ops.minimum(ops.divide(cosine, ops.sqrt(1 - eta * eta)), 1.0)
        angle = ops.arctan2(ops.sqrt(1 - share * share), share) * (2 / pi)
        real_total, imaginary_total = self.total.colours(like, angle)
        reflection = Mueller(
            ops.select(passes, s, 1.0),
            ops.select(passes, p, 1.0),
            ops.select(passes, ops.select(from_rarer, real, real_below), real_total),
            ops.select(passes, ops.select(from_rarer, imaginary, imaginary_below), imaginary_total),
        )
        return reflection, Mueller(1 - s, 1 - p, real_through, imaginary_through)


@functools.lru_cache(16)
def polarised_films(coating: Coating, opaque: bool, sensitivity: Sensitivity) -> PolarisedFilms:
    """Of films between a medium of the lower index, above, and one of the higher, or an opaque one."""
    cosines = np.linspace(0, 1, NODES)[None].repeat(3, axis=0)

    def product(of: Coating, name: str, cos: Array, s: Array | float, p: Array | float) -> list[Array]:
        real, imaginary = (_by_channel(of, f"{name}_{part}", cos, sensitivity) for part in ("real", "imaginary"))
        # Sensitivities that are negative leave no matrix that light cannot have
        bound = np.sqrt(s * p) / np.maximum(np.hypot(real, imaginary), 1e-9)
        return [np.minimum(bound, 1) * x for x in (real, imaginary)]

    s, p = (_by_channel(coating, f"reflected_{x}", cosines, sensitivity) for x in "sp")
    # Colours outside sRGB are clipped as those of unpolarised light are
    both = 2 * np.clip(0.5 * (s + p), 0, 1)
    s = np.clip(s, np.maximum(both - 1, 0), np.minimum(both, 1))
    p = both - s
    parts = [s, p, *product(coating, "reflected", cosines, s, p)]
    if opaque:
        return PolarisedFilms(_sampled(parts), None)
    back = Coating(coating.films[::-1], coating.eta_2, coating.eta_1)
    ratio2 = (np.array(coating.eta_1) / np.array(coating.eta_2))[:, None] ** 2
    parts += product(back, "reflected", np.sqrt(1 - ratio2 * (1 - cosines**2)), s, p)
    parts += product(coating, "transmitted", cosines, 1 - s, 1 - p)
    beyond = np.sqrt(np.maximum(1 - ratio2, 0)) * np.cos(np.linspace(0, pi / 2, TOTAL))
    return PolarisedFilms(_sampled(parts), _sampled(product(back, "reflected", beyond, 1.0, 1.0)))


def _by_channel(coating: Coating, name: str, cosines: Array, sensitivity: Sensitivity) -> Array:
    """A share (3, N) at cosines (3, N)."""
    if (cosines == cosines[0]).all():
        return coating.share(name, cosines[0], sensitivity)
    return np.stack([coating.share(name, each, sensitivity)[c] for c, each in enumerate(cosines)])


def _sampled(parts: list[Array]) -> Sampled:
    return Sampled(np.concatenate(parts).T.copy())
