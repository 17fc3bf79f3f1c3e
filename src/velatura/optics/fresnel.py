"""Fresnel reflectance of a smooth interface: of unpolarised light, and amplitudes of both polarisations.

Indices are relative: eta = eta_2 / eta_1 and kappa = k_2 / eta_1 for light that travels in medium 1. Amplitudes are
pairs of a real and an imaginary part, for waves exp(i(kx - wt)), in which an index that absorbs is eta + i kappa. The
field of s is along the normal of the plane of incidence, that of p along the direction of travel times this normal,
before and after: at normal incidence r_p = -r_s (Born and Wolf 1999, section 1.5.2).
"""

from __future__ import annotations

from velatura import ops
from velatura.ops import Value

Complex = tuple[Value, Value]

EDGE = 1 / 7  # cosine at which metals have a second colour, about 82 degrees (Kutz et al. 2021)
GREATEST = 1e6  # relative index, whose sixth power single precision holds; a greater one reflects as much, but for 4e-6
SMALL = 1e-18  # fourth power of cosines at which all is reflected


def cos_transmitted(cos_theta: Value, eta: Value) -> Value:
    """Cosine of the refracted direction by Snell's law; 0 where light is totally reflected."""
    return ops.sqrt(1 - (1 - cos_theta * cos_theta) / (eta * eta))


def dielectric(cos_theta: Value, eta: Value) -> Value:
    """Reflectance of a dielectric of relative index eta > 0 at cos_theta in [0, 1]; 1 under total reflection."""
    eta = ops.minimum(eta, GREATEST)
    eta2, cos2 = eta * eta, cos_theta * cos_theta
    inside2 = ops.maximum(eta2 - 1 + cos2, 0.0)
    return _dielectric(cos2, inside2, cos_theta * ops.sqrt(inside2), eta2)


def dielectric_between(cos_theta: Value, cos_t: Value, eta: Value) -> Value:
    """Reflectance of a dielectric for given cosines on both sides, which Snell's law need not join.

    This lets all colour channels share one refracted direction; the reflectance is the same from either side.
    """
    eta = ops.minimum(eta, GREATEST)
    inside = eta * cos_t
    return _dielectric(cos_theta * cos_theta, inside * inside, cos_theta * inside, eta * eta)


def dielectric_together(cos2: Value, n12: Value, eta: Value) -> Value:
    """Reflectance, as of `dielectric_between`, by the square of the cosine and the index n12 that refracts all."""
    eta = ops.minimum(eta, GREATEST)
    ratio2 = (eta / n12) * (eta / n12)
    inside2 = ops.maximum(eta * eta - ratio2 + ratio2 * cos2, 0.0)
    return _dielectric(cos2, inside2, ops.sqrt(cos2 * inside2), eta * eta)


def _dielectric(cos2: Value, inside2: Value, both: Value, eta2: Value) -> Value:
    """Reflectance by the squares of c = cos_theta, of g = eta cos_t inside and of eta, and the product c g.

    The mean of the squares of r_s = (c - g) / (c + g) and r_p = (eta2 c - g) / (eta2 c + g) is
    ((eta2 c^2 - g^2)^2 + (eta2 - 1)^2 (c g)^2) / ((c + g) (eta2 c + g))^2.
    """
    s, grown = cos2 + inside2 + 2 * both, eta2 * cos2
    difference, step = grown - inside2, eta2 - 1
    # Under total reflection, this is the square of the difference to the last digit
    product = eta2 * s * (grown + 2 * both) + s * inside2
    some = ops.maximum(product, SMALL)
    ops.names(s=s, grown=grown, difference=difference, step=step, product=product, some=some)
    found = (difference * difference + step * step * (cos2 * inside2) + (some - product)) / some
    return ops.minimum(found, 1.0)


def conductor(cos_theta: Value, eta: Value, kappa: Value) -> Value:
    """Reflectance of a conductor of relative index eta + i kappa at cos_theta in [0, 1]; exact, kappa = 0 included."""
    cos2 = cos_theta * cos_theta
    sin2 = 1 - cos2
    t = eta * eta - kappa * kappa - sin2
    a2_plus_b2 = ops.sqrt(t * t + 4 * eta * eta * kappa * kappa)
    a = ops.sqrt(0.5 * (a2_plus_b2 + t))
    r_s = 1 - ops.divide(4 * a * cos_theta, a2_plus_b2 + cos2 + 2 * a * cos_theta)
    p = cos2 * a2_plus_b2 + sin2 * sin2
    q = 2 * a * cos_theta * sin2
    r_p_over_r_s = 1 - ops.divide(2 * q, p + q)
    ops.names(cos2=cos2, sin2=sin2, t=t, a2_plus_b2=a2_plus_b2, a=a, r_s=r_s, p=p, q=q, r_p_over_r_s=r_p_over_r_s)
    return 0.5 * r_s * (1 + r_p_over_r_s)


def schlick(cos_theta: Value, f0: Value) -> Value:
    """Schlick's approximation of the reflectance from its value f0 at normal incidence."""
    c = 1 - cos_theta
    c2 = c * c
    return f0 + (1 - f0) * c2 * c2 * c


def normal_incidence(eta: Value, kappa: Value = 0.0) -> Value:
    """Reflectance at normal incidence, ((eta-1)^2 + kappa^2) / ((eta+1)^2 + kappa^2) (Bati et al. 2021, Eq. 1)."""
    kappa2 = kappa * kappa
    return ((eta - 1) * (eta - 1) + kappa2) / ((eta + 1) * (eta + 1) + kappa2)


def dielectric_amplitudes(cos_theta: Value, cos_t: Value, eta: Value) -> tuple[Complex, Complex]:
    """Reflected amplitudes of s and p, of a dielectric for given cosines on both sides, as `dielectric_between`."""
    return _amplitude(cos_theta, (eta * cos_t, 0.0)), _amplitude(cos_theta, (ops.divide(cos_t, eta), 0.0))


def total_amplitudes(cos_theta: Value, eta: Value) -> tuple[Complex, Complex]:
    """Amplitudes of s and p under total reflection: of modulus 1, and of different phases.

    (Born and Wolf 1999, section 1.5.4)
    """
    decay = ops.sqrt(1 - cos_theta * cos_theta - eta * eta)
    return _amplitude(cos_theta, (0.0, decay)), _amplitude(cos_theta, (0.0, decay / (eta * eta)))


def conductor_amplitudes(cos_theta: Value, eta: Value, kappa: Value) -> tuple[Complex, Complex]:
    """Reflected amplitudes of s and p, of a conductor of relative index eta + i kappa at cos_theta in [0, 1]."""
    # The square of the index, and the root of it less sin2, which is n cos(theta_t)
    re, im = eta * eta - kappa * kappa, 2 * eta * kappa
    t = re - (1 - cos_theta * cos_theta)
    modulus = ops.sqrt(t * t + im * im)
    a, b = ops.sqrt(0.5 * (modulus + t)), ops.sqrt(0.5 * (modulus - t))
    square = re * re + im * im
    over_square = ops.divide(a * re + b * im, square), ops.divide(b * re - a * im, square)
    return _amplitude(cos_theta, (a, b)), _amplitude(cos_theta, over_square)


def _amplitude(cos_theta: Value, inside: Complex) -> Complex:
    """(cos_theta - z) / (cos_theta + z), where z is n cos(theta_t) for s, and that over the square of n for p."""
    re, im = inside
    square = (cos_theta + re) * (cos_theta + re) + im * im
    return (
        ops.divide(cos_theta * cos_theta - re * re - im * im, square),
        -ops.divide(2 * cos_theta * im, square),
    )
