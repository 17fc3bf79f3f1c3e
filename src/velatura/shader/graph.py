"""Recorded values put in order: equal ones made one, and known ones replaced by their names."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field

from velatura.ops import Value
from velatura.shader.symbol import Operand, Symbol, in_order, operand

COMMUTE = {"add", "multiply", "minimum", "maximum", "both"}


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
