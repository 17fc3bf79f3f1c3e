"""Hostile candidates of the benchmark, functions and files: refused in one line, or scored by finite numbers."""

from __future__ import annotations

import contextlib
import io
import json
import pickle
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fuzzing import Failure
from velatura import benchmark
from velatura.benchmark import candidates
from velatura.errors import InvalidInput

Value = Callable[[Any, Any], Any]
REFUSED, SCORED = True, False


def _raises(error: BaseException) -> Value:
    def value(wi: Any, wo: Any) -> Any:
        raise error

    return value


def _writes(what: str) -> Value:
    """Overwrites what it is given."""

    def value(wi: Any, wo: Any) -> Any:
        given = {"wi": wi, "wo": wo}[what]
        given[...] = np.nan
        return np.full(wo.shape, 0.1)

    return value


class Sampled:
    """A candidate that gives such weights of samples."""

    def __init__(self, weights: Callable[[Any], Any]) -> None:
        self._weights = weights

    def __call__(self, wi: Any, wo: Any) -> Any:
        return np.full(wo.shape, 0.1)

    def sample(self, wi: Any, u: Any) -> Any:
        return self._weights(u)


class Disguised:
    """An object that fails as an array."""

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError("no array\nat all")


#: Candidates at one stack, and whether they must be refused.
FUNCTIONS: dict[str, tuple[Any, bool]] = {
    "raises": (_raises(ZeroDivisionError("division\nby zero")), REFUSED),
    "asserts": (_raises(AssertionError()), REFUSED),
    "runs out of memory": (_raises(MemoryError()), REFUSED),
    "leaves": (_raises(SystemExit(0)), REFUSED),
    "calls itself": (lambda wi, wo: FUNCTIONS["calls itself"][0](wi, wo), REFUSED),
    "divides by zero": (lambda wi, wo: np.float64(1) / (0 * wo), REFUSED),
    "NaN": (lambda wi, wo: np.full(wo.shape, np.nan), SCORED),
    "NaN at one pair": (lambda wi, wo: np.where(np.arange(len(wo))[:, None] == 7, np.nan, 0.1 + 0 * wo), SCORED),
    "infinite": (lambda wi, wo: np.full(wo.shape, np.inf), REFUSED),
    "infinite at one pair": (lambda wi, wo: np.where(np.arange(len(wo))[:, None] == 7, np.inf, 0.1 + 0 * wo), REFUSED),
    "negative": (lambda wi, wo: wo * 0 - 1e-3, REFUSED),
    "huge": (lambda wi, wo: np.full(wo.shape, 1e308), REFUSED),
    "largest": (lambda wi, wo: np.full(wo.shape, candidates.BRIGHTEST), SCORED),
    "smallest": (lambda wi, wo: np.full(wo.shape, 5e-324), SCORED),
    "a scalar": (lambda wi, wo: 0.1, REFUSED),
    "nothing": (lambda wi, wo: None, REFUSED),
    "a row": (lambda wi, wo: wo[:, 0], REFUSED),
    "a column": (lambda wi, wo: wo[:, :1] + 2, REFUSED),
    "turned": (lambda wi, wo: np.full(wo.T.shape, 0.1), REFUSED),
    "too many": (lambda wi, wo: np.full((len(wo) + 1, 3), 0.1), REFUSED),
    "none": (lambda wi, wo: np.empty((0, 3)), REFUSED),
    "ragged": (lambda wi, wo: [[1.0], [1.0, 2.0]], REFUSED),
    "texts": (lambda wi, wo: np.full(wo.shape, "0.1"), REFUSED),
    "objects": (lambda wi, wo: np.full(wo.shape, 0.1, object), REFUSED),
    "complex": (lambda wi, wo: np.full(wo.shape, 0.1 + 1j), REFUSED),
    "truths": (lambda wi, wo: np.full(wo.shape, True), REFUSED),
    "dates": (lambda wi, wo: np.full(wo.shape, np.datetime64("2026-01-01")), REFUSED),
    "fails as an array": (lambda wi, wo: Disguised(), REFUSED),
    "whole numbers": (lambda wi, wo: np.ones(wo.shape, np.uint8), SCORED),
    "halves": (lambda wi, wo: np.full(wo.shape, 0.1, np.float16), SCORED),
    "lists": (lambda wi, wo: np.full(wo.shape, 0.1).tolist(), SCORED),
    "writes to wi": (_writes("wi"), SCORED),
    "writes to wo": (_writes("wo"), SCORED),
    "no function": ("no function", REFUSED),
    "a class": (Disguised, REFUSED),
    "no plugin": ({"type": "no such plugin"}, REFUSED),
    "no dict of a plugin": ({}, REFUSED),
    "bad weights": (Sampled(lambda u: u[:, 0]), REFUSED),
    "infinite weights": (Sampled(lambda u: u / 0), REFUSED),
    "weights that raise": (Sampled(lambda u: u["x"]), REFUSED),
    "weights written to u": (Sampled(lambda u: np.multiply(u, 2, out=u)), REFUSED),
    "weights of NaN": (Sampled(lambda u: u * np.nan), SCORED),
}
KIND = "films"  # of the stacks that are asked about, each from four directions


