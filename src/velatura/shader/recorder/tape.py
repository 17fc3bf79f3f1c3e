"""Recorded values as a tape: one step after another on arrays of numbers, for a machine that compiles nothing.

A step is the name of an operation, details of it, and its arguments. Arguments are numbers of values: first come the
inputs, then the constants, then what each step has made. The page runs tapes (`editor/page/render/tape.js`).
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

from velatura.shader.recorder.graph import COMMUTE
from velatura.shader.recorder.symbol import Operand, Symbol, in_order

#: Operations with a detail besides their name: a table, or a channel.
_DETAILED = ("texels", "value", "component", "film")


@dataclass(frozen=True)
class Tape:
    """Inputs by name, constants (numbers, or three of them), steps, and which values are the outputs."""

    inputs: Sequence[str]
    constants: Sequence[float | tuple[float, ...]]
    steps: Sequence[Sequence[Any]]
    outputs: Sequence[int]

    @property
    def tables(self) -> list[str]:
        """The tables that are looked up."""
        return sorted({step[1] for step in self.steps if step[0] in ("texels", "value")})

    @property
    def films(self) -> list[str]:
        """The tables of films that are looked up."""
        return sorted({step[1] for step in self.steps if step[0] == "film"})


def tape(outputs: Sequence[Operand]) -> Tape:
    """The tape that computes the outputs; equal values are computed once."""
    order = in_order(outputs)
    inputs = list(dict.fromkeys(symbol.detail for symbol in order if symbol.op == "input"))
    arguments = chain(outputs, *(symbol.args for symbol in order))
    constants = list(dict.fromkeys(_constant(x) for x in arguments if not isinstance(x, Symbol)))
    constant = {x: k for k, x in enumerate(constants, len(inputs))}
    number: dict[Symbol, int] = {s: inputs.index(s.detail) for s in order if s.op == "input"}
    known: dict[Hashable, int] = {}
    steps: list[list[Any]] = []

    def numbers(args: Sequence[Operand]) -> list[int]:
        return [number[x] if isinstance(x, Symbol) else constant[_constant(x)] for x in args]

    for symbol in order:
        if symbol.op == "input":
            continue
        args = numbers(symbol.args)
        step = [symbol.op, *([symbol.detail] if symbol.op in _DETAILED else []), *args]
        key = (symbol.op, symbol.detail, *(sorted(args) if symbol.op in COMMUTE else args))
        number[symbol] = known.setdefault(key, len(inputs) + len(constants) + len(steps))
        if len(known) > len(steps):
            steps.append(step)
    return Tape(inputs, constants, steps, numbers(outputs))


def _constant(x: Operand) -> float | tuple[float, ...]:
    """Conditions are numbers: 1 where they hold."""
    assert not isinstance(x, Symbol)
    return x if isinstance(x, tuple) else float(x)
