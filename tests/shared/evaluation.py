"""Values of recorded expressions, in NumPy."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from velatura import ops, tables
from velatura.ops import Value
from velatura.shader.recorder.symbol import Operand, Symbol, in_order, inside, operand
from velatura.tables.store import Table

_ARITHMETIC: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": operator.truediv,
    "negative": operator.neg,
    "both": operator.and_,
    "less": operator.lt,
    "greater": operator.gt,
    "at_most": operator.le,
    "at_least": operator.ge,
}


def evaluate(outputs: Sequence[Value], values: Mapping[str, Any]) -> list[Any]:
    """The outputs for values of the inputs: numbers (N,) and colours (3, N); `vt_baked` is what reads a group of texels
    at a place, `vt_films` are tables of films by name."""
    return _evaluate(outputs, values, {})


def _evaluate(outputs: Sequence[Value], values: Mapping[str, Any], known: Mapping[Symbol, Any]) -> list[Any]:
    """The outputs, where the values of some symbols are known."""
    done = dict(known)

    def of(x: Operand) -> Any:
        if isinstance(x, Symbol):
            return done[x]
        return np.array(x)[:, None] if isinstance(x, tuple) else x

    order, within = _order(tuple(x for x in outputs if isinstance(x, Symbol)))
    for symbol in order:
        if symbol in done:
            continue
        if symbol.kind == "loop":
            done[symbol] = _looped(symbol, values, done)
        elif within[symbol] <= values.keys():
            done[symbol] = _evaluated(symbol, [of(x) for x in symbol.args], values)
    return [of(operand(x)) for x in outputs]


@functools.lru_cache  # a loop has the same order every time
def _order(symbols: tuple[Symbol, ...]) -> tuple[list[Symbol], dict[Symbol, frozenset[str]]]:
    order = in_order(symbols)
    return order, inside(order)


def _looped(loop: Symbol, values: Mapping[str, Any], known: Mapping[Symbol, Any]) -> list[Any]:
    bound, nodes, times = loop.detail
    if nodes:
        return [x for node in nodes for x in _evaluate(loop.args, {**values, bound[0]: node}, known)]
    state = _evaluate(loop.args[: len(bound)], values, known)
    for _ in range(times):
        state = _evaluate(loop.args[len(bound) :], {**values, **dict(zip(bound, state))}, known)
    return state


def _evaluated(symbol: Symbol, args: list[Any], values: Mapping[str, Any]) -> Any:
    if symbol.op in ("input", "bound"):
        return values[symbol.detail]
    if symbol.op in ("component", "item"):
        return args[0][symbol.detail]
    if symbol.op == "colour":
        return np.stack(np.broadcast_arrays(*map(np.atleast_1d, args)))
    if symbol.op in ("texels", "value"):
        channels = ops.interpolate(getattr(tables.load(), symbol.detail), *args)
        return channels if symbol.op == "texels" else channels[0]
    if symbol.op == "film":
        table = Table(values["vt_films"][symbol.detail])
        return np.stack([np.ravel(x) for x in ops.interpolate(table, *args)])
    if symbol.op == "baked":
        return values["vt_baked"](symbol.detail, args)
    function: Callable[..., Any] = _ARITHMETIC.get(symbol.op) or getattr(ops, symbol.op)
    return function(*args)
