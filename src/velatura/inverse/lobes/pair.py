"""Two interfaces that together give one lobe (Bati et al. 2021, 5.2 and 6.2).

The upper index is free; the upper roughness makes the first forward lobe as blurred as is asked, and the second
interface gives the energy that is left, equally blurred.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from velatura.inverse.lobes import coatings, interface
from velatura.inverse.lobes.interface import CLOSED_FORM, DIELECTRIC, Choice, Found
from velatura.inverse.lobes.partial_stack import Above, Array, Layers, Mask
from velatura.model import Model, named
from velatura.model.variance import Variance
from velatura.ops import Value
from velatura.stack.values import Film


@dataclass(frozen=True)
class Pair:
    """N pairs of interfaces, the upper ones and the lower ones."""

    upper: Layers
    lower: Layers

    @property
    def feasible(self) -> Mask:
        """Whether all constraints hold, (N,) of bool."""
        return self.upper.feasible & self.lower.feasible


def invert_pair(
    energy: ArrayLike,
    variance: ArrayLike,
    eta_1: ArrayLike,
    *,
    eta_2: ArrayLike | None = None,
    exterior: ArrayLike = 1.0,
    above: Above | None = None,
    tau: Value = 0.0,
    choice: Choice = DIELECTRIC,
    printed: bool = False,
    model: str | Model = CLOSED_FORM,
    **switches: str,
) -> Pair:
    """The pairs of interfaces that give one lobe of these energies and variances: Bati et al. 2021, Algorithms 1
    and 5.

    Args:
        energy: of both interfaces together, colours (C, N), or (N,) or a number for one channel.
        variance: of both, (N,) or a number, in the space of Belcour's roughness map.
        eta_1: absolute index between the interfaces, (N,) or a number.
        eta_2: absolute index below them; None for the one that needs least absorption, on the side given by `choice`.
        exterior: index of the medium above, where nothing else is there; (N,) or a number.
        above: the stacks above; None for the exterior medium alone.
        tau: optical depths of the medium above the pair, (C, N) or a number.
        choice: the lower interface.
        printed: the upper variance as Algorithm 5 is printed, which misses it by up to 13 % below a stack.

    Raises:
        InvalidInput: an unknown model or switch.
    """
    e = np.atleast_2d(np.asarray(energy, float))
    above = above or Above.nothing(named(model, **switches), interface.as_index(exterior))
    s = above.variance.uniform(np.atleast_1d(interface.own_variance(above, variance)))
    if eta_2 is not None:
        choice = dataclasses.replace(choice, eta=interface.as_index(eta_2))
    upper, lower = solve(above, e, s, interface.as_index(eta_1), tau, choice, printed)
    return Pair(upper.layers, lower.layers)


def solve(
    above: Above,
    energy: Array,
    variance: Variance,
    eta_1: Value,
    tau: Value,
    choice: Choice,
    printed: bool = False,
    coated: tuple[Film, ...] = (),
) -> tuple[Found, Found]:
    """Both interfaces of pairs below any stacks, and their lobes as read by these: Bati et al. 2021, Algorithm 5.

    coated: films on the upper one; those on the lower one are in its choice.
    """
    upper = top(above, energy, variance, eta_1, tau, choice.eta_max, printed, coated)
    left = energy - upper.energy  # Bati et al. 2021, Eq. 20
    return upper, interface.solve(upper.below, left, variance, choice)


def top(
    above: Above,
    energy: Array,
    variance: Variance,
    eta_1: Value,
    tau: Value,
    eta_max: float,
    printed: bool = False,
    coated: tuple[Film, ...] = (),
) -> Found:
    """The upper interfaces of pairs, with films."""
    upper = interface.with_index(above, eta_1, tau, variance, energy if printed else None, coated)
    left = np.min(1 - upper.energy / np.maximum(energy, interface.ENERGY_MIN), axis=0)
    slack = coatings.NEAR if coated else interface.SLACK
    margins = {"upper": interface.margin(left, slack), "index": interface.within(eta_1, eta_max)}
    return dataclasses.replace(upper, layers=upper.layers.with_margins(**margins))
