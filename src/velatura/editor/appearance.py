"""The calls of the Appearance panel: the lobes of a material, and the material with other lobes.

Every verb is a function of a mapping to a mapping, both of JSON's types; `service.VERBS` takes them over. An answer
depends on its request alone, and its lobes are read from the returned stack.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from velatura.editor.messages import LOBES, Answer, Body, Verb, document, model_of, stack_of
from velatura.errors import InvalidInput, NoSolution
from velatura.figures.bati2021_targets import FIGURES
from velatura.inverse import Fixed, Infeasible, Target, coat, invert_stack, solution
from velatura.inverse.coats import with_albedo
from velatura.inverse.lobes.interface import conductor_tint
from velatura.inverse.lobes.target import MOST_INTERFACES
from velatura.inverse.local.coordinates import plain
from velatura.inverse.local.dragged import DraggedStack, seen
from velatura.inverse.nearest import lobes_of, nearest
from velatura.inverse.reasons import REASONS
from velatura.model import Model, named
from velatura.model.registry import stack_lobes
from velatura.model.roughness_maps import MAPS
from velatura.model.variance import Roughness
from velatura.stack import Diffuse, Interface, Stack, Varying
from velatura.stack.mix import Described

ALIKE = 1e-5  # difference of variances of neighbours that are one lobe
SAVED = tuple(str(n) for n in range(15, 23))  # figures of Bati et al. 2021
SAVED_MODEL = "bati2021"


# Bodies and answers --------------------------------------------------------------------------------------------------


def reader_of(body: Body, target: Target) -> Model:
    """The model that reads the stacks; its channels are those of the target, if given there."""
    chosen = model_of(body)
    return chosen.with_switches(channels=target.channels) if target.channels else chosen


def lobe_of(body: Body, target: Target) -> int:
    """The index of a lobe of the target."""
    lobe = body.get("lobe")
    if lobe is None or lobe >= len(target.lobes):
        raise InvalidInput(f"lobe: must be a number from 0 to {len(target.lobes) - 1}, got {lobe!r}")
    return lobe


def held(material: Answer, target: Target, model: Model) -> DraggedStack | None:
    """A material that can be dragged, None if it does not have the form of the target."""
    try:
        found = DraggedStack.of(Stack.from_dict(material), target, model)
    except InvalidInput:
        return None
    return found and found.tinted()


def dragged(body: Body, target: Target) -> DraggedStack | None:
    """The material as it is dragged, by a model in closed form where its lobes are given, films known roughly."""
    model, material, read = reader_of(body, target), body.get("material") or {}, body.get("read")
    if read is None:
        return held(material, target, model)
    near = held(material, target, model.surrogate)
    if near is None or (model.closed_form and not near.space.coated):
        return near
    return near.quickly.known(Target.from_dict(read))


def described(target: Target) -> Answer:
    """A target as a body holds it, all of its lobes' keys written out."""
    rows = []
    for lobe in target.lobes:
        blur = {"alpha": list(lobe.axes[:2]) if lobe.brushed else lobe.roughness, "rotation": lobe.rotation}
        row = {"energy": list(lobe.colour), **blur, "interfaces": lobe.interfaces, "base": lobe.base}
        rows.append({**row, "tint": lobe.tint, "fixed": lobe.fixed.to_dict()})
    return {**target.to_dict(), "lobes": rows}


# A material as lobes -------------------------------------------------------------------------------------------------


