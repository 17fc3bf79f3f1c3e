"""Thin films in the page: the colours that an interface has over the thickness of one of its films."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from velatura.editor.messages import Answer, Body, Verb, array, field, stack_of
from velatura.errors import InvalidInput
from velatura.shader.lookups.films import coated_layers
from velatura.stack import srgb_sensitivity

COLOURS = 128  # over the range of thickness


def film(body: Body) -> Answer:
    """Reflectance at the normal (COLOURS, 3), linear, for thicknesses from 0 to `thickness_nm` of a film of a layer."""
    stack, layer, chosen = stack_of(body, "films"), field(body, "layer", int), field(body, "film", int)
    thickest_nm = field(body, "thickness_nm", float)
    written = getattr(stack.layers[layer], "films", ()) if layer < len(stack.layers) else ()
    if chosen >= len(written):
        raise InvalidInput(f"layer {layer}: has no film {chosen}")
    films = coated_layers(stack.replace(**{f"layer{layer}_film{chosen}_thickness_nm": thickest_nm}))[layer]
    assert films and films.coating
    # Those of no thickness are none
    place = sum(each.thickness_nm > 0 for each in written[:chosen])
    seen = films.coating if films.rarer == 1 else films.coating.reversed()
    drawn = list(seen.films)
    colours = []
    for thickness_nm in np.linspace(0, thickest_nm, COLOURS).tolist():
        drawn[place] = replace(drawn[place], thickness_nm=thickness_nm)
        coating = replace(seen, films=tuple(drawn))
        colours.append(coating.reflectance(np.ones(1), srgb_sensitivity)[:, 0])
    return {"colours": array(np.array(colours))}


VERBS: dict[str, Verb] = {"film": film}
