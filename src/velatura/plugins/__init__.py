"""Mitsuba plugins, one a file; importing this package declares them all."""

from velatura.plugins import layered, openpbr, weidlich_wilkie

__all__ = ["layered", "openpbr", "weidlich_wilkie"]
