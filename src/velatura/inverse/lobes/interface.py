"""One interface below any stack: its index, roughness and the absorption above it, from its lobe.

Everything is at normal incidence. The only iteration is for an implicit average of a model: an index from its
directional albedo, and what total internal reflection does to the light from below.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from velatura import ops
from velatura.inverse.lobes import coatings
from velatura.inverse.lobes.partial_stack import Above, Array, Batch, Layers, Mask, take
from velatura.inverse.lobes.roots import false_position, first_crossing, nearest_to_zero
from velatura.inverse.lobes.target import BLUR
from velatura.model import Model, named
from velatura.model.variance import Isotropic, Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.stack.coatings import STEP_MIN
from velatura.stack.values import INDEX_HIGH, INDEX_LOW, Film

CLOSED_FORM = "bati2021"  # the model of the paper, by which interfaces follow from lobes one by one
DENSER, RARER = 1, -1
SLACK = 1e-9  # by which a constraint may be broken: rounding of solutions
NEGLIGIBLE = 1e-7  # the same for numerical solutions
ENERGY_MIN = 1e-9  # of a lobe in a channel; less is taken for nothing
FAINT = 1e-4  # energy of a lobe in a channel below which errors are seen against this
CONDUCTOR_MIN = 3 - 2 * np.sqrt(2)  # a conductor (k >= eta) reflects more
CONDUCTOR_MAX = 1 - 2.1e-3  # up to which indices of a metal lie within what a material may hold, with any tint
ROUNDS, ENOUGH = 40, 1e-7  # of corrections where a model's own reading differs from the closed form
MISSED = 1e-6  # what remains after them is no solution
NODES_COATED = 16  # indices below films between which solutions are looked for
TINTS = (0.0, -0.5, 0.5, -1.0, 1.0)  # of metals under films, as shares of the way to the least and the largest


@dataclass(frozen=True)
class Choice:
    """Choices about an interface: its kind, and its free parameters.

    side: of the two indices that reflect the same, the denser (1) or the rarer one (-1); (N,) or a number.
    eta, kappa, tau: given values, None where they are sought; absorption that is sought is as little as can be.
    tint: 0..1 between the bounds of a conductor's eta (Bati et al. 2021, Eqs. 9-10).
    absorbs: whether the medium above may absorb at all. eta_max: largest index of a dielectric. films: on the
    interface; of several indices that reflect the same with them, the nearest to that above, and of several metals the
    brightest.
    """

    kind: str = "dielectric"
    side: Value = DENSER
    eta: Value | None = None
    kappa: Value | None = None
    tau: Value | None = None
    tint: Value = 0.5
    absorbs: bool = True
    eta_max: float = 4.0
    films: tuple[Film, ...] = ()

    @property
    def slack(self) -> float:
        """Amount by which constraints may be broken: what films reflect is known roughly here."""
        return coatings.NEAR if self.films else NEGLIGIBLE


DIELECTRIC = Choice()


@dataclass(frozen=True)
class Found(Batch):
    """N interfaces, the stacks that they complete, and their lobes as read by these."""

    layers: Layers
    below: Above
    energy: Array
    variance: Variance


def invert_interface(
    energy: ArrayLike,
    variance: ArrayLike = 0.0,
    *,
    exterior: ArrayLike = 1.0,
    above: Above | None = None,
    choice: Choice = DIELECTRIC,
    model: str | Model = CLOSED_FORM,
    **switches: str,
) -> Layers:
    """The interfaces that give lobes of these energies and variances.

    Args:
        energy: colours (C, N), or (N,) or a number for one channel.
        variance: (N,) or a number, in the space of Belcour's roughness map.
        exterior: index of the medium above, where nothing else is there; (N,) or a number.
        above: the stacks above; None for the exterior medium alone.
        choice: the kind of interface, which of the two indices of a dielectric, and what is given of it.

    The answer holds for every target whether it is feasible, and by which margins.

    Raises:
        InvalidInput: an unknown model or switch.
    """
    e = np.atleast_2d(np.asarray(energy, float))
    if above is None:
        above = Above.nothing(named(model, **switches), as_index(exterior))
        choice = dataclasses.replace(choice, absorbs=choice.tau is not None)
    return solve(above, e, above.variance.uniform(np.asarray(own_variance(above, variance))), choice).layers


def own_variance(above: Above, variance: ArrayLike) -> Value:
    """A variance of Belcour's map, in the space of the model's map."""
    if above.f is BLUR:
        return np.asarray(variance, float)
    return above.f.variance(BLUR.roughness(np.asarray(variance, float)))


def solve(above: Above, energy: Array, variance: Variance, choice: Choice) -> Found:
    """The interfaces whose lobes, read by the model itself, have these energies (C, N) and variances (N,).

    The closed form is exact unless light is totally reflected from inside; then it is asked for what makes up for the
    difference, until nothing is missing.
    """
    energy = np.maximum(energy, ENERGY_MIN)
    bright = attenuated(above, energy)
    want_e, want_s = energy, variance
    before = None
    for _ in range(ROUNDS):
        layers, reflectance = _closed_form(above, want_e, want_s, bright, choice)
        below, lobe = above.below(layers, reflectance)
        read = at_brightest(above, lobe.variance, bright)
        missing, apart = energy / np.maximum(lobe.energy, ops.TINY), variance + read * -1.0
        apart_e = np.abs(energy - lobe.energy) / np.maximum(energy.max(axis=0) if choice.films else lobe.energy, FAINT)
        off = np.maximum(np.max(apart_e, axis=0), _size(apart))
        if not np.any(layers.feasible & (off > (coatings.NEAR if choice.films else ENOUGH))):
            break
        before, want_e, want_s = (
            (want_s, read),
            want_e * np.clip(missing, 0.5, 2.0),
            _secant(want_s, read, apart, before),
        )
    missed = 2 * coatings.NEAR if choice.films else MISSED
    layers = layers.with_margins(**{"unmet blur": np.where(layers.feasible & (off > missed), -off, 0.0)})
    return Found(layers, below, lobe.energy, read)


def with_index(
    above: Above,
    eta: Value,
    tau: Value,
    variance: Variance,
    paired: Array | None = None,
    coated: tuple[Film, ...] = (),
) -> Found:
    """The dielectrics of given index whose lobes have these variances, of any energy.

    The roughness depends on the light that bounces above, that on the reflectance, and that on the roughness.

    Args:
        paired: energy of the pair whose upper interface this is, for the roughness as printed in Bati et al. 2021,
            Algorithm 5: then the light that bounces above follows from the reflectance of the whole pair, and the
            variance is missed by a little.
        coated: films on them.
    """
    lit = above.through(tau)
    smooth = np.atleast_2d(fresnel.normal_incidence(eta / above.eta))
    if coated:
        smooth = lit.reflectance(Layers("dielectric", eta, None, Roughness(0.0, 0.0, 0.0), 0.0, films=coated))
    r = smooth if paired is None else attenuated(lit, paired)
    s_r = reflected(lit, variance, r, r)
    before = None
    for _ in range(ROUNDS):
        layers = Layers("dielectric", eta, None, floor(s_r).roughness(above.f), tau, films=coated)
        below, lobe = above.below(layers)
        bright = attenuated(above, lobe.energy)
        read = at_brightest(above, lobe.variance, bright)
        apart = variance + read * -1.0
        off = _size(apart)
        if paired is not None or not np.any((off > 0.1 * ENOUGH) & (least(s_r) >= 0)):
            break
        slope = at_brightest_value(above, lit.state.j_0i, bright)
        before, s_r = (s_r, read), _secant(s_r, read, apart, before, slope)
    blur = margin(least(s_r), ENOUGH)
    missed = np.where((off > MISSED) & (blur >= 0) & (paired is None), -off, 0.0)
    return Found(layers.with_margins(**{"blur": blur, "unmet blur": missed}), below, lobe.energy, read)


def _secant(
    x: Variance, read: Variance, apart: Variance, before: tuple[Variance, Variance] | None, slope: Value = 1.0
) -> Variance:
    """The next request after x, which gave the reading `read`, by the secant method; `before`: the previous such pair.

    `slope` is its first estimate.
    """
    entries = []
    for n, (now, y, miss) in enumerate(zip(*(vars(s).values() for s in (x, read, apart)))):
        own = slope
        if before is not None:
            x_0, y_0 = (list(vars(s).values())[n] for s in before)
            moved = np.abs(now - x_0) > ops.TINY
            own = np.where(moved, np.clip((y - y_0) / np.where(moved, now - x_0, 1.0), 0.2 * slope, 20 * slope), slope)
        entries.append(now + miss / own)
    return type(x)(*entries)


def _size(s: Variance) -> Array:
    return np.max([np.broadcast_to(np.abs(x), np.shape(s.matrix()[0])) for x in vars(s).values()], axis=0)


def _closed_form(
    above: Above, energy: Array, variance: Variance, bright: Array, choice: Choice
) -> tuple[Layers, Value]:
    """The one formula for an interface below any state: Bati et al. 2021, Algorithms 3 and 4.

    Returns the interfaces, and what they reflect.
    """
    # Request the energy of the lobe below the stack, pinned absorption included (Bati et al. 2021, Algorithm 3)
    if choice.tau is not None:
        above = above.through(choice.tau)
    r = attenuated(above, energy)
    s_r = reflected(above, variance, r, bright)
    roughness, blur = floor(s_r).roughness(above.f), margin(least(s_r))

    # Find its index, and what absorption must take away (Bati et al. 2021, Algorithm 4)
    if choice.kind == "mirror":
        layers = Layers("mirror", 1.0, None, roughness, 0.0)
    elif choice.kind == "conductor":
        layers = _conductor(above, r, roughness, choice)
    else:
        nothing = np.all(energy <= ENERGY_MIN, axis=0)
        # Where nothing may absorb, the index also shows whether the colour is in the way
        hopeless = (blur < 0) & bool(choice.absorbs and choice.tau is None)
        layers = dielectric(above, r, roughness, choice, nothing, hopeless)
    margins = {"blur": blur, **layers.margins}
    reflectance = above.reflectance(layers)
    tau: Value = optical_depth(reflectance, r)
    # With films dark channels are missed by shares of the bright ones
    more = _apart(reflectance, r) if choice.films else tau
    if choice.tau is not None or not choice.absorbs:
        off = margin(-np.max(np.abs(more), axis=0), choice.slack)
        # Where a fixed index alone is in the way, another one would do
        coloured = np.ptp(more, axis=0) > choice.slack
        coloured = (coloured & (choice.kind == "dielectric")) | (choice.eta is None)
        short = ~coloured & (np.min(more, axis=0) < 0)
        for name, where in (("colour", coloured), ("absorption", short), ("excess", ~coloured & ~short)):
            margins[name] = np.where(where, off, 0.0)
        tau = choice.tau if choice.tau is not None else 0.0
    else:
        margins["absorption"] = margin(np.min(more, axis=0), choice.slack)
        tau = np.where((tau < 0) & (more >= -choice.slack), 0.0, tau)
    return dataclasses.replace(layers, tau=tau, margins=margins), reflectance


def optical_depth(reflectance: Value, r: Array, least: float = ops.TINY) -> Array:
    """Optical depth above interfaces of a reflectance, `least` at least, that then reflect r.

    Negative where they reflect too little (Bati et al. 2021, Eq. 13).
    """
    return np.asarray(0.5 * np.log(np.maximum(reflectance, least) / r))


def attenuated(above: Above, energy: Array) -> Array:
    """Reflectance that an interface needs under the medium above it, for a lobe of that energy.

    Bati et al. 2021, Eqs. 11 and 18; the former below one interface.
    """
    state = above.state
    return 1 / (state.t_0i * state.t_i0 / np.maximum(energy, ENERGY_MIN) + state.r_i0)


def reflected(above: Above, variance: Variance, r: Array, bright: Array) -> Variance:
    """The variance of an interface's own reflection, for a lobe of that variance.

    Bati et al. 2021, Eqs. 15 and 19, the former below one interface; 1 - R_n0 R' is 1 / (1 + m) here.

    r: its reflectance (C, N). bright: the brightest channel of this is the one whose variance is asked for, where every
    channel has its own.
    """
    state = above.state
    bounces = state.r_i0 * r / np.maximum(1 - state.r_i0 * r, ops.TINY)
    m = np.mean(bounces, axis=0) if above.model.channels == "mean" else at_brightest_value(above, bounces, bright)
    up, down, inner = (at_brightest(above, s, bright) for s in (state.s_ti0, state.s_t0i, state.s_ri0))
    j = at_brightest_value(above, state.j_0i, bright)
    return ((variance + up * -1.0) * (1 / j) + down * -1.0 + inner * (-1.0 * m)) * (1 / (1 + m))


def dielectric(
    above: Above,
    r: Array,
    roughness: Roughness,
    choice: Choice,
    nothing: Mask | bool = False,
    hopeless: Mask | bool = False,
) -> Layers:
    """The dielectric that reflects r in the channel that needs most, and no less in the others.

    nothing: where none is to reflect; tables hold so little that no index is found by what they have. hopeless: where
    another constraint is broken anyway, so that any index will do that reflects enough.
    """
    if choice.eta is not None:
        layers = Layers("dielectric", as_index(choice.eta), None, roughness, 0.0, films=choice.films)
        return layers.with_margins(index=within(choice.eta, choice.eta_max))
    if choice.films:
        return _coated_dielectric(above, r, roughness, choice)

    denser = np.broadcast_to(np.asarray(choice.side) > 0, np.broadcast_shapes(np.shape(choice.side), r.shape[1:]))
    each = _Dielectrics(above, r, roughness, denser)
    ratio = np.mean(np.atleast_2d(np.where(denser, choice.eta_max, 1.0) / above.eta), axis=0)
    exists = np.where(denser, ratio >= 1, ratio <= 1)
    u_max = np.where(exists, ((ratio - 1) / (ratio + 1)) ** 2, 0.0)
    low, high = np.full_like(u_max, np.log(FAINT)), np.log(u_max + FAINT)
    most = np.where(u_max > 0, each.excess(high), -1.0)
    least = np.where(nothing, 0.0, np.min(np.log(FAINT / (r + FAINT)), axis=0)) + 0.0 * u_max
    u, some = u_max.copy(), np.flatnonzero((most >= 0) & ~np.broadcast_to(hopeless, most.shape))
    if len(some):
        part, *ends = take((each, low, high, least, most), some, len(u))
        u[some] = np.exp(false_position(part.excess, *ends)) - FAINT
    return each.layers(u).with_margins(energy=margin(np.where(exists, most, -1.0), NEGLIGIBLE))


@dataclass(frozen=True)
class _Dielectrics(Batch):
    """The dielectrics below N stacks on one side each, by their reflectance u (N,) when smooth; r: what is asked."""

    above: Above
    r: Array
    roughness: Roughness
    denser: Mask

    def layers(self, u: Array) -> Layers:
        """The dielectrics, at normal incidence of reflectance u when smooth (Bati et al. 2021, Eq. 7)."""
        root = np.sqrt(np.maximum(u, 0.0))  # of what rounding makes less than nothing
        ratio = (1 + root) / (1 - root)
        eta = self.above.eta * np.where(self.denser, ratio, 1 / ratio)[None]
        return Layers("dielectric", eta, None, self.roughness, 0.0)

    def excess(self, log_u: Array) -> Array:
        """The logarithm of what they reflect over r, in the channel that needs most, by that of u + FAINT."""
        # Both as logarithms, in which it is almost straight where next to nothing is reflected, too
        reflectance = self.above.reflectance(self.layers(np.exp(log_u) - FAINT))
        return np.asarray(np.min(np.log((reflectance + FAINT) / (self.r + FAINT)), axis=0))


def _coated_dielectric(above: Above, r: Array, roughness: Roughness, choice: Choice) -> Layers:
    """The dielectric that reflects enough with films: where nothing absorbs, what is nearest to r."""
    count = np.broadcast_shapes(np.shape(choice.side), r.shape[1:])[0]
    denser = np.broadcast_to(np.asarray(choice.side) > 0, count)
    eta_1 = np.broadcast_to(np.mean(np.atleast_2d(above.eta), axis=0), count)
    far = np.log(np.where(denser, choice.eta_max, 1.0) / eta_1)
    exists = np.where(denser, far > STEP_MIN, far < -STEP_MIN)
    first = np.where(exists, np.copysign(2 * STEP_MIN, far), 0.0)

    def excess(share: Array) -> Array:
        eta = (eta_1 * np.exp(first + share * (far - first)))[None]
        reflectance = above.reflectance(Layers("dielectric", eta, None, roughness, 0.0, films=choice.films))
        apart = _apart(reflectance, r)
        alone = choice.tau is not None or not choice.absorbs
        return np.asarray(-np.max(np.abs(apart), axis=0) if alone else np.min(apart, axis=0))

    nodes = np.linspace(0, 1, NODES_COATED)
    each = np.array([excess(np.full(count, x)) for x in nodes])
    share = np.where(
        (each.min(axis=0) < 0) & (each.max(axis=0) >= 0),
        first_crossing(excess, nodes, each),
        nearest_to_zero(excess, nodes, each),
    )
    enough = np.where(exists, margin(excess(share), choice.slack), -1.0)
    eta = (eta_1 * np.exp(first + share * (far - first)))[None]
    return Layers("dielectric", eta, None, roughness, 0.0, {"energy": enough}, films=choice.films)


def _apart(reflectance: Value, r: Array) -> Array:
    """Excess of reflectances (C, N) over others, as shares of the brightest channel of these."""
    return np.asarray((reflectance - r) / np.max(r, axis=0))


@dataclass(frozen=True)
class Metals:
    """The conductors of one choice below N stacks, by their reflectance u (C, N) when smooth.

    Bati et al. 2021, Eqs. 8-10; the reflectance of rough ones is numerical.
    """

    above: Above
    roughness: Roughness
    choice: Choice
    channels: int

    @property
    def given(self) -> tuple[Array | None, Array | None]:
        """Relative eta and kappa where they are given, (C, N) or (C, 1)."""
        eta, kappa = (None if x is None else _colour(x) / self.above.eta for x in (self.choice.eta, self.choice.kappa))
        return eta, kappa

    @property
    def ends(self) -> tuple[Array, Array]:
        """The least and the largest u, (C, N) or (C, 1)."""
        eta, kappa = self.given
        shape = (self.channels, 1)
        if kappa is not None:  # eta from kappa down to almost nothing
            k = np.broadcast_to(kappa, np.broadcast_shapes(kappa.shape, shape))
            least = fresnel.normal_incidence(k, k)
            # Where both are given there is one metal
            return (least, np.full(k.shape, 1 - 1e-9)) if eta is None else (fresnel.normal_incidence(eta, k),) * 2
        if eta is not None:  # kappa from eta upwards
            n = np.broadcast_to(eta, np.broadcast_shapes(eta.shape, shape))
            return fresnel.normal_incidence(n, n), np.full(n.shape, CONDUCTOR_MAX)
        return np.full(shape, CONDUCTOR_MIN + 1e-12), np.full(shape, CONDUCTOR_MAX)

    def layers(self, u: Array) -> Layers:
        """The metals."""
        eta, kappa = self.given
        if eta is not None and kappa is not None:
            n, k = np.broadcast_arrays(eta, kappa, u)[:2]
        elif kappa is not None:
            # eta below kappa, the lower root of Bati et al. 2021, Eq. 1
            b = (1 + u) / (1 - u)
            n, k = b - np.sqrt(np.maximum(b * b - 1 - kappa * kappa, 0)), np.broadcast_to(kappa, u.shape)
        else:
            n = conductor_index(u, self.choice.tint) if eta is None else np.broadcast_to(eta, u.shape)
            k = conductor_extinction(u, n)
        index = n * self.above.eta, k * self.above.eta
        return Layers("conductor", *index, self.roughness, 0.0, films=self.choice.films)

    def reflectance(self, u: Array) -> Array:
        """Reflectances of the metals below their stacks."""
        return np.asarray(self.above.reflectance(self.layers(u)))


def _conductor(above: Above, r: Array, roughness: Roughness, choice: Choice) -> Layers:
    """The conductor that reflects r in every channel."""
    metals = Metals(above, roughness, choice, len(r))
    shape = np.broadcast_shapes(r.shape, np.shape(choice.tint))
    low, high = (np.broadcast_to(end, shape) for end in metals.ends)
    eta, kappa = metals.given
    if eta is not None and kappa is not None:
        bound = margin(np.min(np.broadcast_to(kappa - eta, r.shape), axis=0))
        return metals.layers(low).with_margins(index=bound)

    def excess(u: Array) -> Array:
        return metals.reflectance(u) / r - 1

    if choice.films:
        metals, u, least, most = _coated_metals(metals, r, shape)
    else:
        least, most = excess(low), excess(high)
        u = false_position(excess, low, high, least, most)
    found = metals.layers(u)
    margins = {"bright": np.minimum(margin(np.min(most, axis=0), choice.slack), _writable(found.eta, found.kappa))}
    if not choice.absorbs or choice.tau is not None:
        margins["metal"] = margin(np.min(-least, axis=0), choice.slack)
    return found.with_margins(**margins)


def _coated_metals(metals: Metals, r: Array, shape: tuple[int, ...]) -> tuple[Metals, Array, Array, Array]:
    """Metals that reflect r with films, by u, and the least and the largest excess over r that there are.

    Films make the reflectance depend on the tint, too: in every channel it is the nearest to that of the choice that
    leaves room, or else that leaves any.
    """
    low, high = (np.broadcast_to(end, shape) for end in metals.ends)
    nodes = np.linspace(1, 0, NODES_COATED)
    wanted = np.broadcast_to(metals.choice.tint, shape)
    tint, best = wanted.copy(), np.full(shape, -np.inf)
    least, most = np.full(shape, np.inf), np.full(shape, -np.inf)
    tinted = all(given is None for given in metals.given)
    for way in TINTS if tinted else TINTS[:1]:
        tried = np.where(way > 0, wanted + way * (1 - wanted), wanted * (1 + way))
        there = dataclasses.replace(metals, choice=dataclasses.replace(metals.choice, tint=tried))
        each = np.array([there.reflectance(low + x * (high - low)) for x in nodes]) / r - 1
        # What is too bright may be absorbed
        dark = coatings.NEAR if metals.choice.absorbs and metals.choice.tau is None else -each.min(axis=0)
        room = np.minimum(np.minimum(dark, each.max(axis=0)), coatings.NEAR)
        better = room > best + 1e-6
        tint, best = np.where(better, tried, tint), np.where(better, room, best)
        least, most = (np.where(better, x, old) for x, old in ((each.min(axis=0), least), (each.max(axis=0), most)))
        if np.all(best >= coatings.NEAR):
            break
    metals = dataclasses.replace(metals, choice=dataclasses.replace(metals.choice, tint=tint))

    def excess(share: Array) -> Array:
        return metals.reflectance(low + share * (high - low)) / r - 1

    each = np.array([excess(np.full(shape, x)) for x in nodes])
    crosses = (least < 0) & (most >= 0)
    share = np.where(crosses, first_crossing(excess, nodes, each), nearest_to_zero(excess, nodes, each))
    return metals, low + share * (high - low), least, most


def _writable(eta: Array, kappa: Array) -> Array:
    """The margin, (N,), of a metal's indices within what a material may hold."""
    inside = (np.log(eta / INDEX_LOW), np.log(INDEX_HIGH / eta), np.log(INDEX_HIGH / np.maximum(kappa, INDEX_LOW)))
    return margin(np.min([np.min(np.atleast_2d(x), axis=0) for x in inside], axis=0))


