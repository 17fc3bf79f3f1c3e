"""Candidates for scores: functions of two directions, BSDFs of Mitsuba, and values from files, as light in bins."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from velatura import files, kernel
from velatura.benchmark.stacks import EDITIONS, Case
from velatura.benchmark.walks import Binned, walked
from velatura.checks.probe import Probe
from velatura.errors import InvalidInput, VelaturaError
from velatura.light.polar_bins import AZIMUTHAL, NODES, RADIAL, SIDES, Bins
from velatura.stack.schema import show

Array = NDArray[np.floating]

BRIGHTEST = 1e30  # 1/sr; sums of such values, and their squares, are still numbers

#: f(wi, wo) |cos theta_o| (n, 3) of energies, for unit vectors (n, 3); NaN where a model does not say.
Eval: TypeAlias = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Walk:
    """The walk itself, by another seed."""

    seed: int
    paths: int


#: What a factory makes for a case: an `Eval`, which may have a method `sample(wi, u)` for directions and numbers (n, 3)
#: that gives weights (n, 3); a `mi.BSDF`, or the dict of one; a `Walk`; None where the model cannot express the stack.
Candidate: TypeAlias = Any
Factory: TypeAlias = Callable[[Case], Candidate]

# Pairs of directions -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pairs:
    """All pairs of directions (n, 3) of a case, and their solid angles (n,); those of `keys` in turn, in equal parts.

    keys: direction and side; within: nodes (RADIAL * AZIMUTHAL,) of each bin of a key.
    """

    wi: Array
    wo: Array
    weight: Array
    keys: tuple[tuple[int, str], ...]
    within: NDArray[np.intp]

    @classmethod
    def of(cls, case: Case, nodes: int = NODES) -> Pairs:
        """The pairs of so many squared nodes for each bin, and of those of its edition in the first row."""
        central = EDITIONS[case.edition].central
        sides = SIDES[: 1 + case.stack.transmits]
        keys = tuple((direction, side) for direction in range(len(case.incident)) for side in sides)
        each = [Bins.of(case.incident[direction], side, case.eta).nodes(nodes, central) for direction, side in keys]
        wi = np.repeat(case.incident[[direction for direction, _ in keys]], len(each[0][1]), axis=0)
        wo, weight = (np.concatenate([pair[i] for pair in each], axis=-1) for i in (0, 1))
        within = np.full((RADIAL, AZIMUTHAL), nodes * nodes)
        within[0] = nodes * (central or nodes)
        return cls(wi, wo.T, weight, keys, within.ravel())

    def light(self, value: Array) -> dict[tuple[int, str], Binned]:
        """The light of values (n, 3), of those keys that have no NaN."""
        each = np.split(value * self.weight[:, None], len(self.keys))
        return {key: self._exact(light) for key, light in zip(self.keys, each) if np.isfinite(light).all()}

    def _exact(self, light: Array) -> Binned:
        """Light of energies (n, 3) at the nodes of a key, without errors."""
        begins = np.cumsum(self.within) - self.within
        energy = np.add.reduceat(light, begins, axis=0).reshape(RADIAL, AZIMUTHAL, 3)
        return Binned(energy, np.zeros_like(energy), energy.sum(axis=(0, 1)), np.zeros(3))


def seen(case: Case, candidate: Candidate, nodes: int = NODES) -> dict[tuple[int, str], Binned]:
    """The light of a candidate, by direction and side, of those that it has values for.

    Raises:
        InvalidInput: the candidate fails, or its values are no numbers (n, 3) from 0 to BRIGHTEST or NaN.
    """
    if isinstance(candidate, Walk):
        return {
            (direction, side): light
            for direction in range(len(case.incident))
            for side, light in walked(case, direction, candidate.paths, candidate.seed).items()
        }
    pairs = Pairs.of(case, nodes)
    with asked(case):
        value = numbers("values", candidate(pairs.wi, pairs.wo), pairs.wo.shape)
    return pairs.light(value)


@contextmanager
def asked(case: Case) -> Iterator[None]:
    """Raises InvalidInput, in one line that names the stack, where the candidate's own code fails in the block."""
    try:
        yield
    except InvalidInput as error:
        raise InvalidInput(f"{case.id}: {error}") from error
    except VelaturaError:
        raise
    except (Exception, SystemExit) as error:
        raise InvalidInput(f"{case.id}: the candidate failed: {type(error).__name__}: {error}") from error


