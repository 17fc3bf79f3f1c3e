"""The model `velatura`: statistics of light in tangential momentum, one lobe per interface.

Light of direction w in a medium of index n has the tangential momentum n w_t, which Snell's law leaves alone. A facet
of slope m moves it by 2 n (w.h) m in a reflection, and by (n_2 cos theta_2 - n_1 cos theta_1) m in a refraction, to
first order. So the widths of all that light meets on its way down and up simply add; what is seen from above is the one
GGX reflection that would spread its momentum as much. Energies are added up from the top (Belcour 2018, section 5),
with the light that a rough layer throws beyond the critical angle, trapped, kept apart from that which returns by
Fresnel.

Tensors live in the frame of the plane of incidence (x in the plane, y across it), in the space of f(a) = a^1.5, where
widths add: between Cauchy (1) and Gauss (2), as the long tails of GGX ask for. What first order leaves open is in
`Calibration`. Indices are relative to that outside. A subscript 0i is for light that enters at the top and goes down to
layer i, i0 for light that comes up to the top, 12 and 21 for the layer being added.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from velatura import ops, tables
from velatura.model.adding import Lobe
from velatura.model.calibration import Calibration
from velatura.model.operators import G_MIN
from velatura.model.prepare import COS_MIN, Prepared, PreparedInterface, PreparedMedium
from velatura.model.variance import Covariance, Isotropic, PerAxis, Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel, phase
from velatura.optics.ggx import Direction
from velatura.tables import Average, Tables

FAINT = 1e-4  # albedo that the tables' errors come close to
DIM = 3e-4  # albedo below which the tables are not precise
LOSS_MIN = 1e-6  # of one bounce between the stack and a layer
CONTRAST_MIN = 0.02  # of two indices, below which an interface is hardly there


@dataclass(frozen=True)
class State(ops.Named):
    """The stack so far: energies (colours), tensors of momentum, and the medium below it.

    `cos_theta` is the cosine of the mean direction there, `n` its index and `n_exit` the lowest index above, which
    decides what leaves; `depth` the optical depth (a colour) of all media above. `s_exit` is the tensor of a reflection
    by the interface at that lowest index, `shadow` what the interfaces above leave of a lobe's width, squared.
    """

    cos_theta: Value
    n: Value
    n_exit: Value
    depth: Value
    r_i0: Value
    t_0i: Value
    t_i0: Value
    s_t0i: Variance
    s_ti0: Variance
    s_ri0: Variance
    s_exit: Variance
    shadow: Value


def lobes(prepared: Prepared, k: Calibration, wi: Direction) -> tuple[list[Lobe], Lobe]:
    """The reflected lobes, one per interface from the top, and the lobe transmitted below the last layer."""
    plane = _Plane.of(wi)
    state, reflected = _down(prepared, k, wi, plane)
    passed = _roughness(k, state.s_t0i, state.n, state.cos_theta)
    return reflected, _lobe(prepared, plane, state.t_0i, passed, state.cos_theta)


def _down(prepared: Prepared, k: Calibration, wi: Direction, plane: _Plane) -> tuple[State, list[Lobe]]:
    none = (PerAxis if prepared.variance is Isotropic else Covariance).uniform(0.0)
    state = State(wi[2], 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, none, none, none, none, 1.0)
    reflected: list[Lobe] = []
    for layer in prepared.layers:
        if isinstance(layer, PreparedMedium):
            state = _through(state, layer)
        else:
            state, lobe = _at(prepared, k, state, layer, plane, wi[2])
            reflected.append(lobe)
    # What the first interface reflects is known exactly
    if prepared.once:
        reflected[0] = _exact(prepared, prepared.once, plane, reflected[0], wi[2])
    return state, reflected


def _at(
    prepared: Prepared, k: Calibration, above: State, layer: PreparedInterface, plane: _Plane, cos_top: Value
) -> tuple[State, Lobe]:
    """The state below one more interface, and the lobe that it reflects."""
    cosine, n = ops.maximum(above.cos_theta, COS_MIN), above.n
    facets = plane.seen(layer.s_r)
    alpha = ops.minimum(_size(facets), 1.0)

    with ops.block("Reflect"):
        steep = _steepness(k, facets, cosine)
        s_r = _stretched(facets, n * n * steep[0], n * n * steep[1])
        lit = _fetched(_roughness(k, above.s_t0i + s_r, n, cosine), cosine, layer.opaque)
        r = ops.clip(_reflectance(layer, cosine, lit), 0.0, 1.0)
        ops.names(cosine=cosine, alpha=alpha, steep=steep, lit=lit, r=r)

    with ops.block("See how much of it leaves, and how much is trapped: returns to leave another time"):
        leaves = _leaving(k, above, layer, s_r, cosine)
        rarer = 0.0 if layer.opaque else ops.maximum(n - n * layer.n12, 0.0) / ops.maximum(n - above.n_exit, 1e-6)
        r_again = r + (1 - r) * (k.rare * ops.minimum(rarer, 1.0))
        kept = ops.exp(-k.slant * above.depth)
        leaves_again = k.again * leaves
        trapped = (1 - leaves) * above.t_i0 * kept / ops.maximum(1 - r_again * kept * (1 - leaves_again), LOSS_MIN)
        ops.names(leaves=leaves, r_again=r_again, kept=kept, trapped=trapped)

    with ops.block("Sum the bounces between the stack and the interface (Belcour 2018, Eqs. 28-31)"):
        bounces = 1 / ops.maximum(1 - above.r_i0 * r, LOSS_MIN)
        out = above.t_i0 * leaves * ops.exp(-k.path * lit * above.depth) + trapped * r_again * leaves_again
        energy = above.t_0i * r * bounces * out
        m_rr = ops.mean(above.r_i0 * r * bounces)
        m_trapped = ops.mean(r * trapped)
        back_and_forth = (s_r + above.s_ri0) * (k.bounced * m_rr) + (s_r + above.s_exit) * (k.trapped * m_trapped)
        ops.names(bounces=bounces, out=out, energy=energy, m_rr=m_rr, m_trapped=m_trapped)

    with ops.block("Convert the summed width to a GGX lobe seen from outside"):
        width = above.s_ti0 + above.s_t0i + s_r + back_and_forth
        lobe = _lobe(prepared, plane, energy, _seen(k, above, layer, width, r, cosine, cos_top), cos_top)
    if layer.opaque:
        return replace(above, t_0i=0.0), lobe

    with ops.block("Refract"):
        n_below = n * layer.n12
        cos_t = ops.sqrt(1 - (1 - cosine * cosine) / (layer.n12 * layer.n12))
        steep_t = _steepness(k, facets, cos_t)
        moved = [0.5 * (n_below * ops.sqrt(t) - n * ops.sqrt(i)) for t, i in zip(steep_t, steep)]
        s_t = _stretched(facets, moved[0] * moved[0], moved[1] * moved[1])
        contrast = ops.absolute(n_below - n) / ops.maximum(n_below, n)
        entering = _kept(prepared.tables, cosine, alpha, contrast, k.lost_down)
        leaving = _kept(prepared.tables, cos_t, alpha, contrast, k.lost_up)
        t_12, t_21 = (1 - r) * entering, (1 - r) * leaving
        passed = (1 - r + r * trapped * (1 - r_again)) * entering
        ops.names(n_below=n_below, cos_t=cos_t, moved=moved, contrast=contrast, t_12=t_12, t_21=t_21, passed=passed)

    with ops.block("Add up"):
        m_ri0 = t_12 * above.r_i0 * t_21 * bounces
        share = 1 / ops.maximum(ops.mean(r + m_ri0), ops.TINY)
        from_above = s_t + s_t + above.s_ri0 + back_and_forth
        lowest = (n <= above.n_exit) & (n < n_below)
        shadow = 1 / (1 + k.shadowed * alpha * alpha * contrast)
        ops.names(m_ri0=m_ri0, share=share, shadow=shadow)
        below = State(
            cos_theta=cos_t,
            n=n_below,
            n_exit=ops.minimum(above.n_exit, n),
            depth=above.depth,
            r_i0=r + m_ri0,
            t_0i=above.t_0i * bounces * passed,
            t_i0=t_21 * above.t_i0 * bounces,
            s_t0i=(_narrowed(k, above.s_t0i, n, n_below) + s_t + back_and_forth).bounded(),
            s_ti0=(above.s_ti0 + s_t + back_and_forth).bounded(),
            s_ri0=(s_r * (ops.mean(r) * share) + from_above * (ops.mean(m_ri0) * share)).bounded(),
            s_exit=_chosen(lowest, s_r, above.s_exit),
            shadow=above.shadow * shadow * shadow,
        )
    return below, lobe


def _through(above: State, medium: PreparedMedium) -> State:
    """The state below a medium, which absorbs, and blurs by what it scatters forwards.

    Light that it scatters backwards is lost.
    """
    with ops.block("Sort out what goes on"):
        forwards = phase.forwards(medium.g)
        depth = medium.tau - medium.tau_s * forwards
        path = medium.along(1, above.cos_theta)
        t = ops.exp(-depth * path)
        ops.names(forwards=forwards, depth=depth, path=path, t=t)

    with ops.block("Add a width for each time that it is scattered (Belcour 2018, Eq. 21, as a roughness)"):
        g = ops.clip(medium.g, G_MIN, 1.0)
        s_g = ops.power((1 - g) / g, 0.8) / (1 + g)
        alpha2 = ops.power(s_g / (1 + s_g), 2 / 1.1)
        ops.names(g=g, s_g=s_g, alpha2=alpha2)
        along = above.n * above.cos_theta
        often = ops.mean(medium.tau_s * forwards) * path
        s_t = _stretched(type(above.s_t0i).uniform(_f2(alpha2) * often), along * along, above.n * above.n)
    return replace(
        above,
        depth=above.depth + depth,
        r_i0=above.r_i0 * t * t,
        t_0i=above.t_0i * t,
        t_i0=above.t_i0 * t,
        s_t0i=(above.s_t0i + s_t).bounded(),
        s_ti0=(above.s_ti0 + s_t).bounded(),
        s_ri0=(above.s_ri0 + s_t + s_t).bounded(),
        s_exit=(above.s_exit + s_t + s_t).bounded(),
    )


# Parts of an interface


def _fetched(roughness: Variance, cos_theta: Value, opaque: bool) -> Value:
    """Isotropic roughness at which an average is looked up; that along the plane counts more where light passes."""
    x2, y2 = _width2(_along(roughness)), _width2(_across(roughness))
    cos2 = 1.0 if opaque else cos_theta * cos_theta
    return ops.minimum(ops.sqrt(0.5 * cos2 * (x2 + y2) + (1 - cos2) * x2), 1.0)


def _reflectance(layer: PreparedInterface, cos_theta: Value, alpha: Value) -> Value:
    return 1.0 if layer.reflectance is None else layer.reflectance(cos_theta, alpha)


def _leaving(k: Calibration, above: State, layer: PreparedInterface, s_r: Variance, cos_theta: Value) -> Value:
    """Share of the light going up from an interface that leaves, over that of its mean direction."""
    if layer.leaving is None:
        return 1.0
    blur = _roughness(k, above.s_t0i + s_r + above.s_ti0 * k.seen, above.n, cos_theta)
    ratio = ops.minimum(above.n_exit / above.n, 1.0)
    of_mean = 1 - fresnel.dielectric(cos_theta, ratio)
    share = ops.divide(layer.leaving(cos_theta, ops.minimum(_size(blur), 1.0)), of_mean)
    ops.names(ratio=ratio, of_mean=of_mean, share=share)
    return ops.select(ratio < 1, ops.clip(share, 0.0, 1.0), 1.0)


def _seen(
    k: Calibration, above: State, layer: PreparedInterface, width: Variance, r: Value, cos_theta: Value, cos_top: Value
) -> Variance:
    """Roughness of the lobe of an interface, for the sum of all widths."""
    roughness = _roughness(k, width, 1.0, cos_top)
    # Widen what total internal reflection picks out
    sin2, across = 1 - cos_top * cos_top, 1.0
    if not layer.opaque:
        assert layer.eta is not None
        picked = 1 - (fresnel.dielectric(cos_theta, layer.n12) + DIM) / (ops.mean(r) + DIM)
        across = 1 + k.selected * sin2 * ops.select(layer.n12 < 1, ops.clip(picked, 0.0, 1.0), 0.0)
        ops.names(picked=picked, across=across)
    with ops.block("Cut off what does not leave: steep angles, and all beyond the cone"):
        ratio = above.n_exit / above.n
        closed = ops.maximum(1 - ratio * ratio, 0.0)
        x, y = (k.cone * (1 + wider * sin2) for wider in (k.cone_in, k.cone_across))
        roughness = _stretched(roughness, above.shadow, above.shadow * across * across)
        x2, y2 = _width2(_along(roughness)), _width2(_across(roughness))
        ops.names(closed=closed, x2=x2, y2=y2)
        return _stretched(roughness, 1 / (1 + x2 * closed / (x * x)), 1 / (1 + y2 * closed / (y * y)))


def _kept(known: Tables, cos_theta: Value, alpha: Value, contrast: Value, exponent: float) -> Value:
    """Share of transmitted light that single scattering does not lose between the facets; all, without a contrast."""
    if exponent == 0:
        return 1.0
    once = tables.drawn_albedo(known, ops.maximum(cos_theta, COS_MIN), alpha, alpha)
    return ops.power(once, exponent * contrast / (contrast + CONTRAST_MIN))


def _narrowed(k: Calibration, s: Variance, n: Value, n_below: Value) -> Variance:
    """Width of the part of a beam that enters a medium of lower index."""
    closed = ops.maximum(1 / (n_below * n_below) - 1 / (n * n), 0.0) / (k.entering * k.entering)
    return s * (1 / _f2(1 + closed * _size(s) * _size(s)))


def _lobe(prepared: Prepared, plane: _Plane, energy: Value, roughness: Variance, cos_theta: Value) -> Lobe:
    """A lobe of an energy and a tensor of roughness, drawn so that it has that energy when it is evaluated."""
    alpha_u, alpha_v, rotation = roughness.roughness(prepared.f)
    drawn = Roughness(alpha_u, alpha_v, rotation + plane.azimuth)
    with ops.block("Look at its roughness along the plane and across it"):
        u2, v2 = drawn.alpha_u * drawn.alpha_u, drawn.alpha_v * drawn.alpha_v
        c, s = (1.0, 0.0) if isinstance(rotation, float) else (ops.cos(rotation), ops.sin(rotation))
        x, y = ops.sqrt(u2 * c * c + v2 * s * s), ops.sqrt(u2 * s * s + v2 * c * c)
    gain = 1 / tables.drawn_albedo(prepared.tables, ops.maximum(cos_theta, COS_MIN), x, y)
    return Lobe(energy, plane.unseen(roughness), drawn, gain)


def _exact(prepared: Prepared, once: Average, plane: _Plane, lobe: Lobe, cos_theta: Value) -> Lobe:
    """The lobe of the first interface as the reflection by facets that it is."""
    layer = prepared.layers[0]
    assert isinstance(layer, PreparedInterface)
    cosine = ops.maximum(cos_theta, COS_MIN)
    albedo = once(cosine, _fetched(plane.seen(layer.s_r), cosine, layer.opaque))
    gain = ops.select(albedo > FAINT, ops.divide(lobe.energy, albedo), 1.0)
    return replace(lobe, variance=layer.s_r, roughness=layer.roughness, gain=gain, facets=layer)


# Tensors in the frame of the plane of incidence


@dataclass(frozen=True)
class _Plane(ops.Named):
    """The plane of incidence: cosine and sine of its azimuth, and the azimuth (radians)."""

    cosine: Value
    sine: Value
    azimuth: Value

    @classmethod
    def of(cls, wi: Direction) -> _Plane:
        radius = ops.sqrt(wi[0] * wi[0] + wi[1] * wi[1])
        ops.names(radius=radius)
        x = ops.select(radius > ops.TINY, ops.divide(wi[0], radius), 1.0)
        y = ops.select(radius > ops.TINY, ops.divide(wi[1], radius), 0.0)
        return cls(x, y, ops.arctan2(y, x))

    def seen(self, s: Variance) -> Variance:
        """A tensor of the shading frame in the frame of the plane."""
        return PerAxis(s.s, s.s) if isinstance(s, Isotropic) else _turned(s, self.cosine, self.sine)

    def unseen(self, s: Variance) -> Variance:
        """A tensor in the frame of the plane, in the shading frame."""
        return _turned(s, self.cosine, -1 * self.sine)


def _turned(s: Variance, cosine: Value, sine: Value) -> Covariance:
    """Entries of a tensor in a frame turned by an angle."""
    xx, xy, yy = s.matrix()
    c2, s2, cs = cosine * cosine, sine * sine, cosine * sine
    mixed = 2 * xy * cs
    ops.names(c2=c2, s2=s2, cs=cs, mixed=mixed)
    return Covariance(xx * c2 + mixed + yy * s2, (yy - xx) * cs + xy * (c2 - s2), xx * s2 - mixed + yy * c2)


def _along(s: Variance) -> Value:
    return s.matrix()[0]


def _across(s: Variance) -> Value:
    return s.matrix()[2]


def _chosen(condition: Value, a: Variance, b: Variance) -> Variance:
    return type(b)(*(ops.select(condition, x, y) for x, y in zip(vars(a).values(), vars(b).values())))


def _f2(width2: Value) -> Value:
    """f of the square root: width^1.5."""
    return ops.sqrt(width2 * ops.sqrt(width2))


def _width2(s: Value) -> Value:
    """Square of a width, from f of it."""
    width2 = ops.select(s > ops.TINY, ops.power(ops.maximum(s, ops.TINY), 4 / 3), 0.0)
    ops.names(width2=width2)
    return width2


def _size(s: Variance) -> Value:
    """Width that a tensor has on average over directions."""
    return ops.sqrt(_width2(0.5 * (_along(s) + _across(s))))


def _stretched(s: Variance, x2: Value, y2: Value) -> Variance:
    """A tensor of widths that are longer by sqrt(x2) in the plane, and by sqrt(y2) across it."""
    x, y = _f2(x2), _f2(y2)
    ops.names(stretch=[x, y])
    if isinstance(s, PerAxis):
        return PerAxis(s.uu * x, s.vv * y)
    xx, xy, yy = s.matrix()
    return Covariance(xx * x, xy * ops.sqrt(x * y), yy * y)


def _steepness(k: Calibration, facets: Variance, cos_theta: Value) -> tuple[Value, Value]:
    """Mean square of the cosine at which light meets facets, for its moves in the plane and across it."""
    return _steep(k, cos_theta, _width2(_along(facets)))


def _steep(k: Calibration, cos_theta: Value, along2: Value) -> tuple[Value, Value]:
    cos2 = cos_theta * cos_theta
    tilted = (1 - cos2) * along2
    ops.names(cos2=cos2, tilted=tilted)
    return cos2 + k.steepness_in * tilted, cos2 + k.steepness_across * tilted


def _roughness(k: Calibration, s: Variance, n: Value, cos_theta: Value) -> Variance:
    """Roughness of the interface that would spread the momentum by s, in a medium of index n."""
    with ops.block("In the plane, solve w^2 = n^2 a^2 (cos^2 + steepness sin^2 a^2)"):
        cos2, w2 = cos_theta * cos_theta, _width2(_along(s)) / (n * n)
        root = ops.sqrt(cos2 * cos2 + 4 * k.steepness_in * (1 - cos2) * w2)
        ops.names(cos2=cos2, root=root)
        x2, y2 = _steep(k, cos_theta, 2 * w2 / ops.maximum(cos2 + root, ops.TINY))
    return _stretched(s, 1 / ops.maximum(n * n * x2, ops.TINY), 1 / ops.maximum(n * n * y2, ops.TINY))
