"""Recorded values as statements of GLSL ES 3.00."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import chain, count

import numpy as np

from velatura.shader import atlas
from velatura.shader.symbol import Kind, Operand, Symbol, in_order, inside, is_colour

TYPES: dict[Kind, str] = {
    "number": "float",
    "colour": "vec3",
    "condition": "bool",
    "conditions": "bvec3",
}
HELPERS = """\
float vt_sqrt(float x) { return sqrt(max(x, 0.0)); }
vec3 vt_sqrt(vec3 x) { return sqrt(max(x, 0.0)); }
float vt_mean(vec3 x) { return (x.r + x.g + x.b) / 3.0; }

// Drivers may leave sine and cosine with errors of 2e-4; this series is as good as single precision
vec3 vt_sin(vec3 x) {
    vec3 turns = round(x / 3.14159265), y = (x - turns * 3.140625) - turns * 9.67653590e-4, z = y * y;
    vec3 odd = 1.0 - 2.0 * mod(turns, 2.0);
    vec3 series = 1.0 / 120.0 - z * (1.0 / 5040.0 - z * (1.0 / 362880.0 - z / 39916800.0));
    return odd * (y - y * z * (1.0 / 6.0 - z * series));
}
float vt_sin(float x) { return vt_sin(vec3(x)).x; }
vec3 vt_cos(vec3 x) { return vt_sin(x + 1.57079633); }
float vt_cos(float x) { return vt_sin(x + 1.57079633); }

bvec3 vt_both(bvec3 a, bvec3 b) { return bvec3(a.x && b.x, a.y && b.y, a.z && b.z); }
"""

_LONG = 72  # characters of an expression that gets a name of its own
_FUNCTIONS = {
    "exp": "exp",
    "log": "log",
    "sin": "vt_sin",
    "cos": "vt_cos",
    "sqrt": "vt_sqrt",
    "absolute": "abs",
    "mean": "vt_mean",
}
_TWO = {"power": "pow", "arctan2": "atan", "minimum": "min", "maximum": "max"}
_OPERATORS = {  # with their precedence
    "add": ("+", 5),
    "subtract": ("-", 5),
    "multiply": ("*", 6),
    "divide": ("/", 6),
    "less": ("<", 3),
    "greater": (">", 3),
    "at_most": ("<=", 3),
    "at_least": (">=", 3),
    "both": ("&&", 2),
}
_COMPARE = {"less": "lessThan", "greater": "greaterThan", "at_most": "lessThanEqual", "at_least": "greaterThanEqual"}
_ATOM, _NEGATIVE, _CHOICE = 9, 7, 1
# Words of the language, functions that statements call, and the arguments
_WORDS = """
    abs acos active all any asin asm atan attribute break case cast class clamp coherent common const continue cos cross
    default degrees discard distance do dot else enum exp extern external false far filter fixed flat float floor for
    fract goto greaterThan greaterThanEqual half highp if in inline inout input int interface invariant l layout length
    lessThan lessThanEqual log long lowp m main max mediump min mix mod namespace near noinline noise normalize not out
    output partition patch place pow precision public radians reflect refract resource return row sample sampler short
    sign sin sizeof smooth sqrt static step struct superp switch tan template texel texels texture this true typedef u
    uniform union unsigned using varying void volatile wi while wo
