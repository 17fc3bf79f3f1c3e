"""Recorded values as statements of a function, in the language of a printer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain, count

from velatura.shader.lookups import atlas
from velatura.shader.printers.printer import ATOM, CONDITION, NEGATIVE, Language, Output
from velatura.shader.recorder.needed import OWN, needed, ordered
from velatura.shader.recorder.symbol import Kind, Operand, Symbol, in_order, inside, is_colour

ARGUMENTS = frozenset({"m", "l", "wi", "wo", "u"})  # of the functions
_LONG = 104  # characters of an expression that gets a name of its own
_COMPARE = ("less", "greater", "at_most", "at_least")


def statements(outputs: Sequence[Output], printer: Language) -> tuple[list[str], list[str]]:
    """Lines that work out the outputs, and an expression for each, of the kind given."""
    written = _Statements([value for value, _ in outputs], printer, {})
    return written.lines, [written.of(value, wide=kind == "colour") for value, kind in outputs]


def assignments(outputs: Mapping[str, Output], printer: Language) -> list[str]:
    """Lines that put outputs into places, as soon as they are worked out."""
    places: dict[Symbol, str] = {}
    for place, (value, kind) in outputs.items():
        if isinstance(value, Symbol) and value.op != "input" and value.kind == kind:
            places.setdefault(value, place)
    written, put = _Statements([value for value, _ in outputs.values()], printer, places), places.values()
    others = ((place, value, kind == "colour") for place, (value, kind) in outputs.items() if place not in put)
    return written.lines + [printer.put(place, written.of(value, wide=wide)) for place, value, wide in others]


class _Statements:
    """Names for values that are used more than once, that the model names, or that are long; some have `places`."""

    def __init__(self, outputs: Sequence[Operand], printer: Language, places: Mapping[Symbol, str]) -> None:
        order = in_order(outputs)
        self.printer = printer
        self.places = places
        self.uses = Counter(x for symbol in order for x in symbol.args if isinstance(x, Symbol))
        self.uses.update(x for x in outputs if isinstance(x, Symbol))
        self.cases = needed(outputs) if printer.branches else {}
        self.uses.update(where.condition for case in self.cases.values() for where in case)
        self.clamped = {x.args[0] for x in order if self._clamps(x)}  # which need no text of their own
        self.inside = inside(order)
        self.open: frozenset[str] = frozenset()  # bound in the loops around this point
        self.text: dict[Symbol, tuple[str, int]] = {}
        self.taken = {*printer.words, *ARGUMENTS}
        self.lines: list[str] = []
        self._write([symbol for symbol in ordered(order, self.cases) if not self.inside[symbol]])

    def _write(self, order: Sequence[Symbol]) -> None:
        title = ""
        for symbol in order:
            if symbol in self.clamped:
                continue
            named = symbol.kind in ("loop", "texels")
            text, precedence = ("", ATOM) if named else self._expression(symbol)
            if not named and symbol not in self.cases and self._inline(symbol, text):
                self.text[symbol] = text, precedence
                continue
            if symbol.title != title:
                title = symbol.title
                self.lines += ["", *([self.printer.title(title)] if title else [])]
            if place := self.places.get(symbol):
                self.lines.append(self.printer.put(place, text))
                self.text[symbol] = place, ATOM
                continue
            name = self._name(symbol)
            if symbol.kind == "loop":
                self._loop(symbol, name)
            elif symbol.kind == "texels":
                self.lines += self._texels(symbol, name)
            elif symbol in self.cases:
                self.lines += self.printer.looked_up(name, symbol.kind, text, self._case(symbol))
            else:
                self.lines.append(self.printer.named(name, symbol.kind, text))
            self.text[symbol] = name, ATOM

    def _texels(self, symbol: Symbol, name: str) -> list[str]:
        """A look-up under a name, in a table or in the lobes over direction."""
        args = [self.of(x) for x in symbol.args]
        if symbol.op == "baked":
            return self.printer.baked(name, symbol.detail, args)
        count = atlas.texels(symbol.detail)
        if symbol not in self.cases:
            return self.printer.texels(name, symbol.detail, count, args)
        return self.printer.texels_where(self._case(symbol), name, symbol.detail, count, args)

    def _case(self, symbol: Symbol) -> str:
        """The condition on which a look-up is needed."""
        case = sorted(self.cases[symbol], key=lambda where: (where.condition.serial, where.channel))
        return self.printer.all_of([(self._held(x, channel), holds) for x, holds, channel in case])

    def _held(self, condition: Symbol, channel: int) -> tuple[str, Kind]:
        """A condition of channels, or of one."""
        text = self.text[condition][0]
        if condition.kind == "condition" or channel >= OWN:
            return text, condition.kind
        return self.printer.component(text, channel, condition.kind), "condition"

    def _loop(self, symbol: Symbol, name: str) -> None:
        """A loop that fills an array, or goes from one state to the next."""
        bound, nodes, times = symbol.detail
        count = len(symbol.args) - (0 if nodes else len(bound))
        results, wide = symbol.args[-count:], any(is_colour(x) for x in symbol.args)
        kind: Kind = "colour" if wide else "number"
        index, printer = self._free("i"), self.printer
        filled = name if nodes else f"{name}_next"
        if nodes:
            values = self._free("nodes")
            self.lines += [*printer.nodes(values, nodes), *printer.results(name, kind, count * times)]
        else:
            self.lines += printer.state(name, filled, kind, [self.of(x, wide=wide) for x in symbol.args[:count]])

        # Write the values that depend on bound ones
        before, self.lines = self.lines, []
        outside, self.open = self.open, self.open | set(bound)
        body = [x for x in in_order(results) if set(bound) & self.inside[x] and self.inside[x] <= self.open]
        for x in body:
            if x.op == "bound":
                self.text[x] = printer.item(*((values, index) if nodes else (name, str(bound.index(x.detail))))), ATOM
        self._write([x for x in body if x.op != "bound"])
        place = f"{count} * {index} + " if nodes and count > 1 else ""
        for k, result in enumerate(results):
            at = (f"{place}{k}" if count > 1 else index) if nodes else str(k)
            self.lines.append(printer.store(filled, at, self.of(result, wide=wide)))
        if not nodes:
            self.lines.append(printer.advance(name, filled))
        for x in body:
            self.text.pop(x, None)
        self.open = outside
        self.lines = [*before, *printer.loop(index, times, self.lines)]

    def of(self, x: Operand, least: int = 0, wide: bool = False) -> str:
        """An argument, in parentheses where it binds less than `least`; a number made a colour where it is `wide`."""
        if not isinstance(x, Symbol):
            text, precedence = self.printer.literal(x), NEGATIVE if isinstance(x, float) and x < 0 else ATOM
        else:
            text, precedence = self.text[x]
        if wide and not is_colour(x):
            return self.printer.colour([text])
        return f"({text})" if precedence < least else text

    def _inline(self, symbol: Symbol, text: str) -> bool:
        if symbol in self.places:
            return False
        if symbol.op in ("input", "component", "item") and len(text) < _LONG:
            return True
        if symbol.op == "negative" and text[1:].isidentifier():
            return True
        return self.uses[symbol] == 1 and not symbol.name and len(text) < _LONG

    def _name(self, symbol: Symbol) -> str:
        if symbol.kind == "texels":
            return self._free(symbol.detail.name if symbol.op == "baked" else symbol.detail)
        return self._free(symbol.name.strip("_").replace("__", "_") or "value")

    def _free(self, name: str) -> str:
        """The name, or with a number where it is taken."""
        free = (x for x in chain([name], (f"{name}_{n}" for n in count(2))) if x not in self.taken)
        self.taken.add(chosen := next(free))
        return chosen

    def _expression(self, symbol: Symbol) -> tuple[str, int]:
        """The text, and how strongly its last operator binds."""
        op, args, printer = symbol.op, symbol.args, self.printer
        wide = any(is_colour(x) for x in args)
        if op == "input":
            return printer.input(symbol.detail), ATOM
        if op == "value":
            return printer.value(symbol.detail, [self.of(x, wide=wide) for x in args], wide), ATOM
        if op == "film":
            return printer.film(symbol.detail, [self.of(x) for x in args]), ATOM
        if op == "item":
            return printer.item(self.of(args[0], ATOM), str(symbol.detail)), ATOM
        if op == "component":
            assert isinstance(args[0], Symbol)
            return printer.component(self.of(args[0], ATOM), symbol.detail, args[0].kind), ATOM
        if op == "colour":
            return printer.colour([self.of(x) for x in args]), ATOM
        if op == "negative":
            return f"-{self.of(args[0], ATOM)}", NEGATIVE
        if op == "select":
            return self._selected(symbol)
        if op == "minimum" and args[0] in self.clamped:
            assert isinstance(args[0], Symbol)
            return printer.call("clip", [self.of(x) for x in (*args[0].args, args[1])], wide), ATOM
        if op in printer.functions:
            return printer.call(op, [self.of(x, wide=wide) for x in args], wide), ATOM
        if wide and op == "both":
            return printer.each_channel(op, *map(self.of, args)), ATOM
        if wide and op in _COMPARE:
            return printer.each_channel(op, *(self.of(x, wide=True) for x in args)), ATOM
        sign, precedence = printer.operators[op]
        return f"{self.of(args[0], precedence)} {sign} {self.of(args[1], precedence + 1)}", precedence

    def _clamps(self, symbol: Symbol) -> bool:
        """Whether it keeps a value that nothing else uses between two constants."""
        if symbol.op != "minimum" or "clip" not in self.printer.functions:
            return False
        inner, high = symbol.args
        if not isinstance(inner, Symbol) or inner.op != "maximum" or self.uses[inner] > 1 or inner.name:
            return False
        x, low = inner.args
        return isinstance(x, Symbol) and isinstance(low, float) and isinstance(high, float)

    def _selected(self, symbol: Symbol) -> tuple[str, int]:
        condition, a, b = symbol.args
        wide = symbol.kind == "colour"
        if is_colour(condition):
            return self.printer.select_channels(self.of(condition), self.of(a, wide=True), self.of(b, wide=True)), ATOM
        return self.printer.select(self.of(condition, CONDITION), self.of(a, wide=wide), self.of(b, wide=wide))
