"""Options of programs, and their rows: a printed line for each measurement, and the same for `make bench`."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from statistics import quantiles
from typing import Any, TypeVar

T = TypeVar("T")

NOTES = "VELATURA_BENCH_ROWS"  # the file that a run of tools/bench.py collects rows in
PAUSE = 30  # seconds between two reports of a long series


def counted(each: Iterable[T], total: int, name: str) -> Iterator[T]:
    """The things of a series; how many are done is written to the standard error stream from time to time."""
    start = said = time.monotonic()
    for done, one in enumerate(each):
        if time.monotonic() > said + PAUSE:
            said = time.monotonic()
            print(f"{name}: {done} of {total} in {said - start:.0f} s", file=sys.stderr, flush=True)
        yield one


def row(table: str, name: str, values: float | Sequence[float], unit: str = "s", remark: str = "") -> None:
    """Print the median of repeated measurements with its quartiles, and note them for the report."""
    measured = [float(x) for x in values] if isinstance(values, Sequence) else [float(values)]
    low, median, high = quantiles(measured, n=4, method="inclusive") if len(measured) > 1 else measured * 3
    spread = f" ({low:.3g} to {high:.3g}, {len(measured)} times)" if len(measured) > 1 else ""
    print(f"{table:12s} {name:40s} {median:.3g} {unit}{spread}{f'; {remark}' if remark else ''}", flush=True)
    if path := os.environ.get(NOTES):
        found = {"table": table, "name": name, "unit": unit, "median": median, "low": low, "high": high}
        with open(path, "a", encoding="utf-8") as file:
            file.write(json.dumps({**found, "times": len(measured), "remark": remark}) + "\n")


def parser(about: str | None, **options: Any) -> argparse.ArgumentParser:
    """The parser of a program: an option for each name, given as its default, or as a tuple of that, help and choices.

    A truth value makes a flag, a list takes several values; a type in its place is that of an option without one.
    """
    found = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, given in options.items():
        default, meaning, choices = (*given, None)[:3] if isinstance(given, tuple) else (given, None, None)
        kind, default = (default, None) if isinstance(default, type) else (type(default), default)
        more: dict[str, Any] = {"type": kind, "choices": choices}
        if kind is bool:
            more = {"action": argparse.BooleanOptionalAction if default else "store_true"}
        elif issubclass(kind, list):
            more = {"nargs": "+", "choices": choices}
        elif issubclass(kind, Path):
            more["type"] = Path
        found.add_argument(f"--{name.replace('_', '-')}", default=default, help=meaning, **more)
    return found


def parsed(about: str | None, **options: Any) -> argparse.Namespace:
    """The options of the command line: see `parser`."""
    return parser(about, **options).parse_args()
