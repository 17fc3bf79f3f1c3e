"""The reference: random walks through the layers, which share nothing with the statistical model."""

from velatura.reference import plugin  # noqa: F401  (declares it)
from velatura.reference.distribution import Distribution, distribution
from velatura.reference.polarised import Stokes, stokes
from velatura.reference.statistics import MixtureStatistics, Statistics, WalkedLobe, statistics

__all__ = [
    "Distribution",
    "MixtureStatistics",
    "Statistics",
    "Stokes",
    "WalkedLobe",
    "distribution",
    "statistics",
    "stokes",
]
