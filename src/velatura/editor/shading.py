"""A material for drawing in the page: shader code, which few changes affect, and values, which most do."""

from __future__ import annotations

import functools
import os
from collections.abc import Hashable, Iterator, Sequence
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from velatura.editor.messages import array
from velatura.errors import InvalidInput
from velatura.model import Model
from velatura.shader import Shader, constant, shader
from velatura.shader.lookups import atlas, films
from velatura.shader.lookups.bake import LobeLookUp
from velatura.shader.part import PartCode
from velatura.stack import Address, Described, Mix, Stack, Varying
from velatura.stack.schema import unknown
from velatura.tables import load

if TYPE_CHECKING:  # it loads SciPy
    from velatura.shader.lookups.columns import SolvedContents, SolvedLookUp

#: Of an interface with a roughness for each axis, in the material that stands for all of its pattern.
_STRETCHED = {"alpha_v": 0.2, "rotation": 30.0}

#: A film in that material; and indices of interfaces that have any, of which no two neighbours have the same.
_FILM = {"eta": 1.4, "thickness_nm": 100.0}
_LOWEST, _STEP = 1.6, 0.1

SOLVED = 32  # solutions of stacks, of which a mixture has several, and a drag changes one

_LOCKS = [Lock() for _ in range(64)]


def _in_turn(*question: Hashable) -> Lock:
    """The lock of a question that is cached, so that one thread works it out and the others wait: a page that shows a
    material twice asks for it twice at once."""
    return _LOCKS[hash(question) % len(_LOCKS)]


def shading(material: Described, model: Model, stretched: Sequence[bool]) -> dict[str, Any]:
    """The code for a material, its key, and the values that go in; equal keys mean equal code. `closed_form` says that
    the model would have the material solved, and that code does not. `parts` are the stacks, one or those of a mixture,
    with how the names of their values begin, and where they lie in the structs of the code.

    Args:
        stretched: of each stack, whether any interface has a roughness for each axis, though the two may be equal now.
            Apart from that no change of a plain value changes the code, not even to equal roughnesses or to no
            rotation.

    Raises:
        InvalidInput: a stack without an interface, or a model, that there is no shader for.
    """
    kind = pattern(material, stretched)
    with _in_turn(kind, model):
        made = _made(kind, model)
    stacks = [stack for _, stack in material.leaves()]
    solvable = model.surrogate is not model
    lines = max(line + part.lines for part, line in zip(made.parts, made.lines))
    return {
        "key": made.key,
        "text": made.text,
        "texels": [lines, max(part.width for part in made.parts)],
        "uniforms": {address.name: made.uniforms[address.name] for address, _ in _free(material, made)},
        "tables": ",".join(made.looked_up) or None,
        "maps": [
            {
                "sampler": sampler,
                "texture": os.path.relpath(image.texture),
                "encoding": image.encoding,
                **({"curve": image.curve} if image.curve else {}),
            }
            for sampler, image in made.maps.items()
        ],
        "parts": [_part(*each) for each in zip(made.parts, made.lines, stacks)],
        "closed_form": solvable
        and any(stack.interfaces and _solved(part) is None for part, stack in zip(made.parts, stacks)),
        **_contents(material, kind, model),
    }


def _part(part: PartCode, line: int, stack: Stack) -> dict[str, Any]:
    """A stack of the code: `line` is the first of its lobes over direction, each of so many `columns`, which `baked`
    works out, or a solution has; its share and the members of its lobes are fields of the struct of lobes."""
    recording, within = part.recording, f"{part.member}." if part.parts else ""
    baked = recording.baked
    return {
        "prefix": part.prefix,
        "place": within,
        "share": f"{part.member}_share" if part.parts else None,
        "line": line,
        "columns": part.width,
        "baked": baked.to_dict() if isinstance(baked, LobeLookUp) else None,
        "solved": _solved(part) is not None,
        "lobes": [
            {"place": f"reflected[{k}]", "interface": layers[0], "layers": layers}
            for k, layers in enumerate(part.interfaces)
        ],
        "shown": recording.shown,
        "shares": recording.shares,
        "transmitted": stack.transmits,
        "base": stack.base is not None,
        "thin": stack.thin,
    }


def in_closed_form(stack: Stack, model: Model, stretched: bool) -> dict[str, Any]:
    """The `shading` for all values, of the model's form without a solution."""
    made = shading(stack, model.surrogate, [stretched])
    return {**made, "closed_form": bool(stack.interfaces) and model.surrogate is not model}


