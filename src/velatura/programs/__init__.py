"""Materials of other programs: a folder for each, with parameters, formulas, reader and writer, and common parts."""

from __future__ import annotations

from typing import NamedTuple


class Baked(NamedTuple):
    """A program that parameters are fitted for: the module with its `PROGRAM`, and endings of its files."""

    module: str
    endings: tuple[str, ...]


#: Programs that are written, by the name of the format.
BAKED = {
    "openpbr": Baked("velatura.programs.openpbr.write", (".mtlx",)),
    "gltf": Baked("velatura.programs.gltf.write", (".gltf",)),
    "blender-principled": Baked("velatura.programs.blender.write", (".py",)),
    "mitsuba-principled": Baked("velatura.programs.principled.write", (".xml",)),
}
