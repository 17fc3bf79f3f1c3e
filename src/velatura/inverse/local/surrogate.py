"""Requests to one model whose answers another model, that cannot be solved itself, reads as is wanted."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from velatura.inverse.lobes.partial_stack import Array, Mask

ROUNDS, ENOUGH = 24, 1e-6  # of requests, and what may be missing, in units of the goal
PATIENCE = 6  # rounds without an answer that is nearer
REACH = 3.0  # the longest step, as a multiple of what is missing
SEEN = 0.01  # cosine between a change of the request and that of the reading, below which it says nothing
CLOSE = 1e-4  # the shortest step back to a request with an answer, in units of the goal

Found = TypeVar("Found")


def met(
    ask: Callable[[Array], Found | None],
    read: Callable[[Found], Array],
    first: Array,
    goal: Array,
    scale: Array,
    free: Mask | None = None,
) -> Found | None:
    """The answer whose reading is nearest to a goal, by Broyden's method; None if the first request has no answer.

    Models differ by little, so that the first step asks for as much more as is missing.

    Args:
        ask: the answer to a request, None where there is none.
        read: the reading of an answer, in the order of the goal.
        first: the first request.
        scale: units of the goal.
        free: which numbers of a request may change, all if None. Readings of others do not count.
    """
    moving = slice(None) if free is None else free
    best, least, waited, request = None, np.inf, 0, first
    last: tuple[Array, Array] | None = None
    change = np.eye(len(goal[moving]))  # of requests, by that of readings
    for _ in range(ROUNDS):
        found = ask(request)
        if found is None:
            if last is None or np.abs((request - last[0]) / scale).max() < CLOSE:
                break
            request = 0.5 * (request + last[0])
            continue
        value = read(found)
        missing = ((goal - value) / scale)[moving]
        off = float(np.linalg.norm(missing))
        waited = 0 if off < least else waited + 1
        if waited == 0:
            best, least = found, off
        if least < ENOUGH or waited == PATIENCE:
            break
        if last is not None:
            step, turn = (((now - before) / scale)[moving] for now, before in zip((request, value), last))
            back = step @ change
            if abs(back @ turn) > SEEN * np.linalg.norm(back) * np.linalg.norm(turn):
                change = change + np.outer(step - change @ turn, back / (back @ turn))
        last, request = (request, value), request.copy()
        onwards = change @ missing
        request[moving] += scale[moving] * onwards * min(1.0, REACH * off / np.linalg.norm(onwards))
    return best
