"""Look-ups that only one side of a choice needs, so that a branch may leave them out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias

from velatura.shader.recorder.symbol import Operand, Symbol, in_order, inside

OWN, ANY = 3, 4  # channels: that in which the value itself is used, any


class Where(NamedTuple):
    """A condition that holds, or does not; of one of channels, that of a number from 0, or OWN or ANY."""

    condition: Symbol
    holds: bool
    channel: int


Case: TypeAlias = frozenset[Where]

LOOK_UPS = frozenset({"texels", "value", "film"})


def needed(outputs: Sequence[Operand]) -> dict[Symbol, Case]:
    """The case in which each look-up is needed, for those that are not always.

    Within loops, conditions are known before the look-up: they were recorded earlier, in the same loops or around them.
    """
    order = in_order(outputs)
    bound = inside(order)
    cases = dict[Symbol, Case]({x: frozenset() for x in outputs if isinstance(x, Symbol)})
    for symbol in reversed(order):
        for k, x in enumerate(symbol.args):
            if isinstance(x, Symbol):
                case = frozenset(_passed(each, symbol, k) for each in cases[symbol]) | _chosen(symbol, k)
                cases[x] = cases[x] & case if x in cases else case
    found = {}
    for symbol in order:
        if symbol.op not in LOOK_UPS:
            continue
        own = bound[symbol]
        known = (
            x for x in cases[symbol] if bound[x.condition] <= own and (not own or x.condition.serial < symbol.serial)
        )
        if case := frozenset(known):
            found[symbol] = case
    return found


def _passed(where: Where, symbol: Symbol, k: int) -> Where:
    """The same for an argument of this number: channels are those of the value until something mixes them."""
    apart = symbol.kind == "colour" and symbol.op != "colour" and symbol.op not in LOOK_UPS
    if where.channel != OWN or apart:
        return where
    return where._replace(channel=k if symbol.op == "colour" else ANY)


def _chosen(symbol: Symbol, k: int) -> Case:
    """The case in which a choice takes its argument of this number."""
    condition = symbol.args[0]
    if symbol.op != "select" or k == 0 or not isinstance(condition, Symbol):
        return frozenset()
    return frozenset({Where(condition, k == 1, OWN if condition.kind == "conditions" else ANY)})


def ordered(order: Sequence[Symbol], cases: Mapping[Symbol, Case]) -> list[Symbol]:
    """Symbols in order, the conditions of look-ups before these."""
    done: dict[Symbol, None] = {}
    for symbol in order:
        waiting = [symbol]
        while waiting:
            x = waiting[-1]
            first = [*x.args, *(where.condition for where in cases.get(x, ()))]
            missing = [y for y in first if isinstance(y, Symbol) and y not in done]
            if x in done or not missing:
                done[waiting.pop()] = None
            else:
                waiting += sorted(missing, key=lambda y: -y.serial)
    return list(done)


def most(counts: Mapping[Symbol, int], cases: Mapping[Symbol, Case]) -> int:
    """The largest sum of numbers, each of which counts in its case; channels may differ."""
    total, by_condition = 0, dict[Symbol, tuple[int, int]]()
    for x, count in counts.items():
        single = [where for where in cases.get(x, ()) if where.condition.kind == "condition"]
        if not single:
            total += count
            continue
        first = min(single, key=lambda where: where.condition.serial)
        held, other = by_condition.get(first.condition, (0, 0))
        by_condition[first.condition] = (held + count, other) if first.holds else (held, other + count)
    return total + sum(map(max, by_condition.values()))
