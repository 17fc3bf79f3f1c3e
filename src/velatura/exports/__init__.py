"""A material for other programs: one file for each format, behind `velatura.export`."""

from velatura.exports.formats import FORMATS, Export, Format, check_writable, export, taking

__all__ = ["FORMATS", "Export", "Format", "check_writable", "export", "taking"]
