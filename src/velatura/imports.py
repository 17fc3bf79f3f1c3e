"""Materials of other programs as stacks: one module for each source, and for each kind of file."""

from velatura.programs.formats import (
    FORMATS,
    choice,
    from_gltf,
    from_openpbr,
    from_principled,
    from_standard_surface,
    load,
    read,
)
from velatura.programs.imported import Imported, Left

__all__ = [
    "FORMATS",
    "Imported",
    "Left",
    "choice",
    "from_gltf",
    "from_openpbr",
    "from_principled",
    "from_standard_surface",
    "load",
    "read",
]
