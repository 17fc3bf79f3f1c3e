"""A coat on a material, with or without a change of the lobes of the material (Bati et al. 2021, figure 14)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from velatura.errors import InvalidInput, NoSolution
from velatura.inverse.lobes import interface
from velatura.inverse.lobes.equivalence import dislike
from velatura.inverse.lobes.interface import DENSER, RARER, Choice, conductor_tint
from velatura.inverse.lobes.partial_stack import NORMAL, Above, Array, Layers, Mask, join, written
from velatura.inverse.lobes.roots import bisect
from velatura.inverse.lobes.stacks import Partial, pruned
from velatura.inverse.local import surrogate
from velatura.inverse.reasons import REASONS
from velatura.model import DEFAULT, Model, named, variance_kind
from velatura.model.lobe_statistics import StackLobes, with_axes_named
from velatura.model.papers.adding import lobes
from velatura.model.papers.prepare import prepare
from velatura.model.registry import stack_lobes
from velatura.model.variance import Isotropic, PerAxis, Roughness, Variance
from velatura.results import Result, Table, cell
from velatura.stack import (
    Diffuse,
    Film,
    Interface,
    InterfaceValues,
    Layer,
    Material,
    MaterialLike,
    MediumValues,
    Stack,
    single,
)

KEEP = 64  # partial stacks that are followed
SMALL = 0.01  # energy or variance that is added to those of the goal, for units in which they are missed
MISSED = 1e-5  # what may be missing
KEPT, SEEN = ("energy", "alpha"), 1e-4  # of a lobe, and what is named if it is missed
FOLLOWED, GRID, REFINED = 2, 16, 3  # those that the nearest lobe is sought for, steps on either side, and rounds
HALVED = 10  # times, a step of the width
LEAST, FARTHEST = 1e-3, 3.0  # by which its energy, as a logarithm, and its variance may differ

Kept = tuple[tuple[Layer, ...], list[str]]  # layers below a coat, and what these cannot keep


@dataclass(frozen=True, repr=False)
class Coated(Result):
    """A coated stack, and the lobes at normal incidence without and with the coat: those of the stack come last.

    model: by which these are the lobes. diffuse: energy (3,) that a diffuse base scatters back up, without and with the
    coat; None without one. losses: of lobes that were to be kept, and could not be: the layer, and the reason.
    """

    stack: Stack
    before: StackLobes
    after: StackLobes
    model: Model
    diffuse: tuple[Array, Array] | None
    losses: tuple[str, ...] = ()

    def own(self) -> dict[str, list[float]]:
        """Energy (rgb) and roughness (two axes) of the coat's own lobe, which is new."""
        return {"energy": self.after.energy[0][:, 0].tolist(), "alpha": self.after.alpha[0][..., 0].tolist()}

    def change(self) -> list[dict[str, list[float]]]:
        """Energy (rgb) and roughness (two axes) for every interface of the bare material, before and after."""
        rows = []
        for k, energy in enumerate(self.before.energy):
            rows.append(
                {
                    "energy_before": energy[:, 0].tolist(),
                    "energy_after": self.after.energy[k + 1][:, 0].tolist(),
                    "alpha_before": self.before.alpha[k][..., 0].tolist(),
                    "alpha_after": self.after.alpha[k + 1][..., 0].tolist(),
                }
            )
        return rows

    def change_of_base(self) -> dict[str, list[float]]:
        """Energy (rgb) that a diffuse base scatters back up, before and after; nothing without one."""
        return dict(zip(("energy_before", "energy_after"), (x.tolist() for x in self.diffuse or ())))

    def as_tables(self) -> list[Table]:
        """A row for the coat, one per interface of the bare material, and one for a diffuse base."""
        own = self.own()
        rows: list[tuple[str, ...]] = [("coat", "", cell(own["energy"]), "", cell(own["alpha"]))]
        rows += [(str(n), *(cell(row[key]) for key in row)) for n, row in enumerate(self.change(), 1)]
        rows += [("diffuse", *map(cell, self.change_of_base().values()))] if self.diffuse else []
        title = f"At normal incidence, without and with the coat ({self.model.name})"
        right = ("energy", "with coat", "alpha", "with coat")
        return [Table(title, ("lobe", *right), rows, right)]


