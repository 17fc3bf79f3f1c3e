"""Numerical guards of the solved model: bounds beyond which values are evaluated as these."""

from math import sqrt

import numpy as np

# Cosines
COS_OF_DIRECTIONS_MIN = 1e-6  # and of sums of directions
COS_OUTSIDE_MIN = 1e-4
COS_ON_GRID_MIN = 1e-3
COS_INSIDE_MIN = 1e-3  # times the index inside; what refraction does not reach meets the interface at this one
COS_OF_WIDTHS_MIN = 0.01
COS_IN_MEDIA_MIN = 0.01  # of light between nodes, which attenuates at most as there
SIN_IN_MEDIA_MAX = sqrt(1 - COS_IN_MEDIA_MIN**2)
COS_IN_SLABS_MIN = 0.02  # of light that passes directly, and where it cannot enter

# Momenta, as lengths
MOMENTUM_MIN = 1e-150  # that has an azimuth
MOMENTUM_STEP_MIN = 3e-5  # at steep facets, whose cosines grow with its inverse
MOMENTUM_WIDTH_MIN = 1e-4  # that an interface gives to light which it turns by itself
MOMENTUM_WIDTH_ACROSS_MIN = 2e-5  # of it, across the brushing
WIDTH2_MIN = 1e-12  # that decides the shares where no interface has any

# Roughness
WIDTH_ALPHA_MAX = 1.0
INTERNAL_ALPHA_MAX = 1.5
SEARCHED_ALPHA = 1e-4, 1.0

# Media
G_MIN = 1e-6  # of light that a lobe holds
G_MAX = 0.999  # asymmetry of light that turns by less than nodes resolve
INDEX_MAX = 1e3

# Energies and shares
TINY = np.finfo(float).tiny
SAMPLED_ENERGY_MIN = 1e-30
ENERGY_EPS = 1e-9  # of a part that is drawn, and has a shape, even where it has none
TRACE = 1e-12  # of light, that leaves evenly where next to none does
TRAPPED = 1e-9  # share that is lost at each reflection between layers
ALBEDO_MIN = 1e-6  # of a remainder that is scaled to its energy
BELOW_ONE = 1 - 2**-24  # greatest number of single precision
