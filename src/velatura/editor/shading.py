"""A material for drawing in the page: shader code, which few changes affect, and values, which most do."""

from __future__ import annotations

import functools
import os
from typing import TYPE_CHECKING, Any

import numpy as np

from velatura.editor.messages import array
from velatura.errors import InvalidInput
from velatura.model import Model
from velatura.shader import Shader, constant, shader
from velatura.shader.lookups import atlas, films
from velatura.shader.lookups.bake import LobeLookUp
from velatura.stack import Address, Stack, Varying
from velatura.stack.schema import unknown
from velatura.tables import load

if TYPE_CHECKING:  # it loads SciPy
    from velatura.shader.lookups.columns import SolvedLookUp

#: Of an interface with a roughness for each axis, in the material that stands for all of its pattern.
_STRETCHED = {"alpha_v": 0.2, "rotation": 30.0}

#: A film in that material; and indices of interfaces that have any, of which no two neighbours have the same.
_FILM = {"eta": 1.4, "thickness_nm": 100.0}
_LOWEST, _STEP = 1.6, 0.1

KEPT = 4  # shaders


def shading(stack: Stack, model: Model, stretched: bool) -> dict[str, Any]:
    """The code for a stack, its key, and the values that go in; equal keys mean equal code. `closed_form` says that the
    model would have the material solved, and that code does not.

    Args:
        stretched: whether any interface has a roughness for each axis, though the two may be equal now. Apart from that
            no change of a plain value changes the code, not even to equal roughnesses or to no rotation.

    Raises:
        InvalidInput: a stack without an interface, or a model, that there is no shader for.
    """
    made = _made(pattern(stack, stretched), model)
    return {
        "key": made.key,
        "text": made.text,
        "baked": made.baked.to_dict() if isinstance(made.baked, LobeLookUp) else None,
        "uniforms": {address.name: made.uniforms[address.name] for address, _ in _free(stack, made)},
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
        "lobes": [
            {"place": f"reflected[{k}]", "interface": layers[0], "layers": layers}
            for k, layers in enumerate(made.lobes)
        ],
        "shown": made.shown,
        "shares": made.shares,
        "transmitted": stack.transmits,
        "base": stack.base is not None,
        "thin": stack.thin,
        "closed_form": bool(stack.interfaces) and model.surrogate is not model and _tabulated(made) is None,
        **_contents(stack, made, model),
    }


def in_closed_form(stack: Stack, model: Model, stretched: bool) -> dict[str, Any]:
    """The `shading` for all values, of the model's form without a solution."""
    made = shading(stack, model.surrogate, stretched)
    return {**made, "closed_form": bool(stack.interfaces) and model.surrogate is not model}


def contents(stack: Stack, model: Model, stretched: bool, coarse: bool) -> dict[str, Any]:
    """The values alone, for the code of `shading`, and where a material is solved its `solution`; a `coarse` one has
    fewer directions, for what moves."""
    return _contents(stack, _made(pattern(stack, stretched), model), model, coarse)


def _contents(stack: Stack, made: Shader, model: Model, coarse: bool = False) -> dict[str, Any]:
    coated = films.tables(stack, made.film_tables, model, coarse)
    given = {
        "values": {address.name: _plain(address, value) for address, value in _free(stack, made)},
        "films": {name: array(table) for name, table in coated.items()} or None,
    }
    tabulated = _tabulated(made)
    if tabulated is None:
        return {**given, "solution": None}
    found = tabulated.solve(stack, coarse)
    return {**given, "solution": {name: array(x) for name, x in vars(found).items()}}


def _tabulated(made: Shader) -> SolvedLookUp | None:
    """The look-up of a material that is solved, else None."""
    from velatura.shader.lookups.columns import SolvedLookUp  # it loads SciPy

    return made.baked if isinstance(made.baked, SolvedLookUp) else None


def _free(stack: Stack, made: Shader) -> list[tuple[Address, Any]]:
    return [(at, value) for at, value in stack.values() if at.name in made.uniforms and not isinstance(value, Varying)]


def pattern(stack: Stack, stretched: bool) -> Stack:
    """The stack that stands for all with the same code: of the same layers and textures, stretched or not."""
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
def _made(stack: Stack, model: Model) -> Shader:
    return shader(stack, model, values="uniforms")


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
