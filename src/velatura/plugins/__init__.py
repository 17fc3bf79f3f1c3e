"""Mitsuba plugins, one a file; importing this package declares them all."""

from velatura.plugins import layered, weidlich_wilkie

__all__ = ["layered", "weidlich_wilkie"]
