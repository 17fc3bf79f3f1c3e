"""Factors that make the symmetric form keep energy: f(wi, wo) becomes w(wi) f(wi, wo) w(wo), and stays reciprocal.

They are those for which all that leaves is the energy of all lobes, for light from any direction on either side. Such
factors exist for every symmetric kernel without negative values; Sinkhorn's iteration, half a step at a time, finds
them. The kernel is known by its samples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from velatura import ops
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.sampling import directional_grid, low_discrepancy

# For light from wi: a sampled direction and its weight (a colour), from three uniform numbers; the energy of all lobes
Sampled = Callable[[Direction, Value, Value, Value], tuple[Direction, Value]]
Energy = Callable[[Direction], Value]

LINE, PLANE = (64,), (24, 17)  # nodes over the cosine, or over the cosine and the azimuth
COS_MIN = 1e-3
SAMPLES, SAMPLES_NUMPY = 1024, 128  # at each node; NumPy would take seconds for as many in the plane
STEPS = {False: 8, True: 24}  # more where the stack transmits: what two sides exchange evens out slowly


@dataclass(frozen=True)
class Scaling:
    """The factor, of type `colour`, over direction: above, and below where the stack transmits."""

    sides: Sequence[directional_grid.Curves]
    colour: Callable[..., Value]

    def __call__(self, w: Direction) -> Value:
        """For a direction on either side."""
        up = w[0], w[1], ops.absolute(w[2])
        above, *below = (self.colour(*curves(up)) for curves in self.sides)
        return ops.select(w[2] < 0, below[0], above) if below else above


@dataclass(frozen=True)
class _Kernel:
    """Light from the nodes on one side: its energy, and the directions and weights of as many samples for each."""

    energy: Value
    wo: Direction
    weight: Value
    samples: int


def balanced(
    sampled: Sampled,
    energy: Energy,
    colour: Callable[..., Value],
    number: type | None,
    isotropic: bool,
    transmits: bool,
) -> Scaling:
    """The factors of a kernel, as constants; `number` as in `prepare`."""
    shape = LINE if isotropic else PLANE
    x, y, z = directional_grid.directions(shape, number)
    z = ops.maximum(z, COS_MIN)
    nodes = [(x, y, z), (x, y, -z)] if transmits else [(x, y, z)]
    samples = SAMPLES if number or isotropic else SAMPLES_NUMPY
    kernels = [_kernel(sampled, energy, w, number, samples) for w in nodes]
    factors = [0 * kernel.energy + 1 for kernel in kernels]
    for _ in range(STEPS[transmits]):
        scaling = Scaling([directional_grid.curves(list(factor), shape, number) for factor in factors], colour)
        factors = [_step(scaling, factor, kernel) for factor, kernel in zip(factors, kernels)]
    return Scaling([directional_grid.curves(list(factor), shape, number) for factor in factors], colour)


def _kernel(sampled: Sampled, energy: Energy, wi: Direction, number: type | None, samples: int) -> _Kernel:
    x, y, z = (low_discrepancy.repeated(w, samples) for w in wi)
    wo, weight = sampled((x, y, z), *low_discrepancy.at_nodes(len(wi[2]), samples, number))
    known, wo, weight = directional_grid.as_constants(energy(wi), wo, weight)
    return _Kernel(known, wo, weight, samples)


def _step(scaling: Scaling, factor: Value, kernel: _Kernel) -> Value:
    leaves = factor * low_discrepancy.averaged(kernel.weight * scaling(kernel.wo), kernel.samples)
    return factor * ops.sqrt(ops.divide(kernel.energy, leaves))