def contents(material: Described, model: Model, stretched: Sequence[bool], coarse: bool) -> dict[str, Any]:
    """The values alone, for the code of `shading`, and where stacks are solved the `solution` of each, by names that
    begin as its values do; a `coarse` one has fewer directions, for what moves."""
    return _contents(material, pattern(material, stretched), model, coarse)


def _contents(material: Described, pattern: Described, model: Model, coarse: bool = False) -> dict[str, Any]:
    made, coated, solution = _made(pattern, model), dict[str, np.ndarray](), dict[str, np.ndarray]()
    for number, (part, (_, stack)) in enumerate(zip(made.parts, material.leaves())):
        tables = films.tables(stack, part.recording.films, model, coarse)
        coated |= {part.prefix + name: table for name, table in tables.items()}
        if _solved(part):
            with _in_turn(pattern, model, number, stack, coarse):
                found = _solution(pattern, model, number, stack, coarse)
            solution |= {part.prefix + name: x for name, x in vars(found).items()}
    return {
        "values": {address.name: _plain(address, value) for address, value in _free(material, made)},
        "films": {name: array(table) for name, table in sorted(coated.items())} or None,
        "solution": {name: array(x) for name, x in solution.items()} or None,
    }


def _solved(part: PartCode) -> SolvedLookUp | None:
    """The look-up of a stack that is solved, else None."""
    from velatura.shader.lookups.columns import SolvedLookUp  # it loads SciPy

    baked = part.recording.baked
    return baked if isinstance(baked, SolvedLookUp) else None


@functools.lru_cache(SOLVED)
def _solution(pattern: Described, model: Model, number: int, stack: Stack, coarse: bool) -> SolvedContents:
    """The solution of a stack, that of a number in a material of the pattern."""
    tabulated = _solved(_made(pattern, model).parts[number])
    assert tabulated
    return tabulated.solve(stack, coarse)


def solved_look_up(stack: Stack, model: Model) -> SolvedLookUp | None:
    """The look-up of the code that `shading` makes of a stack, where it is solved."""
    stretched = any(isinstance(layer.alpha, tuple) for layer in stack.interfaces)
    return _solved(_made(pattern(stack, [stretched]), model).parts[0])


def _free(material: Described, made: Shader) -> list[tuple[Address, Any]]:
    return [(at, x) for at, x in material.values() if at.name in made.uniforms and not isinstance(x, Varying)]


def pattern(material: Described, stretched: Sequence[bool]) -> Described:
    """The material that stands for all with the same code: of stacks with the same layers and textures, stretched or
    not, with the same textures as weights."""
    return _pattern(material, iter(stretched))


def _pattern(material: Described, stretched: Iterator[bool]) -> Described:
    if isinstance(material, Stack):
        return _of_stack(material, next(stretched))
    *parts, last = ((part.weight, _pattern(part.material, stretched)) for part in material.mix)
    shares = [(weight if isinstance(weight, Varying) else 0.0, each) for weight, each in parts]
    return Mix([*shares, (None, last[1])])


def _of_stack(stack: Stack, stretched: bool) -> Stack:
    values: dict[str, Any] = {"thin": stack.thin}
    for address, value in stack.values():
        if address.film is not None:
            continue
        if isinstance(value, Varying):
            values[address.name] = value
        elif stretched and address.key in _STRETCHED:
            values[address.name] = _STRETCHED[address.key]
        elif address.declared.typical is not None:
            values[address.name] = address.declared.typical
    for k, coated in enumerate(films.coated_layers(stack)):
        if coated:
            film: dict[str, Any] = {**_FILM, "k": 0.1} if coated.absorbs else {**_FILM}
            if coated.axis:
                film["thickness_nm"] = stack.flat()[f"layer{k}_film{coated.axis.film}_thickness_nm"]
            values |= {f"layer{k}_film0_{key}": value for key, value in film.items()}
            values[f"layer{k}_eta"] = _LOWEST + k * _STEP
    return Stack.from_flat(stack.kinds, values)


@functools.lru_cache(64)
def _made(material: Described, model: Model) -> Shader:
    return shader(material, model, values="uniforms")


def tables(key: str) -> np.ndarray:
    """The texture of tables, float32 of shape (height, width, 4), that a shader was given the key of: their names.

    Raises:
        InvalidInput: no table has one of the names.
    """
    names, known = key.split(","), dict(load().items())
    for name in names:
        if name not in known:
            raise InvalidInput(unknown("table", name, known))
    return atlas.texture(names)


def _plain(address: Address, value: Any) -> float | list[float]:
    """A value for a uniform: a number, or three for a possible colour."""
    number = constant(address, value)
    return np.broadcast_to(number, 3).tolist() if address.colour else float(number)
