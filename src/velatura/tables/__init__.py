"""Averages of Fresnel over GGX interfaces: integrated, compressed, stored, looked up."""

from velatura.tables.fetch import (
    Row,
    conductor_row,
    dielectric_row,
    fgd,
    fgd_sheet,
    mirror_row,
    over_facets,
    tir,
    tir_sheet,
    with_films,
)
from velatura.tables.material_average import Average
from velatura.tables.split_sum import schlick_row
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
    "over_facets",
    "save",
    "schlick_row",
    "tir",
    "tir_sheet",
    "with_films",
]
