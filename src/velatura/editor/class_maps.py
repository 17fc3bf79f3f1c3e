"""The class of one lobe as a map: all indices with the same lobe at normal incidence, and the chosen member."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from velatura.editor.appearance import answered, dragged, lobe_of
from velatura.editor.messages import Answer, Body, Verb, array
from velatura.errors import InvalidInput, within
from velatura.inverse import EquivalenceClass, Target
from velatura.inverse.lobes import interface, stacks
from velatura.inverse.lobes.interface import conductor_extinction, conductor_index
from velatura.inverse.local import members as classes
from velatura.inverse.local.coordinates import Bound
from velatura.inverse.local.dragged import DraggedStack, with_depth
from velatura.optics import fresnel
from velatura.stack.values import Colour

Array = NDArray[np.float64]

SIZES = (8, 256)
TINTS = 33  # points of a conductor's curve
CHANNELS = ("r", "g", "b")
DEPTH = Colour("", low=0.0, high=50.0, texturable=False, differentiable=False)
DEEP, SLACK = 0.01, 1e-6  # the lowest end of an axis of depths, and by which they may miss their bounds


def class_(body: Body) -> Answer:
    """The map of a lobe's class below the layers that the material has above it.

    Arrays have rows over the second axis (y) and columns over the first (x). `feasible` and `absorption` (the mean
    optical depth) are null where all members lie on curves: those of `outlines`, by channel, `all` for the indices
    that do for all of them. `point` is what `member` takes, `member` its place on the map. `depths` are the free
    optical depths by name: `value`, and `low` and `high` at the present indices, by channel. Where the model has no
    closed form, that of the papers stands in, with the lobes that it reads of the material, so that the map is exact
    at the member. `conductor` is the map of a metal's eta against k over its tint, `members` by channel.
    """
    target, near, lobe = _held(body)
    size = body.get("size", 48)
    if not isinstance(size, int) or not SIZES[0] <= size <= SIZES[1]:
        raise InvalidInput(f"size: must be a number from {SIZES[0]} to {SIZES[1]}, got {size!r}")
    place = _place(near, lobe)
    if any(part.films for part, own in zip(near.point.layers, near.interfaces) if own.lobe == lobe):
        raise InvalidInput(
            f"lobe {lobe + 1}: has no map of its class, since thin films change what its indices reflect; "
            "drag its lobe, or choose one without films"
        )
    wanted = near.target.lobes[lobe]
    if wanted.interfaces > 2:
        raise InvalidInput(f"lobe {lobe + 1}: has no map of its class, since three interfaces leave two indices free")
    free = _members(near, lobe)
    members = free.held(tau_0=near.depths_of(lobe)[0]) if wanted.interfaces == 2 else free
    axis = np.geomspace(1.0, target.eta_max, size)
    answer: Answer = {"member": near.point_of(lobe), "point": near.point_of(lobe), "depths": _depths(near, lobe, free)}
    if not answer["point"]:
        return answer | {"kind": "mirror", "axes": [], "feasible": None, "absorption": None, "outlines": []}
    if wanted.interfaces == 2 and wanted.base == "dielectric":
        return answer | {"kind": "dielectric pair"} | _pair(members, axis)
    conductor = _conductor(near, place + wanted.interfaces - 1) if wanted.base == "conductor" else None
    if wanted.interfaces == 1 and conductor:
        return answer | conductor
    kind = f"pair over a {wanted.base}" if wanted.interfaces == 2 else "dielectric"
    answer |= {"kind": kind, "conductor": conductor}
    if not conductor:
        return answer | _line(members, axis)
    tau = near.depths_of(lobe)[1]
    answer["member"] = [answer["point"][0], float(np.mean(tau))]
    return answer | _coat(members, axis, tau)


def member(body: Body) -> Answer:
    """The stack with another member of a lobe's class, or the nearest; all lobes stay unchanged.

    point: as `class` gives it, where it changes; with `map: conductor` a point [eta, k], to which the nearest tint is
    taken. depths: by the names that `class` gives them, where they change.
    """
    target, near, lobe = _held(body)
    wanted = near.target.lobes[lobe]
    depths = _wanted_depths(near, lobe, body)
    point = body.get("point") or (near.point_of(lobe) if depths else None)
    if not point:
        raise InvalidInput(f"point: must be a list of numbers, got {point!r}")
    if wanted.base == "conductor" and (wanted.interfaces == 1 or body.get("map") == "conductor") and len(point) == 2:
        last = max(n for n, place in enumerate(near.interfaces) if place.lobe == lobe)
        point = [*near.point_of(lobe)[:-1], _nearest_tint(near, last, point)]
    here = near.point_of(lobe)
    if len(point) != len(here):
        raise InvalidInput(f"point: must hold {len(here)} numbers, got {len(point)}")
    tints = 1 if wanted.base == "conductor" else 0
    high = [target.eta_max] * (len(here) - tints) + [1.0] * tints
    low = [1.0] * (len(here) - tints) + [0.0] * tints
    goal = np.clip(point, low, high).tolist()
    if lobe == 0 and wanted.interfaces == 1 and not tints:
        # Nothing but what absorbs above it makes another first interface reflect the same
        (part,) = _members(near, lobe).member(goal[0])
        depths[0], goal = np.maximum(np.broadcast_to(part.tau, (3, 1))[:, 0], 0.0), here
    found, bound = classes.member(near, lobe, goal, depths)
    reached = found.depths_of(lobe)
    if bound is None and any(np.max(np.abs(reached[n] - depth)) > SLACK for n, depth in depths.items()):
        bound = Bound(lobe, "bright", -1, 0.0)  # a medium above a metal gives way
    if tints:
        tint = found.point_of(lobe)[-1]
        found = found.renamed(found.target.with_lobe(lobe, tint=min(max(tint, 0.0), 1.0)))
    return answered(found, bound.why(target) if bound else None)


def _held(body: Body) -> tuple[Target, DraggedStack, int]:
    """The target, the material that has it, and the requested lobe."""
    target = Target.from_dict(body.get("target")).of_lobes()
    near = dragged(body, target)
    if near is None:
        raise InvalidInput("material: does not have the interfaces of the target")
    return target, near.renamed(target), lobe_of(body, target)


def _place(near: DraggedStack, lobe: int) -> int:
    """The first interface of a lobe."""
    return next(n for n, place in enumerate(near.interfaces) if place.lobe == lobe)


def _members(near: DraggedStack, lobe: int) -> EquivalenceClass:
    """The class of a lobe, in closed form, below the layers that the material has above; its depths are free."""
    seen = near.in_closed_form()
    wanted = with_depth(seen.target, lobe, None)
    return stacks.class_of(seen.above(_place(near, lobe)), wanted.lobes[lobe], wanted, first=lobe == 0)


def _depths(near: DraggedStack, lobe: int, members: EquivalenceClass) -> dict[str, Answer]:
    place = _place(near, lobe)
    own, now = near.point.layers[place : place + members.interfaces], near.depths_of(lobe)
    found = {}
    for one in members.depths(tuple(own)):
        value = now[int(one.name[-1])]
        found[one.name] = {"value": value.tolist(), "low": one.low, "high": np.maximum(one.high, value).tolist()}
    return found


def _wanted_depths(near: DraggedStack, lobe: int, body: Body) -> dict[int, Array]:
    """Optical depths (3,) by the number of the interface below."""
    wanted, found = near.target.lobes[lobe], {}
    last = wanted.interfaces - 1
    free = [f"tau_{n}" for n in range(wanted.interfaces) if n < last or wanted.base == "conductor"]
    for name, value in (body.get("depths") or {}).items():
        if name not in free:
            allowed = f"one of {', '.join(free)}" if free else "none: they follow from the index"
            raise InvalidInput(f"depths: {name}: must be {allowed}")
        with within(f"depths: {name}", ValueError):
            found[int(name[-1])] = np.broadcast_to(np.array(DEPTH.check(value), float), 3)
    return found


# Maps ----------------------------------------------------------------------------------------------------------------


def _pair(members: EquivalenceClass, axis: Array) -> Answer:
    """Index against index."""
    depths = members.grid(axis, axis)
    feasible = np.all(depths >= -interface.NEGLIGIBLE, axis=0)
    channels = [*zip(CHANNELS, depths), ("all", np.min(depths, axis=0))]
    return {
        "axes": [_axis("eta 1", axis), _axis("eta 2", axis)],
        "feasible": array(feasible.T, "uint8"),
        "absorption": array(np.where(feasible, np.mean(depths, axis=0), np.nan).T),
        "outlines": [{"channel": name, "points": line} for name, depth in channels for line in _zeros(axis, depth)],
    }


def _zeros(axis: Array, depth: Array) -> list[list[list[float]]]:
    """Curves of depth 0 over the indices (eta_1, eta_2): below the index above, where it falls, and where it rises."""
    curves = []
    reflected = np.exp(2 * depth) - 1  # straighter than the depth itself
    for sign in (-1, 1):
        found = []
        for x, column in zip(axis, reflected):
            a, b = sign * column[:-1], sign * column[1:]
            for n in np.flatnonzero((a < 0) & (b >= 0)):
                y = axis[n] + (axis[n + 1] - axis[n]) * a[n] / (a[n] - b[n])
                found.append([float(x), float(y)])
        curves.append(found)
    return [curve for curve in curves if len(curve) > 1]


def _line(members: EquivalenceClass, axis: Array) -> Answer:
    """The one free index."""
    *_, last = parts = members.member(axis)
    feasible = np.logical_and.reduce([np.broadcast_to(part.feasible, axis.shape) for part in parts])
    absorption = np.where(feasible, np.mean(np.atleast_2d(last.tau), axis=0), np.nan)
    return {
        "axes": [_axis("eta 1", axis)],
        "feasible": array(feasible[None], "uint8"),
        "absorption": array(absorption[None]),
        "outlines": [],
    }


def _coat(members: EquivalenceClass, axis: Array, tau: Array) -> Answer:
    """The index of a coat on a conductor against what it absorbs, in the mean of the channels, which differ as now."""
    possible = np.logical_and.reduce(np.broadcast_arrays(*(part.feasible for part in members.member(axis))))
    low, high = members.depths_1(axis)
    depth = np.linspace(0.0, max(float(np.max(high[:, possible], initial=0.0)), float(np.mean(tau)), DEEP), len(axis))
    each = np.maximum(tau[:, None, None] - np.mean(tau) + depth[:, None], 0.0)
    inside = np.all((each >= low[:, None] - SLACK) & (each <= high[:, None] + SLACK), axis=0) & possible
    ends = high - tau[:, None] + np.mean(tau)  # of each channel, where the mean is then
    outlines = [
        {"channel": name, "points": np.stack([axis[possible], end[possible]], axis=1).tolist()}
        for name, end in zip((*CHANNELS, "all"), (*ends, np.min(ends, axis=0)))
    ]
    return {
        "axes": [_axis("eta 1", axis), _axis("absorption of the coat", depth)],
        "feasible": array(inside, "uint8"),
        "absorption": array(np.where(inside, depth[:, None], np.nan)),
        "outlines": [one for one in outlines if len(one["points"]) > 1],
    }


def _conductor(near: DraggedStack, n: int) -> Answer:
    """eta against k of a metal, over its tint."""
    eta, kappa = _curves(near, n, np.linspace(0, 1, TINTS))
    here = [x[:, 0] for x in _metal(near, n)]
    limits = [(float(x.min()), float(x.max())) for x in (eta, kappa)]
    return {
        "kind": "conductor",
        "axes": [{"label": label, "low": low, "high": high} for label, (low, high) in zip(("eta", "k"), limits)],
        "feasible": None,
        "absorption": None,
        "outlines": [
            {"channel": name, "points": np.stack(curve, axis=1).tolist()} for name, *curve in zip(CHANNELS, eta, kappa)
        ],
        "member": [float(np.mean(x)) for x in here],
        "members": np.stack(here, axis=1).tolist(),
        "tint": near.point_of(near.interfaces[n].lobe)[-1],
    }


def _metal(near: DraggedStack, n: int) -> tuple[Array, Array]:
    """Absolute eta and k of a metal, (3, 1) each."""
    eta, kappa = near.indices(n)
    assert kappa is not None
    return np.broadcast_to(eta, (3, 1)), np.broadcast_to(kappa, (3, 1))


def _curves(near: DraggedStack, n: int, tint: Array) -> tuple[Array, Array]:
    """eta and k, (3, N), of metals that reflect as much when smooth."""
    eta, kappa = _metal(near, n)
    eta_1 = near.index_above(n)
    u = fresnel.normal_incidence(eta / eta_1, kappa / eta_1)
    along = conductor_index(u, tint)
    return along * eta_1, conductor_extinction(u, along) * eta_1


def _nearest_tint(near: DraggedStack, n: int, point: list[float]) -> float:
    """The mean tint with which some channel comes nearest to a point (eta, k)."""
    tints = np.linspace(0, 1, 8 * TINTS)
    eta, kappa = _curves(near, n, tints)
    apart = np.hypot(eta - point[0], kappa - point[1])
    channel, best = np.unravel_index(int(np.argmin(apart)), apart.shape)
    return near.tint_by(n, int(channel), float(tints[best]))


def _axis(label: str, values: Array) -> Answer:
    return {"label": label, "low": float(values[0]), "high": float(values[-1]), "values": values.tolist()}


#: What `service.VERBS` takes over.
VERBS: dict[str, Verb] = {"class": class_, "member": member}
