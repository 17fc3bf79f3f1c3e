"""Thin films: what interfaces that carry them reflect and transmit, in tables or at the wavelengths of a ray."""
