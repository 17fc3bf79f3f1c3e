"""Errors of models against the truth: lobes, albedo, distribution and pictures, as numbers and as one figure."""

from velatura.comparison.figure import check_figure, save_figure
from velatura.comparison.result import Account, Comparison, Pictures
from velatura.comparison.side_by_side import COSINES, compare

__all__ = ["COSINES", "Account", "Comparison", "Pictures", "check_figure", "compare", "save_figure"]
