"""The truth of the benchmark: light of random walks by bins, with standard errors, and its files."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import files
from velatura.benchmark.stacks import EDITIONS, Case, Edition, known
from velatura.light.polar_bins import AZIMUTHAL, RADIAL, RADII, SIDES, Bins, mirrored
from velatura.reference.batches import ends
from velatura.reference.statistics import moments

Array = NDArray[np.floating]

PATHS = 2**21  # for each direction
CHANNELS = "rgb"
BITS = {"energy": 14, "energy_error": 5}  # that are kept of what compresses well then

#: Places of a record: its case and direction among all, and its side among SIDES.
Key = tuple[int, int, int]


@dataclass(frozen=True)
class Binned:
    """Light from one direction that leaves on one side, as shares of what comes in.

    energy (RADIAL, AZIMUTHAL, 3) of each bin, total (3,) of all; each is followed by its standard errors.
    """

    energy: Array
    energy_error: Array
    total: Array
    total_error: Array


@dataclass(frozen=True)
class Light(Binned):
    """The same with the mean (2,) and the covariance (3,: xx, xy, yy) of the outgoing x and y, over the mean of the
    colours, and their standard errors.
    """

    mean: Array
    mean_error: Array
    covariance: Array
    covariance_error: Array


# Walk ----------------------------------------------------------------------------------------------------------------


def walked(case: Case, direction: int, paths: int = PATHS, seed: int | None = None) -> dict[str, Light]:
    """The light of a case from one of its directions, by side; by another seed than its edition's, if one is given.

    Raises:
        MissingTool: LLVM is missing or too old.
    """
    wi = case.incident[direction]
    seed = EDITIONS[case.edition].seed if seed is None else seed
    (number,) = np.random.SeedSequence([seed, direction, *case.id.encode()]).generate_state(1)
    found = ends(case.stack, wi, paths, int(number), case.often)
    above = found.w[2] > 0
    sides = {"reflected": above == (wi[2] > 0)}
    if case.stack.transmits:
        sides["transmitted"] = ~sides["reflected"]
    return {
        side: _light(Bins.of(wi, side, case.eta), found.w[:, kept], found.weight[:, kept], paths, case.symmetric)
        for side, kept in sides.items()
    }


def _light(bins: Bins, wo: Array, weight: Array, paths: int, symmetric: bool) -> Light:
    number = bins.number(wo)

    def summed(values: Array) -> Array:
        sums = [np.bincount(number, each, RADIAL * AZIMUTHAL) for each in values]
        return np.stack(sums, axis=-1).reshape(RADIAL, AZIMUTHAL, len(sums)) / paths

    energy, second = summed(weight), summed(weight**2)
    error = np.sqrt(np.maximum(second - energy**2, 0) / paths)
    total, squares = energy.sum(axis=(0, 1)), second.sum(axis=(0, 1))
    if symmetric:
        energy = 0.5 * (energy + mirrored(energy))
        error = 0.5 * np.hypot(error, mirrored(error))
    spread = moments(wo[:2], weight.mean(axis=0))
    return Light(energy, error, total, np.sqrt(np.maximum(squares - total**2, 0) / paths), *spread)


def walk_all(
    folder: Path,
    of_each: int | None = None,
    paths: int = PATHS,
    seed: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    edition: int = 1,
) -> None:
    """Walk through all stacks of an edition, and write them into a folder: `stacks.json`, `truth.npz`, `energies.csv`.

    Walks of single stacks are kept in a folder of it, and are not repeated. Another seed makes other stacks of the same
    kinds.

    Raises:
        InvalidInput: an unknown edition, or the folder cannot be written.
        MissingTool: LLVM is missing or too old.
    """
    chosen = known(edition)
    seed = chosen.seed if seed is None else seed
    cases = list(chosen.all_drawn(of_each, seed))
    kept = folder / f"walks-seed-{seed}-paths-{paths}"
    files.make_folder(kept)
    lights: dict[Key, Light] = {}
    for n, case in enumerate(cases):
        for (direction, side), light in _kept(case, paths, seed, kept / f"{case.id}.npz").items():
            lights[n, direction, side] = light
        if progress:
            progress(n + 1, len(cases))
    write(folder, chosen, cases, lights, paths, seed)


def _kept(case: Case, paths: int, seed: int, path: Path) -> dict[tuple[int, int], Light]:
    """The light of a case, from a file if it is there, else walked and kept there."""
    text = json.dumps(case.to_dict())
    names = [field.name for field in fields(Light)]
    if path.exists():
        with np.load(path) as found:
            if str(found["case"]) == text:
                return {
                    (direction, side): Light(*(found[f"{direction}-{side}-{name}"] for name in names))
                    for direction in range(len(case.incident))
                    for side in range(1 + case.stack.transmits)
                }
    lights = {
        (direction, SIDES.index(side)): light
        for direction in range(len(case.incident))
        for side, light in walked(case, direction, paths, seed).items()
    }
    arrays = {f"{d}-{s}-{name}": getattr(light, name) for (d, s), light in lights.items() for name in names}
    with files.whole(path) as unfinished, open(unfinished, "wb") as stream:
        np.savez_compressed(stream, case=np.array(text), **arrays)
    return lights


# Files ---------------------------------------------------------------------------------------------------------------


def write(
    folder: Path, edition: Edition, cases: Iterable[Case], lights: Mapping[Key, Light], paths: int, seed: int
) -> None:
    """Write cases of an edition.

    Raises:
        InvalidInput: the folder cannot be written.
    """
    cases = list(cases)
    about = {"format": edition.format, "seed": seed, "paths": paths, "radii": RADII.tolist(), "azimuths": AZIMUTHAL}
    lines = ",\n".join(json.dumps(case.to_dict()) for case in cases)
    text = f'{json.dumps(about)[:-1]},\n"stacks": [\n{lines}\n]}}\n'
    with files.whole(folder / "stacks.json") as unfinished:
        unfinished.write_text(text, encoding="utf-8")

    keys = sorted(lights)
    arrays = {name: np.stack([getattr(lights[key], name) for key in keys]) for name in _names()}
    arrays |= {name: _rounded(arrays[name], bits) for name, bits in BITS.items()}
    packed: dict[str, Any] = {name: array.astype(np.float32) for name, array in arrays.items()}
    case, direction, side = np.array(keys, np.uint8).T
    with files.whole(folder / "truth.npz") as unfinished, open(unfinished, "wb") as stream:
        np.savez_compressed(stream, case=case, direction=direction, side=side, **packed)

    with files.whole(folder / "energies.csv") as unfinished, open(unfinished, "w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(_columns())
        for key in keys:
            table.writerow(_row(cases[key[0]], key, lights[key]))


def _rounded(values: Array, bits: int) -> Array:
    fraction, exponent = np.frexp(values)
    return np.ldexp(np.round(fraction * 2**bits) / 2**bits, exponent)


def _names() -> list[str]:
    return [field.name for field in fields(Light)]


def _columns() -> list[str]:
    parts = {"energy": CHANNELS, "mean": "xy", "covariance": ("xx", "xy", "yy")}
    named = [[f"{name}_{part}" for part in each] for name, each in parts.items()]
    measured = [name for each in named for name in (*each, *(f"{name}_error" for name in each))]
    return ["stack", "kind", "bounces", "wi_x", "wi_y", "wi_z", "side", *measured]


def _row(case: Case, key: Key, light: Light) -> list[str]:
    measured = np.concatenate([getattr(light, name) for name in _names()[2:]])
    _, direction, side = key
    wi = [f"{x:.6f}" for x in case.incident[direction]]
    return [case.id, case.kind, case.to_dict()["bounces"], *wi, SIDES[side], *(f"{x:.6g}" for x in measured)]


@cache
def truth(edition: int = 1) -> Mapping[tuple[str, int, str], Light]:
    """The truth of an edition that comes with the package, by stack, direction, and side; not to be written to.

    Raises:
        InvalidInput: an unknown edition.
    """
    data = known(edition).data
    ids = [fields["id"] for fields in json.loads((data / "stacks.json").read_text(encoding="utf-8"))["stacks"]]
    with (data / "truth.npz").open("rb") as stream, np.load(stream) as found:
        arrays = {name: found[name].astype(float) for name in _names()}
        for array in arrays.values():
            array.flags.writeable = False
        keys = zip(found["case"], found["direction"], found["side"])
        return {
            (ids[case], int(direction), SIDES[side]): Light(**{name: array[n] for name, array in arrays.items()})
            for n, (case, direction, side) in enumerate(keys)
        }
