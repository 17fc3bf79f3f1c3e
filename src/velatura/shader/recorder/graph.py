"""Recorded values put in order: equal ones made one, and known ones replaced by their names."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from velatura.ops import Value
from velatura.shader.recorder.symbol import Operand, Symbol, in_order, inside, operand

COMMUTE = {"add", "multiply", "minimum", "maximum", "both"}
DEAR = dict.fromkeys(("exp", "log", "sin", "cos", "power", "arctan2"), 4)  # as many operations


@dataclass
class Graph:
    """Symbols without duplicates.

    `given` are symbols of another graph that need not be computed, with the values read in their place.
    """

    given: Mapping[Symbol, Symbol] = field(default_factory=dict)
    _known: dict[Hashable, Symbol] = field(default_factory=dict)
    _chosen: dict[Symbol, Operand] = field(default_factory=dict)

    def unique(self, outputs: Sequence[Value]) -> list[Operand]:
        """The outputs, made of symbols of this graph."""
        for symbol in in_order(outputs):
            if symbol not in self._chosen:
                self._chosen[symbol] = self.given[symbol] if symbol in self.given else self._one(symbol)
        return [self._of(operand(x)) for x in outputs]

    def _of(self, x: Operand) -> Operand:
        return self._chosen[x] if isinstance(x, Symbol) else x

    def _one(self, symbol: Symbol) -> Operand:
        args = tuple(self._of(x) for x in symbol.args)
        if symbol.op == "select" and args[1] is args[2]:
            return args[1]
        names = [(type(x).__name__, id(x) if isinstance(x, Symbol) else x) for x in args]
        key = (symbol.op, symbol.detail, *(sorted(names) if symbol.op in COMMUTE else names))
        found = self._known.setdefault(key, symbol)
        if found is not symbol:
            found.name = found.name or symbol.name
        elif args != symbol.args:
            found = self._known[key] = symbol.with_args(args)
        return found


def renamed(outputs: Sequence[Value], name: Callable[[Symbol], Any]) -> list[Operand]:
    """The outputs with other details of some symbols, where `name` gives any."""
    found: dict[Symbol, Symbol] = {}
    for symbol in in_order(outputs):
        args = tuple(found[x] if isinstance(x, Symbol) else x for x in symbol.args)
        found[symbol] = symbol.with_args(args, name(symbol))
    return [found[x] if isinstance(x, Symbol) else x for x in map(operand, outputs)]


def known_before(
    outputs: Sequence[Operand], given: Collection[Symbol], later: tuple[str, ...], least: int
) -> list[Symbol]:
    """The numbers and colours that do not depend on inputs whose names begin as `later` says, and that values which do
    are made of: those that take that many operations at least. What is `given` takes none."""
    order = in_order(outputs, given)
    bound, depend = inside(order), _depending(order, given, later)
    read = {y for x in order if x in depend or bound[x] for y in x.args if isinstance(y, Symbol)}
    found = dict.fromkeys(given)
    for x in order:
        known = x in read and x not in depend and not bound[x] and x.kind in ("number", "colour")
        if known and x not in found and sum(work(y) for y in in_order([x], found) if y not in found) >= least:
            found[x] = None
    return [x for x in found if x not in given]


def _depending(order: Sequence[Symbol], given: Collection[Symbol], later: tuple[str, ...]) -> set[Symbol]:
    """The symbols that depend on inputs whose names begin as `later` says."""
    found = set[Symbol]()
    for x in order:
        is_later = x.op == "input" and x.detail.startswith(later)
        if x not in given and (is_later or any(y in found for y in x.args)):
            found.add(x)
    return found


def work(x: Symbol) -> int:
    """Operations that a value takes."""
    return 0 if x.op in ("input", "component", "item") else DEAR.get(x.op, 1)
