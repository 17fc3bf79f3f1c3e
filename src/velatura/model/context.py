"""The context of a computation: the number types of a renderer, permission to sample over direction, and the tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from velatura import tables
from velatura.ops import Value
from velatura.tables import Tables


def as_it_is(value: Value) -> Value:
    return value


def in_silence(done: int, total: int) -> None:
    """No progress is shown."""


def channels(*values: Value) -> np.ndarray:
    """A colour in NumPy, from its channels, or from one value for all."""
    return np.stack(values) if len(values) > 1 else np.broadcast_to(values[0], (3, np.shape(values[0])[-1]))


@dataclass(frozen=True)
class Context:
    """The source of the numbers of a material; by default NumPy's, of one material.

    Args:
        constant: whether the values hold for all points, and may be looked at now.
        number: Dr.Jit's type of numbers, to have what depends on direction alone sampled once; None to work it out for
            every direction.
        colour: makes a colour of its channels, in sampled values; None if none are sampled.
        settle: applied to intermediate values; a renderer evaluates them, so that one kernel serves all.
        tables: the averages over rough interfaces.
        progress: called with steps done and their total while textures are tabulated.
    """

    constant: bool = True
    number: type | None = None
    colour: Callable[..., Value] | None = channels
    settle: Callable[[Value], Value] = as_it_is
    tables: Tables = field(default_factory=tables.load)
    progress: Callable[[int, int], None] = in_silence


def at_a_point() -> Context:
    """Context of values that may differ from point to point, or that are recorded."""
    return Context(constant=False)
