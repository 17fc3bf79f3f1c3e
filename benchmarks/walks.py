"""Random stacks of every kind, and walks through them, kept in a folder: what `fidelity.py` holds models to.

    python benchmarks/walks.py [FOLDER] [--half fit] [--kind NAME]... [--stacks 12] [--paths 1000000] [--seed 0]

Stacks have 1 to 4 interfaces, of an index in 1.1 to 2.2 and alpha to .55 (one in seven is smooth), over metals,
mirrors, glass and diffuse bases; what each kind has besides, its function says. Those of the half `fit` are for
fitting, those of the half `test` never. Light comes from above at cosines 1, .7 and .35, and into solids also from
inside, at the momenta n sin = 0, .6, .93, 1.04 and 1 + .6 (n - 1). The last six kinds are lit at .9, .5, .2 and .08
from above alone. Every stack is a file in YAML, with its walks beside
it as NPZ. What is there already is not walked again.
"""

from __future__ import annotations

import argparse
from ast import literal_eval
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import track
from rows import parser

import velatura as vt
from velatura import files
from velatura.benchmark.random_stacks import (
    clear,
    cloudy,
    crossed,
    etched,
    frosted,
    isotropic,
    lacquered,
    milky,
    painted,
    tinted,
    turned,
    very_rough,
)
from velatura.model import fitted
from velatura.stack import Material, Stack, as_described, dumps

Array = NDArray[np.floating]

COSINES = (1.0, 0.7, 0.35)
MOMENTA = (0.0, 0.6, 0.93, 1.04)  # from inside
DEEP = 0.6  # of the way from the critical angle to grazing
HALVES = ("fit", "test")
STACKS, PATHS, FOLDER = 12, 1_000_000, Path("walks")

# Stacks of every kind ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lighting:
    """Light from above at some cosines and an azimuth from the tangent; and into solids also from inside, or not."""

    cosines: tuple[float, ...] = COSINES
    azimuth: float = 0.0
    inside: bool = True


SLANTED = Lighting((0.9, 0.5, 0.2, 0.08), 0.28, False)  # mirrored light is far from borders of bins


@dataclass(frozen=True)
class Kind:
    """Stacks that `draw` makes from random numbers and a running number.

    often: whether light is scattered many times between facets; passes: whether it is what passes that is looked at.
    """

    name: str
    draw: Callable[[np.random.Generator, int], Stack]
    often: bool
    passes: bool = False
    light: Lighting = Lighting()

    def stack(self, seed: int, half: str, number: int) -> Stack:
        """One of its stacks, independent of the others that are drawn."""
        rng = np.random.default_rng([seed, HALVES.index(half), number, *self.name.encode()])
        return self.draw(rng, number).replace(name=f"{self.name}, {half}, {number}")


KINDS = (
    Kind("isotropic, once", isotropic, False),
    Kind("isotropic, often", isotropic, True),
    Kind("turned, once", turned, False),
    Kind("turned, often", turned, True),
    Kind("absorbing, often", tinted, True),
    Kind("scattering, often", cloudy, True),
    Kind("diffuse base, often", painted, True),
    Kind("passing, once", clear, False, True),
    Kind("passing, often", clear, True, True),
    Kind("passing scattering, often", milky, True, True),
    Kind("brushed under lacquer", lacquered, True, light=SLANTED),
    Kind("crossed brushing", crossed, True, light=SLANTED),
    Kind("frosted pane", frosted, True, True, SLANTED),
    Kind("etched pane", etched, True, True, SLANTED),
    Kind("etched pane, reflected", etched, True, light=SLANTED),
    Kind("very rough", very_rough, True, True, SLANTED),
)

# Their walks ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Incidence:
    """A direction that light comes from, at the azimuth of the kind: its cosine, and from which side."""

    cosine: float
    inside: bool
    momentum: float  # n sin


@dataclass(frozen=True)
class Walks:
    """Where light goes that comes into `stack` from N `incidences`.

    grids (2, 2, 3, N, bins, bins): by half of the paths, and whether light is thrown back or passes, energies over the
    projected disc, whose x and y are those of the stack. energy (K, 3, N): of what the stack throws back upwards, by
    the deepest of K interfaces, None where light passes.
    """

    stack: Stack
    incidences: tuple[Incidence, ...]
    grids: Array
    energy: Array | None


