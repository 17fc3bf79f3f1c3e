"""The lobes of a stack, by the recursion of its model."""

from __future__ import annotations

from velatura.model import adding, momentum
from velatura.model.adding import Lobe, State
from velatura.model.prepare import Prepared
from velatura.optics.ggx import Direction


def lobes(prepared: Prepared, wi: Direction) -> tuple[list[Lobe], Lobe]:
    """The reflected lobes, one per interface from the top, and the lobe transmitted below the last layer.

    `wi` points away from the surface. Where nothing passes, the transmitted lobe has energy 0.
    """
    return (momentum if prepared.model.calibrations else adding).lobes(prepared, wi)


def below(prepared: Prepared, wi: Direction) -> State | momentum.State:
    """The stack with all of its layers, for light from wi."""
    return (momentum if prepared.model.calibrations else adding).below(prepared, wi)
