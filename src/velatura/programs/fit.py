"""Fit of a program's parameters to a material, and the loss that remains."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from velatura.errors import InvalidInput
from velatura.model import DEFAULT, Model, named
from velatura.model.context import in_silence
from velatura.optics.directions import directions
from velatura.programs import BAKED
from velatura.programs.from_stack import Array, Described
from velatura.programs.lost import lost
from velatura.programs.maps import Grid, Mapped, checked, mapped
from velatura.programs.parameters import UNIT, Values, complete
from velatura.programs.program import Bake, Carried, Fitted, Program, Range
from velatura.programs.sampled import Sampled
from velatura.programs.surface import WHITE, Surface
from velatura.programs.textures import carried, means
from velatura.stack import Brushing, Material, MaterialLike, Mix, Stack, load
from velatura.stack.schema import unknown

FITTED, AZIMUTHS = (1.0, 0.85, 0.6, 0.35), (0.0, 60.0, 120.0)  # cosines of incidence, and degrees where brushed
NODES, REPORTED = 350, 2**14  # for each direction: in the fit, and in the loss, which has the errors of both alike
COARSE = 2**12  # of each of several stacks
COMPARED = 2**19  # and beside walks, which have not
COSINES = (1.0, 0.7, 0.35)  # of the loss, as in `compare`
PRIOR = 0.03  # weight of a change, of the whole range, of a parameter that hardly counts
FIRST, STEPS = 3, 12  # of least squares: from every surface, and from where the best of them has led
NEAR = 2e-3
SLACK, SLIGHT = 0.1, 1e-3  # of the cost, by which it may grow for values that the layers say
OTHER = 0.2  # of the cost, by which a base of another kind, or no coat, has to be nearer
CHANGED = 0.01  # of a parameter without an image, or of its value above 1, that is said
STEP = 1e-4  # of finite differences, of a range

#: Programs by the name of the format.
TARGETS: dict[str, Program] = {name: baked.program() for name, baked in BAKED.items()}


def bake(
    material: MaterialLike,
    target: str,
    model: str | Model = DEFAULT,
    *,
    maps: int | None = None,
    progress: Callable[[int, int], None] = in_silence,
    **switches: str,
) -> Bake:
    """Fit a target's parameters to the light of a stack or a mixture; to that of its mean where it has textures.

    Args:
        maps: the greatest size of images, in texels, that parameters are baked into where the material has textures.
        progress: called with stacks fitted and their total, at most, while images are baked.

    Raises:
        InvalidInput: not a valid material, an unknown target, model or switch, an image that cannot be read, a target
            that takes no baked images.
        MissingTool: there are textures, and LLVM is missing or too old.
    """
    from threadpoolctl import threadpool_limits

    if target not in TARGETS:
        raise InvalidInput(unknown("target", target, TARGETS))
    chosen, material, program = named(model, **switches), load(material), TARGETS[target]
    if maps is not None and not program.maps:
        known = ", ".join(name for name, each in TARGETS.items() if each.maps)
        raise InvalidInput(f"maps: only for {known}, not for {target}")
    grid = None if maps is None else Grid.of(material, checked(maps))
    found = means(material)
    stacks = _stacks(material.replace(**found), chosen)
    described = Described.beside([(share, stack) for _, share, stack in stacks])
    with threadpool_limits(1, "blas"):  # matrices are so small that threads wait for each other
        # Of parts side by side the mean is like none, and most texels are like one
        as_layers = grid is not None and len(stacks) > 1
        fit = _fitted(program, described, _sampled(described, chosen), as_layers)
        over = None if grid is None else _over(grid, material, found, chosen, program, fit, progress)

    varying = dict(carried(material, found, program, fit.values))
    left = {name: f"{name}: {what}" for name, what in varying.items() if isinstance(what, str)}
    if over is None:
        values, loss = fit.values, _loss(program, fit.values, described, chosen, REPORTED)
        images = {name: image for name, image in varying.items() if isinstance(image, Carried)}
        lost, remarks = [*left.values()], tuple[str, ...]()
    else:
        values, loss = {**fit.values, **over.mapped.means()}, over.loss
        images = over.mapped.images(program, material.name)
        fields = {at.name for at, value in material.values() if isinstance(value, Brushing)}
        lost, remarks = [*over.unmoved, *(line for name, line in left.items() if name in fields)], over.remarks
    return Bake(
        target=target,
        title=program.title,
        name=material.name,
        model=chosen.name,
        values=values,
        cos_theta=COSINES,
        **loss,
        lost=(*_lost(stacks, program), *lost),
        images=images,
        thin=described.thin,
        maps=remarks,
    )


def distribution(made: Bake, material: MaterialLike, cos_theta: Sequence[float]) -> Array:
    """Energies (3, N, bins, bins) of light that a bake of a material reflects, over the projected disc."""
    material, chosen = load(material), named(made.model)
    stacks = _stacks(material.replace(**means(material)), chosen)
    described = Described.beside([(share, stack) for _, share, stack in stacks])
    shown = Sampled.of(described, chosen, directions(cos_theta), COMPARED)
    return shown.distribution(TARGETS[made.target].value(made.values, shown.pair, made.thin))


def _stacks(material: Stack | Mix, model: Model) -> list[tuple[str, float, Described]]:
    """The stacks of a material that have a share of the surface, with that share, and the name of their part."""
    each = zip(material.leaves(), material.weighted("is replaced by its mean"))
    return [
        (f"part {'.'.join(map(str, path))}: " if path else "", share, Described.of(Material.of(stack), model))
        for (path, _), (share, stack) in each
        if share > 0
    ]


def _lost(stacks: Sequence[tuple[str, float, Described]], program: Program) -> Iterator[str]:
    """A line for each property that is left out or replaced."""
    if len(stacks) > 1:
        yield "the parts become one surface, which has their shares of metal, coat and light that passes"
    for part, _, stack in stacks:
        yield from (part + line for line in lost(stack, program))


def _sampled(described: Described, model: Model) -> Sampled:
    """Light of a material, for fits."""
    azimuths = np.radians(AZIMUTHS if described.brushed else AZIMUTHS[:1])
    cosines, turns = (x.ravel() for x in np.meshgrid(FITTED, azimuths))
    return Sampled.of(described, model, directions(cosines, turns), NODES)


def _loss(program: Program, values: Values, described: Described, model: Model, nodes: int) -> dict[str, Array]:
    """The loss of values, by the names that `Bake` has for its parts."""
    shown = Sampled.of(described, model, directions(COSINES), nodes)
    light = program.value(values, shown.pair, described.thin)
    apart = np.abs((shown.distribution(light) - shown.distribution(shown.value)).mean(axis=0)).sum(axis=(1, 2))
    total = np.maximum(shown.energy(shown.value).mean(axis=0), 1e-12)
    return {
        "total_variation": 0.5 * apart / total,
        "albedo": shown.energy(shown.value),
        "baked_albedo": shown.energy(light),
        "passed": shown.energy(shown.value, up=False),
        "baked_passed": shown.energy(light, up=False),
    }


# Maps -----------------------------------------------------------------------------------------------------------------


class _Over(NamedTuple):
    """Parameters over a surface, the mean loss there, remarks about both, and what takes no image though it varies."""

    mapped: Mapped
    loss: dict[str, Array]
    remarks: tuple[str, ...]
    unmoved: list[str]


def _over(
    grid: Grid,
    material: Stack | Mix,
    found: Mapping[str, Any],
    model: Model,
    program: Program,
    fit: _Fit,
    progress: Callable[[int, int], None],
) -> _Over:
    """Fits of stacks of a grid, near that of the mean stack, whose values stay where a program takes no image."""
    losses: list[dict[str, Array]] = []
    unmoved: dict[str, str] = {}

    def fitted(row: Mapping[str, Any]) -> Fitted:
        stacks = _stacks(material.replace(**{**found, **row}), model)
        described = Described.beside([(share, stack) for _, share, stack in stacks])
        values, left = _near(program, fit, described, _sampled(described, model))
        losses.append(_loss(program, values, described, model, COARSE))
        unmoved.update({name: f"{name}: varies, and takes no image: that of the mean stands for it" for name in left})
        return values

    parameters = tuple(each for each in program.parameters if each.name in program.maps)
    over = mapped(grid, parameters, fitted, progress)
    share = grid.shares(over.nodes)
    loss = {name: np.tensordot(share, [each[name] for each in losses], 1) for name in losses[0]}
    worst = max(float(each["total_variation"].mean()) for each in losses)
    off = max(float(np.abs(each["baked_albedo"] - each["albedo"]).max()) for each in losses)
    height, width = grid.shape
    fits = f"{len(over.nodes)} of {len(grid.values)}" if len(over.nodes) < len(grid.values) else f"{len(over.nodes)}"
    remarks = [
        f"baked images: {width} x {height} texels, by fits of {fits} stacks that differ; the loss is their mean",
        f"at the worst of these: total variation {100 * worst:.1f} %, albedo {off:.3f} off",
    ]
    if over.missed:
        remarks.append(f"between these: interpolated, to {over.missed:.3f} of a parameter's greatest value in the mean")
    return _Over(over, loss, tuple(remarks), list(unmoved.values()))


def _near(program: Program, fit: _Fit, described: Described, sampled: Sampled) -> tuple[Fitted, list[str]]:
    """Values of a stack near another one, whose fit is known; and parameters that take no image, but should change.

    The fit's values are moved by what the surface's own parameters differ; those of these that were fitted descend
    again. All others stay, so that parameters that do the same change in one way.
    """
    kind = _kind(fit.surface)
    surface = min(described.surfaces, key=lambda each: sum(a != b for a, b in zip(_kind(each), kind)))
    before, after = (complete(program.parameters, program.start(each)) for each in (fit.surface, surface))
    start: Fitted = dict(fit.values)
    left = []
    ranges: dict[str, Range] = {}
    for each in program.parameters:
        name = each.name
        of_dielectric = each.fit is not None and each.fit[0] == "index"
        if before[name] == after[name] or (of_dielectric and surface.metalness == 1):
            continue
        moved = np.subtract(after[name], before[name])
        if name not in program.maps:
            if np.abs(moved).max() > CHANGED * max(float(np.abs(before[name]).max()), 1.0):
                left.append(name)
            continue
        value = np.clip(np.asarray(fit.values[name]) + moved, each.low, each.high)
        start[name] = tuple(value.tolist()) if each.is_colour else float(value)
        if name in fit.ranges:
            ranges[name] = fit.ranges[name]
    if not ranges:
        return start, left
    return _descended(program, described.thin, sampled, ranges, start, start, STEPS)[1], left


def _kind(surface: Surface) -> tuple[bool, bool, bool]:
    """Whether a surface has a coat, one with a colour, and a film."""
    return surface.coated, surface.coated and surface.coat.colour != WHITE, surface.film is not None


# Fits -----------------------------------------------------------------------------------------------------------------


class _Fit(NamedTuple):
    """Values, the surface that the descent to them began at, and the ranges of those that were fitted."""

    values: Fitted
    surface: Surface
    ranges: dict[str, Range]


@dataclass(frozen=True)
class _Space:
    """The numbers that are fitted, one for each component of a colour, each between 0 and 1 of its range."""

    like: Fitted
    ranges: dict[str, Range]

    def numbers(self, values: Values) -> Array:
        found: list[float] = []
        for name, (low, high) in self.ranges.items():
            each = np.atleast_1d(np.asarray(values[name], float))
            found.extend(np.clip((each - low) / (high - low), 0, 1))
        return np.array(found)

    def values(self, numbers: Array) -> Fitted:
        each = iter(numbers)
        changed: Fitted = {}
        for name, (low, high) in self.ranges.items():
            if isinstance(self.like[name], tuple):
                r, g, b = (low + (high - low) * float(next(each)) for _ in range(3))
                changed[name] = (r, g, b)
            else:
                changed[name] = low + (high - low) * float(next(each))
        return {**self.like, **changed}

    def rounded(self, numbers: Array) -> Fitted:
        """Values as files have them: six digits, and a share that is nearly 0 or 1 is just that."""
        shares = np.repeat(
            [pair == UNIT for pair in self.ranges.values()], [np.size(self.like[n]) for n in self.ranges]
        )
        numbers = np.where(shares & (numbers < NEAR), 0, np.where(shares & (numbers > 1 - NEAR), 1, numbers))
        plain = {
            name: np.array([float(f"{x:.6g}") for x in np.atleast_1d(value)])
            for name, value in self.values(numbers).items()
        }
        return {name: tuple(value.tolist()) if len(value) > 1 else float(value[0]) for name, value in plain.items()}


def _descended(
    program: Program,
    thin: bool,
    sampled: Sampled,
    ranges: dict[str, Range],
    first: Fitted,
    start: Fitted,
    steps: int,
) -> tuple[float, Fitted]:
    """Cost and values at the end of a descent by least squares, near the first values where nothing else counts."""
    from scipy.optimize import least_squares

    space = _Space(start, ranges)
    origin = space.numbers(first)

    def residuals(numbers: Array) -> Array:
        light = program.value(space.values(numbers), sampled.pair, thin)
        return np.concatenate([sampled.residuals(light), PRIOR * (numbers - origin)])

    inside = np.clip(space.numbers(start), 1e-3, 1 - 1e-3)
    found = least_squares(residuals, inside, bounds=(0, 1), diff_step=STEP, max_nfev=steps, tr_solver="lsmr")
    return float(found.cost), space.rounded(found.x)


def _fitted(program: Program, described: Described, sampled: Sampled, as_layers: bool = False) -> _Fit:
    """The closest values of descents from every surface that the stack may be seen as.

    Parts stay those of the stack: coat, film, metal and clear base have the weights of a surface, and one without the
    coat, or with a base of another kind, has to be much nearer. All but colours and roughness stay as a surface has
    them where that costs little, or where all is to stay `as_layers` say.
    """
    has = {
        **dict.fromkeys(("colour", "index", "diffuse"), True),
        "clear" if described.below is not None else "metal": described.mixed,
        "coat": described.coated,
        "tint": described.tinted,
        "rough": described.blurred,
        "brushed": described.blurred and bool(described.brushed),
        **dict.fromkeys(("film", "thickness"), described.film),
    }
    ranges = {name: pair for kind, there in has.items() if there for name, pair in program.fitted(kind).items()}
    starts = [complete(program.parameters, program.start(surface)) for surface in described.surfaces]
    kinds = [(surface.metalness, surface.coated) for surface in described.surfaces]
    other = [OTHER * (kind != kinds[0] and not described.mixed) for kind in kinds]
    few = {
        name: pair
        for name, pair in ranges.items()
        if isinstance(starts[0][name], tuple) or (name in program.fitted("rough") and starts[0][name])
    }

    descended = partial(_descended, program, described.thin, sampled)

    def nearest(ends: list[tuple[float, Fitted]]) -> int:
        return int(np.argmin([cost + more for (cost, _), more in zip(ends, other)]))

    ends = [descended(few, start, start, STEPS) for start in starts]
    simple = nearest(ends)
    plain_cost, plain = ends[simple]
    as_plain = _Fit(plain, described.surfaces[simple], few)
    if as_layers:
        return as_plain
    ends = [descended(ranges, start, start, FIRST) for start in starts]
    best = nearest(ends)
    cost, found = descended(ranges, starts[best], ends[best][1], STEPS)
    if plain_cost < (1 + SLACK) * cost + SLIGHT:
        return as_plain
    return _Fit(found, described.surfaces[best], ranges)
