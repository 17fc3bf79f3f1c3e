"""Colours of an interface with thin films: its reflectance over the spectrum, as linear sRGB.

Colours of indices are those of channels, as everywhere: a channel has one index at all wavelengths, and its reflectance
is integrated with its own sensitivity. What depends on the wavelength is then the phase alone. An sRGB sensitivity is
negative somewhere, so that the most saturated colours of films lie outside; they are clipped to 0 to 1.

Over the wavenumber a film's reflectance is periodic, and sensitivities are smooth and vanish at both ends. There the
trapezoidal rule has no error but aliasing, of the harmonics that its step does not resolve. So the step starts from the
optical thickness, and is halved until the colour stays as it is twice: sharp resonances need more than thickness says.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura.optics.films import Film, coherent

Array: TypeAlias = NDArray[np.floating]
Channels: TypeAlias = tuple[float, ...]

#: Sensitivities (C, N) of the channels at wavelengths (N,) in nanometres, up to a factor each.
Sensitivity: TypeAlias = Callable[[Array], Array]

RANGE_NM = (360.0, 830.0)  # beyond it, sensitivities are 0
COARSEST = 48  # wavenumbers at first,
PER_PERIOD = 2.5  # or as many in a period of the thickest film's reflectance;
PER_PERIOD_FIXED = 10.0  # where no colour is looked at
CONVERGED = 1e-3  # change of a colour by half the step
FINEST = 1 << 14  # wavenumbers at most
BLOCK = 1 << 16  # cosines times wavenumbers at a time


@dataclass(frozen=True)
class ColouredFilm:
    """A film by the channels of its index eta + i k, and its thickness."""

    eta: Channels
    k: Channels
    thickness_nm: float


@dataclass(frozen=True)
class Coating:
    """Films, from the top, between media of indices eta_1 and eta_2 + i k_2, by channel."""

    films: tuple[ColouredFilm, ...]
    eta_1: Channels
    eta_2: Channels
    k_2: Channels = (0.0, 0.0, 0.0)

    @property
    def absorbs(self) -> bool:
        """Whether any of the films does."""
        return any(any(film.k) for film in self.films)

    def reflectance(self, cos_theta: Array, sensitivity: Sensitivity) -> Array:
        """Reflectance (C, N) of unpolarised light at cosines (N,) above, in [0, 1]."""
        return np.clip(self.share("reflected", cos_theta, sensitivity), 0.0, 1.0)

    def at(self, name: str, wavelengths_nm: Array, cos_theta: Array) -> Array:
        """As `share`, of channels of one wavelength each (C,)."""
        eta_1, eta_2, k_2 = (np.reshape(x, (-1, 1)) for x in (self.eta_1, self.eta_2, self.k_2))
        films = [Film(np.reshape(x.eta, (-1, 1)), np.reshape(x.k, (-1, 1)), x.thickness_nm) for x in self.films]
        return np.asarray(getattr(coherent(cos_theta, wavelengths_nm[:, None], eta_1, films, eta_2, k_2), name))

    def reversed(self) -> Coating:
        """As seen from below, between media that do not absorb."""
        return replace(self, films=self.films[::-1], eta_1=self.eta_2, eta_2=self.eta_1)

    def share(self, name: str, cos_theta: Array, sensitivity: Sensitivity) -> Array:
        """A property of `optics.films.Response`, by its name, as `reflectance`, with colours outside sRGB; cosines may
        differ from channel to channel, (C, N)."""
        if np.ndim(cos_theta) == 1:
            return self._integrated(name, cos_theta, sensitivity)
        return np.stack([self._integrated(name, each, sensitivity)[c] for c, each in enumerate(cos_theta)])

    def below(self, cos_theta: Array) -> Array:
        """Cosines (C, N) of refracted light, of cosines (N,) above; the medium below is not of lower index."""
        return np.sqrt(np.maximum(1 - self._ratio2 * (1 - cos_theta * cos_theta), 0))

    def totally_reflected(self, share: Array) -> Array:
        """Cosines (C, N) below, of light that cannot be above, by their ratio (N,) to that at the critical angle."""
        return np.sqrt(np.maximum(1 - self._ratio2, 0)) * share

    @property
    def _ratio2(self) -> Array:
        return np.asarray((np.array(self.eta_1) / np.array(self.eta_2))[:, None] ** 2)

    def _integrated(self, share: str, cos_theta: Array, sensitivity: Sensitivity) -> Array:
        channels = [self._channel(c) for c in range(len(self.eta_1))]
        if len({*channels}) == 1:
            return channels[0].integrated(share, cos_theta, sensitivity)
        each = (functools.partial(_only, sensitivity, c) for c in range(3))
        return np.concatenate([channel.integrated(share, cos_theta, own) for channel, own in zip(channels, each)])

    def _channel(self, c: int) -> _Channel:
        stack = tuple(Film(film.eta[c], film.k[c], film.thickness_nm) for film in self.films)
        return _Channel(self.eta_1[c], stack, self.eta_2[c], self.k_2[c])


@dataclass(frozen=True)
class _Channel:
    """The films as one channel sees them."""

    eta_1: float
    films: tuple[Film, ...]
    eta_2: float
    k_2: float

    def integrated(self, share: str, cos_theta: Array, sensitivity: Sensitivity) -> Array:
        """A share of light as colours (channels, N)."""

        def over(wavelengths_nm: Array, cosines: Array) -> Array:
            found = coherent(cosines[:, None], wavelengths_nm, self.eta_1, self.films, self.eta_2, self.k_2)
            return np.asarray(getattr(found, share))

        thickness_nm = sum(film.eta * film.thickness_nm for film in self.films)
        return integrated(over, cos_theta, thickness_nm, sensitivity)


def integrated(
    share: Callable[[Array, Array], Array], cosines: Array, thickness_nm: float, sensitivity: Sensitivity
) -> Array:
    """Colours (channels, N) of a share of light (N, W) over wavelengths (W,), at cosines (N,).

    thickness_nm: optical thickness of all films.
    """
    low, high = 1 / RANGE_NM[1], 1 / RANGE_NM[0]
    count = _intervals(thickness_nm, PER_PERIOD)
    step = (high - low) / count
    total, whole = _summed(share, cosines, low + step * np.arange(1, count), sensitivity)
    settled = 0
    while True:
        more, more_whole = _summed(share, cosines, low + step * (np.arange(count) + 0.5), sensitivity)
        before, total, whole = total / whole, total + more, whole + more_whole
        count, step = 2 * count, 0.5 * step
        settled = settled + 1 if np.abs(total / whole - before).max() < CONVERGED else 0
        # Twice, since harmonics that a step and its half both take for the mean change nothing
        if settled == 2 or 2 * count > FINEST:
            return np.asarray(total / whole)


def quadrature(thickness_nm: float, sensitivity: Sensitivity) -> tuple[Array, Array]:
    """Wavelengths (N,) in nanometres, and weights (channels, N) that sum shares of light up to colours.

    One fixed step for all films of an optical thickness, so that colours err by .004 at most, .0001 in the mean.
    """
    low, high = 1 / RANGE_NM[1], 1 / RANGE_NM[0]
    wavelengths_nm = 1 / np.linspace(low, high, _intervals(thickness_nm, PER_PERIOD_FIXED) + 1)[1:-1]
    weights = sensitivity(wavelengths_nm) * wavelengths_nm**2
    return wavelengths_nm, weights / weights.sum(axis=1, keepdims=True)


def _intervals(thickness_nm: float, per_period: float) -> int:
    """Steps of wavenumbers, for films of an optical thickness."""
    low, high = 1 / RANGE_NM[1], 1 / RANGE_NM[0]
    return max(COARSEST, int(np.ceil(per_period * 2 * thickness_nm * (high - low))))


def _summed(
    share: Callable[[Array, Array], Array], cosines: Array, wavenumbers: Array, sensitivity: Sensitivity
) -> tuple[Array, Array]:
    """Sums over wavenumbers of weighted shares (channels, N), and of weights (channels, 1)."""
    wavelengths_nm = 1 / wavenumbers
    weights = sensitivity(wavelengths_nm) * wavelengths_nm**2
    size = max(BLOCK // len(wavelengths_nm), 1)
    blocks = [cosines[k : k + size] for k in range(0, len(cosines), size)]
    total = [weights @ np.broadcast_to(share(wavelengths_nm, x), (len(x), len(wavelengths_nm))).T for x in blocks]
    return np.concatenate(total, axis=1), weights.sum(axis=1, keepdims=True)


def _only(sensitivity: Sensitivity, channel: int, wavelengths_nm: Array) -> Array:
    return sensitivity(wavelengths_nm)[channel : channel + 1]
