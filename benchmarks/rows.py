"""Rows of a benchmark: a printed line for each measurement, and the same for the report of `make bench`."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from statistics import quantiles

NOTES = "VELATURA_BENCH_ROWS"  # the file that a run of tools/bench.py collects rows in


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
