"""Bakes: parameters of other programs' materials, fitted to the light of a stack."""

from velatura.programs.fit import TARGETS, bake, distribution
from velatura.programs.program import Bake, Carried

__all__ = ["TARGETS", "Bake", "Carried", "bake", "distribution"]