def appearance(body: Body) -> Answer:
    """A material as a target; if it is not one, `says` is the reason, and the target is for display only."""
    stack, model = stack_of(body, "appearance"), model_of(body)
    if why := _varies(stack):
        return _shown(stack, model, why)
    try:
        parts = plain(stack)
    except InvalidInput as error:
        return _shown(stack, model, str(error))

    # Share the interfaces out among lobes
    each = DraggedStack.of(stack, _target(stack, parts, [1] * len(parts)), model)
    assert each is not None
    counts: list[int] = body.get("interfaces") or _counts(each.variances, parts)
    if sum(counts) != len(parts) or not set(counts) <= set(range(1, MOST_INTERFACES + 1)):
        raise InvalidInput(
            f"interfaces: must be 1 to {MOST_INTERFACES} for each lobe, {len(parts)} in all, got {counts}"
        )
    whole = DraggedStack.of(stack, _target(stack, parts, counts), model)
    assert whole is not None
    target = lobes_of(stack, whole)
    return {
        "target": described(target),
        "haze": haze(target, model),
        "layers": _layers(stack, counts),
        "held": _held_back(target, whole.scatters),
        "says": None,
    }


def _varies(stack: Stack) -> str | None:
    """Why lobes are not those of one point, if they are not."""
    last = len(stack.layers) - 1 if stack.base else None
    for address, value in stack.values():
        if isinstance(value, Varying) and address.layer not in (None, last):
            own = "so that every point of the surface has lobes of its own; give it one value to drag them"
            return f"layer {address.layer}: has a {value.what}, {own}"
    return None


def _held_back(target: Target, scatters: bool) -> list[Answer]:
    """The parts of every lobe that cannot be asked for, `energy` or `interfaces`, each with the reason."""
    found: list[Answer] = [
        {"interfaces": "a medium that scatters stays where it is"} if scatters else {} for _ in target.lobes
    ]
    if target.lobes[0].base == "mirror" and target.lobes[0].interfaces == 1:
        found[0]["energy"] = REASONS["mirror"]
    return found


def haze(target: Target, model: Model) -> list[Answer]:
    """Ratios of energies, by channel, and of widths, of every lobe and the next one below."""
    found = []
    for lobe, below in zip(target.lobes, target.lobes[1:]):
        s, s_below = (float(MAPS[model.map].variance(one.roughness)) for one in (lobe, below))
        energy = [b / a if a > 0 else None for a, b in zip(lobe.colour, below.colour)]
        found.append({"energy": energy, "width": (s_below / s) ** 0.5 if s > 0 else None})
    return found


def _counts(variances: np.ndarray, parts: list[Any]) -> list[int]:
    """Interfaces of every lobe: neighbours that blur alike are one, unless light is scattered between them: two, or the
    last three of an odd number."""
    runs: list[int] = []
    previous = None
    for s, part in zip(variances, parts):
        if previous is not None and np.abs(s - previous).max() <= ALIKE and part.scatters is None:
            runs[-1] += 1
        else:
            runs.append(1)
        previous = s
    return [count for run in runs for count in _shared(run)]


