"""The parts of a validation: its sliders, and the curves and words of its answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Slider:
    """A number that may be chosen, and its meaning."""

    doc: str
    low: float
    high: float
    default: float


@dataclass(frozen=True)
class Validation:
    """A page: its subject, its sliders by name, and the function that answers them.

    of: "interface" where an interface of the material may set the sliders; "pairs" where the answer is of the material
    with the roughnesses of one interface at the sliders, and the function also takes the body.
    """

    title: str
    doc: str
    sliders: Mapping[str, Slider]
    answer: Callable[..., dict[str, Any]]
    of: str = ""


def alpha_slider(doc: str, default: float) -> Slider:
    """A slider for a roughness."""
    return Slider(doc, 0, 0.9, default)


def curve_of(label: str, kind: str, x: Any, y: Any, error: Any = None) -> dict[str, Any]:
    """A curve of kind `truth` or `model`; error: its standard error where it is counted."""
    curve = {"label": label, "kind": kind, "x": np.asarray(x).tolist(), "y": np.asarray(y).tolist()}
    return curve if error is None else {**curve, "error": error.tolist()}


def axis_of(label: str, low: float | None = 0.0, high: float | None = None) -> dict[str, Any]:
    """An axis; an end that is None is what fits."""
    return {"label": label, "low": low, "high": high}


def answer_of(curves: list[dict[str, Any]], axes: dict[str, Any], says: str) -> dict[str, Any]:
    """An answer of curves."""
    return {"curves": curves, "axes": axes, "says": says}


def in_words(numbers: Mapping[str, float]) -> str:
    """Numbers by name."""
    return ", ".join(f"{name} {number:.3f}" for name, number in numbers.items())