"""


def statements(outputs: Sequence[tuple[Operand, Kind]]) -> tuple[list[str], list[str]]:
    """Lines that work out the outputs, and an expression for each, of the kind given."""
    written = _Statements([value for value, _ in outputs])
    return written.lines, [written.of(value, wide=kind == "colour") for value, kind in outputs]


def _type(symbol: Symbol) -> str:
    if symbol.kind == "texels":
        return f"vec4[{symbol.detail.texels if symbol.op == 'baked' else atlas.texels(symbol.detail)}]"
    return TYPES[symbol.kind]


def literal(x: Operand) -> str:
    """A constant."""
    if isinstance(x, tuple):
        return f"vec3({', '.join(literal(channel) for channel in x)})"
    if isinstance(x, bool):
        return "true" if x else "false"
    assert not isinstance(x, Symbol)
    text = str(np.float32(x))
    return text if "." in text or "e" in text else f"{text}.0"


def block(head: str, lines: Sequence[str]) -> str:
    """A function or struct with its lines."""
    return "\n".join([f"{head} {{", *(f"    {line}".rstrip() for line in lines), "}", ""])


class _Statements:
    """Names for values that are used more than once, that the model names, or that are long."""

    def __init__(self, outputs: Sequence[Operand]) -> None:
        order = in_order(outputs)
        self.uses = Counter(x for symbol in order for x in symbol.args if isinstance(x, Symbol))
        self.uses.update(x for x in outputs if isinstance(x, Symbol))
        self.inside = inside(order)
        self.open: frozenset[str] = frozenset()  # what is bound where we are
        self.text: dict[Symbol, tuple[str, int]] = {}
        self.taken = set(_WORDS.split())
        self.lines: list[str] = []
        self._write([symbol for symbol in order if not self.inside[symbol]])

    def _write(self, order: Sequence[Symbol]) -> None:
        title = ""
        for symbol in order:
            text, precedence = ("", _ATOM) if symbol.kind == "loop" else self._expression(symbol)
            if symbol.kind != "loop" and self._inline(symbol, text):
                self.text[symbol] = text, precedence
                continue
            if symbol.title != title:
                title = symbol.title
                self.lines += ["", *([f"// {title}"] if title else [])]
            name = self._name(symbol)
            if symbol.kind == "loop":
                self._loop(symbol, name)
            else:
                self.lines.append(f"{_type(symbol)} {name} = {text};")
            self.text[symbol] = name, _ATOM

    def _loop(self, symbol: Symbol, name: str) -> None:
        """A loop that fills an array, or goes from one state to the next."""
        bound, nodes, times = symbol.detail
        count = len(symbol.args) - (0 if nodes else len(bound))
        results, wide = symbol.args[-count:], any(is_colour(x) for x in symbol.args)
        kind, index = "vec3" if wide else "float", self._free("i")
        if nodes:
            values = self._free("nodes")
            listed = f"float[{times}]({', '.join(map(literal, nodes))})"
            self.lines += [f"const float {values}[{times}] = {listed};", f"{kind} {name}[{count * times}];"]
        else:
            begin = ", ".join(self.of(x, wide=wide) for x in symbol.args[:count])
            self.lines += [f"{kind} {name}[{count}] = {kind}[{count}]({begin}), {name}_next[{count}];"]
        self.lines.append(f"for (int {index} = 0; {index} < {times}; {index}++) {{")

        # Write what depends on what is bound
        before, self.lines = self.lines, []
        outside, self.open = self.open, self.open | set(bound)
        body = [x for x in in_order(results) if set(bound) & self.inside[x] and self.inside[x] <= self.open]
        for x in body:
            if x.op == "bound":
                self.text[x] = f"{values}[{index}]" if nodes else f"{name}[{bound.index(x.detail)}]", _ATOM
        self._write([x for x in body if x.op != "bound"])
        place = f"{count} * {index} + " if nodes and count > 1 else ""
        for k, result in enumerate(results):
            at = (f"{place}{k}" if count > 1 else index) if nodes else str(k)
            self.lines.append(f"{name}{'' if nodes else '_next'}[{at}] = {self.of(result, wide=wide)};")
        if not nodes:
            self.lines.append(f"{name} = {name}_next;")
        for x in body:
            del self.text[x]
        self.open = outside
        self.lines = [*before, *(f"    {line}".rstrip() for line in self.lines), "}"]

    def of(self, x: Operand, least: int = 0, wide: bool = False) -> str:
        """An argument, in parentheses where it binds less than `least`; a number made a colour where it is `wide`."""
        if not isinstance(x, Symbol):
            text, precedence = literal(x), _NEGATIVE if isinstance(x, float) and x < 0 else _ATOM
        else:
            text, precedence = self.text[x]
        if wide and not is_colour(x):
            return f"vec3({text})"
        return f"({text})" if precedence < least else text

    def _inline(self, symbol: Symbol, text: str) -> bool:
        if symbol.op in ("input", "component", "item") and len(text) < _LONG:
            return True
        return self.uses[symbol] == 1 and not symbol.name and symbol.kind != "texels" and len(text) < _LONG

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
        op, args, wide = symbol.op, symbol.args, any(is_colour(x) for x in symbol.args)
        if op == "input":
            return symbol.detail, _ATOM
        if op in ("texels", "value"):
            return f"vt_{symbol.detail}({', '.join(self.of(x, wide=wide) for x in args)})", _ATOM
        if op == "baked":
            return f"vt_baked_{symbol.detail.name}(vec3({', '.join(map(self.of, args))}))", _ATOM
        if op == "item":
            return f"{self.of(args[0], _ATOM)}[{symbol.detail}]", _ATOM
        if op == "component":
            texel, channel = divmod(symbol.detail, 4)
            of_texels = isinstance(args[0], Symbol) and args[0].kind == "texels"
            return f"{self.of(args[0], _ATOM)}{f'[{texel}]' if of_texels else ''}.{'rgba'[channel]}", _ATOM
        if op == "colour":
            return f"vec3({', '.join(map(self.of, args))})", _ATOM
        if op == "negative":
            return f"-{self.of(args[0], _ATOM)}", _NEGATIVE
        if op == "select":
            return self._selected(symbol)
        if op in _FUNCTIONS:
            return f"{_FUNCTIONS[op]}({self.of(args[0])})", _ATOM
        if op == "minimum" and self._clamps(symbol):
            assert isinstance(args[0], Symbol)
            return f"clamp({', '.join(map(self.of, (*args[0].args, args[1])))})", _ATOM
        if op in _TWO:
            return f"{_TWO[op]}({', '.join(self.of(x, wide=wide) for x in args)})", _ATOM
        if wide and op == "both":
            return f"vt_both({', '.join(f'bvec3({self.of(x)})' for x in args)})", _ATOM
        if wide and op in _COMPARE:
            return f"{_COMPARE[op]}({', '.join(self.of(x, wide=True) for x in args)})", _ATOM
        sign, precedence = _OPERATORS[op]
        return f"{self.of(args[0], precedence)} {sign} {self.of(args[1], precedence + 1)}", precedence

    def _clamps(self, symbol: Symbol) -> bool:
        """Whether it keeps a value that nothing else uses between two constants."""
        inner, high = symbol.args
        if not isinstance(inner, Symbol) or inner.op != "maximum" or self.uses[inner] > 1 or inner.name:
            return False
        x, low = inner.args
        return isinstance(x, Symbol) and isinstance(low, float) and isinstance(high, float)

    def _selected(self, symbol: Symbol) -> tuple[str, int]:
        condition, a, b = symbol.args
        wide = symbol.kind == "colour"
        if is_colour(condition):
            return f"mix({self.of(b, wide=True)}, {self.of(a, wide=True)}, {self.of(condition)})", _ATOM
        return f"{self.of(condition, 2)} ? {self.of(a, wide=wide)} : {self.of(b, wide=wide)}", _CHOICE
