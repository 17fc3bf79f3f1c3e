"""A comparison as one figure."""

from __future__ import annotations

from pathlib import Path

from velatura.comparison.result import Comparison


def save_figure(comparison: Comparison, path: str | Path) -> None:
    raise NotImplementedError
