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
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura.optics.films import OpticalFilm, coherent

Array: TypeAlias = NDArray[np.floating]
Channels: TypeAlias = tuple[float, ...]

#: Sensitivities (C, N) of the channels at wavelengths (N,) in nanometres, up to a factor each.
Sensitivity: TypeAlias = Callable[[Array], Array]

RANGE_NM = (360.0, 830.0)  # beyond it, sensitivities are 0
COARSEST = 48  # wavenumbers at first,
PER_PERIOD = 1.309  # or as many in a period of all films' reflectance; four times as many are far from any integer,
PER_PERIOD_FIXED = 10.0  # whose harmonic they would take for the mean; where no colour is looked at
CONVERGED = 1e-3  # change of a colour by half the step
COMMON = (0.1, 10.0)  # moduli of indices of materials; of eight such films, single precision holds the fields
FINEST, FINEST_ELSE = 1 << 12, 1 << 9  # wavenumbers at most, of films and media of common indices, and of others
TOGETHER = 32  # neighbouring cosines that settle together
DOUBLE_NM = 1000.0  # optical thickness from which single precision, three times as quick, serves
BLOCK = 1 << 14  # cosines times wavenumbers at a time, which a processor's cache holds


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
        """Whether any of the films absorbs."""
        return any(any(film.k) for film in self.films)

    def reflectance(self, cos_theta: Array, sensitivity: Sensitivity) -> Array:
        """Reflectance (C, N) of unpolarised light at cosines (N,) above, in [0, 1]."""
        return np.clip(self.shares(["reflected"], cos_theta, sensitivity)[0], 0.0, 1.0)

    def at(self, names: Sequence[str], cos_theta: Array, wavelengths_nm: Array) -> Array:
        """Properties like those of `shares`, of channels of one wavelength each (C,)."""
        eta_1, eta_2, k_2 = (np.reshape(x, (-1, 1)) for x in (self.eta_1, self.eta_2, self.k_2))
        films = [OpticalFilm(np.reshape(x.eta, (-1, 1)), np.reshape(x.k, (-1, 1)), x.thickness_nm) for x in self.films]
        found = coherent(cos_theta, wavelengths_nm[:, None], eta_1, films, eta_2, k_2)
        return np.stack([getattr(found, name) for name in names])

    def reversed(self) -> Coating:
        """The coating seen from below, between media that do not absorb."""
        return replace(self, films=self.films[::-1], eta_1=self.eta_2, eta_2=self.eta_1)

    def shares(self, names: Sequence[str], cos_theta: Array, sensitivity: Sensitivity) -> Array:
        """Properties of `optics.films.Response`, by their names, as `reflectance`, with colours outside sRGB: (names,
        C, N); cosines may differ from channel to channel, (C, N)."""
        channels = [self._channel(c) for c in range(len(self.eta_1))]
        cosines = np.broadcast_to(cos_theta, (len(channels), np.shape(cos_theta)[-1]))
        if len({*channels}) == 1 and (cosines == cosines[0]).all():
            return channels[0].integrated(names, cosines[0], sensitivity)
        own = (functools.partial(_only, sensitivity, c) for c in range(len(channels)))
        each = (channel.integrated(names, *seen) for channel, *seen in zip(channels, cosines, own))
        return np.concatenate([*each], axis=1)

    def below(self, cos_theta: Array) -> Array:
        """Cosines (C, N) of refracted light, of cosines (N,) above; the medium below is not of lower index."""
        return np.sqrt(np.maximum(1 - self._ratio2 * (1 - cos_theta * cos_theta), 0))

    def totally_reflected(self, share: Array) -> Array:
        """Cosines (C, N) below, of light that cannot be above, by their ratio (N,) to that at the critical angle."""
        return np.sqrt(np.maximum(1 - self._ratio2, 0)) * share

    @property
    def _ratio2(self) -> Array:
        return np.asarray((np.array(self.eta_1) / np.array(self.eta_2))[:, None] ** 2)

    def _channel(self, c: int) -> _Channel:
        stack = tuple(OpticalFilm(film.eta[c], film.k[c], film.thickness_nm).in_colours() for film in self.films)
        return _Channel(self.eta_1[c], stack, self.eta_2[c], self.k_2[c])


