"""Energies of a stack by adding on nodes of tangential momentum, in NumPy, once for a material.

Light between two layers is a measure over p = n sin(theta), a vector that smooth interfaces leave alone, as
coefficients of a few functions of its length (`nodes`) times a few modes of its azimuth (`modes`). Interfaces
(`interfaces`) and media (`media`) are operators on such measures (`operators`); `adding` sums up stacks of them, and
`energies` sorts what leaves by lobe.
"""
