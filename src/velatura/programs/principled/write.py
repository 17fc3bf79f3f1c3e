"""A scene of Mitsuba that holds a `principled` alone, to be included in others."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from velatura.optics import fresnel
from velatura.programs import embedded, xml
from velatura.programs.principled import formulas
from velatura.programs.principled.parameters import PARAMETERS
from velatura.programs.program import Bake, Carried, Fitted, Program, burley, mean_alpha, own_maps, product
from velatura.programs.surface import Surface


def start(surface: Surface) -> Fitted:
    """Parameters of a surface, whose coat's colour goes into the base."""
    colours = (surface.tint, surface.tint) if surface.clear else (surface.colour, surface.coat.colour)
    values: Fitted = {
        "base_color": product(*colours),
        "metallic": surface.metalness,
        **burley(surface.alpha, "roughness", "anisotropic"),
        "eta": surface.eta,
        "spec_trans": surface.clear,
    }
    # It cannot be turned: across the tangent it is brushed less, never more
    if abs(np.cos(np.radians(surface.rotation))) <= 0.5:
        values["anisotropic"] = 0.0
    if surface.coated:
        rough, smooth = formulas.COAT_ALPHA
        values |= {
            "clearcoat": surface.coat.share * min(fresnel.normal_incidence(surface.coat.eta) / formulas.COAT_F_0, 1.0),
            "clearcoat_gloss": float(np.clip((rough - mean_alpha(surface.coat.alpha)) / (rough - smooth), 0, 1)),
        }
    return values


def text(made: Bake, material: Any, files: dict[str, str]) -> str:
    """The scene, with the loss in a comment and the stack in another."""
    values = [
        f'        <{"rgb" if each.is_colour else "float"} name="{each.name}" value="{xml.numbers(value)}"/>'
        for each, value in made.differing(PARAMETERS)
        if each.name not in made.images
    ]
    images = [line for name, image in made.images.items() for line in _image(name, image, files[name])]
    body = ['    <bsdf type="principled" id="material">', *values, *images, "    </bsdf>", "</scene>", ""]
    return embedded.document(['<scene version="3.0.0">'], made.comment, material, body)


def _image(name: str, image: Carried, file: str) -> Iterator[str]:
    """A texture of an image that the plugin takes as it is."""
    yield f'        <texture type="bitmap" name="{name}">'
    yield f'            <string name="filename" value={quoteattr(file)}/>'
    if image.texture.encoding == "linear":
        yield '            <boolean name="raw" value="true"/>'
    yield "        </texture>"


PROGRAM = Program(
    "Mitsuba's principled",
    PARAMETERS,
    formulas.value,
    start,
    text,
    maps=own_maps(PARAMETERS, ("eta",)),
)
