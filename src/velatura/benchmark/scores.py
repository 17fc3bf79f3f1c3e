"""Scores: how far the light of a candidate is from the truth, how noisy its samples are, and what it costs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, TypeAdapter, ValidationError

from velatura import files
from velatura.benchmark import candidates
from velatura.benchmark.candidates import Candidate, Factory
from velatura.benchmark.cost import median_cost
from velatura.benchmark.stacks import Case, chosen, known
from velatura.benchmark.walks import Binned, truth
from velatura.errors import InvalidInput
from velatura.light.polar_bins import RADII
from velatura.results import Fields

Array = NDArray[np.floating]

FAINT = 0.02  # light of a side, or a colour, that is not scored
SAMPLES = 16  # power of 2, of each direction
NUMBERS = ConfigDict(allow_inf_nan=False)  # of scores that are read


@dataclass(frozen=True)
class Record:
    """Light from one direction on one side of a stack.

    variation, floor: total variation, and what an exact candidate would have in the mean, by the noise of both; albedo,
    its noise: relative errors by colour, None where there is too little; width, its noise: logarithm of the ratio of
    the median distances from where a smooth stack would send the light, None where a candidate sends none; spread:
    relative variance of the weights of samples of that direction, None where it draws none.
    """

    stack: str
    kind: str
    bounces: str
    direction: int
    cosine: float
    side: str
    energy: tuple[float, ...]
    variation: float
    floor: float
    albedo: tuple[float | None, ...]
    albedo_noise: tuple[float | None, ...]
    width: float | None
    width_noise: float
    spread: float | None
    __pydantic_config__: ClassVar[ConfigDict] = NUMBERS


@dataclass(frozen=True, repr=False)
class Scores(Fields):
    """All records of a candidate; `asked` is their number if it expressed every stack, by kind; `refused` counts
    reasons; cost is that of an evaluation over one of `roughconductor`, None where it was not measured or is no plugin;
    edition is the number of that of the stacks.
    """

    name: str
    records: tuple[Record, ...]
    asked: Mapping[str, int]
    refused: Mapping[str, int]
    cost: float | None = None
    edition: int = 1
    __pydantic_config__: ClassVar[ConfigDict] = NUMBERS

    def summary(self, kind: str | None = None) -> dict[str, float]:
        """Means over the records, of one kind or all; empty where there are none."""
        records = [r for r in self.records if kind in (None, r.kind)]
        asked = self.asked[kind] if kind else sum(self.asked.values())
        if not records:
            return {"records": 0, "asked": asked}
        albedo, noise = (
            [abs(x) for r in records for x in getattr(r, name) if x is not None] for name in ("albedo", "albedo_noise")
        )
        widths = [abs(r.width) for r in records if r.width is not None]
        spreads = {(r.stack, r.direction): r.spread for r in records if r.spread is not None}
        variation, floor = (float(np.mean([getattr(r, name) for r in records])) for name in ("variation", "floor"))
        return {
            "records": len(records),
            "asked": asked,
            "variation": variation,
            "floor": floor,
            "albedo": float(np.mean(albedo)),
            "albedo_noise": float(np.mean(noise)),
            "worst_albedo": float(np.max(albedo)),
            **({"width": float(np.mean(widths))} if widths else {}),
            "width_noise": float(np.mean([r.width_noise for r in records])),
            **({"spread": float(np.mean(list(spreads.values())))} if spreads else {}),
            **({"cost": self.cost} if self.cost is not None and not kind else {}),
        }

    def to_dict(self) -> dict[str, Any]:
        """All numbers, for JSON."""
        summary = {"all": self.summary(), **{kind: self.summary(kind) for kind in self.asked}}
        return {"format": known(self.edition).format, "summary": summary, **asdict(self)}


def score(
    factory: Factory,
    name: str = "candidate",
    kinds: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
    edition: int = 1,
) -> Scores:
    """Score a model on the stacks of the benchmark.

    Args:
        factory: makes of a `Case` (its `stack`, its `often`) a function of wi and wo (n, 3), unit vectors away from the
            surface, that gives `f * abs(cos(theta_o))` of energies (n, 3), NaN where it has none; or a `mi.BSDF` or the
            dict of one; or None where the model cannot express the stack. An `InvalidInput` counts as that, too. A
            function with a method `sample(wi, u)`, which gives weights (n, 3), is asked for the noise of its samples.
        kinds: of stacks; None for all.
        progress: called with (stacks done, all stacks).
        edition: 1, stacks of every sort, or 2, stacks as people make them, up to grazing angles.

    Raises:
        InvalidInput: an unknown kind or edition, or in a line that begins with the stack: what is no candidate; one
            that fails or calls `sys.exit`, with its error as the cause; values of another shape or type, negative or
            infinite.
        MissingTool: LLVM is missing or too old.
    """
    cases, true = chosen(kinds, edition), truth(edition)
    records: list[Record] = []
    asked: dict[str, int] = dict.fromkeys([case.kind for case in cases], 0)
    refused: Counter[str] = Counter()
    for n, case in enumerate(cases):
        mine = {
            (direction, side): each
            for (id, direction, side), each in true.items()
            if id == case.id and each.total.mean() > FAINT
        }
        asked[case.kind] += len(mine)
        given = None
        with candidates.asked(case):
            try:
                given = factory(case)
            except InvalidInput as error:
                refused[str(error)] += 1
            candidate = candidates.made(given)
        if candidate is not None:
            found = candidates.seen(case, candidate)
            spreads = _spreads(case, candidate)
            kept = [key for key in mine if key in found]
            records += [_record(case, key, found[key], mine[key], spreads.get(key[0])) for key in kept]
        if progress:
            progress(n + 1, len(cases))
    return Scores(name, tuple(records), asked, dict(refused), edition=edition)


def kept_score(
    path: Path | None,
    factory: Factory,
    name: str,
    kinds: Sequence[str] | None = None,
    timed: bool = False,
    progress: Callable[[int, int], None] | None = None,
    edition: int = 1,
) -> Scores:
    """Scores from a JSON file if that is there, else of `score` and kept there; not kept where it is None.

    `timed` measures the cost of evaluations, unless the file has it.

    Raises:
        InvalidInput: as `score`; the file holds other kinds, or cannot be read or written.
    """
    if path and path.exists():
        try:
            found = TypeAdapter(Scores).validate_json(files.content(path))
        except ValidationError as error:
            at, why = error.errors()[0]["loc"], error.errors()[0]["msg"]
            raise InvalidInput(f"{path}: holds no scores: {'.'.join(map(str, at))}: {why}") from None
        if found.edition != edition or set(found.asked) != {case.kind for case in chosen(kinds, edition)}:
            raise InvalidInput(f"{path}: holds scores of other kinds of stacks; give another folder")
        if found.cost is not None or not timed:
            return found
    else:
        if path:
            files.make_folder(path.parent)
        found = score(factory, name, kinds, progress, edition)
    if timed:
        found = replace(found, cost=median_cost(factory, chosen(kinds, edition)))
    if path:
        with files.whole(path) as unfinished:
            unfinished.write_text(json.dumps(found.to_dict(), allow_nan=False), encoding="utf-8")
    return found


def _record(case: Case, key: tuple[int, str], found: Binned, true: Binned, spread: float | None) -> Record:
    total = true.total.sum()
    noise = np.hypot(found.energy_error, true.energy_error)
    lit = true.total > FAINT
    width, width_noise = _width_error(found, true)

    def relative(values: Array) -> tuple[float | None, ...]:
        return tuple(float(x / e) if bright else None for x, e, bright in zip(values, true.total, lit))

    return Record(
        stack=case.id,
        kind=case.kind,
        bounces="any" if case.often else "one",
        direction=key[0],
        cosine=float(case.incident[key[0]][2]),
        side=key[1],
        energy=tuple(true.total.tolist()),
        variation=float(0.5 * np.abs(found.energy - true.energy).sum() / total),
        floor=float(0.5 * np.sqrt(2 / np.pi) * noise.sum() / total),
        albedo=relative(found.total - true.total),
        albedo_noise=relative(np.hypot(found.total_error, true.total_error)),
        width=width,
        width_noise=width_noise,
        spread=spread,
    )


def _width_error(found: Binned, true: Binned) -> tuple[float | None, float]:
    """Logarithm of the ratio of both widths, None where a candidate sends no light, and its standard error."""
    (width, error), (true_width, true_error) = _width(found), _width(true)
    if not width > 0:
        return None, true_error
    return float(np.log(width / true_width)), float(np.hypot(error, true_error))


def _width(light: Binned) -> tuple[float, float]:
    """Median of the share t of the way from the centre to the rim, and its relative standard error.

    The share of the energy within t is interpolated between `RADII`, in their logarithm, and as t squared in the first.
    """
    rows, squares = light.energy.sum(axis=(1, 2)), np.square(light.energy_error).sum(axis=(1, 2))
    if not rows.sum() > 0:
        return 0.0, 0.0
    within = np.cumsum(rows) / rows.sum()
    k = int(np.searchsorted(within, 0.5))
    noise = 0.5 * np.sqrt(squares.sum()) / rows.sum()
    if k == 0:
        return float(RADII[1] * np.sqrt(0.5 / within[0])), float(noise / (2 * 0.5))
    slope = (within[k] - within[k - 1]) / np.log(RADII[k + 1] / RADII[k])
    return float(RADII[k] * np.exp((0.5 - within[k - 1]) / slope)), float(noise / slope)


def _spreads(case: Case, candidate: Candidate) -> dict[int, float]:
    """Relative variance of the weights of samples, by direction."""
    if not hasattr(candidate, "sample"):
        return {}
    found, u = {}, candidates.evenly(SAMPLES, 0)
    for n, wi in enumerate(case.incident):
        with candidates.asked(case):
            weight = candidates.numbers("weights", candidate.sample(np.broadcast_to(wi, u.shape), u), u.shape)
        weight = weight.mean(axis=1)
        if np.isfinite(weight).all() and weight.mean() > 0:
            found[n] = float(weight.var() / weight.mean() ** 2)
    return found