def coat(
    stack: MaterialLike,
    eta: float = 1.5,
    alpha: float = 0.0,
    keep_appearance: bool = False,
    eta_max: float = 4.0,
    model: str | Model = DEFAULT,
    **switches: str,
) -> Coated:
    """A material under a dielectric coat.

    Args:
        stack: a material (a stack, a file, or a preset's name).
        eta, alpha: absolute index and roughness of the coat.
        keep_appearance: change the material below, so that its lobes at normal incidence keep energy and variance, and
            a diffuse base its energy, unless it would have to be brighter than white. A lobe that cannot be kept comes
            as near as it can, and is named in `losses`.
        eta_max: largest index that a dielectric may be given.

    Raises:
        InvalidInput: not a valid material, a texture, an index or a roughness outside its range, an unknown model or
            switch.
        NoSolution: no material keeps any of the appearance; the message names the layer and the constraint.
    """
    chosen, stack = named(model, **switches), single(stack, "the inverse")
    top = Interface(eta=eta, alpha=alpha)
    losses: list[str] = []
    if keep_appearance:
        below, losses = _kept(
            stack, Layers("dielectric", eta, None, Roughness(alpha, alpha, 0.0), 0.0), eta_max, chosen
        )
    else:
        below = stack.layers
        if not below[0].surface:
            raise InvalidInput(f"layer 0 ({below[0].kind}): is above all interfaces; a coat goes below it, not on it")
    coated = stack.with_layers([top, *below], f"{stack.name or 'material'}, coated")
    before, after = (stack_lobes(one, 1.0, model=chosen) for one in (stack, coated))
    diffuse = None
    if stack.base:
        wanted = scattered(stack, chosen)
        if keep_appearance:
            coated = with_albedo(coated, wanted, chosen)
        diffuse = wanted, scattered(coated, chosen)
    found = Coated(coated, before, after, chosen, diffuse, tuple(losses))
    return replace(found, losses=(*losses, *_missed(stack, found))) if keep_appearance else found


def _missed(stack: Stack, found: Coated) -> list[str]:
    """Descriptions of lobes that are not kept, of those for which no loss stands yet."""
    named, missed, lobes = " ".join(found.losses), list[str](), iter(found.change())
    for n, layer in enumerate(stack.layers):
        where = f"layer {n} ({type(layer).__name__.lower()})"
        by: dict[str, Array] = {}
        if isinstance(layer, Interface):
            row = next(lobes)
            by = {key: np.subtract(np.sort(row[f"{key}_after"]), np.sort(row[f"{key}_before"])) for key in KEPT}
        elif isinstance(layer, Diffuse) and found.diffuse:
            by = {"energy": found.diffuse[1] - found.diffuse[0]}
        changes = [f"{key} changes by {x:.2g}" for key, dx in by.items() if (x := np.abs(dx).max()) > SEEN]
        if changes and where not in named:
            missed.append(f"{where}: cannot keep all of its appearance under the coat: {' and '.join(changes)}")
    return missed


def _kept(stack: Stack, top: Layers, eta_max: float, model: Model) -> Kept:
    """Layers whose lobes below a coat equal those of the bare stack, or come near them, and which do not equal them."""
    material = Material.of(stack)
    kind = variance_kind(material)
    above, _ = Above.nothing(model, stack.exterior, kind).below(top)

    def solver_reads(whole: Material) -> list[tuple[Array, Variance]]:
        found, _ = lobes(prepare(whole, above.model, kind), NORMAL)
        return [(np.broadcast_to(lobe.energy, (3, 1)), above.variance_of(lobe.roughness)) for lobe in found]

    wanted = solver_reads(material)
    if (model.closed_form and not any(material.films)) or not wanted:
        return _solved(stack, above, eta_max, wanted)

    # Ask for other lobes, until the model itself reads those of the bare stack
    coating, refused = top.written(0), list[tuple[Array, Kept]]()

    def near(request: Array) -> Kept | None:
        try:
            return _solved(stack, above, eta_max, [_lobe(numbers, kind) for numbers in request.reshape(-1, 6)])
        except NoSolution:
            return None

    def ask(request: Array) -> Kept | None:
        found = near(request)
        if found is None or not found[1]:
            return found
        refused.append((request, found))
        return None

    def read(found: Kept) -> Array:
        return _numbers(stack_lobes(stack.with_layers([*coating, *found[0]]), 1.0, model=model))[6 * len(coating) :]

    goal, first = _numbers(stack_lobes(stack, 1.0, model=model)), np.array([_entries(*lobe) for lobe in wanted]).ravel()
    scale = np.abs(goal) + SMALL
    kept = surrogate.met(ask, read, first, goal, scale)
    if kept is not None and (not refused or np.abs(read(kept) - goal).max() < MISSED):
        return kept
    if not refused:
        return _solved(stack, above, eta_max, wanted)  # fails, with the reason

    # Where it can only come near a request, that loss stays, and the rest is met
    request, nearest = refused[-1]
    solved = solver_reads(Material.of(stack.with_layers([*coating, *nearest[0]])))[len(coating) :]
    lost = np.abs(np.ravel([_entries(*lobe) for lobe in solved]) - request) > LEAST * scale
    found = surrogate.met(near, read, request, goal, scale, ~lost) or nearest
    return found[0], found[1] or nearest[1]


