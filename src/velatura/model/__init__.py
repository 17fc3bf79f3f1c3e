"""The whole stack: statistics of light by adding, and the lobes that have them."""

from velatura.model.base import SWITCHES, Model
from velatura.model.registry import DEFAULT, MODELS, named
from velatura.model.variance import variance_kind

__all__ = ["DEFAULT", "MODELS", "SWITCHES", "Model", "named", "variance_kind"]
