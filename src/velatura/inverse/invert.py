"""Inverse design: the stack, or several, with the lobes of a target (Bati et al. 2021)."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from velatura.errors import whole_number
from velatura.inverse import refined
from velatura.inverse.explain import infeasible
from velatura.inverse.lobes import sampling
from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.lobes.target import Target, TargetLike, read
from velatura.inverse.reasons import Direction
from velatura.inverse.solution import EFFORTS, Solution, exact, in_closed_form, solutions
from velatura.model import DEFAULT, Model, named
from velatura.model.guards import ALPHA_MIN
from velatura.model.registry import stack_lobes
from velatura.stack import Diffuse, MaterialLike, Stack, single

DRAWS = 4  # times that alternatives are drawn
GRAZING = (0.5, 0.4, 0.3, 0.2, 0.1)  # cosines at which members of a class may differ
NARROWEST = 2 * ALPHA_MIN  # roughness of lobes below a rough interface


def invert_stack(
    target: TargetLike,
    model: str | Model = DEFAULT,
    **switches: str,
) -> Solution:
    """A stack whose lobes at normal incidence are those of the target.

    Args:
        target: a target, the mapping of a target file, its lobes alone, or a file.
        model: that reads the stack; its `channels` are those of the target, if given there and by no switch.

    Raises:
        InvalidInput: not a target, or an unknown model or switch.
        Infeasible: there is no such stack; the error gives the reason, and the nearest targets that have one.
    """
    wanted = read(target).of_lobes()
    chosen, start = model_of(wanted, model, **switches), wanted.start
    wanted = wanted.model_copy(update={"start": None})
    begun = refined.from_start(start, wanted, chosen) if isinstance(start, Stack) else None
    if isinstance(begun, Direction):
        raise infeasible(wanted, chosen).nearer(begun)
    found = begun or search(wanted, chosen)
    if found is None:
        raise infeasible(wanted, chosen)
    return found


def model_of(target: Target, model: str | Model, **switches: str) -> Model:
    """The model that reads the stacks of a target; a given switch overrides that of the target."""
    return named(model, **({"channels": target.channels} if target.channels else {}) | switches)


def search(target: Target, model: Model, efforts: Sequence[tuple[int, int]] = EFFORTS) -> Solution | None:
    """The preferred stack, of those found at the lowest effort that finds any."""
    if target.brightness > 1:
        return None
    if not exact(target, model):
        met = refined.search(target, model)
        smooth = _smoothed(target)
        if met is None and smooth != target:
            near = refined.search(smooth, model)
            return near and dataclasses.replace(near, target=target, reached=smooth)
        return met
    return in_closed_form(target, model, efforts)


def _smoothed(target: Target) -> Target:
    """The target, smooth where a lobe is narrower than what is evaluated of rough interfaces."""
    for n, lobe in enumerate(target.lobes):
        if 0 < max(lobe.axes[:2]) < NARROWEST:
            target = target.with_lobe(n, alpha=0.0, variance=None)
    return target


def alternatives(
    target: TargetLike,
    count: int,
    model: str | Model = DEFAULT,
    seed: int = 0,
    **switches: str,
) -> list[Solution]:
    """Stacks that all have the lobes of a target: the one of `invert_stack`, then others drawn at random.

    They are drawn over all free coordinates of all lobes: indices, optical depths and tints. So a medium may absorb
    above the whole stack, where `invert_stack` has one only if it is fixed.

    Fewer than `count` where the target leaves nothing open.

    Raises:
        InvalidInput, Infeasible: as `invert_stack`.
    """
    count = whole_number("count", count, 1)
    first = invert_stack(target, model, **switches)
    rng, found = np.random.default_rng(seed), [first]
    near = first.in_closed_form
    for _ in range(DRAWS):
        paths, known = sampling.drawn(near.target, near.model, near.layers, rng), len(found)
        for drawn in solutions(near.target, near.model, paths, range(min(len(paths.cost), 2 * count))):
            if len(found) == count:
                return found
            other = _met(drawn, first)
            if other is not None and not any(other.alike(each) for each in found):
                found.append(other)
        if len(found) == known:  # too much is fixed for another one
            break
    return found


def _met(drawn: Solution, first: Solution) -> Solution | None:
    """The drawn stack, moved to where the model of the first stack reads its lobes; None if there is no such stack."""
    if exact(first.target, first.model):
        return drawn
    met = refined.moved(drawn, first.reached or first.target, first.model)
    if not isinstance(met, Solution) or met.reached:
        return None
    return dataclasses.replace(met, target=first.target, reached=first.reached)


def on_black(stack: MaterialLike) -> Stack:
    """A stack that ends in a dielectric, on a base that absorbs what it transmits: it shows by reflection alone.

    Raises:
        InvalidInput: not a valid material (a stack, a file, or a preset's name).
    """
    stack = single(stack, "the inverse")
    return Stack([*stack.layers, Diffuse(albedo=0.0)], exterior=stack.exterior) if stack.transmits else stack


def grazing(stack: MaterialLike, model: str | Model = DEFAULT) -> Array:
    """Energy of all lobes together at the cosines of GRAZING, (3, len(GRAZING)).

    Raises:
        InvalidInput: not a valid material (a stack, a file, or a preset's name), an unknown model, a texture.
    """
    return np.sum(stack_lobes(single(stack, "the inverse"), GRAZING, model=model).energy, axis=0)
