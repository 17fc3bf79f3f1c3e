"""Properties of a stack that a program does not hold, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from velatura.programs.from_stack import Described
from velatura.programs.program import Program
from velatura.stack import InterfaceValues, SlabValues

TURNED = 0.5  # degrees


def lost(stack: Described, program: Program) -> Iterator[str]:
    """A line for each property that is left out or replaced; layers are counted from the top, from 0."""
    layers = stack.material.layers
    interfaces = [(n, each) for n, each in enumerate(layers) if isinstance(each, InterfaceValues)]
    surfaces = [n for n, layer in enumerate(layers) if not isinstance(layer, SlabValues)]
    if np.max(np.abs(np.asarray(stack.material.exterior) - 1)) > 1e-6:
        yield "exterior: indices are taken relative to it, so that the material stands in air"
    coated = len(interfaces) > 1 and interfaces[0][1].kind == "dielectric"
    if len(surfaces) > 2:
        yield f"layers {', '.join(map(str, surfaces[coated:]))}: merged into one base"
    for n, each in interfaces:
        coat = coated and n == interfaces[0][0]
        yield from (f"layer {n}: {what}" for what in _of_interface(each, coat, program))
    for n, layer in enumerate(layers):
        if isinstance(layer, SlabValues):
            yield from (f"layer {n}: {what}" for what in _of_medium(layer, program))
    if stack.thin and not program.pane:
        yield "transmission: light is refracted as into a solid, and does not leave a pane"


def _of_interface(each: InterfaceValues, coat: bool, program: Program) -> Iterator[str]:
    brushed = abs(each.alpha_u - each.alpha_v) > 1e-6
    if coat and brushed and not program.coat_brushed:
        yield "the coat's brushing is left out"
    if not coat and brushed and not program.turned:
        along = each.rotation if each.alpha_u > each.alpha_v else each.rotation + 90
        if abs((along + 90) % 180 - 90) > TURNED:
            yield "brushing is held along the tangent only"
    if coat and not program.coat_eta:
        yield "the coat's index is 1.5; its reflectance is the coat's weight"
    if each.kind == "dielectric" and np.ptp(np.broadcast_to(each.eta, (3, 1))) > 1e-6:
        yield "one index for all colours"
    if each.films and not program.fitted("film"):
        yield "thin films are replaced by a colour"
    elif each.films and (coat or len(each.films) > 1):
        yield "thin films are replaced by one film on the base"


def _of_medium(each: SlabValues, program: Program) -> Iterator[str]:
    if np.any(each.tau_s > 0):
        yield "scattering is part of the base's colour"
    if np.any(each.tau_a > 0):
        if not program.coat_colour:
            yield "absorption is part of the base's colour, at all angles alike"
        elif not program.coat_depth:
            yield "absorption does not deepen with the angle"
