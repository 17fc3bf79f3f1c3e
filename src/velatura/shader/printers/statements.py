"""Recorded values as statements of a function, in the language of a printer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
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
        where = self._case(symbol) if symbol in self.cases else ""
        return self.printer.texels(name, symbol.detail, atlas.texels(symbol.detail), args, where)

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
        wide, index, printer = any(is_colour(x) for x in symbol.args), self._free("i"), self.printer
        kind: Kind = "colour" if wide else "number"
        if nodes:
            results, values, filled = symbol.args, self._free("nodes"), name
            self.lines += [*printer.nodes(values, nodes), *printer.results(name, kind, len(results) * times)]
            read, first = {bound[0]: printer.item(values, index)}, f"{len(results)} * {index} + "
            places = [f"{first}{k}" for k in range(len(results))] if len(results) > 1 else [index]
        else:
            begin, results, filled = symbol.args[: len(bound)], symbol.args[len(bound) :], f"{name}_next"
            self.lines += printer.state(name, filled, kind, [self.of(x, wide=wide) for x in begin])
            read = {x: printer.item(name, str(k)) for k, x in enumerate(bound)}
            places = [str(k) for k in range(len(results))]

        # Write the values that depend on bound ones
        before, self.lines = self.lines, []
        outside, self.open = self.open, self.open | set(bound)
        body = [x for x in in_order(results) if set(bound) & self.inside[x] and self.inside[x] <= self.open]
        self.text |= {x: (read[x.detail], ATOM) for x in body if x.op == "bound"}
        self._write([x for x in body if x.op != "bound"])
        stored = [printer.store(filled, place, self.of(x, wide=wide)) for place, x in zip(places, results)]
        self.lines += stored if nodes else [*stored, printer.advance(name, filled)]
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
        if write := _EXPRESSIONS.get(op):
            return write(self, symbol, wide)
        if op == "minimum" and args[0] in self.clamped:
            assert isinstance(args[0], Symbol)
            return printer.call("clip", [self.of(x) for x in (*args[0].args, args[1])], wide), ATOM
        if op in printer.functions:
            return printer.call(op, [self.of(x, wide=wide) for x in args], wide), ATOM
        if wide and op in (*_COMPARE, "both"):
            return printer.each_channel(op, *(self.of(x, wide=op != "both") for x in args)), ATOM
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

    def select(self, symbol: Symbol) -> tuple[str, int]:
        """The text of a choice, and how strongly it binds."""
        condition, a, b = symbol.args
        wide = symbol.kind == "colour"
        if is_colour(condition):
            return self.printer.select_channels(self.of(condition), self.of(a, wide=True), self.of(b, wide=True)), ATOM
        return self.printer.select(self.of(condition, CONDITION), self.of(a, wide=wide), self.of(b, wide=wide))


def _component(s: _Statements, x: Symbol) -> str:
    (whole,) = x.args
    assert isinstance(whole, Symbol)
    return s.printer.component(s.of(whole, ATOM), x.detail, whole.kind)


#: Texts of operations that are neither functions nor operators of a language, and how strongly they bind.
_EXPRESSIONS: dict[str, Callable[[_Statements, Symbol, bool], tuple[str, int]]] = {
    "input": lambda s, x, wide: (s.printer.input(x.detail), ATOM),
    "value": lambda s, x, wide: (s.printer.value(x.detail, [s.of(each, wide=wide) for each in x.args], wide), ATOM),
    "film": lambda s, x, wide: (s.printer.film(x.detail, list(map(s.of, x.args))), ATOM),
    "item": lambda s, x, wide: (s.printer.item(s.of(x.args[0], ATOM), str(x.detail)), ATOM),
    "component": lambda s, x, wide: (_component(s, x), ATOM),
    "colour": lambda s, x, wide: (s.printer.colour(list(map(s.of, x.args))), ATOM),
    "negative": lambda s, x, wide: (f"-{s.of(x.args[0], ATOM)}", NEGATIVE),
    "select": lambda s, x, wide: s.select(x),
}
