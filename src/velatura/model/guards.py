"""Numerical guards that both engines share: bounds beyond which values are evaluated as these."""

from math import sqrt

ALPHA_MIN = 1e-3  # of roughness
MAPPED_ALPHA_MAX = 0.9999  # of roughness that becomes a variance
VARIANCE_MAX = 1e12  # keeps s/(1+s) from inf/inf
EXPONENT_MAX = 60.0  # whose exponential single precision holds
COS_AT_FACETS_MIN = 1e-4  # of light that meets a rough interface
SIN_AT_FACETS_MAX = sqrt(1 - COS_AT_FACETS_MIN**2)
