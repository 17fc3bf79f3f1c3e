"""A material for other programs: one file for each format, behind `velatura.export`."""

from velatura.exports.formats import FORMATS, Format, check_writable, export, taking
from velatura.exports.request import Export

__all__ = ["FORMATS", "Export", "Format", "check_writable", "export", "taking"]