def conductor_index(reflectance: Value, tint: Value) -> Value:
    """Relative eta of a conductor of that reflectance between its bounds (Bati et al. 2021, Eqs. 9-10)."""
    low = (1 - reflectance) / (1 + reflectance)
    root = ops.sqrt(6 * reflectance - 1 - reflectance * reflectance)
    high = (1 + reflectance + root) / (2 * (1 - reflectance))
    return low + tint * (high - low)


def conductor_extinction(reflectance: Value, eta: Value) -> Value:
    """Relative kappa of a conductor of that reflectance and relative eta (Bati et al. 2021, Eq. 8); 0 if none has."""
    return ops.sqrt((reflectance * (eta + 1) ** 2 - (eta - 1) ** 2) / (1 - reflectance))


def conductor_tint(eta: Array, kappa: Array) -> Array:
    """Position of relative eta between the bounds that its reflectance allows, 0..1, as in `conductor_index`."""
    reflectance = np.maximum(fresnel.normal_incidence(eta, kappa), CONDUCTOR_MIN)
    low, high = (conductor_index(reflectance, t) for t in (0.0, 1.0))
    return np.asarray(np.clip((eta - low) / np.maximum(high - low, 1e-12), 0, 1))


def at_brightest(above: Above, s: Variance, bright: Array) -> Variance:
    """The variance of the channel where `bright` is largest, if every channel has its own."""
    return type(s)(*(at_brightest_value(above, x, bright) for x in vars(s).values()))


