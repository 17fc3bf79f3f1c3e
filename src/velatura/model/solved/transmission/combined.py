"""All light that passes a stack: straight through, bounced inside, and scattered; each part with its own energy.

Once for a direction, `parts` has the energies over the integrals of the lobes, and the probabilities of sampling them.
Light that bounces is in a lobe as far as that is narrow. All else is scattered light, and so is the energy that a lobe
lacks if it would have to be drawn more than `MAX_GAIN` times as bright.

A sample of light that goes straight through is that of a rough dielectric: it may be reflected. So nothing else has to
be sampled of a single interface whose facets are met once; elsewhere reflected lobes are sampled by their energies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.directions import select_direction
from velatura.model.solved import sample_allocation
from velatura.model.solved.guards import BELOW_ONE
from velatura.model.solved.lobes import refracted_lobe, wide
from velatura.model.solved.lobes.remainder import EVEN
from velatura.model.solved.sample_allocation import Demand
from velatura.model.solved.transmission import direct, internal_reflections
from velatura.model.solved.transmission.direct import Transmission
from velatura.ops import Value
from velatura.optics.ggx import Direction

MAX_GAIN = 2.0  # energy over integral
LEAST = 0.05  # share of samples of what passes that are scattered, for what all others miss
UNLIKE = 1.5  # weight over its mean, of samples that go straight through, for which more are drawn
PASSES_MIN = 0.05  # share of facets that let light pass, where samples are shared
LITTLE = 3e-3  # energy that passes straight through, which hardly says how much brighter it is than its integral

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Parts(ops.NamedFields):
    """Light from one direction that passes: weights (colours) of what goes straight through, of what bounces, and of
    what is scattered, and the probabilities of sampling them; reflected lobes are sampled else. What is scattered has
    numbers of its own. Where light is wide, what is scattered is drawn `forward`, what goes straight through keeps the
    share `faceted`, and all else the share `narrow`."""

    COLOURS: ClassVar = ("straight", "bounced", "rest")
    CHANCES: ClassVar = ("of_straight", "of_bounced", "of_rest")
    OF_WIDE: ClassVar = ("forward", "narrow", "faceted")

    straight: Value
    bounced: Value
    rest: Value
    of_straight: Value
    of_bounced: Value
    of_rest: Value
    even: Value = EVEN[0]
    cosine: Value = EVEN[1]
    grazing: Value = EVEN[2]
    once: Value = EVEN[3]
    twice: Value = EVEN[4]
    forward: Value = 0.0
    narrow: Value = 1.0
    faceted: Value = 1.0

    @property
    def numbers(self) -> list[Value]:
        """Those of diffuse light."""
        return [self.even, self.cosine, self.grazing, self.once, self.twice]

    def narrowed(self) -> Parts:
        """The parts where what bounces and the rest have their share; of what goes straight, `bsdf` sees to it."""
        return replace(self, bounced=self.narrow * self.bounced, rest=self.narrow * self.rest)

    @property
    def share(self) -> Value:
        """Share of all samples."""
        return self.of_straight + self.of_bounced + self.of_rest


def parts(
    transmission: Transmission,
    wi: tuple[Array, Array, Array],
    straight: Array,
    bounces: Array,
    passed: Array,
    reflected: Demand,
    met: Sequence[int | None] = (),
    facets: Demand | None = None,
    numbers: Sequence[Array] = (),
    peak: Array | float = 1.0,
    whole: Array | None = None,
) -> tuple[Parts, Array]:
    """Parts in NumPy, for directions wi above, (N,) each, and energies (C, N): of light that passes directly, and
    after bounces, where it meets facets once and is not scattered; of all that passes.

    What is `reflected` has the other samples, in shares (K, N). Those that do not pass the facets of an interface are
    as those of its lobe: `met` numbers the interface of each part, None of those that are no lobe. The `facets` of a
    single interface have no others. Diffuse light has the `numbers` of `remainder.passing`, and samples of a weight up
    to `peak`. The integral of scattered light is `whole`, where it is known.
    """
    i, lobe, found = (
        internal_reflections.seen_below(transmission, wi),
        internal_reflections.bounced(transmission, wi),
        internal_reflections.rest(transmission, wi),
    )
    straight = np.clip(straight, 0, passed)  # waves over the azimuth may lie below 0
    bounces = np.clip(internal_reflections.share(lobe) * bounces, 0, passed - straight)
    # Divide energies by integrals, and hand over what they lack
    of_straight, squares, passes = direct.integrals(transmission, wi)
    of_bounced = refracted_lobe.integral(lobe, i) if lobe else np.zeros_like(of_straight)
    # Weights are interpolated: where next to nothing passes, as beyond a critical angle, that of the facets alone
    weight_straight = np.minimum((straight + LITTLE) / (of_straight + LITTLE), MAX_GAIN)
    bounces = np.maximum(bounces + straight - weight_straight * of_straight, 0)
    # A kind of stack may have a lobe that this one has not
    weight_bounced = np.minimum(ops.divide(bounces, of_bounced), MAX_GAIN) * bool(lobe)
    energies = weight_straight * of_straight, weight_bounced * of_bounced
    rest = np.maximum(passed - energies[0] - energies[1], 0)
    weight_rest = rest / (internal_reflections.integral_rest(found, i) if whole is None else whole)
    # Share samples; of the facets that are drawn, some reflect
    straightly, bouncing, scattered = energies[0], energies[1], rest
    if lobe:
        scattered = np.maximum(scattered, LEAST * (straightly + bouncing))
    mean = ops.divide(straightly, np.clip(passes, PASSES_MIN, 1.0))
    usual = np.minimum(weight_straight * ops.divide(squares, of_straight), UNLIKE * mean)
    drawn = Demand.of(mean, usual, usual)
    if facets is not None:
        # Only samples that do not pass the facets are reflected
        weights = (np.minimum(ops.divide(x, 1 - passes), UNLIKE) for x in facets[1:])
        most = (np.maximum(*each) for each in zip(drawn[1:], weights))
        drawn = Demand(ops.mean(straightly) + facets.energy, *most)
    heaviest = weight_rest * (1 + found.diffuse * (peak - 1))
    others = Demand.of(bouncing, bouncing, weight_bounced), Demand.of(scattered, rest, heaviest)
    # Samples that do not pass the facets of an interface are among those of its lobe
    total = sum(each.energy for each in (drawn, *others)) + reflected.energy.sum(axis=0)
    odds = direct.chances(transmission, wi)
    for k, j in enumerate(met):
        if j is not None:
            share = odds[j] * ops.divide(drawn.energy, total)
            reflected = reflected.spared(k, sample_allocation.TARGET_SAMPLE_WEIGHT * share)
    shares = sample_allocation.shared(Demand.together([drawn, *others, reflected]))
    return Parts(weight_straight, weight_bounced, weight_rest, *shares[:3], *numbers), shares[3:]


def energy(transmission: Transmission, wi: tuple[Array, Array, Array], straight: Array, bounces: Array) -> Array:
    """Energy of direct transmission and of internal reflections, with such weights (C, N)."""
    lobe, found = internal_reflections.bounced(transmission, wi), straight * direct.integrals(transmission, wi)[0]
    return (
        found + bounces * refracted_lobe.integral(lobe, internal_reflections.seen_below(transmission, wi))
        if lobe
        else found
    )


def rest(transmission: Transmission, wi: tuple[Array, Array, Array], light: Array) -> Array:
    """The weight of the rest that has an energy (C, N)."""
    whole = internal_reflections.integral_rest(
        internal_reflections.rest(transmission, wi), internal_reflections.seen_below(transmission, wi)
    )
    return np.asarray(np.maximum(light, 0) / whole)


def eval_pdf(transmission: Transmission, of: Parts, wi: Direction, wo: Direction) -> tuple[Value, Value]:
    """f(wi, wo) |cos theta_o|, a colour, of light that passes, and the density of `sample` times `Parts.share`, on both
    sides; wi lies above. Radiance is not scaled by the index."""
    i, o = internal_reflections.seen_below(transmission, wi), (wo[0], wo[1], -wo[2])
    value, density = direct.eval_pdf(transmission, wi, wo)
    value, density = of.straight * value, of.of_straight * density
    lobe = internal_reflections.bounced(transmission, wi)
    also = [
        (
            of.rest,
            of.of_rest,
            internal_reflections.eval_pdf_rest(
                internal_reflections.rest(transmission, wi, of.numbers, of.forward), i, o
            ),
        )
    ]
    if lobe:
        also.append((of.bounced, of.of_bounced, refracted_lobe.eval_pdf(lobe, i, o)))
    passes = (wi[2] > 0) & (wo[2] < 0)
    for weight, probability, (more, density_of_more) in also:
        value = value + ops.select(passes, weight * more, 0.0)
        density = density + ops.select(passes, probability * density_of_more, 0.0)
    return value, density


def wide_value(
    transmission: Transmission, energy: Value, numbers: Sequence[Value], wi: Direction, wo: Direction
) -> Value:
    """f(wi, wo) |cos theta_o|, a colour, of an energy that passes in the shape of the numbers of `wide`."""
    bound = internal_reflections.bound(transmission) / transmission.indices[-1]
    i = internal_reflections.seen_below(transmission, wi)
    within = internal_reflections.within((wo[0], wo[1], -wo[2]), bound)
    even = ops.select((wi[2] > 0) & (within[2] > 0), ops.maximum(-wo[2], 0.0), 0.0)
    return energy * (wide.density(numbers, i, within) * (even * (1 / pi)) / (bound * bound))


def sample(transmission: Transmission, of: Parts, wi: Direction, u: Value, u1: Value, u2: Value) -> Direction:
    """A direction wo on either side, from uniform numbers; where light is lost, `eval_pdf` is 0."""
    i = internal_reflections.seen_below(transmission, wi)
    share = ops.maximum(of.share, ops.TINY)
    probability = of.of_straight / share
    begin = probability + of.of_bounced / share
    wo = direct.sample(transmission, wi, ops.minimum(ops.divide(u, probability), BELOW_ONE), u1, u2)
    lobe = internal_reflections.bounced(transmission, wi)
    if lobe:
        wo = select_direction(u < probability, wo, _down(refracted_lobe.sample(lobe, i, u1, u2)))
    again = ops.clip(ops.divide(u - begin, 1 - begin), 0.0, BELOW_ONE)
    scattered = _down(
        internal_reflections.sample_rest(
            internal_reflections.rest(transmission, wi, of.numbers, of.forward), i, again, u1, u2
        )
    )
    return select_direction(u < begin, wo, scattered)


def _down(w: Direction) -> Direction:
    """A direction turned down; one that lies below the surface already is lost."""
    return w[0], w[1], -ops.maximum(w[2], 0.0)
