"""Fit of a program's parameters to a material, and the loss that remains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from velatura.errors import InvalidInput
from velatura.model import DEFAULT, Model, named
from velatura.optics.directions import directions
from velatura.programs import BAKED
from velatura.programs.from_stack import Array, Described
from velatura.programs.lost import lost
from velatura.programs.parameters import UNIT, Values, complete
from velatura.programs.program import Bake, Carried, Fitted, Program, Range
from velatura.programs.sampled import Sampled
from velatura.programs.textures import carried, means
from velatura.stack import Material, MaterialLike, Mix, Stack, load
from velatura.stack.schema import unknown

FITTED, AZIMUTHS = (1.0, 0.85, 0.6, 0.35), (0.0, 60.0, 120.0)  # cosines of incidence, and degrees where brushed
NODES, REPORTED = 350, 2**14  # for each direction: in the fit, and in the loss, which has the errors of both alike
COMPARED = 2**19  # and beside walks, which have not
COSINES = (1.0, 0.7, 0.35)  # of the loss, as in `compare`
PRIOR = 0.03  # weight of a change, of the whole range, of a parameter that hardly counts
FIRST, STEPS = 3, 12  # of least squares: from every surface, and from where the best of them has led
NEAR = 2e-3
SLACK, SLIGHT = 0.1, 1e-3  # of the cost, by which it may grow for values that the layers say
OTHER = 0.2  # of the cost, by which a base of another kind, or no coat, has to be nearer
STEP = 1e-4  # of finite differences, of a range

#: Programs by the name of the format.
TARGETS: dict[str, Program] = {name: baked.program() for name, baked in BAKED.items()}


def bake(material: MaterialLike, target: str, model: str | Model = DEFAULT, **switches: str) -> Bake:
    """Fit a target's parameters to the light of a stack or a mixture; to that of its mean where it has textures.

    Raises:
        InvalidInput: not a valid material, an unknown target, model or switch, an image that cannot be read.
        MissingTool: there are textures, and LLVM is missing or too old.
    """
    from threadpoolctl import threadpool_limits

    if target not in TARGETS:
        raise InvalidInput(unknown("target", target, TARGETS))
    chosen, material, program = named(model, **switches), load(material), TARGETS[target]
    found = means(material)
    stacks = _stacks(material.replace(**found), chosen)
    described = Described.beside([(share, stack) for _, share, stack in stacks])
    azimuths = np.radians(AZIMUTHS if described.brushed else AZIMUTHS[:1])
    cosines, turns = (x.ravel() for x in np.meshgrid(FITTED, azimuths))
    sampled = Sampled.of(described, chosen, directions(cosines, turns), NODES)
    with threadpool_limits(1, "blas"):  # matrices are so small that threads wait for each other
        values = _fitted(program, described, sampled)

    varying = dict(carried(material, found, program, values))
    left = [f"{name}: {what}" for name, what in varying.items() if isinstance(what, str)]
    images = {name: image for name, image in varying.items() if isinstance(image, Carried)}

    shown = Sampled.of(described, chosen, directions(COSINES), REPORTED)
    light = program.value(values, shown.pair, described.thin)
    apart = np.abs((shown.distribution(light) - shown.distribution(shown.value)).mean(axis=0)).sum(axis=(1, 2))
    total = np.maximum(shown.energy(shown.value).mean(axis=0), 1e-12)
    return Bake(
        target=target,
        title=program.title,
        name=material.name,
        model=chosen.name,
        values=values,
        cos_theta=COSINES,
        total_variation=0.5 * apart / total,
        albedo=shown.energy(shown.value),
        baked_albedo=shown.energy(light),
        passed=shown.energy(shown.value, up=False),
        baked_passed=shown.energy(light, up=False),
        lost=(*_lost(stacks, program), *left),
        images=images,
        thin=described.thin,
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


def _fitted(program: Program, described: Described, sampled: Sampled) -> Fitted:
    """The closest values of descents from every surface that the stack may be seen as.

    Parts stay those of the stack: coat, film, metal and clear base have the weights of a surface, and one without the
    coat, or with a base of another kind, has to be much nearer. All but colours and roughness stay as a surface has
    them where that costs little.
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

    def descended(ranges: dict[str, Range], first: Fitted, start: Fitted, steps: int) -> tuple[float, Fitted]:
        """Cost and values at the end of a descent by least squares, near the first values where nothing else counts."""
        from scipy.optimize import least_squares

        space = _Space(start, ranges)
        origin = space.numbers(first)

        def residuals(numbers: Array) -> Array:
            light = program.value(space.values(numbers), sampled.pair, described.thin)
            return np.concatenate([sampled.residuals(light), PRIOR * (numbers - origin)])

        inside = np.clip(space.numbers(start), 1e-3, 1 - 1e-3)
        found = least_squares(residuals, inside, bounds=(0, 1), diff_step=STEP, max_nfev=steps, tr_solver="lsmr")
        return float(found.cost), space.rounded(found.x)

    def nearest(ends: list[tuple[float, Fitted]]) -> int:
        return int(np.argmin([cost + more for (cost, _), more in zip(ends, other)]))

    ends = [descended(ranges, start, start, FIRST) for start in starts]
    best = nearest(ends)
    cost, found = descended(ranges, starts[best], ends[best][1], STEPS)
    ends = [descended(few, start, start, STEPS) for start in starts]
    plain_cost, plain = ends[nearest(ends)]
    return plain if plain_cost < (1 + SLACK) * cost + SLIGHT else found
