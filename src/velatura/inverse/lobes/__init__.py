"""Lobes to interfaces, from the top, by models in closed form (Bati et al. 2021)."""
