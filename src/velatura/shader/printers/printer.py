"""A shader language: the spelling of values, statements and the parts of a program.

`shader.statements` puts the values of a function in order and names them, `shader.program` puts the parts of a program
in order; both take a printer, which gives each its text. A language is a class of its own with these methods; one whose
programs have other parts needs those of `Language` alone.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence, Set
from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeAlias

from velatura.shader.recorder.symbol import Kind, Operand

if TYPE_CHECKING:
    from velatura.shader.lookups.atlas import TableLayout
    from velatura.shader.lookups.lookup import Group, LookUp
    from velatura.shader.material import Filled
    from velatura.shader.recorder.cost import Cost

Output: TypeAlias = tuple[Operand, Kind]  # a value, and the kind as which it is returned

ATOM, NEGATIVE = 9, 7  # how strongly a text binds: nothing needs parentheses, a sign
CONDITION = 2  # how strongly the condition of a choice has to bind

# What languages of C's grammar have in common
FUNCTIONS = {op: op for op in ("exp", "log", "sin", "cos", "sqrt")} | {
    "absolute": "abs",
    "mean": "vt_mean",
    "power": "pow",
    "arctan2": "atan2",
    "minimum": "min",
    "maximum": "max",
    "clip": "clamp",
}
OPERATORS = {  # with how strongly they bind
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


class Field(NamedTuple):
    """A member of a struct: its kind, or the name of its struct; an array where `length` is not 0."""

    name: str
    type: Kind | str
    length: int = 0


class Struct(NamedTuple):
    name: str
    fields: Sequence[Field]
    comment: str


class Member(NamedTuple):
    """A stack of a mixture: its member in structs, the prefix of the names of its functions, and its share."""

    name: str
    functions: str
    share: Operand


class Language(ABC):
    """A shader language: the spelling of values and statements.

    Arguments that are texts are expressions, in parentheses where they need any; in what takes colours, numbers among
    them have been made colours before.

    Attributes:
        words: names that values of a function may not have, apart from its arguments.
        functions: by operation, the function of as many arguments; with `clip`, which takes three, of a number kept
            between two constants.
        operators: by operation of two values, its sign and how strongly that binds, from 2 to 6.
        branches: whether look-ups that only one side of a choice needs are left out by a branch, as `all_of`,
            `looked_up` and `texels` spell it.
    """

    words: ClassVar[frozenset[str]]
    functions: ClassVar[Mapping[str, str]] = FUNCTIONS
    operators: ClassVar[Mapping[str, tuple[str, int]]] = OPERATORS
    branches: ClassVar[bool] = False

    # Values

    def input(self, place: str) -> str:
        """An argument of a function: `m.layer0.eta`, `l.reflected[0].energy` or its `.r`, `wi.x`, `vt_shown[0]`."""
        return place

    @abstractmethod
    def literal(self, x: Operand) -> str:
        """A constant: a number, a condition, or a colour."""

    @abstractmethod
    def colour(self, channels: Sequence[str]) -> str:
        """A colour of three channels, or of one number that is the same in all."""

    @abstractmethod
    def component(self, x: str, channel: int, kind: Kind) -> str:
        """A channel of a colour, of conditions, or of texels, which have four channels each."""

    def item(self, array: str, place: str) -> str:
        """A value of an array."""
        return f"{array}[{place}]"

    def call(self, op: str, args: Sequence[str], wide: bool) -> str:
        """A function of numbers, or of colours where it is `wide`."""
        return f"{self.functions[op]}({', '.join(args)})"

    @abstractmethod
    def each_channel(self, op: str, a: str, b: str) -> str:
        """Conditions of two colours (`less`, `greater`, `at_most`, `at_least`); `both` of conditions, single or not."""

    @abstractmethod
    def select(self, condition: str, a: str, b: str) -> tuple[str, int]:
        """`a` where a condition holds, else `b`, and how strongly that binds."""

    @abstractmethod
    def select_channels(self, conditions: str, a: str, b: str) -> str:
        """The same choice for each channel of colours."""

    @abstractmethod
    def value(self, table: str, args: Sequence[str], wide: bool) -> str:
        """A table of a single channel, looked up at numbers, or for each channel of colours where it is `wide`."""

    @abstractmethod
    def film(self, table: str, args: Sequence[str]) -> str:
        """A table of thin films, looked up at one coordinate or two: a colour."""

    # Statements

    def title(self, text: str) -> str:
        """A comment over the statements that follow."""
        return f"// {text}"

    @abstractmethod
    def named(self, name: str, kind: Kind, text: str) -> str:
        """A value gets a name."""

    @abstractmethod
    def texels(self, name: str, table: str, count: int, args: Sequence[str], where: str = "") -> list[str]:
        """The channels of a table at a place get a name, as a number of texels; they are not read where a condition
        does not hold."""

    def all_of(self, conditions: Sequence[tuple[tuple[str, Kind], bool]]) -> str:
        """The condition that each one holds, or does not; of conditions of channels, any."""
        raise NotImplementedError

    def looked_up(self, name: str, kind: Kind, text: str, where: str) -> list[str]:
        """A look-up gets a name; it is not made where a condition does not hold."""
        raise NotImplementedError

    @abstractmethod
    def baked(self, name: str, group: Group, place: Sequence[str]) -> list[str]:
        """The texels of a group get a name, looked up in the texture of lobes at a place of three coordinates."""

    @abstractmethod
    def nodes(self, name: str, nodes: Sequence[float]) -> list[str]:
        """An array of constant numbers."""

    @abstractmethod
    def results(self, name: str, kind: Kind, count: int) -> list[str]:
        """An array that is filled later."""

    @abstractmethod
    def state(self, name: str, following: str, kind: Kind, begin: Sequence[str]) -> list[str]:
        """An array of values to begin with, and one of as many values that follow."""

    @abstractmethod
    def loop(self, index: str, times: int, lines: Sequence[str]) -> list[str]:
        """Statements, repeated for an index from 0 on."""

    def store(self, array: str, place: str, text: str) -> str:
        """A value is put into an array."""
        return f"{array}[{place}] = {text};"

    def put(self, place: str, text: str) -> str:
        """A value is put into its place in a struct."""
        return f"{place} = {text};"

    @abstractmethod
    def advance(self, name: str, following: str) -> str:
        """An array takes the values of another."""


class Printer(Language):
    """A shader language in which programs have the same parts as in GLSL."""

    @abstractmethod
    def header(self, name: str, model: str, fixed: bool, costs: Mapping[str, Cost]) -> str:
        """Comments that describe the material, whose values may be `fixed`, how the code is called and what each
        function costs, and the required first lines."""

    @abstractmethod
    def structs(self, structs: Sequence[Struct]) -> str:
        """Declarations of structs, each before those that contain it."""

    @abstractmethod
    def parameters(self, arrays: Sequence[tuple[str, str, int]]) -> str:
        """The uniforms that change: a material, and arrays by kind, name and length: weights of lobes, and where it is
        solved colours of its remainders, and numbers of its layout."""

    @abstractmethod
    def material(self, filled: Filled) -> str:
        """`vt_material`, which gives the values at texture coordinates, and the textures that it reads."""

    @abstractmethod
    def tables(self, layouts: Sequence[TableLayout]) -> str:
        """The texture of tables, and functions that look up each of them in it."""

    @abstractmethod
    def baked_texture(self, width: int, height: int) -> str:
        """The texture of lobes over direction."""

    @abstractmethod
    def lookup(self, bake: LookUp, first: int) -> str:
        """Functions that look up each group of texels of lobes, from a line of their texture on."""

    @abstractmethod
    def films(self, layouts: Sequence[TableLayout]) -> str:
        """The texture of tables of thin films, and functions that look up each of them in it."""

    @abstractmethod
    def helpers(self, called: Set[tuple[str, Kind]]) -> str:
        """Functions that statements call: for operations, with the kinds of their results."""

    @abstractmethod
    def lobes(self, outputs: Mapping[str, Output]) -> str:
        """`vt_lobes(m, wi)`, which fills the struct; outputs by their place in it."""

    @abstractmethod
    def energies(self, found: Sequence[Output]) -> str:
        """`vt_energies(m, wi)`, of the parts of a solved material."""

    @abstractmethod
    def eval_pdf(self, value: Output, density: Output) -> str:
        """`vt_eval_pdf(m, l, wi, wo)`, with `vt_eval` and `vt_pdf`."""

    @abstractmethod
    def sample(self, drawn: Sequence[Output]) -> str:
        """`vt_sample(m, l, wi, u)`, of the three coordinates of a direction."""

    @abstractmethod
    def mixture(self, members: Sequence[Member]) -> str:
        """The same functions of stacks side by side, by those of each: `vt_lobes` with all shares, `vt_eval_pdf` as
        their weighted sum, and `vt_sample` of a part that the first random number chooses, which is then rescaled."""
