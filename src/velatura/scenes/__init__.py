"""The stage of pictures: objects, environments, a camera, and image files.

`render` makes a picture of a material. `scene_dict` gives the scene behind it to those who want another camera, or
several materials side by side: `mesh(mi, OBJECTS["ball"].surface().moved((2.4, 0, 0)), bsdf)` is one more ball in it.
"""

from velatura.scenes.environments import ENVIRONMENTS, PHOTOGRAPHS, emitter
from velatura.scenes.objects import OBJECTS
from velatura.scenes.picture import check_view, check_writable, render, tone_map, write_image
from velatura.scenes.stage import mesh, scene_dict

__all__ = [
    "ENVIRONMENTS",
    "OBJECTS",
    "PHOTOGRAPHS",
    "check_view",
    "check_writable",
    "emitter",
    "mesh",
    "render",
    "scene_dict",
    "tone_map",
    "write_image",
]
