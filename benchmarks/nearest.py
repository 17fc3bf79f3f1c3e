"""Whether a wish from a present material gets one answer, the nearest, and how long that takes.

    python benchmarks/nearest.py [--wishes 60] [--beyond] [--brute 2000] [--model velatura] [--seed 0]

Random stacks of the inverse are wished to have a lobe of other energy or blur; with `--beyond` of much more energy, or
much other blur, and those that are met do not count. Answers at rest and by `invert` must agree in energies and
roughnesses, and the bound under the hand must lie within 2 % of the way of that at rest. Beside each answer at rest
that does not meet its wish, stacks are drawn within the bounds, by their coordinates: none that lies near the line to
the wish may lead to one on the line that is nearer by 2 %. A model that reads one stack at a time reads few of them:
those that the nearest model in closed form, scaled to read the answer alike, sees within `WIDER` times those margins,
and of these the `READ` furthest. Times are of the processor. Every `SAID` wishes a line counts those so far.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Iterator
from itertools import islice

import numpy as np
from inverse import physical_targets
from rows import counted, parsed, row

from velatura.inverse import Infeasible, Target, invert, invert_stack
from velatura.inverse.local.coordinates import SLACK, Point, Space, units
from velatura.inverse.local.dragged import DraggedStack
from velatura.inverse.local.line import Line
from velatura.inverse.nearest import READINGS, Nearest, nearest
from velatura.model import DEFAULT, Model, named
from velatura.model.variance import Roughness

SAME, NEARER, BESIDE, ON_LINE = 2e-3, 0.02, 0.01, 1e-3  # differences of lobes, shares of the way, and of readings
FOLLOWED = 3  # stacks near the line that lead on, at most
WIDER, READ = 4.0, 40  # of margins for stacks that are known roughly, and the most of these that a slow model reads
CHANGE, BEYOND = 1.5, 3.0  # of wishes: the most, as a logarithm
BRIGHTEST, ROUGHEST = 0.95, 0.9
SPREAD = (1e-3, 1.0)  # of stacks that are drawn, in units of coordinates
SAID = 10


def wishes(model: Model, seed: int, beyond: bool = False) -> Iterator[tuple[DraggedStack, Target]]:
    """Present stacks, and their lobes with one changed."""
    rng = np.random.default_rng(seed)
    for target in physical_targets(10**9, model, seed):
        k, of_energy, change = int(rng.integers(len(target.lobes))), rng.random() < 0.6, rng.uniform(-1, 1)
        if beyond:
            change = BEYOND * (abs(change) if of_energy else change) / CHANGE
        lobe, scale = target.lobes[k], float(np.exp(CHANGE * change))
        if of_energy:
            wish = target.with_energy(k, tuple(np.minimum(scale * np.array(lobe.colour), BRIGHTEST).tolist()))
        else:
            u, v = np.minimum(scale * np.array(lobe.axes[:2]), ROUGHEST)
            wish = target.with_roughness(k, Roughness(u, v, lobe.axes.rotation))
        found = invert.search(target, model)
        present = DraggedStack.of(found.stack, wish, model) if found else None
        if present is not None:
            yield present, wish


def answered(
    model: Model, seed: int, beyond: bool, seconds: dict[str, list[float]]
) -> Iterator[tuple[DraggedStack, Target, dict[str, Nearest]]]:
    """Wishes with their answers at rest and under the hand, whose seconds are noted; those beyond that are met are
    left out."""
    for present, wish in wishes(model, seed, beyond):
        answers, taken = dict[str, Nearest](), dict[str, float]()
        for way in seconds:
            start = time.process_time()
            answers[way] = nearest(present.at(present.point.x), wish, quick=way == "hand")
            taken[way] = time.process_time() - start
            if beyond and answers["rest"].met:
                break
        else:
            for way, each in seconds.items():
                each.append(taken[way])
            yield present, wish, answers


def lobes(target: Target) -> np.ndarray:
    """Energies and roughnesses."""
    return np.array([[*lobe.colour, *lobe.axes[:2]] for lobe in target.lobes])


def by_invert(present: DraggedStack, wish: Target, model: Model) -> Target:
    """The answer of `invert` from a material, which is the first way out where it refuses."""
    asked = wish.model_copy(update={"start": present.stack})
    try:
        solution = invert_stack(asked, model)
    except Infeasible as error:
        assert error.nearest is not None
        return error.nearest
    return solution.reached or wish


def nearer(present: DraggedStack, answer: Nearest, count: int, rng: np.random.Generator) -> float:
    """The part of the way of the furthest stack on the line that is reached from stacks drawn about an answer."""
    space, x = answer.stack.space, answer.stack.point.x
    held, caps = answer.stack.constant(answer.wish)
    spread = np.exp(rng.uniform(*np.log(SPREAD), (1, count))) * units(x)[:, None]
    points = np.clip(x[:, None] + spread * rng.normal(size=(len(x), count)), *(end[:, None] for end in space.box))
    points[held] = x[held, None]
    points = points[:, space.margins(space.bounds, points).min(axis=0) >= -SLACK]
    line = Line(answer.stack.point, space.goal(present.now(answer.wish)), space.goal(answer.wish), held, caps)

    def ahead(readings: np.ndarray, wider: float, most: int) -> np.ndarray:
        part, off = np.transpose([line.placed(reading) for reading in readings.T])
        near = np.flatnonzero((off < wider * BESIDE) & (part > answer.part + NEARER / wider))
        return near[np.argsort(-part[near])][:most]

    if space.slow and points.size:
        points = points[:, ahead(roughly(space, x).read(points), WIDER, READ)]
    if not points.size:
        return 0.0
    starts = points[:, ahead(space.read(points), 1.0, FOLLOWED)]
    ends = [dataclasses.replace(line, start=Point(space, start)).last(READINGS) for start in starts.T]
    return max((end.part for end in ends if end.off < ON_LINE), default=0.0)


def roughly(space: Space, x: np.ndarray) -> Space:
    """The space as the nearest model in closed form reads it, scaled to read a point as the model itself does."""
    value, near = (each.read(x[:, None])[:, 0] for each in (space, space.quickly))
    alike = value * near > 0
    factors = np.where(alike, value / np.where(alike, near, 1.0), 1.0)
    return dataclasses.replace(space.quickly, factors=factors)


def main() -> int:
    options = parsed(
        __doc__,
        wishes=60,
        beyond=(False, "those that are not met alone"),
        brute=(2000, "stacks that are drawn beside an answer"),
        model=DEFAULT,
        seed=0,
    )
    model, rng, failed = named(options.model), np.random.default_rng(options.seed), 0
    seconds: dict[str, list[float]] = {"rest": [], "hand": []}
    met = alike = 0
    found = islice(answered(model, options.seed, options.beyond, seconds), options.wishes)
    for done, (present, wish, answers) in enumerate(counted(found, options.wishes, "wishes"), 1):
        rest, hand = answers["rest"], answers["hand"]
        met += rest.met
        others = [by_invert(present, wish, model), hand.reached]
        apart, quickly = (float(np.abs(lobes(one) - lobes(rest.reached)).max()) for one in others)
        alike += quickly <= SAME
        further = 0.0 if rest.met else nearer(present, rest, options.brute, rng) - rest.part
        if apart > SAME or max(further, abs(hand.part - rest.part)) > NEARER:
            failed += 1
            print(
                f"{apart:.1e} apart, {further:.3f} further than {rest.part:.3f} ({rest.why}), {hand.part:.3f} under "
                f"the hand: {wish.to_dict()['lobes']} from {present.stack.to_dict()}",
                flush=True,
            )
        if done % SAID == 0:
            print(f"{done} wishes: {alike} alike under the hand, {met} met, {failed} failed", flush=True)
    for way, taken in seconds.items():
        row("nearest", way, taken, remark=f"95 % below {np.quantile(taken, 0.95):.2f}, at most {max(taken):.2f} s")
    print(f"{options.model}: {alike} of {options.wishes} answers under the hand have the lobes of that at rest")
    print(f"{options.model}: {met} of {options.wishes} wishes met, {failed} with several answers or a nearer one")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
