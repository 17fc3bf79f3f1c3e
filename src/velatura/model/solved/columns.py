"""Columns over direction of a solved material, declared once: their order, their kinds and their rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from itertools import accumulate

from velatura.model.solved.lobes import wide
from velatura.model.solved.transmission.combined import Parts
from velatura.ops import Value

WIDE_SIDES = "wide_reflected", "wide_passed"


@dataclass(frozen=True)
class Column:
    """A number over direction, or a `colour`. Those of an `energy` are read seldom: albedos, and samples of some parts
    alone, need them."""

    name: str
    colour: bool = False
    energy: bool = False

    def rows(self, colours: int) -> int:
        """How many rows it has, for so many channels of a colour."""
        return colours if self.colour else 1


@dataclass(frozen=True)
class Declaration:
    """The columns of a side with so many lobes, of roughnesses of so many entries, and with what passes, a medium on
    top, and light that is too wide for lobes, or without.

    They are in the order in which they are read, those of densities first. The chance of the remainder is what others
    leave.
    """

    lobes: int
    entries: int
    passes: bool
    top: bool = False
    wide: bool = False

    @property
    def columns(self) -> tuple[Column, ...]:
        return _columns(self)

    def _listed(self) -> list[Column]:
        found = [*[Column("roughness")] * self.entries, Column("chance")] * self.lobes
        found += [Column("weight", colour=True)] * self.lobes + [Column("scale", colour=True)]
        found += [Column("energy", colour=True, energy=True)] * self.lobes + [Column("rest", colour=True, energy=True)]
        if self.passes:
            found += [Column(f"passed_{name}", colour=name in Parts.COLOURS) for name in self.parts]
            found.append(Column("passed", colour=True, energy=True))
        found += [Column("of_top")] if self.top else []
        found += [Column("narrow")] if self.wide else []
        for name in WIDE_SIDES if self.wide else ():
            found += [Column(f"{name}_energy", colour=True), *[Column(name)] * wide.COUNT]
        return found

    @property
    def parts(self) -> list[str]:
        """Names of the columns of `Parts`."""
        return [part.name for part in fields(Parts) if self.wide or part.name not in Parts.OF_WIDE]

    def groups(self, colours: int) -> list[int]:
        """Which rows are read together: 1 for those that are read seldom."""
        return [int(column.energy) for column in self.columns for _ in range(column.rows(colours))]

    def first_rows(self, name: str, colours: int) -> Sequence[int]:
        """The first row of each column of a name."""
        return _first_rows(self, colours).get(name, ())

    def rows(self, chosen: Iterable[int], colours: int) -> list[int]:
        """All rows of columns of some numbers."""
        begins = _begins(self, colours)
        return [row for k in chosen for row in range(begins[k], begins[k + 1])]

    def part(self, k: int) -> list[int]:
        """Numbers of the columns that make the reflected part of number k: weight and roughness, or of the last one,
        the remainder, scale and the share of a medium on top, if there is one; and after these what is wide."""
        each, wide_light = self.entries + 1, self._named("narrow")
        if k < self.lobes:
            return [each * self.lobes + k, *range(k * each, k * each + self.entries), *wide_light]
        return [each * self.lobes + k, *self._named("of_top"), *wide_light, *self._named("wide_reflected")]

    @property
    def through(self) -> list[int]:
        """Numbers of the columns that make what passes."""
        return [*self._named("passed_"), *self._named("wide_passed")]

    def _named(self, begin: str) -> list[int]:
        return [k for k, column in enumerate(self.columns) if column.name.startswith(begin)]

    def proportions(self, colours: int) -> list[tuple[int, list[int]]]:
        """The first rows of each energy, and of all else that is in proportion to it."""

        def rows(*names: str) -> list[int]:
            return [row for name in names for row in self.first_rows(name, colours)]

        found = [(energy, [weight]) for energy, weight in zip(rows("energy"), rows("weight"))]
        found += [(row, rows("scale", "wide_reflected_energy")) for row in rows("rest")]
        passed = rows(*(f"passed_{part}" for part in Parts.COLOURS), "wide_passed_energy")
        return found + [(row, passed) for row in rows("passed")]

    def chances(self, colours: int) -> list[int]:
        """Rows of shares of samples, without that of the remainder."""
        names = "chance", *(f"passed_{part}" for part in Parts.CHANCES)
        return [row for name in names for row in self.first_rows(name, colours)]

    def read(self, values: Iterable[Value]) -> Columns:
        """Columns by their values in this order."""
        by_name: dict[str, list[Value]] = {}
        for column, value in zip(self.columns, values):
            by_name.setdefault(column.name, []).append(value)
        weights, energies, chances = (by_name.get(name, []) for name in ("weight", "energy", "chance"))
        numbers = by_name.get("roughness", [])
        roughness = [tuple(numbers[k : k + self.entries]) for k in range(0, len(numbers), self.entries)]
        chance, passes, passed = 1 - sum(chances), None, None
        if self.passes:
            passes = Parts(*(by_name[f"passed_{name}"][0] for name in self.parts))
            passed, chance = by_name["passed"][0], chance - passes.share
        (scale,), (rest,) = by_name["scale"], by_name["rest"]
        of_top = by_name["of_top"][0] if self.top else None
        reflecting, passing = ([*by_name.get(f"{name}_energy", []), *by_name.get(name, [])] for name in WIDE_SIDES)
        narrow = by_name.get("narrow", [1.0])[0]
        reflected = weights, roughness, chances, energies, scale, chance, rest
        return Columns(*reflected, passes, passed, of_top, narrow, reflecting, passing)


# Materials of one kind ask for the same ones at each change of a value


@lru_cache(maxsize=256)
def _columns(declaration: Declaration) -> tuple[Column, ...]:
    return tuple(declaration._listed())


@lru_cache(maxsize=256)
def _begins(declaration: Declaration, colours: int) -> tuple[int, ...]:
    """The first row of each column, and after them the number of all rows."""
    return tuple(accumulate((column.rows(colours) for column in declaration.columns), initial=0))


@lru_cache(maxsize=256)
def _first_rows(declaration: Declaration, colours: int) -> dict[str, list[int]]:
    """Those of the columns of each name, not to be written to."""
    found: dict[str, list[int]] = {}
    for column, begin in zip(declaration.columns, _begins(declaration, colours)):
        found.setdefault(column.name, []).append(begin)
    return found


@dataclass(frozen=True)
class Columns:
    """One direction's values, or arrays (C, M) and (M,) over directions.

    `weights`, `roughness`, `chances` and `energies` are those of lobes; of the remainder `scale`, `chance` and `rest`.
    `of_top` is the share of its samples that a medium on top has, None without one.

    Of light that may be too wide for lobes these are the columns of lobes alone. Of what is reflected other lobes than
    those of the first interface, and the remainder, keep a share `narrow`, and of what passes `passes.narrow`; all else
    is `wide_reflected`, which is of the remainder, and `wide_passed`: an energy, a colour, and numbers of
    `velatura.model.solved.lobes.wide`, or nothing. So each of them varies evenly between materials.
    """

    weights: list[Value]
    roughness: list[tuple[Value, ...]]
    chances: list[Value]
    energies: list[Value]
    scale: Value
    chance: Value
    rest: Value
    passes: Parts | None
    passed: Value | None
    of_top: Value | None = None
    narrow: Value = 1.0
    wide_reflected: list[Value] = field(default_factory=list)
    wide_passed: list[Value] = field(default_factory=list)

    def narrowed(self, inner: Sequence[bool]) -> Columns:
        """The columns where each part has its share; `inner` says of each lobe whether it is of another interface than
        the first."""
        weights, energies = (
            [self.narrow * x if each else x for each, x in zip(inner, values)]
            for values in (self.weights, self.energies)
        )
        handed = sum(energy for each, energy in zip(inner, self.energies) if each)
        return replace(
            self,
            weights=weights,
            energies=energies,
            scale=self.narrow * self.scale,
            rest=self.rest + (1 - self.narrow) * handed,
            passes=self.passes and self.passes.narrowed(),
            wide_reflected=_scaled(1 - self.narrow, self.wide_reflected),
            wide_passed=_scaled(1 - self.passes.narrow, self.wide_passed) if self.passes else [],
        )

    @property
    def declaration(self) -> Declaration:
        entries = len(self.roughness[0]) if self.roughness else 0
        passes, top = self.passes is not None, self.of_top is not None
        return Declaration(len(self.weights), entries, passes, top, bool(self.wide_passed))

    @property
    def all(self) -> list[Value]:
        """Values in the order of the declaration."""
        found = [x for roughness, chance in zip(self.roughness, self.chances) for x in (*roughness, chance)]
        found += [*self.weights, self.scale, *self.energies, self.rest]
        if self.passes:
            found += [*(getattr(self.passes, name) for name in self.declaration.parts), self.passed]
        found += [] if self.of_top is None else [self.of_top]
        found += [self.narrow] if self.wide_passed else []
        return [*found, *self.wide_reflected, *self.wide_passed]


def _scaled(factor: Value, light: Sequence[Value]) -> list[Value]:
    """An energy times a factor, and its numbers."""
    return [*(factor * energy for energy in light[:1]), *light[1:]]