def incidences(kind: Kind, stack: Stack) -> tuple[Incidence, ...]:
    """Every direction that a stack of that kind is lit from."""
    found = [Incidence(c, False, float(np.sqrt(1 - c * c))) for c in kind.light.cosines]
    if kind.passes and not stack.thin and kind.light.inside:
        index = Material.of(stack, as_described).below
        momenta = sorted({*MOMENTA, 1 + DEEP * (index - 1)})
        found += [Incidence(float(np.sqrt(1 - (p / index) ** 2)), True, p) for p in momenta]
    return tuple(found)


def walked(kind: Kind, stack: Stack, paths: int) -> Walks:
    """Walk through a stack from all its directions."""
    lit = incidences(kind, stack)
    sides = []
    for inside in sorted({i.inside for i in lit}):
        seen = _reversed(stack) if inside else stack
        cosines = [i.cosine for i in lit if i.inside == inside]
        halves = [
            vt.reference.distribution(seen, cosines, kind.light.azimuth, paths // 2, seed, kind.often)
            for seed in (1, 2)
        ]
        nothing = np.zeros_like(halves[0].reflected)
        sides.append([[h.reflected, nothing if h.transmitted is None else h.transmitted] for h in halves])
    grids = np.concatenate([np.array(side, np.float32) for side in sides], axis=3)
    if kind.passes:
        return Walks(stack, lit, grids, None)
    energy = np.array(
        vt.reference.statistics(stack, kind.light.cosines, kind.light.azimuth, paths, 3, kind.often).energy
    )
    return Walks(stack, lit, grids, energy)


def _reversed(stack: Stack) -> Stack:
    """A solid as it is from inside, mirrored, so that x and y stay."""
    turned = Material.of(stack, as_described).reversed()
    return Stack.from_flat(turned.kinds, turned.flat())


def kept(kind: Kind, half: str, number: int, paths: int, seed: int, folder: Path) -> Walks:
    """The walks through a stack, from the folder if they are there, else walked and kept there."""
    stack = kind.stack(seed, half, number)
    place = folder / f"seed-{seed}-paths-{paths}" / half / kind.name.replace(", ", "-").replace(" ", "-")
    text, array = place / f"{number:03d}.yaml", place / f"{number:03d}.npz"
    if array.exists() and text.exists() and text.read_text(encoding="utf-8") == dumps(stack):
        with np.load(array) as found:
            return Walks(stack, incidences(kind, stack), found["grids"], found.get("energy"))
    new = walked(kind, stack, paths)
    place.mkdir(parents=True, exist_ok=True)
    array.unlink(missing_ok=True)
    vt.save(stack, text)
    described = {name: np.array([getattr(i, name) for i in new.incidences]) for name in Incidence.__annotations__}
    with files.whole(array) as unfinished, open(unfinished, "wb") as stream:
        energy = {} if new.energy is None else {"energy": new.energy}
        np.savez_compressed(stream, grids=new.grids, **described, **energy)
    return new


def every(
    kinds: Sequence[Kind], halves: Sequence[str], stacks: int, paths: int, seed: int, folder: Path
) -> Iterator[tuple[Kind, Walks]]:
    """The walks of all kinds and halves, with progress."""
    jobs = [(kind, half, number) for number in range(stacks) for kind in kinds for half in halves]
    for kind, half, number in track(jobs, description="walking"):
        yield kind, kept(kind, half, number, paths, seed, folder)


def chosen(names: Sequence[str] | None) -> tuple[Kind, ...]:
    """The kinds of these names; all if there are none."""
    return tuple(kind for kind in KINDS if not names or kind.name in names)


def arguments(about: str | None, **options: Any) -> argparse.ArgumentParser:
    """The parser of a program that needs walks."""
    given = {"stacks": (STACKS, "of each kind"), "paths": (PATHS, "of each direction"), "seed": 0, **options}
    program = parser(about, **given)
    program.add_argument("--kind", action="append", choices=[kind.name for kind in KINDS], help="one or more; else all")
    program.add_argument(
        "--fitted", action="append", type=_fitted, metavar="NAME=VALUE", help="of velatura.model.fitted"
    )
    return program


def _fitted(text: str) -> None:
    """Give a fitted constant another value."""
    name, _, value = text.partition("=")
    if not hasattr(fitted, name):
        raise argparse.ArgumentTypeError(f"unknown constant {name!r}")
    setattr(fitted, name, literal_eval(value))


def main() -> None:
    program = arguments(__doc__)
    program.add_argument("folder", type=Path, nargs="?", default=FOLDER)
    program.add_argument("--half", action="append", choices=HALVES, help="one or both; else both")
    options = program.parse_args()
    halves = options.half or HALVES
    for _ in every(chosen(options.kind), halves, options.stacks, options.paths, options.seed, options.folder):
        pass


if __name__ == "__main__":
    main()
