"""Fits beyond normal incidence: stacks that approximate a table over angles, and simpler stacks that replace a stack.

The future work that Bati et al. 2021 name in their section 8.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import Any, overload

import numpy as np

from velatura.errors import InvalidInput, whole_number, within
from velatura.inverse.fitting import angles
from velatura.inverse.fitting.angles import Directions, ReflectanceTable
from velatura.inverse.fitting.descent import Descent, End, Fit, descended, fit
from velatura.inverse.invert import alternatives, model_of
from velatura.inverse.lobes.partial_stack import written
from velatura.inverse.lobes.target import Target, TargetLike, read
from velatura.inverse.reasons import Infeasible
from velatura.inverse.solution import Solution
from velatura.model import DEFAULT, Model, named, variance_kind
from velatura.model.variance import Isotropic
from velatura.results import Fields
from velatura.stack import (
    Described,
    Diffuse,
    Interface,
    InterfaceValues,
    Layer,
    Material,
    MaterialLike,
    Measured,
    Medium,
    Mix,
    Stack,
    as_described,
    load,
)
from velatura.stack.flat_names import prefix
from velatura.stack.schema import parameters
from velatura.stack.values import Colour

STARTS = 4
BRUSHED, BRUSHING = (22.5, 67.5, 112.5, 157.5), 1.5  # degrees, and by which ratios, fits of brushed samples start
DARKEST = -0.5  # share of a conductor's reflectance, with which its k is 0: a base may be darker than any metal
GAINED = 0.99  # share of the squares of errors below which another interface gains something
TRIED, SETS = 3, 20  # sets of interfaces from which simplification descends, and that are all compared
FEWER = 2  # how many interfaces less are tried, too


def fit_target(
    table: ReflectanceTable,
    target: TargetLike,
    starts: int = STARTS,
    model: str | Model = DEFAULT,
    seed: int = 0,
    **switches: str,
) -> Fit:
    """The stack whose reflectance comes closest to a table, by descent from stacks that give a target.

    Args:
        target: rough lobes of the table at normal incidence; they give the number of interfaces, and the descents start
            from stacks that have them by the nearest model in closed form, or have those of the nearest target of the
            same form where there is none.
        starts: how many of these.

    Raises:
        InvalidInput: as `invert_stack`.
        Infeasible: no target of that form near this one has a stack.
    """
    wanted = read(target)
    chosen = model_of(wanted, model, **switches)
    found = [with_media(solution.stack) for solution in first_stacks(wanted, starts, chosen.surrogate, seed)]
    if table.directions.brushed:
        turned = [_brushed(stack, angle) for stack in found for angle in BRUSHED]
        found = _closest(table, turned, chosen, wanted.eta_max, starts)
    return fit(table, found, chosen, wanted.eta_max, _with_one_less)


def first_stacks(target: Target, count: int, model: Model, seed: int) -> list[Solution]:
    """Stacks that have the lobes of a target, which may be a rough guess: or those of the nearest one that has any."""
    try:
        return alternatives(target, count, model, seed)
    except Infeasible as error:
        alike = [way.target for way in error.directions if _form(way.target) == _form(target)]
        if not alike:
            raise
        return alternatives(alike[0], count, model, seed)


def _form(target: Target) -> list[tuple[int, str]]:
    return [(lobe.interfaces, lobe.base) for lobe in target.lobes]


@dataclass(frozen=True, repr=False)
class MixtureFit(Fields):
    """A mixture with simpler stacks, and each of these as a fit, by the name of its part: `part0`, `part1_part0`.

    Stacks of as few interfaces as are kept, or fewer, are in the mixture alone.
    """

    material: Mix
    model: Model
    parts: dict[str, Fit]

    def to_dict(self) -> dict[str, Any]:
        """The mixture and the reports of its parts as JSON has them."""
        return {
            "material": self.material.to_dict(),
            "parts": {name: found.to_dict() for name, found in self.parts.items()},
        }


@overload
def simplify(
    stack: Stack, interfaces: int, model: str | Model = DEFAULT, eta_max: float = 4.0, **switches: str
) -> Fit: ...


@overload
def simplify(
    stack: MaterialLike, interfaces: int, model: str | Model = DEFAULT, eta_max: float = 4.0, **switches: str
) -> Fit | MixtureFit: ...


def simplify(
    stack: MaterialLike, interfaces: int, model: str | Model = DEFAULT, eta_max: float = 4.0, **switches: str
) -> Fit | MixtureFit:
    """The stack of fewer interfaces whose reflectance comes closest to that of a stack, at all angles.

    It keeps some of the interfaces, the last one if nothing passes it, and a diffuse base; their values, and absorption
    below each but the last, then descend. Only what is reflected is compared: first the energy in every colour at
    every angle of incidence, then how it is spread. Of a mixture each stack that has more interfaces is simplified for
    itself; weights stay.

    Args:
        stack: a material (a stack, a mixture, a file, or a preset's name).
        interfaces: how many are kept, at least 1, and fewer than there are; fewer, where the last gain nothing.

    Raises:
        InvalidInput: not a valid material, no such number of interfaces, a texture, an unknown model or switch.
    """
    chosen = named(model, **switches)
    material: Described = load(stack)
    if not isinstance(material, Mix):
        return _simplified(material, interfaces, chosen, eta_max)
    most = max(len(each.interfaces) for _, each in material.leaves())
    if most <= interfaces:
        raise InvalidInput(f"interfaces: must be fewer than the {most} of the part that has most, got {interfaces}")
    parts: dict[str, Fit] = {}

    def simpler(path: tuple[int, ...], each: Stack) -> Stack:
        if len(each.interfaces) <= interfaces:
            return each
        name = prefix(path).rstrip("_")
        with within(name):
            parts[name] = _simplified(each, interfaces, chosen, eta_max)
        return parts[name].stack

    return MixtureFit(material.each(simpler), chosen, parts)


def _simplified(stack: Stack, interfaces: int, chosen: Model, eta_max: float) -> Fit:
    count = len(stack.interfaces)
    if count == 1:
        raise InvalidInput("interfaces: the material has one, and none can have fewer")
    if not 1 <= whole_number("interfaces", interfaces) < count:
        raise InvalidInput(
            f"interfaces: must be at least 1, and fewer than the {count} that there are, got {interfaces}"
        )
    # Along its first brushing, so that this stays, and where others are as they are to it
    along = next((layer.rotation for layer in Material.of(stack).interfaces if layer.alpha_u != layer.alpha_v), 0.0)
    straight = _turned(stack, -along)
    table = compared(straight, chosen)
    best, *_ = ends = _simplest(straight, interfaces, table, chosen, eta_max, max(interfaces - FEWER, 1))
    found = angles.table_of(best.stack, table.directions, chosen, with_energy=True)
    errors, by_angle = [end.error for end in ends], angles.report(table, found)
    return Fit(_turned(best.stack, along), chosen, best.error, by_angle, errors, energies=angles.energies(table, found))


def compared(stack: Stack, model: Model) -> ReflectanceTable:
    """The table of a stack that simplification compares: reflectance about its lobes, and all energies."""
    turned = variance_kind(Material.of(stack, as_described)) is not Isotropic
    return angles.table_of(stack, Directions.about_lobes(turned), model, with_energy=True)


def _simplest(
    stack: Stack, interfaces: int, table: ReflectanceTable, model: Model, eta_max: float, least: int
) -> list[End]:
    """The ends of descents from the sets of interfaces that are closest before any change, the closest first.

    Where one interface less comes as close, down to the least number, a descent begins at that stack with another
    interface, without effect; if it gains nothing either, that stack is the closest.
    """
    closed = model.closed_form

    def itself(start: Stack) -> End:
        return Descent(table=table, start=start, model=model, eta_max=eta_max, darkest=DARKEST, films=False).run()

    starts = _of_sets(stack, interfaces, table, model, eta_max)
    found = descended(table, starts, model, eta_max, DARKEST, films=False)
    # A model that is slow also descends by itself: the one that stands in for it leads far away from a close start
    found += [] if closed else [itself(start) for start in starts if not any(start.films)]
    if interfaces > least:
        fewer = _simplest(stack, interfaces - 1, table, model, eta_max, least)[0]
        if fewer.cost <= min(end.cost for end in found):
            more = itself(_with_one_more(fewer.stack))
            found.append(more if more.cost < GAINED * fewer.cost else fewer)
    return sorted(found, key=lambda end: end.cost)


def _of_sets(stack: Stack, interfaces: int, table: ReflectanceTable, model: Model, eta_max: float) -> list[Stack]:
    """The stacks of some interfaces, an opaque last one among them, that are closest before any change.

    Where there are many sets, those that lack one interface of the closest sets of one more, by the nearest model in
    closed form.
    """
    count = len(stack.interfaces)
    sets = [tuple(range(count))]
    free = count - stack.interfaces[-1].opaque

    def closest(sets: Sequence[tuple[int, ...]], model: Model, tried: int) -> list[tuple[int, ...]]:
        starts = [_of_some(stack, kept) for kept in sets]
        costs = [Descent(table=table, start=start, model=model, eta_max=eta_max).start_end.cost for start in starts]
        return [sets[n] for n in np.argsort(costs, kind="stable")[:tried]]

    if comb(free, count - interfaces) <= SETS:
        sets = [tuple(kept) for kept in combinations(range(count), interfaces) if count - free <= kept.count(count - 1)]
    else:
        for _ in range(count - interfaces):
            fewer = [tuple(k for k in kept if k != out) for kept in sets for out in kept if out < free]
            sets = closest(list(dict.fromkeys(fewer)), model.surrogate, TRIED)
    return [_of_some(stack, kept) for kept in closest(sets, model, TRIED if model.closed_form else 1)]


def _with_one_more(stack: Stack) -> Stack:
    """The stack with another interface on top, between equal indices."""
    alpha = Material.of(stack).interfaces[0].alpha_u
    return stack.with_layers([Interface(eta=stack.exterior, alpha=alpha), Medium(), *stack.layers])


def _closest(table: ReflectanceTable, starts: list[Stack], model: Model, eta_max: float, count: int) -> list[Stack]:
    """The starts that are closest before any descent."""
    costs = [Descent(table=table, start=start, model=model, eta_max=eta_max).start_end.cost for start in starts]
    return [starts[n] for n in np.argsort(costs, kind="stable")[:count]]


def _of_some(stack: Stack, kept: Sequence[int]) -> Stack:
    """The stack with some of its interfaces, and one medium for all layers between two of them."""
    layers: list[Layer] = []
    media: list[Medium] = []
    n = -1
    for layer in stack.layers:
        if isinstance(layer, Medium):
            media.append(layer)
            continue
        if not layer.surface:
            raise InvalidInput(f"layers: no {layer.kind} is simplified; interfaces, media and a base are")
        n += isinstance(layer, Interface)
        if isinstance(layer, Diffuse) or n in kept:
            # What lay above the first one that is kept, below one that is not, goes below it
            if layers or (media and n == 0):
                layers.append(_merged(media))
                media = []
            layers.append(layer)
    return stack.with_layers(layers)


def _merged(media: Sequence[Medium]) -> Medium:
    """One medium of depth 1 with the optical depths of several, clear where there is none, and their phase function,
    or else Henyey and Greenstein's of their mean asymmetry."""
    absorbed, scattered = (
        np.array([np.broadcast_to(_colour(medium, key), 3) * medium.depth for medium in media]).reshape(-1, 3)
        for key in ("sigma_a", "sigma_s")
    )
    often = scattered.mean(axis=1)
    sigma_a, sigma_s = (written(depths.sum(axis=0)) for depths in (absorbed, scattered))
    phases = {medium.phase for medium, depth in zip(media, often) if depth > 0}
    if len(phases) == 1 and (phase := phases.pop()):
        return Medium(sigma_a=sigma_a, sigma_s=sigma_s, phase=phase)
    g = np.average([medium.written("g") for medium in media], weights=often) if often.sum() > 0 else 0.0
    return Medium(sigma_a=sigma_a, sigma_s=sigma_s, g=float(g))


def _colour(medium: Medium, key: str) -> Any:
    """A coefficient of a medium as a number or a colour."""
    value = medium.written(key)
    declared = parameters(Medium)[key]
    assert isinstance(declared, Colour)
    return declared.reduced(value) if isinstance(value, Measured) else value


def with_media(stack: Stack) -> Stack:
    """The stack with a medium, clear if there was none, between all of its interfaces, and none above them."""
    first = next(n for n, layer in enumerate(stack.layers) if layer.surface)
    return _of_some(stack.with_layers(stack.layers[first:]), range(len(stack.interfaces)))


def _brushed(stack: Stack, angle: float) -> Stack:
    """The stack with all of its rough interfaces brushed along a direction."""
    changed: dict[str, float] = {}
    for n, layer in enumerate(Material.of(stack).layers):
        if isinstance(layer, InterfaceValues) and layer.alpha_u > 0:
            u, v = layer.alpha_u / BRUSHING, min(layer.alpha_v * BRUSHING, 1.0)
            changed |= {f"layer{n}_alpha_u": u, f"layer{n}_alpha_v": v, f"layer{n}_rotation": angle}
    return stack.replace(**changed)


def _turned(stack: Stack, angle: float) -> Stack:
    """The stack with all brushings turned by degrees."""
    interfaces = [(n, layer) for n, layer in enumerate(Material.of(stack).layers) if isinstance(layer, InterfaceValues)]
    turns = {f"layer{n}_rotation": at.rotation + angle for n, at in interfaces if at.alpha_u != at.alpha_v}
    return stack.replace(**turns) if angle else stack


def _with_one_less(stack: Stack) -> list[Stack]:
    """The stacks that lack one of the interfaces, an opaque last one excepted."""
    count = len(stack.interfaces)
    left_out = range(count - stack.interfaces[-1].opaque) if count > 1 else ()
    return [_of_some(stack, [n for n in range(count) if n != out]) for out in left_out]
