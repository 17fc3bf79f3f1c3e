"""The values of a material inside a Mitsuba plugin: constants, spectra, textures, and their names in `traverse`.

All layered plugins take the same properties: `material` (a file, the name of a preset, or JSON text), or flat names of
its values (`layer0_eta`, `layer0_alpha_u`, ...), each a number, a colour or spectrum, or a texture; flat names change a
material's own values.
"""

from velatura.binding.bsdf import Asked, PointBSDF, plugin_class
from velatura.binding.materials import STEERING_NM, Binding
from velatura.binding.textures import Image

__all__ = ["STEERING_NM", "Asked", "Binding", "Image", "PointBSDF", "plugin_class"]
