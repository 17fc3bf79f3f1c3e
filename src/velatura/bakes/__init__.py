"""Bakes: parameters of other programs' materials, fitted to the light of a stack."""

from velatura.bakes.fit import Bake, bake, distribution
from velatura.bakes.targets import TARGETS
from velatura.bakes.textured import Carried

__all__ = ["TARGETS", "Bake", "Carried", "bake", "distribution"]