def _shared(run: int) -> list[int]:
    return [1] if run == 1 else [2] * (run // 2 - run % 2) + [3] * (run % 2)


def _target(stack: Stack, parts: list[Any], counts: list[int]) -> Target:
    """A target of the form of a material, its energies and blurs not yet read."""
    lobes, n, eta, axis = [], 0, stack.exterior, 0.0
    for count in counts:
        own = parts[n : n + count]
        axis = next((r.rotation for r in (part.roughness for part in reversed(own)) if r.alpha_u != r.alpha_v), axis)
        tau = np.broadcast_to(own[0].tau, (3, 1))[:, 0]
        pinned = bool(np.any(tau)) and (count > 1 or n == 0)
        fixed: Answer = {"tau": [tuple(tau.tolist()), *[None] * (count - 1)]} if pinned else {}
        if any(part.films for part in own):
            fixed["films"] = [part.films or None for part in own]
        tint = 0.5
        if own[-1].kind == "conductor":
            above = own[-2].eta if count > 1 else eta
            tint = _tint(own[-1], above)
        form = {"interfaces": count, "base": own[-1].kind, "tint": tint, "fixed": fixed}
        lobes.append({"energy": 0.0, "rotation": float(np.degrees(axis)), **form})
        n, eta = n + count, own[-1].eta
    most = max([4.0, *(float(np.max(part.eta)) for part in parts if part.kind == "dielectric")])
    return Target(lobes, name=stack.name, exterior=stack.exterior, eta_max=most)


def _tint(part: Any, eta_1: Any) -> float:
    return float(np.mean(conductor_tint(part.eta / eta_1, part.kappa / eta_1)))


def _layers(stack: Stack, counts: list[int]) -> list[list[int]]:
    """Indices of the layers of every lobe: its interfaces, and the media above them."""
    found: list[list[int]] = [[] for _ in counts]
    lobes = iter([k for k, count in enumerate(counts) for _ in range(count)])
    waiting: list[int] = []
    for n, layer in enumerate(stack.layers):
        waiting.append(n)
        if isinstance(layer, Interface):
            found[next(lobes)] += waiting
            waiting = []
    return found


def _shown(stack: Stack, model: Model, says: str) -> Answer:
    """The lobes of a material that is no target, one for each interface, as far as they are those of one point."""
    nothing: Answer = {"target": None, "haze": [], "layers": [], "held": [], "says": says}
    try:
        read = stack_lobes(stack, 1.0, model=model)
    except InvalidInput:
        return nothing
    if not read.energy:
        return nothing
    energies = [np.clip(energy[:, 0], 0, None).tolist() for energy in read.energy]
    bases = ["conductor" if layer.opaque else "dielectric" for layer in stack.interfaces]
    target = Target([{"energy": energy, "base": base} for energy, base in zip(energies, bases)])
    for k, (alpha, rotation) in enumerate(zip(read.alpha, read.rotation)):
        target = target.with_roughness(k, Roughness(min(alpha[0, 0], 1.0), min(alpha[1, 0], 1.0), rotation))
    return {
        "target": described(target),
        "haze": haze(target, model),
        "layers": _layers(stack, [1] * len(energies)),
        "held": [{} for _ in energies],
        "says": says,
    }


# Lobes as a material -------------------------------------------------------------------------------------------------


def invert(body: Body) -> Answer:
    """The stack with the lobes of a target, or of the nearest on the way there; near `material` if that is given.

    With `read`, the lobes that the material has, a model without a closed form is read until the answer is near:
    `rough` says so.
    """
    wish = Target.from_dict(body.get("target")).of_lobes()
    model, material = reader_of(body, wish), body.get("material")
    near = held(material, wish, model) if material else None
    if near is None:
        if material and any(part.scatters for part in plain(Stack.from_dict(material))):
            return {"feasible": False, "why": "a medium that scatters stays where it is, and the interfaces around it"}
        return _fresh(wish, model)
    now = lobes_of(Stack.from_dict(material), near)
    found = nearest(near, wish, now, quick=body.get("read") is not None)
    answer = answered(found.stack, found.why, found.exact)
    return answer | ({"material": material} if found.part == 0 else {})


def answered(found: DraggedStack, snapped: str | None, exact: bool = True) -> Answer:
    """A stack as an answer: the requested one, or the nearest one, with the reason as `snapped`; `rough`, unless it is
    exact."""
    stack, rough = _under(found), found.rough or not exact
    target = found.now(found.target) if rough else seen(stack, found.target, found.model)
    return _answer(stack, target, found.model, snapped, found.scatters) | ({"rough": True} if rough else {})


def _answer(stack: Stack, target: Target, model: Model, snapped: str | None, scatters: bool = False) -> Answer:
    """A stack, and the lobes of a target that the stack has."""
    return {
        "feasible": True,
        "material": document(stack),
        "target": described(target),
        "haze": haze(target, model),
        "held": _held_back(target, scatters),
        "snapped": snapped,
    }


def _under(found: DraggedStack) -> Stack:
    """The material; where it has a diffuse base, that keeps its energy."""
    base = found.tail[-1] if found.tail else None
    if not isinstance(base, Diffuse) or isinstance(base.albedo, Varying) or found.diffuse is None:
        return found.stack
    return with_albedo(found.stack, np.array(found.diffuse), found.model)


def _fresh(wish: Target, model: Model) -> Answer:
    """A stack for a target by itself."""
    found = solution.in_closed_form(wish, model.without_tir)
    fresh = DraggedStack.of(found.stack, wish, model) if found else None
    if fresh is not None and (there := nearest(fresh, wish)).met:
        return answered(there.stack, None)
    return _searched(wish, model)


def _searched(wish: Target, model: Model) -> Answer:
    """A stack for a target by the whole search, or for the nearest target of its form that has one."""
    try:
        found, says = invert_stack(wish, model), None
    except Infeasible as error:
        possible = [way.target for way in error.directions if _form(way.target) == _form(wish)]
        possible.sort(key=lambda target: _more_fixed(target, wish))  # a medium is added where it is asked for
        if not possible:
            return {"feasible": False, "why": error.why}
        found, says = invert_stack(possible[0], model), error.why
    return _answer(found.stack, seen(found.stack, found.target, model), model, says)


def ways(body: Body) -> Answer:
    """Ways out of a target without a stack, the nearest first: `words`, and the `target` that has one, by a slow model
    with that stack as its `start`. None where the target has a stack, since only the present one was in its way."""
    wish = Target.from_dict(body.get("target")).of_lobes()
    try:
        found = invert_stack(wish, reader_of(body, wish))
    except Infeasible as error:
        return {"ways": [{"words": way.words, "target": _plain(way.target)} for way in error.directions]}
    return {"ways": [{"words": "another stack that has it", "target": _plain(wish, found.stack)}]}


def _plain(target: Target, start: Described | None = None) -> Answer:
    """A target as a body holds it, and the stack that has it."""
    start = start or target.start
    found = described(target.model_copy(update={"start": None}))
    return found | ({"start": document(start)} if start else {})


def _more_fixed(target: Target, wish: Target) -> bool:
    """Whether a target fixes something of a lobe of which the wish fixes nothing."""
    return any(asked.fixed == Fixed() != lobe.fixed for asked, lobe in zip(wish.lobes, target.lobes))


def _form(target: Target) -> list[tuple[int, str]]:
    return [(lobe.interfaces, lobe.base) for lobe in target.lobes]


# Coats, and the figures ----------------------------------------------------------------------------------------------


def coated(body: Body) -> Answer:
    """A material under a coat, with its appearance kept or not; its own lobe, and the others before and after."""
    stack, eta, alpha = stack_of(body, "coat"), body.get("eta", 1.5), body.get("alpha", 0.0)
    if len(stack.layers) > LOBES:
        raise InvalidInput(f"material: layers: may be {LOBES} at most below a coat, got {len(stack.layers)}")
    try:
        found = coat(stack, eta, alpha, keep_appearance=body.get("keep", False), model=model_of(body))
    except NoSolution as error:
        return {"error": str(error)}
    own = {"coat": found.own(), "lobes": found.change()}
    return {"material": document(found.stack), **own, "losses": list(found.losses)}


def targets(body: Body) -> Answer:
    """The targets of Bati et al. 2021, figures 15 to 22, with the stacks that have them."""
    return {"targets": _saved()}


@functools.cache
def _saved() -> list[Answer]:
    found = []
    for figure, lobes in FIGURES.items():
        if figure.split()[0] not in SAVED:
            continue
        title = f"Bati 2021, figure {figure}"
        answer = _fresh(Target(lobes, name=title), named(SAVED_MODEL))
        name = f"bati2021-{figure.replace(',', '').replace(' ', '-')}"
        found.append({"name": name, "title": title, "model": SAVED_MODEL, **answer})
    return found


#: What `service.VERBS` takes over.
VERBS: dict[str, Verb] = {
    "appearance": appearance,
    "invert": invert,
    "ways": ways,
    "coat": coated,
    "targets": targets,
}