def at_brightest_value(above: Above, x: Value, bright: Array) -> Value:
    """x, (C, N), at the channel where `bright` is largest, the first of equal ones."""
    if above.model.channels == "mean" or np.ndim(x) < 2:
        return x
    shape = np.broadcast_shapes(np.shape(x), np.shape(bright))
    brightest = np.argmax(np.round(np.broadcast_to(bright, shape), 9), axis=0)
    return np.take_along_axis(np.broadcast_to(x, shape), brightest[None], axis=0)[0]


def within(eta: Value, eta_max: float) -> Array:
    """The margin of an index, (1, N) or a number, within the bounds of a dielectric."""
    return margin(np.min(np.atleast_2d(np.minimum(eta - 1, eta_max - eta)), axis=0))


def as_index(eta: ArrayLike) -> Value:
    """An index as a colour (1, N), or a number."""
    eta = np.asarray(eta, float)
    return float(eta) if eta.ndim == 0 else np.atleast_2d(eta)


def _colour(value: Any) -> Value:
    """A number or colour that is the same for all N, or is a colour already."""
    value = np.asarray(value, float)
    return value[:, None] if value.ndim == 1 else value


def floor(s: Variance) -> Variance:
    """The variance, clamped to 0 from below."""
    return type(s)(*(np.maximum(x, 0.0) for x in vars(s).values())) if isinstance(s, Isotropic) else s


def least(s: Variance) -> Array:
    """The smallest variance along any axis."""
    xx, xy, yy = s.matrix()
    return np.atleast_1d((xx + yy) / 2 - np.hypot((xx - yy) / 2, xy))


def margin(x: ArrayLike, slack: float = SLACK) -> Array:
    """A margin that tolerates rounding."""
    x = np.atleast_1d(np.asarray(x, float))
    return np.where(x >= -slack, np.maximum(x, 0.0), np.where(x < 0, x, -np.inf))
