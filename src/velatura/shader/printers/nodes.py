"""Recorded values as nodes of MaterialX, in XML.

Numbers are floats, colours vectors of three channels, since functions of nodes are defined for these; conditions are 1
or 0, or a vector of these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import NamedTuple

from velatura.shader.recorder.graph import Graph
from velatura.shader.recorder.symbol import Operand, Symbol, component, in_order, is_colour, operand

SMALL = 1e-4  # of constants: generators write six digits after the point
LOOKED_UP = frozenset({"texels", "value", "film", "baked"})  # operations that graphs have no nodes for

_BINARY = {"add": "add", "subtract": "subtract", "multiply": "multiply", "divide": "divide"}
_BINARY |= {"minimum": "min", "maximum": "max", "power": "power", "both": "multiply"}
_UNARY = {"exp": "exp", "log": "ln", "sin": "sin", "cos": "cos", "absolute": "absval"}
_COMPARED = {"greater": ("ifgreater", 1), "at_least": ("ifgreatereq", 1)}  # whether the first argument stays the first
_COMPARED |= {"less": ("ifgreater", -1), "at_most": ("ifgreatereq", -1)}


class Node(NamedTuple):
    """A value in a graph: its type, and the attribute that says where it comes from."""

    kind: str
    where: str


def constant(kind: str, *numbers: float) -> Node:
    return Node(kind, f'value="{", ".join(f"{x:.9g}" for x in numbers)}"')


def string(text: str) -> Node:
    return Node("string", f'value="{text}"')


class NodeGraph:
    """Nodes, in order; `lines` are their elements."""

    def __init__(self, prefix: str = "n") -> None:
        self.lines: list[str] = []
        self.prefix = prefix

    def node(self, category: str, kind: str, name: str = "", /, **inputs: Node) -> Node:
        name = name or f"{self.prefix}{len(self.lines)}"
        each = "".join(f'<input name="{key}" type="{x.kind}" {x.where} />' for key, x in inputs.items())
        self.lines.append(f'    <{category} name="{name}" type="{kind}">{each}</{category}>')
        return Node(kind, f'nodename="{name}"')

    def of(self, category: str, kind: str, a: Node, b: Node | float | None = None) -> Node:
        """A node of one input or two."""
        if b is None:
            return self.node(category, kind, **{"in": a})
        return self.node(category, kind, in1=a, in2=constant("float", b) if isinstance(b, float) else b)

    def converted(self, kind: str, x: Node) -> Node:
        return x if x.kind == kind else self.of("convert", kind, x)

    def channel(self, x: Node, channel: int) -> Node:
        return self.node("extract", "float", **{"in": x, "index": Node("integer", f'value="{channel}"')})

    def recorded(self, outputs: Sequence[Operand], inputs: Mapping[str, Node]) -> list[Node]:
        """The outputs, of inputs by the names that recorded values have for them."""
        found = list(map(operand, Graph().unique(outputs)))
        known: dict[Symbol, Node] = {}
        for symbol in in_order(found):
            known[symbol] = self._made(symbol, known, inputs)
        return [self._argument(x, known) for x in found]

    def _argument(self, x: Operand, known: Mapping[Symbol, Node], wide: bool = False) -> Node:
        """An operand; a number becomes a vector where it is `wide`."""
        if isinstance(x, Symbol):
            return self.converted("vector3", known[x]) if wide else known[x]
        channels = x if isinstance(x, tuple) else (float(x),)
        if any(0 < abs(channel) < SMALL for channel in channels):
            each = {f"in{k + 1}": self._small(channel) for k, channel in enumerate(channels)}
            found = each["in1"] if len(each) == 1 else self.node("combine3", "vector3", **each)
            return self.converted("vector3", found) if wide else found
        channels = channels * 3 if wide and len(channels) == 1 else channels
        return constant("vector3" if len(channels) == 3 else "float", *channels)

    def _small(self, x: float) -> Node:
        """A number that may be small, by its exponent."""
        if not 0 < abs(x) < SMALL:
            return constant("float", x)
        exponent = floor(log10(abs(x)))
        power = self.of("power", "float", constant("float", 10.0), float(exponent))
        return self.of("multiply", "float", power, x / 10.0**exponent)

    def _made(self, symbol: Symbol, known: Mapping[Symbol, Node], inputs: Mapping[str, Node]) -> Node:
        """The node of an operation on what is known."""
        op, args, wide = symbol.op, symbol.args, is_colour(symbol)
        kind = "vector3" if wide else "float"

        def arguments(*these: Operand) -> list[Node]:
            return [self._argument(x, known, wide) for x in these]

        if op == "input":
            return self.converted(kind, inputs[symbol.detail])
        if op == "component":
            return self.channel(self._argument(args[0], known), symbol.detail)
        if op == "colour":
            return self.node("combine3", kind, **{f"in{k + 1}": self._argument(x, known) for k, x in enumerate(args)})
        if op == "mean":
            return self.of("dotproduct", "float", self._argument(args[0], known), constant("vector3", *[1 / 3] * 3))
        if op == "negative":
            return self.of("multiply", kind, arguments(*args)[0], -1.0)
        if op == "sqrt":
            return self.of("sqrt", kind, self.of("max", kind, arguments(*args)[0], 0.0))
        if op == "arctan2":
            y, x = arguments(*args)
            return self.node("atan2", kind, iny=y, inx=x)
        if op in _COMPARED:
            one, zero = (constant(kind, *[x] * (3 if wide else 1)) for x in (1.0, 0.0))
            return self._compared(symbol, one, zero, known)
        if op == "select":
            a, b = arguments(*args[1:])
            return self._compared(args[0], a, b, known)
        if op in _UNARY:
            return self.of(_UNARY[op], kind, *arguments(*args))
        return self.of(_BINARY[op], kind, *arguments(*args))

    def _compared(self, condition: Operand, a: Node, b: Node, known: Mapping[Symbol, Node]) -> Node:
        """`a` where a condition holds, else `b`; by channel where it is one of channels."""
        if is_colour(condition):
            each = [self._held(condition, k, self.channel(a, k), self.channel(b, k), known) for k in range(3)]
            return self.node("combine3", "vector3", in1=each[0], in2=each[1], in3=each[2])
        return self._held(condition, None, a, b, known)

    def _held(self, condition: Operand, channel: int | None, a: Node, b: Node, known: Mapping[Symbol, Node]) -> Node:
        assert isinstance(condition, Symbol)
        values: list[Node]
        if condition.op in _COMPARED:
            category, order = _COMPARED[condition.op]
            values = [self._channel(x, channel, known) for x in condition.args[::order]]
        else:
            category, values = "ifgreater", [self._channel(condition, channel, known), constant("float", 0.5)]
        return self.node(category, a.kind, value1=values[0], value2=values[1], in1=a, in2=b)

    def _channel(self, x: Operand, channel: int | None, known: Mapping[Symbol, Node]) -> Node:
        """A channel of a vector; a number is the same in all."""
        if isinstance(x, Symbol) and is_colour(x) and channel is not None:
            return self.channel(known[x], channel)
        return self._argument(component(x, channel or 0), known)
