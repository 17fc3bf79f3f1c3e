"""Requests to one model whose answers another model, that cannot be solved itself, reads as is wanted."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from velatura import ops
from velatura.inverse.partial_stack import Array

ROUNDS, ENOUGH = 24, 1e-6  # of requests, and what may be missing, in units of the goal
SMALL = 0.01  # reading, in these units, of which no ratio is taken
RATIO = 0.1, 10.0  # bounds of that

Found = TypeVar("Found")


def met(
    ask: Callable[[Array], Found | None],
    read: Callable[[Found], Array],
    first: Array,
    goal: Array,
    scale: Array,
) -> Found | None:
    """The answer whose reading is nearest to a goal, by Broyden's method; None if the first request has no answer.

    Args:
        ask: the answer to a request, None where there is none.
        read: the reading of an answer, in the order of the goal.
        first: the first request.
        scale: units of the goal.
    """
    best, least, request = None, np.inf, first
    last: tuple[Array, Array] | None = None
    change = np.eye(len(goal))  # of requests, by that of readings
    for _ in range(ROUNDS):
        found = ask(request)
        if found is None:
            if last is None:
                return None
            request = 0.5 * (request + last[0])
            continue
        value = read(found)
        missing = (goal - value) / scale
        if np.linalg.norm(missing) < least:
            best, least = found, float(np.linalg.norm(missing))
        if least < ENOUGH:
            break
        if last is None:
            large = np.abs(value) > SMALL * scale
            change = np.diag(np.where(large, np.clip(ops.divide(request, value), *RATIO), 1.0))
        else:
            step, turn = (request - last[0]) / scale, (value - last[1]) / scale
            back = step @ change
            change = change + np.outer(step - change @ turn, ops.divide(back, back @ turn))
        last, request = (request, value), request + scale * (change @ missing)
    return best
