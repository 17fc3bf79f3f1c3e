"""The wishes of the Appearance panel that are beyond lobes: what a material shows of each, the answer to one, and the
material made of what a workshop has."""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura.editor.messages import Answer, Body, Verb, document, field, material_of, model_of
from velatura.inverse import Infeasible, Target
from velatura.inverse.answer import nearest_answers, refused
from velatura.inverse.wishes import KINDS, Grazing, MixtureColour
from velatura.model import Model
from velatura.model.registry import stack_lobes
from velatura.stack import Described, Mix

ANGLE = 75.0  # of the second look
CHOICES = 4  # of what a workshop has
BLURRED = "passed"  # with a blur that needs no absorption


def wishes(body: Body) -> Answer:
    """Every wish that a material may be asked for, of a mixture its colour: what it shows of it, or what it lacks."""
    return {"wishes": _shown(material_of(body), model_of(body), body.get("angle", ANGLE))}


def _shown(stack: Described, model: Model, angle: float) -> list[Answer]:
    if isinstance(stack, Mix):
        own = MixtureColour(energy=0.5).of(stack, model)
        return [{"key": MixtureColour.key, "energy": np.clip(own, 0.0, 1.0).tolist()}]
    seen, found = stack_lobes(stack, np.cos(np.radians([0.0, angle])), model=model), list[Answer]()
    groups = [[k] for k in range(len(seen.energy))]
    for key, kind in KINDS.items():
        wish = kind(energy=0.5)
        lacking, row = wish.lacking(stack), Answer(key=key)
        if lacking and lacking.stack:
            row |= {"lacks": lacking.why, "way": lacking.words, "material": document(lacking.stack)}
        if lacking is None or (key == BLURRED and stack.transmits):
            row |= _coloured(wish.shown(seen, int(kind is Grazing), groups))
        if kind is Grazing:
            each = (Grazing(energy=0.5, lobe=k + 1) for k in range(len(groups)))
            row["lobes"] = [_coloured(one.shown(seen, 1, groups)) for one in each]
        if len(row) > 1:
            found.append(row)
    return found


def _coloured(shown: dict[str, Any]) -> dict[str, Any]:
    """Numbers that are shown, with energies in three channels."""
    return {**shown, "energy": np.broadcast_to(shown["energy"], 3).tolist()}


def wish(body: Body) -> Answer:
    """The nearest material to a wish under its key in `target`, from `material`, and what it shows; `snapped`: why the
    wish is not met, or null. A `coarse` one takes fewer readings."""
    model = model_of(body)
    target = Target.from_dict({**field(body, "target", dict), "start": material_of(body)})
    try:
        found = nearest_answers(target, 1, model, quick=body.get("coarse", False))[0]
    except Infeasible as error:
        return {"why": error.why}
    shown = _shown(found.stack, model, body.get("angle", ANGLE))
    snapped = None if found.met or target.film else refused(found).why
    return {"material": document(found.stack), "wishes": shown, "snapped": snapped}


def stock(body: Body) -> Answer:
    """The material made of substances that are `available`, with coats of `thinnest` at least: `choices`, the nearest
    first, each with its `material` and how far its lobes are `off`, in units of CIE 1976."""
    available, thinnest = field(body, "available", tuple), body.get("thinnest", 0.0)
    target = Target(start=material_of(body), available=available, thinnest=thinnest)
    found = nearest_answers(target, CHOICES, model_of(body))
    return {"choices": [{"material": document(each.stack), "off": each.units} for each in found]}


#: What `service.VERBS` takes over.
VERBS: dict[str, Verb] = {"wishes": wishes, "wish": wish, "stock": stock}
