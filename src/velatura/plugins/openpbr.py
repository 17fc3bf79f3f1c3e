"""The plugin `openpbr`: a surface by the parameters of OpenPBR, as the stack that comes nearest to it."""

from __future__ import annotations

import warnings
from typing import Any

from velatura import kernel
from velatura.binding import properties as properties_of
from velatura.errors import Incomplete, InvalidInput, short
from velatura.model import SWITCHES
from velatura.plugins import layered
from velatura.programs.imported import Imported
from velatura.programs.openpbr import read as openpbr
from velatura.stack import dumps

OPTIONS = ("model", *SWITCHES)


@kernel.plugin("openpbr")
def make(mi: Any) -> type:
    """The class for the current variant."""

    class OpenPBR(layered.make(mi)):  # type: ignore[misc]
        """A surface of OpenPBR, by the plugin `layered` (https://academysoftwarefoundation.github.io/OpenPBR).

        Properties:
            base_color, base_metalness, specular_roughness, coat_weight, ... (number, colour): parameters of OpenPBR,
                by their names and with their defaults. No textures.
            geometry_thin_walled (boolean, default false): a pane, where light is transmitted.
            geometry_tangent, geometry_coat_tangent (number, default 0): degrees from dp/du, anticlockwise.
            model, reflectance, form, ... (strings): as in `layered`.

        What stacks cannot carry is listed by a warning. Shares between 0 and 1, of metal or a coat, make a mixture.
        Components are those of `layered`, and so are the names of parameters that can be changed: those of the stack,
        `layer0_eta`.
        """

        def __init__(self, properties: Any) -> None:
            found = _read(mi, properties)
            if found.left:
                warnings.warn(short(f"openpbr: {'; '.join(map(str, found.left))}"), Incomplete, stacklevel=2)
            described = mi.Properties("layered")
            described.set_id(properties.id())
            for name in OPTIONS:
                if name in properties:
                    described[name] = properties[name]
            described["material"] = dumps(found.stack, "json")
            super().__init__(described)

    return OpenPBR


def _read(mi: Any, properties: Any) -> Imported:
    """The stack of all properties but `OPTIONS`."""
    values = {}
    for name in list(properties.keys()):
        if name in OPTIONS:
            continue
        value = properties_of.value_of(mi, properties, name)
        if isinstance(value, mi.Object):
            rule = "must be a number, or a colour in a variant of RGB"
            raise InvalidInput(f"openpbr: {name}: {rule}; images are read from files, as in layered")
        values[name] = value
    try:
        return openpbr.read(values, properties.id() if properties.id() != "_unnamed" else "")
    except InvalidInput as error:
        raise InvalidInput(f"openpbr: {error}") from None
