"""The whole stack: statistics of light by adding, and the lobes that have them."""

from velatura.model.models import DEFAULT, MODELS, SWITCHES, Model, named
from velatura.model.papers.adding import Lobe, lobes
from velatura.model.papers.prepare import Prepared, prepare, variance_kind

__all__ = ["DEFAULT", "MODELS", "SWITCHES", "Lobe", "Model", "Prepared", "lobes", "named", "prepare", "variance_kind"]
