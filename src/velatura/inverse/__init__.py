"""Inverse design: stacks with given lobes at normal incidence.

After Bati et al. 2021, "An Inverse Method for the Exploration of Layered Material Appearance". Stacks are
read by the model's own recursion, so that what is found holds for the model that renders it.
"""

from velatura.inverse.answer import Answer, answer, answers
from velatura.inverse.coats import Coated, coat
from velatura.inverse.fitting.angles import Directions, ReflectanceTable, table_of
from velatura.inverse.fitting.descent import Estimate, Fit, Other, fit
from velatura.inverse.fitting.fit_set import fit_set
from velatura.inverse.fitting.model_error import ModelError, model_error
from velatura.inverse.fitting.simplify import MixtureFit, fit_target, simplify
from velatura.inverse.invert import alternatives, grazing, invert_stack, on_black
from velatura.inverse.lobes import smooth_pair
from velatura.inverse.lobes.equivalence import Coordinate, EquivalenceClass
from velatura.inverse.lobes.interface import Choice, invert_interface
from velatura.inverse.lobes.pair import Pair, invert_pair
from velatura.inverse.lobes.partial_stack import Above, Layers
from velatura.inverse.lobes.target import Fixed, Target, TargetLobe, load_target
from velatura.inverse.measured import load_table
from velatura.inverse.paints import Paint, PigmentFit, fit_pigment, load_reflectances, paint, paint_colour
from velatura.inverse.reasons import Direction, Infeasible
from velatura.inverse.solution import Solution
from velatura.inverse.wishes import Body, FilmColour, Grazing, MixtureColour, Passed

__all__ = [
    "Above",
    "Answer",
    "Body",
    "Choice",
    "Coated",
    "Coordinate",
    "Direction",
    "Directions",
    "EquivalenceClass",
    "Estimate",
    "FilmColour",
    "Fit",
    "Fixed",
    "Grazing",
    "Infeasible",
    "Layers",
    "MixtureColour",
    "MixtureFit",
    "ModelError",
    "Other",
    "Paint",
    "Pair",
    "Passed",
    "PigmentFit",
    "ReflectanceTable",
    "Solution",
    "Target",
    "TargetLobe",
    "alternatives",
    "answer",
    "answers",
    "coat",
    "fit",
    "fit_pigment",
    "fit_set",
    "fit_target",
    "grazing",
    "invert_interface",
    "invert_pair",
    "invert_stack",
    "load_reflectances",
    "load_table",
    "load_target",
    "model_error",
    "on_black",
    "paint",
    "paint_colour",
    "simplify",
    "smooth_pair",
    "table_of",
]
