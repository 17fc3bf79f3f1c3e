"""Averages of Fresnel over GGX interfaces: integrated, compressed, stored, looked up."""

from velatura.tables.fetch import Row, conductor_row, dielectric_row, fgd, mirror_row, tir
from velatura.tables.store import FILE, Table, Tables, load, save

__all__ = [
    "FILE",
    "Row",
    "Table",
    "Tables",
    "conductor_row",
    "dielectric_row",
    "fgd",
    "load",
    "mirror_row",
    "save",
    "tir",
]