def numbers(what: str, given: Any, shape: tuple[int, ...]) -> Array:
    """The answer of a candidate, as numbers of a shape.

    Raises:
        InvalidInput: other types, another shape, or values that are negative, infinite or above BRIGHTEST.
    """
    found = np.asarray(given)
    if found.dtype.kind not in "fiu":
        raise InvalidInput(f"{what}: must be real numbers, got {show(str(found.dtype))}")
    if found.shape != shape:
        raise InvalidInput(f"{what}: must have the shape {shape}, got {found.shape}")
    wrong = (found < 0) | (found > BRIGHTEST)
    if wrong.any():
        first = found[wrong][0]
        raise InvalidInput(f"{what}: must be 0 to {BRIGHTEST:g}, or NaN, got {first:g} at {int(wrong.sum())} places")
    return found.astype(float)


# Mitsuba -------------------------------------------------------------------------------------------------------------


def probe_of(bsdf: Any) -> Probe:
    """Asks a BSDF for energies: of what passes, not the radiance."""
    probe = Probe(bsdf)
    probe.context = probe.mi.BSDFContext(probe.mi.TransportMode.Importance)
    return probe


class Plugin:
    """A `mi.BSDF` as a candidate; NaN from below where it is one-sided, and on the other side where it is opaque."""

    def __init__(self, bsdf: Any) -> None:
        self.probe = probe_of(bsdf)

    def __call__(self, wi: Array, wo: Array) -> Array:
        value = self.probe.eval_pdf(wi, wo).value
        for wrong in self.probe.wrong:
            if wrong.function == "eval":
                raise InvalidInput(f"eval: must be finite and not negative, got {wrong.answer[0]:g}")
        passes = np.sign(wi[:, 2]) != np.sign(wo[:, 2])
        unknown = (passes & (not self.probe.transmits)) | ((wi[:, 2] < 0) & (not self.probe.two_sided))
        return np.where(unknown[:, None], np.nan, value)

    def sample(self, wi: Array, u: Array) -> Array:
        """Weights (n, 3)."""
        return np.where((wi[:, 2:] < 0) & (not self.probe.two_sided), np.nan, self.probe.sample(wi, u).weight)


def made(candidate: Candidate) -> Candidate:
    """The candidate, with a BSDF or the dict of one as a function.

    Raises:
        InvalidInput: a dict that Mitsuba refuses, or what is none of the above.
    """
    if candidate is None or isinstance(candidate, Walk | Plugin):
        return candidate
    if isinstance(candidate, Mapping):
        return Plugin(kernel.load_dict(dict(candidate)))
    if hasattr(candidate, "eval_pdf"):
        return Plugin(candidate)
    if not callable(candidate):
        raise InvalidInput(f"candidate: must be a function of wi and wo, or a BSDF, got {type(candidate).__name__}")
    return candidate


@cache
def evenly(power: int, seed: int) -> Array:
    """Points (2^power, 3) that fill a cube evenly; not to be written to."""
    points: Array = qmc.Sobol(3, seed=seed).random_base2(power).clip(0, 1 - 2**-24)
    points.flags.writeable = False
    return points


# Files ---------------------------------------------------------------------------------------------------------------


def values_of(path: Path) -> Array:
    """The array of an .npy file, which stays on the disk until it is looked at; nothing in it is run.

    Raises:
        InvalidInput: no such file, or another one; one line that begins with the path.
    """
    files.check_regular(path)
    try:
        found: Array = np.lib.format.open_memmap(path, mode="r")
    except Exception as error:  # of any kind, by the parts of the header
        raise InvalidInput(f"{path}: cannot be read as .npy: {files.reason(error)}") from None
    return found


def from_values(values: Array, cases: Sequence[Case]) -> Factory:
    """A factory that reads values (P, 3) of all pairs of these cases, as `write_task` has them.

    Raises:
        InvalidInput: another shape or other types, or values that are negative, infinite or above BRIGHTEST.
    """
    ends = np.cumsum([len(Pairs.of(case).wi) for case in cases])
    found = numbers("values", values, (int(ends[-1]), 3))
    parts = dict(zip([case.id for case in cases], np.split(found, ends[:-1])))
    return lambda case: lambda wi, wo: parts[case.id]
