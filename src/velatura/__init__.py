"""Layered materials: rendered by statistics of light, compared with a reference, and designed by inversion.

Importing this package imports no renderer and sets no variant; other modules are imported at first use.
"""

from __future__ import annotations

from importlib import import_module

from velatura.programs import FORMATS
from velatura.readers import READERS
from velatura.version import __version__ as __version__

TYPE_CHECKING = False  # in place of that of `typing`, which takes half of the time of this import
if TYPE_CHECKING:
    from typing import Any

    from velatura import bakes as bakes
    from velatura import benchmark as benchmark
    from velatura import checks as checks
    from velatura import comparison as comparison
    from velatura import exports as exports
    from velatura import imports as imports
    from velatura import inverse as inverse
    from velatura import kernel as kernel
    from velatura import model as model
    from velatura import reference as reference
    from velatura import scenes as scenes
    from velatura import shader as shader
    from velatura import stack as stack
    from velatura import tables as tables
    from velatura.api import bsdf, check, lobes, register, render
    from velatura.comparison import compare
    from velatura.editor.widget import Editor as Editor
    from velatura.errors import InvalidInput, LawBroken, MissingTool, NoSolution, VelaturaError, VelaturaWarning
    from velatura.exports import export
    from velatura.imports import from_gltf, from_openpbr, from_principled, from_standard_surface
    from velatura.model import MODELS, Model
    from velatura.overview import show
    from velatura.stack import (
        Diffuse,
        Film,
        Interface,
        Medium,
        Mix,
        Pigment,
        Spectrum,
        Stack,
        Substance,
        Texture,
        load,
        preset,
        presets,
        save,
    )
    from velatura.sweeps import Axis, Space, sweep

_HOMES = {
    "velatura.api": ("bsdf", "check", "lobes", "register", "render"),
    "velatura.comparison": ("compare",),
    "velatura.editor.widget": ("Editor",),
    "velatura.errors": ("InvalidInput", "LawBroken", "MissingTool", "NoSolution", "VelaturaError", "VelaturaWarning"),
    "velatura.exports": ("export",),
    "velatura.imports": ("from_gltf", "from_openpbr", "from_principled", "from_standard_surface"),
    "velatura.model": ("MODELS", "Model"),
    "velatura.overview": ("show",),
    "velatura.stack": (
        "Diffuse",
        "Film",
        "Interface",
        "Medium",
        "Mix",
        "Pigment",
        "Spectrum",
        "Stack",
        "Substance",
        "Texture",
        "load",
        "preset",
        "presets",
        "save",
    ),
    "velatura.sweeps": ("Axis", "Space", "sweep"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

# Without `Editor`, so that `import *` works where the extra `notebook` is missing
__all__ = [
    "MODELS",
    "Axis",
    "Diffuse",
    "Film",
    "Interface",
    "InvalidInput",
    "LawBroken",
    "Medium",
    "MissingTool",
    "Mix",
    "Model",
    "NoSolution",
    "Pigment",
    "Space",
    "Spectrum",
    "Stack",
    "Substance",
    "Texture",
    "VelaturaError",
    "VelaturaWarning",
    "bsdf",
    "check",
    "compare",
    "export",
    "from_gltf",
    "from_openpbr",
    "from_principled",
    "from_standard_surface",
    "load",
    "lobes",
    "preset",
    "presets",
    "register",
    "render",
    "save",
    "show",
    "sweep",
]


_PARTS = (
    "bakes",
    "benchmark",
    "checks",
    "comparison",
    "exports",
    "imports",
    "inverse",
    "kernel",
    "model",
    "reference",
    "scenes",
    "shader",
    "stack",
    "tables",
)


def _imported(path: str) -> Any:
    from velatura.imports import load

    return load(path)


READERS.update(dict.fromkeys(FORMATS, _imported))


def __getattr__(name: str) -> Any:
    if name in _HOME_OF:
        return getattr(import_module(_HOME_OF[name]), name)
    if name in _PARTS:
        return import_module(f"velatura.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(_HOME_OF)
