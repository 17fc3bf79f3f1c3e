"""The tables as objects and as one file of the package."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cache
from importlib import resources
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from velatura.files import whole
from velatura.renderer.packets import Packets, SampledGrid

FILE = Path(__file__).with_name("tables.npz")


@dataclass(frozen=True, eq=False)
class Table(SampledGrid):
    """Single-precision values at the nodes i/(N-1) of a two- or three-dimensional grid, channels on the last axis.

    `nodes` are the angles at which Fresnel reflectance multiplies the channels of a low-rank table: cosines, or in
    three dimensions coordinates on the angular axis; `powers` to which it is raised there, 1 where there are none.
    """

    data: np.ndarray
    nodes: tuple[float, ...] = ()
    powers: tuple[int, ...] = ()
    _packets: dict[Any, Packets] = field(default_factory=dict, repr=False)


@dataclass(frozen=True, eq=False)
class Tables:
    """All tables; `build` describes each one."""

    dielectric: Table
    conductor: Table
    inside: Table
    absorbing_inside: Table
    dielectric_multi: Table
    conductor_multi: Table
    inside_multi: Table
    absorbing_inside_multi: Table
    tir_published: Table
    tir_published_outside: Table
    tir_clean: Table
    entering: Table
    returning: Table
    passing: Table
    staying: Table

    def upload(self, dialect: Any) -> None:
        """Hand all tables to a Dr.Jit module now."""
        for _, table in self.items():
            table.packets(dialect)

    def items(self) -> list[tuple[str, Table]]:
        return [(f.name, getattr(self, f.name)) for f in fields(self)]


def save(tables: Tables, path: Path = FILE) -> None:
    """Write the tables, whole or not at all, each byte of their numbers apart, which compresses a fifth better."""
    arrays: dict[str, Any] = {}
    for name, table in tables.items():
        arrays[name] = np.moveaxis(table.data[..., None].view(np.uint8), -1, 0)
        arrays[f"{name}.nodes"] = np.array(table.nodes)
        arrays[f"{name}.powers"] = np.array(table.powers, int)
    with whole(path) as unfinished, unfinished.open("wb") as file:
        np.savez_compressed(file, **arrays)


def load() -> Tables:
    """The tables shipped with the package: the same ones for all threads, since they are distinguished by identity."""
    with _loading:
        return _loaded()


_loading = Lock()


@cache
def _loaded() -> Tables:
    with resources.files("velatura.tables").joinpath(FILE.name).open("rb") as file, np.load(file) as arrays:
        return Tables(**{f.name: _read(arrays, f.name) for f in fields(Tables)})


def _read(arrays: Any, name: str) -> Table:
    nodes, powers = (tuple(arrays[f"{name}.{part}"].tolist()) for part in ("nodes", "powers"))
    data = np.ascontiguousarray(np.moveaxis(arrays[name], 0, -1)).view(np.float32)[..., 0]
    return Table(data, nodes, powers)
