"""Mitsuba plugins, one a file; importing this package declares them all."""

from velatura.plugins import layered

__all__ = ["layered"]
