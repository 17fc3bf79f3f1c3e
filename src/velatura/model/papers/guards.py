"""Numerical guards of the papers' models: bounds beyond which values are evaluated as these."""

COS_MIN = 1e-4  # keeps ways through media, and Snell's factors, finite at grazing
COS_OF_HALF_VECTOR_MIN = 0.05  # in the symmetric form
G_MIN = 1e-3  # keeps the variance of a phase function finite where it scatters evenly
TRANSMITTANCE_MIN = 1e-3  # below which light of a node is taken to be totally reflected
REFLECTION_SHARE_MIN = 1e-6  # of samples: less than that single precision takes for none
