"""Other members of the class of a lobe: stacks with the same lobes, and other free choices."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from velatura.inverse.lobes.interface import CONDUCTOR_MAX, ENERGY_MIN
from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.local.coordinates import REFLECTANCE_MAX, Bound, Point, retinted
from velatura.inverse.local.dragged import DraggedStack, with_depth
from velatura.inverse.local.newton import Compromise, Problem
from velatura.optics import fresnel

STEPS = (1.0, 0.5, 0.25, 0.125)  # shares of the way to a member, of which each is tried in turn


def member(
    stack: DraggedStack, k: int, point: Sequence[float], depths: Mapping[int, Array] | None = None
) -> tuple[DraggedStack, Bound | None]:
    """The stack with another member of a lobe's class, or the nearest to it, and then the bound that it reaches.

    point: as `point_of` gives it: free indices of dielectrics from the top, then a conductor's tint.
    depths: optical depths (3,) that media above interfaces of the lobe are to have, by their number in it.
    """
    here, there = np.array(stack.point_of(k)), np.array(point, float)
    now = {n: stack.depths_of(k)[n] for n in depths or {}}
    found, met, why = stack, 0.0, None
    for step in STEPS:
        share = met + step
        if share > 1:
            continue
        tau = {n: now[n] + share * (wanted - now[n]) for n, wanted in (depths or {}).items()}
        moved = _moved(found, k, here + share * (there - here), tau)
        if isinstance(moved, Bound):
            why = why or moved
        else:
            found, met = moved, share
        if met == 1:
            return found, None
    return found, why


def _moved(stack: DraggedStack, k: int, point: Array, depths: Mapping[int, Array]) -> DraggedStack | Bound:
    """The stack with the member of a class at a point; the violated bound if there is none."""
    moved, held, level = _placed(_deepened(stack, k, depths), k, point)
    problem = Problem(moved.point, stack.space.goal(stack.target))
    if level is not None:
        # Hold the index of the last dielectric, while what absorbs above it gives way, or is clear
        found = problem.solve(level)
        if isinstance(found, Point):
            return dataclasses.replace(moved, point=found)
        if found.reason != "absorption":
            return found
        x = moved.point.x.copy()
        x[level.coordinate] = 0.0
        moved = moved.at(x)
        problem, held = Problem(moved.point, problem.goal), [*held, level.coordinate]
    met = moved.solved(problem, held)
    return dataclasses.replace(moved, point=met) if isinstance(met, Point) else met


def _deepened(stack: DraggedStack, k: int, depths: Mapping[int, Array]) -> DraggedStack:
    """The stack with other optical depths above some interfaces of a lobe, its lobes not yet met.

    What reflects below is as much brighter as the media are darker. The target keeps depths that it holds fixed.
    """
    x, interfaces, target = stack.point.x.copy(), list(stack.interfaces), stack.target
    places = [n for n, own in enumerate(interfaces) if own.lobe == k]
    for n, depth in depths.items():
        own = interfaces[places[n]]
        darker = np.exp(2 * (depth - stack.depths_of(k)[n]))
        interfaces[places[n]] = dataclasses.replace(own, kept=depth[:, None])
        if own.depth is not None:
            x[own.depth] = 1.0
        for below in interfaces[places[n] :]:
            if below.reflectances is not None:
                u = x[below.reflectances]
                most = {"conductor": CONDUCTOR_MAX, "mirror": 1.0}.get(below.kind, REFLECTANCE_MAX)
                x[below.reflectances] = np.minimum(u * (darker if len(u) == 3 else np.mean(darker)), most)
        if n == 0 and (len(places) > 1 or k == 0):
            target = with_depth(target, k, depth)
    return stack.at(x, dataclasses.replace(stack.space, interfaces=tuple(interfaces))).renamed(target)


def _placed(stack: DraggedStack, k: int, point: Array) -> tuple[DraggedStack, list[int], Compromise | None]:
    """The stack with the indices and the tint of a member, its lobes not yet met.

    Returns the coordinates that these hold, too, and how the index of a last dielectric is held where something
    absorbs above it.
    """
    x, interfaces, level = stack.point.x.copy(), list(stack.interfaces), None
    held: list[int] = []
    eta_1 = stack.space.exterior
    for n, (own, part) in enumerate(zip(interfaces, stack.point.layers)):
        if own.lobe == k and own.kind != "mirror":
            wanted = float(point[len(held)])
            if own.log_index is not None:
                x[own.log_index] = np.log(wanted)
                held.append(own.log_index)
            elif own.kind == "conductor":
                interfaces[n] = dataclasses.replace(own, tint=retinted(own.tint, float(np.mean(own.tint)), wanted))
            else:
                assert own.reflectances is not None
                interfaces[n] = dataclasses.replace(own, side=-1 if wanted < eta_1 else 1)
                x[own.reflectances] = _scaled_to(x[own.reflectances], fresnel.normal_incidence(wanted / eta_1))
                if own.depth is not None:
                    bound = Bound(k, "absorption", 1, float(np.log(wanted)), interface=n)
                    level = Compromise(bound, own.depth)
        if own.kind == "dielectric":
            eta_1 = float(np.exp(x[own.log_index]) if own.log_index is not None else part.eta[0, 0])
    return stack.at(x, dataclasses.replace(stack.space, interfaces=tuple(interfaces))), held, level


def _scaled_to(reflectances: Array, most: float) -> Array:
    """Reflectances with another largest one, no channel without any."""
    now = np.max(reflectances)
    return max(most, ENERGY_MIN) * (reflectances / now if now > 0 else np.ones_like(reflectances))
