"""Averages of Fresnel over GGX interfaces: integrated, compressed, stored, looked up."""

from velatura.tables.fetch import Row, conductor_row, dielectric_row, fgd, fgd_sheet, mirror_row, tir, tir_sheet
from velatura.tables.sheet import Average
from velatura.tables.store import FILE, Table, Tables, load, save

__all__ = [
    "FILE",
    "Average",
    "Row",
    "Table",
    "Tables",
    "conductor_row",
    "dielectric_row",
    "fgd",
    "fgd_sheet",
    "load",
    "mirror_row",
    "save",
    "tir",
    "tir_sheet",
]
