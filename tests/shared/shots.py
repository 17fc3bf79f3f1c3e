"""Views of the editor's page, as its calls describe them."""

from __future__ import annotations

from typing import Any

from velatura.scenes import OBJECTS

VIEW = OBJECTS["sphere"].view

#: A sphere of a mirror in the studio.
MIRROR: dict[str, Any] = {
    "material": {"layers": [{"interface": {"conductor": "mirror"}}]},
    "object": "sphere",
    "environment": "studio",
    "camera": {"origin": list(VIEW.origin), "target": list(VIEW.target), "fov": VIEW.fov},
    "size": [24, 16],
}