@dataclass(frozen=True)
class _Channel:
    """The films as one channel sees them."""

    eta_1: float
    films: tuple[OpticalFilm, ...]
    eta_2: float
    k_2: float

    def integrated(self, names: Sequence[str], cosines: Array, sensitivity: Sensitivity) -> Array:
        """Shares of light as colours (names, channels, N)."""

        thickness_nm = sum(film.optical_nm for film in self.films)
        indices = *((film.eta, film.k) for film in self.films), (self.eta_1, 0.0), (self.eta_2, self.k_2)
        common = all(COMMON[0] < np.hypot(*index) < COMMON[1] for index in indices)
        number = np.float32 if common and thickness_nm > DOUBLE_NM else np.float64
        most = FINEST if common else FINEST_ELSE

        def over(wavelengths_nm: Array, cosines: Array) -> Array:
            found = coherent(cosines[:, None], wavelengths_nm, self.eta_1, self.films, self.eta_2, self.k_2)
            shape = len(cosines), len(wavelengths_nm)
            return np.stack([np.broadcast_to(getattr(found, name), shape) for name in names])

        return integrated(over, cosines.astype(number), thickness_nm, sensitivity, most)


def integrated(
    shares: Callable[[Array, Array], Array],
    cosines: Array,
    thickness_nm: float,
    sensitivity: Sensitivity,
    most: int = FINEST,
) -> Array:
    """Colours (S, channels, N) of shares of light (S, N, W) over wavelengths (W,), at cosines (N,), whose precision is
    that of the shares.

    thickness_nm: optical thickness of all films.
    most: wavelengths.
    """
    low, high = 1 / RANGE_NM[1], 1 / RANGE_NM[0]
    count = min(_intervals(thickness_nm, PER_PERIOD), most // 4)
    step = (high - low) / count
    total, whole = _summed(shares, cosines, low + step * np.arange(1, count), sensitivity)
    found = np.empty_like(total)
    left, settled = np.arange(len(cosines)), np.zeros(len(cosines), int)
    while len(left):
        more, more_whole = _summed(shares, cosines[left], low + step * (np.arange(count) + 0.5), sensitivity)
        before, total, whole = total / whole, total + more, whole + more_whole
        count, step = 2 * count, 0.5 * step
        now = total / whole
        first = np.flatnonzero(np.diff(left // TOGETHER, prepend=-1))
        change = np.maximum.reduceat(np.abs(now - before).max(axis=(0, 1)), first)
        settled = np.where(np.repeat(change, np.diff(first, append=len(left))) < CONVERGED, settled + 1, 0)
        # Twice, since harmonics that a step and its half both take for the mean change nothing
        done = (settled == 2) | (2 * count > most)
        found[..., left[done]] = now[..., done]
        left, total, settled = left[~done], total[..., ~done], settled[~done]
    return found


def quadrature(thickness_nm: float, sensitivity: Sensitivity) -> tuple[Array, Array]:
    """Wavelengths (N,) in nanometres, and weights (channels, N) that sum shares of light up to colours.

    One fixed step for all films of an optical thickness, so that colours err by .004 at most, .0001 in the mean.
    """
    low, high = 1 / RANGE_NM[1], 1 / RANGE_NM[0]
    count = min(_intervals(thickness_nm, PER_PERIOD_FIXED), FINEST // 2)
    wavelengths_nm = 1 / np.linspace(low, high, count + 1)[1:-1]
    weights = sensitivity(wavelengths_nm) * wavelengths_nm**2
    return wavelengths_nm, weights / weights.sum(axis=1, keepdims=True)


def _intervals(thickness_nm: float, per_period: float) -> int:
    """Steps of wavenumbers, for films of an optical thickness."""
    low, high = 1 / RANGE_NM[1], 1 / RANGE_NM[0]
    return max(COARSEST, int(np.ceil(per_period * 2 * thickness_nm * (high - low))))


def _summed(
    shares: Callable[[Array, Array], Array], cosines: Array, wavenumbers: Array, sensitivity: Sensitivity
) -> tuple[Array, Array]:
    """Sums over wavenumbers of weighted shares (S, channels, N), and of weights (channels, 1)."""
    wavelengths_nm = 1 / wavenumbers
    weights = sensitivity(wavelengths_nm) * wavelengths_nm**2
    size = max(BLOCK // len(wavelengths_nm), 1)
    blocks = [cosines[k : k + size] for k in range(0, len(cosines), size)]
    total = [weights @ shares(wavelengths_nm.astype(x.dtype), x).swapaxes(1, 2) for x in blocks]
    return np.concatenate(total, axis=-1), weights.sum(axis=1, keepdims=True)


def _only(sensitivity: Sensitivity, channel: int, wavelengths_nm: Array) -> Array:
    return sensitivity(wavelengths_nm)[channel : channel + 1]
