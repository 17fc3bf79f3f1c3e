"""Materials of other programs: a folder for each, with parameters, formulas, reader and writer, and common parts."""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # without `typing`, since the package imports this
if TYPE_CHECKING:
    from typing import Any

    from velatura.programs.program import Program


class Baked:
    """A program that parameters are fitted for: the module with its `PROGRAM`, and endings of its files."""

    def __init__(self, module: str, endings: tuple[str, ...]) -> None:
        self.module, self.endings = module, endings

    def program(self) -> Program:
        """The program itself."""
        found: Program = import_module(self.module).PROGRAM
        return found


#: Programs that are written, by the name of the format.
BAKED = {
    "openpbr": Baked("velatura.programs.openpbr.write", (".mtlx",)),
    "gltf": Baked("velatura.programs.gltf.write", (".gltf", ".glb")),
    "gltf-coat": Baked("velatura.programs.gltf.coated", (".gltf", ".glb")),
    "usd": Baked("velatura.programs.usd.write", (".usda", ".usdz")),
    "blender-principled": Baked("velatura.programs.blender.write", (".py",)),
    "mitsuba-principled": Baked("velatura.programs.principled.write", (".xml",)),
}

#: Modules that read files, by their endings: `materials(path)` gives a file's materials by name, and the chosen name.
FORMATS = {
    ".mtlx": "velatura.programs.materialx.read",
    ".gltf": "velatura.programs.gltf.file",
    ".glb": "velatura.programs.gltf.file",
    ".xml": "velatura.programs.mitsuba_xml.read",
    **dict.fromkeys((".usda", ".usd", ".usdc"), "velatura.programs.usd.file"),
}


def reader(ending: str) -> Any:
    """The module that reads files of an ending."""
    return import_module(FORMATS[ending])
