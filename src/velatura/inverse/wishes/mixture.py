"""A wish for the colour of a mixture, with the weights of its parts as the coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from velatura.inverse.wishes.wish import Lacking, Wish, colour, compared, reflected
from velatura.model import Model
from velatura.model.registry import lobes
from velatura.stack import Mix, Stack
from velatura.stack.mix import Described

FIRM, PULL = 100.0, 1e-3  # weights of a sum that is not 1, and of changes, beside 100 units of CIE 1976
ENOUGH = 1e-12
REFUSAL = "is to be chosen for all points alike; replace it by a number"


class MixtureColour(Wish):
    """The colour of all that a mixture reflects."""

    key: ClassVar[str] = "mixture"

    def lacking(self, stack: Stack) -> Lacking | None:
        return Lacking("mixture: chooses weights; write a start with mix")

    def of(self, material: Described, model: Model) -> NDArray[np.float64]:
        """The colour of a material (3,)."""
        return reflected(lobes(material, np.cos(np.radians(self.angle)), model=model))[:, 0]

    def had_by(self, material: Described, model: Model) -> MixtureColour:
        """This wish with the colour of a material."""
        return self.model_copy(update={"energy": colour(self.of(material, model))})


def weighed(mix: Mix, wishes: Sequence[MixtureColour], model: Model) -> tuple[Mix, float]:
    """The mixture with the weights that bring it nearest to wishes, and what is missed, as `Answer` has it.

    Weights of mixtures within it stay. Where several weights do equally well, those are taken that change least.

    Raises:
        InvalidInput: a weight is a texture.
    """
    from scipy import optimize  # slow to load

    mix.weighted(REFUSAL)
    given = [part.weight for part in mix.mix if isinstance(part.weight, float)]
    present = np.array([*given, 1 - sum(given)])
    parts = np.array([[wish.of(part.material, model) for part in mix.mix] for wish in wishes])
    goal = np.concatenate([wish.goal for wish in wishes])

    def missing(weights: NDArray[np.float64]) -> NDArray[np.float64]:
        mixed = weights / max(weights.sum(), ENOUGH) @ parts
        return np.concatenate([compared(energy, None) for energy in mixed]) - goal

    def residual(weights: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([missing(weights), [FIRM * (weights.sum() - 1)], PULL * (weights - present)])

    starts = np.clip([present, np.full(len(present), 1 / len(present))], 1e-3, 1 - 1e-3)
    ends = [optimize.least_squares(residual, start, bounds=(0, 1), xtol=ENOUGH, ftol=ENOUGH) for start in starts]
    weights = min(ends, key=lambda end: float(end.cost)).x
    weights = np.where(weights < 1e-9, 0.0, weights) / weights.sum()
    chosen = {f"part{n}_weight": float(min(weight, 1.0)) for n, weight in enumerate(weights[:-1])}
    return mix.replace(**chosen), float(np.linalg.norm(missing(weights)))
