"""Metals whose index was measured, as the channels of a colour see them: at a few wavelengths each.

A channel is a weighted sum over wavelengths, of each of which light goes its own way. One index a channel is none: what
light does below a coat, where it meets the metal several times, bends with the reflectance, which differs within a
channel.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from velatura.optics import fresnel
from velatura.stack import InterfaceValues, Material, MeasuredIndex, spectrum, srgb_weights
from velatura.stack.layers import is_zero
from velatura.stack.spectra import LUMINANCE

Array = NDArray[np.floating]

INDICES = (1.0, 1.4, 1.8)  # of media above
COSINES = (1.0, 0.75, 0.5, 0.25)
BACK = (0.0, 0.3, 0.6, 0.8)  # shares of light that what lies above throws back
CLOSE = 0.002  # errors of light: fewer wavelengths do
SEEN_NM = (400.0, 700.0)  # wavelengths that may stand for others,
EACH = (1, 1, 4)  # of those of `srgb_weights` each one, or each fourth of three together
NEARLY = 1e-9  # wavelengths as alike as that are one
LIGHT = 1e-4  # of weights, as of errors


@dataclass(frozen=True, eq=False)
class MetalWavelengths:
    """Index eta + i k (S,) of a metal at some wavelengths, each of one `channel` (S,) of a colour, which is the sum by
    `weights` (S,) of what follows from it there.

    Weights of a channel sum up to 1; some are negative, as sensitivities of sRGB are.
    """

    nm: Array
    eta: Array
    k: Array
    channel: NDArray[np.integer]
    weights: Array

    @property
    def channels(self) -> int:
        return int(self.channel[-1]) + 1

    def seen(self, values: Array, axis: int = -1) -> Array:
        """Values at the wavelengths, along an axis, as channels; what is the same at all of a channel stays so."""
        each = np.moveaxis(values, axis, -1)
        found = []
        for c in range(self.channels):
            own, weights = each[..., self.channel == c], self.weights[self.channel == c]
            found.append(own[..., 0] + (own - own[..., :1]) @ weights)
        return np.moveaxis(np.stack(found, axis=-1), -1, axis)

    @property
    def exceeds(self) -> bool:
        """Whether a channel is more than all light, as gold's red is, which lies outside sRGB."""
        return bool(self.seen(fresnel.conductor(np.array(COSINES)[:, None], self.eta, self.k)).max() > 1)


def of(material: Material, most: int) -> MetalWavelengths | None:
    """The wavelengths of the metal that a material in channels of colours ends in; None where none was measured, or
    films on it have their own colours."""
    index, light, last = material.measured[-1], material.light, material.layers[-1]
    if index is None or not isinstance(light, str) or not isinstance(last, InterfaceValues):
        return None
    bare = all(is_zero(film.thickness_nm) for film in last.films)
    return wavelengths(index, light, most) if bare else None


@functools.lru_cache(256)
def wavelengths(index: MeasuredIndex, light: str, most: int) -> MetalWavelengths:
    """The wavelengths, `most` for a channel, that stand for a metal in the channels of linear sRGB, or of "luminance".

    They are chosen and weighted so that reflectances of facets in denser media, after any number of reflections by what
    lies above, are those of the spectrum.
    """
    nm, weights = srgb_weights()
    if light == "luminance":
        weights = np.array([LUMINANCE]) @ weights
    eta, k = (np.interp(nm, *spectrum(part)) for part in (index.eta, index.k))
    reflected = _reflected(eta, k)
    allowed = np.flatnonzero((nm >= SEEN_NM[0]) & (nm <= SEEN_NM[1]))
    each = [_chosen(reflected / (reflected @ channel)[:, None], allowed, most) for channel in weights]
    places = np.concatenate([chosen for chosen, _ in each])
    channel = np.repeat(np.arange(len(each)), [len(chosen) for chosen, _ in each])
    return MetalWavelengths(nm[places], eta[places], k[places], channel, np.concatenate([own for _, own in each]))


def _reflected(eta: Array, k: Array) -> Array:
    """Light that comes out of coats of some kinds at every wavelength, (kinds, W)."""
    cosines = np.array(COSINES)[:, None]
    facets = [np.asarray(fresnel.conductor(cosines, eta / n, k / n)) for n in INDICES]
    return np.concatenate([r / (1 - back * r) for r in facets for back in BACK])


def _chosen(light: Array, allowed: NDArray[np.integer], most: int) -> tuple[NDArray[np.integer], Array]:
    """The wavelengths, and their weights, by which a sum of all kinds of light (kinds, W) is nearest to 1: as few as
    make it close."""
    for count, step in zip(range(1, most + 1), EACH):
        sets = np.array(list(combinations(allowed[::step], count)))
        # The last weight is what the others leave of 1
        columns = light[:, sets]
        last = columns[..., -1]
        others = columns[..., :-1] - last[..., None]
        matrices = np.einsum("fpi,fpj->pij", others, others) + NEARLY * np.eye(count - 1)
        weights = np.linalg.solve(matrices, np.einsum("fpi,fp->pi", others, 1 - last)[..., None])[..., 0]
        errors = np.abs(np.einsum("fpi,pi->fp", others, weights) + last - 1).max(axis=0)
        # Of those that are close, least weights
        best = int((np.maximum(errors, CLOSE) + LIGHT * np.abs(weights).sum(axis=-1)).argmin())
        if errors[best] < CLOSE:
            break
    return sets[best], np.append(weights[best], 1 - weights[best].sum())
