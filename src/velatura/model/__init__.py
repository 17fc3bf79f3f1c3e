"""The whole stack: statistics of light by adding, and the lobes that have them."""

from velatura.model.adding import Lobe
from velatura.model.models import DEFAULT, MODELS, SWITCHES, Model, named
from velatura.model.prepare import Prepared, prepare, variance_kind
from velatura.optics.ggx import Direction


def lobes(prepared: Prepared, wi: Direction) -> tuple[list[Lobe], Lobe]:
    """The reflected lobes of a stack, one per interface from the top, and the transmitted one, by its model."""
    return prepared.model.recursion.lobes(prepared, wi)


__all__ = ["DEFAULT", "MODELS", "SWITCHES", "Lobe", "Model", "Prepared", "lobes", "named", "prepare", "variance_kind"]
