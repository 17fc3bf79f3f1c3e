"""The open benchmark of layered models: stacks, the light of random walks through them, and scores of models.

Its protocol is that of Bati et al. 2019, a simulated reference for both sides and comparisons by kind of material, on
random stacks.
"""

from velatura.benchmark.candidates import Candidate, Factory, Walk, from_values, values_of
from velatura.benchmark.entrants import ENTRANTS, entrant
from velatura.benchmark.figure import save_figure
from velatura.benchmark.scores import Record, Scores, kept_score, score
from velatura.benchmark.stacks import EDITIONS, Case, Edition, edition
from velatura.benchmark.task import write_task
from velatura.benchmark.walks import Light, truth, walk_all

__all__ = [
    "EDITIONS",
    "ENTRANTS",
    "Candidate",
    "Case",
    "Edition",
    "Factory",
    "Light",
    "Record",
    "Scores",
    "Walk",
    "edition",
    "entrant",
    "from_values",
    "kept_score",
    "save_figure",
    "score",
    "truth",
    "values_of",
    "walk_all",
    "write_task",
]
