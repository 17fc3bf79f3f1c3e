"""The model's own functions, recorded for the layers of a stack."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain, count
from typing import TypeGuard

from velatura import ops
from velatura.errors import InvalidInput
from velatura.films.of_material import films_of
from velatura.model import DEFAULT, Model, named, variance_kind
from velatura.model.context import at_a_point
from velatura.model.papers import bsdf
from velatura.model.variance import Covariance, Isotropic, PerAxis, Variance
from velatura.ops import Value
from velatura.shader import material
from velatura.shader.lookups import films
from velatura.shader.lookups.bake import bake, bake_known
from velatura.shader.lookups.lookup import LookUp
from velatura.shader.recorder import symbol
from velatura.shader.recorder.graph import Graph, known_before
from velatura.shader.recorder.seen import Seen, of_lobes
from velatura.shader.recorder.symbol import Kind, Operand, Symbol, in_order
from velatura.shader.recorder.tape import Tape
from velatura.stack import Address, Described, Diffuse, Material, Stack, Varying, as_described
from velatura.stack.schema import unknown

LATER = ("wo.", "u.")  # inputs that are known after wi
LEAST = 4  # operations for which a value that is known once wi is has a place of its own


@dataclass(frozen=True)
class Recording:
    """The model's computation for a stack: `lobes`, and all else that is known once wi is, from material and wi; the
    rest from these, wo, and random numbers u.

    Inputs are named as in the shader: `m.layer0.eta`, `wi.x`, `l.reflected[0].energy`, ... `baked` is the texture that
    lobes are read from, if they are not added up; `shown`, `shares` and `energies` are those of `Seen`.
    """

    stack: Stack
    model: Model
    baked: LookUp | None
    shown: Sequence[str]
    shares: Sequence[str]
    kinds: Mapping[str, Kind]
    lobes: Mapping[str, Operand]
    energies: Sequence[Operand]
    value: Operand
    density: Operand
    drawn: Sequence[Operand]

    @cached_property
    def symbols(self) -> list[Symbol]:
        """All computed values, and all inputs."""
        return in_order([*self.lobes.values(), *self.energies, self.value, self.density, *self.drawn])

    @cached_property
    def read(self) -> dict[str, str]:
        """The values of the material that the code reads, by flat name, and their place in the struct."""
        return self._places({s.detail for s in self.symbols if s.op == "input"})

    @property
    def films(self) -> set[str]:
        """The tables of films that the code looks up, or a tape does."""
        return films.read_by(self.symbols).union(self._tape.films if self._tape else ())

    @property
    def parameters(self) -> dict[str, str]:
        """Values that anything reads: a tape, which stands for the code that works out the lobes, reads others."""
        return {**self._places(self._tape.inputs if self._tape else ()), **self.read}

    @property
    def _tape(self) -> Tape | None:
        return self.baked.tape if self.baked else None

    def _places(self, inputs: Collection[str]) -> dict[str, str]:
        places = {address.name: material.place(address) for address, _ in self.stack.values()}
        return {name: place for name, place in places.items() if f"m.{place}" in inputs}


def record(
    stack: Stack,
    model: str | Model = DEFAULT,
    constant: Collection[str] = (),
    parameters: bool = False,
    baking: bool = False,
    **switches: str,
) -> Recording:
    """The model's functions for a stack; the values named `constant` as they are, all others as inputs.

    With `parameters`, for a program whose user changes values and looks at single lobes: as general as the `structure`
    of the stack, with a weight for every lobe, and, without textures, with lobes that are read. With `baking`,
    lobes are read of any model, and all values are as they are.

    Raises:
        InvalidInput: an unknown model or switch; a constant that the stack does not have, or that is a texture;
            `baking` values that vary.
    """
    chosen, flat = drawn_by(stack, named(model, **switches)), stack.flat()
    check_constant(stack, constant)
    wi, wo, u = direction("wi"), direction("wo"), direction("u")

    # Run the model
    uniform = is_uniform(stack)
    if baking and not uniform:
        raise InvalidInput("baked: only for materials without textures, since lobes are those of one point")
    solved = not chosen.closed_form
    fixed = (solved or baking) and not parameters
    constants = flat if fixed else {*constant, *([] if parameters else films.beside(stack))}
    recorded = films.recorded(symbols(stack, constants), stack, parameters)
    kind = structure(stack) if parameters else variance(stack)
    prepared = partial(bsdf.body, recorded, chosen, kind, at_a_point())
    baked: LookUp | None = None
    if solved:
        from velatura.shader.lookups.columns import tabulated

        baked = tabulated(stack, recorded, chosen, kind, general=parameters)
    elif uniform and parameters:
        baked = bake(recorded, prepared())
    elif baking and stack.interfaces:
        numbers = Material.of(stack)
        numbers = numbers.coated(films_of(numbers))
        baked = bake_known(prepared(), bsdf.body(numbers, chosen, kind, at_a_point()))
    with ops.readable():
        seen = baked.seen(wi, parameters) if baked else of_lobes(prepared(), wi, parameters, added=True)
        value, density = seen.body.eval_pdf(wi, wo)
        drawn, _ = seen.body.sample(wi, *u)
    return _recorded(stack, chosen, baked, seen, [value, density, *drawn])


def _recorded(stack: Stack, model: Model, baked: LookUp | None, seen: Seen, others: Sequence[Value]) -> Recording:
    """The recording of what is seen, and of value, density and sample, which read the values that the lobes hold."""
    graph, kinds = Graph(), seen.kinds()
    every = iter(graph.unique([*seen.fields.values(), *others]))
    lobes = {name: next(every) for name in seen.fields}
    held = {x: _held(name, kinds[name], x) for name, x in reversed(lobes.items()) if _worth(x)}
    others = list(every)
    for x in known_before(others, held, LATER, LEAST):
        name = next(name for name in _names(x) if name not in kinds)
        kinds[name], lobes[name], held[x] = x.kind, x, _held(name, x.kind, x)
    value, density, *drawn = Graph(held).unique(others)
    energies = Graph().unique(seen.energies)
    return Recording(stack, model, baked, seen.shown, seen.shares, kinds, lobes, energies, value, density, drawn)


def drawn_by(stack: Stack, model: Model) -> Model:
    """The model that a shader of a stack computes: in closed form where it is worked out at every point.

    Raises:
        InvalidInput: it has a lobe for each colour.
    """
    if model.channels == "separate":
        raise InvalidInput("channels=separate: only for lobes and inverse, since a shader has one lobe for all colours")
    # In closed form a diffuse base alone is Lambert's law
    return model if is_uniform(stack) and not isinstance(stack.layers[0], Diffuse) else model.surrogate


def is_uniform(stack: Described) -> bool:
    """Whether no value differs from point to point."""
    return not any(isinstance(value, Varying) for value in stack.flat().values())


def check_constant(stack: Described, constant: Collection[str]) -> None:
    """Refuse names of constants that the material does not have."""
    flat = stack.flat()
    for name in constant:
        if name not in flat:
            raise InvalidInput(f"constant: {unknown('parameter', name, flat)}")


def symbols(stack: Stack, constants: Collection[str]) -> Material:
    """A stack with inputs as its values, but for the `constants`."""
    return Material.of(stack, lambda at, x: material.constant(at, x) if at.name in constants else _input(at))


def _names(x: Symbol) -> Iterator[str]:
    """Names for a value that is known once wi is."""
    name = f"wi_{x.name.strip('_') or 'value'}"
    return chain([name], (f"{name}_{n}" for n in count(2)))


def _worth(x: Operand) -> TypeGuard[Symbol]:
    """Whether to store a value: neither a constant nor an input."""
    return isinstance(x, Symbol) and x.op != "input"


def _held(name: str, kind: Kind, value: Symbol) -> Symbol:
    """A value that the struct of the lobes holds, where a number may stand for a colour."""
    return Symbol("input", (), value.kind, f"l.{name}" if value.kind == kind else f"l.{name}.r")


def direction(name: str) -> tuple[Symbol, Symbol, Symbol]:
    """A direction as inputs."""
    return symbol.number(f"{name}.x"), symbol.number(f"{name}.y"), symbol.number(f"{name}.z")


def _input(address: Address) -> Symbol:
    place = f"m.{material.place(address)}"
    return symbol.colour(place) if address.colour else symbol.number(place)


def variance(stack: Stack) -> type[Variance]:
    """The kind of variance that the shader of a stack computes with."""
    return variance_kind(Material.of(stack, as_described))


def structure(stack: Stack) -> type[Variance]:
    """The kind of variance that holds a stack for any plain values: as general as its interfaces are written,
    with a pair of roughnesses or one, with a rotation or without. (Two that are equal are read as one.)
    """
    pairs = [layer for layer in stack.interfaces if isinstance(layer.alpha, tuple)]
    if not pairs:
        return Isotropic
    return Covariance if any("rotation" in layer.model_fields_set for layer in pairs) else PerAxis
