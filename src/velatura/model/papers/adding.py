"""Adding: the statistics of light through a stack, from the top down, one lobe per interface.

The recursion is Belcour 2018, section 5, as its authors released it, written over any kind of variance (Weier &
Belcour 2020, Listing 3; Yamaguchi et al. 2019, Eqs. 1-2). A subscript 0i is for light that enters at the top and goes
down to layer i, i0 for light that comes up to the top, 12 and 21 for the layer being added.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from velatura import ops
from velatura.model.papers import operators
from velatura.model.papers.prepare import Prepared, PreparedMedium
from velatura.model.variance import Roughness, Variance
from velatura.ops import Value
from velatura.optics.ggx import Direction


@dataclass(frozen=True)
class Lobe(ops.NamedFields):
    """Energy (a colour), variance in the space of the roughness map, and the GGX lobe that has it."""

    energy: Value
    variance: Variance
    roughness: Roughness


@dataclass(frozen=True)
class State(ops.NamedFields):
    """The stack so far: energies (colours), variances, the cosine below it and the products of Snell's factors.

    Of the light that comes up to it, r_i0 returns, t_i0 leaves and a_i0 is absorbed. Each is kept apart, since 1 - r_i0
    would be lost to rounding where nearly all light returns.
    """

    cos_theta: Value
    r_i0: Value
    t_0i: Value
    t_i0: Value
    a_i0: Value
    s_t0i: Variance
    s_ti0: Variance
    s_ri0: Variance
    j_0i: Value
    j_i0: Value


def lobes(prepared: Prepared, wi: Direction) -> tuple[list[Lobe], Lobe]:
    """The reflected lobes, one per interface from the top, and the lobe transmitted below the last layer.

    `wi` points away from the surface. Where nothing passes, the transmitted lobe has energy 0.
    """
    state, reflected = _down(prepared, wi)
    return reflected, Lobe(state.t_0i, state.s_t0i, state.s_t0i.roughness(prepared.f))


def _down(prepared: Prepared, wi: Direction) -> tuple[State, list[Lobe]]:
    state, reflected = top(prepared, wi[2]), []
    for layer in prepared.layers:
        state, lobe = add(prepared, state, layer, wi)
        if lobe is not None:
            reflected.append(lobe)
    return state, reflected


def top(prepared: Prepared, cos_theta: Value) -> State:
    """Nothing above: all light passes, unblurred."""
    none = prepared.variance.uniform(0.0)
    return State(cos_theta, 0.0, 1.0, 1.0, 0.0, none, none, none, 1.0, 1.0)


def add(prepared: Prepared, above: State, layer: operators.PreparedLayer, wi: Direction) -> tuple[State, Lobe | None]:
    """The state below one more layer, and the lobe that this layer reflects (None for a medium)."""
    mean = ops.mean if prepared.model.channels == "mean" else _each
    if isinstance(layer, PreparedMedium):
        own = operators.transmission(prepared, layer, above.cos_theta)
    else:
        own = operators.interface(prepared, layer, above.cos_theta, above.s_t0i, wi)
        if own.leaving is not None:
            above = _totally_reflected(above, own.leaving)
    r_i0, t_0i, t_i0 = above.r_i0, above.t_0i, above.t_i0

    with ops.block("Sum the bounces between the stack and the layer (Belcour 2018, Eqs. 28-31)"):
        gone = above.a_i0 + r_i0 * own.a_12
        bounces = 1 / ops.maximum(gone + t_i0 + r_i0 * own.t_12, ops.TINY)  # 1 - r_i0 r_12
        m_r0i = t_0i * own.r_12 * t_i0 * bounces
        m_ri0 = own.t_21 * r_i0 * own.t_12 * bounces
        m_rr = mean(r_i0 * own.r_12 * bounces)
        e_ri0 = mean(own.r_21 + m_ri0)
        ops.names(gone=gone, bounces=bounces, m_r0i=m_r0i, m_ri0=m_ri0, m_rr=m_rr, e_ri0=e_ri0)

    with ops.block("Add up the variances of what they bounce between (Belcour 2018, Eqs. 38, 49-51)"):
        back_and_forth = (own.s_r + above.s_ri0) * m_rr
        lobe = None
        if not isinstance(layer, PreparedMedium):
            variance = (above.s_ti0 + (above.s_t0i + own.s_r + back_and_forth) * above.j_0i).bounded()
            lobe = Lobe(m_r0i, variance, variance.roughness(prepared.f))
        from_above = own.s_t12 + (own.s_t21 + above.s_ri0 + back_and_forth) * own.j_12
        share = 1 / ops.maximum(e_ri0, ops.TINY)
        below = State(
            cos_theta=own.cos_theta,
            r_i0=own.r_21 + m_ri0,
            t_0i=t_0i * own.t_12 * bounces,
            t_i0=own.t_21 * t_i0 * bounces,
            a_i0=own.a_21 + own.t_21 * gone * bounces,
            s_t0i=(above.s_t0i * own.j_12 + own.s_t12 + back_and_forth * own.j_12).bounded(),
            s_ti0=(own.s_t21 * above.j_i0 + above.s_ti0 + back_and_forth * above.j_i0).bounded(),
            s_ri0=(own.s_r * (mean(own.r_21) * share) + from_above * (mean(m_ri0) * share)).bounded(),
            j_0i=above.j_0i * own.j_12,
            j_i0=above.j_i0 * own.j_21,
        )
    return below, lobe


def _totally_reflected(above: State, leaving: Value) -> State:
    """Move what cannot leave upwards from the light that is transmitted to the light that is reflected (Belcour 2018,
    Eqs. 34-35)."""
    r_i0 = ops.clip(above.r_i0 + (1 - leaving) * above.t_i0, 0.0, 1.0)
    # However often it is reflected, in the end it leaves
    return replace(above, r_i0=r_i0, t_i0=ops.maximum(above.t_i0 * leaving, ops.TINY))


def _each(colour: Value) -> Value:
    return colour
