"""A stack as a BSDF: lobes on both sides of it, seen from either side, in the forward and in the symmetric form.

Reflected lobes and a diffuse base are a mixture about the mirror direction of wi. The transmitted lobe is a mixture in
the medium beyond: the refracted direction, turned up, is reflected about a normal, and the outcome turned down (the
fake refraction of Belcour 2018, 4.2). The forward form takes all lobes from wi. The symmetric form samples those, and
takes the value from the lobes of a direction that only changes its sign when wi and wo are exchanged (6.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from velatura import ops
from velatura.model.base import ALL, Model, Query
from velatura.model.context import Context
from velatura.model.directions import refracted, select_direction, upright
from velatura.model.papers import mixture, precomputed_lobes
from velatura.model.papers.adding import Lobe, lobes
from velatura.model.papers.diffuse_base import Base, under, with_means
from velatura.model.papers.guards import COS_OF_HALF_VECTOR_MIN, REFLECTION_SHARE_MIN
from velatura.model.papers.lobe_merging import merged
from velatura.model.papers.prepare import Prepared, prepare
from velatura.model.variance import Variance, variance_kind
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.stack import Material

MIN_BRANCH_PROBABILITY = 0.1  # of reflection and of transmission, in the symmetric form
EVEN = 0.1  # share of samples that do not go by energy, in the symmetric form


@dataclass(frozen=True)
class Lobed:
    """A stack prepared from above and, where it transmits, from below (else None).

    `eta` is the index below over the index above, one for all colours; 1 where nothing is transmitted. `lobes_above`
    and `lobes_below` give the lobes on either side, for a direction turned up, and `base_above` the diffuse base; None
    where it is worked out from the layers. `even` is the share of samples that goes to all lobes alike, and to the
    cosine: the symmetric form has light where the lobes by which it is sampled have no energy, and samples would miss
    it. `balanced` is whether the symmetric form conserves energy.
    """

    balanced = False

    above: Prepared
    below: Prepared | None
    eta: Value
    lobes_above: precomputed_lobes.Lobes
    lobes_below: precomputed_lobes.Lobes
    base_above: Callable[[Direction], Base | None] | None = None
    even: float = 0.0

    def base(self, w: Direction) -> Base | None:
        """The diffuse base for a direction above; None without one."""
        return self.base_above(w) if self.base_above else under(self.above, w)

    @property
    def diffuse(self) -> bool:
        """Whether a diffuse base is the last reflected part."""
        return self.above.base is not None

    def at_direction(self, wi: Direction) -> Lobed:
        return self

    def albedo(self, wi: Direction, asked: Query = ALL) -> Value:
        """Energy of the queried parts, a colour."""
        return scattered(self, wi).only(asked).albedo

    def eval_pdf(self, wi: Direction, wo: Direction, asked: Query = ALL) -> tuple[Value, Value]:
        """f(wi, wo) |cos theta_o|, a colour, and the density of `sample`; 0 from below an opaque stack."""
        seen, i, o = scattered(self, wi).only(asked), upright(wi, wi), upright(wo, wi)
        symmetric = self.above.model.form == "symmetric"
        reflected, passed = exchangeable(self, wi, wo) if symmetric else (seen.reflected, seen.transmitted)
        if symmetric:
            reflected = asked.lobes(reflected)

        # Reflect
        value, density = mixture.eval_pdf(seen.reflected, seen.base, i, o, reflected, self.even)
        if self.below is None:
            lit = wi[2] > 0
            return ops.select(lit, value, 0.0), ops.select(lit, density, 0.0)
        if seen.transmitted is None or passed is None:
            return value, density

        # Transmit, as a reflection in the medium beyond; radiance is squeezed into the cone there
        i_beyond, o_beyond = _beyond(self, i, seen.eta), _down(o)
        through, density_through = mixture.eval_pdf([seen.transmitted], None, i_beyond, o_beyond, even=self.even)
        if symmetric:
            # In the medium below, for light in either direction
            i_below, o_below = _pair_below(self, wi, wo)
            through, _ = mixture.eval_pdf([passed], None, i_below, o_below)
            through = through * ops.divide(o_beyond[2], o_below[2])
            through = through * ops.select(wi[2] > 0, 1.0, seen.eta * seen.eta)
        if asked.radiance:
            through = through / (seen.eta * seen.eta)

        # Choose the side
        share, passes = seen.share(_least(self)), o[2] < 0
        value = ops.select(passes, through, value)
        return value, ops.select(passes, share * density_through, (1 - share) * density)

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value, asked: Query = ALL) -> tuple[Direction, Value]:
        """A direction wo from uniform numbers, and the index on its side over that on the side of wi.

        Where light cannot go the way that is drawn, `eval_pdf` is 0.
        """
        seen, i = scattered(self, wi).only(asked), upright(wi, wi)
        if self.below is None:
            return mixture.sample(seen.reflected, seen.base, i, u, u1, u2, self.even), 1.0
        passes, u = _way(seen, u, _least(self))
        o = mixture.sample(seen.reflected, seen.base, i, u, u1, u2, self.even)
        if seen.transmitted is None:
            return upright(o, wi), 1.0
        beyond = _down(mixture.sample([seen.transmitted], None, _beyond(self, i, seen.eta), u, u1, u2, self.even))
        x, y, z = select_direction(passes, beyond, o)
        # Clamp samples that end up in the wrong hemisphere
        z = ops.select(passes, ops.minimum(z, 0.0), ops.maximum(z, 0.0))
        return upright((x, y, z), wi), ops.select(passes, seen.eta, 1.0)

    def sample_smooth(self, wi: Direction, u: Value, asked: Query = ALL) -> tuple[Direction, Value, Value, Value]:
        """Like `sample`, for a smooth stack: a direction, its relative index, its probability, and its weight."""
        seen, i = scattered(self, wi).only(asked), upright(wi, wi)
        share = seen.share()
        reflected = sum(lobe.energy for lobe in seen.reflected)
        if seen.transmitted is None:
            lit = (wi[2] > 0) | (self.below is not None)
            return (-wi[0], -wi[1], wi[2]), 1.0, ops.select(lit, 1.0 if seen.reflected else 0.0, 0.0), reflected
        passes = u < share
        x, y, z = refracted(i, seen.eta)
        o = select_direction(passes, (-x, -y, -z), (-i[0], -i[1], i[2]))
        through = seen.transmitted.energy / (seen.eta * seen.eta) if asked.radiance else seen.transmitted.energy
        probability = ops.select(passes, share, 1 - share)
        weight = ops.divide(ops.select(passes, through, reflected), probability)
        return upright(o, wi), ops.select(passes, seen.eta, 1.0), probability, weight

    def component(self, wi: Direction, wo: Direction, u: Value, asked: Query = ALL, smooth: bool = False) -> Value:
        """Number of the part that `sample` draws from, or `sample_smooth`: of all reflected lobes, from the top, then
        of the diffuse base or the transmitted lobe."""
        every = scattered(self, wi)
        seen, count = every.only(asked), len(every.reflected)
        least, even = (0.0, 0.0) if smooth else (_least(self), self.even)
        passes, u = _way(seen, u, least)
        numbers = [float(k) for k in range(count + (every.base is not None)) if asked.reflects(k)]
        return ops.select(passes, float(count), mixture.picked(seen.reflected, seen.base, u, numbers, even))


@dataclass(frozen=True)
class Scattered:
    """The lobes of light from one direction; `eta` is the index of the medium beyond over that on its own side.

    Nothing is transmitted where Snell's law has no solution.
    """

    reflected: Sequence[Lobe]
    base: Base | None
    transmitted: Lobe | None
    eta: Value

    def only(self, asked: Query) -> Scattered:
        """The queried parts."""
        if asked.reflection is True and asked.transmission:
            return self
        base = self.base if self.base and asked.reflects(len(self.reflected)) else None
        transmitted = self.transmitted if asked.transmission else None
        return replace(self, reflected=asked.lobes(self.reflected), base=base, transmitted=transmitted)

    @property
    def albedo(self) -> Value:
        """Energy of all parts, a colour."""
        parts: list[Lobe | Base | None] = [*self.reflected, self.base, self.transmitted]
        return sum(part.energy for part in parts if part)

    def share(self, least: float = 0.0) -> Value:
        """Share of samples that are transmitted; if the stack reflects as well, each gets `least` at least."""
        if self.transmitted is None:
            return 0.0
        if not self.reflected:
            return 1.0
        through = ops.mean(self.transmitted.energy)
        share = ops.divide(through, through + sum(ops.mean(lobe.energy) for lobe in self.reflected))
        return ops.clip(share, least, 1 - max(least, REFLECTION_SHARE_MIN))


def body(
    material: Material, model: Model, variance: type[Variance] | None = None, context: Context | None = None
) -> Lobed:
    """Constants of a stack for both of its sides; arguments as `prepare`."""
    context = context or Context()
    material, variance = material.solid(), variance or variance_kind(material)

    def sampled(prepared: Prepared) -> precomputed_lobes.Lobes:
        added = partial(_lobes, prepared)
        if context.number is None or context.colour is None or not material.interfaces:
            return added
        return precomputed_lobes.sample(added, prepared, context.number, context.colour, material.transmits)

    even = EVEN if model.form == "symmetric" else 0.0
    above = with_means(prepare(material, model, variance, context), context.settle)
    if not material.transmits:
        from_above = sampled(above)
        return Lobed(above, None, 1.0, from_above, from_above, even=even)
    below = prepare(material.reversed(), model, variance, context)
    eta = ops.mean(material.below) / ops.mean(material.exterior)
    return Lobed(above, below, eta, sampled(above), sampled(below), even=even)


def scattered(stack: Lobed, wi: Direction) -> Scattered:
    """The lobes for light from wi, which may come from below only if the stack transmits."""
    turned = upright(wi, wi)
    reflected, passed = stack.lobes_above(turned)
    if stack.below is None:
        return Scattered(reflected, stack.base(turned), None, 1.0)
    from_above = wi[2] > 0
    reflected_below, passed_below = stack.lobes_below(turned)
    assert passed is not None and passed_below is not None
    eta = ops.select(from_above, stack.eta, 1 / stack.eta)
    through = ops.select_record(from_above, passed, passed_below)
    through = replace(through, energy=ops.select(refracted(turned, eta)[2] > 0, through.energy, 0.0))
    reflected = [ops.select_record(from_above, a, b) for a, b in zip(reflected, reflected_below)]
    return Scattered(reflected, None, through, eta)


def _way(seen: Scattered, u: Value, least: float) -> tuple[Value, Value]:
    """Whether a sample passes, and a uniform number for what follows."""
    share = seen.share(least)
    passes = u < share
    return passes, ops.divide(ops.select(passes, u, u - share), ops.select(passes, share, 1 - share))


# The symmetric form


def _least(stack: Lobed) -> float:
    """Share of samples that reflection and transmission get at least: the forward form, by whose lobes the symmetric
    one is sampled, may have no light where this one has some."""
    return MIN_BRANCH_PROBABILITY if stack.above.model.form == "symmetric" else 0.0


def _beyond(stack: Lobed, i: Direction, eta: Value) -> Direction:
    """The refracted direction about which light is sampled; the symmetric form passes light beyond the critical angle,
    too, where it is sampled at grazing."""
    x, y, z = refracted(i, eta)
    if stack.above.model.form == "forward":
        return x, y, z
    return ggx.normalize((x, y, ops.maximum(z, COS_OF_HALF_VECTOR_MIN)))


def exchangeable(stack: Lobed, wi: Direction, wo: Direction) -> tuple[Sequence[Lobe], Lobe | None]:
    """The lobes, reflected and transmitted, that the symmetric form takes its value from: of half the angle between wi
    and wo."""
    i, o = upright(wi, wi), upright(wo, wi)
    half = _difference(i, o)
    if stack.below is None:
        return stack.lobes_above(half)[0], None
    half_below = _difference(*_pair_below(stack, wi, wo))
    seen = select_direction(o[2] > 0, half, refracted(half_below, 1 / stack.eta))
    reflected, passed = stack.lobes_above(seen)
    reflected_below, _ = stack.lobes_below(half)
    assert passed is not None
    return [ops.select_record(wi[2] > 0, a, b) for a, b in zip(reflected, reflected_below)], passed


def _lobes(prepared: Prepared, w: Direction) -> tuple[list[Lobe], Lobe]:
    """The reflected lobes that the model evaluates, and the transmitted one."""
    reflected, passed = lobes(prepared, w)
    return merged(prepared, reflected), passed


def _difference(wi: Direction, wo: Direction) -> Direction:
    """A direction as far from the normal as wi and wo are from the one halfway, along their difference.

    It is wi where the normal is halfway.
    """
    x, y = wi[0] - wo[0], wi[1] - wo[1]
    cos_d = ops.sqrt(ops.clip(0.5 + 0.5 * ggx.dot(wi, wo), 0.0, 1.0))
    scale = ops.divide(ops.sqrt(1 - cos_d * cos_d), ops.sqrt(x * x + y * y))
    return scale * x, scale * y, cos_d


def _pair_below(stack: Lobed, wi: Direction, wo: Direction) -> tuple[Direction, Direction]:
    """Transmitted light in the medium below: wi and wo turned up, the one from above refracted."""
    i, o = upright(wi, wi), _down(upright(wo, wi))
    from_above = wi[2] > 0
    i_below = select_direction(from_above, refracted(i, stack.eta), i)
    return i_below, select_direction(from_above, o, refracted(o, stack.eta))


def _down(w: Direction) -> Direction:
    return w[0], w[1], -w[2]