def _numbers(found: StackLobes) -> Array:
    """Energy (3,) and covariance (3,) of one lobe after the other."""
    return np.concatenate([np.r_[e[:, 0], s[:, 0]] for e, s in zip(found.energy, found.covariance)])


def _entries(energy: Array, variance: Variance) -> Array:
    return np.r_[energy[:, 0], [float(np.ravel(x)[0]) for x in variance.matrix()]]


def _lobe(numbers: Array, kind: type[Variance]) -> tuple[Array, Variance]:
    """Energy (3, 1) and variance of a lobe from its numbers; none is negative."""
    xx, xy, yy = (np.atleast_1d(x) for x in (max(numbers[3], 0.0), numbers[4], max(numbers[5], 0.0)))
    entries = {Isotropic: (0.5 * (xx + yy),), PerAxis: (xx, yy)}.get(kind, (xx, xy, yy))
    return numbers[:3, None], kind(*entries)


def _solved(stack: Stack, above: Above, eta_max: float, wanted: Sequence[tuple[Array, Variance]]) -> Kept:
    """Layers with lobes of these energies and variances below a coat, or near them, and which are not these."""
    material = Material.of(stack)
    # Solve for its interfaces, from the top
    paths, remaining, losses = Partial(above, (), np.zeros(1)), iter(wanted), list[str]()
    for n, (layer, values) in enumerate(zip(stack.layers, material.layers)):
        where = f"layer {n} ({type(layer).__name__.lower()})"
        if isinstance(values, MediumValues):
            if np.any(values.sigma_s > 0):
                raise NoSolution(f"{where}: scatters light; an appearance is kept of media that only absorb")
        elif isinstance(layer, Interface):
            (energy, variance), own = next(remaining), _choices(material, n, eta_max, layer.films)
            tried = _extended(paths, energy, variance, own)
            kept = pruned(tried, 1, KEEP)
            if not len(kept.cost):
                reason = _reason(tried, eta_max)
                near = _nearest(paths, energy, variance, own)
                if near is None:
                    raise NoSolution(f"{where}: cannot keep its appearance under the coat: {reason}")
                kept = near
                losses.append(f"{where}: cannot keep all of its appearance under the coat: {reason}")
            paths = kept
    best = paths.take(np.array([np.argmin(paths.cost)]))
    # The axes keep their names: brushing that is turned by 30 degrees stays so
    axes = [np.radians(values.rotation) for values in material.interfaces]
    named_alike = [replace(x, roughness=with_axes_named(x.roughness, axis)) for x, axis in zip(best.layers, axes)]
    solved = [layer for layers in named_alike for layer in layers.written(0)]
    return (*solved, *([stack.base] if stack.base else [])), losses


def _extended(paths: Partial, energy: Array, variance: Variance, choices: Sequence[Choice]) -> Partial:
    """The partial stacks with an interface that gives a lobe, by all choices, feasible or not."""
    found = []
    for rank, choice in enumerate(choices):
        part = interface.solve(paths.above, energy, variance, choice)
        cost = paths.cost + rank + dislike(paths.above.eta, part.layers)
        found.append(Partial(part.below, (*paths.layers, part.layers), cost))
    return join(found, [len(part.cost) for part in found])


