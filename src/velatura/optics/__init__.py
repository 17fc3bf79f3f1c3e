"""One interface or one medium: Fresnel, GGX, phase functions.

Directions are triples of components (x, y, z) of any dialect, pointing away from the surface, z the normal.
"""
