"""Materials of other programs: their parameters, and their formulas in NumPy."""