def _nearest(paths: Partial, energy: Array, variance: Variance, choices: Sequence[Choice]) -> Partial | None:
    """The partial stack with the nearest lobe that any can have, of other energy or wider; None if none has any.

    Bright channels get darker, or dark ones brighter, and all axes equally wider, each by as little as possible.
    """
    if choices[0].kind == "mirror":  # it may lose energy; nothing absorbs above it
        choices = [*choices, Choice("conductor")]
    some = paths.take(np.argsort(paths.cost, kind="stable")[:FOLLOWED])
    own, s = np.maximum(energy, interface.ENERGY_MIN), float(np.mean(variance.matrix()[0])) + LEAST
    steps = np.geomspace(LEAST, FARTHEST, GRID)
    exponents, widths = np.r_[-steps[::-1], 0.0, steps], np.r_[0.0, steps]
    count = len(some.cost)

    def tried(x: Array, y: Array) -> tuple[Partial, Array]:
        """Stacks with other lobes, below all stacks and by all choices, and how far these lobes are, (N,)."""
        x, y, path = np.repeat(x, count), np.repeat(y, count), np.tile(np.arange(count), len(x))
        darker, brighter = own.max() * np.exp(np.minimum(x, 0)), own.min() * np.exp(np.maximum(x, 0))
        wished = np.where(x < 0, np.minimum(own, darker), np.maximum(own, brighter))
        change = np.sum(np.abs(np.log(wished / own)), axis=0) + np.log1p(y / s)
        found = _extended(some.take(path), wished, variance + type(variance).uniform(y), choices)
        return found, np.where(found.layers[-1].feasible, np.tile(change, len(choices)), np.inf)

    def possible(x: Array, y: Array) -> Mask:
        return np.asarray(np.isfinite(tried(x, y)[1]).reshape(len(choices), len(x), count).any(axis=(0, 2)))

    best, near = np.inf, None
    for _ in range(REFINED):
        # Find the least width that is possible with each energy
        x, y = (each.ravel() for each in np.meshgrid(exponents, widths, indexing="ij"))
        ok = possible(x, y).reshape(len(exponents), len(widths))
        first, x = np.argmax(ok, axis=1)[ok.any(axis=1)], exponents[ok.any(axis=1)]
        if not len(x):
            break
        y = bisect(partial(possible, x), widths[first], widths[np.maximum(first - 1, 0)], HALVED)
        found, cost = tried(x, y)
        n = int(np.argmin(cost))
        if cost[n] < best:
            best, near = cost[n], found.take(np.array([n]))
        # Look again between the neighbours of the best energy
        exponents = _about(exponents, x[n // count % len(x)])
    return near


def _about(axis: Array, value: float) -> Array:
    """Points between the neighbours of a point of an axis."""
    n = int(np.argmin(np.abs(axis - value)))
    return np.unique(np.r_[value, np.linspace(axis[max(n - 1, 0)], axis[min(n + 1, len(axis) - 1)], GRID)])


def scattered(stack: Stack, model: Model) -> Array:
    """Energy of a diffuse base at normal incidence, (3,)."""
    return _scattered(stack, model)[:, 0]


def _scattered(stack: Stack, model: Model, *albedos: float) -> Array:
    """Energy of a diffuse base at normal incidence, its own or of N albedos, (3, N)."""
    assert stack.base

    def reflected(base: Diffuse) -> Array:
        found = stack_lobes(stack.with_layers([*stack.layers[:-1], base]), 1.0, model=model)
        return np.sum([found.remainder, *found.energy], axis=0)

    bases = [Diffuse(albedo=albedo) for albedo in albedos] or [stack.base]
    return np.hstack([reflected(base) for base in bases]) - reflected(Diffuse(albedo=0.0))


def with_albedo(stack: Stack, wanted: Array, model: Model) -> Stack:
    """The stack with the albedo of its base that has this energy, or the nearest to it.

    The energy of an albedo a is p a / (1 - q a), with the transmitted share p and the share q that returns to the base.
    """
    half, white = _scattered(stack, model, 0.5, 1.0).T
    q = (white - 2 * half) / (white - half)
    p = white * (1 - q)
    albedo = np.clip(wanted / (p + q * wanted), 0, 1)
    return stack.with_layers([*stack.layers[:-1], Diffuse(albedo=written(albedo))])


def _choices(material: Material, n: int, eta_max: float, films: tuple[Film, ...] = ()) -> Sequence[Choice]:
    """Choices for a layer and its films, its present state first: the same index, one on the same side, one on the
    other side."""
    layer = material.layers[n]
    assert isinstance(layer, InterfaceValues)
    if layer.kind == "mirror":
        return [Choice("mirror", tau=0.0)]
    eta, eta_1 = layer.eta, _index_above(material, n)
    if layer.kind == "conductor":
        return [Choice("conductor", tint=conductor_tint(eta / eta_1, layer.k / eta_1), films=films)]
    sides = (DENSER, RARER) if np.mean(eta) >= np.mean(eta_1) else (RARER, DENSER)
    bounded = max(eta_max, float(np.max(eta)))
    same = Choice(eta=eta, eta_max=bounded, films=films)
    return [same, *(Choice(side=side, eta_max=bounded, films=films) for side in sides)]


def _index_above(material: Material, n: int) -> Array:
    above = [layer.eta for layer in material.layers[:n] if isinstance(layer, InterfaceValues)]
    return above[-1] if above else np.full((1, 1), material.exterior)


def _reason(tried: Partial, eta_max: float) -> str:
    """The constraint that the best attempt breaks most."""
    margins = tried.layers[-1].margins
    if tried.layers[-1].kind == "mirror" and np.all(margins["blur"] >= 0):
        return REASONS["bright"]
    names, values = list(margins), np.array(np.broadcast_arrays(*margins.values()))
    best = values[:, np.argmax(np.minimum(values, 0).sum(axis=0))]
    return REASONS[names[int(np.argmin(best))]].format(eta_max=eta_max)
