"""A mixture of GGX lobes, with or without a diffuse base, as a BSDF: value, density, sampling.

All reflected lobes share the mirror direction of wi; they differ in energy and roughness (Belcour 2018, Eqs. 39-40).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

from velatura import ops
from velatura.model.guards import ALPHA_MIN
from velatura.model.papers.adding import Lobe
from velatura.model.papers.diffuse_base import Base
from velatura.model.variance import Roughness
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction


def probabilities(lobes: Sequence[Lobe], base: Base | None, even: float = 0.0) -> list[Value]:
    """Probabilities of sampling each lobe, then the base by the cosine: their shares of the energy.

    A share `even` is divided equally among them regardless of energy, and the cosine takes part even without a base.
    """
    parts: list[Lobe | Base] = [*lobes, *([base] if base else [])]
    energies = [ops.mean(part.energy) for part in parts]
    if even and not base:
        energies.append(0.0)
    energies = [energy + 1e-9 for energy in energies]  # the offset decides where none has any
    total = sum(energies[1:], energies[0]) if energies else 0.0
    return [even / len(energies) + (1 - even) * (energy / total) for energy in energies]


def eval_pdf(
    lobes: Sequence[Lobe],
    base: Base | None,
    wi: Direction,
    wo: Direction,
    lit: Sequence[Lobe] | None = None,
    even: float = 0.0,
) -> tuple[Value, Value]:
    """f(wi, wo) |cos theta_o|, a colour, and the density of `sample`; both 0 unless wi and wo are above the surface.

    `lit` are the lobes that the value is taken from, where they are not those that are sampled.
    """
    above = (wi[2] > 0) & (wo[2] > 0)
    h = ggx.normalize((wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]))
    jacobian = 0.25 / ops.maximum(wi[2], ops.TINY)
    shares = probabilities(lobes, base, even)
    value: Value = 0.0
    density: Value = 0.0
    cos_o = ops.maximum(wo[2], 0.0)
    if base:
        value = base.value((wo[0], wo[1], cos_o)) * cos_o
    if base or even:
        density = shares[-1] * cos_o / pi
    for lobe, probability in zip(lobes, shares):
        visible, _ = _visible(lobe.roughness, wi, wo, h)
        density = density + probability * (visible * jacobian)
    for lobe in lobes if lit is None else lit:
        visible, masking = _visible(lobe.roughness, wi, wo, h)
        value = value + lobe.energy * (visible * jacobian * masking)
    return ops.select(above, value, 0.0), ops.select(above, density, 0.0)


def sample(
    lobes: Sequence[Lobe], base: Base | None, wi: Direction, u: Value, u1: Value, u2: Value, even: float = 0.0
) -> Direction:
    """A direction wo from uniform numbers: a lobe by its energy, then a visible normal of it, or the base's cosine.

    The direction may lie below the surface, where `eval_pdf` is 0.
    """
    # Scatter at the base
    radius, phi = ops.sqrt(u1), 2 * pi * u2
    scattered = radius * ops.cos(phi), radius * ops.sin(phi), ops.sqrt(1 - u1)
    if not lobes:
        return scattered
    # Or pick a lobe: of those that begin below u, the last
    shares = probabilities(lobes, base, even)
    chosen, begin = _bounded(lobes[0].roughness), 0.0
    for lobe, before in zip(lobes[1:], shares):
        begin = begin + before
        chosen = Roughness(*(ops.select(u > begin, a, b) for a, b in zip(_bounded(lobe.roughness), chosen)))
    # Reflect about a normal visible from wi
    frame_wi = ggx.rotate(wi, chosen.rotation)
    h = ggx.sample_visible(frame_wi, chosen.alpha_u, chosen.alpha_v, u1, u2)
    wo = ggx.rotate(ggx.reflect(frame_wi, h), -chosen.rotation)
    if not base and not even:
        return wo
    from_base = u > 1 - shares[-1]
    x, y, z = (ops.select(from_base, a, b) for a, b in zip(scattered, wo))
    return x, y, z


def picked(lobes: Sequence[Lobe], base: Base | None, u: Value, numbers: Sequence[float], even: float = 0.0) -> Value:
    """The number for the part that `sample` draws from, of one for each lobe and for the base; 0 without parts."""
    chosen: Value = numbers[0] if numbers else 0.0
    begin: Value = 0.0
    for number, before in zip(numbers[1:], probabilities(lobes, base, even)):
        begin = begin + before
        chosen = ops.select(u > begin, number, chosen)
    return chosen


def _bounded(roughness: Roughness) -> Roughness:
    u, v, rotation = roughness
    return Roughness(ops.maximum(u, ALPHA_MIN), ops.maximum(v, ALPHA_MIN), rotation)


def _visible(roughness: Roughness, wi: Direction, wo: Direction, h: Direction) -> tuple[Value, Value]:
    """D(h) G1(wi), and G1(wo)."""
    alpha_u, alpha_v, i, o, m = _in_frame(roughness, wi, wo, h)
    return ggx.ndf(m, alpha_u, alpha_v) * ggx.masking(i, alpha_u, alpha_v), ggx.masking(o, alpha_u, alpha_v)


def _in_frame(roughness: Roughness, *directions: Direction) -> tuple[Value, ...]:
    alpha_u, alpha_v, rotation = _bounded(roughness)
    unturned = isinstance(rotation, float) and rotation == 0.0
    return alpha_u, alpha_v, *(directions if unturned else (ggx.rotate(w, rotation) for w in directions))