def trial(rng: np.random.Generator) -> list[Failure]:
    """A file with changes, or one in eight times a function."""
    return _function(rng) if rng.random() < 0.125 else _file(rng)


def scored(name: str, number: int) -> list[Failure]:
    """Failures of the answer to a function, at one stack of a kind."""
    candidate, refused = FUNCTIONS[name]
    cases = [case for case in benchmark.edition() if case.kind == KIND]
    at, before = cases[number % len(cases)], _state()
    given = {"candidate": name, "stack": at.id}
    try:
        with np.errstate(all="ignore"), contextlib.redirect_stdout(io.StringIO()) as out:
            found = benchmark.score(lambda case: candidate if case.id == at.id else None, kinds=[KIND])
        json.dumps(found.to_dict(), allow_nan=False)
        wrong = ("is not refused", name) if refused else None
    except InvalidInput as error:
        line = str(error)
        kept = refused and line.startswith(f"{at.id}: ") and line.isprintable()
        wrong = None if kept else ("refused otherwise", line)
    except (Exception, SystemExit):
        wrong = "traceback", traceback.format_exc().splitlines()[-1]
    if not wrong and (_state() != before or out.getvalue()):
        wrong = "the truth has changed", name
    return [Failure(*wrong, given)] if wrong else []


def _state() -> int:
    """A checksum of what candidates are held to."""
    true = [each.tobytes() for light in benchmark.truth().values() for each in vars(light).values()]
    return hash((*true, *(case.incident.tobytes() + repr(case.stack).encode() for case in benchmark.edition())))


def _function(rng: np.random.Generator) -> list[Failure]:
    return scored(list(FUNCTIONS)[rng.integers(len(FUNCTIONS))], int(rng.integers(100)))


# Files


class Trap:
    """Where it is loaded from a pickle, a file is made."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __reduce__(self) -> Any:
        return Path.touch, (self._path,)


def _file(rng: np.random.Generator) -> list[Failure]:
    case = benchmark.edition()[0]
    right = np.full((len(candidates.Pairs.of(case).wi), 3), 0.1, np.float32)
    with tempfile.TemporaryDirectory() as folder:
        path, trapped = Path(folder, "mine.npy"), Path(folder, "trapped")
        kind, data = _content(right, trapped, rng)
        path.write_bytes(data)
        wrong = _read(path, case)
        if trapped.exists():
            wrong = "a pickle was loaded", kind
    return [Failure(*wrong, {"kind": kind, "begins": data[:160].decode("latin-1")})] if wrong else []


def _content(right: Any, trapped: Path, rng: np.random.Generator) -> tuple[str, bytes]:
    """A file, and how it was made."""
    kind = ("bytes", "length", "array", "pickle", "archive", "header", "nothing")[rng.integers(7)]
    file = io.BytesIO()
    if kind == "pickle":
        return kind, pickle.dumps(Trap(trapped))
    if kind == "nothing":
        return kind, bytes(rng.integers(0, 256, rng.integers(0, 40), np.uint8))
    if kind == "archive":
        np.savez(file, right)
    elif kind == "array":
        dtypes: list[Any] = ["f8", "f2", "c16", "i4", "u1", "U3", "?", "M8[s]", "V8", "f4,f4", ">f4", object]
        other = right.astype(object) if (dtype := dtypes[rng.integers(len(dtypes))]) is object else None
        if other is not None:
            other[0, 0] = Trap(trapped)
        else:
            other = np.zeros(right.shape, dtype)
        other = (other, other[:-1], other.T, other[None], other[:0], np.asfortranarray(other))[rng.integers(6)]
        np.save(file, other, allow_pickle=True)
    else:
        values = right.copy()
        values[rng.integers(len(values))] = (np.nan, np.inf, -1, 1e38, 0)[rng.integers(5)]
        np.save(file, values)
    data = bytearray(file.getvalue())
    if kind == "length":
        cut = int(rng.integers(len(data)))
        return kind, bytes(data[:cut]) if rng.random() < 0.8 else bytes(data + data[:cut])
    for _ in range(rng.integers(1, 5) if kind in ("bytes", "header") else 0):
        data[rng.integers(128)] = rng.choice(list(b"(){}[]',:0123456789<>fiOUL\n \x00\xff-"))
    return kind, bytes(data)


def _read(path: Path, case: benchmark.Case) -> tuple[str, str] | None:
    try:
        values = benchmark.values_of(path)
        with contextlib.suppress(InvalidInput):
            taken = benchmark.from_values(values, [case])(case)(None, None)
            expected = np.load(path, allow_pickle=False)
            if not np.array_equal(taken, expected.astype(float), equal_nan=True):
                return "read otherwise", f"{values.dtype} {values.shape}"
            if not ((taken >= 0) & (taken < np.inf) | np.isnan(taken)).all():
                return "is not refused", f"{values.dtype} {values.shape}"
    except InvalidInput as error:
        line = str(error)
        return None if line.startswith(f"{path}: ") and line.isprintable() else ("refused otherwise", line[:300])
    except Exception:
        return "traceback", traceback.format_exc().splitlines()[-1]
    return None
