"""How far each model is from the truth: lobes, albedo, distribution and pictures, as numbers and as one figure."""

from velatura.comparison.compare import COSINES, compare
from velatura.comparison.figure import save_figure
from velatura.comparison.result import Account, Comparison, Pictures

__all__ = ["COSINES", "Account", "Comparison", "Pictures", "compare", "save_figure"]
