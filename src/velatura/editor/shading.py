"""A material as what the page draws it with: shader code, which few changes touch, and values, which most do."""

from __future__ import annotations

import functools
import os
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.model import Model
from velatura.shader import Shader, atlas, constant, shader
from velatura.stack import Stack, Varying, is_colour
from velatura.stack.schema import unknown
from velatura.tables import load

#: Plain values of the material that stands for all of its pattern; those of every other parameter are the default.
_STAND_INS = {"eta": 1.5, "k": 1.0, "alpha_u": 0.1, "alpha_v": 0.1}
_STRETCHED = {**_STAND_INS, "alpha_v": 0.2, "rotation": 30.0}


def shading(stack: Stack, model: Model, stretched: bool) -> dict[str, Any]:
    """The code for a stack, its key, and the values that go in; equal keys mean equal code.

    Args:
        stretched: whether any interface has a roughness for each axis, though the two may be equal now. Apart from that
            no change of a plain value changes the code, be it to equal roughnesses or to no rotation.

    Raises:
        InvalidInput: a stack without an interface, or a model, that there is no shader for.
    """
    made = _made(pattern(stack, stretched), model)
    values = {name: value for name, value in stack.flat().items() if name in made.uniforms}
    free = {name: value for name, value in values.items() if not isinstance(value, Varying)}
    return {
        "key": made.key,
        "text": made.text,
        "baked": made.baked and made.baked.to_dict(),
        "uniforms": {name: made.uniforms[name] for name in free},
        "tables": ",".join(made.looked_up) or None,
        "maps": [
            {"sampler": sampler, "texture": os.path.relpath(image.texture), "encoding": image.encoding}
            for sampler, image in made.maps.items()
        ],
        "lobes": [
            {"place": f"reflected[{k}]", "interface": layers[0], "layers": layers}
            for k, layers in enumerate(made.lobes)
        ],
        "shown": made.shown,
        "transmitted": stack.transmits,
        "base": stack.kinds[-1] == "diffuse",
        "thin": stack.thin,
        "values": {name: _plain(name, value) for name, value in free.items()},
    }


def pattern(stack: Stack, stretched: bool) -> Stack:
    """The stack that stands for all with the same code: of the same layers and textures, stretched or not."""
    values: dict[str, Any] = {"thin": stack.thin}
    stand_ins = _STRETCHED if stretched else _STAND_INS
    for name, value in stack.flat().items():
        key = name.partition("_")[2]
        if isinstance(value, Varying):
            values[name] = value
        elif key in stand_ins:
            values[name] = stand_ins[key]
    mirrors = {f"layer{i}_conductor": "mirror" for i, kind in enumerate(stack.kinds) if kind == "mirror"}
    return Stack.from_flat(stack.kinds, {**values, **mirrors})


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


def _plain(name: str, value: Any) -> float | list[float]:
    """A value as a uniform holds it: a number, or three for what may be a colour."""
    number = constant(name, value)
    return np.broadcast_to(number, 3).tolist() if is_colour(name) else float(number)
