"""Reflectance and transmittance of thin films between two media, coherent, at one wavelength.

Indices are absolute, and a film is thin: light keeps its phase across all of them. Films are listed from the side that
light comes from. Each polarisation is a pair of fields (u, v), continuous across every boundary, that a film's
characteristic matrix takes from its lower side to its upper one (Born and Wolf 1999, section 1.6): u is the electric
field for s and the magnetic one for p, and v is u times q, over the square of the index for p. q is the part of the
wave vector along the normal, in units of that of the vacuum. A matrix is an even function of q, so no root has a sign
to be chosen, and nothing is singular where light grazes a film.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

from velatura import ops
from velatura.ops import Value

COHERENT_NM = 20_000.0  # optical thickness up to which colours may show that light keeps its phase across a film
_SQUARE_MIN = 1e-12  # least square of q: what light grazes has a field that is linear over its depth, not constant


@dataclass(frozen=True)
class OpticalFilm:
    """A film of index eta + i k and a thickness in nanometres; a thickness of 0 is no film.

    `phase_nm` is the thickness that the phase of light sees, that of the film unless it is given.
    """

    eta: Value
    k: Value
    thickness_nm: Value
    phase_nm: Value | None = None

    def in_colours(self) -> OpticalFilm:
        """The film as its colours see it: a thick one has the phase of a thinner one.

        Beyond `COHERENT_NM` the reflectance over the wavenumber has waves so close together that a colour is its mean
        over the phase. Waves that are further apart have the same mean, and ask for fewer wavelengths. Absorption is
        that of the whole thickness.
        """
        waves = self.eta * self.thickness_nm / COHERENT_NM
        slower = (1 + ops.log(ops.maximum(waves, 1.0))) / ops.maximum(waves, 1.0)
        return OpticalFilm(self.eta, self.k, self.thickness_nm, self.thickness_nm * slower)

    @property
    def optical_nm(self) -> Value:
        """The optical thickness of the phase."""
        return self.eta * (self.thickness_nm if self.phase_nm is None else self.phase_nm)


@dataclass(frozen=True)
class _Complex:
    """A complex number of any dialect."""

    re: Value
    im: Value

    def __add__(self, other: _Complex) -> _Complex:
        return _Complex(self.re + other.re, self.im + other.im)

    def __sub__(self, other: _Complex) -> _Complex:
        return _Complex(self.re - other.re, self.im - other.im)

    def __mul__(self, other: _Complex) -> _Complex:
        return _Complex(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    def __truediv__(self, other: _Complex) -> _Complex:
        product, square = self * other.conjugate, other.square
        return _Complex(product.re / square, product.im / square)

    def times(self, real: Value) -> _Complex:
        return _Complex(self.re * real, self.im * real)

    @property
    def conjugate(self) -> _Complex:
        return _Complex(self.re, -self.im)

    @property
    def square(self) -> Value:
        """The square of the modulus."""
        return self.re * self.re + self.im * self.im


@dataclass(frozen=True)
class Response:
    """Shares of light that films and the media around them reflect and transmit, for each polarisation.

    `_s` and `_p` are fields that are incident and reflected at the top, up to a factor each.
    """

    reflected_s: Value
    reflected_p: Value
    transmitted_s: Value
    transmitted_p: Value
    _s: tuple[_Complex, _Complex]
    _p: tuple[_Complex, _Complex]

    @property
    def reflected(self) -> Value:
        """The share of unpolarised light that is reflected."""
        return 0.5 * (self.reflected_s + self.reflected_p)

    @property
    def transmitted(self) -> Value:
        """The share of unpolarised light that is transmitted."""
        return 0.5 * (self.transmitted_s + self.transmitted_p)

    @property
    def reflected_real(self) -> Value:
        """The real part of r_s conj(r_p), of amplitudes that are reflected (`optics.polarisation.Mueller`)."""
        return self._reflected.re

    @property
    def reflected_imaginary(self) -> Value:
        """Its imaginary part."""
        return self._reflected.im

    @property
    def transmitted_real(self) -> Value:
        """The real part of t_s conj(t_p), of amplitudes that are transmitted into a medium that does not absorb; their
        squares are shares of energy."""
        return self._transmitted.re

    @property
    def transmitted_imaginary(self) -> Value:
        """Its imaginary part."""
        return self._transmitted.im

    @property
    def _reflected(self) -> _Complex:
        (incident_s, reflected_s), (incident_p, reflected_p) = self._s, self._p
        return (reflected_s / incident_s) * (reflected_p / incident_p).conjugate

    @property
    def _transmitted(self) -> _Complex:
        phase = self._p[0] * self._s[0].conjugate
        return phase.times(ops.sqrt(ops.divide(self.transmitted_s * self.transmitted_p, phase.square)))


def coherent(
    cos_theta: Value, wavelength_nm: Value, eta_1: Value, films: Sequence[OpticalFilm], eta_2: Value, k_2: Value = 0.0
) -> Response:
    """Reflectance, and transmittance into the medium below, of films between two media.

    Args:
        cos_theta: cosine of the light in the medium above, in [0, 1].
        wavelength_nm: in vacuum.
        eta_1: index of the medium above, which does not absorb.
        films: from the top.
        eta_2, k_2: index of the medium below; light that enters one that absorbs counts as transmitted.

    (Born and Wolf 1999, section 1.6)
    """
    sin2 = eta_1 * eta_1 * (1 - cos_theta * cos_theta)
    square_2 = _square(eta_2, k_2)
    q_2 = _normal(square_2, sin2)
    s, p = (_Complex(1.0, 0.0), q_2), (square_2, q_2)
    flux_s, flux_p = q_2.re, (square_2.conjugate * q_2).re

    # From the medium below, upwards through each film
    left: Value = 1.0
    for film in reversed(films):
        square = _square(film.eta, film.k)
        q = _normal(square, sin2)
        phase_nm = film.thickness_nm if film.phase_nm is None else film.phase_nm
        depth = _Complex(q.re * phase_nm, q.im * film.thickness_nm)
        cosine, sine, decay = _circular(depth.times(2 * pi / wavelength_nm))
        over_q, times_q = _over_i(sine / q), _over_i(sine * q)
        s = _through(cosine, over_q, times_q, s)
        p = _through(cosine, over_q * square, times_q / square, p)
        left = left * decay * decay

    q_1 = eta_1 * cos_theta
    r_s, t_s, fields_s = _at_the_top(q_1, s)
    r_p, t_p, fields_p = _at_the_top(q_1 / (eta_1 * eta_1), p)
    return Response(r_s, r_p, t_s * flux_s * left, t_p * flux_p * left, fields_s, fields_p)


def _square(eta: Value, k: Value) -> _Complex:
    return _Complex(eta * eta - k * k, 2 * eta * k)


def _normal(square: _Complex, sin2: Value) -> _Complex:
    """q of light in a medium, by the square of its index; of two roots, that of a wave that decays downwards."""
    re, im = square.re - sin2, square.im
    modulus = ops.maximum(ops.sqrt(re * re + im * im, None), _SQUARE_MIN)
    greater = ops.sqrt(0.5 * (modulus + ops.absolute(re)), None)
    smaller = 0.5 * im / greater
    propagates = re >= 0
    return _Complex(ops.select(propagates, greater, smaller), ops.select(propagates, smaller, greater))


def _circular(x: _Complex) -> tuple[_Complex, _Complex, Value]:
    """Cosine and sine, both times exp(-im), which no thickness lets overflow, and that factor."""
    decay = ops.exp(-x.im)
    grown, shrunk = 0.5 * (1 + decay * decay), 0.5 * (1 - decay * decay)
    cosine, sine = ops.cos(x.re), ops.sin(x.re)
    return _Complex(cosine * grown, -sine * shrunk), _Complex(sine * grown, cosine * shrunk), decay


def _over_i(z: _Complex) -> _Complex:
    return _Complex(z.im, -z.re)


def _through(
    cosine: _Complex, upper: _Complex, lower: _Complex, fields: tuple[_Complex, _Complex]
) -> tuple[_Complex, _Complex]:
    """Fields above a film, from those below it."""
    u, v = fields
    return cosine * u + upper * v, lower * u + cosine * v


def _at_the_top(admittance: Value, fields: tuple[_Complex, _Complex]) -> tuple[Value, Value, tuple[_Complex, _Complex]]:
    """The reflectance, and transmittance over the flux below, for fields at the top; and what is incident and reflected
    there."""
    u, v = fields
    incident, reflected = u.times(admittance) + v, u.times(admittance) - v
    square = ops.maximum(incident.square, ops.TINY)
    return reflected.square / square, 4 * admittance / square, (incident, reflected)
